//! Acceleration structures: bottom level per mesh, top level over instances.

use super::{Access, Buffer, Device, Error, Location, Named, Recording, Usage};
use ash::vk;
use glam::Affine3A;
use std::sync::Arc;

/// An acceleration structure in a buffer of its own.
struct Accel {
    raw: vk::AccelerationStructureKHR,
    buffer: Arc<Buffer>,
    address: u64,
}

impl Accel {
    /// Memory for the structure of a mesh.
    fn bottom_level(device: &Arc<Device>, name: &str, size: u64) -> Result<Self, Error> {
        let kind = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
        Self::new(device, name, size, kind)
    }

    fn new(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        kind: vk::AccelerationStructureTypeKHR,
    ) -> Result<Self, Error> {
        let buffer = Buffer::new(
            device,
            name,
            size,
            Usage::ACCELERATION_STRUCTURE_STORAGE_KHR,
            Location::Device,
        )?;
        let info = vk::AccelerationStructureCreateInfoKHR::default()
            .buffer(buffer.raw())
            .size(size)
            .ty(kind);
        // SAFETY: the buffer has the size asked for and is held by the structure.
        unsafe {
            let raw = device
                .accel
                .create_acceleration_structure(&info, None)
                .named("vkCreateAccelerationStructureKHR")?;
            device.name(raw, name);
            let info = vk::AccelerationStructureDeviceAddressInfoKHR::default()
                .acceleration_structure(raw);
            let address = device
                .accel
                .get_acceleration_structure_device_address(&info);
            Ok(Self {
                raw,
                buffer,
                address,
            })
        }
    }
}

impl Drop for Accel {
    fn drop(&mut self) {
        // SAFETY: recordings that use the structure hold an `Arc` of its owner.
        unsafe {
            self.buffer
                .device()
                .accel
                .destroy_acceleration_structure(self.raw, None);
        }
    }
}

/// Triangles of one kind.
#[derive(Clone, Copy, Debug)]
pub struct BlasGeometry {
    /// The first one in its [`BlasInput`].
    pub first: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// Without any-hit shader.
    pub opaque: bool,
    /// The any-hit shader is called at most once for each triangle and ray.
    pub once: bool,
}

/// What a bottom-level structure is built from.
#[derive(Clone)]
pub struct BlasInput {
    /// For debuggers.
    pub name: String,
    /// Positions, three floats each.
    pub positions: Arc<Buffer>,
    /// Byte offset of the first position.
    pub position_offset: u64,
    /// Number of positions, > 0.
    pub position_count: u32,
    /// 32-bit indices relative to the first position, and the byte offset of the first triangle's. Else
    /// there are three positions for each triangle, in their order.
    pub indices: Option<(Arc<Buffer>, u64)>,
    /// Parts; hit shaders see their position in this list as geometry index.
    pub geometries: Vec<BlasGeometry>,
}

/// A bottom-level acceleration structure: one mesh.
pub struct Blas {
    accel: Accel,
    /// Bytes of scratch memory for a build and for an update, of those that frames build.
    scratch: [u64; 2],
}

/// What a frame does to a bottom-level structure made by [`Blas::for_frames`].
pub struct Rebuild {
    /// The structure.
    pub blas: Arc<Blas>,
    /// Its triangles now; no more of them than it was made for.
    pub input: BlasInput,
    /// Not built but updated: from this one, which was built of as many triangles. What comes out
    /// depends on the two alone, not on what the structure was before.
    pub from: Option<Arc<Blas>>,
}

