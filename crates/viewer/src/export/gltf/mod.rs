//! A scene as glTF 2.0, for editors and viewers: Y up, metres, `KHR_lights_punctual`,
//! `KHR_materials_emissive_strength`.

mod buffer;
mod glb;

use super::manifest::{self, Exported, Reason};
use super::{Folder, Job, images, safe_name};
use crate::output::PartFile;
use anyhow::{Result, bail};
use buffer::Buffer;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use scene::sky::{BOX_SIDES, SkyKind};
use scene::{Camera, Instance, Material, PointLight, PoseBlend, Scene, Surface, TextureId};
use serde_json::{Map, Value, json};
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};
use std::io::Write as _;
use std::path::Path;

/// Metres per unit: one unit is about an inch.
pub const METRES_PER_UNIT: f64 = 0.0254;

/// Texture filter and wrap modes of OpenGL, which glTF numbers them by.
const NEAREST: u32 = 9728;
const REPEAT: u32 = 10497;
/// Largest half angle of a spotlight's cone that glTF allows.
const MAX_CONE: f64 = std::f64::consts::FRAC_PI_2;

/// Writes the scene into the directory `target`, or into one file if its name ends in `.glb`.
///
/// # Errors
/// When it cannot be written or must not be replaced; see [`Folder`].
pub fn write(job: &Job<'_>, target: &Path) -> Result<Exported> {
    let built = build(job)?;
    let mut manifest = manifest::describe(job, "gltf", &reasons(job), built.counts());
    manifest.insert("metres_per_unit".into(), METRES_PER_UNIT.into());
    let is_glb = (target.extension()).is_some_and(|e| e.eq_ignore_ascii_case("glb"));
    if is_glb {
        let mut part = PartFile::create(target)?;
        let bytes = glb::encode(built)?;
        part.file().write_all(&bytes)?;
        part.commit()?;
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let files = json!([{"path": name, "bytes": bytes.len()}]);
        manifest.insert("files".into(), files);
        return Ok(Exported {
            path: target.to_owned(),
            manifest: manifest.into(),
        });
    }
    let mut folder = Folder::create(target)?;
    let Built {
        mut document,
        buffer,
        pictures,
        ..
    } = built;
    for (i, (name, png)) in pictures.iter().enumerate() {
        let file = format!("textures/{name}.png");
        folder.write(&file, |out| Ok(out.write_all(png)?))?;
        document["images"][i]["uri"] = file.into();
    }
    document["buffers"][0]["uri"] = "scene.bin".into();
    folder.write("scene.bin", |out| Ok(out.write_all(&buffer)?))?;
    let text = serde_json::to_string(&document)?;
    folder.write("scene.gltf", |out| Ok(out.write_all(text.as_bytes())?))?;
    manifest::finish(folder, manifest)
}

/// A document whose buffer and pictures have no place yet.
struct Built {
    document: Value,
    buffer: Vec<u8>,
    /// Names and PNGs, in the order of the document's images.
    pictures: Vec<(String, Vec<u8>)>,
    triangles: usize,
}

impl Built {
    fn counts(&self) -> Map<String, Value> {
        let len = |key: &str| self.document[key].as_array().map_or(0, Vec::len);
        [
            ("meshes", len("meshes")),
            ("triangles", self.triangles),
            ("materials", len("materials")),
            ("textures", len("images")),
            ("nodes", len("nodes")),
        ]
        .into_iter()
        .map(|(name, count)| (name.to_owned(), json!(count)))
        .collect()
    }
}

/// From the level's axes to glTF's: Y up, and a camera that looks along +X looks along -Z.
fn axes() -> DMat3 {
    DMat3::from_cols(DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y)
}

/// A place in metres.
fn place(p: Vec3) -> DVec3 {
    axes() * p.as_dvec3() * METRES_PER_UNIT
}

/// An instance's transform in metres and glTF's axes, as a column-major matrix.
fn matrix(transform: DAffine3) -> Vec<f64> {
    let linear = axes() * transform.matrix3 * axes().transpose();
    let translation = axes() * transform.translation * METRES_PER_UNIT;
    [
        (linear.x_axis, 0.0),
        (linear.y_axis, 0.0),
        (linear.z_axis, 0.0),
        (translation, 1.0),
    ]
    .into_iter()
    .flat_map(|(v, w)| [v.x, v.y, v.z, w])
    .collect()
}

