//! Draws one photograph on a device: the basis response where the light or the quality has changed, then the picture.

use std::rc::Rc;

use super::api::{BindGroup, TextureView};
use super::device::Device;
#[cfg(target_arch = "wasm32")]
use super::downsampler::Downsampler;
use super::photo_textures::PhotoTextures;
use crate::relight::backend::{BackendError, Frame, LightCache};
use crate::relight::texture_layout::TextureLayout;
use crate::transport::{CHANNELS, Extent, Transport};

/// `GROUP` of correlate.wgsl: window origins of a workgroup.
const WORKGROUP_ORIGINS: [u32; 2] = [32, 4];

/// A transport in a device's memory, and the basis response of the last light.
#[derive(Debug)]
pub struct PhotoRenderer {
    device: Rc<Device>,
    layout: TextureLayout,
    textures: PhotoTextures,
    /// For the correlation: `[channel][pair]`.
    correlation: [Vec<BindGroup>; CHANNELS],
    /// For the last pass.
    relighting: BindGroup,
    light: LightCache,
    #[cfg(target_arch = "wasm32")]
    downsampler: Option<Downsampler>,
}

impl PhotoRenderer {
    /// Uploads a transport. A failure leaves nothing on the device.
    ///
    /// # Errors
    /// [`BackendError::Layout`] or [`BackendError::Upload`] if the device cannot hold the transport.
    pub async fn new(device: Rc<Device>, transport: &Transport) -> Result<Self, BackendError> {
        let layout = TextureLayout::new(transport, device.limits)?;
        // In one error scope: a device without room for it is not lost.
        let uploaded = device.try_upload(|| {
            let Device { gpu, pipelines, .. } = &*device;
            let textures = PhotoTextures::new(gpu, &layout, &transport.basis);
            textures.upload(gpu, &layout, transport);
            let correlation = textures.bind_correlation(gpu, &pipelines.correlate);
            let relighting = textures.bind_relighting(gpu, &pipelines.relight);
            (textures, correlation, relighting)
        });
        let (textures, correlation, relighting) = uploaded.await?;
        Ok(Self {
            layout,
            textures,
            correlation,
            relighting,
            light: LightCache::default(),
            #[cfg(target_arch = "wasm32")]
            downsampler: None,
            device,
        })
    }

    /// The device.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Draws a frame into a target of the camera's extent.
    pub fn draw(&mut self, frame: &Frame<'_>, target: &TextureView) {
        let Frame {
            light,
            output,
            quality,
        } = *frame;
        let Device { gpu, pipelines, .. } = &*self.device;
        if let Some(light) = light.filter(|light| !self.light.has(light)) {
            let elements = bytemuck::cast_slice(light.elements());
            let extent = self.layout.light();
            gpu.write_texture(&self.textures.light, elements, [0; 3], extent);
            self.light = LightCache::new(light);
            #[cfg(target_arch = "wasm32")]
            drop(self.downsampler.take());
        }
        let chroma = self.light.chroma();
        let uniforms = self.layout.frame_uniforms(chroma, &output, quality);
        gpu.write_uniforms(&self.textures.frame, bytemuck::bytes_of(&uniforms));
        let mut commands = gpu.create_command_encoder();
        if self.light.set_quality(quality) {
            let Extent { width, height } = self.layout.basis_response().extent;
            let [columns, rows] = WORKGROUP_ORIGINS;
            let pairs = self.layout.used_quad_pairs(quality);
            let bind_groups = &self.correlation[chroma.channels()[0]][..pairs];
            let workgroups = [width.div_ceil(columns), height.div_ceil(rows)];
            commands.dispatch(&pipelines.correlate, bind_groups, workgroups);
        }
        commands.draw(&pipelines.relight, &self.relighting, target);
        gpu.submit(commands);
    }
}

#[cfg(target_arch = "wasm32")]
impl PhotoRenderer {
    /// Makes a picture of the browser's the light. Returns `false` if it is too large.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin. The light stays.
    pub fn set_light_image(
        &mut self,
        image: &wasm_bindgen::JsValue,
        extent: Extent,
    ) -> Result<bool, wasm_bindgen::JsValue> {
        let device = &*self.device;
        if !self.layout.is_light_image_allowed(extent, device.limits) {
            return Ok(false);
        }
        let fits = |downsampler: &Downsampler| downsampler.extent() == extent;
        let downsampler = match self.downsampler.take().filter(fits) {
            Some(downsampler) => downsampler,
            None => Downsampler::new(device, extent, self.layout.light()),
        };
        let downsampler = self.downsampler.insert(downsampler);
        downsampler.downsample(device, image, &self.textures.light)?;
        self.light = LightCache::default();
        Ok(true)
    }
}
