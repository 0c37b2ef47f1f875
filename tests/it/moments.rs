// Moments of a scene in which things move. Included once for each renderer, with its `device`.

use glam::{Affine3A, DVec2, DVec3, Vec3};
use runelight_tests::builder::{Builder, camera, settings};
use runelight_tests::devices::{render, render_moments};
use runelight_tests::moving::{BLOB, DOOR, moment, moving_room, still};
use runelight_tests::scenes::room_view;
use runelight_tests::stats::ZTest;
use scene::camera::ViewBasis;
use scene::frame::{Drift, Past};
use scene::render::{Estimator, Film, Settings};
use scene::{ClearSky, Fog, Frame, Instance, MaterialId, PointLight, PoseBlend, Scene};
use std::sync::Arc;

/// The `id` of the room's skylight.
const SKY: u32 = 6;

fn view(estimator: Estimator, seed: u64) -> Settings {
    Settings {
        seed,
        ..settings(room_view(), 32, estimator, 4)
    }
}

/// A picture of one moment, after others were shown.
fn after(others: &[f32], time: f32, lights: bool, view: &Settings, samples: u32) -> Film {
    let scene = moving_room();
    let mut moments: Vec<(Frame, u32)> = (others.iter())
        .map(|&t| (moment(&scene, t, true), 0))
        .collect();
    moments.push((moment(&scene, time, lights), samples));
    let mut films = render_moments(device(), &scene, view, &[(view.seed, moments)]);
    films.remove(0)
}

#[test]
fn a_moment_shown_looks_like_the_scene_made_in_it() {
    let scene = moving_room();
    let mut films = Vec::new();
    for (time, others) in [(0.1, &[0.9, 0.3][..]), (0.9, &[])] {
        let (shown, made) = (view(Estimator::Mis, 1), view(Estimator::Mis, 2));
        let film = after(others, time, true, &shown, 96);
        let frame = moment(&scene, time, true);
        let made = Settings { time, ..made };
        let truth = render(device(), &still(&scene, &frame), &made, 96);
        ZTest::new(&film, &truth).assert(&format!("{time} s"));
        films.push(film);
    }
    let moved = ZTest::new(&films[0], &films[1]);
    assert!(moved.passed < 0.9, "it must matter what is shown: {moved:?}");
}

#[test]
fn all_estimators_find_what_moves_and_shines() {
    let judge = after(&[], 0.9, false, &view(Estimator::Mis, 1), 512);
    for estimator in [Estimator::Naive, Estimator::Nee] {
        let film = after(&[], 0.9, false, &view(estimator, 2), 512);
        ZTest::new(&film, &judge).assert(estimator.name());
    }
}

#[test]
fn what_was_shown_before_leaves_no_trace() {
    let fresh = after(&[], 0.7, true, &view(Estimator::Mis, 5), 8);
    let later = after(&[0.1, 0.9, 0.2], 0.7, true, &view(Estimator::Mis, 5), 8);
    assert_eq!(fresh.beauty, later.beauty);
    assert_eq!(fresh.counters, later.counters);
    // Nor do other pictures by the same renderer.
    let scene = moving_room();
    let picture = |seed, time| (seed, vec![(moment(&scene, time, true), 8)]);
    let pictures = [picture(1, 0.2), picture(9, 0.9), picture(5, 0.7)];
    let films = render_moments(device(), &scene, &view(Estimator::Mis, 0), &pictures);
    assert_eq!(fresh.beauty, films[2].beauty);
    assert_eq!(fresh.counters, films[2].counters);
}

/// Real models have poses in which a triangle that shines is a line.
#[test]
fn what_a_pose_collapses_gives_no_light() {
    let mut scene = Arc::unwrap_or_clone(moving_room());
    // One of the axes' ends falls on another: two faces collapse, and two become one.
    let collapsed = &mut scene.meshes[BLOB].poses[1];
    collapsed[0] = collapsed[2];
    let mut frame = moment(&scene, 0.1, false);
    let blobs = frame.instances.iter_mut().filter(|i| i.mesh == BLOB);
    for blob in blobs {
        let to = 1;
        blob.pose = PoseBlend { from: 1, to, fraction: 0.0 };
        blob.material = Some(MaterialId(2));
    }
    let scene = Arc::new(scene);
    for estimator in [Estimator::Mis, Estimator::Nee] {
        let view = view(estimator, 3);
        let moments = vec![(frame.clone(), 32)];
        let film = render_moments(device(), &scene, &view, &[(3, moments)]).remove(0);
        assert_eq!(film.counters.nonfinite, 0, "{}", estimator.name());
        let bright = film.beauty.iter().flatten().fold(0.0, |a: f32, b| a.max(*b));
        assert!(bright > 0.0 && bright.is_finite());
    }
}

