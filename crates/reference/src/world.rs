//! A scene made ready for rays: one set of triangles in world space, and what is at a hit.

use crate::Error;
use crate::bsdf::{Bsdf, GlossHere};
use crate::bvh::{Bvh, Hit, MAX_TRIANGLES, Stack};
use crate::passage::{Depth, eval_passage};
use crate::shading::{point_error, spawn_origin, srgb_to_linear, texel_index, warp};
use crate::triangle::{PackedTriangle, Ray};
use glam::{DMat2, DMat3, DVec2, DVec3, Vec3};
use scene::baked::{BakedLight, BakedTriangle};
use scene::cells::{self, CELL, CellNode, LightCells};
use scene::emitter::tree::LEAF;
use scene::emitter::{Emitters, LightTree, NO_EMITTER, Numbering, Shape};
use scene::material::{MAX_ALBEDO, WARP_TILE};
use scene::sky::SkyKind;
use scene::{Instance, Material, Scene, Surface, Texture, TextureId, Triangle};
use std::cell::Cell;
use std::sync::Arc;

/// Least part of a normal in a picture that points away from the face.
const LEAST_RISE: f64 = 0.05;

/// The scene with its triangles flattened.
#[derive(Debug)]
pub(crate) struct World {
    pub scene: Arc<Scene>,
    pub bvh: Bvh,
    /// Level time in seconds.
    pub time: f64,
    /// By slot, what the test of the ray does not need.
    infos: Vec<TriangleInfo>,
    /// By index into `Emitters::sources`, the slot.
    pub source_slots: Vec<u32>,
    /// By slot, the index into `Emitters::sources`; [`NO_EMITTER`] if it does not emit.
    sources: Vec<u32>,
    /// By slot, the grid of baked light; empty if the scene has none.
    baked: Vec<BakedTriangle>,
    /// `srgb_to_linear` of each byte.
    linear: [f64; 256],
}

/// What a triangle looks like, in world space.
#[derive(Clone, Copy, Debug)]
struct TriangleInfo {
    /// Unit normal to the front.
    normal: DVec3,
    /// Bound of the error of a point on it, world units.
    error: f64,
    uv: [[f32; 2]; 3],
    material: u32,
    face: u32,
    /// Corners are clockwise seen from the front: a mirrored instance, or a sliver whose winding
    /// was lost to rounding.
    clockwise: bool,
}

/// A point on a surface, seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint<'a> {
    /// World space.
    pub position: DVec3,
    /// Unit normal to the front.
    pub normal: DVec3,
    /// Whether it is seen from the front.
    pub front: bool,
    /// Bound of the position's error, world units.
    pub error: f64,
    pub material: &'a Material,
    /// Texture coordinates as stored: texels, or world units if the material is warped.
    pub uv: DVec2,
    /// The level's number of the face.
    pub face: u32,
    /// Place of its triangle in the hierarchy.
    slot: u32,
    /// Barycentric weights in the triangle.
    pub weights: [f64; 3],
    /// Area of the triangle, square world units.
    pub area: f64,
    /// Its area in texture coordinates.
    pub uv_area: f64,
    /// Its number among `Emitters::sources`, or [`NO_EMITTER`].
    pub source: u32,
    /// Baked light; 1 if the scene has none.
    baked: DVec3,
}

impl SurfacePoint<'_> {
    /// The normal on the side the point is seen from.
    pub fn facing_normal(&self) -> DVec3 {
        if self.front {
            self.normal
        } else {
            -self.normal
        }
    }

    /// Where rays to that side start.
    pub fn spawn_origin(&self) -> DVec3 {
        spawn_origin(self.position, self.facing_normal(), self.error)
    }
}