fn build(job: &Job<'_>) -> Result<Built> {
    let scene = job.scene;
    let mut pictures = Pictures::default();
    let materials: Vec<Value> = (scene.materials.iter())
        .map(|m| material(scene, m, &mut pictures))
        .collect::<Result<_>>()?;
    let mut buffer = Buffer::default();
    let mut meshes = Vec::new();
    // A mesh in each pose and skin that it is shown in. Those without a triangle have no place in the
    // document.
    let mut numbers = HashMap::new();
    let mut nodes = Vec::new();
    for instance in &scene.instances {
        let PoseBlend { from, to, fraction } = instance.pose;
        let look = (from, to, fraction.to_bits(), instance.material);
        let number = match numbers.entry((instance.mesh, look)) {
            Entry::Occupied(number) => *number.get(),
            Entry::Vacant(place) => {
                let value = mesh(scene, instance, &mut buffer)?;
                let number = value.is_some().then_some(meshes.len());
                meshes.extend(value);
                *place.insert(number)
            }
        };
        if let Some(number) = number {
            nodes.push(instance_node(instance, number));
        }
    }
    let mut lights = Vec::new();
    for light in &scene.lights {
        nodes.push(light_node(light, lights.len()));
        lights.push(punctual(light));
    }
    let mut cameras = Vec::new();
    let asked = &job.settings.camera;
    let others = scene.cameras.iter().filter(|c| *c != asked);
    for camera in std::iter::once(asked).chain(others) {
        nodes.push(camera_node(camera, cameras.len()));
        cameras.push(perspective(job, camera));
    }
    let mut extensions = Vec::new();
    if materials.iter().any(|m| m.get("extensions").is_some()) {
        extensions.push("KHR_materials_emissive_strength");
    }
    let all: Vec<usize> = (0..nodes.len()).collect();
    let mut document = json!({
        "asset": {
            "version": "2.0",
            "generator": concat!("Runelight ", env!("CARGO_PKG_VERSION")),
        },
        "scene": 0,
        "scenes": [{"name": scene.name, "nodes": all}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "cameras": cameras,
        "buffers": [{"byteLength": buffer.bytes.len()}],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    });
    if !pictures.list.is_empty() {
        let count = pictures.list.len();
        let textures: Vec<Value> = (0..count)
            .map(|i| json!({"sampler": 0, "source": i}))
            .collect();
        document["samplers"] = json!([{
            "magFilter": NEAREST, "minFilter": NEAREST, "wrapS": REPEAT, "wrapT": REPEAT,
        }]);
        document["textures"] = textures.into();
        let images = pictures.list.iter().map(|(name, _)| json!({"name": name}));
        document["images"] = images.collect();
    }
    if !lights.is_empty() {
        extensions.push("KHR_lights_punctual");
        document["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
    }
    if !extensions.is_empty() {
        document["extensionsUsed"] = json!(extensions);
    }
    Ok(Built {
        document,
        buffer: buffer.bytes,
        pictures: pictures.list,
        triangles: scene.triangle_count(),
    })
}

/// The pictures that materials use, once each.
#[derive(Default)]
struct Pictures {
    numbers: BTreeMap<TextureId, usize>,
    list: Vec<(String, Vec<u8>)>,
}

impl Pictures {
    fn number(&mut self, scene: &Scene, id: TextureId) -> Result<usize> {
        if let Some(&number) = self.numbers.get(&id) {
            return Ok(number);
        }
        let Some(texture) = scene.textures.get(id.0 as usize) else {
            bail!("a material names a texture that is not there")
        };
        let mut png = Vec::new();
        images::write_rgba(&mut png, &texture.rgba, texture.width, texture.height)?;
        let number = self.list.len();
        self.list
            .push((format!("{:03}_{}", id.0, safe_name(&texture.name)), png));
        self.numbers.insert(id, number);
        Ok(number)
    }
}

fn material(scene: &Scene, material: &Material, pictures: &mut Pictures) -> Result<Value> {
    let mut pbr = json!({"metallicFactor": 0, "roughnessFactor": 1});
    let mut value = json!({"name": material.name, "doubleSided": true});
    if material.surface == Surface::Sky {
        pbr["baseColorFactor"] = json!([0, 0, 0, 1]);
        let mean = mean_sky(scene);
        let strength = mean.max_element();
        if strength > 0.0 {
            value["emissiveFactor"] = json!((mean / strength).to_array());
            value["extensions"] = strong(strength);
        }
    } else {
        pbr["baseColorTexture"] = json!({"index": pictures.number(scene, material.base)?});
        if material.alpha_tested {
            value["alphaMode"] = "MASK".into();
            value["alphaCutoff"] = json!(0.5);
        }
        if let Some(gloss) = material.finish.gloss {
            pbr["metallicFactor"] = json!(gloss.metallic);
            pbr["roughnessFactor"] = json!(gloss.roughness);
        }
        if let Some(normals) = material.finish.normals {
            value["normalTexture"] = json!({"index": pictures.number(scene, normals)?});
        }
        if material.finish.alpha < 1.0 {
            value["alphaMode"] = "BLEND".into();
            pbr["baseColorFactor"] = json!([1, 1, 1, material.finish.alpha]);
        }
        if let Some(emission) = material.emission.filter(|_| material.emission_scale > 0.0) {
            value["emissiveTexture"] = json!({"index": pictures.number(scene, emission)?});
            value["emissiveFactor"] = json!([1, 1, 1]);
            value["extensions"] = strong(material.emission_scale);
        }
    }
    value["pbrMetallicRoughness"] = pbr;
    Ok(value)
}

fn strong(strength: f32) -> Value {
    json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}})
}

