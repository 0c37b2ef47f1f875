//! Buffers and images with their memory.

use super::{Device, Error, Named, Usage};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, PoisonError};

/// Where memory lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Location {
    /// Fast for the device, out of the host's reach.
    Device,
    /// Written by the host, read by the device.
    Upload,
    /// Written by the device, read by the host.
    ReadBack,
}

/// A buffer with a device address.
pub struct Buffer {
    raw: vk::Buffer,
    allocation: Option<Allocation>,
    size: u64,
    address: vk::DeviceAddress,
    device: Arc<Device>,
}

impl Device {
    fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: Location,
        linear: bool,
    ) -> Result<Allocation, Error> {
        let size = requirements.size;
        let refused = |reason: String| Error::Memory {
            name: name.to_owned(),
            size,
            reason,
        };
        let mut allocator = self
            .allocator
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        // Both change under the lock alone.
        let (used, most) = (self.allocated_bytes(), self.most_bytes.load(Relaxed));
        if used.saturating_add(size) > most {
            let why = format!("{used} of the {most} that may be taken are in use");
            return Err(refused(why));
        }
        let allocation = allocator
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location: match location {
                    Location::Device => MemoryLocation::GpuOnly,
                    Location::Upload => MemoryLocation::CpuToGpu,
                    Location::ReadBack => MemoryLocation::GpuToCpu,
                },
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|e| refused(e.to_string()))?;
        self.used_bytes.fetch_add(allocation.size(), Relaxed);
        Ok(allocation)
    }

    /// Bytes that buffers and images have.
    #[must_use]
    pub fn allocated_bytes(&self) -> u64 {
        self.used_bytes.load(Relaxed)
    }

    /// Lets buffers and images have so many bytes at most. What would be more is refused as where the
    /// device has no more; what is there stays.
    pub fn limit_bytes(&self, most: u64) {
        self.most_bytes.store(most, Relaxed);
    }

    fn release(&self, allocation: Option<Allocation>) {
        let Some(allocation) = allocation else { return };
        let mut allocator = self
            .allocator
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        self.used_bytes.fetch_sub(allocation.size(), Relaxed);
        if let Err(error) = allocator.free(allocation) {
            tracing::error!("GPU memory could not be freed: {error}");
        }
    }
}

impl Buffer {
    /// Makes a buffer of at least one byte. It can be copied from and to, and has an address.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        usage: Usage,
        location: Location,
    ) -> Result<Arc<Self>, Error> {
        Ok(Arc::new(Self::unshared(
            device, name, size, usage, location,
        )?))
    }

    fn unshared(
        device: &Arc<Device>,
        name: &str,
        size: u64,
        usage: Usage,
        location: Location,
    ) -> Result<Self, Error> {
        let size = size.max(16);
        let info = vk::BufferCreateInfo::default().size(size).usage(
            usage | Usage::SHADER_DEVICE_ADDRESS | Usage::TRANSFER_SRC | Usage::TRANSFER_DST,
        );
        // SAFETY: a valid create info; the handle is owned by the value made below, which frees it
        // also when a later step fails.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.named("vkCreateBuffer")?;
        device.name(raw, name);
        let mut buffer = Self {
            raw,
            allocation: None,
            size,
            address: 0,
            device: device.clone(),
        };
        // SAFETY: the buffer and its fresh memory belong together; binding happens once.
        unsafe {
            let mut requirements = device.raw.get_buffer_memory_requirements(raw);
            // Covers what addresses must be aligned to: acceleration structures (256), shader
            // binding tables (the device's base alignment), 16-byte reads in shaders.
            let base = u64::from(device.limits().group_base_alignment);
            requirements.alignment = requirements.alignment.max(256).max(base);
            let allocation = device.allocate(name, requirements, location, true)?;
            let bound =
                device
                    .raw
                    .bind_buffer_memory(raw, allocation.memory(), allocation.offset());
            buffer.allocation = Some(allocation);
            bound.named("vkBindBufferMemory")?;
            buffer.address = device
                .raw
                .get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(raw));
        }
        Ok(buffer)
    }

    /// Makes a host-written buffer that holds `data`.
    ///
    /// # Errors
    /// When there is no memory the host can write.
    pub fn with_data(
        device: &Arc<Device>,
        name: &str,
        usage: Usage,
        data: &[u8],
    ) -> Result<Arc<Self>, Error> {
        let size = data.len() as u64;
        let mut buffer = Self::unshared(device, name, size, usage, Location::Upload)?;
        buffer.mapped_mut(name)?[..data.len()].copy_from_slice(data);
        Ok(Arc::new(buffer))
    }

    fn mapped_mut(&mut self, name: &str) -> Result<&mut [u8], Error> {
        let size = self.size;
        self.allocation
            .as_mut()
            .and_then(Allocation::mapped_slice_mut)
            .ok_or_else(|| Error::Memory {
                name: name.to_owned(),
                size,
                reason: "not visible to the host".into(),
            })
    }

    /// The contents of a buffer in [`Location::ReadBack`], after the device has written it.
    ///
    /// # Errors
    /// When the memory is not visible to the host.
    pub fn read(&self) -> Result<&[u8], Error> {
        self.allocation
            .as_ref()
            .and_then(Allocation::mapped_slice)
            .ok_or_else(|| Error::Memory {
                name: "a read-back".into(),
                size: self.size,
                reason: "not visible to the host".into(),
            })
    }

    pub(super) fn raw(&self) -> vk::Buffer {
        self.raw
    }

    /// Bytes.
    #[must_use]
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Address for shaders and acceleration-structure builds.
    #[must_use]
    pub fn address(&self) -> u64 {
        self.address
    }

    /// The device it belongs to.
    #[must_use]
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: recordings that use the buffer hold an `Arc` of it until the GPU is done.
        unsafe { self.device.raw.destroy_buffer(self.raw, None) };
        self.device.release(self.allocation.take());
    }
}

