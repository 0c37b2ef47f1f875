//! Pipelines, the shader binding table, descriptors and dispatch.

use super::{Access, Buffer, Device, Error, Image, Limits, Named, Recording, Tlas, Usage};
use ash::vk;
use std::sync::{Arc, PoisonError, Weak};

/// Values of specialization constants, by constant id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Specialization(pub Vec<u32>);

/// SPIR-V of one ray-tracing pipeline.
pub struct RayTracingShaders<'a> {
    /// Ray generation.
    pub raygen: &'a [u32],
    /// Miss shaders, by miss index.
    pub miss: &'a [&'a [u32]],
    /// Closest hit of every hit group.
    pub closest_hit: &'a [u32],
    /// Any hit of the hit groups after the first, which is opaque.
    pub any_hit: &'a [&'a [u32]],
}

pub(super) struct Layout {
    pub(super) sets: vk::DescriptorSetLayout,
    pub(super) pipeline: vk::PipelineLayout,
    pub(super) device: Arc<Device>,
}

impl Layout {
    pub(super) fn new(
        device: &Arc<Device>,
        bindings: &[vk::DescriptorSetLayoutBinding<'_>],
        push_constants: u32,
        stages: vk::ShaderStageFlags,
    ) -> Result<Self, Error> {
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(bindings);
        // SAFETY: valid create infos; the value made at once owns both handles.
        unsafe {
            let sets = device
                .raw
                .create_descriptor_set_layout(&info, None)
                .named("vkCreateDescriptorSetLayout")?;
            let mut layout = Self {
                sets,
                pipeline: vk::PipelineLayout::null(),
                device: device.clone(),
            };
            let layouts = [sets];
            let ranges = [vk::PushConstantRange::default()
                .stage_flags(stages)
                .size(push_constants)];
            // A range of no bytes is not allowed.
            let ranges = &ranges[..usize::from(push_constants > 0)];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&layouts)
                .push_constant_ranges(ranges);
            layout.pipeline = device
                .raw
                .create_pipeline_layout(&info, None)
                .named("vkCreatePipelineLayout")?;
            Ok(layout)
        }
    }
}

impl Drop for Layout {
    fn drop(&mut self) {
        // SAFETY: pipelines and sets made from it are gone or do not need it any more.
        unsafe {
            self.device.raw.destroy_pipeline_layout(self.pipeline, None);
            self.device
                .raw
                .destroy_descriptor_set_layout(self.sets, None);
        }
    }
}

/// Shader modules that are only needed while a pipeline is made.
pub(super) struct Modules<'a> {
    raw: Vec<vk::ShaderModule>,
    device: &'a Device,
}

impl<'a> Modules<'a> {
    pub(super) fn new(device: &'a Device) -> Self {
        Self {
            raw: Vec::new(),
            device,
        }
    }

    pub(super) fn add(&mut self, code: &[u32]) -> Result<vk::ShaderModule, Error> {
        let info = vk::ShaderModuleCreateInfo::default().code(code);
        // SAFETY: the SPIR-V comes from our own build.
        let module = unsafe { self.device.raw.create_shader_module(&info, None) }
            .named("vkCreateShaderModule")?;
        self.raw.push(module);
        Ok(module)
    }
}

impl Drop for Modules<'_> {
    fn drop(&mut self) {
        for &module in &self.raw {
            // SAFETY: pipelines do not need their modules once made.
            unsafe { self.device.raw.destroy_shader_module(module, None) };
        }
    }
}

/// Where the shader binding tables of a pipeline lie in one buffer, in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TableLayout {
    /// Bytes between entries.
    stride: u64,
    /// Start of the ray generation, miss and hit tables.
    starts: [u64; 3],
    /// Sizes of the same.
    sizes: [u64; 3],
    /// Bytes in all.
    total: u64,
}

