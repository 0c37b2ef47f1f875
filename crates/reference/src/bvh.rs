//! The bounding volume hierarchy: built by `obvhs`, made four wide, and walked here.
//!
//! Boxes are in f32 and rays in f64, so the box test is widened until no rounding can lose a hit
//! (after Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013): see [`BoxRay`].

use crate::triangle::{PackedTriangle, Ray, TriangleHit, intersect};
use glam::{DVec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::{BvhBuildParams, bvh2::Bvh2, bvh2::builder::build_bvh2};
use std::ops::{ControlFlow, Range};
use std::time::Duration;

/// Set in a child that is a leaf; then come 4 bits of count and 27 bits of the first slot.
const LEAF: u32 = 1 << 31;
const COUNT_SHIFT: u32 = 27;
const FIRST_MASK: u32 = (1 << COUNT_SHIFT) - 1;
/// Widens the box test; see [`BoxRay`].
const SLACK: f32 = 1.0 + 1.0 / (1 << 20) as f32;
/// More triangles than this can't be addressed.
pub const MAX_TRIANGLES: usize = FIRST_MASK as usize;
const MAX_LEAF: u32 = 4;
/// Cost of visiting a node in triangle tests, as the builder weighs them. Measured: 3, the
/// builder's own default, makes leaves too large for a triangle test in double precision.
const NODE_COST: f32 = 1.0;

/// Four boxes and what is in them. Lanes that are not used have a box that nothing meets.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Node {
    /// By axis, the boxes' lower and upper planes.
    planes: [[Vec4; 2]; 3],
    /// Index of a node, or a leaf.
    children: [u32; 4],
}

/// Boxes, and which of them a ray meets. What is in a box is its owner's affair.
#[derive(Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    root: Option<u32>,
}

/// Triangles in the order of the hierarchy's leaves. The place of a triangle is its *slot*.
#[derive(Debug)]
pub struct Bvh {
    tree: Tree,
    triangles: Vec<PackedTriangle>,
}

/// What a traversal has still to look at: nodes and the least distance to them. It is only
/// scratch memory, kept so that a ray allocates nothing; a traversal leaves it as it found it.
pub type Stack = Vec<(u32, f32)>;

/// The nearest hit of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Place of the triangle in the hierarchy's order.
    pub slot: u32,
    /// Where on it.
    pub at: TriangleHit,
}

impl Tree {
    /// Builds the hierarchy; also returns the boxes' numbers in the order of its leaves.
    pub fn build(boxes: &[Aabb]) -> (Self, Vec<u32>) {
        let params = BvhBuildParams {
            max_prims_per_leaf: MAX_LEAF,
            collapse_traversal_cost: NODE_COST,
            ..BvhBuildParams::medium_build()
        };
        let bvh2 = build_bvh2(boxes, params, &mut Duration::default());
        let mut builder = Builder {
            bvh2: &bvh2,
            nodes: Vec::with_capacity(bvh2.nodes.len() / 2),
            order: Vec::with_capacity(boxes.len()),
        };
        let root = (!boxes.is_empty()).then(|| builder.convert());
        let Builder { nodes, order, .. } = builder;
        (Self { nodes, root }, order)
    }

    /// Visits the leaves, as ranges of the order, whose boxes a ray may meet before `t_max`: with
    /// `sorted` the near ones first. A visit answers with the new `t_max`, or ends all.
    #[inline]
    pub fn visit(
        &self,
        ray: &Ray,
        mut t_max: f64,
        sorted: bool,
        stack: &mut Stack,
        mut leaf: impl FnMut(Range<u32>, f64, &mut Stack) -> ControlFlow<(), f64>,
    ) {
        let Some(mut current) = self.root else { return };
        let box_ray = BoxRay::new(ray);
        let mut t_max_f32 = round_up(t_max);
        let base = stack.len();
        loop {
            if current & LEAF == 0 {
                let node = &self.nodes[current as usize];
                let (near, mut lanes) = box_ray.meet(node, t_max_f32);
                let near = near.to_array();
                if lanes != 0 {
                    let first = stack.len();
                    while lanes != 0 {
                        let lane = lanes.trailing_zeros() as usize & 3;
                        lanes &= lanes - 1;
                        stack.push((node.children[lane], near[lane]));
                    }
                    if sorted {
                        sort_far_to_near(&mut stack[first..]);
                    }
                    if let Some((child, _)) = stack.pop() {
                        current = child;
                        continue;
                    }
                }
            } else {
                let first = current & FIRST_MASK;
                let count = (current & !LEAF) >> COUNT_SHIFT;
                match leaf(first..first + count, t_max, stack) {
                    ControlFlow::Continue(t) => (t_max, t_max_f32) = (t, round_up(t)),
                    ControlFlow::Break(()) => {
                        stack.truncate(base);
                        return;
                    }
                }
            }
            loop {
                if stack.len() == base {
                    return;
                }
                match stack.pop() {
                    Some((node, t)) if t <= t_max_f32 * SLACK => {
                        current = node;
                        break;
                    }
                    _ => {}
                }
            }
        }
    }
}

