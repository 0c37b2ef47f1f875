// What must agree: the estimators, and the sky with the engine's formula; and rays must not get lost.
// Included once for each renderer, with its `render`.

use glam::{Affine3A, Vec3};
use runelight_tests::builder::{Builder, camera, settings};
use runelight_tests::scenes::{in_fog, polished, pool, pool_views, room, room_view, scrolling, sunny_room};
use scene::render::{Estimator, Film};
use scene::sky::{BACK_SPEED, FRONT_SPEED, scroll_uv};

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
    check_estimators(&room(), &room_view(), &[2, 4, 0]);
    check_estimators(&sunny_room(), &room_view(), &[2, 4, 0]);
}

#[test]
fn all_estimators_see_the_same_through_water_and_glass() {
    for view in pool_views() {
        check_estimators(&pool(), &view, &[2, 0]);
    }
}

#[test]
fn all_estimators_see_the_same_gloss_and_bumps() {
    check_estimators(&polished(), &room_view(), &[2, 0]);
}

#[test]
fn all_estimators_see_the_same_fog() {
    let albedo = Vec3::new(0.9, 0.6, 0.3);
    check_estimators(&in_fog(sunny_room(), 0.01, albedo), &room_view(), &[0]);
    check_estimators(&in_fog(pool(), 0.02, albedo), &pool_views()[1], &[3]);
}

fn check_estimators(scene: &std::sync::Arc<scene::Scene>, view: &scene::Camera, depths: &[u32]) {
    for &depth in depths {
        let films = Estimator::ALL.map(|estimator| {
            let mut s = settings(view.clone(), 16, estimator, depth);
            s.time = 1.3;
            let film = render(scene, &s, 300);
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
    let linear = |byte: u8| (scene::material::srgb_to_linear(byte)) as f32;
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
        let scale = scene.sky.scale[usize::from(direction[2] < 0.0)];
        let expected = Vec3::from(texel.map(linear)) * scale;
        let found = render(&scene, &s, 1).beauty[0];
        for c in 0..3 {
            // Single precision decodes texels with a rounding or two.
            assert!((found[c] / expected[c] - 1.0).abs() < 1e-5, "{found:?} is not {expected:?}");
        }
    }
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