impl TableLayout {
    /// Lays out one ray generation, `miss` and `hit` entries of a bare handle each.
    ///
    /// Entries are aligned to the handle alignment, tables to the base alignment; the ray
    /// generation table's size must equal its stride (Vulkan 1.3, `vkCmdTraceRaysKHR`).
    fn new(limits: &Limits, miss: u64, hit: u64) -> Self {
        let base = u64::from(limits.group_base_alignment);
        let stride = u64::from(limits.group_handle_size)
            .next_multiple_of(u64::from(limits.group_handle_alignment));
        let sizes = [stride, miss * stride, hit * stride];
        let mut starts = [0; 3];
        let mut end = 0;
        for (start, size) in starts.iter_mut().zip(sizes) {
            *start = end;
            end = (end + size).next_multiple_of(base);
        }
        Self {
            stride,
            starts,
            sizes,
            total: end,
        }
    }
}

/// A ray-tracing pipeline with its shader binding table.
///
/// Set 0: binding 0 the top-level structure, binding 1 an array of sampled images.
pub struct RayTracingPipeline {
    raw: vk::Pipeline,
    layout: Layout,
    _table: Arc<Buffer>,
    regions: [vk::StridedDeviceAddressRegionKHR; 3],
    textures: u32,
}

const RAY_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::RAYGEN_KHR.as_raw()
        | vk::ShaderStageFlags::CLOSEST_HIT_KHR.as_raw()
        | vk::ShaderStageFlags::ANY_HIT_KHR.as_raw()
        | vk::ShaderStageFlags::MISS_KHR.as_raw(),
);

impl RayTracingPipeline {
    /// The pipeline of a device that was made for the same numbers, while anyone uses it; else makes one.
    /// A compiler takes its time, and a level that is imported anew asks for the same shaders.
    ///
    /// # Errors
    /// What `make` says.
    pub fn shared(
        device: &Arc<Device>,
        made_for: Vec<u32>,
        make: impl FnOnce() -> Result<Arc<Self>, Error>,
    ) -> Result<Arc<Self>, Error> {
        let known = |made_for| {
            let mut all = device
                .pipelines
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            all.retain(|_, pipeline: &mut Weak<Self>| pipeline.strong_count() > 0);
            all.get(made_for).and_then(Weak::upgrade)
        };
        if let Some(pipeline) = known(&made_for) {
            return Ok(pipeline);
        }
        // Not under the lock: two who want the same at once each make one.
        let pipeline = make()?;
        let mut all = device
            .pipelines
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        all.insert(made_for, Arc::downgrade(&pipeline));
        Ok(pipeline)
    }

