//! A scene in device memory: flat buffers, textures and acceleration structures.

mod emitters;
mod loose;
mod moment;
mod poses;

use crate::abi;
use crate::vk::{
    Blas, BlasInput, Buffer, Device, Error, Image, Location, Recording, Timing, Tlas, Usage,
};
use bytemuck::Zeroable;
use glam::{Affine3A, Vec3};
use scene::light::Falloff;
use scene::material::{Material, Surface};
use scene::mesh::{Mesh, Triangle};
use scene::sky::SkyKind;
use scene::{Features, Scene};
use std::sync::Arc;

/// A scene in device memory.
pub struct GpuScene {
    /// Address of the [`abi::SceneData`].
    pub(crate) address: u64,
    pub(crate) tlas: Arc<Tlas>,
    pub(crate) textures: Vec<Arc<Image>>,
    pub(crate) features: Features,
    pub(crate) sky: u32,
    /// Whether there are lists of lights by cell.
    pub(crate) has_cells: bool,
    /// Whether there is a tree over all lights.
    pub(crate) has_tree: bool,
    /// Bounds of all that is there.
    bounds: (Vec3, Vec3),
    /// GPU times of building and compacting the bottom-level structures and of the first top level.
    pub(crate) timings: Vec<Timing>,
    /// Bytes of all bottom-level structures.
    pub(crate) blas_bytes: u64,
    scene: Arc<Scene>,
    data: abi::SceneData,
    /// By mesh.
    parts: Vec<Part>,
    /// By mesh, the structures of those that are rigid and have triangles.
    blas: Vec<Option<Arc<Blas>>>,
    poses: Option<poses::Poses>,
    /// What emits on each mesh that moves, among the tables.
    lists: Vec<emitters::List>,
    /// Where source numbers by triangle begin: of each instance, or of the world and each list.
    source_starts: Vec<u32>,
    /// Triangles of all meshes, then room for loose ones.
    triangles: Arc<Buffer>,
    own_triangles: u32,
    loose: loose::Loose,
    /// What a moment changes.
    moment: Arc<Buffer>,
    _buffers: Vec<Arc<Buffer>>,
}

/// Where a mesh's parts lie in the scene's flat arrays.
struct Part {
    triangle_base: u32,
    first_see_through: u32,
    position_base: u64,
    index_base: u64,
    /// Bounds in all poses, local space.
    bounds: (Vec3, Vec3),
    /// First of its triangles in its first pose among those with normals, if it is shaded as round.
    first_normals: Option<u32>,
}

impl GpuScene {
    /// Uploads a scene and builds its acceleration structures.
    ///
    /// # Errors
    /// When the scene is larger than the device allows, or there is no memory.
    pub fn upload(device: &Arc<Device>, scene: &Arc<Scene>) -> Result<Self, Error> {
        let mut staging = Staging::default();
        let mut positions: Vec<[f32; 3]> = Vec::new();
        let mut indices: Vec<[u32; 3]> = Vec::new();
        let mut triangles: Vec<abi::Triangle> = Vec::with_capacity(scene.triangle_count());
        let mut normals: Vec<[u32; 3]> = Vec::new();
        let mut parts = Vec::with_capacity(scene.meshes.len());
        for mesh in &scene.meshes {
            parts.push(Part {
                triangle_base: triangles.len() as u32,
                first_see_through: mesh.first_see_through as u32,
                position_base: positions.len() as u64,
                index_base: indices.len() as u64,
                bounds: (mesh.positions.iter().chain(mesh.poses.iter().flatten()))
                    .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| {
                        (low.min(p), high.max(p))
                    }),
                first_normals: (!mesh.normals.is_empty()).then_some(normals.len() as u32),
            });
            normals.extend(packed_normals(mesh));
            positions.extend(mesh.positions.iter().map(Vec3::to_array));
            for t in &mesh.triangles {
                let t = wound(mesh, t);
                indices.push(t.vertices);
                triangles.push(triangle(&mesh.positions, &t, &Affine3A::IDENTITY));
            }
        }
        let total = scene.emitters.total_weight;
        let inv_total_weight = if total > 0.0 { 1.0 / total } else { 0.0 };
        let bases: Vec<u32> = parts.iter().map(|p| p.triangle_base).collect();
        let emitters = emitters::tables(scene, &bases);
        let suns: Vec<_> = (scene.sky.suns.iter())
            .map(|s| abi::Sun {
                direction: s.direction.to_array(),
                one_minus_cos: s.one_minus_cos,
                radiance: s.radiance.to_array(),
                probability: s.weight * inv_total_weight,
            })
            .collect();
        let materials: Vec<_> = scene.materials.iter().map(|m| material(m, scene)).collect();
        let finishes: Vec<_> = (scene.materials.iter())
            .map(|m| finish(&m.finish))
            .collect();
        let cell_nodes: Vec<_> = (scene.cells.nodes.iter())
            .map(|n| abi::CellNode {
                normal: n.normal.to_array(),
                distance: n.distance,
                front: n.children[0],
                back: n.children[1],
                padding: [0; 2],
            })
            .collect();
        let cells: Vec<_> = (scene.cells.cells.iter())
            .map(|c| abi::Cell {
                begin: c.begin,
                count: c.count,
            })
            .collect();
        let cell_entries: Vec<_> = (scene.cells.entries.iter())
            .map(|e| abi::CellEntry {
                emitter: e.emitter,
                probability: e.probability,
                keep: e.keep,
                other: e.other,
            })
            .collect();

