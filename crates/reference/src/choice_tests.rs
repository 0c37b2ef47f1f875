//! Lights are chosen as often as is said, whatever the choice is made by.

use crate::choice::Choice;
use crate::lights::{Light, Reservoir, guess};
use crate::rng::Rng;
use crate::world::World;
use glam::{Affine3A, DVec3, Vec3};
use scene::cells::{CELL, CellNode};
use scene::emitter::MovingLight;
use scene::render::{Sampler, Selection};
use scene::sky::Sun;
use scene::{
    Camera, Emitters, Frame, Instance, LightCells, Material, MaterialId, Mesh, PointLight, Scene,
    Texture, TextureId, Triangle,
};
use std::collections::HashMap;
use std::sync::Arc;

fn camera() -> Camera {
    Camera {
        name: String::new(),
        position: Vec3::ZERO,
        pitch_deg: 0.0,
        yaw_deg: 0.0,
        roll_deg: 0.0,
        fov_deg: 90.0,
        lens: None,
    }
}

/// Triangles that shine, of this size about these points and facing these ways.
fn lamps(name: &str, places: &[(Vec3, Vec3, f32)]) -> Mesh {
    let corners = places.iter().flat_map(|&(at, normal, size)| {
        let (u, v) = normal.any_orthonormal_pair();
        [at, at + u * size, at + v * size]
    });
    let triangles = (places.iter().zip(0..)).map(|(&(_, normal, _), i)| Triangle {
        vertices: [3 * i, 3 * i + 1, 3 * i + 2],
        uv: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        normal,
        material: MaterialId(0),
        face: i,
    });
    Mesh {
        name: name.into(),
        positions: corners.collect(),
        first_see_through: places.len(),
        triangles: triangles.collect(),
        ..Mesh::default()
    }
}

/// Ten lamps of the world that look about, four light entities, two suns; two cells, the list of one of which lacks half.
/// Besides, a mesh of two lamps that moves, and two lights of a frame.
fn world(moves: bool) -> World {
    let ring: Vec<_> = (0..10)
        .map(|i| {
            let (s, c) = (i as f32 * 0.7).sin_cos();
            let at = Vec3::new(200.0 * c, 150.0 * s, 20.0 * i as f32);
            (at, Vec3::new(s, c, 0.3).normalize(), 3.0 + i as f32)
        })
        .collect();
    let carried = [(Vec3::ZERO, Vec3::X, 8.0), (Vec3::Y * 20.0, Vec3::Z, 5.0)];
    let white = Texture {
        name: String::new(),
        width: 1,
        height: 1,
        rgba: vec![[255; 4]],
    };
    let lamp = |position: Vec3, power: f32| PointLight {
        position,
        radius: 2.0,
        intensity: Vec3::splat(power),
        ..PointLight::default()
    };
    let mut scene = Scene {
        meshes: vec![lamps("world", &ring), lamps("carried", &carried)],
        instances: vec![Instance::new(0, Affine3A::IDENTITY, "worldspawn")],
        materials: vec![Material {
            emission: Some(TextureId(0)),
            emission_scale: 2.0,
            emission_weight: 1.0,
            ..Material::new("lamp", TextureId(0))
        }],
        textures: vec![white],
        lights: vec![
            lamp(Vec3::new(0.0, 0.0, 90.0), 50.0),
            lamp(Vec3::new(-60.0, 20.0, 10.0), 400.0),
            lamp(Vec3::new(90.0, -70.0, 150.0), 1500.0),
            lamp(Vec3::new(10.0, 5.0, -300.0), 9000.0),
        ],
        ..Scene::default()
    };
    let sun = |x: f32, strength: f32| {
        Sun::new(
            Vec3::new(x, 0.2, 1.0).normalize(),
            0.1,
            Vec3::splat(strength),
        )
    };
    scene.sky.suns = vec![sun(0.3, 2.0), sun(-0.6, 0.5)];
    let emitters = Emitters::new(
        &scene.meshes,
        &scene.instances,
        &scene.materials,
        &scene.textures,
    );
    scene.emitters = emitters.with_lights(&scene.lights, &scene.sky.suns);
    let split = CellNode {
        normal: Vec3::X,
        distance: 0.0,
        children: [CELL, CELL | 1],
    };
    let side = 500.0;
    let count = scene.emitters.alias.len() as u32;
    scene.cells = LightCells::new(
        vec![split],
        &[
            [Vec3::new(0.0, -side, -side), Vec3::splat(side)],
            [Vec3::splat(-side), Vec3::new(0.0, side, side)],
        ],
        &scene.emitters,
        |cell, seen| seen.extend((0..count).step_by(2 - cell)),
    );
    let scene = scene.completed();
    let (scene, camera) = (if moves { scene.for_frames() } else { scene }, camera());
    let mut instances = scene.instances.clone();
    let place = Affine3A::from_translation(Vec3::new(30.0, 40.0, 50.0));
    instances.push(Instance::new(1, place, "carried"));
    let frame = Frame {
        camera: camera.clone(),
        time: 0.0,
        instances,
        loose: Mesh::default(),
        drifts: Vec::new(),
        lights: vec![lamp(Vec3::X * 40.0, 300.0), lamp(Vec3::Y * 90.0, 90.0)],
        styles: Vec::new(),
        fog: None,
        before: None,
    };
    let mut world = World::new(Arc::new(scene), &camera, 0.0).expect("a world");
    if moves {
        world.show(&frame).expect("a frame");
    }
    world
}

