//! Drawing into memory, by a device of the system's own.

use std::rc::Rc;
use std::time::Instant;

use super::device::Device;
use super::gpu::{API, Gpu, Texture, TextureDescriptor, TextureFormat, usage};
use super::scene::Scene;
use crate::relight::Rgba8Picture;
use crate::relight::backend::{BackendError, Frame};
use crate::transport::{Extent, Transport};

impl Device {
    /// A device that draws into memory.
    pub async fn offscreen() -> Result<Self, BackendError> {
        Self::of(TextureFormat::Rgba8Unorm).await
    }

    /// Waits until all that was asked for is done.
    pub fn wait(&self) -> Result<(), BackendError> {
        let done = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        done.map_err(|e| BackendError::Lost(e.to_string()))?;
        self.check()
    }
}

impl Device {
    /// Seconds that copying so many bytes within its memory takes, which is what benchmarks hold
    /// relighting against: of the fastest of a few runs.
    pub fn copy_seconds(&self, bytes: u64) -> Result<f64, BackendError> {
        const COPIES: u32 = 8;
        let buffer = || {
            self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("copying"),
                size: bytes,
                usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let buffers = [buffer(), buffer()];
        let mut best = f64::INFINITY;
        for _ in 0..5 {
            let start = Instant::now();
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            for _ in 0..COPIES {
                encoder.copy_buffer_to_buffer(&buffers[0], 0, &buffers[1], 0, bytes);
            }
            self.gpu.queue.submit([encoder.finish()]);
            self.wait()?;
            best = best.min(start.elapsed().as_secs_f64() / f64::from(COPIES));
        }
        Ok(best)
    }
}

/// A photograph and a picture of it, in a device's memory.
#[derive(Debug)]
pub struct Offscreen {
    scene: Scene,
    extent: Extent,
    picture: Texture,
}

impl Offscreen {
    /// Uploads a transport.
    pub async fn new(device: Rc<Device>, transport: &Transport) -> Result<Self, BackendError> {
        let scene = Scene::new(device.clone(), transport).await?;
        let extent = transport.geometry.camera;
        let picture = device.attempt(|| {
            device.gpu.texture(&TextureDescriptor {
                label: "picture",
                extent,
                layers: None,
                format: device.format,
                usage: usage::RENDER_ATTACHMENT | usage::COPY_SRC,
            })
        });
        let picture = picture.await?;
        Ok(Self {
            scene,
            extent,
            picture,
        })
    }

    /// Asks for a picture; [`Device::wait`] tells when it is drawn.
    pub fn draw(&mut self, frame: &Frame<'_>) -> Result<(), BackendError> {
        self.scene.device().check()?;
        self.scene.draw(frame, &self.picture.view);
        Ok(())
    }

    /// The picture that was drawn last.
    pub fn read(&self) -> Result<Rgba8Picture, BackendError> {
        let Gpu { device, queue, .. } = &self.scene.device().gpu;
        let picture = &self.picture.texture;
        let Extent { width, height } = self.extent;
        // Rows begin where copies may.
        let stride = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(stride) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride),
                    rows_per_image: None,
                },
            },
            picture.size(),
        );
        queue.submit([encoder.finish()]);
        let refused = |reason: String| BackendError::Device { api: API, reason };
        let (tell, told) = std::sync::mpsc::channel();
        buffer
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |result| {
                let _ = tell.send(result);
            });
        self.scene.device().wait()?;
        let mapped = told.recv().map_err(|e| refused(e.to_string()))?;
        mapped.map_err(|e| refused(e.to_string()))?;
        let bytes = buffer.slice(..).get_mapped_range();
        let bytes = bytes.map_err(|e| refused(e.to_string()))?;
        let rows = bytes.chunks_exact(stride as usize);
        let pixels = rows.flat_map(|row| row[..4 * width as usize].as_chunks().0);
        Ok(Rgba8Picture {
            extent: self.extent,
            pixels: pixels.copied().collect(),
        })
    }
}
