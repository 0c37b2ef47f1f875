//! Rendering a scene on either device.

use rt::{Gpu, Options, PathTracer, Vulkan};
use scene::render::{Film, Renderer, Settings};
use scene::{Frame, Scene};
use std::sync::{Arc, OnceLock};

/// The two renderers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Device {
    /// The Vulkan path tracer.
    Vulkan,
    /// The reference in double precision.
    Cpu,
}

impl Device {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Vulkan, Self::Cpu];
}

/// The Vulkan device of the tests, with validation on: `RUNELIGHT_TEST_DEVICE` (part of a name),
/// else the software driver.
///
/// # Panics
/// When there is none: a Vulkan test that can't run has failed.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(gpu_alone)
}

/// The same device opened once more, for tests that look at all that is allocated.
///
/// # Panics
/// As [`gpu`].
#[must_use]
pub fn gpu_alone() -> Gpu {
    let wanted = std::env::var("RUNELIGHT_TEST_DEVICE").unwrap_or_else(|_| "llvmpipe".into());
    let opened = Vulkan::new(Options {
        validation: true,
        ..Options::default()
    })
    .and_then(|vulkan| Ok((vulkan.devices()?, vulkan)));
    let (devices, vulkan) = opened.unwrap_or_else(|e| {
        panic!("{e}: `cargo xtask test` installs or names what Vulkan tests need")
    });
    let device = (devices.iter()).find(|d| d.name.contains(&wanted)).unwrap_or_else(|| {
        let names: Vec<_> = devices.iter().map(|d| d.name.as_str()).collect();
        panic!("no Vulkan device is named {wanted}, there are {names:?}: `cargo xtask test` installs or names what Vulkan tests need")
    });
    vulkan.open(device.index).unwrap_or_else(|e| panic!("{e}"))
}

/// Renders `samples` samples per pixel.
///
/// # Panics
/// When a renderer fails, the validation layer says anything, or a sample is not finite.
pub fn render(device: Device, scene: &Arc<Scene>, settings: &Settings, samples: u32) -> Film {
    let film = match device {
        Device::Vulkan => {
            let mut tracer = PathTracer::new(gpu(), scene, settings).expect("a path tracer");
            tracer.accumulate(samples).expect("samples");
            let film = tracer.film().expect("a film");
            drop(tracer);
            assert_eq!(gpu().validation_messages(), [""; 0], "validation messages");
            film
        }
        Device::Cpu => {
            let mut tracer =
                reference::Reference::new(scene.clone(), settings).expect("a reference");
            tracer.accumulate(samples).expect("samples");
            tracer.film().expect("a film")
        }
    };
    assert_eq!(
        film.counters.nonfinite, 0,
        "non-finite samples on {device:?}"
    );
    film
}

/// Pictures by one renderer, one after the other: each the seed of its samples, and moments with their
/// samples per pixel.
pub type Pictures<'a> = &'a [(u64, Vec<(Frame, u32)>)];

/// Renders pictures of moments of a scene.
///
/// # Panics
/// As [`render`].
pub fn render_moments(
    device: Device,
    scene: &Arc<Scene>,
    settings: &Settings,
    pictures: Pictures<'_>,
) -> Vec<Film> {
    fn films<R: Renderer>(mut renderer: R, pictures: Pictures<'_>) -> Vec<Film> {
        let mut film = |(seed, moments): &(u64, Vec<(Frame, u32)>)| {
            renderer.restart(*seed).expect("an empty film");
            for (frame, samples) in moments {
                renderer.show(frame).expect("a frame");
                renderer.accumulate(*samples).expect("samples");
            }
            renderer.film().expect("a film")
        };
        pictures.iter().map(&mut film).collect()
    }
    let films = match device {
        Device::Vulkan => {
            let tracer = PathTracer::new(gpu(), scene, settings).expect("a path tracer");
            let films = films(tracer, pictures);
            assert_eq!(gpu().validation_messages(), [""; 0], "validation messages");
            films
        }
        Device::Cpu => {
            let tracer = reference::Reference::new(scene.clone(), settings);
            films(tracer.expect("a reference"), pictures)
        }
    };
    let nonfinite: u64 = films.iter().map(|f| f.counters.nonfinite).sum();
    assert_eq!(nonfinite, 0, "non-finite samples on {device:?}");
    films
}

/// Opens the best usable Vulkan device with this text in its name, without validation, and says which it
/// is and by which driver: for benchmarks.
///
/// # Errors
/// When there is none, or it can't be opened.
pub fn open_named(text: &str) -> Result<(Gpu, String), Box<dyn std::error::Error>> {
    let vulkan = Vulkan::new(Options::default())?;
    let wanted = text.to_lowercase();
    let device = (vulkan.devices()?.into_iter())
        .filter(|d| d.is_usable() && d.name.to_lowercase().contains(&wanted))
        .min_by_key(|d| d.kind)
        .ok_or("no such Vulkan device")?;
    let described = format!("{}, {}", device.name, device.driver);
    Ok((vulkan.open(device.index)?, described))
}

/// The numbers of `WxH`, as benchmarks take a size.
///
/// # Errors
/// When it has another form.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let sides: Option<Vec<u32>> = text.split('x').map(|side| side.parse().ok()).collect();
    (sides.and_then(|sides| sides.try_into().ok())).ok_or_else(|| "not WxH, as 1280x720".into())
}
