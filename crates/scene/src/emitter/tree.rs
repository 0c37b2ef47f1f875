//! A tree over everything that can be chosen as a light, for choosing by position in logarithmic
//! time (Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting",
//! HPG 2018).

use super::Emitter;
use crate::light::PointLight;
use crate::sky::Sun;
use glam::Vec3;

/// Bins per axis where a split is looked for.
const BINS: usize = 12;
/// Longest way down: the bits of a trail. Groups that need all of it are halved.
const MOST_DEPTH: u32 = 32;
/// Most entries of a tree.
const MOST_ENTRIES: usize = 1 << 24;

/// A group of lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeNode {
    /// Smallest corner of its bounds, world space.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
    /// Sum of the weights.
    pub weight: f32,
    /// Axis of the cone that holds the directions its lights face, unit.
    pub axis: Vec3,
    /// Cosine of that cone's half angle; -1 if some light shines to all sides. Lights give nothing
    /// beyond 90 degrees from the direction they face.
    pub cos_cone: f32,
    /// The second child (the first one is the next node), or a light's number with [`LEAF`] added.
    pub child: u32,
}

/// Flag of [`TreeNode::child`]: the node is one light.
pub const LEAF: u32 = 1 << 31;

/// The tree, and the way down to each light.
///
/// From a point, a child is chosen in proportion to its importance, [`TreeNode`]'s weight times the
/// cosine of the least angle between the directions its lights face and a direction to the point,
/// over the squared distance to the middle of its bounds or to their corner, whichever is more. If
/// both have none, nothing in the group can light the point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightTree {
    /// The nodes, the root first.
    pub nodes: Vec<TreeNode>,
    /// Per light, in the order of `Emitters::alias`: bit `d` is set if the way down takes the second
    /// child at depth `d`. For lights with no weight, [`NO_TRAIL`].
    pub trails: Vec<u32>,
}

/// A light that is not in the tree.
pub const NO_TRAIL: u32 = u32::MAX;

/// A light with what its node needs.
#[derive(Clone, Copy)]
struct Entry {
    number: u32,
    node: TreeNode,
}

impl LightTree {
    /// Builds the tree; empty if there are too many lights for it.
    ///
    /// A sun counts as a light as large as the sky it shines through: it is equally strong, and
    /// stronger than any other of its power far away, all over the level.
    pub(super) fn new(emitters: &[Emitter], lights: &[PointLight], suns: &[Sun]) -> Self {
        let surfaces = emitters.iter().map(|e| {
            let [min, max] = e.bounds();
            (
                min,
                max,
                e.weight,
                e.normal,
                if e.two_sided { -1.0 } else { 1.0 },
            )
        });
        let spheres = lights.iter().map(|l| {
            let (axis, cos_cone) = (l.spot).map_or((Vec3::Z, -1.0), |s| (s.direction, s.cos_outer));
            let (min, max) = (l.position - l.radius, l.position + l.radius);
            (min, max, l.weight(), axis, cos_cone)
        });
        let suns_in_sky = (suns.iter()).map(|s| {
            let [min, max] = s.window;
            (min, max, s.weight, Vec3::Z, -1.0)
        });
        let mut entries: Vec<Entry> = (surfaces.chain(spheres).chain(suns_in_sky).zip(0..))
            .filter(|((.., weight, _, _), _)| *weight > 0.0)
            .map(|((min, max, weight, axis, cos_cone), number)| Entry {
                number,
                node: TreeNode {
                    min,
                    max,
                    weight,
                    axis,
                    cos_cone,
                    child: LEAF | number,
                },
            })
            .collect();
        let mut tree = Self {
            nodes: Vec::new(),
            trails: vec![NO_TRAIL; emitters.len() + lights.len() + suns.len()],
        };
        if entries.is_empty() || entries.len() > MOST_ENTRIES {
            return Self::default();
        }
        tree.nodes.reserve(2 * entries.len() - 1);
        tree.add(&mut entries, 0, 0);
        tree
    }

