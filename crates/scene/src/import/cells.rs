//! A level's leafs as cells of the choice among lights, with what its PVS says can be seen.

use crate::cells::{CELL, CellNode, LightCells};
use crate::emitter::Emitters;
use crate::light::PointLight;
use bsp::Bsp;
use bsp::bsp::{NodeChild, contents};
use glam::Vec3;

/// How far from a surface points are looked up that are to lie before it, world units.
const BEFORE: f32 = 2.0;

/// The lists of lights for the leafs of the world; none if its tree cannot be walked or nothing
/// shines.
pub fn light_cells(bsp: &Bsp, emitters: &Emitters, lights: &[PointLight]) -> LightCells {
    let Some(nodes) = nodes(bsp).filter(|_| !emitters.alias.is_empty()) else {
        return LightCells::default();
    };
    // By emitter, the leafs it lies in or borders on.
    let places: Vec<Vec<usize>> = (emitters.list.iter())
        .map(|e| {
            let normal = e.normal * BEFORE;
            let centre = e.corners.iter().sum::<Vec3>() / 4.0;
            let points = e.corners.map(|p| p.lerp(centre, 0.1));
            let around = points.into_iter().chain([centre]);
            let sides = if e.two_sided { 2 } else { 1 };
            leafs_at(
                bsp,
                around.flat_map(|p| [p + normal, p - normal].into_iter().take(sides)),
            )
        })
        .chain(lights.iter().map(|l| leafs_at(bsp, [l.position])))
        .collect();
    let bounds: Vec<[Vec3; 2]> = (bsp.leafs.iter())
        .map(|leaf| [Vec3::from(leaf.mins), Vec3::from(leaf.maxs)])
        .collect();
    LightCells::new(nodes, &bounds, emitters, lights, |leaf, seen| {
        let inside = bsp
            .leafs
            .get(leaf)
            .is_some_and(|l| l.contents != contents::SOLID);
        if leaf == 0 || !inside {
            return;
        }
        let pvs = bsp.pvs(leaf);
        let visible = |place: &Vec<usize>| {
            // In solid, or nowhere: it may be seen.
            place.is_empty() || place.iter().any(|&l| l == leaf || pvs.sees(l))
        };
        let emitters = places
            .iter()
            .enumerate()
            .filter(|(_, place)| visible(place));
        seen.extend(emitters.map(|(i, _)| i as u32));
    })
}

/// The leafs that points lie in, without solid ones.
fn leafs_at(bsp: &Bsp, points: impl IntoIterator<Item = Vec3>) -> Vec<usize> {
    let mut leafs: Vec<usize> = (points.into_iter())
        .filter_map(|p| bsp.point_leaf(0, p.to_array()))
        .filter(|&leaf| leaf != 0)
        .collect();
    leafs.sort_unstable();
    leafs.dedup();
    leafs
}

/// The world's tree from its root on, with parents before children. `None` if it is broken.
pub fn nodes(bsp: &Bsp) -> Option<Vec<CellNode>> {
    let root = u32::try_from(bsp.models.first()?.head_nodes[0]).ok()?;
    let mut nodes: Vec<CellNode> = Vec::new();
    // Old number, and which child of which new node it is.
    let mut open = vec![(root, None::<(usize, usize)>)];
    while let Some((old, parent)) = open.pop() {
        let node = bsp.nodes.get(old as usize)?;
        let plane = bsp.planes.get(node.plane as usize)?;
        let normal = Vec3::from(plane.normal);
        // Shared children would be copied without end.
        if nodes.len() > bsp.nodes.len() || !normal.is_finite() || !plane.distance.is_finite() {
            return None;
        }
        let number = nodes.len();
        if let Some((parent, side)) = parent {
            nodes[parent].children[side] = number as u32;
        }
        let mut children = [0; 2];
        for (side, child) in node.children.into_iter().enumerate() {
            match child {
                NodeChild::Node(n) => open.push((n, Some((number, side)))),
                NodeChild::Leaf(leaf) => children[side] = CELL | leaf,
            }
        }
        nodes.push(CellNode {
            normal,
            distance: plane.distance,
            children,
        });
    }
    Some(nodes)
}
