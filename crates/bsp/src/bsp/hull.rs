//! Where a point is, and what a moving box hits: hull 0 (nodes and leafs, for points) and hulls 1
//! to 3 (clipnodes, for the engine's boxes).

use super::{Bsp, NodeChild, contents};

/// The boxes that the hulls of Quake levels serve, least and greatest corner, in Quake units.
pub const HULL_BOXES: [([f32; 3], [f32; 3]); 3] = [
    ([0.0; 3], [0.0; 3]),
    ([-16.0, -16.0, -24.0], [16.0, 16.0, 32.0]),
    ([-32.0, -32.0, -24.0], [32.0, 32.0, 64.0]),
];

/// A trace stops this far before what it hits, in Quake units, as in the engine.
pub const TRACE_EPSILON: f64 = 1.0 / 32.0;

/// A trace gives up after this many steps: only trees made to take time need more.
const MAX_STEPS: usize = 1 << 16;

/// How a trace ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trace {
    /// How far it came: 1 is all the way.
    pub fraction: f64,
    /// Where it ended.
    pub end: [f32; 3],
    /// Normal of the plane it hit, turned against the motion; `None` if nothing was hit.
    pub normal: Option<[f32; 3]>,
    /// Whether it began in solid.
    pub start_solid: bool,
}

/// A reference to a cell or to a further split.
enum Step {
    Split { plane: u32, children: [i64; 2] },
    Contents(i32),
}

fn distance(plane: &super::Plane, p: [f64; 3]) -> f64 {
    let dot: f64 = plane
        .normal
        .iter()
        .zip(p)
        .map(|(&n, c)| f64::from(n) * c)
        .sum();
    dot - f64::from(plane.distance)
}

impl Bsp {
    /// The leaf of a model's hull 0 that a point is in; `None` if the tree cannot be walked.
    pub fn point_leaf(&self, model: usize, point: [f32; 3]) -> Option<usize> {
        let p = point.map(f64::from);
        let head = self.models.get(model)?.head_nodes[0];
        let mut at = match u32::try_from(head) {
            Ok(n) => NodeChild::Node(n),
            Err(_) => NodeChild::Leaf((-1 - head).unsigned_abs()),
        };
        loop {
            match at {
                NodeChild::Leaf(leaf) => {
                    return ((leaf as usize) < self.leafs.len()).then_some(leaf as usize);
                }
                NodeChild::Node(n) => {
                    // A good node leads to good nodes only and never in a circle.
                    let node = self.good_node(n)?;
                    let plane = self.planes.get(node.plane as usize)?;
                    let [front, back] = node.children;
                    at = if distance(plane, p) > 0.0 {
                        front
                    } else {
                        back
                    };
                }
            }
        }
    }

    /// What is at a point of a model's hull 0, see [`contents`]; `None` if the tree cannot be
    /// walked.
    pub fn point_contents(&self, model: usize, point: [f32; 3]) -> Option<i32> {
        let leaf = self.point_leaf(model, point)?;
        self.leafs.get(leaf).map(|l| l.contents)
    }

    /// Whether a point is in solid or sky of a model's hull 0, or nearer than `margin` units to a
    /// plane behind which there is some, as the light compilers ask. Not where the tree cannot be
    /// walked.
    pub fn touches_solid(&self, model: usize, point: [f64; 3], margin: f64) -> bool {
        let Some(head) = self.models.get(model).map(|m| m.head_nodes[0]) else {
            return false;
        };
        let mut open = vec![match u32::try_from(head) {
            Ok(n) => NodeChild::Node(n),
            Err(_) => NodeChild::Leaf((-1 - head).unsigned_abs()),
        }];
        // Shared children could be looked at again and again.
        for _ in 0..2 * self.nodes.len() + 2 {
            match open.pop() {
                None => return false,
                Some(NodeChild::Leaf(leaf)) => {
                    let contents = self.leafs.get(leaf as usize).map(|l| l.contents);
                    if matches!(contents, Some(contents::SOLID | contents::SKY)) {
                        return true;
                    }
                }
                Some(NodeChild::Node(n)) => {
                    // A good node leads to good nodes only and never in a circle.
                    let Some(node) = self.good_node(n) else {
                        return false;
                    };
                    let Some(plane) = self.planes.get(node.plane as usize) else {
                        return false;
                    };
                    let distance = distance(plane, point);
                    let [front, back] = node.children;
                    if distance > -margin {
                        open.push(front);
                    }
                    if distance < margin {
                        open.push(back);
                    }
                }
            }
        }
        false
    }

