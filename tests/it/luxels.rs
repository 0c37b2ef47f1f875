//! Light traced at luxels against the lightmaps of a real light compiler.

use bsp::lmp::Palette;
use bsp::{Bsp, Level, Limits, SearchPath, Warnings};
use glam::Vec3;
use runelight::luxels::compare::{Comparison, Figures, Luxel, compare};
use runelight_tests::builder::{camera, settings};
use runelight_tests::devices::{Device, render};
use runelight_tests::{levels, light_modes};
use scene::Scene;
use scene::import::{ImportOptions, Lighting, SUN_SAMPLES, compiler_lights, import};
use scene::render::Estimator;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn fixture() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("baked/light_modes.bsp")
}

fn load(path: &Path) -> Level {
    let search = SearchPath::builder().build().expect("an empty search path");
    Level::load_file(&search, path, &Limits::default()).expect("a level")
}

fn traced(level: &Level, extra: u32, scale: f32) -> Comparison {
    let (mut lights, _) = compiler_lights(level, SUN_SAMPLES);
    for light in &mut lights.lights {
        light.intensity *= scale;
    }
    compare(level, &lights, extra, &Limits::default())
}

#[test]
fn the_baked_level_is_the_one_in_the_source() {
    let out = mapc::compile(&light_modes::map(), &mapc::Options::default()).expect("a level");
    let parse = |bytes: &[u8]| {
        Bsp::parse(bytes, &Limits::default(), &mut Warnings::new()).expect("a level")
    };
    let baked = parse(&std::fs::read(fixture()).expect("the fixture"));
    let source = parse(&out.bytes);
    assert_eq!(baked.vertices, source.vertices);
    assert_eq!(baked.texinfos, source.texinfos);
    let places = |bsp: &Bsp| -> Vec<_> {
        (bsp.faces.iter())
            .map(|f| (f.plane, f.side, f.first_edge, f.num_edges))
            .collect()
    };
    assert_eq!(places(&baked), places(&source));
}

/// Half of all luxels within 1, 99 of a hundred within 3 of a lightmap byte, for every kind of light.
#[test]
fn every_kind_of_light_is_what_a_light_compiler_bakes() {
    let level = load(&fixture());
    let comparison = traced(&level, 1, 1.0);
    let by_style = comparison.by_style();
    assert_eq!(
        by_style.len(),
        1 + light_modes::ROOMS.len(),
        "the sky's, and one for each room"
    );
    for (style, figures) in &by_style {
        let name = match style {
            0 => "sun and dome",
            style => light_modes::ROOMS[usize::from(*style) - 1].0,
        };
        println!("{name}: {figures:?}");
        assert!(figures.count > 500, "{name}: {figures:?}");
        assert!(
            figures.median <= 1.0 && figures.p99 <= 3.0,
            "{name}: {figures:?}"
        );
    }
    // A light that is 5 % off is found out.
    let wrong = Figures::over(traced(&level, 1, 1.05).pairs()).expect("luxels");
    assert!(wrong.median >= 1.0 && wrong.p99 > 3.0, "{wrong:?}");
}

/// What a picture of compiler light shows is what the lightmaps show, in every room: with least light and lights
/// that take light away, too.
#[test]
fn pictures_of_compiler_light_are_those_of_the_lightmaps() {
    let level = load(&fixture());
    let palette = Palette(std::array::from_fn(|i| [i as u8; 3]));
    let [compiler, lightmap] = [Lighting::Compiler, Lighting::Lightmap].map(|lighting| {
        let options = ImportOptions {
            lighting,
            style_brightness: (1..=12).map(|style| (style, 0.8)).collect(),
            ..ImportOptions::default()
        };
        Arc::new(import(&level, &palette, &|_| None, &options).expect("a scene"))
    });
    assert!(compiler.features.light_sums);
    for room in 0..=light_modes::ROOMS.len() {
        let eye = Vec3::new(320.0 * room as f32 + 40.0, 30.0, 110.0);
        let picture = |scene: &Arc<Scene>, depth| {
            let view = settings(camera(eye, 15.0, 50.0, 90.0), 48, Estimator::Nee, depth);
            render(Device::Cpu, scene, &view, 4).beauty
        };
        let (traced, baked) = (picture(&compiler, 2), picture(&lightmap, 1));
        // Bytes are cut off, luxels are 16 units apart and hold 255 at most: not every pixel is the same.
        let mut ratios: Vec<f32> = (traced.iter().zip(&baked))
            .filter(|(_, b)| b[1] > 0.01)
            .map(|(t, b)| t[1] / b[1])
            .collect();
        assert!(ratios.len() > 500, "room {room} is dark");
        ratios.sort_unstable_by(f32::total_cmp);
        let [low, median, high] = [1, 5, 9].map(|tenth| ratios[ratios.len() * tenth / 10]);
        println!("room {room}: {low} {median} {high}");
        assert!((median - 1.0).abs() < 0.02, "room {room}: {median}");
        assert!(low > 0.9 && high < 1.2, "room {room}: {low} {high}");
    }
}

/// A level full of tests of a light compiler, lit by it with 2 x 2 samples and without bounces.
#[test]
fn a_real_level_without_bounces_agrees() {
    if levels::game().is_none() {
        return;
    }
    let level = load(&levels::data().join("loose/bsp/q1_hdrtest.bsp"));
    let all = Figures::over(traced(&level, 2, 1.0).pairs()).expect("luxels");
    assert!(
        all.count > 3000 && all.median <= 1.0 && all.p99 <= 3.0,
        "{all:?}"
    );
    // Its textures have no texels: for the compiler fences were all hole. A wall in it is an illusion.
    let level = load(&levels::data().join("loose/bsp/start_notex.bsp"));
    let styles = traced(&level, 1, 1.0).by_style();
    let [(0, steady), (2, templates), (11, behind_fences)] = &styles[..] else {
        panic!("{styles:?}");
    };
    // Suns of a penumbra are scattered at random, lights lie in the planes of walls.
    assert!(steady.p99 <= 6.0, "{steady:?}");
    for figures in [templates, behind_fences] {
        assert!(figures.count > 1000 && figures.max <= 1.0, "{figures:?}");
    }
}

#[test]
fn luxels_in_solid_are_not_compared() {
    let comparison = traced(&load(&fixture()), 1, 1.0);
    let lit = comparison
        .luxels()
        .filter(|l| matches!(l, Luxel::Compared(_)))
        .count();
    let all = comparison.luxels().count();
    assert!(lit > 0 && lit <= all);
    assert!(comparison.pairs().all(|p| p.difference().is_finite()));
}
