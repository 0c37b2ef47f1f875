//! Pictures that must not change unnoticed.
//!
//! A failing picture is written beside its golden one with a map of the difference;
//! `UPDATE_GOLDEN=name` (or `all`) accepts it.

use runelight::metrics;
use runelight::output::layers::Layer;
use runelight::output::{Outputs, Style};
use runelight::picture;
use runelight_tests::builder::settings;
use runelight_tests::devices::{Device, render};
use runelight_tests::levels;
use scene::import::LightMode;
use scene::render::{Estimator, Film};
use std::path::Path;

/// Largest mean FLIP error that passes. Two runs with different seeds differ by more than ten
/// times this, so noise does not hide a change.
const MAX_FLIP: f64 = 0.01;

fn check(name: &str, film: &Film) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    let golden = folder.join(format!("{name}.exr"));
    let style = Style {
        layers: vec![Layer::Beauty],
        half: true,
        ..Style::default()
    };
    let write = |path: &Path| {
        let outputs = Outputs::open(&[path.to_owned()]).expect("a writable folder");
        outputs.write(film, &style).expect("a picture");
    };
    let update = std::env::var("UPDATE_GOLDEN").unwrap_or_default();
    if update == name || update == "all" {
        write(&golden);
        return;
    }
    let failed = folder.join(format!("{name}.failed.exr"));
    write(&failed);
    let read =
        |path: &Path| picture::read(path, picture::BEAUTY).unwrap_or_else(|e| panic!("{e:#}"));
    let (reference, image) = (read(&golden), read(&failed));
    let (found, flip) = metrics::compare(&reference, &image).expect("pictures of one size");
    let ok = found.flip <= MAX_FLIP && (found.mean_ratio - 1.0).abs() < 0.01;
    if ok {
        std::fs::remove_file(&failed).expect("a file just written");
        return;
    }
    let worst = flip.iter().copied().fold(0.0f32, f32::max);
    panic!(
        "{name}: FLIP {} (worst pixel {worst}), mean ratio {}; see {} and \
         `runelight compare --heatmap`; UPDATE_GOLDEN={name} accepts it",
        found.flip,
        found.mean_ratio,
        failed.display(),
    );
}

fn sample(device: Device) -> Film {
    let scene = levels::sample(LightMode::Auto);
    let mut view = settings(scene.cameras[0].clone(), 96, Estimator::Mis, 5);
    view.height = 54;
    render(device, &scene, &view, 32)
}

#[test]
fn the_sample_level_on_the_cpu() {
    check("sample_cpu", &sample(Device::Cpu));
}

#[test]
fn the_sample_level_on_vulkan() {
    check("sample_vulkan", &sample(Device::Vulkan));
}
