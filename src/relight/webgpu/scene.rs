//! A photograph on a device.

use std::rc::Rc;

use super::device::Device;
use super::gpu::{Bindings, View};
use super::textures::Textures;
use crate::relight::backend::{BackendError, Frame, Lit};
use crate::relight::texture_layout::TextureLayout;
use crate::transport::{CHANNELS, Extent, Transport};

/// The shader's: window origins that are seen together.
const GROUP: [u32; 2] = [32, 4];

/// A transport in a device's memory, and what is seen of the last light.
#[derive(Debug)]
pub struct Scene {
    device: Rc<Device>,
    layout: TextureLayout,
    textures: Textures,
    /// What the dispatches that see read and write: `[channel][pair]`.
    sights: [Vec<Bindings>; CHANNELS],
    /// What the last pass reads.
    bindings: Bindings,
    /// The light that is there.
    lit: Lit,
    #[cfg(target_arch = "wasm32")]
    pictures: Option<super::pictures::Pictures>,
}

impl Scene {
    /// Uploads a transport, or fails without leaving anything on the device.
    pub async fn new(device: Rc<Device>, transport: &Transport) -> Result<Self, BackendError> {
        let layout = TextureLayout::new(transport, device.limits)?;
        // All in one, so that a device that has no room for it is not taken for a broken one.
        let made = device.attempt(|| {
            let Device { gpu, pipelines, .. } = &*device;
            let textures = Textures::new(gpu, &layout, &transport.basis);
            textures.upload(gpu, &layout, transport);
            let sights = textures.bind_parts(gpu, &pipelines.see);
            let bindings = textures.bind(gpu, &pipelines.relight);
            (textures, sights, bindings)
        });
        let (textures, sights, bindings) = made.await?;
        Ok(Self {
            layout,
            textures,
            sights,
            bindings,
            lit: Lit::default(),
            #[cfg(target_arch = "wasm32")]
            pictures: None,
            device,
        })
    }

    /// The device it is on.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Draws the picture into a target of its size.
    pub fn draw(&mut self, frame: &Frame<'_>, target: &View) {
        let Frame {
            light,
            display,
            detail,
        } = frame;
        let Device { gpu, pipelines, .. } = &*self.device;
        let detail = *detail;
        if let Some(light) = light.filter(|light| !self.lit.is(light)) {
            let elements = bytemuck::cast_slice(light.elements());
            let extent = self.layout.light();
            gpu.write_texture(&self.textures.light, elements, [0; 3], extent);
            self.lit = Lit::of(light);
            #[cfg(target_arch = "wasm32")]
            drop(self.pictures.take());
        }
        let tint = self.lit.tint();
        let params = self.layout.params(tint, display, detail);
        gpu.write_uniforms(&self.textures.params, bytemuck::bytes_of(&params));
        let mut commands = gpu.commands();
        if self.lit.look(detail) {
            let Extent { width, height } = self.layout.seen().extent;
            let [x, y] = GROUP;
            let sights = &self.sights[tint.channels()[0]][..self.layout.used_pairs(detail)];
            let groups = [width.div_ceil(x), height.div_ceil(y)];
            commands.dispatch(&pipelines.see, sights, groups);
        }
        commands.draw(&pipelines.relight, &self.bindings, target);
        gpu.submit(commands);
    }
}

#[cfg(target_arch = "wasm32")]
impl Scene {
    /// Takes a picture as the light; `false` where it is too large. Nothing changes where
    /// the browser refuses it.
    pub fn take_picture(
        &mut self,
        picture: &wasm_bindgen::JsValue,
        extent: Extent,
    ) -> Result<bool, wasm_bindgen::JsValue> {
        let device = &*self.device;
        if !self.layout.takes(extent, device.limits) {
            return Ok(false);
        }
        let fits = |pictures: &super::pictures::Pictures| pictures.extent() == extent;
        let pictures = match self.pictures.take().filter(fits) {
            Some(pictures) => pictures,
            None => super::pictures::Pictures::new(device, extent, self.layout.light()),
        };
        let pictures = self.pictures.insert(pictures);
        pictures.take(device, picture, &self.textures.light)?;
        self.lit = Lit::default();
        Ok(true)
    }
}
