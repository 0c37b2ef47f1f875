//! The two renderers and the four estimators agree within noise.

use runelight_tests::builder::settings;
use runelight_tests::devices::{Device, render};
use runelight_tests::levels;
use runelight_tests::stats::ZTest;
use scene::render::Estimator;

/// Levels with sky, liquids, fences, lamps and light entities between them.
const LEVELS: [&str; 3] = ["start", "lq_e0m1", "lqdm1"];

#[test]
fn the_devices_agree_on_real_levels() {
    for name in LEVELS {
        let Some(scene) = levels::import(name) else { return };
        for estimator in Estimator::ALL {
            let view = settings(scene.cameras[0].clone(), 48, estimator, 4);
            let films = Device::ALL.map(|device| render(device, &scene, &view, 48));
            let test = ZTest::new(&films[0], &films[1]);
            println!("{name} {} {test:?} escaped {:?}", estimator.name(), films.each_ref().map(|f| (f.counters.escaped, f.counters.rays)));
            test.assert(&format!("{name}, {}", estimator.name()));
        }
    }
}
