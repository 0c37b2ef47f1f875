//! Drawing textured triangles on a picture.

use super::memory::COLOR;
use super::pipeline::{Layout, Modules};
use super::{Buffer, DescriptorSet, Device, Error, Image, Named, Recording};
use ash::vk;
use std::sync::Arc;

/// How texels are looked up between their centres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// The nearest one.
    Nearest,
    /// The four around, weighted.
    Linear,
}

/// What is drawn on. Its former contents are lost.
pub struct Target {
    pub(super) image: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) size: [u32; 2],
    /// The layout it has afterwards.
    pub(super) then: vk::ImageLayout,
    /// What must live until it is drawn; pictures of a window live as long as their swapchain, which
    /// waits before it goes.
    pub(super) owner: Option<Arc<Image>>,
}

impl Target {
    /// Pixels across and down.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// An image made by [`Image::to_draw_on`], to be downloaded afterwards.
    #[must_use]
    pub fn image(image: &Arc<Image>) -> Self {
        let extent = image.extent();
        Self {
            image: image.raw(),
            view: image.view(),
            size: [extent.width, extent.height],
            then: vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            owner: Some(Arc::clone(image)),
        }
    }
}

/// A pipeline for triangles of vertices of 20 bytes: position and texture coordinates as floats, and
/// a colour of four bytes. Colours are premultiplied by alpha and laid over what is there.
pub struct RasterPipeline {
    raw: vk::Pipeline,
    layout: Layout,
    samplers: [vk::Sampler; 2],
}

/// Bytes of a vertex.
const STRIDE: u32 = 20;

/// A texture as the shaders see it.
pub struct DrawTexture {
    set: DescriptorSet,
    // Its sampler is the pipeline's.
    _pipeline: Arc<RasterPipeline>,
}

/// Some triangles with one texture.
pub struct Draw {
    /// The texture.
    pub texture: Arc<DrawTexture>,
    /// Pixels outside of this rectangle stay: left, top, right, bottom.
    pub clip: [u32; 4],
    /// Where its indices begin, and how many there are.
    pub indices: [u32; 2],
    /// Added to each index.
    pub first_vertex: i32,
}