/// All lights of a world.
fn all(world: &World) -> Vec<Light> {
    let scene = &world.scene;
    let emitters = |part: u32, count: usize| {
        (0..count as u32).map(move |number| Light::Emitter { part, number })
    };
    let mut lights: Vec<Light> = emitters(0, scene.emitters.list.len()).collect();
    lights.extend((0..scene.lights.len()).map(Light::Entity));
    lights.extend((0..scene.sky.suns.len()).map(Light::Sun));
    for (entry, light) in world.moving.lights.iter().enumerate() {
        match *light {
            MovingLight::Point(number) => lights.push(Light::Moving {
                entry,
                number: number as usize,
            }),
            MovingLight::Instance { number, list } => {
                let list = &scene.moving.lists[list as usize];
                lights.extend(emitters(number, list.list.len()));
            }
        }
    }
    lights
}

/// Compares counts with what is expected of them (Pearson's chi-square).
fn check(what: &str, counts: &[(f64, f64)]) {
    let (mut chi2, mut freedom) = (0.0, -1.0);
    for &(count, expected) in counts {
        if expected > 10.0 {
            chi2 += (count - expected).powi(2) / expected;
            freedom += 1.0;
        } else {
            assert!(count < 40.0, "{what}: {count} where {expected} belong");
        }
    }
    // The square root of twice a chi-square is nearly normal with variance 1 (Fisher).
    let z = (2.0_f64 * chi2).sqrt() - (2.0_f64 * freedom - 1.0).max(0.0).sqrt();
    assert!(
        z < 4.0,
        "{what}: chi-square {chi2} with {freedom} degrees of freedom"
    );
}

#[test]
fn lights_are_chosen_as_often_as_is_said() {
    let samples = 100_000;
    for moves in [false, true] {
        let world = world(moves);
        let lights = all(&world);
        assert_eq!(lights.len(), if moves { 20 } else { 16 });
        // One before and one behind many lamps, in one cell each, and one far from all.
        for (selection, point) in Selection::ALL.into_iter().flat_map(|s| {
            let points = [[150.0, 0.0, 30.0], [-90.0, -160.0, 99.0], [4e3, 9e3, -7e3]];
            points.map(|p| (s, DVec3::from(p)))
        }) {
            let what = format!("{} at {point}, moving {moves}", selection.name());
            let share = world.moving.share;
            let choice = Choice::at(&world.scene, selection, point, DVec3::Z, share);
            let probabilities: Vec<f64> =
                (lights.iter().map(|l| l.probability(&world, &choice))).collect();
            let mut counts: HashMap<String, f64> = HashMap::new();
            let mut rng = Rng::new(Sampler::Independent, 11, 12, selection as u32);
            let mut none = 0.0;
            for _ in 0..samples {
                match Light::choose(&world, &choice, &mut rng) {
                    Some(light) => *counts.entry(format!("{light:?}")).or_default() += 1.0,
                    None => none += 1.0,
                }
            }
            // Where nothing can light the point, nothing is chosen.
            let rest = 1.0 - probabilities.iter().sum::<f64>();
            assert!(
                rest > -1e-6 && (rest < 1e-6 || selection == Selection::Tree),
                "{what}: {rest}"
            );
            let n = f64::from(samples);
            let mut pairs = vec![(none, rest.max(0.0) * n)];
            for (light, p) in lights.iter().zip(probabilities) {
                let count = counts.remove(&format!("{light:?}")).unwrap_or(0.0);
                assert!(count == 0.0 || p > 0.0, "{what}: {light:?} is chosen");
                pairs.push((count, p * n));
            }
            assert!(counts.is_empty(), "{what}: {counts:?} are no lights");
            check(&what, &pairs);
        }
    }
}

