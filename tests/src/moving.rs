//! A room in which things move: models in poses and skins, a lamp on a door, particles, lights.

use crate::builder::list_emitters;
use crate::scenes::{room, room_view};
use glam::{Affine3A, Vec3};
use scene::smooth::PackedNormal;
use scene::{
    Emitters, Frame, Instance, Material, MaterialId, Mesh, PointLight, PoseBlend, Scene, SeenBy,
    Texture, TextureId, Triangle,
};
use std::sync::Arc;

/// Number of the mesh with poses.
pub const BLOB: usize = 1;
/// Number of the mesh with a lamp.
pub const DOOR: usize = 2;
/// The room's material with several emitting texels.
const LAMP: MaterialId = MaterialId(2);

/// Corners of an octahedron's faces, counter-clockwise from outside.
const FACES: [[u32; 3]; 8] = [
    [0, 2, 4],
    [2, 1, 4],
    [1, 3, 4],
    [3, 0, 4],
    [2, 0, 5],
    [1, 2, 5],
    [3, 1, 5],
    [0, 3, 5],
];

fn triangles(
    positions: &[Vec3],
    faces: &[[u32; 3]],
    material: impl Fn(usize) -> MaterialId,
) -> Vec<Triangle> {
    (faces.iter().enumerate())
        .map(|(i, &vertices)| {
            let [a, b, c] = vertices.map(|v| positions[v as usize]);
            let at = i as f32;
            Triangle {
                vertices,
                uv: [[at, 0.0], [at + 1.5, 0.25], [at + 0.5, 1.75]],
                normal: (b - a).cross(c - a).normalize(),
                material: material(i),
                face: 100 + i as u32,
            }
        })
        .collect()
}

/// An octahedron with the half axes of each pose.
fn blob(poses: &[[f32; 3]], material: MaterialId, skins: Vec<MaterialId>) -> Mesh {
    let poses: Vec<Vec<Vec3>> = (poses.iter())
        .map(|&[x, y, z]| {
            let axes = [Vec3::X * x, Vec3::Y * y, Vec3::Z * z];
            [axes[0], -axes[0], axes[1], -axes[1], axes[2], -axes[2]].to_vec()
        })
        .collect();
    let positions = poses[0].clone();
    Mesh {
        name: "blob".into(),
        triangles: triangles(&positions, &FACES, |_| material),
        first_see_through: FACES.len(),
        positions,
        poses: if poses.len() > 1 { poses } else { Vec::new() },
        skins,
        ..Mesh::default()
    }
}

/// The moving room, in which the blob and the door are shaded as ellipsoids.
#[must_use]
pub fn smooth_room() -> Arc<Scene> {
    let mut scene = Arc::unwrap_or_clone(moving_room());
    for mesh in &mut scene.meshes[BLOB..=DOOR] {
        let rigid = [mesh.positions.clone()];
        let poses = if mesh.poses.is_empty() {
            &rigid[..]
        } else {
            &mesh.poses
        };
        // Vertices lie on the axes: there the normals are theirs.
        let normals = |pose: &Vec<Vec3>| {
            let of = |t: &Triangle| t.vertices.map(|v| PackedNormal::new(pose[v as usize]));
            mesh.triangles.iter().map(of).collect()
        };
        mesh.normals = poses.iter().map(normals).collect();
    }
    Arc::new(scene.for_frames())
}

fn plain(scene: &mut Scene, grey: u8, emitted: f32) -> MaterialId {
    let texel = |grey: u8| Texture {
        name: String::new(),
        width: 1,
        height: 1,
        rgba: vec![[grey, grey, grey, 255]],
    };
    scene.textures.extend([texel(grey), texel(255)]);
    let base = TextureId(scene.textures.len() as u32 - 2);
    scene.materials.push(Material {
        base,
        emission: (emitted > 0.0).then_some(TextureId(base.0 + 1)),
        emission_scale: emitted,
        emission_weight: emitted,
        ..scene.materials[0].clone()
    });
    MaterialId(scene.materials.len() as u32 - 1)
}

/// The room, made for frames: two styles of its own lights, one of them dark at first.
#[must_use]
pub fn moving_room() -> Arc<Scene> {
    let mut scene = Arc::unwrap_or_clone(room());
    let (clay, spark) = (plain(&mut scene, 140, 0.0), plain(&mut scene, 0, 3.0));
    scene.meshes.push(blob(
        &[[9.0, 6.0, 7.0], [5.0, 9.0, 12.0], [12.0, 4.0, 5.0]],
        clay,
        vec![LAMP, spark],
    ));
    let of = |id: MaterialId| id.0 as usize;
    // The lamp shows three pictures in turn, the last one dark.
    let lamp = scene.materials[of(LAMP)].clone();
    let mut other = scene.textures[lamp.emission.expect("a lamp").0 as usize].clone();
    other.rgba = vec![[0; 4], [255, 60, 30, 255], [40, 255, 60, 255], [90; 4]];
    scene.textures.push(other);
    let emission = Some(TextureId(scene.textures.len() as u32 - 1));
    let first = scene.materials.len() as u32;
    for emission in [emission, None] {
        let shown = Material {
            emission,
            ..lamp.clone()
        };
        scene.materials.push(shown);
    }
    scene.materials[of(LAMP)].frames = vec![LAMP, MaterialId(first), MaterialId(first + 1)];
    let mut door = blob(&[[6.0, 8.0, 10.0]], clay, Vec::new());
    for (i, t) in door.triangles.iter_mut().enumerate() {
        if i % 2 == 0 {
            t.material = LAMP;
        }
    }
    scene.meshes.push(door);
    let lamp = |x: f32, style: u16| PointLight {
        position: Vec3::new(x, -15.0, 18.0),
        radius: 1.0,
        intensity: Vec3::new(150.0, 250.0, 200.0),
        style,
        ..PointLight::default()
    };
    scene.lights = vec![lamp(-20.0, 2), lamp(5.0, 33)];
    scene.brightness = vec![1.0; 64];
    scene.brightness[33] = 0.0;
    list_emitters(&mut scene);
    Arc::new(scene.for_frames())
}

