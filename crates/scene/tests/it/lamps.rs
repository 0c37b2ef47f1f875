//! What shines, how much, and what is left out so that no lamp counts twice.

use crate::common::{room, scene_of};
use glam::Vec3;
use scene::import::{CLEARANCE, ImportOptions, LIGHT_RADIUS, LightMode, Lighting};
use scene::light::{Falloff, PointLight};
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
    // 6 units deep in the ceiling: out by the least number of steps, downwards, and on to where it has room.
    assert_eq!(lifted.position, Vec3::new(256.0, 256.0, 256.0 - CLEARANCE));
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

#[test]
fn templates_stand_on_all_faces_with_their_texture() {
    let mut map = room();
    // A panel of 192 x 64 units whose top is cut in two.
    map.brush_box([64.0, 64.0, 0.0], [256.0, 128.0, 16.0], "dimlamp");
    let template = [
        ("origin", "200 200 200"),
        ("_surface", "DIMLAMP"),
        ("_surface_spotlight", "1"),
        ("light", "200"),
        ("delay", "2"),
        ("_color", "1 0.5 0"),
    ];
    map.entity("light", &template);
    let scene = scene_of(&map, &options(LightMode::Entities));
    let up: Vec<_> = (scene.lights.iter())
        .filter(|l| l.spot.is_some_and(|s| s.direction.z > 0.9))
        .collect();
    let mut places: Vec<Vec3> = up.iter().map(|l| l.position).collect();
    places.sort_by(|a, b| a.x.total_cmp(&b.x));
    let expected = [96.0, 192.0].map(|x| Vec3::new(x, 96.0, 16.0 + CLEARANCE));
    assert_eq!(places, expected);
    assert!(up.iter().all(|l| l.radius == LIGHT_RADIUS));
    assert!(
        up.iter()
            .all(|l| l.intensity.z == 0.0 && l.intensity.x > l.intensity.y)
    );
    assert_eq!(
        scene.lights.len(),
        2 + 2 + 2 + 2,
        "top, long sides, short sides"
    );
}

#[test]
fn strength_distance_and_scatter_follow_their_keys() {
    let mut map = room();
    map.world_key("_range", "1");
    map.world_key("_dist", "2");
    for keys in [
        &[("light", "100"), ("delay", "2")][..],
        &[("_light", "100"), ("delay", "2"), ("wait", "0.5")],
        &[("light", "100"), ("delay", "2"), ("_deviance", "20")],
        &[("light", "255 0 0 100"), ("delay", "2")],
        &[("light", "100"), ("_falloff", "400")],
        &[("light", "0")],
    ] {
        let mut all = vec![("origin", "256 256 128")];
        all.extend_from_slice(keys);
        map.entity("light", &all);
    }
    let scene = scene_of(&map, &options(LightMode::Entities));
    let unit = 64.0 * PI * 100.0 * STEADY;
    let near = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-5;
    let [plain, closer, wide, red, falling] = &scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    assert!(near(plain.intensity.x, 2.0 * unit / 4.0));
    assert!(near(closer.intensity.x, 2.0 * unit));
    assert!(near(wide.intensity.x, plain.intensity.x));
    assert_eq!((plain.radius, wide.radius), (4.0, 20.0));
    assert!(near(red.intensity.x, plain.intensity.x) && red.intensity.y == 0.0);
    // Halfway out, at 200 units, half of 100 is left.
    let irradiance = falling.intensity.x / (200.0 * 200.0);
    assert!(near(irradiance, PI / 128.0 * 50.0 * STEADY));
}

#[test]
fn a_lamp_that_is_left_out_is_told_with_its_surface() {
    let mut map = room();
    map.brush_box([0.0, 224.0, 128.0], [16.0, 288.0, 192.0], "lamp");
    map.entity(
        "light_fluoro",
        &[("origin", "32 256 160"), ("light", "150")],
    );
    let scene = scene_of(&map, &options(LightMode::Auto));
    let [pair] = &scene.report.lamp_pairs[..] else {
        panic!("{:?}", scene.report.lamp_pairs);
    };
    assert_eq!(
        (pair.classname.as_str(), pair.texture.as_str()),
        ("light_fluoro", "lamp")
    );
    assert_eq!(pair.position, Vec3::new(32.0, 256.0, 160.0));
    assert!((pair.distance - 16.0).abs() < 0.1, "{}", pair.distance);
}

