//! Physical devices: which can be used and what the others lack. The logical device.

use super::pipeline::RayTracingPipeline;
use super::submit::Queue;
use super::{Error, Instance, Named};
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::collections::HashMap;
use std::ffi::CStr;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, Weak};

/// Kinds of device, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// A GPU inside the processor.
    Integrated,
    /// A GPU of a virtual machine.
    Virtual,
    /// Something else.
    Other,
    /// The processor itself.
    Software,
}

impl DeviceKind {
    /// The name for people and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Other => "other",
            Self::Software => "software",
        }
    }
}

/// A Vulkan device of this machine.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// Position in Vulkan's enumeration.
    pub index: usize,
    /// The device's name.
    pub name: String,
    /// Driver name and version.
    pub driver: String,
    /// Vulkan version the device supports.
    pub api_version: String,
    /// What it is.
    pub kind: DeviceKind,
    /// Names of the extensions, features and limits it lacks; it can be used if there are none.
    pub lacking: Vec<String>,
}

impl DeviceInfo {
    /// Whether the path tracer runs on it.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.lacking.is_empty()
    }
}

/// Limits of a device that this crate respects.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of a shader group handle.
    pub group_handle_size: u32,
    /// Alignment of handles in a shader binding table.
    pub group_handle_alignment: u32,
    /// Alignment of the start of each shader binding table.
    pub group_base_alignment: u32,
    /// Alignment of scratch memory for acceleration structures.
    pub scratch_alignment: u32,
    /// Most primitives in a bottom-level acceleration structure.
    pub max_primitives: u64,
    /// Most instances in a top-level acceleration structure.
    pub max_instances: u64,
    /// Most threads of one ray-tracing dispatch.
    pub max_ray_dispatch: u32,
    /// Most sampled images a stage may use.
    pub max_sampled_images: u32,
    /// Largest width and height of a texture.
    pub max_image_size: u32,
    /// Largest range of a storage buffer, in bytes.
    pub max_storage_range: u32,
    /// Nanoseconds per timestamp tick; 0 if there are no timestamps.
    pub timestamp_period: f32,
    /// Whether the queue draws triangles.
    pub draws: bool,
}

const EXTENSIONS: [&CStr; 3] = [
    khr::acceleration_structure::NAME,
    khr::ray_tracing_pipeline::NAME,
    khr::deferred_host_operations::NAME,
];

/// An opened device with its queue and allocator.
pub struct Device {
    pub(super) queue: ManuallyDrop<Queue>,
    pub(super) allocator: ManuallyDrop<Mutex<Allocator>>,
    /// Bytes that the allocator has handed out, and how many it may.
    pub(super) used_bytes: AtomicU64,
    pub(super) most_bytes: AtomicU64,
    pub(super) raw: ash::Device,
    pub(super) accel: khr::acceleration_structure::Device,
    pub(super) ray_tracing: khr::ray_tracing_pipeline::Device,
    /// What shows pictures in windows; `None` where the instance knows none or the device can't.
    pub(super) swapchain: Option<khr::swapchain::Device>,
    /// Whether it has shown pictures in a window: then it can.
    pub(super) has_shown: AtomicBool,
    pub(super) physical: vk::PhysicalDevice,
    debug: Option<ext::debug_utils::Device>,
    info: DeviceInfo,
    limits: Limits,
    /// Pipelines that are in use, by the numbers that say what they were made for.
    pub(super) pipelines: Mutex<HashMap<Vec<u32>, Weak<RayTracingPipeline>>>,
    instance: Arc<Instance>,
}

/// All features this crate asks of a device, in one place so that the query and the request agree.
#[derive(Default)]
struct Features {
    v12: vk::PhysicalDeviceVulkan12Features<'static>,
    v13: vk::PhysicalDeviceVulkan13Features<'static>,
    accel: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    ray_tracing: vk::PhysicalDeviceRayTracingPipelineFeaturesKHR<'static>,
}

impl Features {
    /// Every needed feature with its name. The closure is called with each.
    fn each(&mut self, mut visit: impl FnMut(&'static str, &mut vk::Bool32)) {
        visit("bufferDeviceAddress", &mut self.v12.buffer_device_address);
        visit("scalarBlockLayout", &mut self.v12.scalar_block_layout);
        visit(
            "runtimeDescriptorArray",
            &mut self.v12.runtime_descriptor_array,
        );
        visit(
            "shaderSampledImageArrayNonUniformIndexing",
            &mut self.v12.shader_sampled_image_array_non_uniform_indexing,
        );
        visit("timelineSemaphore", &mut self.v12.timeline_semaphore);
        visit("hostQueryReset", &mut self.v12.host_query_reset);
        visit("synchronization2", &mut self.v13.synchronization2);
        visit("maintenance4", &mut self.v13.maintenance4);
        // Every device of Vulkan 1.3 has it.
        visit("dynamicRendering", &mut self.v13.dynamic_rendering);
        visit(
            "accelerationStructure",
            &mut self.accel.acceleration_structure,
        );
        visit(
            "rayTracingPipeline",
            &mut self.ray_tracing.ray_tracing_pipeline,
        );
    }
}

impl Instance {
    /// Every Vulkan device of this machine, usable or not, in Vulkan's order.
    ///
    /// # Errors
    /// When the enumeration fails.
    pub fn devices(&self) -> Result<Vec<DeviceInfo>, Error> {
        // SAFETY: the instance is alive.
        let physical =
            unsafe { self.raw.enumerate_physical_devices() }.named("vkEnumeratePhysicalDevices")?;
        physical
            .iter()
            .enumerate()
            .map(|(i, &p)| self.describe(i, p))
            .collect()
    }