impl Bvh {
    /// Builds the hierarchy; also returns for each slot the index into `triangles` it came from.
    ///
    /// Corners must be finite and there must be at most [`MAX_TRIANGLES`] triangles.
    pub fn build(triangles: &[PackedTriangle]) -> (Self, Vec<u32>) {
        let boxes: Vec<Aabb> = triangles.iter().map(bounds).collect();
        let (tree, order) = Tree::build(&boxes);
        let triangles = order.iter().map(|&i| triangles[i as usize]).collect();
        (Self { tree, triangles }, order)
    }

    /// The box around all triangles; `None` if there is none.
    pub fn bounds(&self) -> Option<Aabb> {
        let boxes = self.triangles.iter().map(bounds);
        boxes.reduce(|a, b| Aabb::new(a.min.min(b.min), a.max.max(b.max)))
    }

    /// The triangle in a slot.
    pub fn triangle(&self, slot: u32) -> &PackedTriangle {
        &self.triangles[slot as usize]
    }

    /// The nearest hit in `0 < t < t_max` that `accept` does not reject; it is asked about
    /// alpha-tested triangles only.
    pub fn closest_hit(
        &self,
        ray: &Ray,
        t_max: f64,
        stack: &mut Stack,
        accept: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        self.traverse::<false>(ray, t_max, stack, accept)
    }

    /// Whether anything that `accept` does not reject is hit in `0 < t < t_max`.
    pub fn any_hit(
        &self,
        ray: &Ray,
        t_max: f64,
        stack: &mut Stack,
        accept: impl Fn(&Hit) -> bool,
    ) -> bool {
        self.traverse::<true>(ray, t_max, stack, accept).is_some()
    }

    #[inline]
    fn traverse<const ANY: bool>(
        &self,
        ray: &Ray,
        t_max: f64,
        stack: &mut Stack,
        accept: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        let mut nearest = None;
        (self.tree).visit(ray, t_max, !ANY, stack, |leaf, mut t_max, _| {
            let triangles = &self.triangles[leaf.start as usize..leaf.end as usize];
            for (slot, triangle) in leaf.zip(triangles) {
                if let Some(at) = intersect(ray, triangle, t_max) {
                    let hit = Hit { slot, at };
                    if triangle.alpha_tested() && !accept(&hit) {
                        continue;
                    }
                    nearest = Some(hit);
                    if ANY {
                        return ControlFlow::Break(());
                    }
                    t_max = at.t;
                }
            }
            ControlFlow::Continue(t_max)
        });
        nearest
    }
}

/// Insertion sort of at most four entries.
#[inline]
fn sort_far_to_near(entries: &mut [(u32, f32)]) {
    for i in 1..entries.len() {
        let mut j = i;
        while j > 0 && entries[j - 1].1 < entries[j].1 {
            entries.swap(j - 1, j);
            j -= 1;
        }
    }
}

/// An f32 that is not smaller than `t`.
#[inline]
fn round_up(t: f64) -> f32 {
    (t as f32).next_up()
}

/// A ray as the box test sees it.
///
/// The distance to a plane at `b` is `(b - o) / d`. Rounding the origin to f32 is covered by moving
/// it, by a unit in the last place, away from the near planes and likewise from the far planes. The
/// three further roundings (reciprocal, difference, product) are each 2^-24 of either distance; the
/// far distance is scaled up by 1 + 2^-20, which covers those of both. So no box is missed: where
/// the far distance is not positive its sign is right, and a negative near distance counts as 0.
struct BoxRay {
    near_origin: [Vec4; 3],
    far_origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// By axis, which of the two planes the ray meets first.
    near_plane: [usize; 3],
}