#[test]
fn moments_in_a_shutter_add_up_to_their_mean() {
    let scene = moving_room();
    let moments: u16 = 256;
    let at = |i: u16| {
        let time = 0.2 + 0.3 * f32::from(i) / f32::from(moments);
        moment(&scene, time, true)
    };
    // All in one film, in an order that is not that of time; then each a picture of its own.
    let within = (0..moments).map(|i| (at(i * 37 % moments), 2)).collect();
    let mut pictures = vec![(1, within)];
    pictures.extend((0..moments).map(|i| (100 + u64::from(i), vec![(at(i), 2)])));
    let small = Settings {
        width: 16,
        height: 16,
        ..view(Estimator::Mis, 1)
    };
    let films = render_moments(device(), &scene, &small, &pictures);
    let (blurred, alone) = (&films[0], &films[1..]);
    let pixels = blurred.beauty.len();
    let sum = |of: fn(&Film) -> &Vec<[f32; 3]>, p: usize, c: usize| {
        alone.iter().map(|f| f64::from(of(f)[p][c])).sum::<f64>()
    };
    let n = f64::from(moments);
    let mean = Film {
        beauty: (0..pixels)
            .map(|p| [0, 1, 2].map(|c| (sum(|f| &f.beauty, p, c) / n) as f32))
            .collect(),
        variance: (0..pixels)
            .map(|p| [0, 1, 2].map(|c| (sum(|f| &f.variance, p, c) / (n * n)) as f32))
            .collect(),
        ..Film::default()
    };
    ZTest::new(blurred, &mean).assert("motion blur");
}

/// A sphere of radius `r` at the distance `d` straight above a white floor gives it the irradiance
/// `intensity / d^2`, however large it is (its configuration factor is `(r / d)^2`).
#[test]
fn a_light_of_a_frame_has_the_irradiance_of_a_sphere() {
    let mut b = Builder::new();
    let floor = b.plain(255, 0.0);
    b.cuboid(Vec3::splat(-100.0), Vec3::splat(100.0), true, [floor; 6]);
    let scene = Arc::new(Arc::unwrap_or_clone(b.build()).for_frames());
    let (down, distance) = (camera(Vec3::new(0.0, 0.0, -50.0), 90.0, 0.0, 1.0), 30.0);
    let mut frame = scene.as_frame(&down, 0.0);
    for (radius, share) in [(0.5, 1.0), (8.0, 0.25)] {
        // Two lights in one place are one.
        let light = |part: f32| PointLight {
            position: Vec3::new(0.0, 0.0, -100.0 + distance),
            radius,
            intensity: Vec3::new(900.0, 450.0, 90.0) * part,
            ..PointLight::default()
        };
        frame.lights = vec![light(share), light(1.0 - share)];
        for estimator in [Estimator::Nee, Estimator::Mis] {
            let view = settings(down.clone(), 4, estimator, 2);
            let moments = vec![(frame.clone(), 256)];
            let film = &render_moments(device(), &scene, &view, &[(1, moments)])[0];
            let albedo = f64::from(scene::material::MAX_ALBEDO);
            for (c, intensity) in [900.0, 450.0, 90.0].into_iter().enumerate() {
                let expected =
                    albedo / std::f64::consts::PI * intensity / f64::from(distance).powi(2);
                let found = film.mean_radiance()[c];
                assert!(
                    (found / expected - 1.0).abs() < 5e-3,
                    "{found}, not {expected}: radius {radius}, {}",
                    estimator.name()
                );
            }
        }
    }
}

#[test]
fn a_moment_may_have_a_lens_and_the_next_one_none() {
    let scene = moving_room();
    let lens = |radius| scene::camera::Lens::new(radius, 30.0);
    let frame = |radius| {
        let mut frame = moment(&scene, 0.7, true);
        frame.camera.lens = lens(radius);
        (frame, 8)
    };
    let pictures = [0.0, 1.5, 0.0, 1.5].map(|radius| (5, vec![frame(radius)]));
    let films = render_moments(device(), &scene, &view(Estimator::Mis, 5), &pictures);
    let sharp = after(&[], 0.7, true, &view(Estimator::Mis, 5), 8);
    assert_eq!(films[0].beauty, sharp.beauty);
    assert_eq!(films[2].beauty, sharp.beauty);
    let mut with_lens = view(Estimator::Mis, 5);
    with_lens.camera.lens = lens(1.5);
    let alone = render_moments(device(), &scene, &with_lens, &pictures[1..2]);
    for film in [&films[1], &films[3]] {
        assert_eq!(film.beauty, alone[0].beauty);
    }
    assert_ne!(films[1].beauty, sharp.beauty);
}

/// A triangle.
struct Corners([DVec3; 3]);

