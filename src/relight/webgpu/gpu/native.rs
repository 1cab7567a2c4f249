//! By wgpu, from the system.

use std::sync::Arc;

use wgpu::util::DeviceExt;

use super::{API, Adapter, Loss, Resource, TextureDescriptor, TextureFormat};
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::TextureLimits;
use crate::transport::Extent;

/// A device and its queue.
#[derive(Debug)]
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub loss: Loss,
}

/// A texture, and all of it as a view. Freed when the last that uses it is dropped, as are the others.
#[derive(Debug)]
pub struct Texture {
    pub texture: wgpu::Texture,
    pub view: View,
}

/// What is drawn into.
pub type View = wgpu::TextureView;

/// A small buffer that shaders read.
#[derive(Debug)]
pub struct Uniforms(wgpu::Buffer);

/// Shaders.
pub struct Module(wgpu::ShaderModule);

#[derive(Debug)]
pub struct ComputePipeline(wgpu::ComputePipeline);

#[derive(Debug)]
pub struct RenderPipeline(wgpu::RenderPipeline);

/// What a pipeline's bindings stand for.
#[derive(Debug)]
pub struct Bindings(wgpu::BindGroup);

/// What the device is to do.
pub struct Commands(wgpu::CommandEncoder);

impl Gpu {
    /// The device that the system prefers.
    pub async fn open() -> Result<(Self, Adapter), BackendError> {
        let error = |reason: String| BackendError::Device { api: API, reason };
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::PRIMARY,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = instance.request_adapter(&options).await;
        let adapter = adapter.map_err(|e| error(e.to_string()))?;
        let offered = adapter.limits();
        let limits = TextureLimits {
            side: offered.max_texture_dimension_2d,
            layers: offered.max_texture_array_layers,
        };
        let described = wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: limits.side,
                max_texture_array_layers: limits.layers,
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Default::default()
        };
        let given = adapter.request_device(&described).await;
        let (device, queue) = given.map_err(|e| error(e.to_string()))?;
        let loss = watch(&device);
        let info = adapter.get_info();
        let adapter = Adapter {
            limits,
            fallback: info.device_type == wgpu::DeviceType::Cpu,
            name: info.name,
        };
        let gpu = Self {
            device,
            queue,
            loss,
        };
        Ok((gpu, adapter))
    }

    /// Frees all that is on the device, whoever holds it still.
    pub fn destroy(&self) {
        self.device.destroy();
    }

    /// Runs `work`; what the device has against it, if anything.
    pub async fn attempt<T>(&self, work: impl FnOnce() -> T) -> Result<T, String> {
        let invalid = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let done = work();
        // Both before anything is waited for, as others may use the device meanwhile; innermost first.
        let (memory, invalid) = (memory.pop(), invalid.pop());
        let refused = [memory.await, invalid.await];
        match refused.into_iter().flatten().next() {
            Some(error) => Err(error.to_string()),
            None => Ok(done),
        }
    }

    pub fn module(&self, wgsl: &'static str) -> Module {
        Module(
            self.device
                .create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: None,
                    source: wgpu::ShaderSource::Wgsl(wgsl.into()),
                }),
        )
    }

    pub fn compute_pipeline(&self, Module(module): &Module, entry_point: &str) -> ComputePipeline {
        let described = wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: None,
            module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            cache: None,
        };
        ComputePipeline(self.device.create_compute_pipeline(&described))
    }

    /// Runs a vertex shader, then a fragment shader for a target of a format.
    pub fn render_pipeline(
        &self,
        Module(module): &Module,
        vertex: &str,
        fragment: &str,
        format: TextureFormat,
    ) -> RenderPipeline {
        let described = wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: None,
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::TextureFormat::from(format).into())],
            }),
            multiview_mask: None,
            cache: None,
        };
        RenderPipeline(self.device.create_render_pipeline(&described))
    }

    pub fn texture(&self, described: &TextureDescriptor) -> Texture {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(described.label),
            size: size(described.extent, described.layers.unwrap_or(1)),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: described.format.into(),
            usage: wgpu::TextureUsages::from_bits_truncate(described.usage),
            view_formats: &[],
        });
        let dimension = match described.layers {
            Some(_) => wgpu::TextureViewDimension::D2Array,
            None => wgpu::TextureViewDimension::D2,
        };
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(dimension),
            ..Default::default()
        });
        Texture { texture, view }
    }

    /// Writes a rectangle of one layer, from column, row and layer `at` on.
    pub fn write_texture(
        &self,
        texture: &Texture,
        texels: &[u8],
        [x, y, z]: [u32; 3],
        extent: Extent,
    ) {
        self.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x, y, z },
                ..texture.texture.as_image_copy()
            },
            texels,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(texels.len() as u32 / extent.height),
                rows_per_image: None,
            },
            size(extent, 1),
        );
    }

    pub fn uniforms(&self, contents: &[u8]) -> Uniforms {
        let described = wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        };
        Uniforms(self.device.create_buffer_init(&described))
    }

    pub fn write_uniforms(&self, uniforms: &Uniforms, contents: &[u8]) {
        self.queue.write_buffer(&uniforms.0, 0, contents);
    }

    pub fn commands(&self) -> Commands {
        Commands(self.device.create_command_encoder(&Default::default()))
    }

    pub fn submit(&self, commands: Commands) {
        self.queue.submit([commands.0.finish()]);
    }

    fn bind<'a>(
        &self,
        layout: &wgpu::BindGroupLayout,
        resources: &[(u32, Resource<'a>)],
    ) -> Bindings {
        let entry = |(binding, resource): &(u32, Resource<'a>)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: match *resource {
                Resource::Texture(texture) => wgpu::BindingResource::TextureView(&texture.view),
                Resource::Uniforms(uniforms) => uniforms.0.as_entire_binding(),
            },
        };
        let entries: Vec<_> = resources.iter().map(entry).collect();
        let described = wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        };
        Bindings(self.device.create_bind_group(&described))
    }
}

