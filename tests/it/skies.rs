// What the sky shows and how it lights. Included once for each renderer, with its `render`.

use runelight_tests::builder::{Builder, assert_mean, camera, probe, settings};
use glam::Vec3;
use scene::material::srgb_to_linear;
use scene::render::Estimator;
use scene::sky::{Sky, SkyKind, Sun};
use std::f64::consts::PI;
use std::sync::Arc;
use ::scene::Scene;

const GREY: u8 = 188;

/// A plane under a wide ceiling that shows the sky, or is plain; with a screen between, or without.
fn plane_under_sun(sun: Sun, weight: f32, is_sky: bool, screen: bool) -> Arc<Scene> {
    let mut b = Builder::new();
    let ground = b.plain(GREY, 0.0);
    let sky = if is_sky { b.sky(weight) } else { b.plain(0, 0.0) };
    b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
    b.slab(Vec3::Z * 200.0, [4000.0; 2], false, sky, [1.0; 2]);
    if screen {
        let black = b.plain(0, 0.0);
        b.slab(Vec3::Z * 50.0, [100.0; 2], true, black, [1.0; 2]);
    }
    b.scene.sky = Sky {
        kind: SkyKind::Flat(Vec3::splat(weight)),
        suns: vec![sun],
        ..Sky::default()
    };
    b.build()
}

#[test]
fn a_sun_lights_a_plane_by_its_height() {
    let irradiance = Vec3::new(3.0, 2.0, 1.0);
    let view = probe(Vec3::new(-50.0, -200.0, 50.0), Vec3::ZERO);
    for degrees in [0.001f32, 0.27, 25.0] {
        let direction = Vec3::new(0.3, -0.5, 0.8).normalize();
        let sun = Sun::new(direction, degrees.to_radians(), irradiance);
        for weight in [0.0, 0.5] {
            let scene = plane_under_sun(sun, weight, true, false);
            for estimator in Estimator::ALL {
                // Small suns are not found by chance.
                if degrees < 1.0 && !estimator.samples_lights() {
                    continue;
                }
                let film = render(&scene, &settings(view.clone(), 16, estimator, 2), 200);
                // The ceiling is not endless: the sky's own part is its form factor.
                let at = 4000.0;
                let form = gallery::formulas::rectangle_form_factor([-at, at], [-at, at], 200.0);
                let light = irradiance.to_array().map(|e| {
                    f64::from(e) * f64::from(direction.z) + PI * f64::from(weight) * form
                });
                let expected = light.map(|e| srgb_to_linear(GREY) / PI * e);
                let what = format!("{} at {degrees} degrees with {weight}", estimator.name());
                assert_mean(&film, expected, 4.0, &what);
            }
        }
    }
}

#[test]
fn a_sun_shines_through_sky_faces_alone_and_nothing_else() {
    let sun = Sun::new(Vec3::Z, 0.0047, Vec3::ONE);
    let view = probe(Vec3::new(-50.0, -200.0, 20.0), Vec3::ZERO);
    for (is_sky, screen) in [(false, false), (true, true)] {
        let scene = plane_under_sun(sun, 0.0, is_sky, screen);
        // The builder leaves out suns without a sky: they are asked for all the same.
        let mut scene = Arc::unwrap_or_clone(scene);
        scene.sky.suns = vec![Sun { weight: 1.0, ..sun }];
        scene.emitters = scene::Emitters::default().with_lights(&[], &scene.sky.suns);
        let scene = Arc::new(scene.completed());
        for estimator in [Estimator::Nee, Estimator::Mis] {
            let film = render(&scene, &settings(view.clone(), 4, estimator, 2), 16);
            assert_mean(&film, [0.0; 3], 0.0, "in the shade");
        }
    }
    // Where there is nothing at all it is dark, too.
    let mut b = Builder::new();
    let ground = b.plain(GREY, 0.0);
    b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
    let mut scene = Arc::unwrap_or_clone(b.build());
    scene.sky.suns = vec![Sun { weight: 1.0, ..sun }];
    scene.emitters = scene::Emitters::default().with_lights(&[], &scene.sky.suns);
    let film = render(
        &Arc::new(scene.completed()),
        &settings(view, 4, Estimator::Nee, 2),
        16,
    );
    assert_mean(&film, [0.0; 3], 0.0, "without a sky");
    // The bounce rays; those to the sun are no escapes.
    assert_eq!(film.counters.escaped, film.counters.paths);
}