impl World {
    /// Places every instance's triangles in the world and builds the hierarchy over them.
    pub fn new(scene: Arc<Scene>, time: f64) -> Result<Self, Error> {
        check(&scene)?;
        let count = scene.triangle_count();
        let mut packed = Vec::with_capacity(count);
        let mut infos = Vec::with_capacity(count);
        let mut instance_starts = Vec::with_capacity(scene.instances.len());
        for instance in &scene.instances {
            instance_starts.push(packed.len());
            place(&scene, instance, &mut packed, &mut infos)?;
        }
        let (bvh, order) = Bvh::build(&packed);
        let infos = order.iter().map(|&i| infos[i as usize]).collect();
        let baked = (scene.baked.as_ref()).map_or_else(Vec::new, |baked| {
            let placed: Vec<BakedTriangle> = (scene.instances.iter())
                .flat_map(|i| baked.meshes[i.mesh].iter().copied())
                .collect();
            order.iter().map(|&i| placed[i as usize]).collect()
        });
        let mut slots = vec![0; count];
        for (slot, &index) in order.iter().enumerate() {
            slots[index as usize] = slot as u32;
        }
        let source_slots: Vec<u32> = (scene.emitters.sources.iter())
            .map(|t| slots[instance_starts[t.instance as usize] + t.triangle as usize])
            .collect();
        let mut sources = vec![NO_EMITTER; count];
        for (number, &slot) in source_slots.iter().enumerate() {
            sources[slot as usize] = number as u32;
        }
        Ok(Self {
            bvh,
            time,
            infos,
            source_slots,
            sources,
            baked,
            linear: std::array::from_fn(|i| srgb_to_linear(i as u8)),
            scene,
        })
    }

    /// The nearest surface along a ray. Of those that light passes through, the nearest beyond
    /// `passed`: the ray has passed all before.
    pub fn closest_hit(&self, ray: &Ray, passed: f64, stack: &mut Stack) -> Option<Hit> {
        (self.bvh).closest_hit(ray, f64::INFINITY, stack, |hit| {
            hit.at.t > passed && !self.is_hole(hit)
        })
    }

    /// What of the light from one point arrives at another, whose space has this absorption.
    pub fn transmittance(
        &self,
        absorption: DVec3,
        from: DVec3,
        to: DVec3,
        stack: &mut Stack,
    ) -> DVec3 {
        let distance = from.distance(to);
        let ray = Ray::new(from, (to - from) / distance);
        let passed = Cell::new((DVec3::ONE, Depth::new(absorption)));
        let is_blocked = (self.bvh).any_hit(&ray, distance, stack, |hit| {
            let info = &self.infos[hit.slot as usize];
            let finish = &self.scene.materials[info.material as usize].finish;
            if self.is_hole(hit) {
                return false;
            }
            if finish.alpha >= 1.0 {
                return true;
            }
            let (mut surfaces, mut depth) = passed.get();
            surfaces *= eval_passage(finish, info.normal.dot(ray.direction).abs());
            depth.pass(finish, self.is_front(hit), hit.at.t);
            passed.set((surfaces, depth));
            false
        });
        if is_blocked {
            return DVec3::ZERO;
        }
        let (surfaces, depth) = passed.get();
        surfaces * depth.transmittance(distance)
    }

    /// Absorption of what fills the space at a point, per world unit.
    pub fn absorption_at(&self, point: DVec3) -> DVec3 {
        let material = self.scene.media.at(point.as_vec3());
        material.map_or(DVec3::ZERO, |id| {
            self.scene.materials[id.0 as usize]
                .finish
                .absorption
                .as_dvec3()
        })
    }

    /// Whether a triangle is seen from its front.
    fn is_front(&self, hit: &Hit) -> bool {
        // By the sign of the determinant that decided the hit, not by `dot(n, wo)`: the two differ
        // where a ray grazes a triangle whose rounded corners are a hair off its plane, and there
        // only this one keeps the path on the side it came from.
        hit.at.counter_clockwise != self.infos[hit.slot as usize].clockwise
    }

