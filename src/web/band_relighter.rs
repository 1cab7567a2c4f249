//! Relighting in a worker: tiles and light in, pixels out, and no canvas.

use std::ops::Range;

use js_sys::Uint8Array;
use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Display, Photo};
use crate::relight::{Light, cpu};
use crate::transport::Extent;
use crate::workers::OneThread;

/// Relights some rows of a photograph on the CPU. Only their tiles need be there.
#[wasm_bindgen]
pub struct BandRelighter {
    relighter: cpu::Relighter,
    rows: Range<u32>,
}

#[wasm_bindgen]
impl BandRelighter {
    /// Plans the work for `rows` rows of the picture from `first` on. The photograph keeps its tiles
    /// until this is freed.
    #[wasm_bindgen(constructor)]
    pub fn new(photo: &Photo, first: u32, rows: u32) -> Result<Self, CodedError> {
        let height = photo.geometry().camera.height;
        let end = first.checked_add(rows).filter(|end| *end <= height);
        let end = end.ok_or_else(|| CodedError::new("internal", "rows outside the picture"))?;
        Ok(Self {
            relighter: cpu::Relighter::new(photo.transport()),
            rows: first..end,
        })
    }

    /// The first row of the light that is seen, and the first after it that is not.
    #[wasm_bindgen(getter, js_name = lightRows)]
    pub fn light_rows(&self) -> Vec<u32> {
        let Range { start, end } = self.relighter.light_rows();
        vec![start, end]
    }

    /// The picture's rows under a light, of which `light` has linear RGB values of the
    /// [`lightRows`](Self::light_rows), by a share of the components, into `out`: RGBA, row by row.
    pub fn relight(
        &mut self,
        light: &[f32],
        display: &Display,
        detail: f64,
        out: &Uint8Array,
    ) -> Result<(), CodedError> {
        let geometry = self.relighter.transport().geometry;
        let pixels = self.rows.len() * geometry.camera.width as usize;
        if out.length() as usize != 4 * pixels {
            return Err(CodedError::new("internal", "room for other rows"));
        }
        let seen = self.relighter.light_rows();
        let extent = Extent {
            width: geometry.light.width,
            height: seen.len() as u32,
        };
        let light = Light::from_linear_rgb(extent, light)?;
        self.relighter.set_detail(detail as f32);
        self.relighter.relight_from(seen.start, &light, &OneThread);
        // So that its memory serves for the pixels.
        drop(light);
        let mut picture = vec![[0; 4]; pixels];
        let rows = self.rows.clone();
        self.relighter
            .show(&display.inner(), rows, &mut picture, &OneThread);
        out.copy_from(picture.as_flattened());
        Ok(())
    }
}

/// What relights on the CPU: `simd128` or `scalar`.
#[wasm_bindgen(js_name = cpuKernel)]
pub fn cpu_kernel() -> String {
    cpu::KERNEL.into()
}