/// Mean radiance of the sky's texture.
fn mean_sky(scene: &Scene) -> Vec3 {
    let picture = match scene.sky.kind {
        SkyKind::None => Vec3::ZERO,
        SkyKind::Flat(radiance) => radiance,
        SkyKind::Box(first) => {
            let sides = (scene.textures.iter())
                .skip(first.0 as usize)
                .take(BOX_SIDES);
            let texels = || sides.clone().flat_map(|side| &side.rgba);
            let sum: DVec3 = texels()
                .map(|&[r, g, b, _]| DVec3::from([r, g, b].map(scene::material::srgb_to_linear)))
                .sum();
            (sum / texels().count().max(1) as f64).as_vec3()
        }
        SkyKind::Scrolling { back, front } => {
            let [back, front] = [back, front].map(|id| &scene.textures[id.0 as usize].rgba);
            let shown = |i: usize| match front[i] {
                [_, _, _, 0] => back[i * back.len() / front.len()],
                texel => texel,
            };
            let sum: DVec3 = (0..front.len())
                .map(|i| {
                    let [r, g, b, _] = shown(i).map(scene::material::srgb_to_linear);
                    DVec3::new(r, g, b)
                })
                .sum();
            (sum / front.len().max(1) as f64).as_vec3()
        }
    };
    picture * scene.sky.scale[0] + scene.sky.veil[0]
}

/// An instance's mesh with one primitive per material, in its pose and skin; `None` if it has no
/// triangle.
fn mesh(scene: &Scene, instance: &Instance, buffer: &mut Buffer) -> Result<Option<Value>> {
    let mesh = &scene.meshes[instance.mesh];
    let positions = mesh.posed(instance.pose);
    let mut by_material: BTreeMap<u32, Vec<buffer::Vertex>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        let id = instance.material_of(triangle);
        let material = &scene.materials[id.0 as usize];
        let texture = &scene.textures[material.base.0 as usize];
        // A liquid's coordinates are in units of 64 to a tile, and lie still.
        let tile = scene::material::WARP_TILE as f32;
        let size = if material.warped {
            [tile; 2]
        } else {
            [texture.width as f32, texture.height as f32]
        };
        let [a, b, c] = triangle.vertices.map(|v| positions[v as usize].as_dvec3());
        let normal = match mesh.poses.is_empty() {
            true => triangle.normal.as_dvec3(),
            false => (b - a).cross(c - a),
        };
        let normal = (axes() * normal).normalize_or_zero();
        let vertices = by_material.entry(id.0).or_default();
        for (v, uv) in triangle.vertices.into_iter().zip(triangle.uv) {
            vertices.push(buffer::Vertex {
                position: place(positions[v as usize]).as_vec3().to_array(),
                normal: normal.as_vec3().to_array(),
                uv: [uv[0] / size[0], uv[1] / size[1]],
            });
        }
    }
    let primitives: Vec<Value> = by_material
        .into_iter()
        .map(|(material, vertices)| {
            let mut primitive = buffer.triangles(&vertices)?;
            primitive["material"] = material.into();
            Ok(primitive)
        })
        .collect::<Result<_>>()?;
    Ok((!primitives.is_empty()).then(|| json!({"name": mesh.name, "primitives": primitives})))
}

fn instance_node(instance: &Instance, mesh: usize) -> Value {
    let mut node = json!({"name": instance.name, "mesh": mesh});
    let t = instance.transform;
    let transform = DAffine3 {
        matrix3: glam::Mat3::from(t.matrix3).as_dmat3(),
        translation: Vec3::from(t.translation).as_dvec3(),
    };
    if transform != DAffine3::IDENTITY {
        node["matrix"] = json!(matrix(transform));
    }
    node
}

