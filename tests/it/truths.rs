// Pictures whose radiance is known in closed form; included once for each renderer, with its
// `render`.

use gallery::formulas::{closed_box, rectangle_form_factor};
use runelight_tests::builder::{Builder, assert_mean, camera, probe, settings};
use glam::{Affine3A, EulerRot, Quat, Vec3};
use scene::material::srgb_to_linear;
use scene::render::{Estimator, Settings};
use scene::{PointLight, Scene, light::Spot};
use std::f64::consts::PI;
use std::sync::Arc;

const GREY: u8 = 188;

/// A turn that leaves no coordinate simple.
fn odd_turn() -> Affine3A {
    Affine3A::from_quat(Quat::from_euler(EulerRot::XYZ, 0.3, 0.5, 0.7))
}

/// A closed box, turned oddly, that emits 1 everywhere.
fn furnace() -> Builder {
    let mut b = Builder::new();
    let wall = b.plain(GREY, 1.0);
    let (min, max) = (Vec3::new(-31., -40., -20.), Vec3::new(50., 17., 29.));
    b.cuboid(min, max, true, [wall; 6]);
    b.transform(odd_turn());
    b
}

fn inside() -> scene::Camera {
    camera(Vec3::ZERO, 5.0, 30.0, 90.0)
}

fn check_furnace(scene: &Arc<Scene>, depth: u32, what: &str) {
    let expected = closed_box(1.0, srgb_to_linear(GREY), depth);
    for estimator in Estimator::ALL {
        let film = render(scene, &settings(inside(), 16, estimator, depth), 64);
        let what = format!("{what}, {} at depth {depth}", estimator.name());
        assert_mean(&film, [expected; 3], 4.0, &what);
        assert_eq!(film.counters.escaped, 0, "{what}");
        // Every path finds the same light, so each pixel is exact.
        if estimator == Estimator::Naive && depth > 0 {
            for p in &film.beauty {
                let off = (f64::from(p[0]) - expected).abs();
                assert!(off < 1e-5 * expected, "{what}: {p:?}");
            }
        }
    }
}

#[test]
fn a_closed_box_reads_the_geometric_series() {
    let scene = furnace().build();
    for depth in [1, 2, 3, 5, 0] {
        check_furnace(&scene, depth, "box");
    }
}

#[test]
fn placing_a_box_by_a_mirroring_instance_changes_nothing() {
    let mut scene = Arc::unwrap_or_clone(furnace().build());
    let flip = Affine3A::from_scale(Vec3::new(1.3, -0.7, 1.1));
    scene.instances[0].transform = odd_turn() * flip;
    // Light sampling must know the areas as placed.
    gallery::builder::list_emitters(&mut scene);
    let scene = Arc::new(scene.completed());
    check_furnace(&scene, 3, "mirrored box");
}

#[test]
fn in_a_white_furnace_everything_is_equally_bright() {
    // Each surface emits what it does not reflect, so radiance is 1 everywhere, whatever is where.
    let mut b = Builder::new();
    let mut balanced = |grey: u8| b.plain(grey, 1.0 - srgb_to_linear(grey) as f32);
    let [dark, middle, bright] = [60, 150, 220].map(&mut balanced);
    let walls = [dark, middle, bright, bright, middle, dark];
    b.cuboid(Vec3::splat(-50.0), Vec3::splat(50.0), true, walls);
    let (min, max) = (Vec3::new(10., -15., -50.), Vec3::new(30., 20., -10.));
    b.cuboid(
        min,
        max,
        false,
        [bright, middle, dark, bright, middle, dark],
    );
    b.transform(odd_turn());
    let scene = b.build();
    // Light sampling alone has no bound on its variance where walls meet, so that its error can't be
    // told from its samples: `agreement` judges it where they do not shine.
    for estimator in [Estimator::Naive, Estimator::Uniform, Estimator::Mis] {
        let film = render(&scene, &settings(inside(), 16, estimator, 0), 128);
        assert_mean(&film, [1.0; 3], 4.0, estimator.name());
        assert_eq!(film.counters.escaped, 0);
    }
}

/// A white ball of 128 facets, shaded as round, in a box that shines evenly: of what arrives no part more than all is
/// reflected, whatever the angle, and little less.
#[test]
fn a_ball_shaded_as_round_makes_no_light_of_nothing() {
    check_ball(|ball| ball.make_smooth(), 0.96);
}