#[test]
fn compiler_light_is_what_adds_up_and_what_does_not() {
    let mut map = room();
    map.world_key("_sunlight", "100");
    map.world_key("_sun_mangle", "0 -90 0");
    map.world_key("_sunlight2", "50");
    map.entity(
        "light",
        &[("origin", "128 128 128"), ("delay", "3"), ("light", "-20")],
    );
    map.entity("light", &[("origin", "128 128 128"), ("delay", "4")]);
    map.entity(
        "light",
        &[
            ("origin", "128 128 128"),
            ("_deviance", "8"),
            ("delay", "2"),
        ],
    );
    let compiler = ImportOptions {
        lighting: Lighting::Compiler,
        ..ImportOptions::default()
    };
    let scene = scene_of(&map, &compiler);
    assert!(scene.features.compiler_lights && scene.emitters.list.is_empty());
    let is = |l: &&PointLight, f: fn(&Falloff) -> bool| l.compiler.is_some_and(|c| f(&c.falloff));
    let constant: Vec<_> = (scene.lights.iter())
        .filter(|l| is(l, |f| matches!(f, Falloff::Constant)))
        .collect();
    assert_eq!(constant.len(), 1);
    let value = PI / 128.0 * 0.5 * -20.0 * STEADY;
    assert!((constant[0].intensity.x / value - 1.0).abs() < 1e-5);
    // The first light of the scatter is where the entity is, all of them add up to it.
    let scattered: Vec<_> = (scene.lights.iter())
        .filter(|l| is(l, |f| matches!(f, Falloff::InverseSquare { .. })))
        .collect();
    assert_eq!(
        (scattered.len(), scattered[0].position),
        (16, Vec3::splat(128.0))
    );
    let suns: Vec<_> = (scene.lights.iter())
        .filter(|l| is(l, |f| matches!(f, Falloff::Sun(_))))
        .collect();
    assert_eq!(suns.len(), 1 + 65, "a sun, and the dome of 64 samples");
    let down = suns[0].compiler.map(|c| c.falloff);
    assert!(matches!(down, Some(Falloff::Sun(d)) if (d + Vec3::Z).length() < 1e-6));
    // What does not add up comes after what does, least light before what takes light away.
    let sums = scene.light_sums.as_ref().expect("sums");
    let [all] = &sums.styles[..] else {
        panic!("{sums:?}");
    };
    assert_eq!((all.first, all.count as usize), (0, scene.lights.len()));
    let last = &scene.lights[scene.lights.len() - 2..];
    assert!(is(&&last[0], |f| matches!(f, Falloff::Least)) && last[1].is_negative());
    assert_eq!((sums.gamma, all.least), (1.0, Vec3::ZERO));
    // Worldspawn's keys alone are reason enough, without a light.
    let mut dim = room();
    dim.world_key("light", "60");
    dim.world_key("_minlight_color", "255 0 0");
    dim.world_key("_gamma", "1.5");
    let sums = scene_of(&dim, &compiler).light_sums.expect("sums");
    assert_eq!((sums.gamma, sums.styles.len()), (1.5, 1));
    let least = PI / 128.0 * 0.5 * 60.0 * STEADY;
    assert!((sums.styles[0].least / least - Vec3::X).length() < 1e-5);
    // A brush model's own, which is more.
    dim.brush_entity(
        "func_wall",
        &[("_minlight", "90")],
        vec![mapc::Brush::cuboid([32.0; 3], [64.0; 3], ["wall"; 6])],
    );
    let own = PI / 128.0 * 0.5 * 90.0 * STEADY;
    let scene = scene_of(&dim, &compiler);
    let lit = |m: &&scene::Material| (m.least_light / own - Vec3::ONE).length() < 1e-5;
    assert_eq!(scene.materials.iter().filter(lit).count(), 1);
    let plain = room();
    // Lights that aim at nothing are no spotlights.
    let at = ("origin", "128 128 128");
    for (keys, is_spot) in [
        ([at, ("angle", "60"), ("light", "200")], false),
        ([at, ("angle", "60"), ("target", "nowhere")], false),
        ([at, ("angle", "60"), ("mangle", "0 -90 0")], true),
    ] {
        let mut map = plain.clone();
        map.entity("light", &keys);
        let scene = scene_of(&map, &compiler);
        assert!(scene.light_sums.is_none());
        assert_eq!(scene.lights[0].spot.is_some(), is_spot, "{keys:?}");
    }
}

