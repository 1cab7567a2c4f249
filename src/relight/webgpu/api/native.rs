//! WebGPU natively, by wgpu.

use std::sync::Arc;

use wgpu::util::DeviceExt;

use super::{API, AdapterInfo, BindingResource, DeviceLoss, TextureDescriptor, TextureFormat};
use crate::relight::backend::BackendError;
use crate::relight::texture_layout::TextureLimits;
use crate::transport::Extent;

/// A device and its queue.
#[derive(Debug)]
pub struct DeviceQueue {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub loss: DeviceLoss,
}

/// A texture and a view of all of it. wgpu frees resources when their last user is dropped.
#[derive(Debug)]
pub struct Texture {
    pub texture: wgpu::Texture,
    pub view: TextureView,
}

/// A view of a texture.
pub type TextureView = wgpu::TextureView;

/// A uniform buffer.
#[derive(Debug)]
pub struct UniformBuffer(wgpu::Buffer);

/// A compiled shader module.
pub struct ShaderModule(wgpu::ShaderModule);

#[derive(Debug)]
pub struct ComputePipeline(wgpu::ComputePipeline);

#[derive(Debug)]
pub struct RenderPipeline(wgpu::RenderPipeline);

/// The resources of a pipeline's bindings.
#[derive(Debug)]
pub struct BindGroup(wgpu::BindGroup);

/// Records passes to submit.
pub struct CommandEncoder(wgpu::CommandEncoder);

impl DeviceQueue {
    /// The system's preferred device.
    ///
    /// # Errors
    /// [`BackendError::Device`] if there is none.
    pub async fn open() -> Result<(Self, AdapterInfo), BackendError> {
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
            max_side: offered.max_texture_dimension_2d,
            max_layers: offered.max_texture_array_layers,
        };
        let descriptor = wgpu::DeviceDescriptor {
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: limits.max_side,
                max_texture_array_layers: limits.max_layers,
                ..wgpu::Limits::downlevel_defaults()
            },
            ..Default::default()
        };
        let given = adapter.request_device(&descriptor).await;
        let (device, queue) = given.map_err(|e| error(e.to_string()))?;
        let loss = watch_loss(&device);
        let info = adapter.get_info();
        let adapter = AdapterInfo {
            limits,
            is_software: info.device_type == wgpu::DeviceType::Cpu,
            name: info.name,
        };
        let gpu = Self {
            device,
            queue,
            loss,
        };
        Ok((gpu, adapter))
    }

    /// Frees everything on the device, also resources in use.
    pub fn destroy(&self) {
        self.device.destroy();
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

    pub fn create_shader_module(&self, wgsl: &'static str) -> ShaderModule {
        ShaderModule(
            self.device
                .create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: None,
                    source: wgpu::ShaderSource::Wgsl(wgsl.into()),
                }),
        )
    }

    pub fn create_compute_pipeline(
        &self,
        ShaderModule(module): &ShaderModule,
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
        ComputePipeline(self.device.create_compute_pipeline(&descriptor))
    }

    /// A pipeline of a vertex and a fragment shader, for one target.
    pub fn create_render_pipeline(
        &self,
        ShaderModule(module): &ShaderModule,
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
        RenderPipeline(self.device.create_render_pipeline(&descriptor))
    }

    pub fn create_texture(&self, descriptor: &TextureDescriptor) -> Texture {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(descriptor.label),
            size: size(descriptor.extent, descriptor.layers.unwrap_or(1)),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: descriptor.format.into(),
            usage: wgpu::TextureUsages::from_bits_truncate(descriptor.usage),
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
        Texture { texture, view }
    }

    /// Writes a rectangle of one layer, from that column, row and layer on.
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

    pub fn create_uniforms(&self, contents: &[u8]) -> UniformBuffer {
        let descriptor = wgpu::util::BufferInitDescriptor {
            label: None,
            contents,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        };
        UniformBuffer(self.device.create_buffer_init(&descriptor))
    }

    pub fn write_uniforms(&self, uniforms: &UniformBuffer, contents: &[u8]) {
        self.queue.write_buffer(&uniforms.0, 0, contents);
    }

    pub fn create_command_encoder(&self) -> CommandEncoder {
        CommandEncoder(self.device.create_command_encoder(&Default::default()))
    }

    pub fn submit(&self, commands: CommandEncoder) {
        self.queue.submit([commands.0.finish()]);
    }

    fn bind<'a>(
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
                BindingResource::Uniforms(uniforms) => uniforms.0.as_entire_binding(),
            },
        };
        let entries: Vec<_> = resources.iter().map(entry).collect();
        let descriptor = wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        };
        BindGroup(self.device.create_bind_group(&descriptor))
    }
}

impl ComputePipeline {
    pub fn bind(&self, gpu: &DeviceQueue, resources: &[(u32, BindingResource<'_>)]) -> BindGroup {
        gpu.bind(&self.0.get_bind_group_layout(0), resources)
    }
}

impl RenderPipeline {
    pub fn bind(&self, gpu: &DeviceQueue, resources: &[(u32, BindingResource<'_>)]) -> BindGroup {
        gpu.bind(&self.0.get_bind_group_layout(0), resources)
    }
}

impl CommandEncoder {
    /// Dispatches a compute pipeline once for each bind group.
    pub fn dispatch(
        &mut self,
        pipeline: &ComputePipeline,
        bind_groups: &[BindGroup],
        workgroups: [u32; 2],
    ) {
        let mut pass = self.0.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline.0);
        for BindGroup(bind_group) in bind_groups {
            pass.set_bind_group(0, bind_group, &[]);
            pass.dispatch_workgroups(workgroups[0], workgroups[1], 1);
        }
    }

    /// Clears a target and draws one triangle into it.
    pub fn draw(
        &mut self,
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
        let mut pass = self.0.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        pass.set_pipeline(&pipeline.0);
        pass.set_bind_group(0, &bind_group.0, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Records the loss of a device or its first uncaught error, at which wgpu would panic.
fn watch_loss(device: &wgpu::Device) -> DeviceLoss {
    let loss = DeviceLoss::default();
    let recorder = loss.clone();
    device.set_device_lost_callback(move |reason, message| {
        recorder.record(format!("{reason:?} {message}"));
    });
    let recorder = loss.clone();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        recorder.record(error.to_string());
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
