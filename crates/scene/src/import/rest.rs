//! Where things come to rest when a level begins.

use super::inhabitants::Rest;
use super::poses::Pose;
use bsp::Bsp;
use bsp::bsp::HULL_BOXES;
use glam::Vec3;

/// How far things fall at most, in world units.
const MAX_DROP: f32 = 256.0;

/// Where what stands at `origin` comes to rest. What starts in solid or finds no floor stays where the
/// level has it: engines would remove it, a picture rather shows it.
pub fn at_rest(bsp: &Bsp, poses: &[Pose<'_>], origin: Vec3, rest: Rest) -> Vec3 {
    let Some((raise, hull, to_hull)) = rest.fall() else {
        return origin;
    };
    let raised = origin + Vec3::Z * raise;
    let (low, high) = HULL_BOXES[hull];
    let is_grown = bsp.hull_contents(0, hull, raised.to_array()).is_some();
    // Without clip hulls a point in the middle of the box's bottom has to do.
    let (hull, start) = if is_grown {
        (hull, raised + to_hull)
    } else {
        (0, raised + to_hull + Vec3::Z * low[2])
    };
    let is_below = |model: usize, offset: Vec3| {
        let (Some(model), p) = (bsp.models.get(model), (start - offset).to_array()) else {
            return false;
        };
        (0..2).all(|axis| {
            p[axis] + high[axis] >= model.mins[axis] - 1.0
                && p[axis] + low[axis] <= model.maxs[axis] + 1.0
        })
    };
    let world = std::iter::once((0, Vec3::ZERO));
    let solids = (poses.iter()).filter(|p| p.solid && is_below(p.model, p.offset));
    let mut fall = 1.0_f64;
    for (model, offset) in world.chain(solids.map(|p| (p.model, p.offset))) {
        let from = start - offset;
        let to = from - Vec3::Z * MAX_DROP;
        match bsp.trace(model, hull, from.to_array(), to.to_array()) {
            Some(trace) if trace.start_solid => return origin,
            Some(trace) => fall = fall.min(trace.fraction),
            None => {}
        }
    }
    if fall >= 1.0 {
        return origin;
    }
    raised - Vec3::Z * (fall as f32 * MAX_DROP)
}