    /// What is at a hit.
    pub fn surface_point(&self, hit: &Hit) -> SurfacePoint<'_> {
        self.point_on(hit.slot, hit.at.weights, self.is_front(hit))
    }

    /// Texture coordinates of a triangle's corners.
    pub fn uv_of(&self, slot: u32) -> [DVec2; 3] {
        corners_uv(&self.infos[slot as usize].uv)
    }

    /// The point of a triangle with these barycentric weights.
    pub fn point_on(&self, slot: u32, weights: [f64; 3], front: bool) -> SurfacePoint<'_> {
        let info = &self.infos[slot as usize];
        let [a, b, c] = self.bvh.triangle(slot).corners();
        SurfacePoint {
            position: a * weights[0] + b * weights[1] + c * weights[2],
            normal: info.normal,
            front,
            error: info.error,
            material: &self.scene.materials[info.material as usize],
            uv: interpolate_uv(&info.uv, weights),
            face: info.face,
            slot,
            weights,
            area: (b - a).cross(c - a).length() / 2.0,
            uv_area: uv_area(&info.uv),
            source: self.sources[slot as usize],
            baked: self.baked_light(slot, weights),
        }
    }

    /// Baked light at a point of a triangle: bilinear between the samples, constant beyond them.
    fn baked_light(&self, slot: u32, weights: [f64; 3]) -> DVec3 {
        let (Some(grid), Some(baked)) = (self.baked.get(slot as usize), &self.scene.baked) else {
            return DVec3::ONE;
        };
        let at = interpolate_uv(&grid.uv, weights);
        let axis = |at: f64, count: u32| {
            let at = at.clamp(0.0, f64::from(count - 1));
            let low = at.floor();
            let next = (low as u32 + 1).min(count - 1);
            (low as u32, next, at - low)
        };
        let ((x0, x1, fx), (y0, y1, fy)) = (axis(at.x, grid.width), axis(at.y, grid.height));
        let sample = |x: u32, y: u32| {
            let index = grid.first as usize + y as usize * grid.width as usize + x as usize;
            DVec3::from(baked.samples[index].map(f64::from))
        };
        let row = |y| sample(x0, y).lerp(sample(x1, y), fx);
        row(y0).lerp(row(y1), fy)
    }

    /// Radiance that leaves a point towards where it is seen from, but for that of suns; `direction`
    /// is the view's direction to the point.
    pub fn emitted(&self, point: &SurfacePoint<'_>, direction: DVec3) -> DVec3 {
        let material = point.material;
        if material.surface == Surface::Sky {
            return self.sky_radiance(direction);
        }
        let Some(id) = material.emission else {
            return DVec3::ZERO;
        };
        // Light sampling can choose a point in a hole; rays never end there.
        let shines = point.front || material.two_sided;
        if !shines
            || (material.alpha_tested && self.texel(material.base, material, point.uv)[3] == 0)
        {
            return DVec3::ZERO;
        }
        let texel = self.texel(id, material, point.uv);
        let emitted = self.decode(texel) * f64::from(material.emission_scale);
        if self.baked.is_empty() || texel[3] == 0 {
            emitted
        } else {
            emitted * point.baked
        }
    }

    /// Share of light that a surface reflects; none for the sky.
    pub fn albedo(&self, point: &SurfacePoint<'_>) -> DVec3 {
        if point.material.surface == Surface::Sky {
            return DVec3::ZERO;
        }
        self.decode(self.texel(point.material.base, point.material, point.uv))
            .min(DVec3::splat(f64::from(MAX_ALBEDO)))
    }

    /// How a point of this albedo scatters light towards `wo`.
    pub fn bsdf(&self, point: &SurfacePoint<'_>, albedo: DVec3, wo: DVec3) -> Bsdf {
        let material = point.material;
        let texel = |id: TextureId| self.texel(id, material, point.uv);
        let gloss = material.finish.gloss.map(|gloss| GlossHere {
            roughness: f64::from(gloss.roughness)
                * (gloss.roughness_map).map_or(1.0, |id| f64::from(texel(id)[0]) / 255.0),
            metallic: f64::from(gloss.metallic),
            specular: f64::from(gloss.specular),
        });
        let face = point.facing_normal();
        let bent = material.finish.normals.and_then(|id| {
            let [x, y, z, _] = texel(id).map(|byte| (f64::from(byte) - 128.0) / 127.0);
            self.along_texture(point, DVec3::new(x, -y, z.max(LEAST_RISE)))
        });
        let normal = bent.map_or(face, |n| if point.front { n } else { -n });
        Bsdf::new(albedo, gloss, face, normal, wo)
    }

    /// A unit vector along `u`, `v` and the normal of a point's triangle, in world space; `None` if
    /// its texture coordinates span nothing.
    fn along_texture(&self, point: &SurfacePoint<'_>, v: DVec3) -> Option<DVec3> {
        let [a, b, c] = self.bvh.triangle(point.slot).corners();
        let [p, q, r] = self.uv_of(point.slot);
        let (uv, wx) = (DMat2::from_cols(q - p, r - p), [b - a, c - a]);
        if uv.determinant() == 0.0 {
            return None;
        }
        // Rows: how the corners' weights change along u and along v.
        let inverse = uv.inverse();
        let [along, down] = [inverse.x_axis, inverse.y_axis].map(|w| {
            let direction = wx[0] * w.x + wx[1] * w.y;
            (direction - point.normal * direction.dot(point.normal)).try_normalize()
        });
        (along? * v.x + down? * v.y + point.normal * v.z).try_normalize()
    }

    fn is_hole(&self, hit: &Hit) -> bool {
        let info = &self.infos[hit.slot as usize];
        let material = &self.scene.materials[info.material as usize];
        if !material.alpha_tested {
            return false;
        }
        let uv = interpolate_uv(&info.uv, hit.at.weights);
        self.texel(material.base, material, uv)[3] == 0
    }

    /// The texel of a texture of `material` at stored coordinates.
    fn texel(&self, id: TextureId, material: &Material, uv: DVec2) -> [u8; 4] {
        let texture = self.texture(id);
        let uv = if material.warped {
            DVec2::from(warp(uv.to_array(), self.time)) / WARP_TILE * size(texture)
        } else {
            uv
        };
        texture.rgba[texel_index(texture, uv)]
    }

    pub fn texture(&self, id: TextureId) -> &Texture {
        &self.scene.textures[id.0 as usize]
    }

    /// Linear RGB of a texel.
    pub fn decode(&self, texel: [u8; 4]) -> DVec3 {
        let [r, g, b, _] = texel.map(|byte| self.linear[usize::from(byte)]);
        DVec3::new(r, g, b)
    }
}

