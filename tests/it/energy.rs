//! Scenes whose radiance is known.

use glam::Vec3;
use runelight_tests::builder::{Builder, assert_mean, camera, settings};
use runelight_tests::devices::{Device, render};
use scene::render::Estimator;

#[test]
fn a_closed_box_reads_the_geometric_series() {
    let mut b = Builder::new();
    let wall = b.plain(188, 1.0);
    b.cuboid(Vec3::new(-31., -40., -20.), Vec3::new(50., 17., 29.), true, [wall; 6]);
    let scene = b.build();
    let rho = scene::material::srgb_to_linear(188);
    for device in Device::ALL {
        for estimator in Estimator::ALL {
            for depth in [1, 2, 4, 0] {
                let expected = match depth {
                    0 => 1.0 / (1.0 - rho),
                    n => (1.0 - rho.powi(n)) / (1.0 - rho),
                };
                let view = camera(Vec3::ZERO, 5.0, 30.0, 90.0);
                let film =
                    render(device, &scene, &settings(view, 16, estimator, depth as u32), 64);
                let what = format!("{device:?} {} at depth {depth}", estimator.name());
                assert_mean(&film, [expected; 3], 4.5, &what);
                assert_eq!(film.counters.escaped, 0, "{what}");
            }
        }
    }
}
