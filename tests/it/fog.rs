// Fog against integrals that are worked out otherwise; included once for each renderer, with its `render`.

use gallery::formulas::{LampBeside, airlight};
use runelight_tests::builder::{Builder, assert_mean, camera, mean_and_error, probe, settings};
use runelight_tests::scenes::in_fog;
use glam::{DVec3, Vec3};
use scene::render::{Estimator, Sampler, Selection};
use scene::light::Spot;
use scene::{PointLight, Scene};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const ALBEDO: Vec3 = Vec3::new(0.9, 0.6, 0.2);

#[test]
fn fog_takes_light_by_the_law_of_beer_and_lambert() {
    let mut b = Builder::new();
    let lamp = b.plain(0, 3.0);
    b.slab(Vec3::ZERO, [500.0; 2], true, lamp, [1.0; 2]);
    let clear = b.build();
    for (extinction, distance) in [(0.01_f32, 50.0_f32), (0.002, 400.0), (1e-6, 10.0), (0.1, 60.0)] {
        let scene = in_fog(clear.clone(), extinction, Vec3::ZERO);
        let view = probe(Vec3::Z * distance, Vec3::ZERO);
        let left = 3.0 * (-f64::from(extinction) * f64::from(distance)).exp();
        let by = match extinction {
            0.01 => &Estimator::ALL[..],
            _ => &[Estimator::Mis],
        };
        for &estimator in by {
            let film = render(&scene, &settings(view.clone(), 4, estimator, 0), 4);
            assert_mean(&film, [left; 3], 0.0, estimator.name());
        }
    }
}

#[test]
fn a_light_entity_shines_in_fog() {
    // Along a ray that ends on black, past a lamp: what fog scatters into it on its way.
    let (eye, wall) = (Vec3::new(0.0, -200.0, 0.0), 300.0_f32);
    let spot = Spot {
        direction: Vec3::new(0.0, -0.6, -0.8),
        cos_inner: 0.95,
        cos_outer: 0.6,
    };
    for (at, radius, spot, extinction) in [
        (Vec3::new(0.0, 10.0, 30.0), 1.0_f32, None, 0.004_f32),
        (Vec3::new(0.0, -150.0, 3.0), 2.0, None, 0.01),
        (Vec3::new(0.0, 10.0, 30.0), 0.5, Some(spot), 0.001),
    ] {
        let mut b = Builder::new();
        let black = b.plain(0, 0.0);
        let side = Vec3::new(0.0, wall - 200.0, 0.0);
        b.cuboid(side - Vec3::new(50.0, 0.0, 50.0), side + Vec3::splat(50.0), false, [black; 6]);
        b.light(PointLight {
            position: at,
            radius,
            intensity: Vec3::splat(900.0),
            spot,
            ..PointLight::default()
        });
        let scene = in_fog(b.build(), extinction, ALBEDO);
        let lamp = LampBeside {
            along: f64::from(at.y - eye.y),
            height: f64::from(at.z),
            radius: f64::from(radius),
        };
        let cone = |t: f64| {
            let to_light = at.as_dvec3() - (eye.as_dvec3() + DVec3::Y * t);
            spot.map_or(1.0, |s| {
                let cos = s.direction.as_dvec3().dot(-to_light.normalize());
                ((cos - 0.6) / 0.35).clamp(0.0, 1.0)
            })
        };
        let scattered = 900.0 * airlight(f64::from(extinction), f64::from(wall), lamp, cone);
        let view = probe(eye, side);
        for estimator in [Estimator::Nee, Estimator::Mis] {
            for sampler in Sampler::ALL {
                if sampler == Sampler::Sobol && spot.is_none() {
                    continue;
                }
                let mut s = settings(view.clone(), 16, estimator, 2);
                s.sampler = sampler;
                let film = render(&scene, &s, 256);
                let (mean, error) = mean_and_error(&film);
                for c in 0..3 {
                    let expected = f64::from(ALBEDO[c]) * scattered;
                    let off = (mean[c] - expected).abs();
                    assert!(
                        off <= 4.0 * error[c] + 1e-3 * expected,
                        "{} with lamp at {at}: {mean:?} +- {error:?}, not {expected}",
                        estimator.name()
                    );
                    assert!(error[c] < 0.02 * expected, "{error:?} of {expected}");
                }
            }
        }
        let film = render(&scene, &settings(view, 4, Estimator::Naive, 2), 64);
        assert_mean(&film, [0.0; 3], 0.0, "no ray finds a lamp");
    }
}