    /// Makes a pipeline that can use `textures` images and `push_constants` bytes.
    ///
    /// # Errors
    /// When there are more textures than the device allows, or a call fails.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        shaders: &RayTracingShaders<'_>,
        specialization: &Specialization,
        textures: u32,
        push_constants: u32,
    ) -> Result<Arc<Self>, Error> {
        let allowed = device.limits().max_sampled_images;
        if textures > allowed {
            return Err(Error::Limit {
                what: "textures",
                needed: u64::from(textures),
                allowed: u64::from(allowed),
            });
        }
        let bindings = [
            vk::DescriptorSetLayoutBinding::default()
                .binding(crate::abi::BINDING_TLAS)
                .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
                .descriptor_count(1)
                .stage_flags(RAY_STAGES),
            vk::DescriptorSetLayoutBinding::default()
                .binding(crate::abi::BINDING_TEXTURES)
                .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
                .descriptor_count(textures)
                .stage_flags(RAY_STAGES),
        ];
        let layout = Layout::new(device, &bindings, push_constants, RAY_STAGES)?;

        let mut modules = Modules::new(device);
        let entries: Vec<_> = (0..specialization.0.len() as u32)
            .map(|i| vk::SpecializationMapEntry {
                constant_id: i,
                offset: 4 * i,
                size: 4,
            })
            .collect();
        let data: Vec<u8> = specialization
            .0
            .iter()
            .flat_map(|v| v.to_ne_bytes())
            .collect();
        let constants = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(&data);
        let mut stages = Vec::new();
        let mut groups = Vec::new();
        let mut stage = |code: &[u32], kind: vk::ShaderStageFlags| -> Result<u32, Error> {
            stages.push(
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(kind)
                    .module(modules.add(code)?)
                    .name(c"main")
                    .specialization_info(&constants),
            );
            Ok(stages.len() as u32 - 1)
        };
        let group = || {
            vk::RayTracingShaderGroupCreateInfoKHR::default()
                .general_shader(vk::SHADER_UNUSED_KHR)
                .closest_hit_shader(vk::SHADER_UNUSED_KHR)
                .any_hit_shader(vk::SHADER_UNUSED_KHR)
                .intersection_shader(vk::SHADER_UNUSED_KHR)
        };
        let general = vk::RayTracingShaderGroupTypeKHR::GENERAL;
        let triangles = vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP;
        let raygen = stage(shaders.raygen, vk::ShaderStageFlags::RAYGEN_KHR)?;
        groups.push(group().ty(general).general_shader(raygen));
        for code in shaders.miss {
            let miss = stage(code, vk::ShaderStageFlags::MISS_KHR)?;
            groups.push(group().ty(general).general_shader(miss));
        }
        let closest = stage(shaders.closest_hit, vk::ShaderStageFlags::CLOSEST_HIT_KHR)?;
        groups.push(group().ty(triangles).closest_hit_shader(closest));
        for code in shaders.any_hit {
            let any = stage(code, vk::ShaderStageFlags::ANY_HIT_KHR)?;
            groups.push(
                group()
                    .ty(triangles)
                    .closest_hit_shader(closest)
                    .any_hit_shader(any),
            );
        }

        let info = vk::RayTracingPipelineCreateInfoKHR::default()
            .stages(&stages)
            .groups(&groups)
            // Rays are traced from the ray generation shader alone.
            .max_pipeline_ray_recursion_depth(1)
            .layout(layout.pipeline);
        // SAFETY: everything the info points to lives until the call returns.
        let raw = unsafe {
            device
                .ray_tracing
                .create_ray_tracing_pipelines(
                    vk::DeferredOperationKHR::null(),
                    vk::PipelineCache::null(),
                    &[info],
                    None,
                )
                .map_err(|(_, result)| result)
                .named("vkCreateRayTracingPipelinesKHR")?[0]
        };
        device.name(raw, name);
        let hit_groups = 1 + shaders.any_hit.len() as u64;
        let miss_groups = shaders.miss.len() as u64;
        let built = build_table(device, raw, miss_groups, hit_groups);
        let (table, regions) = match built {
            Ok(done) => done,
            Err(error) => {
                // SAFETY: just made, never used.
                unsafe { device.raw.destroy_pipeline(raw, None) };
                return Err(error);
            }
        };
        Ok(Arc::new(Self {
            raw,
            layout,
            _table: table,
            regions,
            textures,
        }))
    }

    /// Records one thread per pixel of `size`.
    ///
    /// # Errors
    /// When that is more threads than the device allows.
    pub fn record_trace(
        self: &Arc<Self>,
        recording: &mut Recording,
        set: &Arc<DescriptorSet>,
        push_constants: &[u8],
        size: [u32; 2],
    ) -> Result<(), Error> {
        let device = recording.device.clone();
        let threads = u64::from(size[0]) * u64::from(size[1]);
        let allowed = u64::from(device.limits().max_ray_dispatch);
        if threads > allowed {
            return Err(Error::Limit {
                what: "pixels",
                needed: threads,
                allowed,
            });
        }
        recording.access(&[Access::TraceRead, Access::TraceWrite]);
        let commands = recording.commands;
        let point = vk::PipelineBindPoint::RAY_TRACING_KHR;
        let none = vk::StridedDeviceAddressRegionKHR::default();
        // SAFETY: pipeline, table and set are kept alive and fit each other.
        unsafe {
            device.raw.cmd_bind_pipeline(commands, point, self.raw);
            let layout = self.layout.pipeline;
            device
                .raw
                .cmd_bind_descriptor_sets(commands, point, layout, 0, &[set.raw], &[]);
            device
                .raw
                .cmd_push_constants(commands, layout, RAY_STAGES, 0, push_constants);
            let [raygen, miss, hit] = &self.regions;
            device
                .ray_tracing
                .cmd_trace_rays(commands, raygen, miss, hit, &none, size[0], size[1], 1);
        }
        recording.keep(self.clone());
        recording.keep(set.clone());
        Ok(())
    }
}

