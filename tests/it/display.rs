//! The passes that pictures are shown by: the same on both shader compilers and on the CPU.

use rt::{Filter, Look, Mesh, PICTURE, PathTracer, Screen, ToneCurve, Vertex};
use runelight::denoise::Denoise;
use runelight::tonemap::{Tonemap, display_u8};
use runelight_tests::builder::settings;
use runelight_tests::devices::gpu;
use runelight_tests::{levels, scenes};
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

#[test]
fn the_filter_for_noise_is_the_cpus() {
    let scene = levels::sample(LightMode::Auto);
    let mut view = settings(scene.cameras[0].clone(), 67, Estimator::Mis, 3);
    view.aovs = true;
    let mut tracer = PathTracer::new(gpu(), &scene, &view).expect("a path tracer");
    let mut samples = 0;
    // One sample, few, and as many as tell their own noise.
    for more in [1, 3, 12] {
        samples += more;
        tracer.accumulate(more).expect("samples");
        let mut film = tracer.film().expect("a film");
        Denoise::Svgf.apply(&mut film);
        let differs = (film.picture().iter().zip(&film.beauty)).filter(|(p, b)| p != b);
        assert!(differs.count() > film.beauty.len() / 2, "it does something");
        for picture in tracer.denoised().expect("pictures") {
            for (i, (a, b)) in picture.iter().zip(film.picture()).enumerate() {
                // Exponentials and powers may round differently, five times one after the other.
                let near = (0..3).all(|c| (a[c] - b[c]).abs() <= 2e-3 * b[c].abs() + 1e-5);
                assert!(near, "pixel {i} of {samples} samples: {a:?}, CPU {b:?}");
            }
        }
    }
    drop(tracer);
    assert_eq!(gpu().validation_messages(), [""; 0]);
}

/// What a screen shows of a film.
fn shown(screen: &mut Screen, tracer: &PathTracer, size: [u32; 2], denoise: bool) -> Vec<[u8; 4]> {
    let [x, y] = size.map(|n| n as f32);
    let corner = |position: [f32; 2], texture_at| Vertex {
        position,
        texture_at,
        color: [255; 4],
    };
    let mesh = Mesh {
        texture: PICTURE,
        clip: [0.0, 0.0, x, y],
        vertices: &[
            corner([0.0, 0.0], [0.0, 0.0]),
            corner([x, 0.0], [1.0, 0.0]),
            corner([x, y], [1.0, 1.0]),
            corner([0.0, y], [0.0, 1.0]),
        ],
        indices: &[0, 1, 2, 0, 2, 3],
    };
    let look = Look {
        curve: ToneCurve::Agx,
        ev: 0.0,
        denoise,
    };
    let film = Some((tracer, look));
    (screen.draw(film, Filter::Nearest, &[mesh], 1.0)).expect("a frame");
    screen.read().expect("a device").expect("a picture").1
}

#[test]
fn pictures_that_follow_each_other_remember_what_stays_in_sight() {
    let scene = scenes::room();
    let mut view = settings(scenes::room_view(), 67, Estimator::Mis, 4);
    view.aovs = true;
    let size = [view.width, view.height];
    let mut tracer = PathTracer::new(gpu(), &scene, &view).expect("a path tracer");
    let fresh = || Screen::off_screen(gpu(), size).expect("a screen");
    let mut moving = fresh();
    let mut step = |tracer: &mut PathTracer, yaw: f32| {
        view.camera.yaw_deg += yaw;
        view.seed += 1;
        tracer.set(&view).expect("settings");
        tracer.accumulate(1).expect("samples");
    };
    // The eye turns and goes on.
    for _ in 0..12 {
        step(&mut tracer, 0.4);
        shown(&mut moving, &tracer, size, true);
    }
    let remembers = shown(&mut moving, &tracer, size, true);
    let forgets = shown(&mut fresh(), &tracer, size, true);
    // With more samples it needs its memory less, and then no more.
    tracer.accumulate(7).expect("samples");
    let less = [
        shown(&mut moving, &tracer, size, true),
        shown(&mut fresh(), &tracer, size, true),
    ];
    assert_ne!(less[0], less[1]);
    tracer.accumulate(1).expect("samples");
    let rested = shown(&mut moving, &tracer, size, true);
    assert_eq!(rested, shown(&mut fresh(), &tracer, size, true));
    tracer.accumulate(300).expect("samples");
    let truth = shown(&mut fresh(), &tracer, size, false);
    // Edges, which one sample does not smooth, are wrong in both.
    let error = |picture: &[[u8; 4]]| {
        let square = |(a, b): (&u8, &u8)| u32::from(a.abs_diff(*b)).pow(2);
        let of = |(p, t): (&[u8; 4], &[u8; 4])| p.iter().zip(t).map(square).sum::<u32>();
        let mut errors: Vec<u32> = picture.iter().zip(&truth).map(of).collect();
        errors.sort_unstable();
        errors[..errors.len() * 3 / 4].iter().sum::<u32>() as f64 / truth.len() as f64
    };
    let [with, without] = [&remembers, &forgets].map(|p| error(p));
    println!(
        "squared error of three pixels in four: {with} with the pictures before, {without} without"
    );
    assert!(with < 0.5 * without, "{with} with, {without} without");

    // What lies behind was not in sight.
    step(&mut tracer, 180.0);
    let turned = shown(&mut moving, &tracer, size, true);
    assert_eq!(turned, shown(&mut fresh(), &tracer, size, true));
    drop((moving, tracer));
    assert_eq!(gpu().validation_messages(), [""; 0]);
}
