//! Pictures whose radiance is known in closed form.

mod common;

use common::{Builder, assert_mean, camera, render, settings};
use glam::{Affine3A, Quat, Vec3};
use scene::material::srgb_to_linear;
use scene::render::{Estimator, Settings};

/// A closed box, turned oddly, of albedo `grey` that emits 1 everywhere.
fn furnace(grey: u8) -> std::sync::Arc<scene::Scene> {
    let mut b = Builder::new();
    let wall = b.plain(grey, 1.0);
    b.cuboid(
        Vec3::new(-31., -40., -20.),
        Vec3::new(50., 17., 29.),
        true,
        [wall; 6],
    );
    b.transform(Affine3A::from_quat(Quat::from_euler(
        glam::EulerRot::XYZ,
        0.3,
        0.5,
        0.7,
    )));
    b.build()
}

#[test]
fn a_closed_box_reads_the_geometric_series() {
    let grey = 188;
    let scene = furnace(grey);
    let rho = srgb_to_linear(grey);
    for depth in [1, 2, 3, 5, 0] {
        let expected = match depth {
            0 => 1.0 / (1.0 - rho),
            n => (1.0 - rho.powi(n)) / (1.0 - rho),
        };
        for estimator in Estimator::ALL {
            let settings = settings(
                camera(Vec3::ZERO, 5., 30., 90.),
                16,
                estimator,
                depth as u32,
            );
            let film = render(&scene, &settings, 64);
            let what = format!("{} at depth {depth}", estimator.name());
            assert_mean(&film, [expected; 3], 4.0, &what);
            assert_eq!(film.counters.escaped, 0, "{what}");
            // Every path finds the same light, so each pixel is exact.
            if estimator == Estimator::Naive && depth > 0 {
                for p in &film.beauty {
                    assert!(
                        (f64::from(p[0]) - expected).abs() < 1e-5 * expected,
                        "{what}"
                    );
                }
            }
        }
    }
}

#[test]
fn layers_add_up_and_describe_the_first_hit() {
    let scene = furnace(188);
    let s = Settings {
        aovs: true,
        ..settings(camera(Vec3::ZERO, 5., 30., 90.), 16, Estimator::Mis, 4)
    };
    let film = render(&scene, &s, 16);
    let rho = srgb_to_linear(188) as f32;
    for i in 0..256 {
        let total = film.emission[i][0] + film.direct[i][0] + film.indirect[i][0];
        assert!((film.beauty[i][0] - total).abs() < 1e-5);
        assert!((film.emission[i][0] - 1.0).abs() < 1e-6);
        assert!((film.albedo[i][1] - rho).abs() < 1e-6);
        assert!(film.depth[i] > 10.0 && (1..=6).contains(&film.id[i]));
    }
}
