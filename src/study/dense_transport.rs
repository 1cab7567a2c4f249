//! A small light transport matrix with all of its elements, for methods without a window.

use super::known_transport::KnownTransport;
use crate::executor::Executor;
use crate::transport::{CHANNELS, CameraPx};

/// A light transport matrix, column by column, `[N][M]`.
pub(super) type DenseTransport = Vec<Vec<[f32; CHANNELS]>>;

/// Computes every column of `known`.
pub(super) fn dense_transport(
    known: &impl KnownTransport,
    executor: &impl Executor,
) -> DenseTransport {
    let geometry = known.geometry();
    executor.map(geometry.camera.area(), |n| {
        let width = geometry.camera.width;
        let (x, y) = (n as u32 % width, n as u32 / width);
        let pixel = CameraPx { x, y };
        let mut function = vec![[0.0; CHANNELS]; geometry.window.area()];
        known.transport_function(pixel, &mut function);
        let mut column = vec![[0.0; CHANNELS]; geometry.light.area()];
        for (s, m) in geometry.elements_of_window(known.origin(pixel)) {
            column[m] = function[s];
        }
        column
    })
}
