use super::*;
use glam::{Affine3A, Vec3};
use scene::material::{Material, Texture};
use scene::{Emitters, Instance, Mesh, PointLight, Triangle};

/// A grey floor, a screen beside its middle that hides what is to the left of it and low, and these lamps.
fn probe(lamps: Vec<PointLight>) -> Probe {
    let grey = Texture {
        name: String::new(),
        width: 1,
        height: 1,
        rgba: vec![[128, 128, 128, 255]],
    };
    let material = Material::new("floor", TextureId(0));
    let quad = |[a, b, c, d]: [Vec3; 4], face: u32| {
        let normal = (b - a).cross(c - a).normalize();
        let triangle = |i: u32, j: u32, k: u32| Triangle {
            vertices: [4 * face + i, 4 * face + j, 4 * face + k],
            uv: [[0.0; 2]; 3],
            normal,
            material: MaterialId(0),
            face: face + 7,
        };
        ([a, b, c, d], [triangle(0, 1, 2), triangle(0, 2, 3)])
    };
    let floor =
        [[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]].map(|[x, y]| 200.0 * Vec3::new(x, y, 0.));
    let screen = [[-1., 0.], [1., 0.], [1., 1.], [-1., 1.]];
    let screen = screen.map(|[y, z]| Vec3::new(-10.0, 100.0 * y, 60.0 * z));
    let quads = [quad(floor, 0), quad(screen, 1)];
    let mesh = Mesh {
        name: "world".into(),
        positions: quads.iter().flat_map(|q| q.0).collect(),
        triangles: quads.iter().flat_map(|q| q.1).collect(),
        first_see_through: 4,
        ..Mesh::default()
    };
    let mut scene = Scene {
        meshes: vec![mesh],
        instances: vec![Instance::new(0, Affine3A::IDENTITY, "worldspawn")],
        materials: vec![material],
        textures: vec![grey],
        lights: lamps,
        ..Scene::default()
    };
    let emitters = Emitters::new(
        &scene.meshes,
        &scene.instances,
        &scene.materials,
        &scene.textures,
    );
    scene.emitters = emitters.with_lights(&scene.lights, &[]);
    Probe::new(Arc::new(scene.completed()), 0.0).expect("a scene")
}

fn lamp(x: f32, y: f32, z: f32, style: u16) -> PointLight {
    PointLight {
        position: Vec3::new(x, y, z),
        radius: 0.5,
        intensity: Vec3::new(1000.0, 500.0, 250.0),
        style,
        ..PointLight::default()
    }
}

/// The floor in its middle, from above.
fn middle(probe: &Probe) -> Seen {
    let seen = probe.look_along(DVec3::new(0.0, 0.0, 50.0), DVec3::NEG_Z);
    let seen = seen.expect("the floor");
    assert_eq!((seen.face, seen.instance), (7, Some(0)));
    assert!((seen.distance - 50.0).abs() < 1e-9 && seen.normal == DVec3::Z);
    seen
}

/// Luminance of an inverse-square lamp's irradiance over pi.
fn exactly(light: &PointLight, at: DVec3) -> f64 {
    let to = light.position.as_dvec3() - at;
    let cos = to.z / to.length();
    luminance(light.intensity.as_dvec3()) * cos / to.length_squared() / std::f64::consts::PI
}

#[test]
fn one_lamp_gives_all_the_light_and_as_much_as_its_law_says() {
    let light = lamp(30.0, 0.0, 60.0, 5);
    let probe = probe(vec![light]);
    let seen = middle(&probe);
    let found = probe.lights(&seen, 256, 1);
    let [share] = found.shares.as_slice() else {
        panic!("{found:?}")
    };
    assert_eq!((share.luminary, share.style), (Luminary::Lamp(0), 5));
    let exact = exactly(&light, seen.position);
    // The lamp is a sphere seen at a hundredth of its distance: its cosine hardly varies.
    assert!(
        (share.luminance / exact - 1.0).abs() < 1e-3,
        "{} for {exact}",
        share.luminance
    );
    assert_eq!(found.total[0], share.luminance);
    assert_eq!(
        probe.lights(&seen, 256, 1),
        found,
        "the same question, the same answer"
    );
}

#[test]
fn two_equal_lamps_give_half_each_and_a_hidden_one_is_not_listed() {
    let lamps = vec![
        lamp(40.0, 30.0, 50.0, 0),
        lamp(40.0, -30.0, 50.0, 0),
        lamp(-40.0, 0.0, 50.0, 0),
        lamp(-12.0, 0.0, 90.0, 0),
    ];
    let probe = probe(lamps.clone());
    let seen = middle(&probe);
    let found = probe.lights(&seen, 1024, 3);
    let of = |i: usize| {
        found
            .shares
            .iter()
            .find(|s| s.luminary == Luminary::Lamp(i))
    };
    assert!(of(2).is_none(), "the screen hides it");
    let [a, b, high] = [0, 1, 3].map(|i| of(i).expect("a lamp in view").luminance);
    assert!((a / b - 1.0).abs() < 2e-3, "{a} and {b}");
    // Over the screen's edge.
    let exact = lamps[3];
    assert!((high / exactly(&exact, seen.position) - 1.0).abs() < 2e-3);
    assert!(found.shares[0].luminance >= found.shares[1].luminance);
    let sum: f64 = found.shares.iter().map(|s| s.luminance).sum();
    assert!((sum / found.total[0] - 1.0).abs() < 1e-12);
}

#[test]
fn the_error_is_that_of_the_estimate() {
    // A large lamp half behind the screen's edge: each sample sees it or not.
    let light = PointLight {
        radius: 12.0,
        ..lamp(-14.0, 0.0, 84.0, 0)
    };
    let probe = probe(vec![light]);
    let seen = middle(&probe);
    let runs: Vec<Share> = (0..64)
        .map(|seed| probe.lights(&seen, 64, seed).shares.remove(0))
        .collect();
    let mean = runs.iter().map(|s| s.luminance).sum::<f64>() / 64.0;
    let spread = runs
        .iter()
        .map(|s| (s.luminance - mean).powi(2))
        .sum::<f64>()
        / 63.0;
    let said = runs.iter().map(|s| s.error * s.error).sum::<f64>() / 64.0;
    // The variance of 64 normal numbers is known to a fifth (standard error).
    assert!((0.4..1.8).contains(&(spread / said)), "{spread} for {said}");
    assert!(said > 0.0);
}
