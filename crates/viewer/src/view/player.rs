//! A demo that is played.

use scene::timeline::{Options, State, Timeline, Unseen};
use std::sync::Arc;

/// A demo, and where it is.
#[derive(Clone, Debug)]
pub struct Player {
    /// Its name or file.
    pub demo: String,
    /// The demo as a function of time.
    pub timeline: Arc<Timeline>,
    /// Seconds of the demo.
    pub time: f64,
    /// Seconds of the demo in a second; less than 0 plays backwards.
    pub speed: f64,
    /// Whether time passes.
    pub plays: bool,
    /// Whether the eye is the player's.
    pub follows: bool,
}

impl Player {
    /// A demo that waits at a time.
    #[must_use]
    pub fn new(demo: String, timeline: Arc<Timeline>, time: f64) -> Self {
        let mut player = Self {
            demo,
            timeline,
            time: 0.0,
            speed: 1.0,
            plays: false,
            follows: true,
        };
        player.seek(time);
        player
    }

    /// Goes to a time, or to the nearest that the demo has.
    pub fn seek(&mut self, time: f64) {
        self.time = time.clamp(0.0, self.timeline.duration());
    }

    /// Time passes. At either end the demo stops.
    pub fn pass(&mut self, seconds: f32) {
        if self.plays {
            let next = self.time + f64::from(seconds) * self.speed;
            self.seek(next);
            self.plays = next == self.time;
        }
    }

    /// Everything at this time. A free eye sees what the player did not.
    #[must_use]
    pub fn state(&self) -> Option<State> {
        let options = Options {
            unseen: if self.follows {
                Unseen::Hidden
            } else {
                Unseen::All
            },
            ..Options::default()
        };
        self.timeline.state_at(self.time, &options)
    }
}
