//! Light images on the device: decoded, then resampled by area along columns and along rows, without leaving it.

use wasm_bindgen::JsValue;

use super::api::{
    BindGroup, BindingResource, Texture, TextureDescriptor, TextureFormat, UniformBuffer, usage,
};
use super::device::Device;
use crate::transport::Extent;

/// Textures for light images of one extent.
#[derive(Debug)]
pub(super) struct Downsampler {
    extent: Extent,
    image: Texture,
    /// The image resampled along columns.
    columns: Texture,
    /// For columns, then for rows.
    bind_groups: [BindGroup; 2],
    /// Kept alive for the bind groups.
    _uniforms: [UniformBuffer; 2],
}

impl Downsampler {
    /// From light images of extent `image` to a light plane of extent `light`.
    pub fn new(device: &Device, image: Extent, light: Extent) -> Self {
        let Device { gpu, pipelines, .. } = device;
        let extent = image;
        let image = gpu.create_texture(&TextureDescriptor {
            label: "light image",
            extent,
            layers: None,
            format: TextureFormat::Rgba8Unorm,
            usage: usage::TEXTURE_BINDING | usage::COPY_DST | usage::RENDER_ATTACHMENT,
        });
        let columns = gpu.create_texture(&TextureDescriptor {
            label: "columns of the light image",
            extent: Extent {
                width: light.width,
                height: extent.height,
            },
            layers: None,
            format: TextureFormat::Rgba32Float,
            usage: usage::TEXTURE_BINDING | usage::RENDER_ATTACHMENT,
        });
        // `DownsampleUniforms` of the WGSL.
        let uniforms = [[1, 0, light.width, 0], [0, 1, light.height, 0]]
            .map(|uniforms| gpu.create_uniforms(bytemuck::cast_slice(&uniforms)));
        let bind = |i: usize, source: &Texture| {
            let resources = [
                (10, BindingResource::Texture(source)),
                (11, BindingResource::Uniforms(&uniforms[i])),
            ];
            pipelines.downsample.bind(gpu, &resources)
        };
        Self {
            extent,
            bind_groups: [bind(0, &image), bind(1, &columns)],
            image,
            columns,
            _uniforms: uniforms,
        }
    }

    /// Extent of the light images.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Uploads a light image and writes it into the light's texture.
    ///
    /// # Errors
    /// What the browser throws, for instance for pictures of another origin. The light stays.
    pub fn downsample(
        &self,
        device: &Device,
        image: &JsValue,
        light: &Texture,
    ) -> Result<(), JsValue> {
        let Device { gpu, pipelines, .. } = device;
        gpu.write_image(&self.image, image, self.extent)?;
        let mut commands = gpu.create_command_encoder();
        for (bind_group, target) in self.bind_groups.iter().zip([&self.columns, light]) {
            commands.draw(&pipelines.downsample, bind_group, &target.view);
        }
        gpu.submit(commands);
        Ok(())
    }
}
