//! What must agree: estimators, thread counts, ways to split the work; and rays must not get lost.

mod common;

use common::{Builder, camera, render, settings};
use glam::{Affine3A, EulerRot, Quat, Vec3};
use reference::Reference;
use scene::render::{Counters, Estimator, Film, Renderer, Settings};
use scene::sky::{BACK_SPEED, FRONT_SPEED, SkyKind, scroll_uv};
use scene::{Scene, Sky};
use std::sync::Arc;

/// Two layers, each with two colours, the front one with holes.
fn scrolling(b: &mut Builder) -> Sky {
    let back = b.texture(2, vec![[200, 120, 60, 255], [60, 60, 160, 255]]);
    let front = b.texture(2, vec![[0, 0, 0, 0], [220, 220, 230, 255]]);
    Sky {
        kind: SkyKind::Scrolling { back, front },
        scale: 1.5,
    }
}

/// A room with a skylight, a lamp with bright and dark texels, a glowing two-sided warped sheet, and
/// a bench that casts shadows.
fn room() -> Arc<Scene> {
    let mut b = Builder::new();
    let (wall, sky) = (b.plain(170, 0.0), b.sky(0.5));
    let colours = vec![
        [255, 200, 90, 255],
        [0, 0, 0, 255],
        [0, 0, 0, 255],
        [90, 160, 255, 255],
    ];
    let (base, glow) = (b.texture(2, colours.clone()), b.texture(2, colours));
    let lamp = b.material(base, Some(glow), 6.0);
    let lava = b.material(base, Some(glow), 1.0);
    b.edit(lava).two_sided = true;
    b.edit(lava).warped = true;
    let walls = [wall, wall, wall, wall, wall, sky];
    b.cuboid(Vec3::splat(-40.0), Vec3::splat(40.0), true, walls);
    b.slab(
        Vec3::new(15., 10., 20.),
        [12.0, 9.0],
        false,
        lamp,
        [5.0, 4.0],
    );
    b.slab(
        Vec3::new(-20., 5., -20.),
        [15.0, 15.0],
        true,
        lava,
        [128.0, 128.0],
    );
    let (min, max) = (Vec3::new(5., -25., -40.), Vec3::new(30., 0., -25.));
    b.cuboid(min, max, false, [wall; 6]);
    b.transform(Affine3A::from_quat(Quat::from_euler(
        EulerRot::XYZ,
        0.2,
        -0.1,
        0.4,
    )));
    b.scene.sky = scrolling(&mut b);
    b.build()
}

fn view() -> scene::Camera {
    camera(Vec3::new(0.0, -30.0, 5.0), 20.0, 80.0, 100.0)
}

/// z-scores of the difference of two pictures over blocks of 4 by 4 pixels.
fn z_scores(a: &Film, b: &Film) -> Vec<f64> {
    let (width, n) = (a.width as usize, a.beauty.len());
    let block = |i: usize| i / width / 4 * (width / 4) + i % width / 4;
    let mut sums = vec![[0.0; 2]; n / 16 * 3];
    for i in 0..n {
        for c in 0..3 {
            let sum = &mut sums[block(i) * 3 + c];
            sum[0] += f64::from(a.beauty[i][c]) - f64::from(b.beauty[i][c]);
            sum[1] += f64::from(a.variance[i][c]) + f64::from(b.variance[i][c]);
        }
    }
    sums.iter().map(|[d, v]| d / v.max(1e-12).sqrt()).collect()
}

#[test]
fn all_estimators_converge_to_the_same_picture() {
    let scene = room();
    for depth in [2, 4, 0] {
        let films = Estimator::ALL.map(|estimator| {
            let mut s = settings(view(), 16, estimator, depth);
            s.time = 1.3;
            let film = render(&scene, &s, 300);
            assert_eq!((film.counters.nonfinite, film.counters.escaped), (0, 0));
            film
        });
        for (i, film) in films.iter().enumerate().skip(1) {
            let z = z_scores(&films[0], film);
            let worst = z.iter().fold(0.0, |w: f64, z| w.max(z.abs()));
            let mean_square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
            let name = Estimator::ALL[i].name();
            assert!(worst < 5.0, "{name} at depth {depth}: z = {worst}");
            // Channels of a block are correlated: 16 blocks' worth of freedom, so 1 +- 0.35.
            assert!(
                mean_square < 2.0,
                "{name} at depth {depth}: mean z^2 = {mean_square}"
            );
        }
    }
}

