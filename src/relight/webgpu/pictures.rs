//! Pictures that the browser has, as light: decoded, then averaged by area, without leaving the device.

use js_sys::{Array, Function, Object, Reflect};
use wasm_bindgen::{JsCast, JsValue};
use wgpu::util::DeviceExt;

use super::device::Device;
use super::scene::cover;
use crate::transport::Extent;

/// Room for pictures of one size, on their way to one light.
#[derive(Debug)]
pub(super) struct Pictures {
    extent: Extent,
    /// As the browser has it: wgpu's own copying panics at pictures of other origins.
    handle: JsValue,
    picture: wgpu::Texture,
    /// Means of columns.
    narrow: wgpu::Texture,
    /// How many columns, then rows, the light has.
    shrinks: [wgpu::Buffer; 2],
    bindings: [wgpu::BindGroup; 2],
    targets: [wgpu::TextureView; 2],
}

impl Pictures {
    /// For pictures of this extent, and a light's texture.
    pub fn new(device: &Device, extent: Extent, light: &wgpu::Texture) -> Result<Self, JsValue> {
        let Device { device, shrink, .. } = device;
        let size = |width, height| wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        };
        let described = |label, size, format, usage| wgpu::TextureDescriptor {
            label: Some(label),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        };
        use wgpu::TextureUsages as Usages;
        let given = Usages::TEXTURE_BINDING | Usages::COPY_DST | Usages::RENDER_ATTACHMENT;
        let whole = size(extent.width, extent.height);
        let picture = described("picture", whole, wgpu::TextureFormat::Rgba8Unorm, given);
        let handle = handle_of(device, extent, given)?;
        let picture = device.create_texture_from_webgpu_handle(
            handle.clone().unchecked_into(),
            &picture,
            None,
        );
        let narrow = device.create_texture(&described(
            "columns",
            size(light.width(), extent.height),
            wgpu::TextureFormat::Rgba32Float,
            Usages::TEXTURE_BINDING | Usages::RENDER_ATTACHMENT,
        ));
        let shrinks = [light.width(), light.height()].map(|to| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("shrink"),
                contents: bytemuck::cast_slice(&[to as i32, 0, 0, 0]),
                usage: wgpu::BufferUsages::UNIFORM,
            })
        });
        let view = |texture: &wgpu::Texture| texture.create_view(&Default::default());
        let bind = |i: usize, from: &wgpu::Texture| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("shrink"),
                layout: &shrink[i].get_bind_group_layout(0),
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 10,
                        resource: wgpu::BindingResource::TextureView(&view(from)),
                    },
                    wgpu::BindGroupEntry {
                        binding: 11,
                        resource: shrinks[i].as_entire_binding(),
                    },
                ],
            })
        };
        Ok(Self {
            extent,
            bindings: [bind(0, &picture), bind(1, &narrow)],
            targets: [view(&narrow), view(light)],
            handle,
            picture,
            narrow,
            shrinks,
        })
    }

    /// The pictures' extent.
    pub fn extent(&self) -> Extent {
        self.extent
    }

    /// Takes a picture.
    pub fn copy(&self, device: &Device, picture: &JsValue) -> Result<(), JsValue> {
        let queue = device.queue.as_webgpu().ok_or(JsValue::UNDEFINED)?;
        let source = object(&[("source", picture.clone())])?;
        // Colours apart from alpha, in sRGB.
        let to = object(&[("texture", self.handle.clone())])?;
        let size = Array::of2(&self.extent.width.into(), &self.extent.height.into());
        call(
            queue,
            "copyExternalImageToTexture",
            &[source.into(), to.into(), size.into()],
        )?;
        Ok(())
    }

    /// Makes it the light.
    pub fn shrink(&self, device: &Device, encoder: &mut wgpu::CommandEncoder) {
        for i in 0..2 {
            let targets = std::slice::from_ref(&self.targets[i]);
            cover(encoder, &device.shrink[i], &self.bindings[i], targets);
        }
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        // What was made by hand is let go by hand.
        let _ = call(&self.handle, "destroy", &[]);
        self.picture.destroy();
        self.narrow.destroy();
        self.shrinks.iter().for_each(wgpu::Buffer::destroy);
    }
}

fn handle_of(
    device: &wgpu::Device,
    extent: Extent,
    usage: wgpu::TextureUsages,
) -> Result<JsValue, JsValue> {
    let device = device.as_webgpu().ok_or(JsValue::UNDEFINED)?;
    let size = Array::of2(&extent.width.into(), &extent.height.into());
    let described = object(&[
        ("size", size.into()),
        ("format", "rgba8unorm".into()),
        ("usage", usage.bits().into()),
    ])?;
    call(device, "createTexture", &[described.into()])
}

fn object(fields: &[(&str, JsValue)]) -> Result<Object, JsValue> {
    let object = Object::new();
    for (name, value) in fields {
        Reflect::set(&object, &(*name).into(), value)?;
    }
    Ok(object)
}

fn call(object: &JsValue, name: &str, arguments: &[JsValue]) -> Result<JsValue, JsValue> {
    let method: Function = Reflect::get(object, &name.into())?.dyn_into()?;
    method.apply(object, &arguments.iter().collect())
}
