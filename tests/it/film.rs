//! What a film holds besides means: rays that left, and pixels with samples of their own number.

use gallery::builder::list_emitters;
use glam::Vec3;
use runelight_tests::builder::{Builder, camera, settings};
use runelight_tests::devices::{Device, gpu, render};
use runelight_tests::scenes::{room, room_view};
use runelight_tests::stats::ZTest;
use scene::cells::{CELL, CellNode, LightCells};
use scene::light::{PointLight, Spot};
use scene::render::{
    ESCAPES_KEPT, Escape, Estimator, Film, Renderer, Sampler, Selection, Settings,
};
use scene::{Scene, Sun};
use std::sync::Arc;

/// A film of the sum of several calls, each with as many samples per pixel as `schedule` says.
fn per_pixel(
    device: Device,
    scene: &Arc<Scene>,
    settings: &Settings,
    schedules: &[Vec<u32>],
) -> Film {
    fn run<R: Renderer>(mut renderer: R, schedules: &[Vec<u32>]) -> Film {
        for schedule in schedules {
            renderer.accumulate_per_pixel(schedule).expect("samples");
        }
        renderer.film().expect("a film")
    }
    match device {
        Device::Vulkan => {
            let tracer = rt::PathTracer::new(gpu(), scene, settings).expect("a path tracer");
            let film = run(tracer, schedules);
            assert_eq!(gpu().validation_messages(), [""; 0], "validation messages");
            film
        }
        Device::Cpu => run(
            reference::Reference::new(scene.clone(), settings).expect("a reference"),
            schedules,
        ),
    }
}

#[test]
fn a_pixel_with_as_many_samples_has_the_same_mean_whoever_has_more() {
    let scene = room();
    let mut view = settings(room_view(), 12, Estimator::Mis, 3);
    view.aovs = true;
    for device in Device::ALL {
        let even = render(device, &scene, &view, 5);
        // 3 everywhere, then 2 more where the number is divisible by 3, 7 more at every fourth.
        let three = vec![3; 144];
        let more: Vec<u32> = (0..144).map(|i| if i % 3 == 0 { 2 } else { 0 }).collect();
        let most: Vec<u32> = (0..144).map(|i| if i % 4 == 1 { 7 } else { 0 }).collect();
        let film = per_pixel(device, &scene, &view, &[three, more.clone(), most.clone()]);
        for i in 0..144 {
            let count = 3 + more[i] + most[i];
            assert_eq!(film.sample_counts[i], count, "{device:?}");
            let same = [
                film.beauty[i] == even.beauty[i],
                film.variance[i] == even.variance[i],
                film.position[i] == even.position[i],
                film.depth[i].to_bits() == even.depth[i].to_bits(),
            ];
            if count == 5 {
                assert_eq!(same, [true; 4], "pixel {i} on {device:?}");
            } else {
                // Light may be the same, none; the place is not.
                assert!(!same[2], "pixel {i} on {device:?}");
            }
        }
        let taken: u32 = film.sample_counts.iter().sum();
        assert_eq!(film.counters.paths, u64::from(taken));
        assert_eq!(film.samples, (f64::from(taken) / 144.0).round() as u32);
        assert!(even.sample_counts.is_empty());
    }
}

#[test]
fn what_leaves_is_counted_and_the_first_are_kept() {
    // A floor under an open sky that is not there: camera rays above the horizon leave, and so do
    // most bounce rays from the floor.
    let mut b = Builder::new();
    let grey = b.plain(128, 0.0);
    b.slab(Vec3::ZERO, [100.0; 2], true, grey, [1.0; 2]);
    let scene = b.build();
    let view = settings(
        camera(Vec3::new(-90.0, 0.0, 20.0), 0.0, 0.0, 60.0),
        16,
        Estimator::Naive,
        2,
    );
    for device in Device::ALL {
        let film = render(device, &scene, &view, 4);
        let counters = film.counters;
        // Every camera ray leaves, or hits the floor and its bounce leaves.
        assert_eq!(counters.escaped, 16 * 16 * 4, "{device:?}");
        assert_eq!(film.escapes.len(), ESCAPES_KEPT);
        for escape in &film.escapes {
            let [x, y, z] = escape.origin;
            let length: f32 = escape.direction.iter().map(|d| d * d).sum();
            assert!((length - 1.0).abs() < 1e-5 && escape.sample < 4 && escape.pixel < 256);
            match scene.triangle_beside(escape.origin.into()) {
                None => assert_eq!((x, y, z), (-90.0, 0.0, 20.0)),
                Some(triangle) => {
                    assert_eq!(triangle.face, 0);
                    assert!(x.abs() <= 100.0 && y.abs() <= 100.0 && (0.0..0.1).contains(&z));
                    assert!(escape.direction[2] > 0.0);
                }
            }
        }
        let order: Vec<_> = film.escapes.iter().map(|e| (e.pixel, e.sample)).collect();
        assert!(order.is_sorted(), "{device:?}");
        // At one sample and few pixels all are kept, of both kinds.
        let small = Settings {
            width: 8,
            height: 8,
            ..view.clone()
        };
        let film = render(device, &scene, &small, 1);
        let is_camera = |e: &&Escape| scene.triangle_beside(e.origin.into()).is_none();
        let camera = film.escapes.iter().filter(is_camera).count();
        let bounce = film.escapes.len() - camera;
        assert_eq!(camera + bounce, 64, "{device:?}");
        assert!(camera > 16 && bounce > 16);
    }
}

