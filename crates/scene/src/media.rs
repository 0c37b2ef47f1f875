//! Which liquid fills the space at a point.

use crate::cells::{CELL, CellNode};
use crate::material::MaterialId;
use glam::Vec3;

/// A partition of space into what absorbs light and what does not. It is asked for one point per
/// picture, the camera's; from there on a ray knows what it is in by the interfaces it passes.
#[derive(Clone, Debug, Default)]
pub struct Media {
    /// Splits, the first one at the root; children come after their parents. A child that is no
    /// node is a number with [`CELL`] added: 0 for free space, else one more than the number of the
    /// material whose [`crate::material::Finish::absorption`] is there. Empty if there is nothing.
    pub nodes: Vec<CellNode>,
}

impl Media {
    /// The material that fills the space at `point`, which absorbs.
    #[must_use]
    pub fn at(&self, point: Vec3) -> Option<MaterialId> {
        let mut at = 0;
        while at & CELL == 0 {
            // A node that leads nowhere, or back, leads to free space.
            let node = self.nodes.get(at as usize)?;
            let is_behind = node.normal.dot(point) <= node.distance;
            let child = node.children[usize::from(is_behind)];
            if child & CELL == 0 && child <= at {
                return None;
            }
            at = child;
        }
        (at & !CELL).checked_sub(1).map(MaterialId)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_in_what_the_planes_say() {
        let node = |normal, distance, children| CellNode {
            normal,
            distance,
            children,
        };
        let mut media = Media::default();
        assert_eq!(media.at(Vec3::ZERO), None);
        // Water below 10, left of 5.
        media.nodes = vec![
            node(Vec3::Z, 10.0, [CELL, 1]),
            node(Vec3::X, 5.0, [CELL, CELL | 8]),
        ];
        assert_eq!(media.at(Vec3::new(0.0, 0.0, 9.0)), Some(MaterialId(7)));
        assert_eq!(media.at(Vec3::new(6.0, 0.0, 9.0)), None);
        assert_eq!(media.at(Vec3::new(0.0, 0.0, 11.0)), None);
        // A loop ends.
        media.nodes[1].children[1] = 0;
        assert_eq!(media.at(Vec3::ZERO), None);
    }
}
