//! The tone mapping pass: the same on both shader compilers and on the CPU.

use rt::{PathTracer, ToneCurve};
use runelight::tonemap::{Tonemap, display_u8};
use runelight_tests::builder::settings;
use runelight_tests::devices::gpu;
use runelight_tests::levels;
use scene::import::LightMode;
use scene::render::{Estimator, Renderer};

#[test]
fn display_codes_are_the_cpus() {
    let scene = levels::sample(LightMode::Auto);
    let view = settings(scene.cameras[0].clone(), 37, Estimator::Mis, 3);
    let mut tracer = PathTracer::new(gpu(), &scene, &view).expect("a path tracer");
    tracer.accumulate(4).expect("samples");
    let film = tracer.film().expect("a film");
    for (curve, twin) in [
        (ToneCurve::Agx, Tonemap::Agx),
        (ToneCurve::Aces, Tonemap::Aces),
        (ToneCurve::Reinhard, Tonemap::Reinhard),
        (ToneCurve::Clip, Tonemap::Clip),
    ] {
        for ev in [-2.0, 0.0, 3.5] {
            let codes = tracer.display(curve, ev).expect("codes");
            let other = tracer.display_by_other_compiler(curve, ev).expect("codes");
            for (i, &radiance) in film.beauty.iter().enumerate() {
                let expected = display_u8(radiance, ev, twin);
                for c in 0..3 {
                    let [a, b, x] = [codes[i][c], other[i][c], expected[c]];
                    let what = format!("{curve:?} at {ev} EV, {radiance:?}: {a}, {b}, CPU {x}");
                    // Powers and logarithms may round differently: one code at most.
                    assert!(a.abs_diff(x) <= 1 && b.abs_diff(x) <= 1, "{what}");
                }
            }
        }
    }
    drop(tracer);
    assert_eq!(gpu().validation_messages(), [""; 0]);
}