/// A sampled 8-bit RGBA image of one level, with its view.
pub struct Image {
    raw: vk::Image,
    view: vk::ImageView,
    allocation: Option<Allocation>,
    extent: [u32; 2],
    device: Arc<Device>,
}

impl Image {
    /// Makes an image of `width` by `height` texels, format `R8G8B8A8_UNORM`.
    ///
    /// # Errors
    /// When it is larger than the device allows, or there is no memory.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        width: u32,
        height: u32,
    ) -> Result<Arc<Self>, Error> {
        let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
        Self::with_usage(device, name, width, height, usage)
    }

    /// Makes an image that is drawn on and copied from, of the same format.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn to_draw_on(device: &Arc<Device>, width: u32, height: u32) -> Result<Arc<Self>, Error> {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        Self::with_usage(device, "off-screen", width, height, usage)
    }

    fn with_usage(
        device: &Arc<Device>,
        name: &str,
        width: u32,
        height: u32,
        usage: vk::ImageUsageFlags,
    ) -> Result<Arc<Self>, Error> {
        let allowed = device.limits().max_image_size;
        if width.max(height) > allowed {
            return Err(Error::Limit {
                what: "texels across a texture",
                needed: u64::from(width.max(height)),
                allowed: u64::from(allowed),
            });
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_UNORM)
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        // SAFETY: as in `Buffer::unshared`.
        let raw = unsafe { device.raw.create_image(&info, None) }.named("vkCreateImage")?;
        device.name(raw, name);
        let mut image = Self {
            raw,
            view: vk::ImageView::null(),
            allocation: None,
            extent: [width, height],
            device: device.clone(),
        };
        // SAFETY: the image and its fresh memory belong together; binding happens once.
        unsafe {
            let requirements = device.raw.get_image_memory_requirements(raw);
            let allocation = device.allocate(name, requirements, Location::Device, false)?;
            let bound = device
                .raw
                .bind_image_memory(raw, allocation.memory(), allocation.offset());
            image.allocation = Some(allocation);
            bound.named("vkBindImageMemory")?;
            let view = vk::ImageViewCreateInfo::default()
                .image(raw)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(vk::Format::R8G8B8A8_UNORM)
                .subresource_range(COLOR);
            image.view = device
                .raw
                .create_image_view(&view, None)
                .named("vkCreateImageView")?;
        }
        Ok(Arc::new(image))
    }

    pub(super) fn raw(&self) -> vk::Image {
        self.raw
    }

    pub(super) fn view(&self) -> vk::ImageView {
        self.view
    }

    /// Texels across and down.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        self.extent
    }

    pub(super) fn extent(&self) -> vk::Extent3D {
        vk::Extent3D {
            width: self.extent[0],
            height: self.extent[1],
            depth: 1,
        }
    }
}

/// The one level and layer an [`Image`] has.
pub(super) const COLOR: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: recordings that use the image hold an `Arc` of it until the GPU is done.
        // Destroying a null view is allowed.
        unsafe {
            self.device.raw.destroy_image_view(self.view, None);
            self.device.raw.destroy_image(self.raw, None);
        }
        self.device.release(self.allocation.take());
    }
}
