//! What only the reference promises: the same bits on any number of threads, and scenes that are
//! checked once.

use reference::Reference;
use runelight_tests::builder::settings;
use runelight_tests::devices::{Device, render};
use runelight_tests::scenes::{room, room_view};
use scene::Scene;
use scene::render::{Counters, Estimator, Film, Renderer, Settings};
use std::sync::Arc;

/// A picture and its layers to the last bit.
fn bits(film: &Film) -> (Vec<u32>, Counters) {
    let planes = [
        &film.beauty,
        &film.variance,
        &film.direct,
        &film.albedo,
        &film.normal,
        &film.position,
    ];
    let mut bits: Vec<u32> = film.id.clone();
    bits.extend(film.depth.iter().map(|d| d.to_bits()));
    bits.extend(planes.into_iter().flatten().flatten().map(|x| x.to_bits()));
    (bits, film.counters)
}

#[test]
fn threads_and_splits_do_not_change_a_bit() {
    let scene = room();
    let s = Settings {
        width: 37,
        height: 23,
        aovs: true,
        ..settings(room_view(), 1, Estimator::Mis, 0)
    };
    let run = |threads: usize, splits: &[u32]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut renderer = Reference::new(scene.clone(), &s).unwrap();
            for &n in splits {
                renderer.accumulate(n).unwrap();
            }
            renderer.film().unwrap()
        })
    };
    let whole = bits(&run(1, &[12]));
    assert_eq!(whole, bits(&run(2, &[12])));
    assert_eq!(whole, bits(&run(7, &[1, 2, 0, 4, 5])));
    let reseeded = render(
        Device::Cpu,
        &scene,
        &Settings {
            seed: 2,
            ..s.clone()
        },
        12,
    );
    assert_ne!(whole.0, bits(&reseeded).0);
}

#[test]
fn scenes_that_contradict_themselves_are_errors() {
    let broken = |change: fn(&mut Scene)| {
        let mut scene = Arc::unwrap_or_clone(room());
        change(&mut scene);
        let s = settings(room_view(), 4, Estimator::Mis, 3);
        Reference::new(Arc::new(scene), &s).unwrap_err().to_string()
    };
    let errors = [
        broken(|s| s.textures[0].rgba.clear()),
        broken(|s| s.materials[0].base.0 = 1000),
        broken(|s| s.meshes[0].triangles[0].vertices[1] = 1_000_000),
        broken(|s| s.meshes[0].positions[0].x = f32::NAN),
        broken(|s| s.instances[0].mesh = 5),
        broken(|s| s.emitters.sources[0].triangle = 1_000_000),
        broken(|s| s.emitters.list[0].first_source = 1_000_000),
        broken(|s| s.emitters.alias.truncate(1)),
    ];
    for error in errors {
        assert!(error.starts_with("the scene is invalid: "), "{error}");
    }
    let empty = settings(room_view(), 0, Estimator::Mis, 3);
    assert!(matches!(
        Reference::new(room(), &empty),
        Err(reference::Error::EmptyPicture)
    ));
}