impl Blas {
    /// Builds and compacts one structure per input, in one go. They are built for fast tracing.
    ///
    /// Spans `build BLAS` and `compact BLAS` time the two steps; returns the timings too.
    ///
    /// # Errors
    /// When a mesh has more triangles than the device allows, or there is no memory.
    pub fn build(
        device: &Arc<Device>,
        inputs: &[BlasInput],
    ) -> Result<(Vec<Arc<Self>>, Vec<super::Timing>), Error> {
        let flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE
            | vk::BuildAccelerationStructureFlagsKHR::ALLOW_COMPACTION;
        let geometries: Vec<Vec<_>> = inputs.iter().map(geometry_structs).collect();
        let counts: Vec<Vec<u32>> = inputs
            .iter()
            .map(|i| triangle_counts(device, i))
            .collect::<Result<_, _>>()?;
        let ranges: Vec<Vec<_>> = inputs
            .iter()
            .map(|i| i.geometries.iter().map(|g| range(g.triangles)).collect())
            .collect();

        let alignment = u64::from(device.limits().scratch_alignment);
        let mut infos = Vec::with_capacity(inputs.len());
        let mut full: Vec<Arc<Self>> = Vec::with_capacity(inputs.len());
        let mut scratch_offsets = Vec::with_capacity(inputs.len());
        let mut scratch_size = 0;
        for ((input, geometry), counts) in inputs.iter().zip(&geometries).zip(&counts) {
            let info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
                .ty(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL)
                .flags(flags)
                .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
                .geometries(geometry);
            let sizes = build_sizes(device, &info, counts);
            let accel =
                Accel::bottom_level(device, &input.name, sizes.acceleration_structure_size)?;
            infos.push(info.dst_acceleration_structure(accel.raw));
            scratch_offsets.push(scratch_size);
            scratch_size += sizes.build_scratch_size.next_multiple_of(alignment);
            full.push(Arc::new(Self {
                accel,
                scratch: [0; 2],
            }));
        }
        let scratch = scratch_buffer(device, scratch_size)?;
        let first = scratch.address().next_multiple_of(alignment);
        for (info, offset) in infos.iter_mut().zip(&scratch_offsets) {
            info.scratch_data = vk::DeviceOrHostAddressKHR {
                device_address: first + offset,
            };
        }

        let queries = CompactedSizes::new(device, inputs.len() as u32)?;
        let mut recording = Recording::begin(device)?;
        recording.span("build BLAS", |r| {
            r.access(&[Access::BuildRead, Access::BuildWrite]);
            let ranges: Vec<&[_]> = ranges.iter().map(Vec::as_slice).collect();
            // SAFETY: inputs, scratch memory and structures are kept alive below; sizes are those
            // the driver asked for; scratch areas are aligned and do not overlap.
            unsafe {
                device
                    .accel
                    .cmd_build_acceleration_structures(r.commands, &infos, &ranges);
            }
            r.access(&[Access::BuildRead]);
            let raw: Vec<_> = full.iter().map(|b| b.accel.raw).collect();
            // SAFETY: the structures were just built and allow compaction.
            unsafe {
                device.accel.cmd_write_acceleration_structures_properties(
                    r.commands,
                    &raw,
                    vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR,
                    queries.raw,
                    0,
                );
            }
            Ok(())
        })?;
        for (input, blas) in inputs.iter().zip(&full) {
            input.keep(&mut recording);
            recording.keep(blas.clone());
        }
        recording.keep(scratch);
        let mut timings = recording.submit_and_wait()?;

        let sizes = queries.read(inputs.len())?;
        let mut recording = Recording::begin(device)?;
        let compact = recording.span("compact BLAS", |r| {
            let mut compact = Vec::with_capacity(full.len());
            r.access(&[Access::BuildRead, Access::BuildWrite]);
            for ((input, blas), &size) in inputs.iter().zip(&full).zip(&sizes) {
                let accel = Accel::bottom_level(device, &input.name, size)?;
                let info = vk::CopyAccelerationStructureInfoKHR::default()
                    .src(blas.accel.raw)
                    .dst(accel.raw)
                    .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
                // SAFETY: the target has the size the driver reported for this source.
                unsafe {
                    device
                        .accel
                        .cmd_copy_acceleration_structure(r.commands, &info)
                };
                compact.push(Arc::new(Self {
                    accel,
                    scratch: [0; 2],
                }));
            }
            Ok(compact)
        })?;
        for blas in full.iter().chain(&compact) {
            recording.keep(blas.clone());
        }
        timings.extend(recording.submit_and_wait()?);
        Ok((compact, timings))
    }

    /// Makes room for a structure that frames build from as many triangles as `input` has, or fewer,
    /// or update. Nothing is built yet.
    ///
    /// # Errors
    /// When it has more triangles than the device allows, or there is no memory.
    pub fn for_frames(device: &Arc<Device>, input: &BlasInput) -> Result<Arc<Self>, Error> {
        let geometry = geometry_structs(input);
        let counts = triangle_counts(device, input)?;
        let sizes = build_sizes(device, &frames_info(&geometry), &counts);
        let accel = Accel::bottom_level(device, &input.name, sizes.acceleration_structure_size)?;
        let scratch = [sizes.build_scratch_size, sizes.update_scratch_size];
        Ok(Arc::new(Self { accel, scratch }))
    }