        let own_triangles = triangles.len() as u32;
        let positions = staging.add(device, "positions", BUILD_INPUT, &positions)?;
        let indices = staging.add(device, "indices", BUILD_INPUT, &indices)?;
        let triangles = staging.add(device, "triangles", Usage::STORAGE_BUFFER, &triangles)?;
        let alias_buffer = staging.add(
            device,
            "alias table",
            Usage::STORAGE_BUFFER,
            &emitters.alias,
        )?;
        let sun_buffer = staging.add(device, "suns", Usage::STORAGE_BUFFER, &suns)?;
        let materials = staging.add(device, "materials", Usage::STORAGE_BUFFER, &materials)?;
        let finishes = staging.add(device, "finishes", Usage::STORAGE_BUFFER, &finishes)?;
        let normals = staging.add(device, "normals", Usage::STORAGE_BUFFER, &normals)?;
        let table = match scene.features.gloss {
            true => scene::gloss::table(),
            false => &[],
        };
        let gloss_table = staging.add(device, "gloss table", Usage::STORAGE_BUFFER, table)?;
        let baked = staging.add(
            device,
            "baked light",
            Usage::STORAGE_BUFFER,
            &baked_triangles(scene),
        )?;
        let no_samples = Vec::new();
        let samples = (scene.baked.as_ref()).map_or(&no_samples, |b| &b.samples);
        let baked_samples = staging.add(device, "baked samples", Usage::STORAGE_BUFFER, samples)?;
        let cell_nodes = staging.add(device, "cell nodes", Usage::STORAGE_BUFFER, &cell_nodes)?;
        let cells = staging.add(device, "cells", Usage::STORAGE_BUFFER, &cells)?;
        let cell_entries =
            staging.add(device, "cell lists", Usage::STORAGE_BUFFER, &cell_entries)?;
        let sums: Vec<abi::StyleSum> = (scene.light_sums.iter().flat_map(|s| &s.styles))
            .map(|s| abi::StyleSum {
                least: s.least.to_array(),
                brightness: s.brightness,
                first: s.first,
                count: s.count,
            })
            .collect();
        let of_materials = (scene.materials.iter()).map(|m| abi::StyleSum {
            least: m.least_light.to_array(),
            ..abi::StyleSum::zeroed()
        });
        let sum_count = sums.len() as u32;
        let sums: Vec<_> = match scene.features.light_sums {
            true => sums.into_iter().chain(of_materials).collect(),
            false => sums,
        };
        let style_sums = staging.add(device, "sums of light", Usage::STORAGE_BUFFER, &sums)?;
        let mut table = |name, data: &[u8]| staging.add(device, name, Usage::STORAGE_BUFFER, data);
        let emitter_list = table("emitters", bytemuck::cast_slice(&emitters.list))?;
        let sources = table("sources", bytemuck::cast_slice(&emitters.sources))?;
        let source_triangles = table(
            "emitting triangles",
            bytemuck::cast_slice(&emitters.triangles),
        )?;
        let maps = table("emission maps", bytemuck::cast_slice(&emitters.maps))?;
        let texel_tables = table("emitting texels", bytemuck::cast_slice(&emitters.texels))?;
        let tree = table("light tree", bytemuck::cast_slice(&emitters.tree))?;
        let light_bounds = table("light bounds", bytemuck::cast_slice(&emitters.bounds))?;
        let trails = table("trails", bytemuck::cast_slice(&scene.emitters.tree.trails))?;
        let emitter_numbers = table("emitter numbers", bytemuck::cast_slice(&emitters.numbers))?;
        let source_numbers = table(
            "source numbers",
            bytemuck::cast_slice(&emitters.source_numbers),
        )?;
        let source_indices = table(
            "emitting triangles' numbers",
            bytemuck::cast_slice(&emitters.triangle_numbers),
        )?;
        let mut data = abi::SceneData {
            triangles: triangles.address(),
            materials: materials.address(),
            finishes: finishes.address(),
            normals: normals.address(),
            gloss_table: gloss_table.address(),
            emitters: emitter_list.address(),
            sources: sources.address(),
            source_triangles: source_triangles.address(),
            maps: maps.address(),
            texel_tables: texel_tables.address(),
            tree: tree.address(),
            trails: trails.address(),
            light_bounds: light_bounds.address(),
            source_numbers: source_numbers.address(),
            source_indices: source_indices.address(),
            alias: alias_buffer.address(),
            suns: sun_buffer.address(),
            baked: baked.address(),
            baked_samples: baked_samples.address(),
            cell_nodes: cell_nodes.address(),
            cells: cells.address(),
            cell_entries: cell_entries.address(),
            emitter_numbers: emitter_numbers.address(),
            style_sums: style_sums.address(),
            sum_count,
            light_gamma: scene.light_sums.as_ref().map_or(1.0, |s| s.gamma),
            cell_fallback: scene::cells::FALLBACK,
            emitter_count: scene.emitters.list.len() as u32,
            entry_count: scene.emitters.alias.len() as u32,
            sun_count: suns.len() as u32,
            first_sun: (scene.emitters.list.len() + scene.lights.len()) as u32,
            baked_count: own_triangles,
            sky_upper: scene.sky.scale[0].to_array(),
            sky_lower: scene.sky.scale[1].to_array(),
            veil_upper: scene.sky.veil[0].to_array(),
            veil_lower: scene.sky.veil[1].to_array(),
            fog_albedo: scene.fog.map_or([0.0; 3], |f| f.albedo.to_array()),
            fog_extinction: scene.fog.map_or(0.0, |f| f.extinction),
            ..abi::SceneData::zeroed()
        };
        let sky = match scene.sky.kind {
            SkyKind::None => abi::SKY_NONE,
            SkyKind::Flat(radiance) => {
                data.sky_radiance = radiance.to_array();
                abi::SKY_FLAT
            }
            SkyKind::Box(first) => {
                data.sky_back = first.0;
                abi::SKY_BOX
            }
            SkyKind::Scrolling { back, front } => {
                (data.sky_back, data.sky_front) = (back.0, front.0);
                abi::SKY_SCROLLING
            }
        };
        let textures = staging.add_textures(device, scene)?;
        staging.submit(device)?;

