//! Windows: their surface, and the pictures that are shown on it in turn.

use super::memory::COLOR;
use super::{Device, Error, Instance, Named, Recording, Submission, Target};
use ash::vk;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// A window of any system.
pub trait Window: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static {}

impl<W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static> Window for W {}

/// What Vulkan draws on of a window.
pub struct Surface {
    raw: vk::SurfaceKHR,
    instance: Arc<Instance>,
    // The window must outlive its surface.
    _window: Arc<dyn Any + Send + Sync>,
}

fn lacks(device: &Device, what: &str) -> Error {
    Error::Unusable {
        name: device.info().name.clone(),
        lacking: vec![what.into()],
    }
}

impl Surface {
    /// The surface of a window.
    ///
    /// # Errors
    /// When Vulkan was opened without windows, or a call fails.
    pub fn new<W: Window>(instance: &Arc<Instance>, window: Arc<W>) -> Result<Arc<Self>, Error> {
        let no = |why: String| Error::NoVulkan(format!("it can't draw into this window ({why})"));
        if instance.surfaces.is_none() {
            return Err(no("the driver knows no window system".into()));
        }
        let display = (window.display_handle()).map_err(|e| no(e.to_string()))?;
        let handle = (window.window_handle()).map_err(|e| no(e.to_string()))?;
        // SAFETY: the handles are those of a window that this value keeps alive.
        let raw = unsafe {
            ash_window::create_surface(
                &instance.entry,
                &instance.raw,
                display.as_raw(),
                handle.as_raw(),
                None,
            )
        }
        .map_err(|e| no(e.to_string()))?;
        Ok(Arc::new(Self {
            raw,
            instance: Arc::clone(instance),
            _window: window,
        }))
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        if let Some(surfaces) = &self.instance.surfaces {
            // SAFETY: swapchains hold an `Arc` of it.
            unsafe { surfaces.destroy_surface(self.raw, None) };
        }
    }
}

/// When a picture is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// With the display, every picture in turn.
    #[default]
    Vsync,
    /// With the display, always the newest picture.
    Mailbox,
    /// At once, with tearing.
    Immediate,
}

impl Pace {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Vsync, Self::Mailbox, Self::Immediate];

    fn mode(self) -> vk::PresentModeKHR {
        match self {
            Self::Vsync => vk::PresentModeKHR::FIFO,
            Self::Mailbox => vk::PresentModeKHR::MAILBOX,
            Self::Immediate => vk::PresentModeKHR::IMMEDIATE,
        }
    }
}

/// Pictures that are drawn while others are shown.
pub struct Swapchain {
    raw: vk::SwapchainKHR,
    images: Vec<vk::Image>,
    views: Vec<vk::ImageView>,
    /// Signalled when a picture is drawn; one for each, because only its next turn tells that
    /// showing has waited for it.
    drawn: Vec<vk::Semaphore>,
    /// Signalled when a picture may be drawn, one for each frame under way and one more.
    free: Vec<vk::Semaphore>,
    turn: usize,
    format: vk::Format,
    size: [u32; 2],
    paces: Vec<Pace>,
    surface: Arc<Surface>,
    device: Arc<Device>,
}

/// Frames that may be under way.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// A wait for a picture ends after this many nanoseconds: a hidden window may never get one.
const ACQUIRE_NS: u64 = 100_000_000;

/// What became of a frame.
pub enum Presented {
    /// It is on its way to the window.
    Yes(Submission),
    /// The window showed none of it: it is hidden, or its pictures no longer fit it; if `stale`, a new
    /// swapchain is needed.
    No {
        /// Whether a new swapchain is needed.
        stale: bool,
    },
    /// It is on its way, and a new swapchain is needed.
    Stale(Submission),
}