#[test]
fn what_is_chosen_by_a_guess_stands_for_all() {
    let samples = 100_000;
    for (moves, listed) in [(false, 15), (true, 15), (false, 3)] {
        let world = world(moves);
        let lights = all(&world);
        let own = world.scene.emitters.bounds.len();
        let places = [
            ([150.0, 0.0, 30.0], DVec3::Z),
            // Without the suns, which outshine the rest.
            ([150.0, 0.0, 130.0], DVec3::NEG_Z),
            ([-90.0, -160.0, 99.0], DVec3::NEG_Z),
        ];
        let mut often = 0;
        for (point, normal) in places {
            let point = DVec3::from(point);
            let share = world.moving.share;
            let choice = Choice::at(&world.scene, Selection::Leaf, point, normal, share);
            let mut rng = Rng::new(Sampler::Independent, 5, 6, listed);
            let mut sums: HashMap<String, [f64; 3]> = HashMap::new();
            for _ in 0..samples {
                let at = (point, normal);
                let chosen = Light::choose_by_guess(&world, &choice, at, listed, &mut rng);
                if let Some((light, weight)) = chosen {
                    let [count, sum, squares] = sums.entry(format!("{light:?}")).or_default();
                    *count += 1.0;
                    *sum += weight;
                    *squares += weight * weight;
                }
            }
            // Each light that may add something is there once in the mean, weighted. Those that add next to
            // nothing hardly ever come.
            let n = f64::from(samples);
            let mut never = 0;
            for (number, light) in lights.iter().enumerate() {
                let may_add = match world.scene.emitters.bounds.get(number) {
                    Some(bounds) if number < own => guess(bounds, point, normal) > 0.0,
                    _ => true,
                };
                let [count, sum, squares] = sums.remove(&format!("{light:?}")).unwrap_or_default();
                if !may_add {
                    assert_eq!(sum, 0.0, "{light:?}");
                    never += 1;
                    continue;
                }
                if count < 50.0 {
                    continue;
                }
                often += 1;
                let (mean, error) = (sum / n, (squares / n - (sum / n).powi(2)).sqrt() / n.sqrt());
                assert!(
                    (mean - 1.0).abs() < 4.0 * error && error < 0.2,
                    "{light:?} at {point}, moving {moves}: {mean} +- {error}"
                );
            }
            assert!(sums.is_empty() && never > 2, "{sums:?}, {never}");
        }
        assert!(often > 8, "{often}");
    }
}

#[test]
fn a_guess_is_above_0_wherever_a_light_adds_something() {
    let world = world(false);
    let emitters = &world.scene.emitters;
    let mut rng = Rng::new(Sampler::Independent, 7, 8, 9);
    let (mut lit, mut dark) = (0, 0);
    for _ in 0..2000 {
        let mut random = || DVec3::from_array([(); 3].map(|()| 2.0 * rng.next() - 1.0));
        let (point, normal) = (300.0 * random(), random().normalize());
        for (emitter, bounds) in emitters.list.iter().zip(&emitters.bounds) {
            let front = emitter
                .normal
                .as_dvec3()
                .dot(point - emitter.corners[0].as_dvec3());
            // Corners are the points that stick out most.
            let seen = |p: &Vec3| normal.dot(p.as_dvec3() - point) > 1e-3;
            let adds = front > 1e-3 && emitter.corners.iter().any(seen);
            let guessed = guess(bounds, point, normal);
            assert!(
                guessed.is_finite() && (guessed > 0.0 || !adds),
                "{emitter:?} at {point}"
            );
            // No light is taken for more than a lamp of its strength in the worst place.
            let nearest = f64::from(bounds.radius).powi(2);
            assert!(guessed <= f64::from(bounds.weight) / nearest * 1.000_001);
            *(if adds { &mut lit } else { &mut dark }) += 1;
        }
    }
    assert!(lit > 1000 && dark > 1000);
}

#[test]
fn of_candidates_one_is_kept_as_often_as_it_adds() {
    let adds = [0.0, 1.0, 5.0, 0.25, 3.0];
    let samples = 100_000;
    let mut counts = [0.0; 5];
    let mut rng = Rng::new(Sampler::Independent, 1, 2, 3);
    let total: f64 = adds.iter().sum();
    for _ in 0..samples {
        let mut reservoir = Reservoir::new(adds.len() as u32);
        for (i, &add) in adds.iter().enumerate() {
            reservoir.offer(i, DVec3::splat(add), &mut rng);
        }
        let (kept, radiance) = reservoir.kept().expect("a candidate");
        // Whoever is kept stands for the mean.
        assert!((radiance - total / 5.0).abs().max_element() < 1e-12);
        counts[kept] += 1.0;
    }
    let expected = |add: f64| f64::from(samples) * add / total;
    let pairs: Vec<_> = (counts.iter().zip(adds))
        .map(|(&count, add)| (count, expected(add)))
        .collect();
    assert_eq!(counts[0], 0.0);
    check("candidates", &pairs);
}