pub(crate) fn size(texture: &Texture) -> DVec2 {
    DVec2::new(f64::from(texture.width), f64::from(texture.height))
}

fn corners_uv(uv: &[[f32; 2]; 3]) -> [DVec2; 3] {
    uv.map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)))
}

/// Area of a triangle in texture coordinates.
fn uv_area(uv: &[[f32; 2]; 3]) -> f64 {
    let [a, b, c] = corners_uv(uv);
    (b - a).perp_dot(c - a).abs() / 2.0
}

fn interpolate_uv(uv: &[[f32; 2]; 3], weights: [f64; 3]) -> DVec2 {
    let [a, b, c] = corners_uv(uv);
    a * weights[0] + b * weights[1] + c * weights[2]
}

/// Adds the triangles of an instance.
fn place(
    scene: &Scene,
    instance: &Instance,
    packed: &mut Vec<PackedTriangle>,
    infos: &mut Vec<TriangleInfo>,
) -> Result<(), Error> {
    let mesh = &scene.meshes[instance.mesh];
    let matrix = DMat3::from_cols(
        instance.transform.matrix3.x_axis.as_dvec3(),
        instance.transform.matrix3.y_axis.as_dvec3(),
        instance.transform.matrix3.z_axis.as_dvec3(),
    );
    let translation = Vec3::from(instance.transform.translation).as_dvec3();
    let normal_matrix = matrix.inverse().transpose();
    // Rounded to f32 once per vertex, so that neighbours still share it.
    let positions: Vec<Vec3> = (mesh.positions.iter())
        .map(|p| (matrix * p.as_dvec3() + translation).as_vec3())
        .collect();
    if !positions.iter().all(|p| p.is_finite()) {
        return Err(Error::InvalidScene("a vertex is not finite"));
    }
    let extent = (positions.iter())
        .map(|p| f64::from(p.abs().max_element()))
        .fold(1.0, f64::max);
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let corners = triangle.vertices.map(|v| positions[v as usize]);
        packed.push(PackedTriangle::new(
            corners.map(|p| p.to_array()),
            i >= mesh.first_alpha_tested,
        ));
        let points = corners.map(Vec3::as_dvec3);
        infos.push(info(triangle, points, normal_matrix, extent));
    }
    Ok(())
}

