//! A photograph on a device.

use std::rc::Rc;

use super::device::Device;
use super::textures::{Textures, write_texture};
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
    sights: [Vec<wgpu::BindGroup>; CHANNELS],
    /// What the last pass reads.
    bindings: wgpu::BindGroup,
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
            let textures = Textures::new(&device.device, &layout, &transport.basis);
            textures.upload(&device.queue, &layout, transport);
            let sights = textures.bind_parts(&device.device, &device.see);
            let bindings = textures.bind(&device.device, &device.relight);
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
    pub fn draw(&mut self, frame: &Frame<'_>, target: wgpu::TextureView) {
        let Frame {
            light,
            display,
            detail,
        } = frame;
        let Device {
            device,
            queue,
            see,
            relight,
            ..
        } = &*self.device;
        let detail = *detail;
        if let Some(light) = light.filter(|light| !self.lit.is(light)) {
            let elements = bytemuck::cast_slice(light.elements());
            let extent = self.layout.light();
            write_texture(queue, &self.textures.light, elements, [0; 3], extent);
            self.lit = Lit::of(light);
            #[cfg(target_arch = "wasm32")]
            drop(self.pictures.take());
        }
        let tint = self.lit.tint();
        let params = self.layout.params(tint, display, detail);
        queue.write_buffer(&self.textures.params, 0, bytemuck::bytes_of(&params));
        let mut encoder = device.create_command_encoder(&Default::default());
        if self.lit.look(detail) {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(see);
            let Extent { width, height } = self.layout.seen().extent;
            let [x, y] = GROUP;
            let sights = &self.sights[tint.channels()[0]];
            for sight in &sights[..self.layout.used_pairs(detail)] {
                pass.set_bind_group(0, sight, &[]);
                pass.dispatch_workgroups(width.div_ceil(x), height.div_ceil(y), 1);
            }
        }
        cover(&mut encoder, relight, &self.bindings, &[target]);
        queue.submit([encoder.finish()]);
    }
}

#[cfg(target_arch = "wasm32")]
impl Scene {
    /// Takes a picture as the light; `false` where it is too large. Nothing changes where
    /// the browser refuses it.
    pub fn take_picture(
        &mut self,
        picture: &wasm_bindgen::JsValue,
        extent: crate::transport::Extent,
    ) -> Result<bool, wasm_bindgen::JsValue> {
        let device = &*self.device;
        if !self.layout.takes(extent, device.limits) {
            return Ok(false);
        }
        let light = &self.textures.light;
        let fits = |pictures: &super::pictures::Pictures| pictures.extent() == extent;
        let pictures = match self.pictures.take().filter(fits) {
            Some(pictures) => pictures,
            None => super::pictures::Pictures::new(device, extent, light)?,
        };
        let pictures = self.pictures.insert(pictures);
        pictures.copy(device, picture)?;
        let mut encoder = device.device.create_command_encoder(&Default::default());
        pictures.shrink(device, &mut encoder);
        device.queue.submit([encoder.finish()]);
        self.lit = Lit::default();
        Ok(true)
    }
}

/// Runs a fragment shader over all of its targets.
pub(super) fn cover(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::RenderPipeline,
    bindings: &wgpu::BindGroup,
    targets: &[wgpu::TextureView],
) {
    let attachment = |view| {
        Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })
    };
    let attachments: Vec<_> = targets.iter().map(attachment).collect();
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &attachments,
        ..Default::default()
    });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bindings, &[]);
    pass.draw(0..3, 0..1);
}