impl Drop for RayTracingPipeline {
    fn drop(&mut self) {
        // SAFETY: recordings that use the pipeline hold an `Arc` of it.
        unsafe { self.layout.device.raw.destroy_pipeline(self.raw, None) };
    }
}

type Table = (Arc<Buffer>, [vk::StridedDeviceAddressRegionKHR; 3]);

/// Builds the shader binding table of a pipeline whose groups are one ray generation group, then
/// the miss groups, then the hit groups.
fn build_table(
    device: &Arc<Device>,
    pipeline: vk::Pipeline,
    miss: u64,
    hit: u64,
) -> Result<Table, Error> {
    let limits = device.limits();
    let layout = TableLayout::new(limits, miss, hit);
    let size = limits.group_handle_size as usize;
    let groups = (1 + miss + hit) as usize;
    // SAFETY: the pipeline has this many groups.
    let handles = unsafe {
        device
            .ray_tracing
            .get_ray_tracing_shader_group_handles(pipeline, 0, groups as u32, groups * size)
            .named("vkGetRayTracingShaderGroupHandlesKHR")?
    };
    let mut data = vec![0u8; layout.total as usize];
    let table_of = |group: u64| match group {
        0 => (0, 0),
        g if g <= miss => (1, g - 1),
        g => (2, g - 1 - miss),
    };
    for (group, handle) in handles.chunks_exact(size).enumerate() {
        let (table, entry) = table_of(group as u64);
        let at = (layout.starts[table] + entry * layout.stride) as usize;
        data[at..at + size].copy_from_slice(handle);
    }
    let usage = Usage::SHADER_BINDING_TABLE_KHR;
    let buffer = Buffer::with_data(device, "shader binding table", usage, &data)?;
    let first = buffer.address();
    let region = |i: usize| vk::StridedDeviceAddressRegionKHR {
        device_address: first + layout.starts[i],
        stride: layout.stride,
        size: layout.sizes[i],
    };
    Ok((buffer, [region(0), region(1), region(2)]))
}

/// What a ray-tracing pipeline reads besides buffers: the scene's structure and textures.
pub struct DescriptorSet {
    pub(super) raw: vk::DescriptorSet,
    pool: vk::DescriptorPool,
    _textures: Vec<Arc<Image>>,
    _tlas: Option<Arc<Tlas>>,
    device: Arc<Device>,
}

