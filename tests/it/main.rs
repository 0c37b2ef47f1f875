//! The integration tests: physical truths, agreement of estimators and devices, golden pictures.

mod adaptive;
mod display;
mod every_level;
mod everything;
mod film;
mod frames;
mod golden;
mod golden_window;
mod hard;
// Programs that are given to others do not compile shaders.
#[cfg(debug_assertions)]
mod hot;
mod hygiene;
mod lighting;
mod looking;
mod luxels;
mod panels;
mod parity;
mod recompile;
mod reference;
mod screen;
mod tour;
mod viewer;
mod window;
// Displays of other systems can't be had for a test.
#[cfg(target_os = "linux")]
mod x11;

/// A file of tests, once for each renderer.
macro_rules! on_both_renderers {
    ($($name:ident: $file:literal),*) => { $( mod $name {
        mod vulkan {
            use super::super::*;
            fn render(scene: &Arc<Scene>, settings: &Settings, samples: u32) -> Film {
                devices::render(Device::Vulkan, scene, settings, samples)
            }
            mod tests { use super::render; include!($file); }
        }
        mod cpu {
            use super::super::*;
            fn render(scene: &Arc<Scene>, settings: &Settings, samples: u32) -> Film {
                devices::render(Device::Cpu, scene, settings, samples)
            }
            mod tests { use super::render; include!($file); }
        }
    } )* };
}

use ::scene::Scene;
use ::scene::render::{Film, Settings};
use runelight_tests::devices::{self, Device};
use std::sync::Arc;

on_both_renderers!(truths: "truths.rs", agreement: "agreement.rs", passages: "passages.rs",
    skies: "skies.rs", fog: "fog.rs",
    styles: "styles.rs");

/// The same for files that ask for a renderer more than one picture at a time.
mod moments {
    mod vulkan {
        fn device() -> super::super::Device {
            super::super::Device::Vulkan
        }
        mod tests {
            use super::device;
            include!("moments.rs");
        }
    }
    mod cpu {
        fn device() -> super::super::Device {
            super::super::Device::Cpu
        }
        mod tests {
            use super::device;
            include!("moments.rs");
        }
    }
}