    /// Records builds and updates, all at once.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn record_rebuilds(
        recording: &mut Recording,
        rebuilds: &[Rebuild],
        scratch: &mut Scratch,
    ) -> Result<(), Error> {
        if rebuilds.is_empty() {
            return Ok(());
        }
        let device = recording.device.clone();
        let alignment = u64::from(device.limits().scratch_alignment);
        let mut size = 0;
        let offsets: Vec<u64> = (rebuilds.iter())
            .map(|r| {
                let at = size;
                let needed = r.blas.scratch[usize::from(r.from.is_some())];
                size += needed.next_multiple_of(alignment);
                at
            })
            .collect();
        let memory = scratch.at_least(&device, size)?;
        let first = memory.address().next_multiple_of(alignment);
        let geometries: Vec<Vec<_>> = rebuilds
            .iter()
            .map(|r| geometry_structs(&r.input))
            .collect();
        let ranges: Vec<Vec<_>> = (rebuilds.iter())
            .map(|r| {
                r.input
                    .geometries
                    .iter()
                    .map(|g| range(g.triangles))
                    .collect()
            })
            .collect();
        let infos: Vec<_> = (rebuilds.iter().zip(&geometries).zip(&offsets))
            .map(|((r, geometry), offset)| {
                let info = frames_info(geometry)
                    .dst_acceleration_structure(r.blas.accel.raw)
                    .scratch_data(vk::DeviceOrHostAddressKHR {
                        device_address: first + offset,
                    });
                match &r.from {
                    None => info,
                    Some(from) => info
                        .mode(vk::BuildAccelerationStructureModeKHR::UPDATE)
                        .src_acceleration_structure(from.accel.raw),
                }
            })
            .collect();
        let ranges: Vec<&[_]> = ranges.iter().map(Vec::as_slice).collect();
        recording.access(&[Access::BuildRead, Access::BuildWrite]);
        // SAFETY: inputs, scratch memory and structures are kept alive below; sizes are those the
        // driver asked for or more; scratch areas are aligned and do not overlap; an update has the
        // geometry of what it updates from.
        unsafe {
            device
                .accel
                .cmd_build_acceleration_structures(recording.commands, &infos, &ranges);
        }
        recording.keep(memory);
        for r in rebuilds {
            r.input.keep(recording);
            recording.keep((r.blas.clone(), r.from.clone()));
        }
        Ok(())
    }

    /// Bytes of device memory.
    #[must_use]
    pub fn size(&self) -> u64 {
        self.accel.buffer.size()
    }
}

impl BlasInput {
    fn keep(&self, recording: &mut Recording) {
        recording.keep((self.positions.clone(), self.indices.clone()));
    }
}

/// Scratch memory that frames share; it grows and never shrinks.
#[derive(Default)]
pub struct Scratch {
    buffer: Option<Arc<Buffer>>,
}

impl Scratch {
    fn at_least(&mut self, device: &Arc<Device>, size: u64) -> Result<Arc<Buffer>, Error> {
        let enough = size + u64::from(device.limits().scratch_alignment);
        match &self.buffer {
            Some(buffer) if buffer.size() >= enough => Ok(buffer.clone()),
            _ => {
                let buffer = scratch_buffer(device, size.next_power_of_two())?;
                self.buffer = Some(buffer.clone());
                Ok(buffer)
            }
        }
    }
}

/// How frames build bottom-level structures.
fn frames_info<'a>(
    geometry: &'a [vk::AccelerationStructureGeometryKHR<'a>],
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL)
        .flags(
            vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_BUILD
                | vk::BuildAccelerationStructureFlagsKHR::ALLOW_UPDATE,
        )
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(geometry)
}

/// A query pool for compacted sizes.
struct CompactedSizes {
    raw: vk::QueryPool,
    device: Arc<Device>,
}

impl CompactedSizes {
    fn new(device: &Arc<Device>, count: u32) -> Result<Self, Error> {
        let info = vk::QueryPoolCreateInfo::default()
            .query_type(vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR)
            .query_count(count.max(1));
        // SAFETY: a valid create info; queries are reset before their first use.
        unsafe {
            let raw = device
                .raw
                .create_query_pool(&info, None)
                .named("vkCreateQueryPool")?;
            device.raw.reset_query_pool(raw, 0, count.max(1));
            Ok(Self {
                raw,
                device: device.clone(),
            })
        }
    }

