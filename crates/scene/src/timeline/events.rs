//! What a demo tells by itself: marks for who looks for a moment of it.

use super::Timeline;

/// Something that happens to the player or to the demo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EventKind {
    /// A level begins: its index.
    Level(usize),
    /// The level is over, or a finale or cutscene begins: the camera stands.
    Intermission,
    /// The player dies.
    Death,
    /// The player is hurt.
    Hurt,
    /// The player picks something up.
    Pickup,
}

/// Something that happens at a time, timeline seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When.
    pub time: f64,
    /// What.
    pub kind: EventKind,
}

impl Timeline {
    /// All that happens, in order of time. Levels that show nothing are left out.
    #[must_use]
    pub fn events(&self) -> Vec<Event> {
        let mut events = Vec::new();
        for (index, level) in self.levels.iter().enumerate() {
            let Some(moments) = self.moments.get(level.moments.clone()) else {
                continue;
            };
            let mut add = |time, kind| events.push(Event { time, kind });
            if !moments.is_empty() {
                add(level.span.0, EventKind::Level(index));
            }
            let (mut standing, mut alive) = (0, false);
            for moment in moments {
                if moment.intermission > standing {
                    add(moment.window.end, EventKind::Intermission);
                }
                standing = moment.intermission;
                let client = self.clients.get(moment.client as usize);
                let lives = client.is_some_and(|c| c.health > 0);
                // Before the first word of a player's health there is no player.
                if alive && !lives && standing == 0 {
                    add(moment.window.end, EventKind::Death);
                }
                alive = lives;
            }
            for hurt in &level.hurts {
                add(hurt.begin, EventKind::Hurt);
            }
            for &(_, begin) in &level.bonuses {
                add(begin, EventKind::Pickup);
            }
        }
        // Stable: what ends a level is told before the next one.
        events.sort_by(|a, b| a.time.total_cmp(&b.time));
        events
    }
}
