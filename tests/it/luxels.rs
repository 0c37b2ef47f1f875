//! Light traced at luxels against the lightmaps of a real light compiler.

use bsp::{Bsp, Level, Limits, SearchPath, Warnings};
use runelight::luxels::compare::{Comparison, Figures, Luxel, compare};
use runelight_tests::{levels, light_modes};
use scene::import::{SUN_SAMPLES, compiler_lights};
use std::path::{Path, PathBuf};

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
