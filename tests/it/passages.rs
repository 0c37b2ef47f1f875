// Light that passes through surfaces, in closed form; included once for each renderer, with its
// `render`.

use glam::Vec3;
use runelight_tests::builder::{Builder, assert_mean, camera, probe, settings};
use runelight_tests::scenes::fill_below;
use scene::material::srgb_to_linear;
use scene::render::Estimator;
use scene::{Finish, PointLight};

/// Reflectance of a smooth interface at normal incidence.
fn straight(eta: f64) -> f64 {
    ((eta - 1.0) / (eta + 1.0)).powi(2)
}

/// Fresnel's equations in the form of their angles.
fn slanted(theta: f64, eta: f64) -> f64 {
    let inside = (theta.sin() / eta).asin();
    let s = (theta - inside).sin() / (theta + inside).sin();
    let p = (theta - inside).tan() / (theta + inside).tan();
    (s * s + p * p) / 2.0
}

fn clear(ior: f32) -> Finish {
    Finish {
        alpha: 0.0,
        ior,
        ..Finish::default()
    }
}

/// What reflects, passes and emits in balance shows nothing, from above and from below.
#[test]
fn in_a_white_furnace_water_and_glass_are_not_seen() {
    let mut b = Builder::new();
    let mut balanced = |grey: u8, alpha: f32| {
        b.plain(grey, alpha * (1.0 - srgb_to_linear(grey) as f32))
    };
    let [dark, bright, water, glass] =
        [(60, 1.0), (220, 1.0), (150, 0.3), (90, 0.2)].map(|(grey, alpha)| balanced(grey, alpha));
    for (id, alpha, ior) in [(water, 0.3, 1.33), (glass, 0.2, 1.5)] {
        b.edit(id).two_sided = true;
        b.edit(id).emission_weight *= 2.0;
        b.edit(id).finish = Finish {
            alpha,
            ior,
            ..Finish::default()
        };
    }
    b.cuboid(Vec3::splat(-50.), Vec3::splat(50.), true, [dark, bright, dark, bright, dark, bright]);
    b.slab(Vec3::Z * -10.0, [50.0; 2], true, water, [1.0; 2]);
    let (min, max) = (Vec3::new(10., -15., -30.), Vec3::new(30., 20., 20.));
    b.cuboid(min, max, false, [glass; 6]);
    b.transform(glam::Affine3A::from_rotation_x(0.3));
    let scene = b.build();
    assert!(scene.features.translucent);
    for (at, pitch) in [(Vec3::ZERO, 10.0), (Vec3::new(0., 0., -30.), -20.0)] {
        for estimator in Estimator::ALL {
            let s = settings(camera(at, pitch, 30.0, 100.0), 16, estimator, 0);
            let film = render(&scene, &s, 128);
            assert_mean(&film, [1.0; 3], 4.0, estimator.name());
            assert_eq!(film.counters.escaped, 0);
        }
    }
}

/// A floor that shines under water which absorbs, seen straight from above: what passes, what is
/// mirrored of the ceiling, and what the paint glows.
#[test]
fn a_view_into_water_is_absorbed_mirrored_and_painted() {
    let (alpha, absorption, depth) = (0.25, [0.02, 0.005, 0.0], 30.0);
    let mut b = Builder::new();
    let (floor, ceiling, black) = (b.plain(0, 2.0), b.plain(0, 3.0), b.plain(0, 0.0));
    let water = b.plain(0, 0.25 * 0.8);
    b.edit(water).two_sided = true;
    b.edit(water).finish = Finish {
        alpha,
        ior: 1.33,
        tint: Vec3::new(1.0, 1.0, 0.5),
        absorption: Vec3::from(absorption),
        ..Finish::default()
    };
    let walls = [black, black, black, black, floor, ceiling];
    b.cuboid(Vec3::splat(-40.0), Vec3::splat(40.0), true, walls);
    b.slab(Vec3::Z * (depth - 40.0), [40.0; 2], true, water, [1.0; 2]);
    fill_below(&mut b, depth - 40.0, water);
    let scene = b.build();
    let tint = [1.0, 1.0, 0.5];
    let expected = |from_above: bool| {
        [0, 1, 2].map(|c| {
            let through = |units: f64| (-f64::from(absorption[c]) * units).exp();
            let free = 1.0 - f64::from(alpha);
            let (mirrored, painted) = (free * straight(1.33), 0.2);
            let passing = (free - mirrored) * tint[c];
            if from_above {
                passing * through(30.0) * 2.0 + mirrored * 3.0 + painted
            } else {
                (passing * 3.0 + mirrored * through(30.0) * 2.0 + painted) * through(5.0)
            }
        })
    };
    for (at, target, from_above) in [(35.0, -40.0, true), (-15.0, 40.0, false)] {
        for estimator in Estimator::ALL {
            let eye = Vec3::new(1.0, 2.0, at);
            let s = settings(probe(eye, Vec3::new(1.0, 2.0, target)), 16, estimator, 4);
            let film = render(&scene, &s, 256);
            assert_mean(&film, expected(from_above), 4.0, estimator.name());
        }
    }
}

