//! A demo as a function of time: the state of everything at any moment, forwards, backwards and by
//! seeking.
//!
//! [`Timeline::new`] reads a demo once and keeps, for every entity, what changed and when. A
//! [`State`] is then computed from those tables and the time alone: nothing is carried over from one
//! moment to the next, so that it is the same however it is reached and whatever the frame rate.
//! Where the engine adds up frames (particles, trails, the eye on stairs, tints that fade), the
//! timeline has the limit for ever shorter ones in closed form; where the engine throws dice, each
//! throw is a function of what it is for.
//!
//! **Time.** Timeline seconds begin at 0 with the first message that shows entities and go on
//! through all levels ([`bsp::dem::clock_step`] says how). Message k is the newest from the time of
//! message k - 1 on, and all is as it says at its own time: pictures are one message late, as in the
//! engine, and effects appear where message k becomes the newest. After a gap of more than 0.1 s
//! things rest until 0.1 s before the message.

mod build;
mod events;
mod fog;
mod level;
mod particle;
mod seed;
mod state;
mod text;
mod tint;
mod track;
mod trail;
mod view;

pub use events::{Event, EventKind};
pub use fog::AskedFog;
pub use level::{Level, ModelName, Static};
pub use particle::{Particle, Trail};
pub use state::{Beam, BeamPart, DynamicLight, Entity, LightKind, Options, State, Unseen};
pub use tint::{Shift, Tint};
pub use track::FrameBlend;
pub use view::{View, ViewModel, axes};

use bsp::Warnings;
use bsp::dem::{ClientData, Demo};
use view::Moment;

/// A demo as a function of time.
#[derive(Clone, Debug, Default)]
pub struct Timeline {
    levels: Vec<Level>,
    moments: Vec<Moment>,
    /// The player's own data, each as long as it stays the same.
    clients: Vec<ClientData>,
}

impl Timeline {
    /// Reads a demo. `flags` are the flags of a model by its file's name where the file is at hand
    /// ([`bsp::mdl::flags`]); other models have those of the game's model of that name. `warnings`
    /// tells of what cannot be read.
    pub fn new(
        demo: &Demo<'_>,
        flags: &dyn Fn(&str) -> Option<u32>,
        warnings: &mut Warnings,
    ) -> Self {
        build::build(demo, flags, warnings)
    }

    /// The demo's levels, in order. A level that never shows an entity has no time.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Seconds that the demo plays for.
    pub fn duration(&self) -> f64 {
        self.moments.last().map_or(0.0, |m| m.window.end)
    }

    /// Number of messages that show entities.
    pub fn messages(&self) -> usize {
        self.moments.len()
    }

    /// The time of a message, less than [`Timeline::messages`].
    pub fn message_time(&self, message: usize) -> Option<f64> {
        self.moments.get(message).map(|m| m.window.end)
    }

    /// The time of the message with the most entities.
    pub fn busiest(&self) -> f64 {
        let most = self.moments.iter().rev().max_by_key(|m| m.entities);
        most.map_or(0.0, |m| m.window.end)
    }

    /// The level of [`Timeline::state_at`], without the work for the rest of it.
    pub fn level_at(&self, t: f64) -> Option<usize> {
        let index = self.message_at(t.clamp(0.0, self.duration()))?;
        Some(self.moments.get(index)?.level as usize)
    }

    /// What the server calls the sky's pictures at `t`, without the work for the rest of the state; `None` if it
    /// has not asked for any.
    pub fn sky_at(&self, t: f64) -> Option<&str> {
        let index = self.message_at(t.clamp(0.0, self.duration()))?;
        let level = self.levels.get(self.moments.get(index)?.level as usize)?;
        let next = level
            .sky_changes
            .partition_point(|(moment, _)| *moment as usize <= index);
        let (_, sky) = level.sky_changes.get(next.checked_sub(1)?)?;
        level.skies.get(*sky as usize).map(String::as_str)
    }

    /// The state at `t` seconds; before the beginning that of the beginning, after the end that of
    /// the end. `None` if the demo shows nothing at all.
    pub fn state_at(&self, t: f64, options: &Options) -> Option<State> {
        let t = t.clamp(0.0, self.duration());
        let index = self.message_at(t)?;
        Some(state::state(self, index, t, options))
    }

    /// The newest message at `t`.
    fn message_at(&self, t: f64) -> Option<usize> {
        let last = self.moments.len().checked_sub(1)?;
        let index = self.moments.partition_point(|m| m.window.end < t).min(last);
        let moment = self.moments.get(index)?;
        // The gap before it still belongs to the message before.
        let waits = t <= moment.window.start && t < moment.window.end;
        let before = index.checked_sub(1).filter(|_| waits);
        let before =
            before.filter(|&b| self.moments.get(b).is_some_and(|b| b.level == moment.level));
        Some(before.unwrap_or(index))
    }
}