        let once = scene.features.translucent;
        let is_rigid = |mesh: &Mesh| mesh.poses.is_empty() && !mesh.triangles.is_empty();
        let inputs: Vec<_> = (scene.meshes.iter().zip(&parts))
            .filter(|(mesh, _)| is_rigid(mesh))
            .map(|(mesh, part)| blas_input(mesh, part, &positions, &indices, once))
            .collect();
        let (built, timings) = Blas::build(device, &inputs)?;
        let poses = poses::Poses::new(device, &scene.meshes, once)?;
        let blas_bytes = built.iter().map(|b| b.size()).sum::<u64>()
            + poses.as_ref().map_or(0, poses::Poses::model_bytes);
        let mut built = built.into_iter();
        let blas = (scene.meshes.iter())
            .map(|mesh| is_rigid(mesh).then(|| built.next()).flatten())
            .collect();
        let mut gpu_scene = Self {
            address: 0,
            tlas: Tlas::new(device, scene.instances.len().max(1) as u32)?,
            textures,
            features: scene.features,
            sky,
            has_cells: !scene.cells.is_empty(),
            has_tree: !scene.emitters.tree.nodes.is_empty(),
            bounds: (scene.bounds_min, scene.bounds_max),
            timings,
            blas_bytes,
            scene: scene.clone(),
            data,
            parts,
            blas,
            poses,
            lists: emitters.lists,
            source_starts: emitters.source_starts,
            triangles,
            own_triangles,
            loose: loose::Loose::default(),
            moment: Buffer::new(device, "moment", 0, Usage::STORAGE_BUFFER, Location::Device)?,
            _buffers: vec![
                emitter_list,
                sources,
                source_triangles,
                source_indices,
                maps,
                texel_tables,
                tree,
                trails,
                light_bounds,
                source_numbers,
                alias_buffer,
                sun_buffer,
                style_sums,
                baked,
                baked_samples,
                materials,
                finishes,
                normals,
                gloss_table,
                cell_nodes,
                cells,
                cell_entries,
                emitter_numbers,
            ],
        };
        let mut recording = Recording::begin(device)?;
        gpu_scene.record_moment(&mut recording, &Self::first_moment(scene), [1; 2])?;
        (gpu_scene.timings).extend(recording.submit_and_wait()?);
        Ok(gpu_scene)
    }

    /// The scene.
    pub(crate) fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The material whose absorption fills the space at `eye`, or [`abi::NO_MEDIUM`].
    pub(crate) fn medium_at(&self, eye: Vec3) -> u32 {
        self.scene.media.at(eye).map_or(abi::NO_MEDIUM, |m| m.0)
    }

    /// A length no ray inside the scene, seen from `eye`, can exceed.
    pub(crate) fn longest_ray(&self, eye: Vec3) -> f32 {
        let (min, max) = (self.bounds.0.min(eye), self.bounds.1.max(eye));
        (max - min).length() * 1.01 + 1.0
    }
}

