//! A small light transport matrix with all of its elements, for methods without a window.

use super::known_transport::KnownTransport;
use crate::executor::Executor;
use crate::transport::{CHANNELS, CameraPx};

/// A light transport matrix, column by column.
#[derive(Clone, Debug)]
pub(super) struct DenseTransport {
    /// Number of light elements, M.
    pub elements: usize,
    /// `[N, M]`.
    pub tau: Vec<[f32; CHANNELS]>,
}

impl DenseTransport {
    /// Computes every column of `known`.
    pub fn new(known: &impl KnownTransport, executor: &impl Executor) -> Self {
        let geometry = known.geometry();
        let elements = geometry.light.area();
        let columns = executor.map(geometry.camera.area(), |n| {
            let width = geometry.camera.width;
            let pixel = CameraPx {
                x: n as u32 % width,
                y: n as u32 / width,
            };
            let mut function = vec![[0.0; CHANNELS]; geometry.window.area()];
            known.transport_function(pixel, &mut function);
            let mut column = vec![[0.0; CHANNELS]; elements];
            for (s, m) in geometry.elements_of_window(known.origin(pixel)) {
                column[m] = function[s];
            }
            column
        });
        Self {
            elements,
            tau: columns.concat(),
        }
    }

    /// Number of camera pixels, N.
    pub fn pixels(&self) -> usize {
        self.tau.len() / self.elements
    }

    /// The column of pixel `n`, `[M]`.
    pub fn pixel(&self, n: usize) -> &[[f32; CHANNELS]] {
        &self.tau[n * self.elements..(n + 1) * self.elements]
    }
}
