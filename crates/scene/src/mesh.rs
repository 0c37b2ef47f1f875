//! Triangle meshes and their placement.

use crate::material::MaterialId;
use crate::smooth::PackedNormal;
use glam::{Affine3A, DVec3, Vec3};
use std::borrow::Cow;

/// One triangle of a [`Mesh`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Indices into [`Mesh::positions`], counter-clockwise seen from the front.
    pub vertices: [u32; 3],
    /// Texture coordinates of the three vertices in texels of the material's base texture.
    ///
    /// They wrap, and are stored near the origin (a whole number of tiles is taken off per face) so
    /// that f32 keeps its precision.
    pub uv: [[f32; 2]; 3],
    /// Unit normal to the front, local space. Taken from the face's plane, so it is right even
    /// where the triangle is a sliver. In a mesh with poses that of the first pose: the facets of
    /// the others take theirs from their corners.
    pub normal: Vec3,
    /// What the surface looks like.
    pub material: MaterialId,
    /// Number of the face in the level's file, for picking and for the `id` layer.
    pub face: u32,
}

/// A triangle mesh in its own local space.
///
/// Triangles that light passes through somewhere ([`crate::Material::is_see_through`]) stand last, from
/// [`Mesh::first_see_through`] on, so that a renderer can treat the rest as opaque.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For people: `world`, or the brush model's name such as `*3` or `maps/b_bh25.bsp`.
    pub name: String,
    /// Vertex positions, local space. Shared vertices are shared indices: the mesh is watertight
    /// where the level is.
    pub positions: Vec<Vec3>,
    /// Opaque triangles first, then alpha-tested and translucent ones.
    pub triangles: Vec<Triangle>,
    /// Index of the first alpha-tested or translucent triangle; equals `triangles.len()` if there is none.
    pub first_see_through: usize,
    /// Poses that instances blend between, each as long as [`Mesh::positions`], which is the first
    /// of them. Empty: the mesh is rigid.
    pub poses: Vec<Vec<Vec3>>,
    /// Normals that its facets are shaded with: for each pose (one, if it has none) those of the corners of all
    /// triangles, to the front, local space. Empty: it is shaded flat. The world is.
    pub normals: Vec<Vec<[PackedNormal; 3]>>,
    /// Materials that an instance may show instead of those of the triangles ([`Instance::material`])
    /// and still be chosen as a light.
    pub skins: Vec<MaterialId>,
}

impl Mesh {
    /// Positions of a pose, local space. Poses that do not exist are the first.
    #[must_use]
    pub fn posed(&self, blend: PoseBlend) -> Cow<'_, [Vec3]> {
        let of = |pose: u32| self.poses.get(pose as usize).unwrap_or(&self.positions);
        if blend.fraction == 0.0 || blend.from == blend.to {
            return Cow::Borrowed(of(blend.from));
        }
        let ends = of(blend.from).iter().zip(of(blend.to));
        ends.map(|(&a, &b)| a + (b - a) * blend.fraction).collect()
    }

    /// One of the positions that [`Mesh::posed`] gives.
    #[must_use]
    pub fn vertex(&self, blend: PoseBlend, vertex: u32) -> Vec3 {
        let of =
            |pose: u32| self.poses.get(pose as usize).unwrap_or(&self.positions)[vertex as usize];
        let (a, b) = (of(blend.from), of(blend.to));
        a + (b - a) * blend.fraction
    }
}

/// A pose between two of a mesh's: `from + (to - from) * fraction` for every vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseBlend {
    /// Index into [`Mesh::poses`]; 0 for rigid meshes.
    pub from: u32,
    /// Index into [`Mesh::poses`]; 0 for rigid meshes.
    pub to: u32,
    /// How far from the one to the other, 0 to 1.
    pub fraction: f32,
}

/// Which rays meet an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeenBy(u8);

impl SeenBy {
    /// Rays from the camera, up to what they end on. Rays that begin on what these alone meet miss
    /// what [`SeenBy::OTHERS`] alone meet: a weapon in view does not stick in the head that holds it.
    pub const CAMERA: Self = Self(1);
    /// Rays from surfaces: reflections and shadows.
    pub const OTHERS: Self = Self(2);
    /// All rays.
    pub const ALL: Self = Self(3);

    /// Whether the camera's rays meet it.
    #[must_use]
    pub fn camera(self) -> bool {
        self.0 & Self::CAMERA.0 != 0
    }