    fn read(&self, count: usize) -> Result<Vec<u64>, Error> {
        let mut sizes = vec![0u64; count];
        if count > 0 {
            // SAFETY: the recording that wrote them has ended.
            unsafe {
                self.device
                    .raw
                    .get_query_pool_results(
                        self.raw,
                        0,
                        &mut sizes,
                        vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT,
                    )
                    .named("vkGetQueryPoolResults")?;
            }
        }
        Ok(sizes)
    }
}

impl Drop for CompactedSizes {
    fn drop(&mut self) {
        // SAFETY: the recording that used the pool was waited for.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}

/// A mesh placed in the world.
#[derive(Clone)]
pub struct TlasInstance {
    /// The mesh.
    pub blas: Arc<Blas>,
    /// Local to world space.
    pub transform: Affine3A,
    /// What hit shaders see as custom index; 24 bits, of which scenes use the lower 21 as number.
    pub custom_index: u32,
    /// Rays whose mask has a bit in common meet it.
    pub mask: u8,
    /// First hit group of the mesh.
    pub hit_group: u32,
}

/// The top-level acceleration structure: rebuilt when instances move.
pub struct Tlas {
    accel: Accel,
    scratch: Arc<Buffer>,
    capacity: u32,
}

impl Tlas {
    /// Makes room for so many instances. Nothing is built yet.
    ///
    /// # Errors
    /// When there are more instances than the device allows, or there is no memory.
    pub fn new(device: &Arc<Device>, capacity: u32) -> Result<Arc<Self>, Error> {
        check_limit(
            "instances",
            u64::from(capacity),
            device
                .limits()
                .max_instances
                .min(u64::from(crate::abi::INSTANCE_INDEX) + 1),
        )?;
        let geometry = [instance_geometry(0)];
        let sizes = build_sizes(device, &Self::build_info(&geometry), &[capacity]);
        Ok(Arc::new(Self {
            accel: Accel::new(
                device,
                "TLAS",
                sizes.acceleration_structure_size,
                vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            )?,
            scratch: scratch_buffer(device, sizes.build_scratch_size)?,
            capacity,
        }))
    }

    /// Most instances that it has room for.
    #[must_use]
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    fn build_info<'a>(
        geometry: &'a [vk::AccelerationStructureGeometryKHR<'a>],
    ) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(vk::AccelerationStructureTypeKHR::TOP_LEVEL)
            .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(geometry)
    }

    /// Records a build from these instances, no more than it has room for. Span `rebuild TLAS`.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn record_build(
        self: &Arc<Self>,
        recording: &mut Recording,
        instances: &[TlasInstance],
    ) -> Result<(), Error> {
        assert!(instances.len() <= self.capacity as usize, "room for all");
        let device = recording.device.clone();
        let records: Vec<_> = instances.iter().map(instance_record).collect();
        // SAFETY: a plain C struct without padding, viewed as bytes.
        let bytes = unsafe {
            std::slice::from_raw_parts(records.as_ptr().cast::<u8>(), size_of_val(&records[..]))
        };
        let input = Buffer::with_data(
            &device,
            "TLAS instances",
            Usage::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR,
            bytes,
        )?;
        let geometry = [instance_geometry(input.address())];
        let alignment = u64::from(device.limits().scratch_alignment);
        let info = Self::build_info(&geometry)
            .dst_acceleration_structure(self.accel.raw)
            .scratch_data(vk::DeviceOrHostAddressKHR {
                device_address: self.scratch.address().next_multiple_of(alignment),
            });
        let ranges = [range(instances.len() as u32)];
        recording.span("rebuild TLAS", |r| {
            r.access(&[Access::BuildRead, Access::BuildWrite]);
            // SAFETY: instances, scratch memory and all structures are kept alive.
            unsafe {
                device
                    .accel
                    .cmd_build_acceleration_structures(r.commands, &[info], &[&ranges]);
            }
            Ok(())
        })?;
        recording.keep(input);
        recording.keep(self.clone());
        let used: Vec<Arc<Blas>> = instances.iter().map(|i| i.blas.clone()).collect();
        recording.keep(used);
        Ok(())
    }

    pub(super) fn raw(&self) -> &vk::AccelerationStructureKHR {
        &self.accel.raw
    }
}

