//! What one entity does through a level: states that hold from message to message, and how it gets
//! from one to the next.
//!
//! A key is made where the server's word changes. While message k is the newest, from its moment's
//! start to its time, an entity moves from where message k - 1 had it to where message k has it
//! (`CL_RelinkEntities`), monsters in steps of their own (`R_SetupEntityTransform`), and poses blend
//! (`R_SetupAliasFrame`).

use bsp::dem::{EntityState, EntityUpdate, effect, entity_flag};
use glam::Vec3;

/// Farthest that an entity moves along an axis from message to message; beyond that it jumps.
const LONGEST_MOVE: f32 = 100.0;
/// Seconds that a step or a change of pose takes if the server does not say.
pub const STEP_SECONDS: f64 = 0.1;
/// After so many seconds unseen an entity's pose is not blended.
const FORGET_SECONDS: f64 = 0.2;

/// The window of time in which a message is the newest one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// When it becomes the newest, timeline seconds.
    pub start: f64,
    /// Its own time, at which all is as it says.
    pub end: f64,
    /// The server's clock at its own time.
    pub clock: f64,
}

impl Window {
    /// Share of the way from the message before to this one.
    pub fn share(&self, t: f64) -> f32 {
        let length = self.end - self.start;
        if length <= 0.0 || t >= self.end {
            return 1.0;
        }
        ((t - self.start) / length).max(0.0) as f32
    }
}

/// Two frames of a model and how far it is from one to the other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameBlend {
    /// Frame that it comes from.
    pub from: u16,
    /// Frame that it goes to.
    pub to: u16,
    /// 0 is `from`, 1 is `to`.
    pub fraction: f32,
}

impl FrameBlend {
    /// One frame alone.
    pub fn still(frame: u16) -> Self {
        Self {
            from: frame,
            to: frame,
            fraction: 1.0,
        }
    }
}

/// A change of frame under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blend {
    from: u16,
    to: u16,
    begin: f64,
    end: f64,
    /// The next change is not blended.
    defer: bool,
}

impl Blend {
    /// A frame without a past.
    pub fn still(frame: u16) -> Self {
        Self {
            from: frame,
            to: frame,
            begin: 0.0,
            end: 0.0,
            defer: false,
        }
    }

    /// What follows on this when a message shows `frame`. `flash` is the flash of a weapon, whose
    /// flame would be drawn out by a blend; `end` is when the server wants the change done.
    pub fn next(self, frame: u16, flash: bool, window: &Window, end: Option<f64>) -> Self {
        if flash {
            return Self {
                defer: true,
                ..Self::still(frame)
            };
        }
        if frame == self.to {
            return self;
        }
        if self.defer {
            return Self::still(frame);
        }
        Self {
            from: self.to,
            to: frame,
            begin: window.start,
            end: end.unwrap_or(window.start + STEP_SECONDS),
            defer: false,
        }
    }

    /// Where the change is at `t`.
    pub fn at(&self, t: f64) -> FrameBlend {
        let length = self.end - self.begin;
        if length <= 0.0 || t >= self.end {
            return FrameBlend::still(self.to);
        }
        FrameBlend {
            from: self.from,
            to: self.to,
            fraction: ((t - self.begin) / length).max(0.0) as f32,
        }
    }
}

/// A place and a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Place {
    /// World space.
    pub origin: Vec3,
    /// Pitch, yaw, roll in degrees.
    pub angles: Vec3,
}

impl Place {
    fn of(state: &EntityState) -> Self {
        Self {
            origin: state.origin.into(),
            angles: state.angles.into(),
        }
    }

    /// Between two, angles the short way.
    pub fn lerp(self, to: Self, share: f32) -> Self {
        if share >= 1.0 {
            return to;
        }
        Self {
            origin: self.origin + (to.origin - self.origin) * share,
            angles: lerp_angles(self.angles, to.angles, share),
        }
    }
}

/// Between two angles in degrees, the short way.
pub fn lerp_angles(from: Vec3, to: Vec3, share: f32) -> Vec3 {
    let difference = to - from;
    let turns = ((difference + 180.0) / 360.0).floor();
    from + (difference - turns * 360.0) * share
}

/// Whether it is too far to have moved.
pub fn is_jump(from: Vec3, to: Vec3) -> bool {
    (to - from).abs().max_element() > LONGEST_MOVE
}

/// A step of an entity that moves in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    from: Place,
    begin: f64,
    end: f64,
}

/// What an entity is from a message on.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Number of the message among the timeline's moments.
    pub moment: u32,
    /// What the server says; `None` where the entity is not in the message.
    pub state: Option<EntityState>,
    /// Whether it moves here from the key before: it was there, and is not too far away.
    pub moves: bool,
    /// Since when it has moved without a jump, timeline seconds.
    pub since: f64,
    blend: Blend,
    step: Option<Step>,
}

/// All that happens to an entity.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Its number.
    pub number: u16,
    /// In the order of their moments.
    pub keys: Vec<Key>,
}

/// An entity at a moment, as far as its own track says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// What the server says.
    pub state: EntityState,
    /// Where it is.
    pub place: Place,
    /// Its frames.
    pub blend: FrameBlend,
    /// Since when it has moved without a jump, timeline seconds.
    pub since: f64,
}