    /// Whether rays from surfaces meet it.
    #[must_use]
    pub fn others(self) -> bool {
        self.0 & Self::OTHERS.0 != 0
    }
}

/// A mesh placed in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Index into `Scene::meshes`.
    pub mesh: usize,
    /// Local to world space.
    pub transform: Affine3A,
    /// For people: the entity's classname, for example `func_door`; `worldspawn` for the world.
    pub name: String,
    /// Its pose, of a mesh that has poses.
    pub pose: PoseBlend,
    /// Stands for the material of every triangle of the mesh, if there is one. Light passes through
    /// it nowhere, unless the mesh has only triangles that light passes through.
    pub material: Option<MaterialId>,
    /// Which rays meet it.
    pub seen_by: SeenBy,
    /// What it is from one frame to the next, so that its motion is known; 0 for no one in particular.
    pub id: u64,
}

impl Instance {
    /// A mesh in its first pose and its own materials, seen by all.
    #[must_use]
    pub fn new(mesh: usize, transform: Affine3A, name: impl Into<String>) -> Self {
        Self {
            mesh,
            transform,
            name: name.into(),
            pose: PoseBlend::default(),
            material: None,
            seen_by: SeenBy::ALL,
            id: 0,
        }
    }

    /// The material that a triangle of its mesh shows.
    #[must_use]
    pub fn material_of(&self, triangle: &Triangle) -> MaterialId {
        self.material.unwrap_or(triangle.material)
    }
}

/// The point of the triangle with these corners that is nearest to the origin, by the regions of its
/// plane (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
pub(crate) fn nearest_on_triangle([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let inside = |p: DVec3, q: DVec3| (q - p).cross(-p).dot(normal) >= 0.0;
    if normal != DVec3::ZERO && inside(a, b) && inside(b, c) && inside(c, a) {
        return normal * (a.dot(normal) / normal.length_squared());
    }
    let on_edge = |p: DVec3, q: DVec3| {
        let along = q - p;
        let t = (-p.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        p + along * t
    };
    let edges = [on_edge(a, b), on_edge(b, c), on_edge(c, a)];
    let nearer = |p: DVec3, q: DVec3| {
        if q.length_squared() < p.length_squared() {
            q
        } else {
            p
        }
    };
    nearer(nearer(edges[0], edges[1]), edges[2])
}

/// Distance from the origin to the triangle with these corners.
pub(crate) fn distance_to_triangle(corners: [DVec3; 3]) -> f64 {
    nearest_on_triangle(corners).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_blend_from_the_one_to_the_other() {
        let poses = [0.0, 4.0, 8.0].map(|x| vec![Vec3::X * x, Vec3::Y * x]);
        let mesh = Mesh {
            positions: poses[0].clone(),
            poses: poses.to_vec(),
            ..Mesh::default()
        };
        let at = |from, to, fraction| mesh.posed(PoseBlend { from, to, fraction }).into_owned();
        assert_eq!(at(1, 2, 0.0), poses[1]);
        assert_eq!(at(1, 2, 1.0), poses[2]);
        assert_eq!(at(2, 1, 0.25), [Vec3::X * 7.0, Vec3::Y * 7.0]);
        assert_eq!(at(7, 7, 0.5), poses[0]);
    }

    #[test]
    fn distances_to_triangles_are_those_to_their_nearest_points() {
        let corners = [DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0];
        for (point, distance) in [
            (DVec3::new(1.0, 1.0, 3.0), 3.0),
            (DVec3::new(1.0, 1.0, -0.5), 0.5),
            (DVec3::new(2.0, -3.0, 4.0), 5.0),
            (DVec3::new(-3.0, -4.0, 0.0), 5.0),
            (DVec3::new(4.0, 4.0, 0.0), 8f64.sqrt()),
            (DVec3::new(7.0, 0.0, 4.0), 5.0),
        ] {
            let found = distance_to_triangle(corners.map(|c| c - point));
            assert!((found - distance).abs() < 1e-12, "{found} at {point}");
        }
        // Without area it is a line, or a point.
        let line = [DVec3::X, DVec3::X * 2.0, DVec3::X * 3.0];
        assert_eq!(distance_to_triangle(line), 1.0);
        assert_eq!(distance_to_triangle([DVec3::Y * 2.0; 3]), 2.0);
    }
}