impl RasterPipeline {
    /// Makes the pipeline for pictures of one format.
    ///
    /// # Errors
    /// When the device does not draw, or a call fails.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        code: [&[u32]; 2],
        push_constants: u32,
        format: vk::Format,
    ) -> Result<Arc<Self>, Error> {
        if !device.limits().draws {
            return Err(Error::Unusable {
                name: device.info().name.clone(),
                lacking: vec!["a queue with graphics".into()],
            });
        }
        let stage = vk::ShaderStageFlags::FRAGMENT;
        let binding = |i, kind| {
            vk::DescriptorSetLayoutBinding::default()
                .binding(i)
                .descriptor_type(kind)
                .descriptor_count(1)
                .stage_flags(stage)
        };
        let bindings = [
            binding(0, vk::DescriptorType::SAMPLED_IMAGE),
            binding(1, vk::DescriptorType::SAMPLER),
        ];
        let layout = Layout::new(
            device,
            &bindings,
            push_constants,
            vk::ShaderStageFlags::VERTEX,
        )?;
        let mut pipeline = Self {
            raw: vk::Pipeline::null(),
            layout,
            samplers: [vk::Sampler::null(); 2],
        };
        for (sampler, filter) in
            (pipeline.samplers.iter_mut()).zip([vk::Filter::NEAREST, vk::Filter::LINEAR])
        {
            let clamp = vk::SamplerAddressMode::CLAMP_TO_EDGE;
            let info = vk::SamplerCreateInfo::default()
                .mag_filter(filter)
                .min_filter(filter)
                .address_mode_u(clamp)
                .address_mode_v(clamp);
            // SAFETY: a valid create info; `pipeline` owns the sampler from here on.
            *sampler =
                unsafe { device.raw.create_sampler(&info, None) }.named("vkCreateSampler")?;
        }
        pipeline.raw = pipeline.make(device, code, format)?;
        device.name(pipeline.raw, name);
        Ok(Arc::new(pipeline))
    }

    fn make(
        &self,
        device: &Arc<Device>,
        [vertex, fragment]: [&[u32]; 2],
        format: vk::Format,
    ) -> Result<vk::Pipeline, Error> {
        let mut modules = Modules::new(device);
        let mut stage = |flags, code| {
            Ok::<_, Error>(
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(flags)
                    .module(modules.add(code)?)
                    .name(c"main"),
            )
        };
        let stages = [
            stage(vk::ShaderStageFlags::VERTEX, vertex)?,
            stage(vk::ShaderStageFlags::FRAGMENT, fragment)?,
        ];
        let bindings = [vk::VertexInputBindingDescription {
            binding: 0,
            stride: STRIDE,
            input_rate: vk::VertexInputRate::VERTEX,
        }];
        let attribute = |location, format, offset| vk::VertexInputAttributeDescription {
            location,
            binding: 0,
            format,
            offset,
        };
        let attributes = [
            attribute(0, vk::Format::R32G32_SFLOAT, 0),
            attribute(1, vk::Format::R32G32_SFLOAT, 8),
            attribute(2, vk::Format::R8G8B8A8_UNORM, 16),
        ];
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let rasterization = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let over = [vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&over);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let formats = [format];
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&rasterization)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout.pipeline)
            .push_next(&mut rendering);
        // SAFETY: everything the info points to lives until the call returns.
        unsafe {
            let made =
                (device.raw).create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
            let made = made.map_err(|(_, result)| result);
            Ok(made.named("vkCreateGraphicsPipelines")?[0])
        }
    }

    /// Makes an image ready for drawing with it.
    ///
    /// # Errors
    /// When a call fails.
    pub fn texture(
        self: &Arc<Self>,
        image: &Arc<Image>,
        filter: Filter,
    ) -> Result<Arc<DrawTexture>, Error> {
        let device = &self.layout.device;
        let size = |ty| vk::DescriptorPoolSize {
            ty,
            descriptor_count: 1,
        };
        let sizes = [
            size(vk::DescriptorType::SAMPLED_IMAGE),
            size(vk::DescriptorType::SAMPLER),
        ];
        let set =
            DescriptorSet::allocate(device, &sizes, self.layout.sets, vec![Arc::clone(image)])?;
        let view = [vk::DescriptorImageInfo::default()
            .image_view(image.view())
            .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
        let sampler = [vk::DescriptorImageInfo::default().sampler(self.samplers[filter as usize])];
        let write = |binding, kind| {
            vk::WriteDescriptorSet::default()
                .dst_set(set.raw)
                .dst_binding(binding)
                .descriptor_type(kind)
        };
        let writes = [
            write(0, vk::DescriptorType::SAMPLED_IMAGE).image_info(&view),
            write(1, vk::DescriptorType::SAMPLER).image_info(&sampler),
        ];
        // SAFETY: the set is new and unused, what it points to is alive.
        unsafe { device.raw.update_descriptor_sets(&writes, &[]) };
        Ok(Arc::new(DrawTexture {
            set,
            _pipeline: Arc::clone(self),
        }))
    }

    /// Draws on black. Indices must stay within the vertices.
    pub fn record(
        self: &Arc<Self>,
        recording: &mut Recording,
        target: &Target,
        [vertices, indices]: [&Arc<Buffer>; 2],
        push_constants: &[u8],
        draws: &[Draw],
    ) {
        let device = Arc::clone(&recording.device);
        let (raw, commands) = (&device.raw, recording.commands);
        let [width, height] = target.size;
        let drawing = (
            vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
            vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::COLOR_ATTACHMENT_READ,
        );
        let before = vk::ImageMemoryBarrier2::default()
            .src_stage_mask(drawing.0)
            .dst_stage_mask(drawing.0)
            .dst_access_mask(drawing.1)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(target.image)
            .subresource_range(COLOR);
        let after = vk::ImageMemoryBarrier2 {
            src_access_mask: drawing.1,
            dst_stage_mask: vk::PipelineStageFlags2::ALL_COMMANDS,
            dst_access_mask: vk::AccessFlags2::MEMORY_READ,
            old_layout: vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            new_layout: target.then,
            ..before
        };
        let area = vk::Rect2D {
            offset: vk::Offset2D::default(),
            extent: vk::Extent2D { width, height },
        };
        let black = vk::ClearValue {
            color: vk::ClearColorValue {
                float32: [0.0, 0.0, 0.0, 1.0],
            },
        };
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(target.view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(black)];
        let rendering = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&attachments);
        let viewport = vk::Viewport {
            width: width as f32,
            height: height as f32,
            max_depth: 1.0,
            ..vk::Viewport::default()
        };
        let point = vk::PipelineBindPoint::GRAPHICS;
        let layout = self.layout.pipeline;
        // SAFETY: the command buffer is being recorded; all objects are kept alive, layouts follow
        // each other, and the overlay has checked its indices.
        unsafe {
            let barriers = [before];
            let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
            raw.cmd_pipeline_barrier2(commands, &info);
            raw.cmd_begin_rendering(commands, &rendering);
            raw.cmd_bind_pipeline(commands, point, self.raw);
            raw.cmd_set_viewport(commands, 0, &[viewport]);
            let stage = vk::ShaderStageFlags::VERTEX;
            raw.cmd_push_constants(commands, layout, stage, 0, push_constants);
            raw.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw()], &[0]);
            raw.cmd_bind_index_buffer(commands, indices.raw(), 0, vk::IndexType::UINT32);
            for draw in draws {
                let [left, top, right, bottom] = draw.clip;
                let (right, bottom) = (right.min(width), bottom.min(height));
                if left >= right || top >= bottom {
                    continue;
                }
                let scissor = vk::Rect2D {
                    offset: vk::Offset2D {
                        x: left as i32,
                        y: top as i32,
                    },
                    extent: vk::Extent2D {
                        width: right - left,
                        height: bottom - top,
                    },
                };
                raw.cmd_set_scissor(commands, 0, &[scissor]);
                let sets = [draw.texture.set.raw];
                raw.cmd_bind_descriptor_sets(commands, point, layout, 0, &sets, &[]);
                let [first, count] = draw.indices;
                raw.cmd_draw_indexed(commands, count, 1, first, draw.first_vertex, 0);
            }
            raw.cmd_end_rendering(commands);
            let barriers = [after];
            let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
            raw.cmd_pipeline_barrier2(commands, &info);
        }
        recording.keep(Arc::clone(vertices));
        recording.keep(Arc::clone(indices));
        recording.keep(Arc::clone(self));
        recording.keep(target.owner.clone());
        for draw in draws {
            recording.keep(Arc::clone(&draw.texture));
        }
    }
}

impl Drop for RasterPipeline {
    fn drop(&mut self) {
        let raw = &self.layout.device.raw;
        // SAFETY: recordings and textures that use it hold an `Arc` of it. Destroying null handles is
        // allowed.
        unsafe {
            raw.destroy_pipeline(self.raw, None);
            for sampler in self.samplers {
                raw.destroy_sampler(sampler, None);
            }
        }
    }
}
