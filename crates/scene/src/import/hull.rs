//! Where solid is: points and lines through a level's trees.

use bsp::Bsp;
use bsp::bsp::{NodeChild, contents};
use glam::DVec3;

/// Deepest tree that is followed; compilers make trees of a few dozen levels.
const MAX_DEPTH: usize = 1024;
/// Most nodes that one line visits.
const MAX_VISITS: usize = 1 << 16;

/// One tree of a brush model.
#[derive(Clone, Copy)]
pub struct Hull<'a> {
    bsp: &'a Bsp,
    /// 0 is the drawn geometry, 1 to 3 are grown by a box.
    number: usize,
    head: i32,
}

enum Step {
    Split {
        normal: DVec3,
        distance: f64,
        children: [i32; 2],
    },
    Contents(i32),
}

impl<'a> Hull<'a> {
    /// Hull `number` of `model`; `None` if the file has no such tree.
    pub fn new(bsp: &'a Bsp, model: usize, number: usize) -> Option<Self> {
        let head = *bsp.models.get(model)?.head_nodes.get(number)?;
        let count = if number == 0 {
            bsp.nodes.len()
        } else {
            bsp.clipnodes.len()
        };
        usize::try_from(head).ok().filter(|&h| h < count)?;
        Some(Self { bsp, number, head })
    }

    fn step(&self, node: i32) -> Option<Step> {
        let Ok(index) = usize::try_from(node) else {
            return Some(Step::Contents(node));
        };
        let (plane, children) = if self.number == 0 {
            let node = self.bsp.nodes.get(index)?;
            let child = |c: NodeChild| match c {
                NodeChild::Node(n) => i32::try_from(n).ok(),
                NodeChild::Leaf(l) => {
                    let contents = self.bsp.leafs.get(l as usize)?.contents;
                    // Contents are negative; anything else is damage.
                    Some(contents.min(contents::EMPTY))
                }
            };
            (
                node.plane,
                [child(node.children[0])?, child(node.children[1])?],
            )
        } else {
            let node = self.bsp.clipnodes.get(index)?;
            (node.plane, node.children)
        };
        let plane = self.bsp.planes.get(plane as usize)?;
        Some(Step::Split {
            normal: DVec3::from(plane.normal.map(f64::from)),
            distance: f64::from(plane.distance),
            children,
        })
    }

    /// Contents at a point; `None` if the tree is damaged there.
    pub fn contents(&self, p: DVec3) -> Option<i32> {
        let mut node = self.head;
        for _ in 0..MAX_DEPTH {
            match self.step(node)? {
                Step::Contents(contents) => return Some(contents),
                Step::Split {
                    normal,
                    distance,
                    children,
                } => {
                    node = children[usize::from(normal.dot(p) - distance < 0.0)];
                }
            }
        }
        None
    }

    /// Whether a point lies in solid; damage counts as open.
    pub fn is_solid(&self, p: DVec3) -> bool {
        self.contents(p) == Some(contents::SOLID)
    }

    /// Part of the way from `start` to `end` after which solid begins (0 to 1); 0 if `start` lies
    /// in it, `None` if the way is free.
    pub fn first_solid(&self, start: DVec3, end: DVec3) -> Option<f64> {
        let mut stack = vec![(self.head, 0.0, 1.0)];
        for _ in 0..MAX_VISITS {
            // Parts of the way come off the stack in their order along it.
            let (node, t0, t1) = stack.pop()?;
            match self.step(node)? {
                Step::Contents(contents::SOLID) => return Some(t0),
                Step::Contents(_) => {}
                Step::Split {
                    normal,
                    distance,
                    children,
                } => {
                    let height = |t: f64| normal.dot(start.lerp(end, t)) - distance;
                    let (h0, h1) = (height(t0), height(t1));
                    let side = usize::from(h0 < 0.0);
                    if side == usize::from(h1 < 0.0) {
                        stack.push((children[side], t0, t1));
                        continue;
                    }
                    let middle = (t0 + (t1 - t0) * h0 / (h0 - h1)).clamp(t0, t1);
                    stack.push((children[1 - side], middle, t1));
                    stack.push((children[side], t0, middle));
                }
            }
        }
        None
    }
}
