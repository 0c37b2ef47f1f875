//! Where to look from.

use crate::camera::{Camera, DEFAULT_FOV_DEG};
use bsp::Bsp;
use bsp::bsp::{TRACE_EPSILON, contents};
use bsp::entity::Entity;
use glam::{DVec3, Vec3};

/// Eyes above a player's origin.
const VIEW_HEIGHT: f32 = 22.0;
/// Engines move the eye by this much along each axis, so that it never lies in a liquid's surface.
const EYE_NUDGE: f32 = 1.0 / 32.0;
/// Starts are this far above where the level has them.
const START_LIFT: f32 = 1.0;
/// Arrivals of teleporters likewise.
const TELEPORT_LIFT: f32 = 27.0;

/// Farthest that a player who has just started falls before the first picture.
const MAX_FALL: f32 = 4096.0;

/// Classes of starts, the preferred one first.
const STARTS: [&str; 5] = [
    "info_player_start",
    "info_player_start2",
    "info_player_coop",
    "info_player_deathmatch",
    "testplayerstart",
];

/// All cameras of a level; the first one is the default. Never empty.
pub fn cameras(bsp: &Bsp, entities: &[Entity]) -> Vec<Camera> {
    let of_class = |class: &'static str| {
        entities
            .iter()
            .filter(move |e| e.classname() == class)
            .map(move |e| camera(bsp, e, class))
    };
    let mut out: Vec<Camera> = STARTS
        .into_iter()
        .find_map(|c| of_class(c).next())
        .into_iter()
        .collect();
    out.extend(of_class("info_intermission"));
    out.extend(of_class("info_teleport_destination"));
    if out.is_empty() || !out.iter().any(|c| !c.name.starts_with("info_teleport")) {
        out.insert(0, middle(bsp));
    }
    out
}

fn camera(bsp: &Bsp, entity: &Entity, class: &str) -> Camera {
    let origin = Vec3::from(entity.origin());
    let yaw = entity.angles_deg().map_or(0.0, |a| a[1]);
    let standing = |feet_z: f32, position: Vec3| {
        (position + Vec3::Z * (feet_z + VIEW_HEIGHT), [0.0, yaw, 0.0])
    };
    let (eye, [pitch_deg, yaw_deg, roll_deg]) = match class {
        "info_intermission" => {
            // Pitch, yaw, roll, whatever the editors' help says.
            let angles = entity.vec3("mangle").unwrap_or([0.0, yaw, 0.0]);
            (origin, angles)
        }
        "info_teleport_destination" => standing(TELEPORT_LIFT, origin),
        _ => standing(0.0, landed(bsp, origin + Vec3::Z * START_LIFT)),
    };
    Camera {
        name: class.to_owned(),
        position: eye + EYE_NUDGE,
        pitch_deg,
        yaw_deg,
        roll_deg,
        fov_deg: DEFAULT_FOV_DEG,
        lens: None,
    }
}

/// Where a player that starts here stands a moment later: hull 1 moves the player's own origin.
fn landed(bsp: &Bsp, start: Vec3) -> Vec3 {
    let end = start - Vec3::Z * MAX_FALL;
    match bsp.trace(0, 1, start.to_array(), end.to_array()) {
        // The trace stops a little above the floor, and players settle on it.
        Some(trace) if !trace.start_solid && trace.fraction < 1.0 => {
            let fall = trace.fraction * f64::from(MAX_FALL) + TRACE_EPSILON;
            start - Vec3::Z * fall as f32
        }
        _ => start,
    }
}

/// A camera in the open near the middle of the level, for levels without any start.
fn middle(bsp: &Bsp) -> Camera {
    let world = &bsp.models[0];
    let clean =
        |v: [f32; 3]| DVec3::from(v.map(|c| if c.is_finite() { f64::from(c) } else { 0.0 }));
    let centre = (clean(world.mins) + clean(world.maxs)) / 2.0;
    let is_open = |p: DVec3| bsp.point_contents(0, p.as_vec3().to_array()) == Some(contents::EMPTY);
    let position = if is_open(centre) {
        centre
    } else {
        bsp.leafs
            .iter()
            .filter(|l| l.contents == contents::EMPTY)
            .map(|l| (clean(l.mins) + clean(l.maxs)) / 2.0)
            .filter(|&p| is_open(p))
            .min_by(|a, b| {
                let d = |p: &DVec3| p.distance_squared(centre);
                d(a).total_cmp(&d(b))
            })
            .unwrap_or(centre)
    };
    Camera {
        name: "middle of the level".to_owned(),
        position: position.as_vec3(),
        pitch_deg: 0.0,
        yaw_deg: 0.0,
        roll_deg: 0.0,
        fov_deg: DEFAULT_FOV_DEG,
        lens: None,
    }
}
