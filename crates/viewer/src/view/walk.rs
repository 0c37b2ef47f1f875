//! Walking through a level as a player does: the engine's rules for its box of 32 by 32 by 56 units.
//!
//! After `sv_user.c` and `sv_phys.c` of Quake's released source, in steps of a fixed time, so that the same
//! controls lead to the same place at any frame rate.

use super::fly::{Controls, Eye};
use bsp::Bsp;
use bsp::bsp::contents;
use bsp::entity::Entity;
use glam::Vec3;

/// Seconds of a step: the engine's highest frame rate.
pub const STEP: f32 = 1.0 / 72.0;
/// Eyes above a player's origin.
pub const VIEW_HEIGHT: f32 = 22.0;

const GRAVITY: f32 = 800.0;
const MAX_SPEED: f32 = 320.0;
const ACCELERATE: f32 = 10.0;
const FRICTION: f32 = 4.0;
/// Friction is so many times as strong at the edge of a drop.
const EDGE_FRICTION: f32 = 2.0;
const STOP_SPEED: f32 = 100.0;
const JUMP: f32 = 270.0;
const STEP_HEIGHT: f32 = 18.0;
/// In the air so much of the wished speed counts.
const AIR_SPEED: f32 = 30.0;
/// Flatter than this is floor: the Z of its normal.
const FLOOR: f32 = 0.7;
/// Share of the speed that is left in water.
const WATER: f32 = 0.7;
/// Idle swimmers sink by this.
const SINK: f32 = 60.0;
/// Planes a move slides along at most.
const MAX_SLIDES: usize = 4;
/// Eyes follow stairs at this many units per second, and are never farther behind than this.
const STAIR: [f32; 2] = [80.0, 12.0];

/// How a move of the player's box ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// How far it came: 1 is all the way.
    pub fraction: f32,
    /// Where it ended.
    pub end: Vec3,
    /// Normal of what it hit.
    pub normal: Vec3,
    /// Whether it began inside of something.
    pub stuck: bool,
}

/// What players walk in.
pub trait Ground {
    /// Moves the player's box.
    fn trace(&self, from: Vec3, to: Vec3) -> Hit;
    /// Whether a point is in a liquid.
    fn is_liquid(&self, point: Vec3) -> bool;
}

/// A level and those of its brush models that stand in the way.
pub struct Walls<'a> {
    bsp: &'a Bsp,
    /// Number and origin of each, the world first.
    solid: Vec<(usize, Vec3)>,
}

impl<'a> Walls<'a> {
    /// The walls of a level; `None` where it has no hull that players can walk in.
    #[must_use]
    pub fn of(bsp: &'a Bsp, entities: &[Entity]) -> Option<Self> {
        // A tree that is a single cell, or that can't be walked.
        let there = bsp.models.first()?.head_nodes[1] >= 0;
        let origin = [0.0; 3];
        if !there || bsp.trace(0, 1, origin, origin).is_none() {
            return None;
        }
        let brush = |e: &Entity| {
            let class = e.classname();
            let solid = class.starts_with("func_") && class != "func_illusionary";
            let model = e.get("model")?.strip_prefix('*')?.parse::<usize>().ok()?;
            (solid && model < bsp.models.len()).then(|| (model, Vec3::from(e.origin())))
        };
        let mut solid = vec![(0, Vec3::ZERO)];
        solid.extend(entities.iter().filter_map(brush));
        Some(Self { bsp, solid })
    }
}

impl Ground for Walls<'_> {
    fn trace(&self, from: Vec3, to: Vec3) -> Hit {
        let mut nearest = Hit {
            fraction: 1.0,
            end: to,
            normal: Vec3::ZERO,
            stuck: false,
        };
        for &(model, origin) in &self.solid {
            let [a, b] = [from, to].map(|p| (p - origin).to_array());
            let Some(trace) = self.bsp.trace(model, 1, a, b) else {
                continue;
            };
            nearest.stuck |= trace.start_solid;
            if (trace.fraction as f32) < nearest.fraction {
                nearest.fraction = trace.fraction as f32;
                nearest.end = Vec3::from(trace.end) + origin;
                nearest.normal = trace.normal.map_or(Vec3::ZERO, Vec3::from);
            }
        }
        nearest
    }

    fn is_liquid(&self, point: Vec3) -> bool {
        (self.bsp.point_contents(0, point.to_array())).is_some_and(contents::is_liquid)
    }
}

