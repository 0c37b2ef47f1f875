// Light by light style. Included once for each renderer, with its `render`.

use gallery::builder::list_emitters;
use glam::Vec3;
use runelight_tests::builder::settings;
use runelight_tests::scenes::{room, room_view};
use runelight_tests::stats::ZTest;
use ::scene::Scene;
use scene::render::{Estimator, Film, Settings};
use scene::{LightStyle, PointLight};
use std::sync::Arc;

/// Steady light, one style that burns and one that is dark, at the brightnesses given; `apart` says
/// whether the film tells them apart.
fn lamps(brightness: [f32; 2], apart: bool) -> Arc<Scene> {
    let mut scene = Arc::unwrap_or_clone(room());
    let lamp = |x: f32, style: u16, brightness: f32| PointLight {
        position: Vec3::new(x, -15.0, 18.0),
        radius: 1.0,
        intensity: Vec3::new(300.0, 200.0, 100.0 * x.abs()) * brightness,
        style,
        ..PointLight::default()
    };
    let [first, second] = if apart { [1.0; 2] } else { brightness };
    scene.lights = vec![
        lamp(-20.0, 0, 1.0),
        lamp(5.0, 33, second),
        lamp(20.0, 2, first),
        lamp(-5.0, 2, first),
    ];
    if apart {
        let style = |number, brightness| LightStyle { number, brightness };
        scene.styles = vec![style(0, 1.0), style(2, brightness[0]), style(33, brightness[1])];
    }
    list_emitters(&mut scene);
    Arc::new(scene.completed())
}

fn view(aovs: bool, seed: u64) -> Settings {
    Settings {
        aovs,
        seed,
        time: 1.3,
        ..settings(room_view(), 24, Estimator::Mis, 4)
    }
}

#[test]
fn layers_of_styles_add_up_to_the_picture_and_relight_it() {
    for aovs in [false, true] {
        let film = render(&lamps([0.75, 0.0], true), &view(aovs, 1), 64);
        let numbers: Vec<u16> = film.styles.iter().map(|s| s.number).collect();
        assert_eq!(numbers, [0, 2, 33]);
        let sum = |brightness: [f32; 3], i: usize| {
            [0, 1, 2].map(|c| {
                let parts = brightness.iter().zip(&film.styles);
                parts.map(|(b, s)| b * s.radiance[i][c]).sum::<f32>()
            })
        };
        for i in 0..film.beauty.len() {
            let all = sum([1.0, 0.75, 0.0], i);
            for c in 0..3 {
                let off = (all[c] - film.beauty[i][c]).abs();
                assert!(off <= 2e-5 * film.beauty[i][c].max(all[c]), "{i}: {all:?}");
                assert!(film.styles.iter().all(|s| s.radiance[i][c] >= 0.0));
            }
        }
        // Each style by itself, as if there was no other; and all at another moment. A relit
        // picture's own variance is not known: its like has the film's, times what is added at most.
        for brightness in [[0.0, 0.0], [2.0, 0.0], [0.0, 1.5], [0.3, 2.0]] {
            let mut relit = Film {
                width: film.width,
                height: film.height,
                beauty: (0..film.beauty.len())
                    .map(|i| sum([1.0, brightness[0], brightness[1]], i))
                    .collect(),
                ..Film::default()
            };
            let truth = render(&lamps(brightness, false), &view(false, 2), 256);
            relit.variance = truth.variance.iter().map(|v| v.map(|v| 8.0 * v)).collect();
            let z = ZTest::new(&relit, &truth);
            z.assert(&format!("relit at {brightness:?}"));
            assert!((z.mean_ratio - 1.0).abs() < 0.03, "{z:?} at {brightness:?}");
        }
    }
}

#[test]
fn without_styles_there_are_no_layers_of_them() {
    assert!(render(&lamps([1.0; 2], false), &view(true, 1), 1).styles.is_empty());
}