#[test]
fn the_sky_shows_its_layers_by_direction() {
    let mut b = Builder::new();
    let sky = b.sky(1.0);
    b.cuboid(Vec3::splat(-64.0), Vec3::splat(64.0), true, [sky; 6]);
    b.scene.sky = scrolling(&mut b);
    let scene = b.build();
    let linear = |byte: u8| (scene::material::srgb_to_linear(byte) * 1.5) as f32;
    for (pitch, yaw, time) in [(-80.0, 10.0, 0.0), (-30.0, 200.0, 2.5), (40.0, 77.0, 9.0)] {
        let mut view = camera(Vec3::new(5.0, 3.0, 1.0), pitch, yaw, 1e-4);
        view.name = "up".into();
        let direction = view.view_basis(1, 1).forward.to_array();
        let mut s = settings(view, 1, Estimator::Mis, 3);
        s.time = time;
        let right_half = |speed| {
            let u = scroll_uv(direction, f64::from(time), speed)[0];
            u.rem_euclid(128.0) >= 64.0
        };
        let texel = match (right_half(FRONT_SPEED), right_half(BACK_SPEED)) {
            (true, _) => [220, 220, 230],
            (_, false) => [200, 120, 60],
            (_, true) => [60, 60, 160],
        };
        assert_eq!(render(&scene, &s, 1).beauty[0], texel.map(linear));
    }
}

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
        ..settings(view(), 1, Estimator::Mis, 0)
    };
    let run = |threads: usize, splits: &[u32]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut renderer = Reference::new(scene.clone(), &s).unwrap();
            for &n in splits {
                renderer.accumulate(n).unwrap();
            }
            let film = renderer.film().unwrap();
            let relmse = renderer.estimated_relmse().unwrap();
            assert!((relmse / film.estimated_relmse() - 1.0).abs() < 1e-4);
            film
        })
    };
    let whole = bits(&run(1, &[12]));
    assert_eq!(whole, bits(&run(2, &[12])));
    assert_eq!(whole, bits(&run(7, &[1, 2, 0, 4, 5])));
    let reseeded = render(
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
fn a_closed_mesh_loses_no_ray() {
    // A bumpy cave far from the origin: a cube's faces, cut into squares with shared corners that
    // are pushed in and out.
    let mut b = Builder::new();
    let rock = b.plain(255, 0.0);
    let n = 16_i8;
    let bump = |p: Vec3| {
        let wave = (p.x * 7.1).sin() + (p.y * 5.3 + p.z * 9.7).sin() + (p.z * 13.0).cos();
        p.normalize() * (100.0 + 12.0 * wave)
    };
    for side in 0..6_usize {
        let at = |i: i8, j: i8| {
            let [u, v] = [i, j].map(|k| f32::from(2 * k - n) / f32::from(n));
            let flip = if side < 3 { 1.0 } else { -1.0 };
            let mut p = Vec3::ZERO;
            (p[side % 3], p[(side + 1) % 3], p[(side + 2) % 3]) = (flip, u, v);
            bump(p)
        };
        for i in 0..n {
            for j in 0..n {
                let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                b.quad(corners, rock, [1.0; 2]);
            }
        }
    }
    let centre = Vec3::new(3001.3, -3907.7, 1203.1);
    b.transform(Affine3A::from_translation(centre) * Affine3A::from_rotation_z(0.7));
    let scene = b.build();
    let s = settings(camera(centre, 3.0, 11.0, 120.0), 64, Estimator::Uniform, 32);
    let film = render(&scene, &s, 16);
    assert!(film.counters.rays > 1_000_000, "{:?}", film.counters);
    assert_eq!(film.counters.escaped, 0);
}

#[test]
fn scenes_that_contradict_themselves_are_errors() {
    let broken = |change: fn(&mut Scene)| {
        let mut scene = Arc::unwrap_or_clone(room());
        change(&mut scene);
        let s = settings(view(), 4, Estimator::Mis, 3);
        Reference::new(Arc::new(scene), &s).unwrap_err().to_string()
    };
    let errors = [
        broken(|s| s.textures[0].rgba.clear()),
        broken(|s| s.materials[0].base.0 = 1000),
        broken(|s| s.meshes[0].triangles[0].vertices[1] = 1_000_000),
        broken(|s| s.meshes[0].positions[0].x = f32::NAN),
        broken(|s| s.instances[0].mesh = 5),
        broken(|s| s.emitters.triangles[0].triangle = 1_000_000),
        broken(|s| s.emitters.alias.truncate(1)),
    ];
    for error in errors {
        assert!(error.starts_with("the scene is invalid: "), "{error}");
    }
    let empty = settings(view(), 0, Estimator::Mis, 3);
    assert!(matches!(
        Reference::new(room(), &empty),
        Err(reference::Error::EmptyPicture)
    ));
}