    fn describe(&self, index: usize, physical: vk::PhysicalDevice) -> Result<DeviceInfo, Error> {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut ray_tracing = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
        // SAFETY: plain queries of a physical device of this instance. The driver and ray-tracing
        // structs are ignored by devices that do not know them.
        let (properties, extensions) = unsafe {
            let mut two = vk::PhysicalDeviceProperties2::default()
                .push_next(&mut driver)
                .push_next(&mut ray_tracing);
            self.raw.get_physical_device_properties2(physical, &mut two);
            let properties = two.properties;
            let extensions = self
                .raw
                .enumerate_device_extension_properties(physical)
                .named("vkEnumerateDeviceExtensionProperties")?;
            (properties, extensions)
        };
        let api = properties.api_version;
        let api_version = format!(
            "{}.{}",
            vk::api_version_major(api),
            vk::api_version_minor(api)
        );
        let mut lacking = Vec::new();
        if api < vk::API_VERSION_1_3 {
            lacking.push(format!("Vulkan 1.3 (it has {api_version})"));
        }
        let known = |name: &CStr| {
            extensions
                .iter()
                .any(|e| e.extension_name_as_c_str() == Ok(name))
        };
        for name in EXTENSIONS {
            if !known(name) {
                lacking.push(name.to_string_lossy().into_owned());
            }
        }
        // Asking for the features of absent extensions or versions is not allowed.
        if lacking.is_empty() {
            let mut features = self.query_features(physical);
            features.each(|name, on| {
                if *on == vk::FALSE {
                    lacking.push(format!("the feature {name}"));
                }
            });
            if ray_tracing.max_ray_recursion_depth < 1 {
                lacking.push("a maxRayRecursionDepth of at least 1".to_owned());
            }
        }
        if self.queue_family(physical).is_none() {
            lacking.push("a queue with compute".to_owned());
        }
        let text = |chars: &[std::ffi::c_char]| {
            let bytes: Vec<u8> = chars
                .iter()
                .map(|&c| c as u8)
                .take_while(|&c| c != 0)
                .collect();
            String::from_utf8_lossy(&bytes).into_owned()
        };
        let kind = match properties.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
            vk::PhysicalDeviceType::CPU => DeviceKind::Software,
            _ => DeviceKind::Other,
        };
        Ok(DeviceInfo {
            index,
            name: text(&properties.device_name),
            driver: format!(
                "{} {}",
                text(&driver.driver_name),
                text(&driver.driver_info)
            ),
            api_version,
            kind,
            lacking,
        })
    }

    fn query_features(&self, physical: vk::PhysicalDevice) -> Features {
        let mut features = Features::default();
        let mut two = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut features.v12)
            .push_next(&mut features.v13)
            .push_next(&mut features.accel)
            .push_next(&mut features.ray_tracing);
        // SAFETY: a plain query; the chain lives until it returns.
        unsafe { self.raw.get_physical_device_features2(physical, &mut two) };
        // The chain's pointers must not be followed again.
        features.v12.p_next = std::ptr::null_mut();
        features.v13.p_next = std::ptr::null_mut();
        features.accel.p_next = std::ptr::null_mut();
        features.ray_tracing.p_next = std::ptr::null_mut();
        features
    }

    fn queue_family(&self, physical: vk::PhysicalDevice) -> Option<u32> {
        // SAFETY: a plain query.
        let families = unsafe {
            self.raw
                .get_physical_device_queue_family_properties(physical)
        };
        // One that draws too, if there is any: windows need it, and it is as fast.
        let both = vk::QueueFlags::COMPUTE | vk::QueueFlags::GRAPHICS;
        let with = |flags| (families.iter()).position(|f| f.queue_flags.contains(flags));
        with(both)
            .or_else(|| with(vk::QueueFlags::COMPUTE))
            .map(|i| i as u32)
    }

    /// Whether a device has an extension.
    fn device_knows(&self, physical: vk::PhysicalDevice, name: &CStr) -> Result<bool, Error> {
        // SAFETY: a plain query of a physical device of this instance.
        let known = unsafe { self.raw.enumerate_device_extension_properties(physical) }
            .named("vkEnumerateDeviceExtensionProperties")?;
        Ok((known.iter()).any(|e| e.extension_name_as_c_str() == Ok(name)))
    }
}