impl ComputePipeline {
    pub fn bind(&self, gpu: &Gpu, resources: &[(u32, Resource<'_>)]) -> Bindings {
        gpu.bind(&self.0.get_bind_group_layout(0), resources)
    }
}

impl RenderPipeline {
    pub fn bind(&self, gpu: &Gpu, resources: &[(u32, Resource<'_>)]) -> Bindings {
        gpu.bind(&self.0.get_bind_group_layout(0), resources)
    }
}

impl Commands {
    /// Runs a compute shader by so many groups, once for each of the bindings.
    pub fn dispatch(&mut self, pipeline: &ComputePipeline, each: &[Bindings], groups: [u32; 2]) {
        let mut pass = self.0.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline.0);
        for Bindings(bindings) in each {
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(groups[0], groups[1], 1);
        }
    }

    /// Draws one triangle into a target that was cleared.
    pub fn draw(&mut self, pipeline: &RenderPipeline, bindings: &Bindings, target: &View) {
        let attachment = wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        };
        let mut pass = self.0.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        pass.set_pipeline(&pipeline.0);
        pass.set_bind_group(0, &bindings.0, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Notes the first thing that stops a device from working. (wgpu panics at an error that nobody
/// listens for.)
fn watch(device: &wgpu::Device) -> Loss {
    let loss = Loss::default();
    let note = loss.clone();
    device.set_device_lost_callback(move |reason, message| {
        note.note(format!("{reason:?} {message}"));
    });
    let note = loss.clone();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        note.note(error.to_string());
    }));
    loss
}

fn size(extent: Extent, layers: u32) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width: extent.width,
        height: extent.height,
        depth_or_array_layers: layers,
    }
}

impl From<TextureFormat> for wgpu::TextureFormat {
    fn from(format: TextureFormat) -> Self {
        match format {
            TextureFormat::Rgba8Unorm => Self::Rgba8Unorm,
            TextureFormat::Rg16Sint => Self::Rg16Sint,
            TextureFormat::Rgba16Sint => Self::Rgba16Sint,
            TextureFormat::Rgba32Sint => Self::Rgba32Sint,
            TextureFormat::Rgba32Float => Self::Rgba32Float,
        }
    }
}