impl Corners {
    fn of(corners: [Vec3; 3]) -> Self {
        Self(corners.map(|c| c.as_dvec3()))
    }

    /// Where in the triangle a point of it is.
    fn place(&self, p: DVec3) -> DVec2 {
        let [a, b, c] = self.0;
        let (e, f, d) = (b - a, c - a, p - a);
        let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
        let (de, df) = (d.dot(e), d.dot(f));
        DVec2::new(de * ff - df * ef, df * ee - de * ef) / (ee * ff - ef * ef)
    }

    /// The point at a place.
    fn at(&self, place: DVec2) -> DVec3 {
        let [a, b, c] = self.0;
        a + (b - a) * place.x + (c - a) * place.y
    }
}

/// Where the point `p` of a posed triangle was, in the same place of the triangle.
fn was(scene: &Scene, now: &Instance, then: Past, face: u32, p: DVec3) -> DVec3 {
    let mesh = &scene.meshes[now.mesh];
    let triangle = mesh.triangles.iter().find(|t| t.face == face).expect("a face");
    let corners = |place: Affine3A, pose| {
        let positions = mesh.posed(pose);
        Corners::of(triangle.vertices.map(|v| place.transform_point3(positions[v as usize])))
    };
    let place = corners(now.transform, now.pose).place(p);
    corners(then.transform, then.pose).at(place)
}

#[test]
fn the_motion_layer_says_where_everything_was() {
    let scene = moving_room();
    let place = |turn: f32, at: [f32; 3]| {
        Affine3A::from_translation(at.into()) * Affine3A::from_rotation_z(turn)
    };
    let blend = |from, to, fraction| PoseBlend { from, to, fraction };
    let still = (place(0.2, [0.0, 5.0, 5.0]), PoseBlend::default());
    // Meshes with their places and poses now and then: a rigid one moves, another changes its pose, a
    // third both; a fourth stands still.
    let moves = [
        (DOOR, still, (place(-0.1, [2.0, 5.0, 3.0]), PoseBlend::default())),
        (BLOB, (still.0, blend(0, 1, 0.3)), (still.0, blend(1, 2, 0.6))),
        (BLOB, (still.0, blend(2, 2, 0.0)), (place(0.4, [-3.0, 4.0, 5.0]), blend(0, 2, 0.5))),
        (DOOR, still, still),
    ];
    for (number, (mesh, now, then)) in moves.into_iter().enumerate() {
        let instance = |(transform, pose)| Instance {
            id: 7,
            pose,
            ..Instance::new(mesh, transform, "")
        };
        let frame = |camera: &scene::Camera, placed| Frame {
            camera: camera.clone(),
            instances: vec![scene.instances[0].clone(), instance(placed)],
            ..moment(&scene, 0.2, false)
        };
        let mut view = view(Estimator::Naive, 1);
        (view.aovs, view.depth) = (true, 1);
        // The skylight is seen from here.
        view.camera.pitch_deg = -15.0;
        let mut moved = view.camera.clone();
        moved.position += Vec3::new(1.0, -1.5, 0.5);
        moved.yaw_deg -= 4.0;
        moved.pitch_deg += 2.0;
        moved.fov_deg += 3.0;
        let mut shown = frame(&view.camera, now);
        shown.loose = scene::Mesh::default();
        shown.follow(&frame(&moved, then));
        let mut steady = shown.clone();
        steady.follow(&shown);
        let pictures = [(1, vec![(shown.clone(), 1)]), (1, vec![(steady, 4)])];
        let films = render_moments(device(), &scene, &view, &pictures);
        assert!(films[1].motion.iter().all(|m| *m == [0.0; 2]), "nothing moves");

        let basis = [&view.camera, &moved].map(|c| c.view_basis(view.width, view.height));
        let pixels = |basis: &ViewBasis, direction| {
            let at = basis.project(direction).expect("before the eye");
            DVec2::new(at.x * f64::from(view.width), -at.y * f64::from(view.height)) / 2.0
        };
        let film = &films[0];
        let (mut on_it, mut on_sky) = (0, 0);
        for (i, motion) in film.motion.iter().enumerate() {
            let p = Vec3::from(film.position[i]).as_dvec3();
            let id = film.id[i];
            let [mut from, mut to] = [p - basis[0].origin, p - basis[1].origin];
            if id > 100 {
                on_it += 1;
                let past = Past { transform: then.0, pose: then.1 };
                to = was(&scene, &shown.instances[1], past, id - 1, p) - basis[1].origin;
            } else if id == SKY {
                on_sky += 1;
                to = from;
            }
            from = pixels(&basis[0], from).extend(0.0);
            to = pixels(&basis[1], to).extend(0.0);
            let [x, y] = motion.map(f64::from);
            let off = DVec3::new(x, y, 0.0) - (to - from);
            assert!(off.length() < 2e-3, "{number}: pixel {i}, face {id}: {motion:?}, not {}", to - from);
        }
        assert!(on_it > 20 && on_sky > 20, "{on_it} {on_sky}");
    }
}