    /// Adds the node over `entries`, which is reached by `trail` at `depth`.
    fn add(&mut self, entries: &mut [Entry], trail: u32, depth: u32) -> TreeNode {
        if let [one] = entries {
            self.trails[one.number as usize] = trail;
            self.nodes.push(one.node);
            return one.node;
        }
        let at = self.nodes.len();
        self.nodes.push(entries[0].node);
        let middle = split(entries, depth);
        let (first, second) = entries.split_at_mut(middle);
        let a = self.add(first, trail, depth + 1);
        let child = self.nodes.len() as u32;
        let b = self.add(second, trail | 1 << depth, depth + 1);
        self.nodes[at] = TreeNode {
            child,
            ..joined(&a, &b)
        };
        self.nodes[at]
    }
}

/// Orders the entries and says where to part them.
fn split(entries: &mut [Entry], depth: u32) -> usize {
    let centre = |e: &Entry| 0.5 * (e.node.min + e.node.max);
    let min = entries.iter().map(centre).fold(Vec3::INFINITY, Vec3::min);
    let max = entries
        .iter()
        .map(centre)
        .fold(Vec3::NEG_INFINITY, Vec3::max);
    let size = max - min;
    let half = entries.len() / 2;
    let must_halve = entries.len() as u64 > 1 << (MOST_DEPTH - 1).saturating_sub(depth);
    if must_halve || size.max_element() <= 0.0 || !size.is_finite() {
        // Any halves will do, along the longest side.
        let axis = (0..3).fold(0, |best, i| if size[i] > size[best] { i } else { best });
        entries.select_nth_unstable_by(half, |a, b| {
            (centre(a)[axis].total_cmp(&centre(b)[axis])).then(a.number.cmp(&b.number))
        });
        return half;
    }
    let bin = |e: &Entry, axis: usize| {
        let at = (centre(e)[axis] - min[axis]) / size[axis] * BINS as f32;
        (at as usize).min(BINS - 1)
    };
    let mut best = (f32::INFINITY, 0, 0);
    for axis in (0..3).filter(|&i| size[i] > 0.0) {
        let mut bins: [Option<TreeNode>; BINS] = [None; BINS];
        for e in entries.iter() {
            let bin = &mut bins[bin(e, axis)];
            *bin = Some(bin.map_or(e.node, |b| joined(&b, &e.node)));
        }
        let join = |a: Option<TreeNode>, b: &Option<TreeNode>| match (a, b) {
            (Some(a), Some(b)) => Some(joined(&a, b)),
            (a, b) => a.or(*b),
        };
        let mut after: [Option<TreeNode>; BINS] = [None; BINS];
        for i in (0..BINS - 1).rev() {
            after[i] = join(after[i + 1], &bins[i + 1]);
        }
        // Thin slabs are no good: lights of a flat group are told apart along its long sides.
        let thin = size.max_element() / size[axis];
        let mut before = None;
        for i in 0..BINS - 1 {
            before = join(before, &bins[i]);
            if let (Some(a), Some(b)) = (&before, &after[i]) {
                let cost = thin * (cost(a) + cost(b));
                if cost < best.0 {
                    best = (cost, axis, i);
                }
            }
        }
    }
    let (_, axis, last) = best;
    let mut middle = 0;
    for i in 0..entries.len() {
        if bin(&entries[i], axis) <= last {
            entries.swap(i, middle);
            middle += 1;
        }
    }
    if middle == 0 || middle == entries.len() {
        half
    } else {
        middle
    }
}

/// What a group costs: its weight, the more the larger it is and the more ways its lights face.
fn cost(n: &TreeNode) -> f32 {
    let d = n.max - n.min;
    let area = d.x * d.y + d.y * d.z + d.z * d.x;
    // Solid angle of the cone with the cosine-weighted rim of 90 degrees around it.
    let cone = n.cos_cone.clamp(-1.0, 1.0).acos();
    let rim = (cone + std::f32::consts::FRAC_PI_2).min(std::f32::consts::PI);
    let (sin, cos) = cone.sin_cos();
    let spread = std::f32::consts::TAU * (1.0 - cos)
        + std::f32::consts::FRAC_PI_2
            * (2.0 * rim * sin - (cone - 2.0 * rim).cos() - 2.0 * cone * sin + cos);
    n.weight * area * spread
}