/// A light's colour and strength. Intensity is in candela, where a radiance of 1 is 1 cd/m^2, as
/// emissive strengths are.
fn punctual(light: &PointLight) -> Value {
    let strength = light.intensity.max_element();
    let candela = f64::from(strength) * METRES_PER_UNIT * METRES_PER_UNIT;
    let color = if strength > 0.0 {
        light.intensity / strength
    } else {
        Vec3::ONE
    };
    let mut value = json!({
        "type": "point",
        "color": color.to_array(),
        "intensity": candela,
    });
    if let Some(spot) = light.spot {
        let angle = |cos: f32| f64::from(cos).clamp(-1.0, 1.0).acos();
        let outer = angle(spot.cos_outer).clamp(1e-4, MAX_CONE);
        let inner = angle(spot.cos_inner).min(outer * 0.999);
        value["type"] = "spot".into();
        value["spot"] = json!({"innerConeAngle": inner, "outerConeAngle": outer});
    }
    value
}

fn light_node(light: &PointLight, number: usize) -> Value {
    let mut node = json!({
        "name": format!("light-{number}"),
        "translation": place(light.position).to_array(),
        "extensions": {"KHR_lights_punctual": {"light": number}},
    });
    if let Some(spot) = light.spot {
        // Spotlights shine along -Z.
        let direction = (axes() * spot.direction.as_dvec3()).normalize_or(DVec3::NEG_Z);
        let turn = glam::DQuat::from_rotation_arc(DVec3::NEG_Z, direction);
        node["rotation"] = json!(turn.to_array());
    }
    node
}

fn camera_node(camera: &Camera, number: usize) -> Value {
    let basis = camera.view_basis(4, 3);
    let [right, up, forward] =
        [basis.right, basis.up, basis.forward].map(|v| (axes() * v).normalize_or_zero());
    let turn = glam::DQuat::from_mat3(&DMat3::from_cols(right, up, -forward));
    json!({
        "name": camera.name,
        "camera": number,
        "translation": place(camera.position).to_array(),
        "rotation": turn.normalize().to_array(),
    })
}

fn perspective(job: &Job<'_>, camera: &Camera) -> Value {
    let (w, h) = (job.settings.width, job.settings.height);
    let basis = camera.view_basis(w, h);
    json!({
        "name": camera.name,
        "type": "perspective",
        "perspective": {
            "aspectRatio": f64::from(w) / f64::from(h),
            "yfov": 2.0 * basis.up.length().atan(),
            "znear": 0.01,
        },
    })
}

/// What editors show otherwise.
fn reasons(job: &Job<'_>) -> Vec<Reason> {
    let scene = job.scene;
    let features = scene.features;
    let one_sided = (scene.materials.iter()).any(|m| m.emission.is_some() && !m.two_sided);
    [
        (
            features.sky,
            "sky",
            "sky faces shine evenly with the sky's mean colour",
        ),
        (features.liquids, "warped liquids", "liquids do not warp"),
        (
            features.gloss,
            "gloss",
            "gloss has glTF's strength, 4 % straight on, and no pictures of its roughness",
        ),
        (
            features.translucent,
            "see-through surfaces",
            "light passes through them without being mirrored, tinted or absorbed",
        ),
        (
            features.smooth_normals,
            "smooth normals",
            "the facets of models are shaded flat",
        ),
        (features.fog, "fog", "there is no fog"),
        (
            job.settings.camera.lens.is_some(),
            "lens",
            "the camera is a pinhole: everything is sharp",
        ),
        (
            features.masks,
            "masks",
            "the camera and light see all models: some should be seen by one of them alone",
        ),
        (
            one_sided,
            "emission",
            "lamps shine to both sides of their surface",
        ),
        (
            features.point_lights,
            "lamps",
            "light entities are points, not spheres; spotlights have the editor's falloff, and \
             cones of at most 180 degrees",
        ),
    ]
    .into_iter()
    .filter(|(applies, ..)| *applies)
    .map(|(_, what, why)| Reason {
        what,
        why: why.into(),
        visible: true,
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_is_y_and_quakes_forward_is_minus_z() {
        assert_eq!(axes() * DVec3::Z, DVec3::Y);
        assert_eq!(axes() * DVec3::X, DVec3::NEG_Z);
        assert_eq!(axes().determinant(), 1.0);
        // A place that is moved and then written is a place that is written and then moved.
        let moved = DAffine3::from_rotation_translation(
            glam::DQuat::from_rotation_z(0.7),
            DVec3::new(100.0, -50.0, 8.0),
        );
        let p = Vec3::new(3.0, 4.0, 5.0);
        let m = matrix(moved);
        let q = place(p);
        let after: DVec3 = DVec3::from_slice(&m[0..3]) * q.x
            + DVec3::from_slice(&m[4..7]) * q.y
            + DVec3::from_slice(&m[8..11]) * q.z
            + DVec3::from_slice(&m[12..15]);
        let before = axes() * moved.transform_point3(p.as_dvec3()) * METRES_PER_UNIT;
        assert!(after.distance(before) < 1e-12);
    }
}
