//! Small transports as whole matrices, for methods that know no window.

use super::known::Known;
use crate::executor::Executor;
use crate::transport::{CHANNELS, CameraPx};

/// Every element of a transport.
#[derive(Clone, Debug)]
pub(super) struct Dense {
    /// Light elements, `M`.
    pub elements: usize,
    /// `[N, M]`.
    pub tau: Vec<[f32; CHANNELS]>,
}

impl Dense {
    /// All of `known`.
    pub fn new(known: &impl Known, executor: &impl Executor) -> Self {
        let geometry = known.geometry();
        let elements = geometry.light.area();
        let rows = executor.map(geometry.camera.area(), |n| {
            let width = geometry.camera.width;
            let pixel = CameraPx {
                x: n as u32 % width,
                y: n as u32 / width,
            };
            let mut band = vec![[0.0; CHANNELS]; geometry.window.area()];
            known.transport_function(pixel, &mut band);
            let mut row = vec![[0.0; CHANNELS]; elements];
            let origin = known.origin(pixel);
            for (s, tau) in band.into_iter().enumerate() {
                if let Some(m) = geometry.window.element(origin, s).index_in(geometry.light) {
                    row[m] = tau;
                }
            }
            row
        });
        Self {
            elements,
            tau: rows.concat(),
        }
    }

    /// Camera pixels, `N`.
    pub fn pixels(&self) -> usize {
        self.tau.len() / self.elements
    }

    /// What pixel `n` sees of each element, `[M]`.
    pub fn pixel(&self, n: usize) -> &[[f32; CHANNELS]] {
        &self.tau[n * self.elements..(n + 1) * self.elements]
    }
}
