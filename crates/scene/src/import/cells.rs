//! A level's leafs as cells of the choice among lights, with what its PVS says can be seen.

use crate::cells::{CELL, CellNode, LightCells};
use crate::emitter::Emitters;
use crate::light::{Falloff, PointLight};
use crate::sky::Sun;
use bsp::Bsp;
use bsp::bsp::{NodeChild, contents};
use glam::{Vec3, Vec3Swizzles as _};

/// How far from a surface points are looked up that are to lie before it, world units.
const BEFORE: f32 = 2.0;

/// The lists of lights for the leafs of the world; none if its tree cannot be walked or nothing
/// shines. `sky` holds the corners of all sky triangles.
pub fn light_cells(
    bsp: &Bsp,
    emitters: &Emitters,
    lights: &[PointLight],
    suns: &[Sun],
    sky: &[[Vec3; 3]],
) -> LightCells {
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
        .chain(lights.iter().map(|l| match l.compiler {
            // A sun has no place.
            Some(c) if matches!(c.falloff, Falloff::Sun(_)) => Vec::new(),
            _ => leafs_at(bsp, [l.position]),
        }))
        .collect();
    let bounds: Vec<[Vec3; 2]> = (bsp.leafs.iter())
        .map(|leaf| [Vec3::from(leaf.mins), Vec3::from(leaf.maxs)])
        .collect();
    let shafts: Vec<Shaft> = suns.iter().map(Shaft::new).collect();
    // By sun, the sky that it shines through: the leafs before it, and where it is across the light.
    let windows: Vec<Vec<(Vec<usize>, Rect)>> = (shafts.iter().zip(suns))
        .map(|(shaft, sun)| {
            let normal = |t: &[Vec3; 3]| (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
            (sky.iter().filter(|t| normal(t).dot(sun.direction) <= 0.0))
                .map(|t| {
                    let centre = (t[0] + t[1] + t[2]) / 3.0;
                    let around = t.map(|p| p.lerp(centre, 0.1)).into_iter().chain([centre]);
                    let before = around.map(|p| p + BEFORE * normal(t));
                    (leafs_at(bsp, before), shaft.across(*t))
                })
                .collect()
        })
        .collect();
    let first_sun = emitters.list.len() + lights.len();
    LightCells::new(nodes, &bounds, emitters, |leaf, seen| {
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
        for (i, (shaft, windows)) in shafts.iter().zip(&windows).enumerate() {
            let here = shaft.across(corners(bounds[leaf]));
            let lights = |(before, window): &(Vec<usize>, Rect)| {
                shaft.may_light(*window, here) && visible(before)
            };
            if windows.iter().any(lights) {
                seen.push((first_sun + i) as u32);
            }
        }
    })
}

/// Bounds across a sun's light: lowest and highest on two axes, and along the way to the sun.
type Rect = [Vec3; 2];

/// The light of a sun, as seen along it.
struct Shaft {
    axes: [Vec3; 3],
    /// Tangent of the sun's angular radius.
    spread: f32,
}

impl Shaft {
    fn new(sun: &Sun) -> Self {
        let (u, v) = sun.direction.any_orthonormal_pair();
        let cos = (1.0 - sun.one_minus_cos).max(0.02);
        Self {
            axes: [u, v, sun.direction],
            spread: (1.0 - cos * cos).sqrt() / cos,
        }
    }

    fn across<const N: usize>(&self, points: [Vec3; N]) -> Rect {
        let seen = points.map(|p| Vec3::from(self.axes.map(|axis| axis.dot(p))));
        let first = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        (seen.iter()).fold(first, |[min, max], p| [min.min(*p), max.max(*p)])
    }

    /// Whether light that comes through a window may reach what is here.
    fn may_light(&self, window: Rect, here: Rect) -> bool {
        let way = window[1].z - here[0].z;
        // A unit for the rounding.
        let wide = Vec3::new(way * self.spread, way * self.spread, 0.0) + 1.0;
        way >= -1.0
            && (window[0] - wide).xy().cmple(here[1].xy()).all()
            && (window[1] + wide).xy().cmpge(here[0].xy()).all()
    }
}

/// The corners of a box.
fn corners([min, max]: [Vec3; 2]) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        Vec3::select(
            glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0),
            max,
            min,
        )
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