/// A walking player.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walker {
    /// The player's origin, 24 above the soles.
    pub origin: Vec3,
    /// Units per second.
    pub velocity: Vec3,
    /// Whether it stands on something.
    pub on_ground: bool,
    /// How far the eyes are behind on stairs.
    lag: f32,
    /// Time that no step has used yet.
    left: f32,
}

impl Walker {
    /// A player with its eyes there.
    #[must_use]
    pub fn at(eye: &Eye) -> Self {
        Self {
            origin: eye.position - Vec3::Z * VIEW_HEIGHT,
            velocity: Vec3::ZERO,
            on_ground: false,
            lag: 0.0,
            left: 0.0,
        }
    }

    /// Walks for so many seconds and takes the eye along. `false` while it is stuck in something:
    /// then it stays, and whoever leads it may fly out.
    pub fn walk(
        &mut self,
        ground: &dyn Ground,
        eye: &mut Eye,
        controls: &Controls,
        seconds: f32,
    ) -> bool {
        /// A longer pause than this is not caught up with.
        const MOST: f32 = 0.25;
        if ground.trace(self.origin, self.origin).stuck {
            return false;
        }
        self.left = (self.left + seconds).min(MOST);
        while self.left >= STEP {
            self.left -= STEP;
            self.step(ground, eye, controls);
        }
        eye.position = self.origin + Vec3::Z * (VIEW_HEIGHT - self.lag);
        true
    }

    /// One step of [`STEP`] seconds.
    fn step(&mut self, ground: &dyn Ground, eye: &Eye, controls: &Controls) {
        let in_water = ground.is_liquid(self.origin);
        if in_water {
            self.swim(eye, controls);
            self.slide(ground);
            self.on_ground = false;
            return;
        }
        if controls.up > 0.0 && self.on_ground {
            self.velocity.z += JUMP;
            self.on_ground = false;
        }
        let [forward, right, _] = Eye {
            pitch: 0.0,
            roll: 0.0,
            ..*eye
        }
        .axes();
        let wish = forward * controls.forward + right * controls.right;
        let pace = if controls.fast { 1.0 } else { 0.625 };
        let wish = wish.clamp_length_max(1.0) * MAX_SPEED * pace;
        if self.on_ground {
            self.rub(ground);
            self.accelerate(wish, wish.length());
        } else {
            self.accelerate(wish, wish.length().min(AIR_SPEED));
        }
        self.velocity.z -= GRAVITY * STEP;
        self.lag = (self.lag - STAIR[0] * STEP).max(0.0);
        self.step_or_slide(ground);
    }

    /// Speed is taken up towards `wish`, to at most `speed` along it.
    fn accelerate(&mut self, wish: Vec3, speed: f32) {
        let direction = wish.normalize_or_zero();
        let missing = speed - self.velocity.dot(direction);
        if missing > 0.0 {
            let gain = ACCELERATE * wish.length() * STEP;
            self.velocity += direction * gain.min(missing);
        }
    }

    /// The floor takes speed, more at the edge of a drop.
    fn rub(&mut self, ground: &dyn Ground) {
        let flat = Vec3::new(self.velocity.x, self.velocity.y, 0.0);
        let speed = flat.length();
        if speed == 0.0 {
            return;
        }
        let ahead = self.origin + flat / speed * 16.0;
        let drop = ground.trace(ahead, ahead - Vec3::Z * (24.0 + 34.0));
        let edge = if drop.fraction >= 1.0 {
            EDGE_FRICTION
        } else {
            1.0
        };
        let lost = speed.max(STOP_SPEED) * FRICTION * edge * STEP;
        let share = (speed - lost).max(0.0) / speed;
        self.velocity.x *= share;
        self.velocity.y *= share;
    }