impl Device {
    /// Opens the device with the given index in [`Instance::devices`].
    ///
    /// # Errors
    /// [`Error::Unusable`] naming what it lacks, or the call that failed.
    pub fn open(instance: &Arc<Instance>, index: usize) -> Result<Arc<Self>, Error> {
        // SAFETY: the instance is alive.
        let all = unsafe { instance.raw.enumerate_physical_devices() }
            .named("vkEnumeratePhysicalDevices")?;
        let &physical = all
            .get(index)
            .ok_or_else(|| Error::NoVulkan(format!("there is no Vulkan device {index}")))?;
        let info = instance.describe(index, physical)?;
        if !info.is_usable() {
            return Err(Error::Unusable {
                name: info.name,
                lacking: info.lacking,
            });
        }
        let family = instance
            .queue_family(physical)
            .ok_or_else(|| Error::Unusable {
                name: info.name.clone(),
                lacking: vec!["a queue with compute".into()],
            })?;

        let mut features = Features::default();
        features.each(|_, on| *on = vk::TRUE);
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(family)
            .queue_priorities(&[1.0])];
        let mut names = EXTENSIONS.map(CStr::as_ptr).to_vec();
        let shows =
            instance.surfaces.is_some() && instance.device_knows(physical, khr::swapchain::NAME)?;
        if shows {
            names.push(khr::swapchain::NAME.as_ptr());
        }
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&names)
            .push_next(&mut features.v12)
            .push_next(&mut features.v13)
            .push_next(&mut features.accel)
            .push_next(&mut features.ray_tracing);
        // SAFETY: extensions and features were checked to be there.
        let raw = unsafe { instance.raw.create_device(physical, &create, None) }
            .named("vkCreateDevice")?;
        let limits = instance.limits(physical, family);
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
            buffer_device_address: true,
            allocation_sizes: gpu_allocator::AllocationSizes::default(),
        })
        .map_err(|e| Error::Memory {
            name: "the allocator".into(),
            size: 0,
            reason: e.to_string(),
        })?;
        let queue = Queue::new(&raw, family, limits.timestamp_period)?;
        Ok(Arc::new(Self {
            queue: ManuallyDrop::new(queue),
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            used_bytes: AtomicU64::new(0),
            most_bytes: AtomicU64::new(u64::MAX),
            accel: khr::acceleration_structure::Device::new(&instance.raw, &raw),
            ray_tracing: khr::ray_tracing_pipeline::Device::new(&instance.raw, &raw),
            swapchain: shows.then(|| khr::swapchain::Device::new(&instance.raw, &raw)),
            has_shown: AtomicBool::new(false),
            physical,
            debug: instance
                .debug_names
                .then(|| ext::debug_utils::Device::new(&instance.raw, &raw)),
            raw,
            info,
            limits,
            pipelines: Mutex::default(),
            instance: instance.clone(),
        }))
    }

    /// What the device is.
    #[must_use]
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// What the device allows.
    #[must_use]
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The instance it belongs to.
    #[must_use]
    pub fn instance(&self) -> &Arc<Instance> {
        &self.instance
    }

    /// Gives an object a name that validation layers and debuggers show.
    pub(super) fn name<T: vk::Handle>(&self, object: T, name: &str) {
        let Some(debug) = &self.debug else { return };
        let Ok(name) = std::ffi::CString::new(name) else {
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(object)
            .object_name(&name);
        // SAFETY: the object was made by this device. A name that fails to stick harms nothing.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }
}

impl Instance {
    fn limits(&self, physical: vk::PhysicalDevice, family: u32) -> Limits {
        let mut accel = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let mut rt = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
        let mut two = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut accel)
            .push_next(&mut rt);
        // SAFETY: plain queries of a physical device of this instance.
        let families = unsafe {
            self.raw.get_physical_device_properties2(physical, &mut two);
            self.raw
                .get_physical_device_queue_family_properties(physical)
        };
        let base = two.properties.limits;
        let family = families.get(family as usize);
        let has_timestamps = family.is_some_and(|f| f.timestamp_valid_bits > 0);
        Limits {
            group_handle_size: rt.shader_group_handle_size,
            group_handle_alignment: rt.shader_group_handle_alignment,
            group_base_alignment: rt.shader_group_base_alignment,
            scratch_alignment: accel.min_acceleration_structure_scratch_offset_alignment,
            max_primitives: accel.max_primitive_count,
            max_instances: accel.max_instance_count,
            max_ray_dispatch: rt.max_ray_dispatch_invocation_count,
            max_sampled_images: base
                .max_per_stage_descriptor_sampled_images
                .min(base.max_descriptor_set_sampled_images),
            max_image_size: base.max_image_dimension2_d,
            max_storage_range: base.max_storage_buffer_range,
            timestamp_period: if has_timestamps {
                base.timestamp_period
            } else {
                0.0
            },
            draws: family.is_some_and(|f| f.queue_flags.contains(vk::QueueFlags::GRAPHICS)),
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: this is the last holder of the device: every object made from it is gone, and so
        // is all that recordings kept alive once the queue has waited. Order: queue, allocator
        // (frees its memory blocks), device.
        unsafe {
            ManuallyDrop::drop(&mut self.queue);
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
        }
    }
}