impl Swapchain {
    /// Makes the pictures of a window of `size` pixels; `None` while the window has no area. `old` is
    /// what the window had before, of the same surface.
    ///
    /// # Errors
    /// When the device can't show on the window, or a call fails.
    pub fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        size: [u32; 2],
        pace: Pace,
        old: Option<Self>,
    ) -> Result<Option<Self>, Error> {
        let instance = device.instance();
        let (Some(surfaces), Some(swapchains)) = (&instance.surfaces, &device.swapchain) else {
            return Err(lacks(device, "VK_KHR_swapchain"));
        };
        // Showing has no fence: what was shown is done with when the queue is.
        device.wait_idle()?;
        let (physical, target) = (device.physical, surface.raw);
        // SAFETY: plain queries of a surface and a device of the same instance.
        let shows = unsafe {
            surfaces
                .get_physical_device_surface_support(physical, device.queue.family, target)
                .named("vkGetPhysicalDeviceSurfaceSupportKHR")?
        };
        if !shows {
            // Drivers say that also of a surface whose window is gone; nothing else may be asked of it.
            return Err(if device.has_shown.load(Ordering::Relaxed) {
                Error::SurfaceLost
            } else {
                lacks(device, "a queue that shows on this window")
            });
        }
        // SAFETY: as before; the device supports the surface.
        let (room, formats, modes) = unsafe {
            (
                surfaces
                    .get_physical_device_surface_capabilities(physical, target)
                    .named("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?,
                surfaces
                    .get_physical_device_surface_formats(physical, target)
                    .named("vkGetPhysicalDeviceSurfaceFormatsKHR")?,
                surfaces
                    .get_physical_device_surface_present_modes(physical, target)
                    .named("vkGetPhysicalDeviceSurfacePresentModesKHR")?,
            )
        };
        let size = match room.current_extent {
            // The window takes the size of its pictures.
            vk::Extent2D {
                width: u32::MAX, ..
            } => {
                let (least, most) = (room.min_image_extent, room.max_image_extent);
                [
                    size[0].clamp(least.width, most.width.max(least.width)),
                    size[1].clamp(least.height, most.height.max(least.height)),
                ]
            }
            extent => [extent.width, extent.height],
        };
        if size.contains(&0) {
            return Ok(None);
        }
        // The shader writes display codes: a format that encodes once more would be wrong.
        let plain = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
        let format = (formats.iter())
            .find(|f| plain.contains(&f.format))
            .ok_or_else(|| lacks(device, "a window format of 8 bits without encoding"))?;
        let paces: Vec<Pace> = Pace::ALL
            .into_iter()
            .filter(|p| modes.contains(&p.mode()))
            .collect();
        // One to draw on while one is shown and one waits.
        let most = room.max_image_count;
        let count = (room.min_image_count + 1).max(3);
        let count = if most > 0 { count.min(most) } else { count };
        let alphas = [
            vk::CompositeAlphaFlagsKHR::OPAQUE,
            vk::CompositeAlphaFlagsKHR::INHERIT,
            vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
        ];
        let alpha = (alphas.into_iter())
            .find(|&a| room.supported_composite_alpha.contains(a))
            .unwrap_or(vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED);
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(target)
            .min_image_count(count)
            .image_format(format.format)
            .image_color_space(format.color_space)
            .image_extent(vk::Extent2D {
                width: size[0],
                height: size[1],
            })
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(room.current_transform)
            .composite_alpha(alpha)
            .present_mode(if paces.contains(&pace) {
                pace.mode()
            } else {
                vk::PresentModeKHR::FIFO
            })
            .clipped(true)
            .old_swapchain(old.as_ref().map_or(vk::SwapchainKHR::null(), |o| o.raw));
        // SAFETY: a valid create info; the value made at once owns what is made. The queue is idle, so
        // the old swapchain may go.
        unsafe {
            let raw = (swapchains.create_swapchain(&info, None)).named("vkCreateSwapchainKHR")?;
            device.has_shown.store(true, Ordering::Relaxed);
            drop(old);
            let mut chain = Self {
                raw,
                images: Vec::new(),
                views: Vec::new(),
                drawn: Vec::new(),
                free: Vec::new(),
                turn: 0,
                format: format.format,
                size,
                paces,
                surface: Arc::clone(surface),
                device: Arc::clone(device),
            };
            chain.images =
                (swapchains.get_swapchain_images(raw)).named("vkGetSwapchainImagesKHR")?;
            let semaphore = || {
                let info = vk::SemaphoreCreateInfo::default();
                (device.raw.create_semaphore(&info, None)).named("vkCreateSemaphore")
            };
            for &image in &chain.images {
                let view = vk::ImageViewCreateInfo::default()
                    .image(image)
                    .view_type(vk::ImageViewType::TYPE_2D)
                    .format(chain.format)
                    .subresource_range(COLOR);
                let view = device.raw.create_image_view(&view, None);
                chain.views.push(view.named("vkCreateImageView")?);
                chain.drawn.push(semaphore()?);
            }
            for _ in 0..=FRAMES_IN_FLIGHT {
                chain.free.push(semaphore()?);
            }
            Ok(Some(chain))
        }
    }

    /// The format of the pictures.
    #[must_use]
    pub fn format(&self) -> vk::Format {
        self.format
    }

    /// The paces that the window knows.
    #[must_use]
    pub fn paces(&self) -> &[Pace] {
        &self.paces
    }

    /// Draws the next picture by `record` and shows it. At most [`FRAMES_IN_FLIGHT`] may be under way.
    ///
    /// # Errors
    /// When `record` or a call fails.
    pub fn show(
        &mut self,
        record: impl FnOnce(&Target) -> Result<Recording, Error>,
    ) -> Result<Presented, Error> {
        let Some(swapchains) = &self.device.swapchain else {
            return Err(lacks(&self.device, "VK_KHR_swapchain"));
        };
        let free = self.free[self.turn % self.free.len()];
        // SAFETY: the semaphore is not in use: the frame that had it is done.
        let acquired =
            unsafe { swapchains.acquire_next_image(self.raw, ACQUIRE_NS, free, vk::Fence::null()) };
        let (index, mut stale) = match acquired {
            Ok(both) => both,
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => {
                return Ok(Presented::No { stale: false });
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => return Ok(Presented::No { stale: true }),
            Err(other) => return Err(other).named("vkAcquireNextImageKHR"),
        };
        self.turn += 1;
        let image = index as usize;
        let recording = record(&Target {
            image: self.images[image],
            view: self.views[image],
            size: self.size,
            then: vk::ImageLayout::PRESENT_SRC_KHR,
            owner: None,
        })?;
        let drawn = self.drawn[image];
        let submission = recording.submit_between(Some(free), Some(drawn))?;
        let (chains, indices, waits) = ([self.raw], [index], [drawn]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&waits)
            .swapchains(&chains)
            .image_indices(&indices);
        // SAFETY: the picture was acquired, and is drawn when the semaphore is signalled.
        let shown =
            (self.device.queue).locked(|queue| unsafe { swapchains.queue_present(queue, &info) });
        match shown {
            Ok(suboptimal) => stale |= suboptimal,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => stale = true,
            Err(other) => return Err(other).named("vkQueuePresentKHR"),
        }
        Ok(if stale {
            Presented::Stale(submission)
        } else {
            Presented::Yes(submission)
        })
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // Showing has no fence.
        let _ = self.device.wait_idle();
        let raw = &self.device.raw;
        // SAFETY: the queue is idle, or the device is lost.
        unsafe {
            for &view in &self.views {
                raw.destroy_image_view(view, None);
            }
            for &semaphore in self.drawn.iter().chain(&self.free) {
                raw.destroy_semaphore(semaphore, None);
            }
            if let Some(swapchains) = &self.device.swapchain {
                swapchains.destroy_swapchain(self.raw, None);
            }
        }
        let _ = &self.surface;
    }
}

impl Device {
    /// Waits until the device has nothing to do.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn wait_idle(&self) -> Result<(), Error> {
        // SAFETY: nobody else uses the queue meanwhile.
        self.queue
            .locked(|_| unsafe { self.raw.device_wait_idle() })
            .named("vkDeviceWaitIdle")
    }
}
