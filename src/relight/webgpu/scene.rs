//! A photograph on a device.

use std::rc::Rc;

use super::device::Device;
use super::textures::{Textures, write_texture};
use crate::relight::backend::{BackendError, Frame, Lit};
use crate::relight::texture_layout::{Pass, TextureLayout};
use crate::transport::{CHANNELS, Transport};

/// A transport in a device's memory, and what is seen of the last light.
#[derive(Debug)]
pub struct Scene {
    device: Rc<Device>,
    layout: TextureLayout,
    textures: Textures,
    /// What the passes that see read: `[channel][pair]`.
    sights: [Vec<wgpu::BindGroup>; CHANNELS],
    /// What they draw into.
    layers: Vec<wgpu::TextureView>,
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
        let textures = Textures::new(&device.device, &layout, &transport.basis);
        let bound = device.attempt(|| {
            textures.upload(&device.queue, &layout, transport);
            Ok((
                textures.bind_passes(&device.device, &device.see),
                textures.layers(),
                textures.bind(&device.device, &device.relight),
            ))
        });
        let (sights, layers, bindings) = bound.await?;
        Ok(Self {
            layout,
            textures,
            sights,
            layers,
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
        }
        let tint = self.lit.tint();
        let params = self.layout.params(tint, display, detail);
        queue.write_buffer(&self.textures.params, 0, bytemuck::bytes_of(&params));
        let mut encoder = device.create_command_encoder(&Default::default());
        if self.lit.look(detail) {
            for Pass {
                channel,
                pair,
                layer,
            } in self.layout.passes(tint, detail)
            {
                let layers = &self.layers[layer as usize..][..2];
                cover(&mut encoder, see, &self.sights[channel][pair], layers);
            }
        }
        cover(&mut encoder, relight, &self.bindings, &[target]);
        queue.submit([encoder.finish()]);
    }
}

#[cfg(target_arch = "wasm32")]
impl Scene {
    /// Takes a picture as the light; `false` where it is larger than a texture. Nothing changes where
    /// the browser refuses it.
    pub fn take_picture(
        &mut self,
        picture: &wasm_bindgen::JsValue,
        extent: crate::transport::Extent,
    ) -> Result<bool, wasm_bindgen::JsValue> {
        let device = &*self.device;
        if extent.width.max(extent.height) > device.limits.side {
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