#[test]
fn styles_are_told_apart_where_the_film_is_to_be_relit() {
    let mut map = room();
    let lamp = |style: &'static str, flags: &'static str| {
        [
            ("origin", "128 128 128"),
            ("style", style),
            ("spawnflags", flags),
            ("targetname", "x"),
        ]
    };
    for (style, flags) in [("0", "0"), ("10", "0"), ("32", "1"), ("33", "0")] {
        map.entity("light", &lamp(style, flags));
    }
    let apart = |styles_apart| {
        let options = ImportOptions {
            styles_apart,
            // Style 10 is dark then.
            time: 0.25,
            ..ImportOptions::default()
        };
        scene_of(&map, &options)
    };
    let lit = apart(false);
    assert_eq!(lit.lights.len(), 2);
    assert!(lit.styles.is_empty() && !lit.features.style_layers);
    let scene = apart(true);
    let styles: Vec<(u16, f32)> = (scene.styles.iter())
        .map(|s| (s.number, s.brightness))
        .collect();
    assert_eq!(styles, [(0, 1.0), (10, 0.0), (32, 0.0), (33, STEADY)]);
    assert!(scene.features.style_layers && scene.lights.len() == 4);
    let of = |style| scene.lights.iter().find(|l| l.style == style).unwrap();
    for style in [10, 32, 33] {
        assert_eq!(of(style).intensity * STEADY, of(0).intensity);
    }
    // More styles than are told apart.
    let mut map = room();
    for style in 0..30 {
        let style = style.to_string();
        map.entity("light", &[("origin", "128 128 128"), ("style", &style)]);
    }
    let options = ImportOptions {
        styles_apart: true,
        ..ImportOptions::default()
    };
    let scene = scene_of(&map, &options);
    assert_eq!(scene.styles.len(), scene::light::MAX_STYLES);
    let is_known = |l: &PointLight| scene.styles.iter().any(|s| s.number == l.style);
    assert!(scene.lights.iter().all(is_known));
    assert!(
        scene
            .report
            .warnings
            .iter()
            .any(|w| w.contains("light styles"))
    );
}

#[test]
fn styles_shine_as_bright_as_is_asked_whatever_the_level_says() {
    let mut map = room();
    for (style, flags) in [("0", "0"), ("3", "0"), ("32", "1")] {
        let keys = [
            ("origin", "128 128 128"),
            ("style", style),
            ("spawnflags", flags),
            ("targetname", "x"),
        ];
        map.entity("light", &keys);
    }
    let of = |style_brightness: &[(u16, f32)]| {
        let options = ImportOptions {
            style_brightness: style_brightness.to_vec(),
            ..ImportOptions::default()
        };
        scene_of(&map, &options)
    };
    let intensity = |scene: &scene::Scene, style: u16| {
        (scene.lights.iter().find(|l| l.style == style)).map_or(0.0, |l| l.intensity.x)
    };
    let usual = of(&[]);
    let steady = intensity(&usual, 0) / STEADY;
    assert_eq!(intensity(&usual, 32), 0.0, "switched off");
    // The lamp that is switched off shines when it is asked to; of two for one style the last counts.
    let set = of(&[(32, 0.5), (3, 9.0), (3, 0.0)]);
    assert_eq!(intensity(&set, 0), intensity(&usual, 0));
    assert_eq!(intensity(&set, 3), 0.0);
    assert!((intensity(&set, 32) / (0.5 * steady) - 1.0).abs() < 1e-6);
    assert_eq!(set.set_styles, [(32, 0.5), (3, 9.0), (3, 0.0)]);
}