    fn swim(&mut self, eye: &Eye, controls: &Controls) {
        let [forward, right, _] = eye.axes();
        let wish = forward * controls.forward + right * controls.right + Vec3::Z * controls.up;
        let idle = controls.forward == 0.0 && controls.right == 0.0 && controls.up == 0.0;
        let wish = if idle {
            Vec3::NEG_Z * SINK
        } else {
            wish.clamp_length_max(1.0) * MAX_SPEED
        } * WATER;
        let speed = self.velocity.length();
        if speed > 0.0 {
            let share = (1.0 - FRICTION * STEP).max(0.0);
            self.velocity *= share;
        }
        self.accelerate(wish, wish.length());
    }

    /// Moves along floors and walls, and over what is no higher than a step.
    fn step_or_slide(&mut self, ground: &dyn Ground) {
        let before = *self;
        let was_on_ground = self.on_ground;
        self.on_ground = false;
        let wall = self.slide(ground);
        if !wall || !was_on_ground {
            return;
        }
        let flat = *self;
        // Once more from one step higher.
        *self = before;
        let up = ground.trace(self.origin, self.origin + Vec3::Z * STEP_HEIGHT);
        self.origin = up.end;
        self.velocity.z = 0.0;
        self.slide(ground);
        let fall = STEP_HEIGHT - before.velocity.z.min(0.0) * STEP;
        let down = ground.trace(self.origin, self.origin - Vec3::Z * fall);
        let way = |w: &Self| (w.origin - before.origin).truncate().length_squared();
        if down.stuck || down.normal.z <= FLOOR || way(self) <= way(&flat) {
            *self = flat;
            return;
        }
        self.origin = down.end;
        self.on_ground = true;
        self.velocity.z = 0.0;
        let risen = self.origin.z - before.origin.z;
        self.lag = (self.lag + risen.max(0.0)).min(STAIR[1]);
    }

    /// Moves for one step, along what is in the way. Whether a wall was in the way.
    fn slide(&mut self, ground: &dyn Ground) -> bool {
        let wanted = self.velocity;
        let mut planes: Vec<Vec3> = Vec::new();
        let (mut left, mut wall) = (STEP, false);
        for _ in 0..MAX_SLIDES {
            if self.velocity == Vec3::ZERO {
                break;
            }
            let hit = ground.trace(self.origin, self.origin + self.velocity * left);
            if hit.stuck {
                self.velocity = Vec3::ZERO;
                return wall;
            }
            if hit.fraction > 0.0 {
                self.origin = hit.end;
                if hit.fraction >= 1.0 {
                    break;
                }
                planes.clear();
            }
            if hit.normal.z > FLOOR {
                self.on_ground = true;
            } else {
                wall = true;
            }
            left *= 1.0 - hit.fraction;
            planes.push(hit.normal);
            let along = planes.iter().map(|n| clipped(self.velocity, *n));
            let free = |v: &Vec3| planes.iter().all(|n| v.dot(*n) >= -1e-3);
            self.velocity = match (along.into_iter().find(free), planes.as_slice()) {
                (Some(velocity), _) => velocity,
                // Along the crease of two.
                (None, [a, b]) => {
                    let crease = a.cross(*b).normalize_or_zero();
                    crease * crease.dot(self.velocity)
                }
                (None, _) => Vec3::ZERO,
            };
            // Never back: that would shake in corners.
            if self.velocity.dot(wanted) <= 0.0 {
                self.velocity = Vec3::ZERO;
            }
        }
        wall
    }
}

/// A velocity without what goes into a plane.
fn clipped(velocity: Vec3, normal: Vec3) -> Vec3 {
    velocity - normal * velocity.dot(normal)
}

#[cfg(test)]
mod tests;