/// Normals of a mesh's triangles in all poses, each with its corners in the order of [`wound`].
fn packed_normals(mesh: &Mesh) -> impl Iterator<Item = [u32; 3]> + '_ {
    (mesh.normals.iter()).flat_map(|pose| {
        pose.iter().zip(&mesh.triangles).map(|(normals, t)| {
            let [a, b, c] = normals.map(|n| n.0);
            if wound(mesh, t).vertices == t.vertices {
                [a, b, c]
            } else {
                [a, c, b]
            }
        })
    })
}

/// The triangle with its corners counter-clockwise about its normal: in slivers the order of the
/// corners, rounded as they are, can disagree with the plane, and shaders take the side from it. In
/// meshes with poses the corners say where the front is.
fn wound(mesh: &Mesh, t: &Triangle) -> Triangle {
    if !mesh.poses.is_empty() {
        return *t;
    }
    let [a, b, c] = t.vertices.map(|v| mesh.positions[v as usize].as_dvec3());
    if (b - a).cross(c - a).dot(t.normal.as_dvec3()) >= 0.0 {
        return *t;
    }
    let ([v0, v1, v2], [uv0, uv1, uv2]) = (t.vertices, t.uv);
    Triangle {
        vertices: [v0, v2, v1],
        uv: [uv0, uv2, uv1],
        ..*t
    }
}

const BUILD_INPUT: Usage = Usage::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR;

