//! Emitters as the shaders read them.

use super::{triangle, wound};
use crate::abi;
use scene::Scene;
use scene::emitter::tree::TreeNode;
use scene::emitter::{Emitter, Numbering, Shape, Source};

/// The tables of a scene's emitters.
pub(super) struct Tables {
    pub list: Vec<abi::Emitter>,
    pub sources: Vec<abi::Source>,
    /// The sources' triangles, world space.
    pub triangles: Vec<abi::Triangle>,
    pub maps: Vec<abi::EmissionMap>,
    /// Sums and labels of all maps.
    pub texels: Vec<u32>,
    /// Tree over all lights.
    pub tree: Vec<abi::TreeNode>,
}

/// Makes the tables; `inv_total_weight` turns weights into probabilities.
pub(super) fn tables(scene: &Scene, inv_total_weight: f32) -> Tables {
    let emitters = &scene.emitters;
    let mut texels = Vec::new();
    let maps: Vec<abi::EmissionMap> = (emitters.maps.iter())
        .map(|map| {
            let sums = texels.len() as u32;
            texels.extend_from_slice(&map.sums);
            let labels = texels.len() as u32;
            texels.extend_from_slice(&map.labels);
            abi::EmissionMap {
                sums,
                labels,
                rectangles: map.rectangles.len() as u32,
                width: map.width,
                height: map.height,
            }
        })
        .collect();
    let triangles = (emitters.sources.iter())
        .map(|s| {
            let placed = &scene.instances[s.instance as usize];
            let mesh = &scene.meshes[placed.mesh];
            // Corners in the order in which hits count them.
            let t = wound(mesh, &mesh.triangles[s.triangle as usize]);
            triangle(mesh, &t, &placed.transform)
        })
        .collect();
    Tables {
        list: (emitters.list.iter())
            .map(|e| emitter(e, &maps, inv_total_weight))
            .collect(),
        sources: emitters.sources.iter().map(source).collect(),
        triangles,
        maps,
        texels,
        tree: emitters.tree.nodes.iter().map(tree_node).collect(),
    }
}

fn tree_node(n: &TreeNode) -> abi::TreeNode {
    let centre = 0.5 * (n.min + n.max);
    abi::TreeNode {
        centre: centre.to_array(),
        radius2: (n.max - centre).length_squared(),
        axis: n.axis.to_array(),
        cos_cone: n.cos_cone,
        weight: n.weight,
        child: n.child,
        padding: [0; 2],
    }
}

fn emitter(e: &Emitter, maps: &[abi::EmissionMap], inv_total_weight: f32) -> abi::Emitter {
    let (map, rectangle, origin) = match e.shape {
        Shape::Texels {
            map,
            rectangle: [x0, y0, x1, y1],
            tile,
        } => {
            let size = [maps[map as usize].width, maps[map as usize].height];
            let origin = [0, 1].map(|axis| tile[axis] as f32 * size[axis] as f32);
            (map, [x0 | y0 << 16, x1 | y1 << 16], origin)
        }
        Shape::Part {
            divisions,
            column,
            row,
            upper,
        } => (
            abi::NO_MAP,
            [divisions, u32::from(upper)],
            [column as f32, row as f32],
        ),
    };
    abi::Emitter {
        first_source: e.first_source,
        sources: e.sources,
        map,
        probability: e.weight * inv_total_weight,
        rectangle,
        origin,
    }
}

fn source(s: &Source) -> abi::Source {
    let (map, first, first_tile, tiles) = match s.numbering {
        Numbering::Texels {
            map,
            first_tile,
            tiles,
            table,
        } => (map, table, first_tile.map(|t| t as f32), tiles),
        Numbering::Parts { divisions, first } => (abi::NO_MAP, first, [0.0; 2], [divisions; 2]),
    };
    abi::Source {
        map,
        first,
        first_tile,
        tiles,
        padding: [0; 2],
    }
}
