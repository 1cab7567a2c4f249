//! Pictures that the browser has, as light: decoded, then averaged by area, without leaving the device.

use wasm_bindgen::JsValue;

use super::device::Device;
use super::gpu::{Bindings, Resource, Texture, TextureDescriptor, TextureFormat, Uniforms, usage};
use crate::transport::Extent;

/// Room for pictures of one size, on their way to one light.
#[derive(Debug)]
pub(super) struct Pictures {
    extent: Extent,
    picture: Texture,
    /// Means of columns.
    narrow: Texture,
    bindings: [Bindings; 2],
    /// How many columns, then rows, the light has.
    _shrinks: [Uniforms; 2],
}

impl Pictures {
    /// For pictures of this extent, and a light's texture and extent.
    pub fn new(device: &Device, extent: Extent, light: Extent) -> Self {
        let Device { gpu, pipelines, .. } = device;
        let picture = gpu.texture(&TextureDescriptor {
            label: "picture",
            extent,
            layers: None,
            format: TextureFormat::Rgba8Unorm,
            usage: usage::TEXTURE_BINDING | usage::COPY_DST | usage::RENDER_ATTACHMENT,
        });
        let narrow = gpu.texture(&TextureDescriptor {
            label: "columns",
            extent: Extent {
                width: light.width,
                height: extent.height,
            },
            layers: None,
            format: TextureFormat::Rgba32Float,
            usage: usage::TEXTURE_BINDING | usage::RENDER_ATTACHMENT,
        });
        let shrinks = [light.width, light.height]
            .map(|to| gpu.uniforms(bytemuck::cast_slice(&[to as i32, 0, 0, 0])));
        let bind = |i: usize, from: &Texture| {
            let resources = [
                (10, Resource::Texture(from)),
                (11, Resource::Uniforms(&shrinks[i])),
            ];
            pipelines.shrink[i].bind(gpu, &resources)
        };
        Self {
            extent,
            bindings: [bind(0, &picture), bind(1, &narrow)],
            picture,
            narrow,
            _shrinks: shrinks,
        }
    }

    /// The pictures' extent.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Makes a picture the light.
    ///
    /// # Errors
    /// What the browser throws, as for pictures of another origin: the light stays.
    pub fn take(&self, device: &Device, picture: &JsValue, light: &Texture) -> Result<(), JsValue> {
        let Device { gpu, pipelines, .. } = device;
        gpu.write_picture(&self.picture, picture, self.extent)?;
        let mut commands = gpu.commands();
        for (i, target) in [&self.narrow, light].into_iter().enumerate() {
            commands.draw(&pipelines.shrink[i], &self.bindings[i], &target.view);
        }
        gpu.submit(commands);
        Ok(())
    }
}
