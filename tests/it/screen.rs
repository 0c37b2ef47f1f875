//! The frame loop of the window, without one.

use rt::{Filter, Look, Mesh, PICTURE, PathTracer, Screen, Shown, ToneCurve, Vertex};
use runelight_tests::builder::settings;
use runelight_tests::devices::gpu;
use runelight_tests::levels;
use scene::import::LightMode;
use scene::render::{Estimator, Renderer};

/// The corners of a rectangle, and its two triangles.
fn rectangle([left, top, right, bottom]: [f32; 4], color: [u8; 4]) -> [Vertex; 4] {
    [
        ([left, top], [0.0, 0.0]),
        ([right, top], [1.0, 0.0]),
        ([right, bottom], [1.0, 1.0]),
        ([left, bottom], [0.0, 1.0]),
    ]
    .map(|(position, texture_at)| Vertex {
        position,
        texture_at,
        color,
    })
}
const TRIANGLES: [u32; 6] = [0, 1, 2, 0, 2, 3];
const WHITE: [u8; 4] = [255; 4];
const PLAIN: Look = Look {
    curve: ToneCurve::Agx,
    ev: 1.0,
    denoise: false,
};

#[test]
fn the_screen_shows_the_film_and_what_lies_over_it() {
    let scene = levels::sample(LightMode::Auto);
    let view = settings(scene.cameras[0].clone(), 32, Estimator::Mis, 3);
    let [width, height] = [view.width, view.height];
    let mut tracer = PathTracer::new(gpu(), &scene, &view).expect("a path tracer");
    let mut screen = Screen::off_screen(gpu(), [width, height]).expect("a screen");
    assert!(screen.read().expect("a device").is_none(), "nothing drawn");
    // Two texels, one of them half transparent: premultiplied.
    let texels = [[0, 100, 0, 100], [200, 0, 0, 255]];
    (screen.set_texture(7, [2, 1], &texels, Filter::Nearest)).expect("a texture");

    let points = [width, height].map(|n| n as f32 / 2.0);
    let whole = rectangle([0.0, 0.0, points[0], points[1]], WHITE);
    let over = rectangle([2.0, 2.0, 6.0, 4.0], [255, 255, 255, 255]);
    let everywhere = [0.0, 0.0, 1000.0, 1000.0];
    let mesh = |texture, clip, vertices| Mesh {
        texture,
        clip,
        vertices,
        indices: &TRIANGLES,
    };
    let meshes = [
        mesh(PICTURE, everywhere, &whole[..]),
        mesh(7, [0.0, 0.0, 1000.0, 3.0], &over[..]),
        // A texture that nobody gave.
        mesh(8, everywhere, &whole[..]),
    ];
    // More frames than may be under way, each of another film.
    let mut shown = Vec::new();
    for _ in 0..5 {
        tracer.accumulate(1).expect("samples");
        let film = Some((&tracer, PLAIN));
        let drawn = screen.draw(film, Filter::Linear, &meshes, 2.0);
        assert_eq!(drawn.expect("a frame"), Shown::Yes);
        let (size, pixels) = screen.read().expect("a device").expect("a picture");
        assert_eq!(size, [width, height]);
        let codes = tracer.display(PLAIN.curve, PLAIN.ev).expect("codes");
        let at = |p: &[[u8; 4]], x: u32, y: u32| p[(y * width + x) as usize];
        for y in 0..height {
            for x in 0..width {
                let [film, seen] = [at(&codes, x, y), at(&pixels, x, y)];
                // Two pixels to a point; cut off below 3 points.
                let inside = (4..12).contains(&x) && (4..6).contains(&y);
                let expected = match (inside, x < 8) {
                    (false, _) => film,
                    (true, true) => {
                        let under = [0, 1, 2].map(|c| f32::from(film[c]) * (155.0 / 255.0));
                        [under[0], 100.0 + under[1], under[2], 255.0].map(|v| v.round() as u8)
                    }
                    (true, false) => [200, 0, 0, 255],
                };
                let near = (0..4).all(|c| seen[c].abs_diff(expected[c]) <= 1);
                assert!(near, "{x} {y}: {seen:?}, not {expected:?}");
            }
        }
        shown.push(pixels);
    }
    assert_ne!(shown[0], shown[4], "another film, another picture");

    // The film stays while nothing new is given, also on a screen of another size.
    screen.resize([2 * width, 2 * height]).expect("a size");
    let drawn = screen.draw(None, Filter::Nearest, &meshes[..1], 4.0);
    assert_eq!(drawn.expect("a frame"), Shown::Yes);
    let (_, pixels) = screen.read().expect("a device").expect("a picture");
    assert_eq!(
        pixels[0],
        tracer.display(PLAIN.curve, PLAIN.ev).expect("codes")[0]
    );
    drop((screen, tracer));
    assert_eq!(gpu().validation_messages(), [""; 0]);
}

#[test]
fn other_settings_give_the_film_that_a_new_path_tracer_gives() {
    let scene = levels::sample(LightMode::Auto);
    let first = settings(scene.cameras[0].clone(), 24, Estimator::Mis, 3);
    let mut tracer = PathTracer::new(gpu(), &scene, &first).expect("a path tracer");
    tracer.accumulate(2).expect("samples");
    let mut turned = first.clone();
    turned.camera.yaw_deg += 40.0;
    let mut small = turned.clone();
    (small.width, small.height) = (12, 9);
    let mut other = small.clone();
    (other.estimator, other.aovs, other.depth) = (Estimator::Nee, true, 2);
    let clamped = scene::render::Settings {
        clamp: Some(2.0),
        ..other.clone()
    };
    for settings in [turned, small, other, clamped, first] {
        tracer.set(&settings).expect("settings");
        tracer.accumulate(3).expect("samples");
        while tracer.is_busy().expect("a device") {
            std::thread::yield_now();
        }
        let film = tracer.film().expect("a film");
        let mut alone = PathTracer::new(gpu(), &scene, &settings).expect("a path tracer");
        alone.accumulate(3).expect("samples");
        let alone = alone.film().expect("a film");
        assert_eq!(film.beauty, alone.beauty);
        assert_eq!((film.albedo, film.clamped), (alone.albedo, alone.clamped));
        assert_eq!((film.samples, film.counters.rays), (3, alone.counters.rays));
        // An emptied film is empty before its first sample.
        tracer.set(&settings).expect("settings");
        assert_eq!(tracer.film().expect("a film").samples, 0);
    }
    drop(tracer);
    assert_eq!(gpu().validation_messages(), [""; 0]);
}