impl DescriptorSet {
    /// Makes the set of a pipeline.
    ///
    /// # Errors
    /// When a call fails.
    pub fn new(
        pipeline: &RayTracingPipeline,
        tlas: &Arc<Tlas>,
        textures: Vec<Arc<Image>>,
    ) -> Result<Arc<Self>, Error> {
        assert_eq!(
            textures.len(),
            pipeline.textures as usize,
            "one texture per descriptor"
        );
        let device = &pipeline.layout.device;
        let sizes = [
            vk::DescriptorPoolSize {
                ty: vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
                descriptor_count: 1,
            },
            vk::DescriptorPoolSize {
                ty: vk::DescriptorType::SAMPLED_IMAGE,
                descriptor_count: pipeline.textures,
            },
        ];
        let mut set = Self::allocate(device, &sizes, pipeline.layout.sets, textures)?;
        set._tlas = Some(tlas.clone());
        let tlas = [*tlas.raw()];
        let mut structures = vk::WriteDescriptorSetAccelerationStructureKHR::default()
            .acceleration_structures(&tlas);
        let images: Vec<_> = set
            ._textures
            .iter()
            .map(|image| {
                vk::DescriptorImageInfo::default()
                    .image_view(image.view())
                    .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)
            })
            .collect();
        let writes = [
            vk::WriteDescriptorSet::default()
                .dst_set(set.raw)
                .dst_binding(crate::abi::BINDING_TLAS)
                .descriptor_type(vk::DescriptorType::ACCELERATION_STRUCTURE_KHR)
                .descriptor_count(1)
                .push_next(&mut structures),
            vk::WriteDescriptorSet::default()
                .dst_set(set.raw)
                .dst_binding(crate::abi::BINDING_TEXTURES)
                .descriptor_type(vk::DescriptorType::SAMPLED_IMAGE)
                .image_info(&images),
        ];
        // SAFETY: the set is new and unused, what it points to is alive.
        unsafe { device.raw.update_descriptor_sets(&writes, &[]) };
        Ok(Arc::new(set))
    }

    pub(super) fn allocate(
        device: &Arc<Device>,
        sizes: &[vk::DescriptorPoolSize],
        layout: vk::DescriptorSetLayout,
        textures: Vec<Arc<Image>>,
    ) -> Result<Self, Error> {
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(sizes);
        // SAFETY: valid create infos; the value made at once owns the pool and with it the set.
        unsafe {
            let pool = device
                .raw
                .create_descriptor_pool(&info, None)
                .named("vkCreateDescriptorPool")?;
            let mut set = Self {
                raw: vk::DescriptorSet::null(),
                pool,
                _textures: textures,
                _tlas: None,
                device: device.clone(),
            };
            let layouts = [layout];
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&layouts);
            set.raw = device
                .raw
                .allocate_descriptor_sets(&info)
                .named("vkAllocateDescriptorSets")?[0];
            Ok(set)
        }
    }
}

