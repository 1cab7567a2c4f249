//! Draws one photograph on a device: the basis response where the light or the quality has changed, then the picture.

use std::rc::Rc;

use super::api::{TextureView, record_dispatches, record_draw};
use super::context::GpuContext;
use super::photo_textures::PhotoTextures;
use crate::relight::backend::{BackendError, FrameRequest, UploadedLight};
use crate::relight::texture_layout::{TextureLayout, binding};
use crate::transport::{Extent, Transport};

/// `GROUP` of correlate.wgsl: window origins of a workgroup.
const WORKGROUP_ORIGINS: [u32; 2] = [32, 4];

/// A transport in a device's memory, and the basis response of the last light.
#[derive(Debug)]
pub struct WebGpuRenderer {
    pub device: Rc<GpuContext>,
    pub layout: TextureLayout,
    pub textures: PhotoTextures,
    pub light: UploadedLight,
}

impl WebGpuRenderer {
    /// Uploads a transport. A failure leaves nothing on the device.
    ///
    /// # Errors
    /// [`BackendError::Layout`] or [`BackendError::Upload`] if the device cannot hold the transport.
    pub async fn new(device: Rc<GpuContext>, transport: &Transport) -> Result<Self, BackendError> {
        let layout = TextureLayout::new(transport, device.gpu.limits)?;
        // In one error scope: a device without room for it is not lost.
        let textures = device.try_upload(|| PhotoTextures::new(&device, &layout, transport));
        Ok(Self {
            textures: textures.await?,
            layout,
            light: UploadedLight::default(),
            device,
        })
    }

    /// Draws a frame into a target of the camera's extent.
    pub fn draw(&mut self, frame: &FrameRequest<'_>, target: &TextureView) {
        let GpuContext { gpu, pipelines, .. } = &*self.device;
        let (layout, textures) = (&self.layout, &self.textures);
        if let Some(light) = frame.light.filter(|light| !self.light.has(light)) {
            let elements = bytemuck::cast_slice(light.elements());
            gpu.write_texture(textures.light(), elements, [0; 3], light.extent());
            self.light = UploadedLight::new(light);
        }
        let chroma = self.light.chroma;
        let uniforms = layout.frame_uniforms(chroma, &frame.output, frame.quality);
        gpu.write_uniforms(&textures.frame, bytemuck::bytes_of(&uniforms));
        let is_stale = self.light.set_quality(frame.quality);
        gpu.submit(|commands| {
            if is_stale {
                let Extent { width, height } = layout.textures[binding::BASIS_RESPONSE].extent;
                let [columns, rows] = WORKGROUP_ORIGINS;
                let pairs = layout.used_quad_pairs(frame.quality);
                let bind_groups = &textures.correlation[..pairs];
                let workgroups = [width.div_ceil(columns), height.div_ceil(rows)];
                record_dispatches(commands, &pipelines.correlate, bind_groups, workgroups);
            }
            record_draw(commands, &pipelines.relight, &textures.relighting, target);
        });
    }
}