impl Track {
    /// Notes that message `moment` has the entity. Gives whether that was news.
    pub fn see(
        &mut self,
        moment: u32,
        window: &Window,
        update: &EntityUpdate,
        last_seen: Option<f64>,
    ) -> bool {
        let state = &update.state;
        let last = self.keys.last();
        let before = last.filter(|k| k.state.is_some());
        if before.is_some_and(|k| k.state.as_ref() == Some(state)) {
            return false;
        }
        let known = self.keys.iter().rev().take(2).find_map(|k| {
            let state = k.state.as_ref()?;
            Some((state.model, k.blend))
        });
        let fresh = last_seen.is_some_and(|seen| window.clock - seen <= FORGET_SECONDS);
        let flash = state.effects & effect::MUZZLE_FLASH != 0;
        let finish = update.lerp_finish.map(|s| window.end + f64::from(s));
        let blend = match known {
            Some((model, blend)) if fresh && model == state.model => {
                blend.next(state.frame, flash, window, finish)
            }
            _ => Blend::still(state.frame).next(state.frame, flash, window, finish),
        };
        let place = Place::of(state);
        let old = before.and_then(|k| Some((k, k.state.as_ref()?)));
        // An entity that had no model was nowhere.
        let moves =
            old.is_some_and(|(_, s)| s.model != 0 && !is_jump(Vec3::from(s.origin), place.origin));
        let since = match old {
            Some((key, _)) if moves => key.since,
            _ => window.start,
        };
        let step = (state.flags & entity_flag::STEP != 0).then(|| {
            let still = Step {
                from: place,
                begin: window.start,
                end: window.start,
            };
            let Some((key, s)) = old.filter(|_| moves) else {
                return still;
            };
            if Place::of(s) == place {
                return key.step.unwrap_or(still);
            }
            Step {
                from: key.stepped(s, window.start),
                begin: window.start,
                end: finish.unwrap_or(window.start + STEP_SECONDS),
            }
        });
        self.keys.push(Key {
            moment,
            state: Some(*state),
            moves,
            since,
            blend,
            step,
        });
        true
    }

    /// Notes that message `moment` does not have the entity. Gives whether that was news.
    pub fn miss(&mut self, moment: u32) -> bool {
        let Some(key) = self.keys.last().filter(|k| k.state.is_some()) else {
            return false;
        };
        let absent = Key {
            moment,
            state: None,
            moves: false,
            step: None,
            ..key.clone()
        };
        self.keys.push(absent);
        true
    }

    /// Index of the key that holds in message `moment`.
    pub fn key_at(&self, moment: u32) -> Option<usize> {
        self.keys
            .partition_point(|k| k.moment <= moment)
            .checked_sub(1)
    }

    /// The entity at `t` in the window of message `moment`; `None` if the message does not have it.
    pub fn pose(&self, moment: u32, window: &Window, t: f64) -> Option<Pose> {
        self.pose_of(self.key_at(moment)?, moment, window, t)
    }

    /// The same with the number of the key that holds.
    pub fn pose_of(&self, index: usize, moment: u32, window: &Window, t: f64) -> Option<Pose> {
        let key = self.keys.get(index)?;
        let state = key.state?;
        let to = Place::of(&state);
        let place = if key.step.is_some() {
            key.stepped(&state, t)
        } else if key.moment == moment && key.moves {
            let before = index.checked_sub(1).and_then(|i| self.keys.get(i)?.state);
            before.map_or(to, |s| Place::of(&s).lerp(to, window.share(t)))
        } else {
            to
        };
        Some(Pose {
            state,
            place,
            blend: key.blend.at(t),
            since: key.since,
        })
    }

    /// The entity as it was last seen up to message `moment`, or first after it.
    pub fn last_seen(&self, moment: u32) -> Option<&EntityState> {
        let next = self.keys.partition_point(|k| k.moment <= moment);
        let (past, future) = self.keys.split_at(next);
        let past = past.iter().rev().find_map(|k| k.state.as_ref());
        past.or_else(|| future.iter().find_map(|k| k.state.as_ref()))
    }
}

impl Key {
    /// Where a step has led at `t`; `state` is this key's.
    fn stepped(&self, state: &EntityState, t: f64) -> Place {
        let to = Place::of(state);
        let Some(step) = self.step else {
            return to;
        };
        let length = step.end - step.begin;
        if length <= 0.0 || t >= step.end {
            return to;
        }
        step.from
            .lerp(to, ((t - step.begin) / length).max(0.0) as f32)
    }

    /// The way that it makes from here: from where, when, and until when; `None` if it stands.
    pub fn way(&self, before: Option<&Self>, window: &Window) -> Option<(Place, f64, f64)> {
        let state = self.state.as_ref()?;
        if let Some(step) = self.step {
            return (step.end > step.begin).then_some((step.from, step.begin, step.end));
        }
        let from = Place::of(before.filter(|_| self.moves)?.state.as_ref()?);
        (from.origin != Vec3::from(state.origin)).then_some((from, window.start, window.end))
    }
}
