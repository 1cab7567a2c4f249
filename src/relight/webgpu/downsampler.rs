//! Light images on the device: decoded, then resampled by area along columns and along rows, without leaving it.

use wasm_bindgen::JsValue;

use super::api::{BindGroup, BindingResource, UniformBuffer, WebGpuTexture, record_draw, usage};
use super::context::GpuContext;
use crate::relight::texture_layout::{TextureDescriptor, TextureFormat};
use crate::transport::Extent;

/// Textures for light images of one extent.
#[derive(Debug)]
pub(super) struct Downsampler {
    /// Extent of the light images.
    pub extent: Extent,
    image: WebGpuTexture,
    /// The image resampled along columns.
    columns: WebGpuTexture,
    /// For columns, then for rows.
    bind_groups: [BindGroup; 2],
    /// Kept alive for the bind groups.
    _uniforms: [UniformBuffer; 2],
}

impl Downsampler {
    /// From light images of extent `image` to a light plane of extent `light`.
    pub fn new(device: &GpuContext, image: Extent, light: Extent) -> Self {
        use TextureFormat::{Rgba8Unorm, Rgba32Float};
        let GpuContext { gpu, pipelines, .. } = device;
        let create = |label, format, extent, usage| {
            let usage = usage | usage::TEXTURE_BINDING | usage::RENDER_ATTACHMENT;
            gpu.create_texture(&TextureDescriptor::flat(label, format, extent), usage)
        };
        let extent = image;
        let columns_extent = Extent {
            width: light.width,
            ..extent
        };
        let image = create("light image", Rgba8Unorm, extent, usage::COPY_DST);
        let columns = create("light image's columns", Rgba32Float, columns_extent, 0);
        // `DownsampleUniforms` of the WGSL.
        let uniforms = [[1, 0, light.width, 0], [0, 1, light.height, 0]]
            .map(|uniforms| gpu.create_uniforms(bytemuck::cast_slice(&uniforms)));
        let bind = |i: usize, source: &WebGpuTexture| {
            let resources = [
                (10, BindingResource::Texture(source)),
                (11, BindingResource::Uniforms(&uniforms[i])),
            ];
            gpu.create_bind_group(&pipelines.downsample.get_bind_group_layout(0), &resources)
        };
        Self {
            extent,
            bind_groups: [bind(0, &image), bind(1, &columns)],
            image,
            columns,
            _uniforms: uniforms,
        }
    }

    /// Uploads a light image and writes it into the light's texture.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin. The light stays.
    pub fn downsample(
        &self,
        device: &GpuContext,
        image: &JsValue,
        light: &WebGpuTexture,
    ) -> Result<(), JsValue> {
        let GpuContext { gpu, pipelines, .. } = device;
        gpu.write_image(&self.image, image, self.extent)?;
        gpu.submit(|commands| {
            for (bind_group, target) in self.bind_groups.iter().zip([&self.columns, light]) {
                record_draw(commands, &pipelines.downsample, bind_group, &target.view);
            }
        });
        Ok(())
    }
}
