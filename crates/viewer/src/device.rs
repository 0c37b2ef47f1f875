//! What computes: a Vulkan device, or the processor.

use crate::job::AnyRenderer;
use anyhow::{Result, bail};
use rt::{DeviceInfo, DeviceKind};
use scene::Scene;
use scene::render::Settings;
use std::sync::Arc;

/// A device that was chosen.
#[derive(Clone, Debug)]
pub struct Device {
    /// Its name; `cpu` for the processor.
    pub name: String,
    /// Its driver with the version.
    pub driver: String,
    /// Vulkan as it was opened for the choice; `None` for the processor.
    vulkan: Option<(rt::Vulkan, usize)>,
}

/// The name of the built-in renderer.
pub const CPU: &str = "cpu";

/// The driver's name and version of the built-in renderer.
pub const CPU_DRIVER: &str = concat!("runelight reference ", env!("CARGO_PKG_VERSION"));

impl Device {
    /// The built-in renderer on all cores.
    #[must_use]
    pub fn cpu() -> Self {
        Self {
            name: CPU.into(),
            driver: CPU_DRIVER.into(),
            vulkan: None,
        }
    }

    /// The device that `--device` names.
    ///
    /// # Errors
    /// When there is none such, or it cannot be used; the sentence says what there is or what it
    /// lacks.
    pub fn choose(wanted: &str) -> Result<Self> {
        if wanted == CPU {
            return Ok(Self::cpu());
        }
        let opened = rt::Vulkan::new(rt::Options::default())
            .and_then(|vulkan| Ok((vulkan.devices()?, vulkan)));
        match opened {
            Ok((devices, vulkan)) => {
                Ok(pick(wanted, &devices)?.map_or_else(Self::cpu, |info| Self {
                    name: info.name.clone(),
                    driver: info.driver.clone(),
                    vulkan: Some((vulkan, info.index)),
                }))
            }
            Err(why) if wanted == "auto" => {
                tracing::info!("{why}; the processor renders");
                Ok(Self::cpu())
            }
            Err(why) => bail!("--device {wanted}: {why}"),
        }
    }

    /// The device that `--device` names, opened to draw into windows: auto takes the best that there is,
    /// software too.
    ///
    /// # Errors
    /// As [`Self::choose`]; and the processor alone shows nothing.
    pub fn for_window(wanted: &str, validation: bool) -> Result<(Self, rt::Gpu)> {
        if wanted == CPU {
            bail!(
                "--device {CPU}: a window shows what a Vulkan device traces; `runelight render` \
                 takes the processor"
            );
        }
        let vulkan = rt::Vulkan::new(rt::Options {
            validation,
            windows: true,
        })?;
        let devices = vulkan.devices()?;
        let software = || devices.iter().find(|d| d.is_usable());
        let Some(info) = pick(wanted, &devices)?.or_else(software) else {
            bail!("no Vulkan device here traces rays; `runelight devices` says what each lacks");
        };
        let gpu = vulkan.open(info.index)?;
        let device = Self {
            name: info.name.clone(),
            driver: info.driver.clone(),
            vulkan: Some((vulkan.clone(), info.index)),
        };
        Ok((device, gpu))
    }

    /// Prepares the device for a scene.
    ///
    /// # Errors
    /// When the device refuses.
    pub fn renderer(
        &self,
        scene: &Arc<Scene>,
        settings: &Settings,
    ) -> Result<Box<dyn AnyRenderer>> {
        Ok(match &self.vulkan {
            None => Box::new(reference::Reference::new(Arc::clone(scene), settings)?),
            Some((vulkan, index)) => {
                let gpu = vulkan.open(*index)?;
                Box::new(rt::PathTracer::new(&gpu, scene, settings)?)
            }
        })
    }
}

/// Picks among Vulkan's devices and the processor, which is `None`; see [`Device::choose`].
pub(crate) fn pick<'a>(wanted: &str, devices: &'a [DeviceInfo]) -> Result<Option<&'a DeviceInfo>> {
    if wanted == "auto" {
        // Software Vulkan is slower than the built-in renderer: it must be asked for.
        return Ok((devices.iter())
            .filter(|d| d.is_usable() && d.kind != DeviceKind::Software)
            .min_by_key(|d| d.kind));
    }
    let found = match wanted.parse::<usize>() {
        Ok(index) => devices.iter().find(|d| d.index == index),
        Err(_) => {
            let text = wanted.to_lowercase();
            let named = || {
                devices
                    .iter()
                    .filter(|d| d.name.to_lowercase().contains(&text))
            };
            // Of several with the same name, one that works.
            named().find(|d| d.is_usable()).or_else(|| named().next())
        }
    };
    match found {
        Some(info) if info.is_usable() => Ok(Some(info)),
        Some(info) => bail!(
            "--device {wanted}: {} cannot be used, it lacks {}",
            info.name,
            info.lacking.join(", ")
        ),
        None => {
            let names: Vec<String> = (devices.iter())
                .map(|d| format!("{} ({})", d.index, d.name))
                .collect();
            let there = match names.as_slice() {
                [] => "Vulkan has no device here, only cpu is left".to_owned(),
                names => format!("there are {} and cpu", names.join(", ")),
            };
            bail!("--device {wanted}: no such device; {there}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(index: usize, name: &str, kind: DeviceKind, lacking: &[&str]) -> DeviceInfo {
        DeviceInfo {
            index,
            name: name.into(),
            driver: "driver 1".into(),
            api_version: "1.3".into(),
            kind,
            lacking: lacking.iter().map(ToString::to_string).collect(),
        }
    }

    fn devices() -> Vec<DeviceInfo> {
        vec![
            info(0, "llvmpipe (LLVM 19)", DeviceKind::Software, &[]),
            info(1, "Old Card", DeviceKind::Discrete, &["VK_KHR_ray_query"]),
            info(2, "Small GPU", DeviceKind::Integrated, &[]),
            info(3, "Big GPU", DeviceKind::Discrete, &[]),
        ]
    }

    #[test]
    fn auto_is_the_best_hardware_that_can_be_used_else_the_processor() {
        let all = devices();
        let name = |devices| pick("auto", devices).unwrap().map(|d| d.name.as_str());
        assert_eq!(name(&all), Some("Big GPU"));
        assert_eq!(name(&all[..3]), Some("Small GPU"));
        assert_eq!(name(&all[..2]), None);
        assert_eq!(name(&[]), None);
    }

    #[test]
    fn devices_are_found_by_number_and_by_part_of_their_name() {
        let all = devices();
        let index = |wanted| pick(wanted, &all).unwrap().map(|d| d.index);
        assert_eq!(index("2"), Some(2));
        assert_eq!(index("LLVMpipe"), Some(0));
        assert_eq!(index("gpu"), Some(2));
        let chosen = Device::choose(CPU).unwrap();
        assert_eq!((chosen.name.as_str(), chosen.vulkan.is_none()), (CPU, true));
    }

    #[test]
    fn a_device_that_is_missing_or_lacks_something_is_a_sentence() {
        let all = devices();
        let error = |wanted: &str| pick(wanted, &all).unwrap_err().to_string();
        assert!(error("old").ends_with("Old Card cannot be used, it lacks VK_KHR_ray_query"));
        assert!(error("9").contains("no such device; there are 0 (llvmpipe (LLVM 19)), 1 (Old"));
        let none = pick("gpu", &[]).unwrap_err().to_string();
        assert!(
            none.ends_with("Vulkan has no device here, only cpu is left"),
            "{none}"
        );
    }
}