/// Two cards before the eye: one that the picture before had elsewhere, turned, and one that it had not, which
/// comes from where its speed says.
#[test]
fn loose_triangles_move_by_themselves() {
    let scene = moving_room();
    let mut view = view(Estimator::Naive, 1);
    (view.aovs, view.depth) = (true, 1);
    let basis = view.camera.view_basis(view.width, view.height);
    let [forward, right, up] = [basis.forward, basis.right, basis.up].map(|v| v.as_vec3());
    let eye = view.camera.position;
    let card = |x: f32, turn: f32, far: f32| {
        let (sin, cos) = turn.sin_cos();
        [[-0.3, -0.5], [0.3, -0.5], [0.0, 0.6]].map(|[s, t]: [f32; 2]| {
            let (s, t) = (s * cos - t * sin, s * sin + t * cos);
            eye + forward * far + right * (x + s) + up * t
        })
    };
    let velocity = (right - up) * 0.5;
    let frame = |time: f32, cards: &[(u64, [Vec3; 3])]| {
        let mut frame = scene.as_frame(&view.camera, time);
        for (number, (id, corners)) in cards.iter().enumerate() {
            let first = 3 * number as u32;
            frame.loose.positions.extend(corners);
            frame.loose.triangles.push(scene::Triangle {
                vertices: [first, first + 1, first + 2],
                uv: [[0.0; 2], [1.0, 0.0], [0.0, 1.0]],
                normal: -forward,
                material: scene.meshes[0].triangles[0].material,
                face: 1000 + number as u32,
            });
            let ids = if *id == 0 { [0; 3] } else { [*id, id + 1, id + 2] };
            frame.drifts.extend(ids.map(|id| Drift { id, velocity }));
        }
        frame.loose.first_see_through = cards.len();
        frame
    };
    let (now, then) = (card(-0.5, 0.0, 1.0), card(-0.3, 0.4, 1.3));
    let new = card(0.5, 0.0, 1.0);
    let mut shown = frame(2.0, &[(7, now), (20, new)]);
    shown.follow(&frame(1.75, &[(0, new), (7, then)]));
    let film = &render_moments(device(), &scene, &view, &[(1, vec![(shown, 1)])])[0];
    let was = [then, new.map(|p| p - velocity * 0.25)];
    let mut on = [0; 2];
    for (i, motion) in film.motion.iter().enumerate() {
        let Some(number) = film.id[i].checked_sub(1001) else {
            assert_eq!(*motion, [0.0; 2], "the room stands still");
            continue;
        };
        let number = number as usize;
        on[number] += 1;
        let p = Vec3::from(film.position[i]).as_dvec3();
        let place = Corners::of([now, new][number]).place(p);
        let pixels = |p: DVec3| {
            let at = basis.project(p - basis.origin).expect("before the eye");
            DVec2::new(at.x * f64::from(view.width), -at.y * f64::from(view.height)) / 2.0
        };
        let expected = pixels(Corners::of(was[number]).at(place)) - pixels(p);
        let off = (DVec2::from(motion.map(f64::from)) - expected).length();
        assert!(off < 2e-3, "card {number}, pixel {i}: {motion:?}, not {expected}");
    }
    assert!(on.iter().all(|n| *n > 20), "{on:?}");
}

#[test]
fn fog_comes_and_goes_from_moment_to_moment() {
    let mut scene = Arc::unwrap_or_clone(moving_room());
    scene.clear_sky = Some(ClearSky {
        scale: scene.sky.scale,
        mean: [Vec3::splat(0.3), Vec3::new(0.1, 0.2, 0.3)],
        share: 0.6,
    });
    let scene = Arc::new(scene.for_frames());
    let frame = |fog| Frame {
        fog,
        ..moment(&scene, 0.9, true)
    };
    let thick = Fog {
        extinction: 0.02,
        albedo: Vec3::new(0.9, 0.6, 0.3),
    };
    let view = view(Estimator::Mis, 3);
    let pictures = [Some(thick), None].map(|fog| (view.seed, vec![(frame(fog), 96)]));
    let films = render_moments(device(), &scene, &view, &pictures);
    for (film, fog) in films.iter().zip([Some(thick), None]) {
        let made = Settings {
            time: 0.9,
            seed: 4,
            ..view.clone()
        };
        let truth = render(device(), &still(&scene, &frame(fog)), &made, 96);
        ZTest::new(film, &truth).assert(&format!("{fog:?}"));
    }
    let differs = ZTest::new(&films[0], &films[1]);
    assert!(differs.passed < 0.5, "fog must be seen: {differs:?}");
}
