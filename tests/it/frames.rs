//! What showing frames costs the device, and what frames must not be.

use runelight_tests::builder::settings;
use runelight_tests::devices::{Device, gpu_alone, render_moments};
use runelight_tests::moving::{moment, moving_room, smooth_room, still};
use runelight_tests::scenes::{room, room_view};
use runelight_tests::stats::ZTest;
use scene::render::{Estimator, Renderer, Settings};
use scene::{Frame, Instance, PointLight, SeenBy};

#[test]
fn the_devices_agree_on_a_moment() {
    let scene = moving_room();
    for estimator in Estimator::ALL {
        let lights = estimator.samples_lights();
        let films = Device::ALL.map(|device| {
            let view = settings(room_view(), 32, estimator, 4);
            let moments = vec![(moment(&scene, 0.8, lights), 64)];
            let mut films = render_moments(device, &scene, &view, &[(device as u64, moments)]);
            films.remove(0)
        });
        let what = format!("a moment by {}, Vulkan against CPU", estimator.name());
        ZTest::new(&films[0], &films[1]).assert(&what);
    }
}

/// Facets that stand for round surfaces, in poses between two, seen by both devices and found by all estimators; the
/// scene made in that moment has them rigid.
#[test]
fn the_devices_agree_on_facets_shaded_as_round() {
    let scene = smooth_room();
    assert!(scene.features.smooth_normals && !moving_room().features.smooth_normals);
    let film = |device, estimator, seed| {
        let view = settings(room_view(), 32, estimator, 4);
        let moments = vec![(moment(&scene, 0.8, false), 128)];
        render_moments(device, &scene, &view, &[(seed, moments)]).remove(0)
    };
    let judge = film(Device::Cpu, Estimator::Mis, 1);
    for estimator in Estimator::ALL {
        let found = film(Device::Vulkan, estimator, 2);
        ZTest::new(&found, &judge).assert(&format!("round facets by {}", estimator.name()));
    }
    let found = film(Device::Cpu, Estimator::Uniform, 3);
    ZTest::new(&found, &judge).assert("round facets, uniform on the CPU");
    let moments = vec![(moment(&moving_room(), 0.8, false), 128)];
    let view = settings(room_view(), 32, Estimator::Mis, 4);
    let flat = render_moments(Device::Cpu, &moving_room(), &view, &[(1, moments)]).remove(0);
    assert_ne!(flat.beauty, judge.beauty, "it must matter");
}

#[test]
fn memory_does_not_grow_with_the_frames_shown() {
    let scene = moving_room();
    let gpu = gpu_alone();
    let view = settings(room_view(), 8, Estimator::Mis, 2);
    let mut tracer = rt::PathTracer::new(&gpu, &scene, &view).expect("a path tracer");
    let mut pass = || {
        for i in 0..100_u16 {
            let frame = moment(&scene, f32::from(i) / 100.0, true);
            tracer.show(&frame).expect("a frame");
            tracer.accumulate(1).expect("a sample");
        }
        tracer.take_timings().expect("an end");
        tracer.allocated_bytes()
    };
    let (first, second) = (pass(), pass());
    assert_eq!(first, second);
    drop(tracer);
    assert_eq!(gpu.validation_messages(), [""; 0], "validation messages");
}

/// A scene at rest pays nothing for what moves: neither its features nor its emitters are others.
#[test]
fn what_stands_still_has_no_features_of_frames() {
    let features = room().features;
    assert!(!(features.frames || features.poses || features.skins || features.masks));
    let scene = moving_room();
    let features = still(&scene, &moment(&scene, 0.1, true)).features;
    assert!(!features.frames && features.poses && features.skins && features.masks);
}

