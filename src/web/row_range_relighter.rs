//! The CPU backend in a worker: takes tiles and a light, and gives pixels of a row range.

use std::ops::Range;

use js_sys::{Float32Array, Uint8Array};
use wasm_bindgen::prelude::wasm_bindgen;

use super::{CodedError, Photo, WebOutputTransform};
use crate::job_executor::SequentialExecutor;
use crate::relight::cpu::{self, EncodedRelighter, STRIP_ROWS};
use crate::transport::{CHANNELS, Extent, ShardOrigin, TileRect};

/// Relights a row range of a photograph. Only its tiles are needed.
#[wasm_bindgen]
pub struct RowRangeRelighter {
    relighter: EncodedRelighter,
    rows: Range<u32>,
}

#[wasm_bindgen]
impl RowRangeRelighter {
    /// For `rows` rows of the picture from `first` on. The photograph cannot give or take tiles until this is freed.
    ///
    /// # Errors
    /// Code `internal` if the rows lie outside the picture.
    #[wasm_bindgen(constructor)]
    pub fn new(photo: &Photo, first: u32, rows: u32) -> Result<Self, CodedError> {
        let height = photo.geometry().camera.height;
        let end = first.checked_add(rows).filter(|end| *end <= height);
        let end =
            end.ok_or_else(|| CodedError::internal("the row range lies outside the picture"))?;
        Ok(Self {
            relighter: EncodedRelighter::new(photo.transport()),
            rows: first..end,
        })
    }

    /// The rows of the light that are needed: the first, and one past the last.
    #[wasm_bindgen(getter, js_name = lightRows)]
    pub fn light_rows(&self) -> Vec<u32> {
        let Range { start, end } = self.relighter.light_rows();
        vec![start, end]
    }

    /// Sets the part of the picture that is in view, at first all: pixels `left..right` of rows `top..bottom`.
    ///
    /// # Errors
    /// Code `internal` if the part reaches beyond the picture.
    #[wasm_bindgen(js_name = setView)]
    pub fn set_view(
        &mut self,
        left: u32,
        top: u32,
        right: u32,
        bottom: u32,
    ) -> Result<(), CodedError> {
        let camera = self.relighter.transport().geometry.camera;
        if left > right || right > camera.width || top > bottom || bottom > camera.height {
            return Err(CodedError::internal("the view reaches beyond the picture"));
        }
        self.relighter.set_view(TileRect {
            x: left,
            y: top,
            extent: Extent::new(right - left, bottom - top),
        });
        Ok(())
    }

    /// Writes the row range under a light into `out`: RGBA, row by row. Rows out of view are not written. `light` has linear RGB
    /// of the [`lightRows`](Self::light_rows); without it, the last light stays. `quality` is the share of the components in
    /// use, 0 to 1. Both arrays are copied in strips: the module's memory never shrinks.
    ///
    /// # Errors
    /// Code `internal` if an array has another length.
    pub fn relight(
        &mut self,
        light: Option<Float32Array>,
        output: &WebOutputTransform,
        quality: f64,
        out: &Uint8Array,
    ) -> Result<(), CodedError> {
        let geometry = &self.relighter.transport().geometry;
        let (width, light_width) = (geometry.camera.width, geometry.light.width);
        if u64::from(out.length()) != 4 * self.rows.len() as u64 * u64::from(width) {
            return Err(CodedError::internal(
                "the output has not the row range's length",
            ));
        }
        self.relighter.set_quality(quality as f32);
        if let Some(values) = light {
            let light_rows = self.relighter.light_rows();
            let mut rgb = vec![[0.0; CHANNELS]; light_width as usize];
            let length = rgb.as_flattened().len() as u32;
            if u64::from(values.length()) != u64::from(length) * light_rows.len() as u64 {
                return Err(CodedError::internal(
                    "the light has not the length of its rows",
                ));
            }
            let mut row = Vec::with_capacity(rgb.len());
            for (i, v) in (0..).zip(light_rows) {
                let values = values.subarray(i * length, (i + 1) * length);
                values.copy_to(rgb.as_flattened_mut());
                row.clear();
                row.extend(rgb.iter().map(|[r, g, b]| [*r, *g, *b, 0.0]));
                self.relighter.set_light_row(v, &row);
            }
        }
        self.relighter.set_output(&output.0);
        self.relighter.update(&SequentialExecutor);
        // A view has a dozen shards, which are relit one after another.
        if self.relighter.transport().geometry.correspondence.origin != ShardOrigin::ZERO {
            self.relighter.release_scratch();
        }
        let TileRect { y, extent, .. } = self.relighter.view();
        let rows = self.rows.start.max(y)..self.rows.end.min(y + extent.height);
        let mut strip = vec![[0; 4]; STRIP_ROWS.min(rows.len()) * width as usize];
        for first in rows.clone().step_by(STRIP_ROWS) {
            let rows = first..rows.end.min(first + STRIP_ROWS as u32);
            let pixels = &mut strip[..rows.len() * width as usize];
            self.relighter.copy_rows(rows.clone(), pixels);
            let [start, end] =
                [rows.start, rows.end].map(|row| 4 * (row - self.rows.start) * width);
            out.subarray(start, end).copy_from(pixels.as_flattened());
        }
        Ok(())
    }
}

/// The instructions that the CPU backend uses: `simd128` or `scalar`.
#[wasm_bindgen(js_name = cpuKernel)]
pub fn cpu_kernel() -> String {
    cpu::KERNEL.into()
}
