//! The two renderers and the four estimators agree within noise.

use glam::Vec3;
use runelight_tests::builder::settings;
use runelight_tests::devices::{Device, render};
use runelight_tests::levels;
use runelight_tests::scenes::{in_fog, polished, pool, pool_views, room_view};
use runelight_tests::stats::ZTest;
use scene::Scene;
use scene::import::LightMode;
use scene::render::{Estimator, Film, Selection};
use std::sync::Arc;

/// Levels that have sky, liquids, fences, lamps and light entities between them.
const LEVELS: [&str; 3] = ["start", "lq_e0m1", "lqdm1"];

/// A picture of 40 x 40 pixels from the level's start.
fn picture(device: Device, scene: &Arc<Scene>, estimator: Estimator, samples: u32) -> Film {
    let mut view = settings(scene.cameras[0].clone(), 40, estimator, 4);
    if estimator == Estimator::Nee {
        // Beside a lamp its samples have no bounded variance. Lists of lights go there more often,
        // and a z-test of few samples takes the light they have not found for a difference.
        view.selection = Selection::Power;
    }
    // Different numbers on the two devices and for each estimator.
    view.seed = 4 * (device as u64) + estimator as u64;
    render(device, scene, &view, samples)
}

fn check_devices(scene: &Arc<Scene>) {
    for estimator in Estimator::ALL {
        let films = Device::ALL.map(|device| picture(device, scene, estimator, 64));
        let what = format!("{} by {}, Vulkan against CPU", scene.name, estimator.name());
        ZTest::new(&films[0], &films[1]).assert(&what);
    }
}

#[test]
fn the_devices_agree_on_the_sample_level() {
    check_devices(&levels::sample(LightMode::Auto));
}

#[test]
fn the_devices_agree_through_water_and_glass() {
    let mut scene = Arc::unwrap_or_clone(pool());
    for (i, view) in pool_views().into_iter().enumerate() {
        scene.name = format!("pool {i}");
        scene.cameras = vec![view];
        check_devices(&Arc::new(scene.clone()));
    }
}

#[test]
fn the_devices_agree_in_fog() {
    let mut scene = Arc::unwrap_or_clone(pool());
    let lamp = |position, spot| scene::PointLight {
        position,
        radius: 2.0,
        intensity: Vec3::new(400.0, 300.0, 200.0),
        spot,
        ..scene::PointLight::default()
    };
    let spot = scene::light::Spot {
        direction: Vec3::NEG_Z,
        cos_inner: 0.9,
        cos_outer: 0.5,
    };
    scene.lights = vec![
        lamp(Vec3::new(-30.0, -20.0, 10.0), None),
        lamp(Vec3::new(10.0, -10.0, 35.0), Some(spot)),
    ];
    let scene = in_fog(Arc::new(scene), 0.01, Vec3::new(0.9, 0.7, 0.5));
    let mut scene = Arc::unwrap_or_clone(scene);
    for (i, view) in pool_views().into_iter().enumerate() {
        scene.name = format!("pool in fog {i}");
        scene.cameras = vec![view];
        check_devices(&Arc::new(scene.clone()));
    }
}

#[test]
fn the_devices_agree_on_a_room_with_suns() {
    let mut scene = Arc::unwrap_or_clone(runelight_tests::scenes::sunny_room());
    scene.cameras = vec![room_view()];
    check_devices(&Arc::new(scene));
}

#[test]
fn the_devices_agree_through_a_lens() {
    let mut scene = Arc::unwrap_or_clone(pool());
    scene.name = "pool through a lens".into();
    scene.cameras = vec![pool_views()[0].clone()];
    scene.cameras[0].lens = scene::camera::Lens::new(2.0, 40.0);
    let scene = Arc::new(scene);
    check_devices(&scene);
    // First-hit layers are means over the lens, too.
    let mut view = settings(scene.cameras[0].clone(), 24, Estimator::Naive, 1);
    view.aovs = true;
    let [gpu, cpu] = Device::ALL.map(|device| render(device, &scene, &view, 256));
    let mean = |film: &Film| {
        let sum: f64 = film.depth.iter().map(|&d| f64::from(d)).sum();
        sum / film.depth.len() as f64
    };
    assert!((mean(&gpu) / mean(&cpu) - 1.0).abs() < 2e-3);
}

