//! Relighting in a worker: tiles and light in, pixels out, and no canvas.

use std::ops::Range;

use js_sys::{Float32Array, Uint8Array};
use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Display, Photo};
use crate::executor::SequentialExecutor;
use crate::relight::cpu;
use crate::transport::CHANNELS;

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
    /// [`lightRows`](Self::light_rows), or under the last one, by a share of the components, into `out`:
    /// RGBA, row by row. Both stay where they are but for a few rows: this memory never shrinks.
    pub fn relight(
        &mut self,
        light: Option<Float32Array>,
        display: &Display,
        detail: f64,
        out: &Uint8Array,
    ) -> Result<(), CodedError> {
        let geometry = self.relighter.transport().geometry;
        let width = geometry.camera.width;
        if u64::from(out.length()) != 4 * self.rows.len() as u64 * u64::from(width) {
            return Err(CodedError::new("internal", "room for other rows"));
        }
        self.relighter.set_detail(detail as f32);
        match light {
            Some(values) => {
                let seen = self.relighter.light_rows();
                let width = geometry.light.width as usize;
                if values.length() as usize != CHANNELS * width * seen.len() {
                    return Err(CodedError::new("internal", "other rows of the light"));
                }
                let rows = ValueRows {
                    values,
                    first: seen.start,
                    linear: vec![[0.0; CHANNELS]; width],
                    row: vec![[0.0; 4]; width],
                };
                self.relighter.relight_rows(rows, &SequentialExecutor);
            }
            None => self.relighter.update(&SequentialExecutor),
        }
        let display = display.inner();
        let mut picture = vec![[0; 4]; cpu::BAND_ROWS.min(self.rows.len()) * width as usize];
        for first in self.rows.clone().step_by(cpu::BAND_ROWS) {
            let rows = first..self.rows.end.min(first + cpu::BAND_ROWS as u32);
            let pixels = &mut picture[..rows.len() * width as usize];
            self.relighter
                .show(&display, rows.clone(), pixels, &SequentialExecutor);
            let [start, end] =
                [rows.start, rows.end].map(|row| 4 * (row - self.rows.start) * width);
            out.subarray(start, end).copy_from(pixels.as_flattened());
        }
        Ok(())
    }
}

/// A light's rows that a script has.
struct ValueRows {
    /// Linear RGB.
    values: Float32Array,
    /// The row that they begin with.
    first: u32,
    linear: Vec<[f32; CHANNELS]>,
    row: Vec<[f32; 4]>,
}

impl cpu::LightRows for ValueRows {
    fn row(&mut self, v: u32) -> &[[f32; 4]] {
        let values = self.linear.as_flattened_mut();
        let length = values.len() as u32;
        let start = (v - self.first) * length;
        self.values.subarray(start, start + length).copy_to(values);
        for (element, [r, g, b]) in self.row.iter_mut().zip(&self.linear) {
            *element = [*r, *g, *b, 0.0];
        }
        &self.row
    }
}

/// What relights on the CPU: `simd128` or `scalar`.
#[wasm_bindgen(js_name = cpuKernel)]
pub fn cpu_kernel() -> String {
    cpu::KERNEL.into()
}
