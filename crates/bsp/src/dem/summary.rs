//! What a demo holds, counted.

use std::collections::{BTreeMap, BTreeSet};

use super::message::{Message, ServerInfo};
use super::{Demo, plain_text};
use crate::error::Warnings;
use crate::reader::latin1;

/// Counts over a whole demo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// CD track that replaces those of the levels; -1 none.
    pub cd_track: i32,
    /// Its levels, in order.
    pub levels: Vec<LevelSummary>,
    /// Blocks read.
    pub blocks: usize,
    /// Bytes of messages read.
    pub bytes: u64,
    /// Messages by their kind.
    pub messages: BTreeMap<&'static str, u64>,
    /// Whether the recording ends with a message that says so.
    pub disconnected: bool,
}

/// Counts over one level of a demo.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LevelSummary {
    /// 15, 666 or 999.
    pub protocol: i32,
    /// Flags of protocol 999.
    pub flags: u32,
    /// Extensions of FTE and vkQuake.
    pub extensions: [u32; 2],
    /// The level's file, `maps/e1m1.bsp`.
    pub map: String,
    /// The level's title.
    pub title: String,
    /// Slots for players.
    pub max_players: u8,
    /// Files of models, the level among them.
    pub models: usize,
    /// Files of sounds.
    pub sounds: usize,
    /// Blocks, from the level's beginning on.
    pub blocks: usize,
    /// The server's clock at the first and the last message that shows entities.
    pub clock: [f32; 2],
    /// Seconds that it plays for.
    pub seconds: f64,
    /// Entities that ever appear.
    pub entities: usize,
    /// Entities that stay for good.
    pub statics: usize,
    /// For each second played, the most entities of one message in it.
    pub entities_per_second: Vec<u32>,
}

/// Seconds that pass from one message's time to the next as a demo plays: the clock may be set
/// back (a level is loaded again), and gaps are cut to one second.
pub fn clock_step(from: f32, to: f32) -> f64 {
    (f64::from(to) - f64::from(from)).clamp(0.0, 1.0)
}

/// The level being counted.
#[derive(Default)]
struct Counting {
    seen: BTreeSet<u16>,
    now: BTreeSet<u16>,
    time: Option<f32>,
}

impl Summary {
    /// Plays a demo and counts. `warnings` tells of what cannot be read.
    pub fn of(demo: &Demo<'_>, warnings: &mut Warnings) -> Self {
        let mut summary = Self {
            cd_track: demo.cd_track,
            ..Self::default()
        };
        let mut counting = Counting::default();
        let mut player = demo.player();
        loop {
            let persist = player.entities_persist();
            let block = player.next_block(warnings, |message| {
                *summary.messages.entry(message.name()).or_default() += 1;
                summary.count(&message, &mut counting, persist);
            });
            let Some(block) = block else { break };
            summary.blocks += 1;
            summary.bytes += u64::from(block.length);
            if let Some(level) = summary.levels.last_mut() {
                level.blocks += 1;
                if let Some(time) = counting.time.filter(|_| !counting.seen.is_empty()) {
                    level.note(time, &counting);
                }
            }
        }
        summary
    }

    fn count(&mut self, message: &Message<'_>, counting: &mut Counting, persist: bool) {
        if let Message::ServerInfo(info) = message {
            self.levels.push(LevelSummary::new(info));
            *counting = Counting::default();
            return;
        }
        let Some(level) = self.levels.last_mut() else {
            return;
        };
        match message {
            Message::Time(time) => {
                // A level shows from its first entity on.
                if let Some(before) = counting.time.filter(|_| !counting.seen.is_empty()) {
                    level.seconds += clock_step(before, *time);
                } else {
                    level.clock = [*time; 2];
                }
                counting.time = Some(*time);
                if !persist {
                    counting.now.clear();
                }
            }
            Message::Entity(update) => {
                counting.seen.insert(update.number);
                counting.now.insert(update.number);
                level.entities = counting.seen.len();
            }
            Message::Remove(number) => {
                counting.now.remove(number);
            }
            Message::RemoveAll => counting.now.clear(),
            Message::Static(_) => level.statics += 1,
            Message::Precache(super::Precache::Model, index, _) => {
                level.models = level.models.max(usize::from(*index));
            }
            Message::Disconnect => self.disconnected = true,
            _ => {}
        }
    }

    /// Seconds that the whole demo plays for.
    pub fn seconds(&self) -> f64 {
        self.levels.iter().map(|l| l.seconds).sum()
    }
}

impl LevelSummary {
    fn new(info: &ServerInfo<'_>) -> Self {
        Self {
            protocol: info.protocol,
            flags: info.flags,
            extensions: info.extensions,
            map: info.models.first().map_or(String::new(), |m| latin1(m)),
            title: plain_text(info.level_name),
            max_players: info.max_players,
            models: info.models.len(),
            sounds: info.sounds.len(),
            ..Self::default()
        }
    }

    /// Notes what is there at the end of a block.
    fn note(&mut self, time: f32, counting: &Counting) {
        let [_, last] = &mut self.clock;
        *last = time;
        let second = self.seconds as usize;
        if self.entities_per_second.len() <= second {
            self.entities_per_second.resize(second + 1, 0);
        }
        if let Some(most) = self.entities_per_second.get_mut(second) {
            *most = (*most).max(counting.now.len() as u32);
        }
    }
}

impl Message<'_> {
    /// What the protocol calls it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Disconnect => "disconnect",
            Self::Stat(..) => "updatestat",
            Self::SetView(_) => "setview",
            Self::Sound { .. } => "sound",
            Self::StopSound(_) => "stopsound",
            Self::Time(_) => "time",
            Self::Print(_) => "print",
            Self::StuffText(_) => "stufftext",
            Self::SetAngle(_) => "setangle",
            Self::TurnAngle(_) => "setangledelta",
            Self::ServerInfo(_) => "serverinfo",
            Self::LightStyle(..) => "lightstyle",
            Self::Name(..) => "updatename",
            Self::Frags(..) => "updatefrags",
            Self::Colours(..) => "updatecolors",
            Self::Client(_) => "clientdata",
            Self::Particles { .. } => "particle",
            Self::Damage { .. } => "damage",
            Self::Static(_) => "spawnstatic",
            Self::Baseline(..) => "spawnbaseline",
            Self::TempEntity(_) => "temp_entity",
            Self::Pause(_) => "setpause",
            Self::Signon(_) => "signonnum",
            Self::CenterPrint(_) => "centerprint",
            Self::KilledMonster => "killedmonster",
            Self::FoundSecret => "foundsecret",
            Self::StaticSound { .. } => "spawnstaticsound",
            Self::Intermission => "intermission",
            Self::Finale(_) => "finale",
            Self::Cutscene(_) => "cutscene",
            Self::SellScreen => "sellscreen",
            Self::CdTrack(..) => "cdtrack",
            Self::Skybox(_) => "skybox",
            Self::BonusFlash => "bf",
            Self::Fog { .. } => "fog",
            Self::Achievement(_) => "achievement",
            Self::LocalSound(_) => "localsound",
            Self::Entity(_) => "entity",
            Self::Remove(_) => "remove",
            Self::RemoveAll => "removeall",
            Self::Precache(..) => "precache",
            Self::TextStat(..) => "updatestatstring",
            Self::Ignored => "ignored",
        }
    }
}
