//! The Vulkan instance, its validation layer and what that says.

use super::{Error, Named};
use ash::{ext, khr, vk};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

/// How Vulkan is opened.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Switch on the Khronos validation layer with synchronization validation. Opening fails if
    /// the layer is not installed.
    pub validation: bool,
    /// Be able to draw into windows, as far as the system has any; opening does not fail where it has
    /// none.
    pub windows: bool,
}

type Messages = Mutex<Vec<String>>;

/// An opened Vulkan loader and instance.
pub struct Instance {
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    pub(super) raw: ash::Instance,
    pub(super) debug_names: bool,
    // Boxed behind Arc so that its address, which the messenger holds, stays.
    messages: Arc<Messages>,
    /// What windows are drawn through; `None` where the system has none, or nobody asked.
    pub(super) surfaces: Option<khr::surface::Instance>,
    // The library must outlive everything that was loaded from it.
    pub(super) entry: ash::Entry,
}

/// Of every window system there is one.
const SURFACES: [&CStr; 5] = [
    khr::xlib_surface::NAME,
    khr::xcb_surface::NAME,
    khr::wayland_surface::NAME,
    khr::win32_surface::NAME,
    ext::metal_surface::NAME,
];

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

impl Instance {
    /// Opens the Vulkan loader and creates an instance.
    ///
    /// # Errors
    /// [`Error::NoVulkan`] if there is no loader, no driver, or one older than Vulkan 1.3.
    pub fn new(options: Options) -> Result<Arc<Self>, Error> {
        // SAFETY: loading the system's Vulkan library runs its initialisers, which we trust.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|e| Error::NoVulkan(format!("the Vulkan loader could not be opened ({e})")))?;
        // SAFETY: a global command without parameters.
        let version = unsafe { entry.try_enumerate_instance_version() }
            .named("vkEnumerateInstanceVersion")?
            .unwrap_or(vk::API_VERSION_1_0);
        if version < vk::API_VERSION_1_3 {
            let (major, minor) = (
                vk::api_version_major(version),
                vk::api_version_minor(version),
            );
            let text = format!("the Vulkan loader is version {major}.{minor}, 1.3 is needed");
            return Err(Error::NoVulkan(text));
        }
        // SAFETY: a global command with valid parameters.
        let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
            .named("vkEnumerateInstanceExtensionProperties")?;
        let known =
            |name: &CStr| (extensions.iter()).any(|e| e.extension_name_as_c_str() == Ok(name));
        let has_debug_utils = known(ext::debug_utils::NAME);
        let has_windows =
            options.windows && known(khr::surface::NAME) && SURFACES.into_iter().any(known);
        if options.validation {
            // SAFETY: a global command without parameters.
            let layers = unsafe { entry.enumerate_instance_layer_properties() }
                .named("vkEnumerateInstanceLayerProperties")?;
            if !layers
                .iter()
                .any(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER))
            {
                return Err(Error::NoVulkan(
                    "the validation layer VK_LAYER_KHRONOS_validation is not installed".into(),
                ));
            }
        }

        let application = vk::ApplicationInfo::default()
            .application_name(c"runelight")
            .api_version(vk::API_VERSION_1_3);
        let layers = [VALIDATION_LAYER.as_ptr()];
        let debug_names = has_debug_utils || options.validation;
        let mut names = Vec::new();
        if debug_names {
            names.push(ext::debug_utils::NAME.as_ptr());
        }
        if has_windows {
            names.push(khr::surface::NAME.as_ptr());
            let there = SURFACES.into_iter().filter(|name| known(name));
            names.extend(there.map(CStr::as_ptr));
        }
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut validation =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_extension_names(&names);
        if options.validation {
            info = info.enabled_layer_names(&layers).push_next(&mut validation);
        }
        // SAFETY: all pointers in `info` live until the call returns.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|e| {
            let text = match e {
                vk::Result::ERROR_INCOMPATIBLE_DRIVER => "no Vulkan driver is installed".to_owned(),
                other => format!("the Vulkan instance could not be created ({other})"),
            };
            Error::NoVulkan(text)
        })?;
        let messages = Arc::new(Messages::default());
        let messenger = if options.validation {
            let debug = ext::debug_utils::Instance::new(&entry, &raw);
            let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                .message_severity(
                    vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                        | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
                )
                .message_type(
                    vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                        | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
                )
                .pfn_user_callback(Some(collect))
                .user_data(Arc::as_ptr(&messages).cast_mut().cast());
            // SAFETY: `messages` outlives the messenger, which is destroyed in `Drop`.
            let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }
                .named("vkCreateDebugUtilsMessengerEXT")?;
            Some((debug, messenger))
        } else {
            None
        };
        Ok(Arc::new(Self {
            messenger,
            surfaces: has_windows.then(|| khr::surface::Instance::new(&entry, &raw)),
            raw,
            debug_names,
            messages,
            entry,
        }))
    }

    /// What the validation layer has said so far; empty without validation.
    #[must_use]
    pub fn validation_messages(&self) -> Vec<String> {
        self.messages
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
            .clone()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: devices hold an `Arc` of this instance, so none is left.
        unsafe {
            if let Some((debug, messenger)) = &self.messenger {
                debug.destroy_debug_utils_messenger(*messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: `user` is the `Messages` given at creation, `data` is valid during the call, its
    // message is a NUL-terminated string or null.
    unsafe {
        let messages = &*user.cast::<Messages>();
        let text = (*data).message_as_c_str().map_or_else(
            || "a message without text".to_owned(),
            |m| m.to_string_lossy().into_owned(),
        );
        tracing::warn!(target: "vulkan", "{text}");
        if let Ok(mut list) = messages.lock() {
            list.push(text);
        }
    }
    vk::FALSE
}