fn blas_input(
    mesh: &Mesh,
    part: &Part,
    positions: &Arc<Buffer>,
    indices: &Arc<Buffer>,
    once: bool,
) -> BlasInput {
    BlasInput {
        name: format!("BLAS {}", mesh.name),
        positions: positions.clone(),
        position_offset: part.position_base * size_of::<[f32; 3]>() as u64,
        position_count: mesh.positions.len().max(1) as u32,
        indices: Some((
            indices.clone(),
            part.index_base * size_of::<[u32; 3]>() as u64,
        )),
        geometries: poses::geometries(part.first_see_through, mesh.triangles.len() as u32, once),
    }
}

/// The record of a triangle of a mesh with vertices at `positions`.
fn triangle(positions: &[Vec3], t: &Triangle, transform: &Affine3A) -> abi::Triangle {
    let corner = |i: usize| {
        transform
            .transform_point3(positions[t.vertices[i] as usize])
            .to_array()
    };
    // The cofactor matrix, with the sign of the determinant, keeps the normal on its side under
    // any transform, mirrors included.
    let [x, y, z] = [
        transform.matrix3.x_axis,
        transform.matrix3.y_axis,
        transform.matrix3.z_axis,
    ];
    let n = y.cross(z) * t.normal.x + z.cross(x) * t.normal.y + x.cross(y) * t.normal.z;
    let n = n * x.cross(y).dot(z).signum();
    abi::Triangle {
        p0: corner(0),
        material: t.material.0,
        p1: corner(1),
        face: t.face,
        p2: corner(2),
        normal: Vec3::from(n).normalize_or_zero().to_array(),
        uv0: t.uv[0],
        uv1: t.uv[1],
        uv2: t.uv[2],
    }
}

/// An instance's record without the indices of its triangles.
fn placement(transform: &Affine3A) -> abi::Instance {
    let (m, t) = (transform.matrix3, transform.translation);
    let row = |i: usize| [m.x_axis[i], m.y_axis[i], m.z_axis[i], t[i]];
    abi::Instance {
        row0: row(0),
        row1: row(1),
        row2: row(2),
        ..abi::Instance::zeroed()
    }
}

fn material(m: &Material, scene: &Scene) -> abi::Material {
    let base = &scene.textures[m.base.0 as usize];
    let mut flags = 0;
    let mut set = |on: bool, flag: u32| flags |= if on { flag } else { 0 };
    set(m.two_sided, abi::MATERIAL_TWO_SIDED);
    set(m.warped, abi::MATERIAL_WARPED);
    set(m.surface == Surface::Sky, abi::MATERIAL_SKY);
    set(m.emission.is_some(), abi::MATERIAL_EMISSIVE);
    set(m.finish.alpha < 1.0, abi::MATERIAL_TRANSLUCENT);
    set(m.finish.gloss.is_some(), abi::MATERIAL_GLOSSY);
    set(m.finish.normals.is_some(), abi::MATERIAL_BUMPED);
    abi::Material {
        base: m.base.0,
        emission: m.emission.map_or(0, |t| t.0),
        emission_scale: m.emission_scale,
        emission_weight: m.emission_weight,
        flags,
        width: base.width,
        height: base.height,
        padding: 0,
    }
}

fn finish(f: &scene::Finish) -> abi::Finish {
    let texture = |id: Option<scene::TextureId>| id.map_or(abi::NO_TEXTURE, |t| t.0);
    abi::Finish {
        tint: f.tint.to_array(),
        alpha: f.alpha,
        absorption: f.absorption.to_array(),
        ior: f.ior,
        roughness: f.gloss.map_or(1.0, |g| g.roughness),
        metallic: f.gloss.map_or(0.0, |g| g.metallic),
        specular: f.gloss.map_or(0.0, |g| g.specular),
        roughness_map: texture(f.gloss.and_then(|g| g.roughness_map)),
        normals: texture(f.normals),
        padding: [0.0; 3],
    }
}

