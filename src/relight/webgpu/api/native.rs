//! WebGPU natively, by wgpu.

use std::sync::Arc;

use wgpu::util::DeviceExt;

pub use wgpu::{
    BindGroup, Buffer as UniformBuffer, CommandEncoder, ComputePipeline, RenderPipeline,
    TextureView,
};

use super::{API, BindingResource, DeviceLoss};
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::{TextureDescriptor, TextureFormat, TextureLimits};
use crate::transport::Extent;

/// A device and its queue.
#[derive(Debug)]
pub struct DeviceAndQueue {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub limits: TextureLimits,
    pub name: String,
    pub is_software: bool,
    pub loss: DeviceLoss,
}

/// A texture and a view of all of it. wgpu frees resources when their last user is dropped.
#[derive(Debug)]
pub struct WebGpuTexture {
    pub texture: wgpu::Texture,
    pub view: TextureView,
}

impl DeviceAndQueue {
    /// The system's preferred device.
    ///
    /// # Errors
    /// [`BackendError::Device`] if there is none.
    pub async fn open() -> Result<Self, BackendError> {
        let error = |reason: String| BackendError::Device(API, reason);
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
        let wgpu::Limits {
            max_texture_dimension_2d,
            max_texture_array_layers,
            ..
        } = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits {
                max_texture_dimension_2d,
                max_texture_array_layers,
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Default::default()
        };
        let given = adapter.request_device(&descriptor).await;
        let (device, queue) = given.map_err(|e| error(e.to_string()))?;
        let info = adapter.get_info();
        Ok(Self {
            loss: watch_loss(&device),
            device,
            queue,
            limits: TextureLimits {
                max_side: max_texture_dimension_2d,
                max_layers: max_texture_array_layers,
            },
            is_software: info.device_type == wgpu::DeviceType::Cpu,
            name: info.name,
        })
    }

    /// Runs `work`.
    ///
    /// # Errors
    /// The message of the first error that its calls raise.
    pub async fn catch_errors<T>(&self, work: impl FnOnce() -> T) -> Result<T, String> {
        let invalid = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let done = work();
        // Both scopes are popped, the inner one first, before either is awaited: others may use the device meanwhile.
        let (memory, invalid) = (memory.pop(), invalid.pop());
        let errors = [memory.await, invalid.await];
        match errors.into_iter().flatten().next() {
            Some(error) => Err(error.to_string()),
            None => Ok(done),
        }
    }

    pub fn create_shader_module(&self, wgsl: &'static str) -> wgpu::ShaderModule {
        self.device
            .create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Wgsl(wgsl.into()),
            })
    }

    pub fn create_compute_pipeline(
        &self,
        module: &wgpu::ShaderModule,
        entry_point: &str,
    ) -> ComputePipeline {
        let descriptor = wgpu::ComputePipelineDescriptor {
            label: Some(entry_point),
            layout: None,
            module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            cache: None,
        };
        self.device.create_compute_pipeline(&descriptor)
    }

    /// A pipeline of a vertex and a fragment shader, for one target.
    pub fn create_render_pipeline(
        &self,
        module: &wgpu::ShaderModule,
        vertex: &str,
        fragment: &str,
        format: TextureFormat,
    ) -> RenderPipeline {
        let descriptor = wgpu::RenderPipelineDescriptor {
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
        self.device.create_render_pipeline(&descriptor)
    }

    /// Creates a texture for these bits of [`usage`](super::usage).
    pub fn create_texture(&self, descriptor: &TextureDescriptor, usage: u32) -> WebGpuTexture {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(descriptor.label),
            size: size(descriptor.extent, descriptor.layers.unwrap_or(1)),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: descriptor.format.into(),
            usage: wgpu::TextureUsages::from_bits_truncate(usage),
            view_formats: &[],
        });
        let dimension = match descriptor.layers {
            Some(_) => wgpu::TextureViewDimension::D2Array,
            None => wgpu::TextureViewDimension::D2,
        };
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(dimension),
            ..Default::default()
        });
        WebGpuTexture { texture, view }
    }

    /// Writes a rectangle of one layer, from that column, row and layer on.
    pub fn write_texture(
        &self,
        texture: &WebGpuTexture,
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
                bytes_per_row: Some((texels.len() / extent.height as usize) as u32),
                rows_per_image: None,
            },
            size(extent, 1),
        );
    }

    pub fn create_uniforms(&self, contents: &[u8]) -> UniformBuffer {
        let descriptor = wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        };
        self.device.create_buffer_init(&descriptor)
    }

    pub fn write_uniforms(&self, uniforms: &UniformBuffer, contents: &[u8]) {
        self.queue.write_buffer(uniforms, 0, contents);
    }

    pub fn create_bind_group<'a>(
        &self,
        layout: &wgpu::BindGroupLayout,
        resources: &[(u32, BindingResource<'a>)],
    ) -> BindGroup {
        let entry = |(binding, resource): &(u32, BindingResource<'a>)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: match *resource {
                BindingResource::Texture(texture) => {
                    wgpu::BindingResource::TextureView(&texture.view)
                }
                BindingResource::Uniforms(uniforms) => uniforms.as_entire_binding(),
            },
        };
        let entries: Vec<_> = resources.iter().map(entry).collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
    }

    /// Submits the commands that `record` records.
    pub fn submit(&self, record: impl FnOnce(&mut CommandEncoder)) {
        let mut commands = self.device.create_command_encoder(&Default::default());
        record(&mut commands);
        self.queue.submit([commands.finish()]);
    }
}

/// Dispatches a compute pipeline once for each bind group.
pub fn record_dispatches(
    commands: &mut CommandEncoder,
    pipeline: &ComputePipeline,
    bind_groups: &[BindGroup],
    [columns, rows]: [u32; 2],
) {
    let mut pass = commands.begin_compute_pass(&Default::default());
    pass.set_pipeline(pipeline);
    for bind_group in bind_groups {
        pass.set_bind_group(0, bind_group, &[]);
        pass.dispatch_workgroups(columns, rows, 1);
    }
}

/// Clears a target and draws one triangle into it.
pub fn record_draw(
    commands: &mut CommandEncoder,
    pipeline: &RenderPipeline,
    bind_group: &BindGroup,
    target: &TextureView,
) {
    let attachment = wgpu::RenderPassColorAttachment {
        view: target,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations {
            load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
            store: wgpu::StoreOp::Store,
        },
    };
    let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(attachment)],
        ..Default::default()
    });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bind_group, &[]);
    pass.draw(0..3, 0..1);
}

/// Records the loss of a device or its first uncaught error, at which wgpu would panic.
fn watch_loss(device: &wgpu::Device) -> DeviceLoss {
    let loss = DeviceLoss::default();
    let recorder = loss.clone();
    device.set_device_lost_callback(move |reason, message| {
        let _ = recorder.set(format!("{reason:?} {message}"));
    });
    let recorder = loss.clone();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        let _ = recorder.set(error.to_string());
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
            TextureFormat::Bgra8Unorm => Self::Bgra8Unorm,
            TextureFormat::Rg16Sint => Self::Rg16Sint,
            TextureFormat::Rgba16Sint => Self::Rgba16Sint,
            TextureFormat::Rg32Sint => Self::Rg32Sint,
            TextureFormat::Rgba32Float => Self::Rgba32Float,
        }
    }
}