impl BoxRay {
    #[inline]
    fn new(ray: &Ray) -> Self {
        /// Smaller components are taken for this, which moves a point by less than `MIN_PAD`
        /// within 10^9 units, and keeps all distances finite.
        const MIN_DIRECTION: f64 = 1e-25;
        const MIN_PAD: f32 = 1e-15;
        let mut out = Self {
            near_origin: [Vec4::ZERO; 3],
            far_origin: [Vec4::ZERO; 3],
            inverse: [Vec4::ZERO; 3],
            near_plane: [0; 3],
        };
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        for axis in 0..3 {
            let direction = if d[axis].abs() < MIN_DIRECTION {
                MIN_DIRECTION.copysign(d[axis])
            } else {
                d[axis]
            };
            let inverse = (1.0 / direction) as f32;
            let origin = o[axis] as f32;
            let pad = (origin.abs() * f32::EPSILON).max(MIN_PAD).copysign(inverse);
            out.near_origin[axis] = Vec4::splat(origin + pad);
            out.far_origin[axis] = Vec4::splat(origin - pad);
            out.inverse[axis] = Vec4::splat(inverse);
            out.near_plane[axis] = usize::from(inverse < 0.0);
        }
        out
    }

    /// Distances to the four boxes, and a bit for each that the ray may meet by `t_max`.
    #[inline]
    fn meet(&self, node: &Node, t_max: f32) -> (Vec4, u32) {
        let mut near = Vec4::ZERO;
        let mut far = Vec4::splat(t_max);
        for axis in 0..3 {
            let planes = &node.planes[axis];
            let first = self.near_plane[axis] & 1;
            let enter = (planes[first] - self.near_origin[axis]) * self.inverse[axis];
            let leave = (planes[first ^ 1] - self.far_origin[axis]) * self.inverse[axis];
            near = near.max(enter);
            far = far.min(leave);
        }
        (near, near.cmple(far * SLACK).bitmask())
    }
}

fn bounds(triangle: &PackedTriangle) -> Aabb {
    // Exact: the corners were f32 to begin with.
    let [a, b, c] = triangle.corners().map(to_vec3a);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

fn to_vec3a(p: DVec3) -> Vec3A {
    p.as_vec3().into()
}

/// Collapses the binary hierarchy to a four-wide one.
struct Builder<'a> {
    bvh2: &'a Bvh2,
    nodes: Vec<Node>,
    order: Vec<u32>,
}

impl Builder<'_> {
    /// Converts all; returns the root. Iterative, as a hostile level can make a deep tree.
    fn convert(&mut self) -> u32 {
        let mut root = 0;
        // A binary node, and the place of its parent's child that is to point to it.
        let mut pending: Vec<(u32, Option<(usize, usize)>)> = vec![(0, None)];
        while let Some((index, place)) = pending.pop() {
            let node = &self.bvh2.nodes[index as usize];
            let code = if node.is_leaf() {
                self.leaf(node.first_index, node.prim_count)
            } else {
                let at = self.nodes.len();
                let (children, count) = self.adopt(node.first_index);
                self.nodes.push(self.node(&children[..count]));
                for (lane, &child) in children[..count].iter().enumerate().rev() {
                    pending.push((child, Some((at, lane))));
                }
                at as u32
            };
            match place {
                Some((parent, lane)) => self.nodes[parent].children[lane] = code,
                None => root = code,
            }
        }
        root
    }

    fn leaf(&mut self, first: u32, count: u32) -> u32 {
        let code = LEAF | count << COUNT_SHIFT | self.order.len() as u32;
        let primitives = &self.bvh2.primitive_indices[first as usize..][..count as usize];
        self.order.extend_from_slice(primitives);
        code
    }

    /// Up to four descendants: starting from the pair at `pair`, opens the inner node of largest
    /// area while there is room.
    fn adopt(&self, pair: u32) -> ([u32; 4], usize) {
        let mut children = [pair, pair + 1, 0, 0];
        let mut count = 2;
        while count < 4 {
            let area = |i: u32| self.bvh2.nodes[i as usize].aabb().half_area();
            let largest = (0..count)
                .filter(|&i| !self.bvh2.nodes[children[i] as usize].is_leaf())
                .max_by(|&a, &b| area(children[a]).total_cmp(&area(children[b])));
            let Some(i) = largest else { break };
            let opened = self.bvh2.nodes[children[i] as usize].first_index;
            children[i] = opened;
            children[count] = opened + 1;
            count += 1;
        }
        (children, count)
    }

    fn node(&self, children: &[u32]) -> Node {
        let mut node = Node {
            planes: [[Vec4::INFINITY, Vec4::NEG_INFINITY]; 3],
            children: [0; 4],
        };
        for (lane, &child) in children.iter().enumerate() {
            let aabb = self.bvh2.nodes[child as usize].aabb();
            for axis in 0..3 {
                node.planes[axis][0][lane] = aabb.min[axis];
                node.planes[axis][1][lane] = aabb.max[axis];
            }
        }
        node
    }
}

#[cfg(test)]
#[path = "bvh_tests.rs"]
mod tests;
