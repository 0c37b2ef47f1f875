//! Guards against level files made to take time.

use bsp::Bsp;
use bsp::bsp::NodeChild;

/// Deepest tree that is asked for contents; compilers make trees of a few dozen levels, and every
/// question walks down one.
const MAX_DEPTH: u32 = 512;

/// Whether both trees of a level are shallow enough to be asked often.
pub fn are_shallow(bsp: &Bsp) -> bool {
    let nodes = is_shallow(bsp.nodes.len(), |i| {
        bsp.nodes[i].children.map(|c| match c {
            NodeChild::Node(n) => Some(n as usize),
            NodeChild::Leaf(_) => None,
        })
    });
    let clipnodes = || {
        is_shallow(bsp.clipnodes.len(), |i| {
            bsp.clipnodes[i].children.map(|c| usize::try_from(c).ok())
        })
    };
    nodes && clipnodes()
}

/// Whether no way down from any node is longer than [`MAX_DEPTH`]; loops are. Each node is visited
/// once, without recursion.
fn is_shallow(count: usize, children: impl Fn(usize) -> [Option<usize>; 2]) -> bool {
    const NEW: u32 = 0;
    const OPEN: u32 = u32::MAX;
    // Height of the tree below each node once it is known, at least 1.
    let mut height = vec![NEW; count];
    let mut stack = Vec::new();
    for root in 0..count {
        if height[root] != NEW {
            continue;
        }
        stack.push(root);
        while let Some(&node) = stack.last() {
            let below = children(node).into_iter().flatten();
            if height[node] == NEW {
                height[node] = OPEN;
                for child in below {
                    match height.get(child) {
                        Some(&NEW) => stack.push(child),
                        Some(&OPEN) | None => return false,
                        Some(_) => {}
                    }
                }
                continue;
            }
            stack.pop();
            if height[node] != OPEN {
                continue;
            }
            let tallest = below.map(|c| height[c]).max().unwrap_or(0);
            if tallest >= MAX_DEPTH {
                return false;
            }
            height[node] = tallest + 1;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_and_long_chains_are_found_and_shared_children_are_not() {
        let chain = |n: usize| is_shallow(n, |i| [(i + 1 < n).then_some(i + 1), None]);
        assert!(chain(512));
        assert!(!chain(513));
        assert!(!is_shallow(3, |i| [Some((i + 1) % 3), None]));
        // Both sides of each node lead to the next one: 2^100 ways, 100 nodes.
        assert!(is_shallow(100, |i| [(i < 99).then_some(i + 1); 2]));
    }
}
