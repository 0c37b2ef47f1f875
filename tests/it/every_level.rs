//! Every real level renders on both devices: nothing non-finite, no ray out of a sealed level.

use runelight_tests::devices::{Device, render};
use runelight_tests::levels;
use scene::import::LightMode;
use scene::render::{Estimator, Settings};
use std::path::PathBuf;

/// Levels of the test data in formats that are read: in PAKs, and loose files.
fn all(game: &bsp::SearchPath) -> Vec<String> {
    let mut names: Vec<String> = game
        .list("maps/")
        .into_iter()
        .filter(|n| n.ends_with(".bsp"))
        .collect();
    let loose = std::fs::read_dir(levels::data().join("loose/bsp")).expect("loose levels");
    let mut files: Vec<PathBuf> = loose.flatten().map(|e| e.path()).collect();
    files.sort();
    files.retain(|f| f.extension().is_some_and(|e| e == "bsp"));
    names.extend(files.iter().map(|f| f.display().to_string()));
    // Half-Life and Quake II are refused, with a sentence; the command line's tests read it.
    names.retain(|n| !n.ends_with("dev_hl.bsp") && !n.ends_with("lqdm1_q2.bsp"));
    names
}

#[test]
fn every_level_renders() {
    let Some(game) = levels::game() else { return };
    let names = all(&game);
    assert!(names.len() >= 30, "only {} levels", names.len());
    for name in names {
        let scene = levels::load(&game, &name, LightMode::Auto);
        let scene = scene.unwrap_or_else(|e| panic!("{name}: {e}"));
        for (device, width, height) in [(Device::Vulkan, 160, 90), (Device::Cpu, 640, 360)] {
            let settings = Settings {
                width,
                height,
                camera: scene.cameras[0].clone(),
                estimator: Estimator::Mis,
                selection: scene::render::Selection::default(),
                candidates: scene::render::CANDIDATES,
                sampler: scene::render::Sampler::Independent,
                depth: 8,
                time: 0.0,
                seed: 0,
                aovs: false,
                clamp: None,
            };
            let film = render(device, &scene, &settings, 1);
            let escaped = film.counters.escaped;
            if scene.report.sealed {
                assert_eq!(escaped, 0, "{name} on {device:?}");
            }
            println!(
                "{name} on {device:?}: {} rays, {escaped} escaped, sealed {}",
                film.counters.rays, scene.report.sealed
            );
        }
    }
}
