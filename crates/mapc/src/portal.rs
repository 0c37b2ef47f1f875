//! Portals: the polygons through which neighbouring leafs touch; and the fill from outside.

use std::collections::VecDeque;

use crate::math::{Bounds, Plane, PlaneSet, Vec3, add, scale};
use crate::texture::Contents;
use crate::tree::Tree;
use crate::winding::Winding;

/// Space left around the brushes, in Quake units.
const MARGIN: f64 = 64.0;

/// What lies beyond the box around the map.
pub(crate) const OUTSIDE: usize = usize::MAX;

/// A polygon between two leafs.
#[derive(Debug, Clone)]
pub(crate) struct Portal {
    /// The node whose plane it lies on; `None` for the box around the map.
    pub(crate) on_node: Option<usize>,
    /// Clockwise seen from `leafs[0]`.
    pub(crate) winding: Winding,
    /// In front and behind; a leaf index or [`OUTSIDE`]. Nodes while building.
    pub(crate) leafs: [usize; 2],
}

/// Builds the portals of a tree, and the bounds of its nodes.
pub(crate) fn build(tree: &mut Tree, planes: &PlaneSet) -> Vec<Portal> {
    let mut portals = outer_box(tree);
    for i in 0..portals.len() {
        tree.nodes[0].portals.push(i);
    }
    let mut todo = vec![0];
    while let Some(node) = todo.pop() {
        let own = std::mem::take(&mut tree.nodes[node].portals);
        let bounds = Bounds::of(own.iter().flat_map(|&p| &portals[p].winding.0));
        tree.nodes[node].bounds = bounds;
        let Some(split) = tree.nodes[node].split else {
            let corners: Vec<Vec3> = own
                .iter()
                .flat_map(|&p| portals[p].winding.0.iter().copied())
                .collect();
            let sum = corners.iter().fold([0.0; 3], |s, p| add(s, *p));
            tree.nodes[node].middle = scale(sum, 1.0 / corners.len().max(1) as f64);
            tree.nodes[node].portals = own;
            continue;
        };
        let plane = planes.get(split.plane);
        // The node's own portal: its plane, clipped by the walls of its cell.
        let mut cut = Some(Winding::on_plane(&plane));
        for &p in &own {
            let wall = wall_plane(&portals[p], node, tree, planes);
            cut = cut.and_then(|w| w.clip_back(&wall, 1e-6, false));
        }
        for p in own {
            distribute(tree, &mut portals, p, node, split.children, &plane);
        }
        if let Some(winding) = cut {
            let index = portals.len();
            portals.push(Portal {
                on_node: Some(node),
                winding,
                leafs: split.children,
            });
            for c in split.children {
                tree.nodes[c].portals.push(index);
            }
        }
        todo.extend([split.children[1], split.children[0]]);
    }
    portals
}

/// The plane of a portal, facing out of the cell.
fn wall_plane(portal: &Portal, cell: usize, tree: &Tree, planes: &PlaneSet) -> Plane {
    let plane = match portal.on_node.and_then(|n| tree.nodes[n].split) {
        Some(split) => planes.get(split.plane),
        None => winding_plane(&portal.winding),
    };
    if portal.leafs[0] == cell {
        plane.flipped()
    } else {
        plane
    }
}

/// The plane of a winding that is a clean square.
fn winding_plane(w: &Winding) -> Plane {
    Plane::from_points(&[w.0[0], w.0[1], w.0[2]]).unwrap_or(Plane {
        normal: [0.0, 0.0, 1.0],
        dist: 0.0,
    })
}

/// Hands a portal of a node on to the child or children it touches.
fn distribute(
    tree: &mut Tree,
    portals: &mut Vec<Portal>,
    p: usize,
    node: usize,
    children: [usize; 2],
    plane: &Plane,
) {
    let slot = usize::from(portals[p].leafs[0] != node);
    let (front, back) = match portals[p].winding.split(plane, 1e-6) {
        // On the plane: cannot happen for a real wall of the cell, keep it somewhere.
        (None, None) => (Some(portals[p].winding.clone()), None),
        parts => parts,
    };
    let mut parts = [front, back]
        .into_iter()
        .zip(children)
        .filter_map(|(w, c)| Some((w?, c)));
    if let Some((winding, child)) = parts.next() {
        portals[p].winding = winding;
        portals[p].leafs[slot] = child;
        tree.nodes[child].portals.push(p);
    }
    if let Some((winding, child)) = parts.next() {
        let mut other = portals[p].clone();
        other.winding = winding;
        other.leafs[slot] = child;
        let index = portals.len();
        tree.nodes[child].portals.push(index);
        let neighbour = other.leafs[1 - slot];
        if neighbour != OUTSIDE {
            tree.nodes[neighbour].portals.push(index);
        }
        portals.push(other);
    }
}

fn outer_box(tree: &Tree) -> Vec<Portal> {
    let b = tree.bounds;
    let mut walls = Vec::new();
    for axis in 0..3 {
        for (sign, edge) in [(-1.0, b.mins[axis] - MARGIN), (1.0, b.maxs[axis] + MARGIN)] {
            let mut normal = [0.0; 3];
            normal[axis] = sign;
            walls.push(Plane {
                normal,
                dist: sign * edge,
            });
        }
    }
    let clip = |wall: &Plane| {
        let mut w = Some(Winding::on_plane(wall));
        for other in &walls {
            if other.normal != wall.normal {
                w = w.and_then(|w| w.clip_back(other, 1e-6, false));
            }
        }
        // The planes face outward: the map is behind them.
        w.map(|winding| Portal {
            on_node: None,
            winding,
            leafs: [OUTSIDE, 0],
        })
    };
    walls.iter().filter_map(clip).collect()
}

/// Which leafs can be reached from the given points without passing solid or sky; and the first
/// point, if any, from which the outside can be reached.
pub(crate) struct Flood {
    pub(crate) reached: Vec<bool>,
    pub(crate) leak: Option<usize>,
    /// Was any point outside of solid at all?
    pub(crate) any: bool,
}

/// Floods the leafs from points (Quake units).
pub(crate) fn flood(tree: &Tree, planes: &PlaneSet, portals: &[Portal], from: &[Vec3]) -> Flood {
    let mut out = Flood {
        reached: vec![false; tree.nodes.len()],
        leak: None,
        any: false,
    };
    for (i, point) in from.iter().enumerate() {
        let outer = &tree.bounds;
        let inside = (0..3).all(|k| point[k] > outer.mins[k] && point[k] < outer.maxs[k]);
        let start = tree.leaf_at(planes, *point);
        if !inside {
            out.leak.get_or_insert(i);
            continue;
        }
        if tree.nodes[start].contents.is_opaque() || out.reached[start] {
            continue;
        }
        out.any = true;
        out.reached[start] = true;
        let mut queue = VecDeque::from([start]);
        while let Some(leaf) = queue.pop_front() {
            for &p in &tree.nodes[leaf].portals {
                let [a, b] = portals[p].leafs;
                let other = if a == leaf { b } else { a };
                if other == OUTSIDE {
                    out.leak.get_or_insert(i);
                } else if !out.reached[other] && !tree.nodes[other].contents.is_opaque() {
                    out.reached[other] = true;
                    queue.push_back(other);
                }
            }
        }
    }
    out
}

/// Makes every open leaf that was not reached solid.
pub(crate) fn fill_unreached(tree: &mut Tree, flood: &Flood) {
    for (node, reached) in tree.nodes.iter_mut().zip(&flood.reached) {
        if node.split.is_none() && !reached && node.contents != Contents::Sky {
            node.contents = Contents::Solid;
        }
    }
}