/// The record of a point light that is chosen with this probability.
fn light(l: &scene::PointLight, probability: f32) -> abi::Light {
    let (mut direction, cos_inner, cos_outer) = match l.spot {
        Some(spot) => (spot.direction, spot.cos_inner, spot.cos_outer),
        None => (Vec3::Z, -2.0, -2.0),
    };
    let (falloff, falloff_scale) = match l.compiler.map(|c| c.falloff) {
        Some(Falloff::Linear { reach }) => (abi::FALLOFF_LINEAR, 1.0 / reach),
        Some(Falloff::Inverse { scale }) => (abi::FALLOFF_INVERSE, scale),
        Some(Falloff::InverseSquare { scale }) => (abi::FALLOFF_INVERSE_SQUARE, scale),
        Some(Falloff::InverseSquareShifted { scale }) => (abi::FALLOFF_SHIFTED, scale),
        Some(Falloff::Sun(along)) => {
            direction = along;
            (abi::FALLOFF_SUN, 0.0)
        }
        Some(Falloff::Least) => (abi::FALLOFF_LEAST, 0.0),
        Some(Falloff::Constant) | None => (abi::FALLOFF_CONSTANT, 0.0),
    };
    let angle_scale = l.compiler.map_or(1.0, |c| c.angle_scale);
    abi::Light {
        position: l.position.to_array(),
        radius: l.radius,
        intensity: l.intensity.to_array(),
        probability,
        direction: direction.to_array(),
        cos_inner,
        cos_outer,
        falloff,
        falloff_scale,
        angle_scale,
    }
}

/// The grids of baked light in the order of the flat triangles, corners as [`wound`] has them.
fn baked_triangles(scene: &Scene) -> Vec<abi::BakedTriangle> {
    let Some(baked) = &scene.baked else {
        return Vec::new();
    };
    (scene.meshes.iter().zip(&baked.meshes))
        .flat_map(|(mesh, grids)| {
            mesh.triangles
                .iter()
                .zip(grids)
                .map(move |(t, grid)| (mesh, t, grid))
        })
        .map(|(mesh, t, grid)| {
            let [uv0, uv1, uv2] = wound(mesh, &Triangle { uv: grid.uv, ..*t }).uv;
            abi::BakedTriangle {
                first: grid.first,
                width: grid.width,
                height: grid.height,
                uv0,
                uv1,
                uv2,
            }
        })
        .collect()
}

/// Copies from host to device memory, collected into one submission.
#[derive(Default)]
struct Staging {
    buffers: Vec<(Arc<Buffer>, Arc<Buffer>, u64)>,
    texels: Option<Arc<Buffer>>,
    images: Vec<(u64, Arc<Image>)>,
}

impl Staging {
    fn add<T: bytemuck::NoUninit>(
        &mut self,
        device: &Arc<Device>,
        name: &str,
        usage: Usage,
        data: &[T],
    ) -> Result<Arc<Buffer>, Error> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let size = bytes.len() as u64;
        let buffer = Buffer::new(device, name, size, usage, Location::Device)?;
        if size > 0 {
            let from = Buffer::with_data(device, name, Usage::empty(), bytes)?;
            self.buffers.push((from, buffer.clone(), size));
        }
        Ok(buffer)
    }

    fn add_textures(
        &mut self,
        device: &Arc<Device>,
        scene: &Scene,
    ) -> Result<Vec<Arc<Image>>, Error> {
        let mut texels: Vec<u8> = Vec::new();
        for texture in &scene.textures {
            let image = Image::new(device, &texture.name, texture.width, texture.height)?;
            self.images.push((texels.len() as u64, image));
            texels.extend_from_slice(bytemuck::cast_slice(&texture.rgba));
        }
        if self.images.is_empty() {
            // A descriptor array of no length is not allowed.
            self.images
                .push((0, Image::new(device, "no texture", 1, 1)?));
            texels.extend_from_slice(&[255; 4]);
        }
        self.texels = Some(Buffer::with_data(
            device,
            "texels",
            Usage::empty(),
            &texels,
        )?);
        Ok(self.images.iter().map(|(_, image)| image.clone()).collect())
    }

    fn submit(self, device: &Arc<Device>) -> Result<(), Error> {
        let mut recording = Recording::begin(device)?;
        for (from, to, size) in &self.buffers {
            recording.copy(from, to, (0, 0), *size);
        }
        if let Some(texels) = &self.texels {
            for (offset, image) in &self.images {
                recording.upload_image(texels, *offset, image);
            }
        }
        recording.submit_and_wait()?;
        Ok(())
    }
}