/// Both faces of a pane together reflect 2 F / (1 + F) and let the rest pass.
#[test]
fn a_pane_reflects_as_often_as_light_bounces_in_it() {
    let mut b = Builder::new();
    let (dark, bright) = (b.plain(0, 0.0), b.plain(0, 1.0));
    let glass = b.plain(0, 0.0);
    b.edit(glass).finish = clear(1.5);
    let walls = [bright, dark, dark, dark, dark, dark];
    b.cuboid(Vec3::splat(-40.0), Vec3::splat(40.0), true, walls);
    b.cuboid(Vec3::new(0., -40., -40.), Vec3::new(2., 40., 40.), false, [glass; 6]);
    let scene = b.build();
    let one = straight(1.5);
    let both = 2.0 * one / (1.0 + one);
    for (from, to, expected) in [(-20.0, 40.0, both), (20.0, -40.0, 1.0 - both)] {
        let view = probe(Vec3::X * from, Vec3::new(to, 0.0, 0.0));
        for estimator in Estimator::ALL {
            let film = render(&scene, &settings(view.clone(), 16, estimator, 0), 512);
            assert_mean(&film, [expected; 3], 4.0, estimator.name());
        }
    }
}

/// A small lamp above water lights the ground under it by the inverse square, less what is mirrored,
/// painted and absorbed on the way.
#[test]
fn a_lamp_shines_through_water() {
    let (height, surface, absorption) = (50.0, 20.0, 0.01);
    let mut b = Builder::new();
    let ground = b.plain(188, 0.0);
    let water = b.plain(0, 0.0);
    b.edit(water).finish = Finish {
        alpha: 0.4,
        absorption: Vec3::splat(absorption),
        ..clear(1.33)
    };
    b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
    b.slab(Vec3::Z * surface, [500.0; 2], true, water, [1.0; 2]);
    fill_below(&mut b, surface, water);
    b.light(PointLight {
        position: Vec3::Z * height,
        radius: 0.25,
        intensity: Vec3::splat(1e4),
        ..PointLight::default()
    });
    let scene = b.build();
    for x in [0.5_f32, 40.0, 120.0] {
        let point = Vec3::new(x, 0.0, 0.0);
        let eye = point + Vec3::new(0.0, -30.0, 10.0);
        let distance = f64::from((Vec3::Z * height - point).length());
        let cos = f64::from(height) / distance;
        let passing = 0.6 * (1.0 - slanted(cos.acos(), f64::from(1.33_f32)));
        let inside = f64::from(surface) / cos + f64::from((eye - point).length());
        let depth = f64::from(absorption) * inside;
        let irradiance = 1e4 * cos / (distance * distance) * passing;
        let expected = srgb_to_linear(188) / std::f64::consts::PI * irradiance * (-depth).exp();
        for estimator in [Estimator::Nee, Estimator::Mis] {
            let film = render(&scene, &settings(probe(eye, point), 8, estimator, 2), 16);
            // The lamp is a small sphere, not a point.
            let (mean, _) = runelight_tests::builder::mean_and_error(&film);
            let off = (mean[0] / expected - 1.0).abs();
            assert!(off < 2e-3, "{} at {x}: {} is not {expected}", estimator.name(), mean[0]);
        }
    }
}
