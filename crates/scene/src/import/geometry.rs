//! Faces of one brush model into a watertight triangle mesh.

use super::liquid;
use super::tjunction::{EdgeSplitter, open_edges, simple_loops};
use super::triangulate::triangulate;
use super::weld::Welder;
use crate::material::MaterialId;
use crate::mesh::Triangle;
use glam::{DVec2, DVec3, Vec3};

/// A polygon of a brush model with all that its triangles need.
#[derive(Clone, Debug)]
pub struct FacePolygon {
    /// Corners counter-clockwise seen from the front, model space.
    pub points: Vec<Vec3>,
    /// Unit normal to the front.
    pub normal: DVec3,
    /// What the surface looks like.
    pub material: MaterialId,
    /// A liquid's surface: its opposite twin is dropped, and it does not close the mesh.
    pub liquid: bool,
    /// Its front lies in the liquid that it bounds: it is turned around.
    pub inward: bool,
    /// Number of the face in the file.
    pub face: u32,
    /// How the texture lies on it.
    pub mapping: TextureMapping,
}

/// Texture coordinates as affine functions of the position, in texels of the material's base.
#[derive(Clone, Copy, Debug)]
pub struct TextureMapping {
    /// `u = dot(s, (p, 1))`.
    pub s: [f64; 4],
    /// `v = dot(t, (p, 1))`.
    pub t: [f64; 4],
    /// Length of a tile in `u` and in `v`: whole tiles are taken off, so that values stay small.
    pub tile: [f64; 2],
}

impl TextureMapping {
    fn at(&self, p: DVec3) -> [f64; 2] {
        [self.s, self.t].map(|[x, y, z, w]| DVec3::new(x, y, z).dot(p) + w)
    }
}

/// The mesh of one brush model.
#[derive(Clone, Debug, Default)]
pub struct ModelMesh {
    /// Vertices, model space.
    pub positions: Vec<Vec3>,
    /// Triangles over them, in the order of the faces.
    pub triangles: Vec<Triangle>,
    /// Faces that became triangles.
    pub faces: usize,
    /// Vertices inserted into edges.
    pub inserted: usize,
    /// Edges without an opposite edge, liquids aside, as pairs of vertices.
    pub open_edges: Vec<(u32, u32)>,
    /// Whether edge splitting was given up.
    pub exhausted: bool,
}

/// Drops the twins of liquid faces and turns inner ones around, welds vertices, splits T-junctions and triangulates.
pub fn build(mut polygons: Vec<FacePolygon>) -> ModelMesh {
    let mut twins = liquid::twins(&polygons).into_iter();
    polygons.retain(|_| !twins.next().unwrap_or(false));
    for polygon in polygons.iter_mut().filter(|p| p.inward) {
        polygon.points.reverse();
        polygon.normal = -polygon.normal;
    }
    let mut welder = Welder::default();
    let welded: Vec<Vec<u32>> = polygons
        .iter()
        .map(|p| p.points.iter().map(|&q| welder.weld(q)).collect())
        .collect();
    let positions = welder.into_positions();
    let corners = welded.iter().map(Vec::len).sum();
    let mut splitter = EdgeSplitter::new(&positions, corners);
    let loops: Vec<Vec<Vec<u32>>> = welded
        .iter()
        .map(|w| simple_loops(&splitter.split_polygon(w)))
        .collect();
    let mut mesh = ModelMesh {
        inserted: splitter.inserted(),
        exhausted: splitter.exhausted(),
        open_edges: open_edges(
            polygons
                .iter()
                .zip(&loops)
                .filter(|(p, _)| !p.liquid)
                .flat_map(|(_, l)| l.iter().map(Vec::as_slice)),
        ),
        ..ModelMesh::default()
    };
    for (polygon, loops) in polygons.iter().zip(&loops) {
        let before = mesh.triangles.len();
        for corners in loops {
            add_triangles(&mut mesh.triangles, polygon, corners, &positions);
        }
        mesh.faces += usize::from(mesh.triangles.len() > before);
    }
    mesh.positions = positions;
    mesh
}

fn add_triangles(
    out: &mut Vec<Triangle>,
    polygon: &FacePolygon,
    corners: &[u32],
    positions: &[Vec3],
) {
    let (x, y) = polygon.normal.any_orthonormal_pair();
    let points: Vec<DVec3> = corners
        .iter()
        .map(|&c| positions[c as usize].as_dvec3())
        .collect();
    let flat: Vec<DVec2> = points
        .iter()
        .map(|p| {
            let p = p - points[0];
            DVec2::new(p.dot(x), p.dot(y))
        })
        .collect();
    let mut uv: Vec<[f64; 2]> = points.iter().map(|&p| polygon.mapping.at(p)).collect();
    for axis in 0..2 {
        let tile = polygon.mapping.tile[axis];
        let least = uv.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min);
        let whole = (least / tile).floor() * tile;
        uv.iter_mut().for_each(|c| c[axis] -= whole);
    }
    let normal = polygon.normal.as_vec3();
    out.extend(triangulate(&flat).into_iter().map(|t| Triangle {
        vertices: t.map(|i| corners[i]),
        uv: t.map(|i| uv[i].map(|c| c as f32)),
        normal,
        material: polygon.material,
        face: polygon.face,
    }));
}