/// Midpoint rule over `0..length`.
fn integral(length: f64, steps: u32, f: impl Fn(f64) -> f64) -> f64 {
    let step = length / f64::from(steps);
    (0..steps).map(|i| f((f64::from(i) + 0.5) * step)).sum::<f64>() * step
}

/// A closed box of this size about the origin that emits 1 and reflects nothing.
fn glowing_box(half: Vec3) -> Arc<Scene> {
    let mut b = Builder::new();
    let wall = b.plain(0, 1.0);
    b.cuboid(-half, half, true, [wall; 6]);
    b.build()
}

#[test]
fn walls_shine_in_fog_as_in_the_integral_over_all_directions() {
    let half = Vec3::new(40.0, 60.0, 30.0);
    let extinction = 0.01_f32;
    let scene = in_fog(glowing_box(half), extinction, ALBEDO);
    let (sigma, half) = (f64::from(extinction), half.as_dvec3());
    let eye = DVec3::new(5.0, -50.0, -4.0);
    let to_wall = |from: DVec3, d: DVec3| ((half * d.signum() - from) / d).min_element();
    let length = to_wall(eye, DVec3::Y);
    // What comes from all directions to a place on the ray, and from there.
    let scattered = integral(length, 50, |t| {
        let place = eye + DVec3::Y * t;
        let n = 64;
        let arriving = integral(2.0, n, |z| {
            integral(TAU, 2 * n, |phi| {
                let (z, (s, c)) = (z - 1.0, phi.sin_cos());
                let r = (1.0 - z * z).sqrt();
                (-sigma * to_wall(place, DVec3::new(r * c, r * s, z))).exp()
            })
        });
        sigma * (-sigma * t).exp() * arriving / (4.0 * PI)
    });
    let seen = (-sigma * length).exp();
    let expected = [0, 1, 2].map(|c| seen + f64::from(ALBEDO[c]) * scattered);
    let view = probe(eye.as_vec3(), eye.as_vec3() + Vec3::Y);
    for estimator in Estimator::ALL {
        for selection in Selection::ALL {
            let mut s = settings(view.clone(), 16, estimator, 2);
            s.selection = selection;
            let film = render(&scene, &s, 400);
            let what = format!("{} by {}", estimator.name(), selection.name());
            let (mean, error) = mean_and_error(&film);
            for c in 0..3 {
                let off = (mean[c] - expected[c]).abs();
                // The quadrature is good for 1e-4.
                let allowed = 4.0 * error[c] + 1e-4 * expected[c];
                assert!(off <= allowed, "{what}: {mean:?} +- {error:?}, not {expected:?}");
            }
            if estimator != Estimator::Mis {
                break;
            }
        }
    }
}

#[test]
fn thin_white_fog_gives_back_what_it_takes() {
    // Each surface emits what it does not reflect: without fog radiance is 1. Light that white fog
    // scatters is not lost but where it would be scattered twice: here by a few parts in 10,000.
    let mut b = Builder::new();
    let mut balanced = |grey: u8| b.plain(grey, 1.0 - scene::material::srgb_to_linear(grey) as f32);
    let [dark, bright] = [60, 200].map(&mut balanced);
    b.cuboid(Vec3::splat(-50.0), Vec3::splat(50.0), true, [dark, dark, bright, bright, dark, bright]);
    let clear = b.build();
    let view = camera(Vec3::ZERO, 5.0, 30.0, 90.0);
    for (albedo, least, most) in [(Vec3::ONE, 0.9985, 1.0005), (Vec3::ZERO, 0.985, 0.996)] {
        let scene = in_fog(clear.clone(), 1e-4, albedo);
        for estimator in [Estimator::Naive, Estimator::Uniform, Estimator::Mis] {
            let film = render(&scene, &settings(view.clone(), 16, estimator, 0), 256);
            let (mean, error) = mean_and_error(&film);
            let (low, high) = (mean[0] + 4.0 * error[0], mean[0] - 4.0 * error[0]);
            assert!(low > least && high < most, "{}: {mean:?} +- {error:?}", estimator.name());
        }
    }
}