fn info(
    triangle: &Triangle,
    points: [DVec3; 3],
    normal_matrix: DMat3,
    extent: f64,
) -> TriangleInfo {
    let wound = (points[1] - points[0]).cross(points[2] - points[0]);
    let fallback = wound.normalize_or(DVec3::Z);
    let normal = (normal_matrix * triangle.normal.as_dvec3()).normalize_or(fallback);
    TriangleInfo {
        normal,
        error: point_error(points, extent),
        uv: triangle.uv,
        material: triangle.material.0,
        face: triangle.face,
        clockwise: wound.dot(normal) < 0.0,
    }
}

/// Checks every index once, so that nothing after this can be out of range.
fn check(scene: &Scene) -> Result<(), Error> {
    let ensure = |ok: bool, what| {
        if ok {
            Ok(())
        } else {
            Err(Error::InvalidScene(what))
        }
    };
    let texture_exists = |id: TextureId| (id.0 as usize) < scene.textures.len();
    ensure(
        scene.textures.iter().all(|t| {
            !t.rgba.is_empty() && t.rgba.len() as u64 == u64::from(t.width) * u64::from(t.height)
        }),
        "a texture's size does not match its texels",
    )?;
    ensure(
        scene.materials.iter().all(|m| {
            let roughness = m.finish.gloss.and_then(|g| g.roughness_map);
            let others = [m.emission, m.finish.normals, roughness];
            texture_exists(m.base) && others.into_iter().flatten().all(texture_exists)
        }),
        "a material's texture does not exist",
    )?;
    let sky_textures = match scene.sky.kind {
        SkyKind::None | SkyKind::Flat(_) => vec![],
        SkyKind::Scrolling { back, front } => vec![back, front],
        SkyKind::Box(first) => (0..6)
            .map(|i| TextureId(first.0.saturating_add(i)))
            .collect(),
    };
    ensure(
        sky_textures.into_iter().all(texture_exists),
        "a texture of the sky does not exist",
    )?;
    ensure(
        scene.meshes.iter().all(|mesh| {
            mesh.triangles.iter().all(|t| {
                (t.material.0 as usize) < scene.materials.len()
                    && t.vertices
                        .iter()
                        .all(|&v| (v as usize) < mesh.positions.len())
            })
        }),
        "a triangle's vertex or material does not exist",
    )?;
    ensure(
        scene.instances.iter().all(|i| i.mesh < scene.meshes.len()),
        "an instance's mesh does not exist",
    )?;
    ensure(
        scene.triangle_count() <= MAX_TRIANGLES,
        "it has more than 2^27 triangles",
    )?;
    ensure(
        (scene.media.nodes.iter().flat_map(|n| n.children))
            .all(|child| child & CELL == 0 || ((child & !CELL) as usize) <= scene.materials.len()),
        "a medium's material does not exist",
    )?;
    let emitters = &scene.emitters;
    ensure(
        emitters.sources.iter().all(|t| {
            (scene.instances.get(t.instance as usize))
                .is_some_and(|i| (t.triangle as usize) < scene.meshes[i.mesh].triangles.len())
        }),
        "an emitter's triangle does not exist",
    )?;
    ensure(
        emitters_are_valid(emitters),
        "an emitter's texels or its number do not exist",
    )?;
    let entries = emitters.list.len() + scene.lights.len() + scene.sky.suns.len();
    ensure(
        emitters.alias.len() == entries
            && emitters
                .alias
                .iter()
                .all(|&(_, other)| (other as usize) < entries),
        "the emitters' alias table does not fit the emitters",
    )?;
    ensure(
        scene
            .sky
            .suns
            .iter()
            .all(|s| s.one_minus_cos > 0.0 && s.one_minus_cos <= 1.0),
        "a sun is not between a point and half of the sky",
    )?;
    ensure(
        scene.baked.as_ref().is_none_or(|b| baked_fits(scene, b)),
        "the baked light does not fit the meshes",
    )?;
    ensure(
        cells_fit(scene),
        "the cells' lists of lights do not fit the scene",
    )
}