/// Normals of a file may be any; those that point inside are not taken.
#[test]
fn a_ball_with_any_normals_makes_no_light_of_nothing() {
    let any = |ball: &mut scene::Mesh| {
        // The golden ratio's multiples: all about.
        let normal = |i: usize| {
            let (turn, z) = (i as f32 * 2.399_963, 1.0 - (i as f32 * 0.618_034).fract() * 2.0);
            Vec3::new(turn.cos(), turn.sin(), 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
        };
        let mut normals: Vec<Vec3> = (0..ball.positions.len()).map(normal).collect();
        normals[..3].fill(Vec3::NAN);
        ball.shade_with(&[normals]);
    };
    check_ball(any, 0.5);
}

/// Means of the ball's reflectance lie between this share of its albedo and the albedo, and are one for all estimators.
fn check_ball(shade: impl Fn(&mut scene::Mesh), least: f64) {
    let mut b = furnace();
    let white = b.plain(255, 0.0);
    let mut scene = Arc::unwrap_or_clone(b.build());
    let mut ball = scene::Mesh {
        name: "ball".into(),
        ..scene::Mesh::default()
    };
    let octant = [Vec3::X, Vec3::Y, Vec3::Z];
    for turn in 0..8 {
        let sign = Vec3::from([1, 2, 4].map(|bit| if turn & bit == 0 { 1.0 } else { -1.0 }));
        let [x, y, z] = octant.map(|axis| axis * sign);
        let corners = if sign.element_product() > 0.0 { [x, y, z] } else { [x, z, y] };
        let mut facets = vec![corners];
        for _ in 0..2 {
            facets = (facets.into_iter())
                .flat_map(|[a, b, c]| {
                    let [d, e, f] = [(a + b), (b + c), (c + a)].map(Vec3::normalize);
                    [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
                })
                .collect();
        }
        for corners in facets {
            let first = ball.positions.len() as u32;
            ball.positions.extend(corners.map(|c| c * 5.0));
            let [a, b, c] = corners;
            ball.triangles.push(scene::Triangle {
                vertices: [first, first + 1, first + 2],
                uv: [[0.0; 2], [1.0, 0.0], [0.0, 1.0]],
                normal: (b - a).cross(c - a).normalize(),
                material: white,
                face: 0,
            });
        }
    }
    ball.first_see_through = ball.triangles.len();
    shade(&mut ball);
    assert_eq!(ball.normals.len(), 1);
    scene.meshes.push(ball);
    let place = odd_turn() * Affine3A::from_translation(Vec3::new(4.0, -3.0, 2.0));
    scene.instances.push(scene::Instance::new(scene.meshes.len() - 1, place, "ball"));
    gallery::builder::list_emitters(&mut scene);
    let scene = Arc::new(scene.completed());
    assert!(scene.features.smooth_normals);
    // Nothing but the ball is in the picture, to near its rim.
    let at = Vec3::from(place.translation);
    let mut view = probe(at + Vec3::new(-20.0, 3.0, 7.0), at);
    view.fov_deg = 20.0;
    let albedo = f64::from(scene::material::MAX_ALBEDO);
    let mut means = Vec::new();
    for estimator in [Estimator::Naive, Estimator::Uniform, Estimator::Mis] {
        let film = render(&scene, &settings(view.clone(), 16, estimator, 2), 1024);
        if estimator == Estimator::Naive {
            for p in &film.beauty {
                assert!(f64::from(p[0]) < albedo * 1.000_01, "{p:?}");
            }
        }
        let mean = film.mean_radiance()[0];
        assert!(mean > least * albedo && mean < albedo, "{}: {mean}", estimator.name());
        means.push(mean);
    }
    let spread = means.iter().fold(0.0_f64, |m, x| m.max((x - means[0]).abs()));
    assert!(spread < 5e-3, "{means:?}");
}

#[test]
fn a_rectangle_lights_a_plane_by_its_form_factor() {
    let (height, half, emitted) = (30.0, [25.0, 15.0], 3.0);
    let mut b = Builder::new();
    let (ground, lamp) = (b.plain(GREY, 0.0), b.plain(0, emitted as f32));
    b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
    let up = Vec3::Z * height as f32;
    b.slab(up, half.map(|h| h as f32), false, lamp, [1.0; 2]);
    let scene = b.build();
    for [x, y] in [[0.0, 0.0], [20.0, 10.0], [-60.0, 35.0]] {
        let point = Vec3::new(x as f32, y as f32, 0.0);
        let view = probe(point + Vec3::new(40.0, -200.0, 50.0), point);
        let spans = [[-half[0] - x, half[0] - x], [-half[1] - y, half[1] - y]];
        let irradiance = PI * emitted * rectangle_form_factor(spans[0], spans[1], height);
        let expected = srgb_to_linear(GREY) / PI * irradiance;
        for estimator in Estimator::ALL {
            let film = render(&scene, &settings(view.clone(), 16, estimator, 2), 200);
            let what = format!("{} at {x}, {y}", estimator.name());
            assert_mean(&film, [expected; 3], 4.0, &what);
        }
    }
}

/// A plane under a lamp at `at`, of radius `radius`.
fn plane_under(at: Vec3, radius: f32, spot: Option<Spot>) -> Arc<Scene> {
    let mut b = Builder::new();
    let ground = b.plain(GREY, 0.0);
    b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
    b.light(PointLight {
        position: at,
        radius,
        intensity: Vec3::new(900.0, 600.0, 300.0),
        spot,
        ..PointLight::default()
    });
    b.build()
}

#[test]
fn a_light_entity_gives_intensity_times_cosine_over_squared_distance() {
    let at = Vec3::new(3.0, -7.0, 40.0);
    let spot = Spot {
        direction: Vec3::NEG_Z,
        cos_inner: 0.95,
        cos_outer: 0.6,
    };
    for (radius, spot) in [(0.5, None), (12.0, None), (0.5, Some(spot))] {
        let scene = plane_under(at, radius, spot);
        for point in [
            Vec3::new(3.0, -7.0, 0.0),
            Vec3::new(30., 0., 0.),
            Vec3::new(-90., 9., 0.),
        ] {
            let to_light = (at - point).as_dvec3();
            let cos = to_light.normalize().z;
            let factor = spot.map_or(1.0, |_| ((cos - 0.6) / 0.35).clamp(0.0, 1.0));
            // Exact for a sphere above the horizon, however large.
            let reflected = srgb_to_linear(GREY) / PI * cos / to_light.length_squared() * factor;
            let view = probe(point + Vec3::new(-50.0, -200.0, 50.0), point);
            for estimator in Estimator::ALL {
                let film = render(&scene, &settings(view.clone(), 8, estimator, 2), 64);
                let what = format!("{} with radius {radius} at {point}", estimator.name());
                let found = f64::from(u8::from(estimator.samples_lights()));
                let expected = [900.0, 600.0, 300.0].map(|i| i * reflected * found);
                // The sampled cosines of a large sphere vary; those of a small one hardly do, and
                // there f32 angles of the camera limit how well the place is known.
                let film_error = 1e-4 * expected[0];
                let (mean, error) = runelight_tests::builder::mean_and_error(&film);
                for c in 0..3 {
                    let off = (mean[c] - expected[c]).abs();
                    assert!(
                        off <= 4.0 * error[c] + film_error,
                        "{what}: {mean:?} {expected:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn inside_a_light_entity_there_is_no_light() {
    let scene = plane_under(Vec3::new(0.0, 0.0, 5.0), 20.0, None);
    let view = probe(Vec3::new(-50.0, -200.0, 50.0), Vec3::ZERO);
    let film = render(&scene, &settings(view, 4, Estimator::Mis, 2), 16);
    assert_mean(&film, [0.0; 3], 0.0, "inside");
}

#[test]
fn a_fence_is_there_where_its_texels_are() {
    // Holes and bars, each 10 units wide, half way between the plane and the lamp.
    let lamp = Vec3::new(0.0, 0.0, 40.0);
    let build = |fence: bool| {
        let mut b = Builder::new();
        let ground = b.plain(GREY, 0.0);
        b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
        if fence {
            let bars = b.texture(2, vec![[90, 90, 90, 255], [255, 0, 255, 0]]);
            let bars = b.material(bars, None, 0.0);
            b.edit(bars).alpha_tested = true;
            b.slab(Vec3::Z * 20.0, [100.0; 2], true, bars, [20.0, 1.0]);
        }
        b.light(PointLight {
            position: lamp,
            radius: 0.01,
            intensity: Vec3::splat(1000.0),
            ..PointLight::default()
        });
        b.build()
    };
    let (fenced, open) = (build(true), build(false));
    for cell in -6..6_i16 {
        // The ground point whose way to the lamp crosses the middle of a cell of the fence.
        let point = Vec3::new((f32::from(cell) * 10.0 + 5.0) * 2.0, 7.0, 0.0);
        let eye = Vec3::new(point.x, -30.0, 4.0);
        for estimator in [Estimator::Nee, Estimator::Mis] {
            let s = settings(probe(eye, point), 4, estimator, 2);
            let (lit, shaded) = (render(&open, &s, 4), render(&fenced, &s, 4));
            if cell.rem_euclid(2) == 1 {
                assert_eq!(lit.beauty, shaded.beauty, "hole {cell}");
                assert!(lit.beauty[0][0] > 0.0);
            } else {
                assert!(shaded.beauty.iter().all(|p| *p == [0.0; 3]), "bar {cell}");
            }
        }
        // Seen from above the fence: bars, or the ground behind them.
        let target = Vec3::new(f32::from(cell) * 10.0 + 5.0, 0.0, 20.0);
        let mut s = settings(probe(target + Vec3::Z * 15.0, target), 2, Estimator::Mis, 1);
        s.aovs = true;
        let depth = render(&fenced, &s, 1).depth[0];
        let expected = if cell.rem_euclid(2) == 1 { 35.0 } else { 15.0 };
        assert!((depth - expected).abs() < 1e-3, "cell {cell}: {depth}");
    }
}

#[test]
fn only_two_sided_surfaces_emit_backwards() {
    for two_sided in [false, true] {
        let mut b = Builder::new();
        let (ground, lamp) = (b.plain(GREY, 0.0), b.plain(0, 2.0));
        b.edit(lamp).two_sided = two_sided;
        b.slab(Vec3::ZERO, [500.0; 2], true, ground, [1.0; 2]);
        // Faces up, away from the ground.
        b.slab(Vec3::Z * 10.0, [10.0; 2], true, lamp, [1.0; 2]);
        let scene = b.build();
        let behind = if two_sided { 1.0 } else { 0.0 };
        let irradiance = 2.0 * PI * rectangle_form_factor([-10.0, 10.0], [-10.0, 10.0], 10.0);
        let reflected = srgb_to_linear(GREY) / PI * irradiance * behind;
        let above = probe(Vec3::new(1.0, 2.0, 50.0), Vec3::new(0.0, 0.0, 10.0));
        let below = probe(Vec3::new(1.0, 2.0, 5.0), Vec3::new(0.0, 0.0, 10.0));
        let shaded = probe(Vec3::new(80.0, 0.0, 9.0), Vec3::ZERO);
        for estimator in Estimator::ALL {
            let s = |view: &scene::Camera, depth| settings(view.clone(), 16, estimator, depth);
            let name = estimator.name();
            assert_mean(&render(&scene, &s(&above, 1), 1), [2.0; 3], 0.0, name);
            assert_mean(
                &render(&scene, &s(&below, 1), 1),
                [2.0 * behind; 3],
                0.0,
                name,
            );
            assert_mean(
                &render(&scene, &s(&shaded, 2), 64),
                [reflected; 3],
                4.0,
                name,
            );
        }
    }
}

#[test]
fn layers_add_up_and_describe_the_first_hit() {
    let scene = furnace().build();
    let s = Settings {
        aovs: true,
        ..settings(inside(), 16, Estimator::Mis, 4)
    };
    let film = render(&scene, &s, 16);
    let rho = srgb_to_linear(GREY) as f32;
    for i in 0..256 {
        let total = film.emission[i][0] + film.direct[i][0] + film.indirect[i][0];
        assert!((film.beauty[i][0] - total).abs() < 1e-5);
        assert!((film.emission[i][0] - 1.0).abs() < 1e-6);
        assert!(film.direct[i][0] > 0.0 && film.indirect[i][0] > 0.0);
        assert!((film.albedo[i][1] - rho).abs() < 1e-6);
        assert!((1..=6).contains(&film.id[i]));
        assert!(Vec3::from(film.normal[i]).length() < 1.0 + 1e-6);
        let position = Vec3::from(film.position[i]);
        let forward = camera_forward();
        assert!((position.dot(forward) - film.depth[i]).abs() < 1e-3);
        // The normal faces the camera, which is at the origin.
        assert!(Vec3::from(film.normal[i]).dot(position) < 0.0);
    }
}

#[test]
fn what_a_clamp_takes_is_counted() {
    // A small bright lamp on the wall and a bright one in sight: most light is in few samples.
    let mut b = Builder::new();
    let (wall, lamp) = (b.plain(GREY, 0.0), b.plain(0, 400.0));
    b.cuboid(Vec3::splat(-40.0), Vec3::splat(40.0), true, [wall; 6]);
    b.slab(Vec3::new(20., 10., 39.), [4.0; 2], false, lamp, [1.0; 2]);
    b.slab(Vec3::new(28., 16., -15.), [2.0; 2], true, lamp, [1.0; 2]);
    let scene = b.build();
    for aovs in [false, true] {
        let mut s = settings(inside(), 16, Estimator::Naive, 4);
        s.aovs = aovs;
        let free = render(&scene, &s, 64);
        assert_eq!((free.clamped, free.clamped_share()), (None, 0.0));
        s.clamp = Some(2.0);
        let film = render(&scene, &s, 64);
        let clamped = film.clamped.expect("what is lost");
        let (all, kept) = (free.mean_radiance(), film.mean_radiance());
        for c in 0..3 {
            let sum = kept[c] + clamped.lost[c];
            assert!((sum / all[c] - 1.0).abs() < 1e-5, "{sum} is not {}", all[c]);
        }
        let share = clamped.lost[1] / all[1];
        assert!((film.clamped_share() - share).abs() < 1e-5 && share > 0.1, "{share}");
        assert!(clamped.samples > 10 && clamped.samples < film.counters.paths / 4);
        if aovs {
            // What the camera sees shine is as it was, and a mean is no more than the most of its samples.
            assert_eq!(film.emission, free.emission);
            assert!(free.emission.iter().any(|p| p[0] > 2.0));
            let reflected = |i: usize| film.direct[i][0] + film.indirect[i][0];
            assert!((0..256).all(|i| reflected(i) <= 2.0 + 1e-4));
        }
        // A clamp that nothing exceeds changes nothing.
        s.clamp = Some(1e6);
        let film = render(&scene, &s, 64);
        assert_eq!((film.beauty, film.clamped), (free.beauty, Some(Default::default())));
    }
}

fn camera_forward() -> Vec3 {
    inside().view_basis(1, 1).forward.as_vec3()
}

#[test]
fn a_lens_blurs_a_small_lamp_into_an_even_disc() {
    use scene::camera::Lens;
    let lens = Lens { radius: 2.0, focus: 100.0 };
    for depth in [60.0, 100.0, 250.0_f64] {
        // Square, and so large that it is seen 4 pixels wide.
        let (size, pixels_per_slope) = (24.0, 480.0);
        let half = 2.0 / pixels_per_slope;
        let mut b = Builder::new();
        let lamp = b.plain(0, 1.0);
        let corner = |y: f64, z: f64| {
            let [x, y, z] = [depth, depth * half * y, depth * half * z].map(|v| v as f32);
            Vec3::new(x, y, z)
        };
        let corners = [corner(1.0, -1.0), corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
        b.quad(corners, lamp, [1.0; 2]);
        let scene = b.build();
        let fov_deg = 2.0 * (size / 2.0 / pixels_per_slope / 0.75).atan().to_degrees();
        let mut view = settings(camera(Vec3::ZERO, 0.0, 0.0, fov_deg as f32), 24, Estimator::Naive, 1);
        view.camera.lens = Some(lens);
        let film = render(&scene, &view, 1024);
        let radius = pixels_per_slope * 2.0 * (1.0 / depth - 1.0 / 100.0).abs();
        let (mut sum, mut squares) = (0.0, [0.0; 2]);
        for (i, p) in film.beauty.iter().enumerate() {
            let at = [i % 24, i / 24].map(|c| c as f64 + 0.5 - size / 2.0);
            let value = f64::from(p[0]);
            sum += value;
            squares = [0, 1].map(|c| squares[c] + value * at[c] * at[c]);
            let nearest = at.map(|c| (c.abs() - 2.5).max(0.0));
            assert!(value == 0.0 || nearest[0].hypot(nearest[1]) <= radius + 1e-3, "{depth}: {at:?}");
        }
        // All light arrives, as wide as disc, lamp and pixel together.
        assert!((sum / 16.0 - 1.0).abs() < 0.03, "{depth}: light {sum}");
        // A sharp lamp's edges are those of pixels, whose middles then stand for all of them.
        let pixel = if radius > 0.0 { 1.0 / 12.0 } else { -1.0 / 12.0 };
        let expected = radius * radius / 4.0 + 4.0 / 3.0 + pixel;
        for squares in squares {
            let variance = squares / sum;
            assert!((variance / expected - 1.0).abs() < 0.04, "{depth}: {variance}, expected {expected}");
        }
    }
}