#[test]
fn the_camera_sees_the_disc_of_a_sun_in_the_sky() {
    let mut b = Builder::new();
    let sky = b.sky(1.0);
    b.cuboid(Vec3::splat(-64.0), Vec3::splat(64.0), true, [sky; 6]);
    let direction = Vec3::new(0.6, -0.3, 0.2).normalize();
    let sun = Sun::new(direction, 0.02, Vec3::new(0.4, 0.5, 0.6));
    b.scene.sky = Sky {
        kind: SkyKind::Flat(Vec3::ONE),
        scale: [Vec3::new(0.25, 0.5, 0.75), Vec3::new(1.0, 2.0, 3.0)],
        suns: vec![sun],
        ..Sky::default()
    };
    let scene = b.build();
    let (side, _) = direction.any_orthonormal_pair();
    for (off, seen) in [(0.0, true), (0.0199, true), (0.0201, false), (3.0, false)] {
        let target = direction + side * f32::tan(off);
        let scale = scene.sky.scale[usize::from(target.z < 0.0)];
        let expected = scale + if seen { sun.radiance } else { Vec3::ZERO };
        for estimator in Estimator::ALL {
            let view = probe(Vec3::ZERO, target);
            let film = render(&scene, &settings(view, 2, estimator, 3), 4);
            assert_mean(&film, expected.to_array().map(f64::from), 0.0, estimator.name());
        }
    }
}

#[test]
fn each_half_of_the_sky_lights_what_faces_it() {
    let mut b = Builder::new();
    let (ground, sky) = (b.plain(GREY, 0.0), b.sky(1.0));
    b.cuboid(Vec3::splat(-640.0), Vec3::splat(640.0), true, [sky; 6]);
    b.slab(Vec3::ZERO, [9.0; 2], true, ground, [1.0; 2]);
    let scale = [Vec3::new(0.5, 1.0, 2.0), Vec3::new(0.4, 0.1, 0.0)];
    b.scene.sky = Sky {
        kind: SkyKind::Flat(Vec3::ONE),
        scale,
        suns: Vec::new(),
        ..Sky::default()
    };
    let scene = b.build();
    for (height, scale) in [(20.0, scale[0]), (-20.0, scale[1])] {
        let view = camera(Vec3::new(0.0, 0.0, height), 90.0 * height.signum(), 0.0, 1e-4);
        let expected = scale.to_array().map(|s| srgb_to_linear(GREY) * f64::from(s));
        for estimator in Estimator::ALL {
            let film = render(&scene, &settings(view.clone(), 16, estimator, 2), 64);
            assert_mean(&film, expected, 4.0, estimator.name());
        }
    }
}

#[test]
fn a_skybox_shows_its_sides_by_direction() {
    let mut b = Builder::new();
    let sky = b.sky(1.0);
    b.cuboid(Vec3::splat(-64.0), Vec3::splat(64.0), true, [sky; 6]);
    // Sides of different sizes; no two texels are alike.
    let sizes = [(2, 2), (4, 4), (1, 1), (3, 2), (2, 5), (8, 8)];
    let sides = sizes.map(|(w, h): (usize, usize)| {
        let texels = (0..w * h).map(|i| [20 + 3 * i as u8, 100 + i as u8, 30 * w as u8, 255]);
        b.texture(w, texels.collect())
    });
    b.scene.sky = Sky {
        kind: SkyKind::Box(sides[0]),
        scale: [Vec3::new(0.5, 1.0, 2.0), Vec3::ONE],
        suns: Vec::new(),
        ..Sky::default()
    };
    let scene = b.build();
    // Per side: what is ahead, to the right of it and above it, as the engine has it.
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let frames = [(x, -y, z), (y, x, z), (-x, y, z), (-y, -x, z), (z, -y, -x), (-z, -y, x)];
    for (side, (ahead, right, up)) in frames.into_iter().enumerate() {
        let (w, h) = sizes[side];
        for (u, v) in [(0.05, 0.1), (0.93, 0.07), (0.45, 0.55), (0.1, 0.98), (0.97, 0.9)] {
            let target = ahead + right * (2.0 * u - 1.0) + up * (1.0 - 2.0 * v);
            let at = (v * h as f32) as usize * w + (u * w as f32) as usize;
            let [r, g, b, _] = scene.textures[sides[side].0 as usize].rgba[at];
            let scale = scene.sky.scale[usize::from(target.z < 0.0)];
            let expected = [r, g, b].map(srgb_to_linear);
            let expected = [0, 1, 2].map(|c| expected[c] * f64::from(scale[c]));
            let view = probe(Vec3::new(3.0, 5.0, -2.0), Vec3::new(3.0, 5.0, -2.0) + target);
            let film = render(&scene, &settings(view, 1, Estimator::Mis, 2), 1);
            assert_mean(&film, expected, 0.0, &format!("side {side} at {u}, {v}"));
        }
    }
}