#[test]
fn the_devices_agree_on_gloss_and_bumps() {
    let mut scene = Arc::unwrap_or_clone(polished());
    scene.name = "polished".into();
    scene.cameras = vec![room_view()];
    check_devices(&Arc::new(scene));
}

#[test]
fn the_devices_agree_on_real_levels() {
    let Some(game) = levels::game() else { return };
    for name in LEVELS {
        check_devices(&levels::load(&game, name, LightMode::Auto).expect(name));
    }
}

/// `naive` and `uniform` can't find light entities, so these are left out here.
#[test]
fn the_estimators_agree_on_each_device() {
    let scene = levels::sample(LightMode::Textures);
    for device in Device::ALL {
        let samples = match device {
            Device::Vulkan => 512,
            Device::Cpu => 1024,
        };
        let judge = picture(device, &scene, Estimator::Mis, samples);
        for estimator in [Estimator::Naive, Estimator::Uniform, Estimator::Nee] {
            let film = picture(device, &scene, estimator, samples);
            let what = format!("{} against mis on {device:?}", estimator.name());
            ZTest::new(&film, &judge).assert(&what);
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_picture_however_it_is_split() {
    use rt::PathTracer;
    use scene::render::Renderer;
    let scene = levels::sample(LightMode::Auto);
    let mut view = settings(scene.cameras[0].clone(), 24, Estimator::Mis, 3);
    view.aovs = true;
    let whole = render(Device::Vulkan, &scene, &view, 7);
    let gpu = runelight_tests::devices::gpu();
    let mut tracer = PathTracer::new(gpu, &scene, &view).expect("a path tracer");
    for samples in [1, 4, 2] {
        tracer.accumulate(samples).expect("samples");
    }
    let split = tracer.film().expect("a film");
    assert_eq!(split.counters, whole.counters);
    assert_eq!(split.beauty, whole.beauty);
    assert_eq!(split.variance, whole.variance);
    assert_eq!(split.indirect, whole.indirect);
    assert_eq!(split.depth, whole.depth);
    assert_eq!(split.id, whole.id);
    view.seed = 2;
    assert_ne!(
        render(Device::Vulkan, &scene, &view, 7).beauty,
        whole.beauty
    );
}

/// What the camera sees first does not depend on light: the planes agree but for pixels at edges.
#[test]
fn the_first_hit_layers_agree() {
    let scene = levels::sample(LightMode::Auto);
    let mut view = settings(scene.cameras[0].clone(), 40, Estimator::Naive, 3);
    view.aovs = true;
    let [gpu, cpu] = Device::ALL.map(|device| render(device, &scene, &view, 64));
    let pixels = gpu.depth.len();
    let agree = |name: &str, near: &dyn Fn(usize) -> bool| {
        let share = (0..pixels).filter(|&i| near(i)).count() as f64 / pixels as f64;
        assert!(share > 0.9, "{name}: only {share} of the pixels agree");
    };
    let close = |a: [f32; 3], b: [f32; 3], allowed: f32| {
        a.iter().zip(b).all(|(x, y)| (x - y).abs() <= allowed)
    };
    agree("depth", &|i| {
        (gpu.depth[i] - cpu.depth[i]).abs() <= 0.02 * cpu.depth[i] + 0.5
    });
    agree("normal", &|i| close(gpu.normal[i], cpu.normal[i], 0.1));
    agree("albedo", &|i| close(gpu.albedo[i], cpu.albedo[i], 0.05));
    agree("position", &|i| {
        close(gpu.position[i], cpu.position[i], 0.03 * cpu.depth[i] + 0.5)
    });
    agree("emission", &|i| {
        close(gpu.emission[i], cpu.emission[i], 0.3)
    });
    // The pixel's first sample is another one on each device: faces differ at their edges.
    let same = (0..pixels).filter(|&i| gpu.id[i] == cpu.id[i]).count() as f64 / pixels as f64;
    assert!(same > 0.7, "ids agree in {same} of the pixels");
    for film in [&gpu, &cpu] {
        for i in 0..pixels {
            let parts = |c: usize| film.emission[i][c] + film.direct[i][c] + film.indirect[i][c];
            for c in 0..3 {
                let (whole, parts) = (film.beauty[i][c], parts(c));
                assert!(
                    (whole - parts).abs() <= 1e-4 * whole + 1e-6,
                    "{whole} is not {parts}"
                );
            }
        }
    }
}
