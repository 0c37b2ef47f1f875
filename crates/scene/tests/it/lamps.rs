//! What shines, how much, and what is left out so that no lamp counts twice.

use crate::common::{room, scene_of};
use glam::Vec3;
use scene::import::{ImportOptions, LightMode};
use std::f32::consts::PI;

fn options(lights: LightMode) -> ImportOptions {
    ImportOptions {
        lights,
        ..ImportOptions::default()
    }
}

/// `m`, the letter of a lamp that simply burns.
const STEADY: f32 = 264.0 / 256.0;

#[test]
fn light_entities_shine_as_their_keys_say() {
    let mut map = room();
    map.entity("light", &[("origin", "128 128 128")]);
    let blue = [
        ("origin", "384 128 128"),
        ("light", "200"),
        ("delay", "2"),
        ("_color", "0 0 255"),
    ];
    map.entity("light_fluoro", &blue);
    map.entity(
        "light",
        &[("origin", "128 384 128"), ("style", "1"), ("light", "300")],
    );
    let spot = [
        ("origin", "384 384 128"),
        ("mangle", "90 -90 0"),
        ("angle", "60"),
    ];
    map.entity("light", &spot);
    let off = [
        ("origin", "64 64 64"),
        ("style", "32"),
        ("targetname", "x"),
        ("spawnflags", "1"),
    ];
    map.entity("light", &off);
    for keys in [
        [("delay", "3")],
        [("delay", "4")],
        [("light", "-200")],
        [("_nostaticlight", "1")],
    ] {
        map.entity("light", &[("origin", "96 96 96"), keys[0]]);
    }
    map.entity("light", &[("origin", "256 256 262")]);
    map.brush_box([400.0, 0.0, 0.0], [464.0, 64.0, 64.0], "wall");
    map.entity("light", &[("origin", "432 32 32")]);
    let at = |time| {
        let options = ImportOptions {
            time,
            ..ImportOptions::default()
        };
        scene_of(&map, &options)
    };
    let scene = at(0.35);
    let [plain, blue, flicker, spot, lifted] = &scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    let full = PI * 300.0_f32.powi(3) / 2048.0 * STEADY;
    let near = |a: Vec3, b: Vec3| (a / b.max_element() - b / b.max_element()).length() < 1e-5;
    assert!(
        near(plain.intensity, Vec3::splat(full)),
        "{}",
        plain.intensity
    );
    assert!(near(blue.intensity, Vec3::Z * (64.0 * PI * 200.0 * STEADY)));
    assert!(near(flicker.intensity, plain.intensity));
    let brighter = at(0.25).lights[2].intensity.x / full;
    assert!((brighter - 286.0 / 264.0).abs() < 1e-5, "{brighter}");
    let cone = spot.spot.expect("a cone");
    assert!((cone.direction - Vec3::NEG_Z).length() < 1e-6);
    assert!((cone.cos_outer - 30.0_f32.to_radians().cos()).abs() < 1e-6);
    assert!(scene.features.spotlights && scene.features.point_lights);
    // 6 units deep in the ceiling: out by the least number of steps, downwards.
    assert_eq!(lifted.position, Vec3::new(256.0, 256.0, 254.0));
    for word in ["negative", "delay", "deep in solid"] {
        assert!(
            scene.report.warnings.iter().any(|w| w.contains(word)),
            "{word}"
        );
    }
}

#[test]
fn a_lamp_that_is_there_twice_counts_once() {
    let mut map = room();
    map.texture(mapc::Texture::from_fn("stray", 64, 64, |x, y| {
        if (x, y) == (3, 5) {
            crate::common::WHITE
        } else {
            100
        }
    }));
    map.brush_box([0.0, 224.0, 128.0], [16.0, 288.0, 192.0], "lamp");
    // Beside the lamp, far from it, and beside a wall with one stray bright texel.
    map.brush_box([496.0, 496.0, 0.0], [512.0, 512.0, 64.0], "stray");
    for origin in ["32 256 160", "256 256 160", "488 488 32"] {
        map.entity("light", &[("origin", origin), ("light", "150")]);
    }
    let lights = |mode| scene_of(&map, &options(mode)).lights.len();
    assert_eq!(lights(LightMode::Auto), 2);
    assert_eq!(lights(LightMode::All), 3);
    assert_eq!(lights(LightMode::Entities), 3);
    assert_eq!(lights(LightMode::Textures), 0);
    let surfaces = |mode| scene_of(&map, &options(mode)).emitters.list.len();
    assert!(surfaces(LightMode::Auto) > 0);
    assert_eq!(surfaces(LightMode::Auto), surfaces(LightMode::Textures));
    assert_eq!(surfaces(LightMode::Entities), 0);
}

#[test]
fn the_sky_stays_whatever_lamps_shine() {
    let mut map = room();
    map.brush_box([64.0, 64.0, 240.0], [192.0, 192.0, 256.0], "sky1");
    for mode in [
        LightMode::Auto,
        LightMode::Textures,
        LightMode::Entities,
        LightMode::All,
    ] {
        let scene = scene_of(&map, &options(mode));
        assert!(scene.features.sky && !scene.emitters.list.is_empty());
        assert!(!scene.features.emissive_surfaces);
    }
}

#[test]
fn dark_fullbright_texels_do_not_emit_and_the_threshold_decides() {
    let mut map = room();
    map.brush_box([0.0, 0.0, 0.0], [32.0, 32.0, 32.0], "lamp");
    map.brush_box([64.0, 64.0, 0.0], [96.0, 96.0, 32.0], "dimlamp");
    let texels = |threshold| {
        let options = ImportOptions {
            threshold,
            ..ImportOptions::default()
        };
        scene_of(&map, &options).report.emissive_texels
    };
    assert_eq!(texels(0.5), 64 * 64);
    assert_eq!(texels(0.01), 2 * 64 * 64);
    assert_eq!(texels(1.01), 0);
}