    /// What a box of hull `hull` (see [`HULL_BOXES`]) is in with its origin at a point; `None` if
    /// the tree cannot be walked.
    pub fn hull_contents(&self, model: usize, hull: usize, point: [f32; 3]) -> Option<i32> {
        let p = point.map(f64::from);
        let mut at = i64::from(*self.models.get(model)?.head_nodes.get(hull)?);
        loop {
            match self.step(hull, at)? {
                Step::Contents(c) => return Some(c),
                Step::Split { plane, children } => {
                    let plane = self.planes.get(plane as usize)?;
                    let [front, back] = children;
                    at = if distance(plane, p) >= 0.0 {
                        front
                    } else {
                        back
                    };
                }
            }
        }
    }

    /// Moves a box of hull `hull` from `start` to `end` and stops it at the first solid. `None` if
    /// the tree cannot be walked.
    pub fn trace(
        &self,
        model: usize,
        hull: usize,
        start: [f32; 3],
        end: [f32; 3],
    ) -> Option<Trace> {
        let head = i64::from(*self.models.get(model)?.head_nodes.get(hull)?);
        let (a, b) = (start.map(f64::from), end.map(f64::from));
        let along = |t: f64| {
            let mut p = a;
            for (c, to) in p.iter_mut().zip(b) {
                *c += t * (to - *c);
            }
            p
        };
        // Pieces of the segment still to visit, the nearest on top: where, from, to, and the plane
        // crossed to get there.
        let mut stack = vec![(head, 0.0_f64, 1.0_f64, None::<u32>)];
        let mut start_solid = false;
        let mut was_open = false;
        for _ in 0..MAX_STEPS {
            let Some((at, from, to, entered)) = stack.pop() else {
                return Some(Trace {
                    fraction: 1.0,
                    end,
                    normal: None,
                    start_solid,
                });
            };
            match self.step(hull, at)? {
                Step::Contents(contents::SOLID) => {
                    let plane = entered.and_then(|p| self.planes.get(p as usize));
                    let (true, Some(plane)) = (was_open, plane) else {
                        start_solid = true;
                        continue;
                    };
                    let sign = if distance(plane, a) < distance(plane, b) {
                        -1.0
                    } else {
                        1.0
                    };
                    let closing = (distance(plane, a) - distance(plane, b)).abs();
                    let fraction = (from - TRACE_EPSILON / closing).max(0.0);
                    return Some(Trace {
                        fraction,
                        end: along(fraction).map(|c| c as f32),
                        normal: Some(plane.normal.map(|n| n * sign)),
                        start_solid,
                    });
                }
                Step::Contents(_) => was_open = true,
                Step::Split { plane, children } => {
                    let split = self.planes.get(plane as usize)?;
                    let [front, back] = children;
                    let (d0, d1) = (distance(split, along(from)), distance(split, along(to)));
                    if d0 >= 0.0 && d1 >= 0.0 {
                        stack.push((front, from, to, entered));
                    } else if d0 < 0.0 && d1 < 0.0 {
                        stack.push((back, from, to, entered));
                    } else {
                        let middle = from + (to - from) * (d0 / (d0 - d1)).clamp(0.0, 1.0);
                        let (near, far) = if d0 >= 0.0 {
                            (front, back)
                        } else {
                            (back, front)
                        };
                        stack.push((far, middle, to, Some(plane)));
                        stack.push((near, from, middle, entered));
                    }
                }
            }
        }
        None
    }

    fn good_node(&self, n: u32) -> Option<&super::Node> {
        let bad = self.bad_nodes.get(n as usize)?;
        if *bad {
            None
        } else {
            self.nodes.get(n as usize)
        }
    }

    /// One step of a hull's tree; `None` where it must not be walked. For hull 0 the leafs stand
    /// as negative numbers, as in 32-bit files.
    fn step(&self, hull: usize, at: i64) -> Option<Step> {
        if hull == 0 {
            let Ok(n) = u32::try_from(at) else {
                let leaf = usize::try_from(-1 - at).ok()?;
                return Some(Step::Contents(self.leafs.get(leaf)?.contents));
            };
            let node = self.good_node(n)?;
            let children = node.children.map(|c| match c {
                NodeChild::Node(n) => i64::from(n),
                NodeChild::Leaf(l) => -1 - i64::from(l),
            });
            return Some(Step::Split {
                plane: node.plane,
                children,
            });
        }
        let Ok(n) = usize::try_from(at) else {
            return Some(Step::Contents(i32::try_from(at).ok()?));
        };
        let node = self.clipnodes.get(n)?;
        if *self.bad_clipnodes.get(n)? {
            return None;
        }
        Some(Step::Split {
            plane: node.plane,
            children: node.children.map(i64::from),
        })
    }
}