/// A moment of it, at a time of some seconds: everything moves, and blobs, a skin, sparks, lights and
/// styles come and go. With `lights` there are spheres that rays can't find.
#[must_use]
pub fn moment(scene: &Scene, time: f32, lights: bool) -> Frame {
    let turn = |a: f32, p: Vec3| Affine3A::from_translation(p) * Affine3A::from_rotation_z(a);
    let blob = |at: Vec3, pose: PoseBlend, material, seen_by| Instance {
        pose,
        material,
        seen_by,
        ..Instance::new(BLOB, turn(time, at), "blob")
    };
    let blend = |from, to, fraction| PoseBlend { from, to, fraction };
    let spark = MaterialId(LAMP.0 + 3);
    let mut instances = vec![
        scene.instances[0].clone(),
        blob(
            Vec3::new(-14.0, 2.0, -8.0 + 4.0 * time),
            blend(0, 1, (0.3 + 0.4 * time).fract()),
            None,
            SeenBy::ALL,
        ),
        blob(
            Vec3::new(16.0, 14.0, -12.0),
            blend(2, 1, (0.25 * time).fract()),
            Some(LAMP),
            SeenBy::ALL,
        ),
        Instance::new(
            DOOR,
            turn(0.3, Vec3::new(-5.0, 22.0 - 6.0 * time, -20.0)),
            "door",
        ),
        // Its mirror image, larger.
        Instance::new(
            DOOR,
            turn(-0.4, Vec3::new(24.0, -2.0, 14.0))
                * Affine3A::from_scale(Vec3::new(-1.3, 1.3, 1.3)),
            "door",
        ),
        // Before the eye, and around it.
        blob(
            Vec3::new(1.0, -17.0, 2.0),
            blend(1, 1, 0.0),
            Some(spark),
            SeenBy::CAMERA,
        ),
        blob(room_view().position, blend(0, 2, 0.5), None, SeenBy::OTHERS),
    ];
    if time > 0.5 {
        instances.insert(
            2,
            blob(
                Vec3::new(4.0, 8.0, 12.0),
                blend(0, 1, 0.9),
                Some(spark),
                SeenBy::ALL,
            ),
        );
    }
    let sparks = (3.0 * time) as usize + 1;
    let mut loose = Mesh::default();
    for i in 0..sparks {
        let at = Vec3::new(-10.0 + 5.0 * i as f32, 5.0, 6.0 + time);
        let first = loose.positions.len() as u32;
        let corners = [
            Vec3::ZERO,
            Vec3::new(2.0, 0.0, 0.0),
            Vec3::new(0.0, 0.5, 2.0),
        ];
        loose.positions.extend(corners.map(|c| at + c));
        let face = [first, first + 1, first + 2];
        (loose.triangles).extend(triangles(&loose.positions, &[face], |_| spark));
    }
    loose.first_see_through = loose.triangles.len();
    let mut styles = vec![1.0; 64];
    styles[2] = if lights { 0.5 } else { 0.0 };
    styles[33] = if lights { 1.0 + time } else { 0.0 };
    let light = |position: Vec3| PointLight {
        position,
        radius: 1.5,
        intensity: Vec3::new(400.0, 250.0, 80.0),
        ..PointLight::default()
    };
    let lights = match lights {
        true => vec![
            light(Vec3::new(8.0 * time, 0.0, -5.0)),
            light(Vec3::new(-25.0, 20.0, 25.0)),
        ],
        false => Vec::new(),
    };
    Frame {
        camera: room_view(),
        time,
        instances,
        loose,
        drifts: Vec::new(),
        lights,
        styles,
        fog: scene.fog,
        before: None,
    }
}

/// The scene that a frame shows, made in that moment.
#[must_use]
pub fn still(scene: &Scene, frame: &Frame) -> Arc<Scene> {
    let mut still = scene.clone();
    still.lights = scene.lights_now(&frame.styles);
    still.lights.extend(frame.lights.iter().copied());
    still.brightness = Vec::new();
    for (material, look) in still.materials.iter_mut().zip(scene.looks(frame.time)) {
        material.clone_from(&scene.materials[look.0 as usize]);
        material.frames.clear();
    }
    still.fog = frame.fog;
    [still.sky.scale, still.sky.veil] = scene.sky_now(frame.fog);
    still.clear_sky = None;
    still.moving = scene::MovingEmitters::default();
    still.features.frames = false;
    still.instances.clone_from(&frame.instances);
    still.meshes.push(frame.loose.clone());
    still.instances.push(Instance {
        seen_by: SeenBy::CAMERA,
        ..Instance::new(still.meshes.len() - 1, Affine3A::IDENTITY, "sparks")
    });
    still.emitters = Emitters::new(
        &still.meshes,
        &still.instances,
        &still.materials,
        &still.textures,
    )
    .with_lights(&still.lights, &still.sky.suns);
    Arc::new(still.completed())
}
