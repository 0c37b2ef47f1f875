//! Rays against triangles, for those who want the judge's watertight intersection without its paths.

use crate::bvh::{Bvh, Hit, MAX_TRIANGLES, Stack};
use crate::triangle::{PackedTriangle, Ray};
use glam::{DVec3, Vec3};
use std::cell::RefCell;

/// A triangle that rays are looked up against.
#[derive(Clone, Copy, Debug)]
pub struct Occluder {
    /// Corners; triangles that are not finite are left out.
    pub corners: [Vec3; 3],
    /// Whether the caller decides at each hit if it is there.
    pub is_asked: bool,
}

/// Where a ray meets an [`Occluder`].
#[derive(Clone, Copy, Debug)]
pub struct OccluderHit {
    /// Its number.
    pub index: usize,
    /// Weights of its three corners.
    pub weights: [f64; 3],
}

/// Triangles made ready for rays; both sides stop them.
#[derive(Debug)]
pub struct Occluders {
    bvh: Bvh,
    /// By slot, the number of the triangle.
    order: Vec<u32>,
}

thread_local! {
    static STACK: RefCell<Stack> = RefCell::default();
}

impl Occluders {
    /// Builds the hierarchy over `triangles`. Beyond 2^27 of them the rest is left out.
    #[must_use]
    pub fn new(triangles: &[Occluder]) -> Self {
        let (numbers, packed): (Vec<u32>, Vec<PackedTriangle>) = (0..)
            .zip(triangles)
            .filter(|(_, t)| t.corners.iter().all(|c| c.is_finite()))
            .take(MAX_TRIANGLES)
            .map(|(i, t)| {
                let corners = t.corners.map(|c| c.to_array());
                (i, PackedTriangle::new(corners, t.is_asked))
            })
            .unzip();
        let (bvh, order) = Bvh::build(&packed);
        Self {
            bvh,
            order: order.iter().map(|&i| numbers[i as usize]).collect(),
        }
    }

    /// Whether a triangle is between two points; `is_there` is asked about some.
    pub fn is_blocked(
        &self,
        from: DVec3,
        to: DVec3,
        is_there: impl Fn(OccluderHit) -> bool,
    ) -> bool {
        let distance = from.distance(to);
        if distance == 0.0 {
            return false;
        }
        let ray = Ray::new(from, (to - from) / distance);
        STACK.with_borrow_mut(|stack| {
            (self.bvh).any_hit(&ray, distance, stack, |hit| is_there(self.hit(hit)))
        })
    }

    /// The nearest triangle in the unit direction `direction`; `is_there` is asked about some.
    pub fn nearest(
        &self,
        from: DVec3,
        direction: DVec3,
        is_there: impl Fn(OccluderHit) -> bool,
    ) -> Option<OccluderHit> {
        let ray = Ray::new(from, direction);
        STACK.with_borrow_mut(|stack| {
            (self.bvh)
                .closest_hit(&ray, f64::INFINITY, stack, |hit| is_there(self.hit(hit)))
                .map(|hit| self.hit(&hit))
        })
    }

    fn hit(&self, hit: &Hit) -> OccluderHit {
        OccluderHit {
            index: self.order[hit.slot as usize] as usize,
            weights: hit.at.weights,
        }
    }
}
