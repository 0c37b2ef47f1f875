//! Real levels: no ray leaves a sealed one, and nothing is not a number.

mod common;
#[path = "common/level.rs"]
mod level;

use common::{render, settings};
use scene::render::Estimator;

#[test]
fn no_ray_leaves_a_sealed_level() {
    let game = match level::game() {
        Ok(game) => game,
        Err(why) => {
            println!("SKIPPED: {why}");
            return;
        }
    };
    let mut sealed = 0;
    for name in ["dm3", "gpl_e1m1", "lq_e0m1", "lq_e3m6"] {
        let scene = level::load(&game, name).unwrap();
        sealed += u32::from(scene.report.sealed);
        for camera in scene.cameras.iter().take(2) {
            let film = render(&scene, &settings(camera.clone(), 48, Estimator::Mis, 8), 2);
            let counters = film.counters;
            assert_eq!(counters.nonfinite, 0, "{name}, {camera:?}");
            assert!(
                film.mean_radiance()[1] > 0.0,
                "{name} is black from {camera:?}"
            );
            if scene.report.sealed {
                assert_eq!(counters.escaped, 0, "{name}, {camera:?}");
            }
        }
    }
    assert!(sealed > 0, "no sealed level to test");
}