fn check_limit(what: &'static str, needed: u64, allowed: u64) -> Result<(), Error> {
    if needed > allowed {
        Err(Error::Limit {
            what,
            needed,
            allowed,
        })
    } else {
        Ok(())
    }
}

/// Scratch memory with room to align its start.
fn scratch_buffer(device: &Arc<Device>, size: u64) -> Result<Arc<Buffer>, Error> {
    let size = size + u64::from(device.limits().scratch_alignment);
    Buffer::new(
        device,
        "build scratch",
        size,
        Usage::STORAGE_BUFFER,
        Location::Device,
    )
}

fn build_sizes(
    device: &Device,
    info: &vk::AccelerationStructureBuildGeometryInfoKHR<'_>,
    counts: &[u32],
) -> vk::AccelerationStructureBuildSizesInfoKHR<'static> {
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    // SAFETY: one count per geometry of `info`.
    unsafe {
        device.accel.get_acceleration_structure_build_sizes(
            vk::AccelerationStructureBuildTypeKHR::DEVICE,
            info,
            counts,
            &mut sizes,
        );
    }
    sizes
}

fn range(primitives: u32) -> vk::AccelerationStructureBuildRangeInfoKHR {
    vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(primitives)
}

/// Triangles by geometry; an error if the device allows fewer of them in a mesh.
fn triangle_counts(device: &Device, input: &BlasInput) -> Result<Vec<u32>, Error> {
    let counts: Vec<u32> = input.geometries.iter().map(|g| g.triangles).collect();
    let triangles = counts.iter().map(|&n| u64::from(n)).sum();
    let allowed = device.limits().max_primitives;
    check_limit("triangles in a mesh", triangles, allowed)?;
    Ok(counts)
}

fn geometry_structs(input: &BlasInput) -> Vec<vk::AccelerationStructureGeometryKHR<'static>> {
    const CORNER: u64 = 12;
    let positions = input.positions.address() + input.position_offset;
    input
        .geometries
        .iter()
        .map(|g| {
            let mut triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
                .vertex_format(vk::Format::R32G32B32_SFLOAT)
                .vertex_data(vk::DeviceOrHostAddressConstKHR {
                    device_address: positions,
                })
                .vertex_stride(CORNER)
                .max_vertex(input.position_count - 1)
                .index_type(vk::IndexType::NONE_KHR);
            match &input.indices {
                Some((indices, offset)) => {
                    triangles.index_type = vk::IndexType::UINT32;
                    triangles.index_data = vk::DeviceOrHostAddressConstKHR {
                        device_address: indices.address() + offset + u64::from(g.first) * 12,
                    };
                }
                None => {
                    triangles.vertex_data = vk::DeviceOrHostAddressConstKHR {
                        device_address: positions + u64::from(g.first) * 3 * CORNER,
                    };
                }
            }
            let flags = if g.opaque {
                vk::GeometryFlagsKHR::OPAQUE
            } else if g.once {
                vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION
            } else {
                vk::GeometryFlagsKHR::empty()
            };
            vk::AccelerationStructureGeometryKHR::default()
                .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
                .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
                .flags(flags)
        })
        .collect()
}

fn instance_geometry(address: u64) -> vk::AccelerationStructureGeometryKHR<'static> {
    let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default().data(
        vk::DeviceOrHostAddressConstKHR {
            device_address: address,
        },
    );
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances })
}

fn instance_record(instance: &TlasInstance) -> vk::AccelerationStructureInstanceKHR {
    let m = instance.transform.matrix3;
    let t = instance.transform.translation;
    let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]];
    let mut matrix = [0.0; 12];
    for i in 0..3 {
        matrix[4 * i..4 * i + 4].copy_from_slice(&row(i));
    }
    vk::AccelerationStructureInstanceKHR {
        transform: vk::TransformMatrixKHR { matrix },
        instance_custom_index_and_mask: vk::Packed24_8::new(instance.custom_index, instance.mask),
        instance_shader_binding_table_record_offset_and_flags: vk::Packed24_8::new(
            instance.hit_group,
            vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw() as u8,
        ),
        acceleration_structure_reference: vk::AccelerationStructureReferenceKHR {
            device_handle: instance.blas.accel.address,
        },
    }
}
