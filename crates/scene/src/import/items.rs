//! Item boxes: pickups and barrels that are brush models of their own (`maps/b_*.bsp`).

use super::poses::{Pose, appears};
use bsp::Bsp;
use bsp::entity::Entity;
use glam::Vec3;

/// How far items fall at most, in world units.
const MAX_DROP: f32 = 256.0;
/// From the corner of an item's box (0,0,0 to 32,32,56) to the point that hull 1 moves.
const CORNER_TO_HULL: Vec3 = Vec3::new(16.0, 16.0, 24.0);

/// An item box as the level has it.
pub struct Item<'a> {
    /// File with the brush model.
    pub file: &'static str,
    /// Class of the entity.
    pub classname: &'a str,
    /// Corner of the box before it falls, world space.
    pub origin: Vec3,
    /// Rotation about +Z through the corner, degrees.
    pub yaw_deg: f32,
}

/// The item boxes that appear at `skill`.
pub fn items(entities: &[Entity], skill: u32) -> impl Iterator<Item = Item<'_>> {
    entities
        .iter()
        .skip(1)
        .filter(move |e| appears(e, skill))
        .filter_map(|e| {
            Some(Item {
                file: file(e)?,
                classname: e.classname(),
                // Items start 6 units up and barrels 2, so that one standing in the floor by a
                // rounding error falls too.
                origin: Vec3::from(e.origin())
                    + Vec3::Z * if is_barrel(e.classname()) { 2.0 } else { 6.0 },
                yaw_deg: e.angles_deg().map_or(0.0, |a| a[1]),
            })
        })
}

fn is_barrel(classname: &str) -> bool {
    classname.starts_with("misc_explobox")
}

/// The model of an entity that is an item box (the game code's own table).
fn file(entity: &Entity) -> Option<&'static str> {
    let flags = entity.spawnflags();
    let big = |small, big| if flags & 1 != 0 { big } else { small };
    Some(match entity.classname() {
        "item_health" if flags & 1 != 0 => "maps/b_bh10.bsp",
        "item_health" if flags & 2 != 0 => "maps/b_bh100.bsp",
        "item_health" => "maps/b_bh25.bsp",
        "item_shells" => big("maps/b_shell0.bsp", "maps/b_shell1.bsp"),
        "item_spikes" => big("maps/b_nail0.bsp", "maps/b_nail1.bsp"),
        "item_rockets" => big("maps/b_rock0.bsp", "maps/b_rock1.bsp"),
        "item_cells" => big("maps/b_batt0.bsp", "maps/b_batt1.bsp"),
        // The ammunition box of early levels.
        "item_weapon" => match (flags & 7, flags & 8 != 0) {
            (1, false) => "maps/b_shell0.bsp",
            (1, true) => "maps/b_shell1.bsp",
            (2, false) => "maps/b_rock0.bsp",
            (2, true) => "maps/b_rock1.bsp",
            (4, false) => "maps/b_nail0.bsp",
            (4, true) => "maps/b_nail1.bsp",
            _ => return None,
        },
        "misc_explobox" => "maps/b_explob.bsp",
        "misc_explobox2" => "maps/b_exbox2.bsp",
        _ => return None,
    })
}

/// Where an item comes to rest. One that starts in solid or finds no floor stays where the level
/// has it: engines would remove it, a picture rather shows it.
pub fn rest(bsp: &Bsp, poses: &[Pose<'_>], origin: Vec3) -> Vec3 {
    let mapped = origin;
    let is_below = |model: usize, offset: Vec3| {
        let (Some(model), point) = (bsp.models.get(model), origin - offset) else {
            return false;
        };
        // Hull 1 is grown by a player's half width.
        let grown = |c: f32, sign: f32| c + sign * 48.0;
        point.x >= grown(model.mins[0], -1.0)
            && point.x <= grown(model.maxs[0], 1.0)
            && point.y >= grown(model.mins[1], -1.0)
            && point.y <= grown(model.maxs[1], 1.0)
    };
    let grown = bsp.hull_contents(0, 1, origin.to_array()).is_some();
    // Without clip hulls a point in the middle of the box's bottom has to do.
    let (number, from_corner) = if grown {
        (1, CORNER_TO_HULL)
    } else {
        (0, Vec3::new(16.0, 16.0, 0.0))
    };
    let start = origin + from_corner;
    let world = std::iter::once((0, Vec3::ZERO));
    let solids = (poses.iter()).filter(|p| p.solid && is_below(p.model, p.offset));
    let mut fall = 1.0_f64;
    for (model, offset) in world.chain(solids.map(|p| (p.model, p.offset))) {
        let from = start - offset;
        let to = from - Vec3::Z * MAX_DROP;
        match bsp.trace(model, number, from.to_array(), to.to_array()) {
            Some(trace) if trace.start_solid => return mapped,
            Some(trace) => fall = fall.min(trace.fraction),
            None => {}
        }
    }
    if fall >= 1.0 {
        return mapped;
    }
    origin - Vec3::Z * (fall as f32 * MAX_DROP)
}
