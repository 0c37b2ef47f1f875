//! Triangle meshes and their placement.

use crate::material::MaterialId;
use glam::{Affine3A, DVec3, Vec3};

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
/// Triangles that light passes through somewhere ([`crate::Material::is_see_through`]) stand last, from
/// [`Mesh::first_alpha_tested`] on, so that a renderer can treat the rest as opaque.
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

/// Distance from the origin to the triangle with these corners, by the regions of its plane
/// (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
pub(crate) fn distance_to_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let inside = |p: DVec3, q: DVec3| (q - p).cross(-p).dot(normal) >= 0.0;
    if normal != DVec3::ZERO && inside(a, b) && inside(b, c) && inside(c, a) {
        return a.dot(normal).abs() / normal.length();
    }
    let to_edge = |p: DVec3, q: DVec3| {
        let along = q - p;
        let t = (-p.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (p + along * t).length()
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

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
