//! A demo that is played.

use crate::clip::{Ratio, Steps};
use scene::timeline::{Event, Options, State, Timeline, Unseen};
use std::sync::Arc;

const MICROSECOND: f64 = 1e-6;

/// The time of a film's first frame that begins nearest to a time.
fn sayable(time: f64) -> f64 {
    let fps = crate::view::look::demo_defaults().clip.fps;
    Ratio::of(time).map_or(time, |from| Steps { from, fps }.time(0))
}

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
    /// Whether an eye that is not the player's goes where the player goes.
    pub along: bool,
    /// The part that was marked: its first and its last second.
    pub marked: Option<[f64; 2]>,
    /// What happens in it.
    pub events: Arc<[Event]>,
}

impl Player {
    /// A demo that waits at a time.
    #[must_use]
    pub fn new(demo: String, timeline: Arc<Timeline>, time: f64) -> Self {
        let mut player = Self {
            demo,
            events: timeline.events().into(),
            marked: None,
            timeline,
            time: 0.0,
            speed: 1.0,
            plays: false,
            follows: true,
            along: false,
        };
        player.seek(time);
        player
    }

    /// Goes to a time, or to the nearest that the demo has and a command line can say: whole microseconds.
    pub fn seek(&mut self, time: f64) {
        let end = self.timeline.duration();
        let time = time.clamp(0.0, end);
        let said = sayable(time);
        // A film has no frame at the very end.
        self.time = if said >= end && end > 2.0 * MICROSECOND {
            sayable(end - MICROSECOND)
        } else {
            said
        };
    }

    /// Marks the part between two times.
    pub fn mark(&mut self, from: f64, to: f64) {
        let [from, to] = [from, to].map(|t| t.clamp(0.0, self.timeline.duration()));
        self.marked = (from != to).then(|| [from.min(to), from.max(to)]);
    }

    /// Marks where the part begins, or where it ends. What was marked on its other side is moved along where
    /// it must.
    pub fn mark_here(&mut self, begins: bool) {
        let all = self.timeline.duration();
        let [from, to] = self.marked.unwrap_or([0.0, all]);
        if begins {
            let to = if to > self.time { to } else { all };
            self.mark(self.time, to);
        } else {
            let from = if from < self.time { from } else { 0.0 };
            self.mark(from, self.time);
        }
    }

    /// Goes to what happens next, or before.
    pub fn go_to_event(&mut self, next: bool) {
        let (now, events) = (self.time, Arc::clone(&self.events));
        // Half a frame: where one has just gone to is not gone to again.
        let found = if next {
            events.iter().find(|e| e.time > now + 0.01)
        } else {
            events.iter().rev().find(|e| e.time < now - 0.01)
        };
        if let Some(event) = found {
            self.seek(event.time);
        }
    }

    /// Plays, or stops. At the end that is played to it begins at the other one.
    pub fn play_or_stop(&mut self) {
        self.plays = !self.plays;
        if self.plays {
            let before = self.time;
            self.pass(0.01);
            let moves = self.plays;
            self.time = before;
            if !moves {
                let end = self.timeline.duration();
                self.seek(if self.speed < 0.0 { end } else { 0.0 });
                self.plays = true;
            }
        }
    }

    /// Time passes. At either end the demo stops.
    pub fn pass(&mut self, seconds: f32) {
        if self.plays {
            let next = self.time + f64::from(seconds) * self.speed;
            self.seek(next);
            self.plays = (0.0..self.timeline.duration()).contains(&next);
        }
    }

    /// The level of this time, and the name of its skybox if the server asks for one.
    #[must_use]
    pub fn place(&self) -> Option<(usize, Option<String>)> {
        let level = self.timeline.level_at(self.time)?;
        let sky = self.timeline.sky_at(self.time);
        Some((level, sky.map(str::to_owned)))
    }

    /// What is seen that the server did not send: by a free eye all of it.
    #[must_use]
    pub fn unseen(&self) -> Unseen {
        if self.follows {
            Unseen::Hidden
        } else {
            Unseen::All
        }
    }

    /// Everything at this time.
    #[must_use]
    pub fn state(&self) -> Option<State> {
        let options = Options {
            unseen: self.unseen(),
            ..Options::default()
        };
        self.timeline.state_at(self.time, &options)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::timeline::EventKind;

    #[test]
    fn parts_are_marked_and_events_found() {
        let demo = bsp::dem::Demo::parse(
            crate::bundled::DEMO,
            &bsp::Limits::default(),
            &mut bsp::Warnings::new(),
        );
        let none = &|_: &str| None;
        let timeline = Timeline::new(&demo.unwrap(), none, &mut bsp::Warnings::new());
        let all = timeline.duration();
        let mut player = Player::new("a.dem".into(), Arc::new(timeline), 2.0);
        assert_eq!(player.events[0].kind, EventKind::Level(0));
        player.mark_here(true);
        assert_eq!(player.marked, Some([2.0, all]));
        player.seek(3.0);
        player.mark_here(false);
        assert_eq!(player.marked, Some([2.0, 3.0]));
        // Beyond the end: the rest is marked.
        player.seek(4.0);
        player.mark_here(true);
        assert_eq!(player.marked, Some([4.0, all]));
        player.mark(5.0, -1.0);
        assert_eq!(player.marked, Some([0.0, 5.0]));
        player.mark(1.0, 1.0);
        assert_eq!(player.marked, None);
        player.go_to_event(false);
        assert!(player.time < 4.0);
        // Stopped at an end it begins anew, whichever way it goes.
        player.seek(all);
        player.play_or_stop();
        assert!(player.plays && player.time == 0.0);
        player.play_or_stop();
        player.speed = -1.0;
        player.play_or_stop();
        assert!(player.plays && player.time > all - 0.1);
        player.pass(1.0);
        assert!(player.plays && player.time < all - 0.9);
        player.pass(1e6);
        assert!(!player.plays && player.time == 0.0);
        // What it has rounded it has rounded; at the end there is still something to see.
        player.seek(1.0 / 3.0);
        let third = player.time;
        assert!((third - 1.0 / 3.0).abs() < 1e-6);
        player.seek(third);
        assert_eq!(
            (player.time, Ratio::of(third).map(Ratio::value)),
            (third, Some(third))
        );
        player.seek(1e9);
        assert!(player.time < all && player.time > all - 1e-5 && player.state().is_some());
    }
}