impl Drop for DescriptorSet {
    fn drop(&mut self) {
        // SAFETY: recordings that use the set hold an `Arc` of it.
        unsafe { self.device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}

/// A compute pipeline over storage buffers: set 0, bindings 0 to `buffers - 1`.
pub struct ComputePipeline {
    raw: vk::Pipeline,
    layout: Layout,
    buffers: u32,
}

impl ComputePipeline {
    /// Makes a pipeline.
    ///
    /// # Errors
    /// When a call fails.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        code: &[u32],
        buffers: u32,
        push_constants: u32,
    ) -> Result<Arc<Self>, Error> {
        let stage = vk::ShaderStageFlags::COMPUTE;
        let bindings: Vec<_> = (0..buffers)
            .map(|i| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(i)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .descriptor_count(1)
                    .stage_flags(stage)
            })
            .collect();
        let layout = Layout::new(device, &bindings, push_constants, stage)?;
        let mut modules = Modules::new(device);
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(stage)
                    .module(modules.add(code)?)
                    .name(c"main"),
            )
            .layout(layout.pipeline);
        // SAFETY: everything the info points to lives until the call returns.
        let raw = unsafe {
            device
                .raw
                .create_compute_pipelines(vk::PipelineCache::null(), &[info], None)
                .map_err(|(_, result)| result)
                .named("vkCreateComputePipelines")?[0]
        };
        device.name(raw, name);
        Ok(Arc::new(Self {
            raw,
            layout,
            buffers,
        }))
    }

    /// Records a dispatch of `groups` workgroups over byte ranges of buffers, one per binding.
    ///
    /// # Errors
    /// When a range is larger than the device allows, or a call fails.
    pub fn record_dispatch(
        self: &Arc<Self>,
        recording: &mut Recording,
        buffers: &[(&Arc<Buffer>, u64)],
        push_constants: &[u8],
        groups: [u32; 2],
    ) -> Result<(), Error> {
        assert_eq!(
            buffers.len(),
            self.buffers as usize,
            "one buffer per binding"
        );
        let device = recording.device.clone();
        let allowed = u64::from(device.limits().max_storage_range);
        for &(_, range) in buffers {
            if range > allowed {
                return Err(Error::Limit {
                    what: "bytes in one buffer",
                    needed: range,
                    allowed,
                });
            }
        }
        let sizes = [vk::DescriptorPoolSize {
            ty: vk::DescriptorType::STORAGE_BUFFER,
            descriptor_count: self.buffers,
        }];
        let set = Arc::new(DescriptorSet::allocate(
            &device,
            &sizes,
            self.layout.sets,
            Vec::new(),
        )?);
        let infos: Vec<_> = buffers
            .iter()
            .map(|(b, range)| {
                [vk::DescriptorBufferInfo::default()
                    .buffer(b.raw())
                    .offset(0)
                    .range(*range)]
            })
            .collect();
        let writes: Vec<_> = infos
            .iter()
            .enumerate()
            .map(|(i, info)| {
                vk::WriteDescriptorSet::default()
                    .dst_set(set.raw)
                    .dst_binding(i as u32)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .buffer_info(info)
            })
            .collect();
        recording.access(&[Access::ComputeRead, Access::ComputeWrite]);
        let commands = recording.commands;
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: pipeline, set and buffers are kept alive; ranges were checked.
        unsafe {
            device.raw.update_descriptor_sets(&writes, &[]);
            device.raw.cmd_bind_pipeline(commands, point, self.raw);
            let layout = self.layout.pipeline;
            device
                .raw
                .cmd_bind_descriptor_sets(commands, point, layout, 0, &[set.raw], &[]);
            if !push_constants.is_empty() {
                device.raw.cmd_push_constants(
                    commands,
                    layout,
                    vk::ShaderStageFlags::COMPUTE,
                    0,
                    push_constants,
                );
            }
            device.raw.cmd_dispatch(commands, groups[0], groups[1], 1);
        }
        for (buffer, _) in buffers {
            recording.keep(Arc::clone(buffer));
        }
        recording.keep(set);
        recording.keep(self.clone());
        Ok(())
    }
}

impl Drop for ComputePipeline {
    fn drop(&mut self) {
        // SAFETY: recordings that use the pipeline hold an `Arc` of it.
        unsafe { self.layout.device.raw.destroy_pipeline(self.raw, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits(size: u32, handle: u32, base: u32) -> Limits {
        Limits {
            group_handle_size: size,
            group_handle_alignment: handle,
            group_base_alignment: base,
            scratch_alignment: 128,
            max_primitives: 1 << 29,
            max_instances: 1 << 24,
            max_ray_dispatch: 1 << 30,
            max_sampled_images: 1 << 20,
            max_image_size: 16384,
            max_storage_range: 1 << 27,
            timestamp_period: 1.0,
            draws: true,
        }
    }

    #[test]
    fn tables_respect_every_alignment() {
        // lavapipe, NVIDIA, AMD (RADV), and a device with large alignments.
        for (size, handle, base) in [(32, 16, 32), (32, 32, 64), (32, 32, 32), (48, 64, 256)] {
            let layout = TableLayout::new(&limits(size, handle, base), 2, 2);
            assert_eq!(layout.stride % u64::from(handle), 0);
            assert!(layout.stride >= u64::from(size));
            assert_eq!(
                layout.sizes,
                [layout.stride, 2 * layout.stride, 2 * layout.stride]
            );
            for i in 0..3 {
                assert_eq!(layout.starts[i] % u64::from(base), 0);
                let end = layout.starts.get(i + 1).copied().unwrap_or(layout.total);
                assert!(layout.starts[i] + layout.sizes[i] <= end);
            }
        }
    }
}