/// The room with two lamps of very different power, one of them a spotlight.
fn room_with_lamps() -> Arc<Scene> {
    let mut scene = (*room()).clone();
    let lamp = |position: Vec3, power: f32| PointLight {
        position,
        radius: 1.0,
        intensity: Vec3::splat(power),
        ..PointLight::default()
    };
    scene.lights = vec![
        lamp(Vec3::new(-20.0, -20.0, 15.0), 150.0),
        PointLight {
            spot: Some(Spot {
                direction: -Vec3::Z,
                cos_inner: 0.9,
                cos_outer: 0.5,
            }),
            ..lamp(Vec3::new(10.0, -15.0, 25.0), 1500.0)
        },
    ];
    let direction = Vec3::new(0.3, 0.2, 1.0).normalize();
    scene.sky.suns = vec![Sun::new(direction, 0.1, Vec3::splat(2.0))];
    list_emitters(&mut scene);
    // Two cells; the list of one lacks half of what shines there, that of the other has all.
    let split = CellNode {
        normal: Vec3::X,
        distance: 0.0,
        children: [CELL, CELL | 1],
    };
    let count = scene.emitters.alias.len() as u32;
    let bounds = [
        [Vec3::new(0.0, -60.0, -60.0), Vec3::splat(60.0)],
        [Vec3::splat(-60.0), Vec3::new(0.0, 60.0, 60.0)],
    ];
    scene.cells = LightCells::new(vec![split], &bounds, &scene.emitters, |cell, seen| {
        seen.extend((0..count).step_by(2 - cell))
    });
    Arc::new(scene.completed())
}

#[test]
fn every_selection_has_the_same_expectation() {
    let scene = room_with_lamps();
    for device in Device::ALL {
        for estimator in [Estimator::Nee, Estimator::Mis] {
            let films = Selection::ALL.map(|selection| {
                let mut view = settings(room_view(), 24, estimator, 4);
                view.selection = selection;
                view.seed = selection as u64;
                render(device, &scene, &view, 1024)
            });
            let what = format!("selections with {} on {device:?}", estimator.name());
            for film in &films[1..] {
                ZTest::new(&films[0], film).assert(&what);
                // They are not one and the same.
                assert_ne!(films[0].estimated_relmse(), film.estimated_relmse());
            }
        }
    }
}

#[test]
fn sobol_points_have_the_same_expectation_and_less_error() {
    let scene = room_with_lamps();
    for device in Device::ALL {
        let mut view = settings(room_view(), 24, Estimator::Mis, 3);
        let truth = render(device, &scene, &view, 2048);
        view.seed = 1;
        let errors = Sampler::ALL.map(|sampler| {
            view.sampler = sampler;
            let film = render(device, &scene, &view, 64);
            // Few samples, and the spread of Sobol' points tells too much: the means are compared.
            let z = ZTest::new(&truth, &film);
            assert!(z.mean_z < 4.5, "{} on {device:?}: {z:?}", sampler.name());
            let squares = (film.beauty.iter().flatten())
                .zip(truth.beauty.iter().flatten())
                .map(|(a, b)| f64::from(a - b).powi(2));
            squares.sum::<f64>()
        });
        let [independent, sobol] = errors;
        assert!(
            sobol < 0.7 * independent,
            "{sobol} {independent} on {device:?}"
        );
    }
}
