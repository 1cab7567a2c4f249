//! Draws into a texture, on a device of the system, for tests and benchmarks.

use std::rc::Rc;

use super::api::{API, DeviceAndQueue, WebGpuTexture, usage};
use super::context::GpuContext;
use super::photo_renderer::WebGpuRenderer;
use crate::relight::Rgba8Picture;
use crate::relight::backend::{BackendError, FrameRequest};
use crate::relight::texture_layout::{TextureDescriptor, TextureFormat};
use crate::transport::{Extent, Transport};

impl GpuContext {
    /// A device for textures.
    ///
    /// # Errors
    /// [`BackendError::Device`] if the system has none.
    pub async fn offscreen() -> Result<Self, BackendError> {
        Self::open(TextureFormat::Rgba8Unorm).await
    }

    /// Waits until all submitted work is done.
    ///
    /// # Errors
    /// [`BackendError::Lost`] if the device is lost.
    pub fn wait(&self) -> Result<(), BackendError> {
        let done = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        done.map_err(|e| BackendError::Lost(e.to_string()))?;
        self.check()
    }

    /// The device of wgpu, and its queue.
    pub fn wgpu(&self) -> (&wgpu::Device, &wgpu::Queue) {
        (&self.gpu.device, &self.gpu.queue)
    }
}

/// Draws one photograph into a texture.
#[derive(Debug)]
pub struct HeadlessRenderer {
    renderer: WebGpuRenderer,
    picture: WebGpuTexture,
}

impl HeadlessRenderer {
    /// Uploads a transport.
    ///
    /// # Errors
    /// [`BackendError::Layout`] or [`BackendError::Upload`] if the device cannot hold it.
    pub async fn new(device: Rc<GpuContext>, transport: &Transport) -> Result<Self, BackendError> {
        let renderer = WebGpuRenderer::new(device.clone(), transport).await?;
        let picture = device.try_upload(|| {
            let camera = transport.geometry.camera;
            let descriptor = TextureDescriptor::flat("picture", device.format, camera);
            let usage = usage::RENDER_ATTACHMENT | usage::COPY_SRC;
            device.gpu.create_texture(&descriptor, usage)
        });
        let picture = picture.await?;
        Ok(Self { renderer, picture })
    }

    /// Submits a frame. [`GpuContext::wait`] waits until it is drawn.
    ///
    /// # Errors
    /// [`BackendError::Lost`] if the device is lost.
    pub fn draw(&mut self, frame: &FrameRequest<'_>) -> Result<(), BackendError> {
        self.renderer.device.check()?;
        self.renderer.draw(frame, &self.picture.view);
        Ok(())
    }

    /// Reads the last picture.
    ///
    /// # Errors
    /// [`BackendError::Lost`] or [`BackendError::Device`] if it cannot be read.
    pub fn read(&self) -> Result<Rgba8Picture, BackendError> {
        let DeviceAndQueue { device, queue, .. } = &self.renderer.device.gpu;
        let picture = &self.picture.texture;
        let (width, height) = (picture.width(), picture.height());
        // Copies need aligned rows.
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
        let device_error = |reason: String| BackendError::Device(API, reason);
        let (sender, receiver) = std::sync::mpsc::channel();
        buffer
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |result| {
                let _ = sender.send(result);
            });
        self.renderer.device.wait()?;
        let mapped = receiver.recv().map_err(|e| device_error(e.to_string()))?;
        mapped.map_err(|e| device_error(e.to_string()))?;
        let bytes = buffer.slice(..).get_mapped_range();
        let bytes = bytes.map_err(|e| device_error(e.to_string()))?;
        let rows = bytes.chunks_exact(stride as usize);
        let pixels = rows.flat_map(|row| row[..4 * width as usize].as_chunks().0);
        Ok(Rgba8Picture {
            extent: Extent { width, height },
            pixels: pixels.copied().collect(),
        })
    }
}