/// Whether every emitter has its triangles and texels, and every triangle its emitters.
fn emitters_are_valid(emitters: &Emitters) -> bool {
    let Emitters {
        list,
        sources,
        numbers,
        maps,
        ..
    } = emitters;
    let maps_are_whole = maps.iter().all(|m| {
        let (w, h) = (m.width as usize, m.height as usize);
        let labels_exist = (m.labels.iter()).all(|&l| l as usize <= m.rectangles.len());
        m.labels.len() == w * h && m.sums.len() == (w + 1) * (h + 1) && labels_exist
    });
    let fits = |[x0, y0, x1, y1]: [u32; 4], map: usize| {
        x0 <= x1
            && y0 <= y1
            && maps
                .get(map)
                .is_some_and(|m| x1 <= m.width && y1 <= m.height)
    };
    let listed = list.iter().all(|e| {
        let last = (e.first_source as usize).saturating_add(e.sources as usize);
        let shape = match e.shape {
            Shape::Texels { map, rectangle, .. } => fits(rectangle, map as usize),
            Shape::Part { divisions, .. } => divisions > 0 && e.sources == 1,
        };
        last <= sources.len() && shape
    });
    let numbered = sources.iter().all(|s| match s.numbering {
        Numbering::Parts { divisions, first } => {
            divisions > 0 && first as usize + divisions.pow(2) as usize <= list.len()
        }
        Numbering::Texels {
            map, tiles, table, ..
        } => {
            let rectangles = maps.get(map as usize).map_or(0, |m| m.rectangles.len());
            let places = tiles[0] as usize * tiles[1] as usize * rectangles;
            places > 0 && table as usize + places <= numbers.len()
        }
    });
    let exist = |&n: &u32| n == NO_EMITTER || (n as usize) < list.len();
    tree_is_valid(&emitters.tree, emitters.alias.len())
        && maps_are_whole
        && listed
        && numbered
        && numbers.iter().all(exist)
}

/// Whether every way down the tree ends in a light, where its trail leads.
fn tree_is_valid(tree: &LightTree, lights: usize) -> bool {
    let nodes = &tree.nodes;
    let children_follow = nodes.iter().enumerate().all(|(i, n)| {
        let child = (n.child & !LEAF) as usize;
        match n.child & LEAF {
            0 => child > i + 1 && child < nodes.len(),
            _ => child < lights,
        }
    });
    children_follow && (nodes.is_empty() || tree.trails.len() == lights)
}

/// Whether every triangle has a grid of samples that exist.
fn baked_fits(scene: &Scene, baked: &BakedLight) -> bool {
    let lies_in = |t: &BakedTriangle| {
        let end = u64::from(t.first) + u64::from(t.width) * u64::from(t.height);
        t.width > 0 && t.height > 0 && end <= baked.samples.len() as u64
    };
    baked.meshes.len() == scene.meshes.len()
        && (baked.meshes.iter().zip(&scene.meshes))
            .all(|(grids, mesh)| grids.len() == mesh.triangles.len() && grids.iter().all(lies_in))
}

/// Whether every way through the cells ends in a list of emitters that exist.
fn cells_fit(scene: &Scene) -> bool {
    let LightCells {
        nodes,
        cells,
        entries,
    } = &scene.cells;
    let leads_on = |(i, node): (usize, &CellNode)| {
        node.children.iter().all(|&child| match child & CELL {
            0 => (i..nodes.len()).contains(&(child as usize)) && child as usize != i,
            _ => ((child & !CELL) as usize) < cells.len(),
        })
    };
    let fits = |cell: &cells::Cell| {
        let list = (cell.begin as usize)
            .checked_add(cell.count as usize)
            .and_then(|end| entries.get(cell.begin as usize..end));
        list.is_some_and(|list| {
            list.iter()
                .all(|e| (e.emitter as usize) < scene.emitters.alias.len() && e.other < cell.count)
        })
    };
    nodes.iter().enumerate().all(leads_on) && cells.iter().all(fits)
}