/// The group of both, without a child.
fn joined(a: &TreeNode, b: &TreeNode) -> TreeNode {
    let (axis, cos_cone) = cone_around((a.axis, a.cos_cone), (b.axis, b.cos_cone));
    TreeNode {
        min: a.min.min(b.min),
        max: a.max.max(b.max),
        weight: a.weight + b.weight,
        axis,
        cos_cone,
        child: 0,
    }
}

/// The smallest cone that holds two.
fn cone_around(a: (Vec3, f32), b: (Vec3, f32)) -> (Vec3, f32) {
    let all = (Vec3::Z, -1.0);
    if a.1 <= -1.0 || b.1 <= -1.0 {
        return all;
    }
    let angle = |c: f32| c.clamp(-1.0, 1.0).acos();
    // Wider than rounding could make it too narrow.
    let slack = 1e-3;
    let (ta, tb) = (angle(a.1), angle(b.1));
    let between = angle(a.0.dot(b.0));
    let (wide, narrow, tw, tn) = if ta >= tb {
        (a, b, ta, tb)
    } else {
        (b, a, tb, ta)
    };
    if between < 1e-4 && tn == tw || between + tn <= tw {
        return wide;
    }
    let half = 0.5 * (tw + between + tn) + slack;
    let turn = half - tw;
    let across = narrow.0 - wide.0 * wide.0.dot(narrow.0);
    match across.try_normalize() {
        Some(across) if half < std::f32::consts::PI => {
            let (sin, cos) = turn.sin_cos();
            ((wide.0 * cos + across * sin).normalize(), half.cos())
        }
        _ => all,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(i: u32) -> PointLight {
        let random = |k: u32| {
            let v = i
                .wrapping_mul(2_654_435_761)
                .wrapping_add(k.wrapping_mul(40_503_001));
            (v ^ v >> 15).wrapping_mul(2_246_822_519) as f32 / u32::MAX as f32
        };
        PointLight {
            position: Vec3::new(random(1), random(2), random(3)) * 1000.0,
            radius: 1.0,
            intensity: Vec3::splat(random(4) + 0.01),
            spot: None,
            ..PointLight::default()
        }
    }

    #[test]
    fn every_light_is_where_its_trail_leads_and_inside_all_its_groups() {
        let mut lights: Vec<_> = (0..1000).map(light).collect();
        // Many in one place, and one without any light.
        for l in &mut lights[100..400] {
            l.position = Vec3::ONE;
        }
        lights[7].intensity = Vec3::ZERO;
        let tree = LightTree::new(&[], &lights, &[]);
        assert_eq!(tree.nodes.len(), 2 * 999 - 1);
        assert_eq!(tree.trails[7], NO_TRAIL);
        for (i, l) in lights.iter().enumerate().filter(|(i, _)| *i != 7) {
            let (mut at, mut trail) = (0, tree.trails[i]);
            while tree.nodes[at].child & LEAF == 0 {
                let node = &tree.nodes[at];
                assert!(l.position.cmpge(node.min).all() && l.position.cmple(node.max).all());
                let [a, b] = [at + 1, node.child as usize].map(|c| tree.nodes[c].weight);
                assert!((a + b - node.weight).abs() <= 1e-5 * node.weight);
                at = if trail & 1 == 1 {
                    node.child as usize
                } else {
                    at + 1
                };
                trail >>= 1;
            }
            assert_eq!((tree.nodes[at].child, trail), (LEAF | i as u32, 0));
        }
    }

    #[test]
    fn cones_hold_both_of_what_they_are_made_of() {
        let direction = |i: u32| light(i).position.normalize_or(Vec3::X) * 2.0 - Vec3::ONE;
        for i in 0..200 {
            let a = (direction(i).normalize(), 1.0 - 0.004 * i as f32);
            let b = (direction(i + 500).normalize(), 1.0);
            let (axis, cos) = cone_around(a, b);
            for (inner, inner_cos) in [a, b] {
                let reach = axis.dot(inner).clamp(-1.0, 1.0).acos() + inner_cos.acos();
                assert!(cos <= -1.0 || reach <= cos.acos() + 1e-3, "{i}: {reach}");
            }
        }
    }
}
