//! Triangle meshes and their placement.

use crate::material::MaterialId;
use glam::{Affine3A, Vec3};

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
    /// where the triangle is a sliver.
    pub normal: Vec3,
    /// What the surface looks like.
    pub material: MaterialId,
    /// Number of the face in the level's file, for picking and for the `id` layer.
    pub face: u32,
}

/// A triangle mesh in its own local space.
///
/// Triangles that need an alpha test stand last, from [`Mesh::first_alpha_tested`] on, so that a
/// renderer can treat the rest as opaque.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For people: `world`, or the brush model's name such as `*3` or `maps/b_bh25.bsp`.
    pub name: String,
    /// Vertex positions, local space. Shared vertices are shared indices: the mesh is watertight
    /// where the level is.
    pub positions: Vec<Vec3>,
    /// Opaque triangles first, then alpha-tested ones.
    pub triangles: Vec<Triangle>,
    /// Index of the first alpha-tested triangle; equals `triangles.len()` if there is none.
    pub first_alpha_tested: usize,
}

/// A mesh placed in the world.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Index into `Scene::meshes`.
    pub mesh: usize,
    /// Local to world space.
    pub transform: Affine3A,
    /// For people: the entity's classname, for example `func_door`; `worldspawn` for the world.
    pub name: String,
}