#[test]
fn frames_that_contradict_their_scene_are_refused() {
    let scene = moving_room();
    let view = settings(room_view(), 8, Estimator::Mis, 2);
    let gpu = runelight_tests::devices::gpu();
    let mut tracer = rt::PathTracer::new(gpu, &scene, &view).expect("a path tracer");
    let mut reference = reference::Reference::new(scene.clone(), &view).expect("a reference");
    let good = moment(&scene, 0.1, true);
    let broken: [fn(&mut Frame); 12] = [
        |f| f.instances.clear(),
        |f| f.instances[0].transform.translation.x += 1.0,
        |f| f.instances[1].mesh = 99,
        |f| f.instances[1].pose.to = 3,
        |f| f.instances[1].pose.fraction = 1.5,
        |f| f.instances[1].pose.fraction = f32::NAN,
        |f| f.instances[1].transform.translation.y = f32::INFINITY,
        |f| f.instances[1].material = Some(scene::MaterialId(99)),
        |f| f.loose.triangles[0].vertices[2] = 1000,
        |f| f.loose.positions[0].z = f32::NAN,
        |f| f.lights[0].radius = 0.0,
        |f| f.styles[5] = -1.0,
    ];
    for break_it in broken {
        let mut frame = good.clone();
        break_it(&mut frame);
        let told = frame.check(&scene).expect_err("a contradiction");
        let error = tracer.show(&frame).expect_err(told).to_string();
        assert!(error.ends_with(told), "{error}");
        let error = reference.show(&frame).expect_err(told).to_string();
        assert!(error.ends_with(told), "{error}");
    }
    // What was shown before is still there.
    tracer.show(&good).expect("a frame");
    reference.show(&good).expect("a frame");
    tracer.accumulate(1).expect("a sample");
    reference.accumulate(1).expect("a sample");
    // A scene at rest shows none.
    let at_rest = room();
    let frame = at_rest.as_frame(&room_view(), 0.0);
    let mut tracer = rt::PathTracer::new(gpu, &at_rest, &view).expect("a path tracer");
    tracer.show(&frame).expect_err("not made for frames");
}

/// The camera looks at a wall through what it does not see, and at what only it sees; a lamp above sees
/// what the camera does not.
#[test]
fn masks_hide_from_the_camera_and_from_light() {
    let scene = moving_room();
    let view = Settings {
        aovs: true,
        ..settings(room_view(), 16, Estimator::Mis, 3)
    };
    let show = |device, seen_by: Option<SeenBy>| {
        let mut frame = scene.as_frame(&room_view(), 0.0);
        frame.lights = vec![PointLight {
            position: room_view().position,
            radius: 1.0,
            intensity: glam::Vec3::splat(50_000.0),
            ..PointLight::default()
        }];
        let basis = room_view().view_basis(16, 16);
        let middle = (basis.origin + 8.0 * basis.forward).as_vec3();
        let small = glam::Affine3A::from_scale(glam::Vec3::splat(0.3));
        let transform = glam::Affine3A::from_translation(middle) * small;
        frame.instances.extend(seen_by.map(|seen_by| Instance {
            seen_by,
            ..Instance::new(1, transform, "blob")
        }));
        let mut films = render_moments(device, &scene, &view, &[(1, vec![(frame, 16)])]);
        films.remove(0)
    };
    for device in Device::ALL {
        let empty = show(device, None);
        let [all, camera, others] =
            [SeenBy::ALL, SeenBy::CAMERA, SeenBy::OTHERS].map(|s| show(device, Some(s)));
        let centre = 8 * 16 + 8;
        assert!(all.depth[centre] < 0.8 * empty.depth[centre]);
        assert_eq!(all.depth, camera.depth);
        assert_eq!(empty.depth, others.depth);
        // Its shadow lies behind it, from the light at the eye.
        let [dark, bright] = [&others, &empty].map(|f| f.direct[centre][1]);
        assert!(dark < 0.6 * bright, "{device:?}: {dark} of {bright}");
        // Around it, what the camera alone sees takes no light away.
        let outside = |i: &usize| empty.depth[*i] == camera.depth[*i];
        for i in (0..256).filter(outside) {
            assert_eq!(camera.direct[i], empty.direct[i], "{device:?}, pixel {i}");
        }
    }
}
