//! Reading a demo's messages one block after the other.

use std::collections::HashMap;

use super::cursor::{Cursor, Read, flag};
use super::message::{EntityState, EntityUpdate, Fault, Message, Precache, ServerInfo};
use super::{Block, Demo, MAX_ENTITY, MAX_PRECACHES, delta, entity, temp};
use crate::error::{ErrorKind, FormatError, WarningKind, Warnings};

/// Extensions of FTE that change nothing in how messages are read, or that are read here.
const READ_EXTENSIONS: [u32; 2] = [GAME_CODE, 0x3f];
/// Of the first set: messages of a mod's own code.
const GAME_CODE: u32 = 0x4000_0000;
/// Of the second set: entities are sent as changes.
const REPLACEMENT_DELTAS: u32 = 8;
/// Of the second set: what players predict their movement by.
const PREDICTION: u32 = 0x20;
/// `FTEX` and `FTE2`, before the flags of the two sets.
const EXTENSION_MARKS: [i32; 2] = [0x5845_5446, 0x3245_5446];
/// Bad blocks in a row that end a demo.
const MOST_BAD_BLOCKS: u32 = 3;

/// Which language a level's server speaks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Dialect {
    protocol: i32,
    flags: u32,
    extensions: [u32; 2],
}

impl Dialect {
    fn is_extended(self) -> bool {
        matches!(self.protocol, 666 | 999)
    }

    fn has_deltas(self) -> bool {
        self.extensions[1] & REPLACEMENT_DELTAS != 0
    }

    fn predicts(self) -> bool {
        self.extensions[1] & PREDICTION != 0
    }
}

/// Plays a demo's messages. What it remembers is what messages refer to: the protocol, baselines
/// and, with replacement deltas, entities.
pub struct Player<'a> {
    demo: &'a Demo<'a>,
    next: usize,
    dialect: Option<Dialect>,
    baselines: HashMap<u16, EntityState>,
    /// With replacement deltas: every entity that is there.
    present: HashMap<u16, EntityState>,
    time: Option<f32>,
    last: Option<u8>,
    bad: u32,
    over: bool,
    /// Why playing stopped, if a level's protocol is not read here.
    refused: Option<FormatError>,
}

impl<'a> Player<'a> {
    pub(super) fn new(demo: &'a Demo<'a>) -> Self {
        Self {
            demo,
            next: 0,
            dialect: None,
            baselines: HashMap::new(),
            present: HashMap::new(),
            time: None,
            last: None,
            bad: 0,
            over: false,
            refused: None,
        }
    }

    /// Whether entities persist from message to message until they are removed (replacement
    /// deltas); else an entity is there that the newest message with a time has.
    pub fn entities_persist(&self) -> bool {
        self.dialect.is_some_and(Dialect::has_deltas)
    }

    /// Why playing stopped, where a later level is in a protocol that is not read here.
    pub fn refused(&self) -> Option<&FormatError> {
        self.refused.as_ref()
    }

    /// Reads the next block, hands its messages to `sink` in their order, and gives the block;
    /// `None` at the end, which is the last block, a message that says so, three blocks in a row
    /// that cannot be read, or a level in another protocol. Of a block that cannot be read, the
    /// messages before the damage are handed on, and `warnings` tells of it.
    pub fn next_block(
        &mut self,
        warnings: &mut Warnings,
        mut sink: impl FnMut(Message<'a>),
    ) -> Option<Block> {
        if self.over {
            return None;
        }
        let block = *self.demo.blocks.get(self.next)?;
        let index = self.next;
        self.next += 1;
        let bytes = self.demo.bytes_of(&block);
        let mut r = Cursor::new(bytes, self.dialect.map_or(0, |d| d.flags));
        let mut start = 0;
        let mut fault = None;
        while !self.over && !r.is_empty() {
            start = r.at();
            match self.message(&mut r, &mut sink) {
                Ok(()) => {}
                Err(found) => {
                    fault = Some(found);
                    break;
                }
            }
        }
        let at = block.offset + super::BLOCK_HEADER as u64;
        if r.wild > 0 {
            warnings.add_many(WarningKind::DemoValue, "", r.wild, || {
                format!(
                    "block {index} at byte {at}: a number that is not finite or beyond any level \
                     is read as 0"
                )
            });
        }
        match fault {
            None => self.bad = 0,
            Some(fault) => {
                if fault != Fault::GameCode {
                    self.bad += 1;
                    self.over |= self.bad >= MOST_BAD_BLOCKS;
                }
                let (last, over) = (self.last, self.over);
                warnings.add(WarningKind::DemoBlock, "", || {
                    let after = last.map_or(String::new(), |id| format!(", after message {id}"));
                    let end = if over {
                        "; after three such blocks the demo is left"
                    } else {
                        "; the rest of the block is left out"
                    };
                    let byte = at + start as u64;
                    format!("block {index} at byte {byte}: {fault}{after}{end}")
                });
            }
        }
        if let Some(error) = &self.refused {
            warnings.add(WarningKind::DemoBlock, "protocol", || error.to_string());
        }
        Some(block)
    }

    /// Reads one message.
    fn message(&mut self, r: &mut Cursor<'a>, sink: &mut impl FnMut(Message<'a>)) -> Read<()> {
        let id = r.byte()?;
        if id & 0x80 != 0 {
            let update = self.update(r, id & 0x7f)?;
            sink(Message::Entity(update));
        } else if id == 86 && self.entities_persist() {
            self.changes(r, sink)?;
        } else if let Some(message) = self.plain(r, id)? {
            if let Message::Time(t) = message {
                self.time = Some(t);
            }
            sink(message);
        }
        self.last = Some(id);
        Ok(())
    }

    /// An entity's update as all protocols have it.
    fn update(&mut self, r: &mut Cursor<'_>, low: u8) -> Read<EntityUpdate> {
        let dialect = self.dialect.ok_or(Fault::NoLevel)?;
        let extended = dialect.is_extended();
        let head = entity::update_head(r, low, extended)?;
        let number = checked(u32::from(head.1))?;
        let baseline = self.baselines.get(&number).copied().unwrap_or_default();
        entity::update(r, head, &baseline, extended)
    }

    /// All changes of entities at one time.
    fn changes(&mut self, r: &mut Cursor<'a>, sink: &mut impl FnMut(Message<'a>)) -> Read<()> {
        const REMOVE: u16 = 0x8000;
        const LARGE: u16 = 0x4000;
        let predicts = self.dialect.is_some_and(Dialect::predicts);
        if predicts {
            r.skip(2)?; // which of the player's moves the server has seen
        }
        let time = r.float()?;
        if self.time != Some(time) {
            self.time = Some(time);
            sink(Message::Time(time));
        }
        loop {
            let head = r.u16()?;
            let mut number = u32::from(head & !REMOVE);
            if head & LARGE != 0 {
                number = u32::from(head & 0x3fff) | u32::from(r.byte()?) << 14;
            }
            let removed = head & REMOVE != 0;
            if number == 0 && !removed {
                return Ok(());
            }
            let number = checked(number)?;
            if removed && number == 0 {
                self.present.clear();
                sink(Message::RemoveAll);
            } else if removed {
                self.present.remove(&number);
                sink(Message::Remove(number));
            } else {
                let before = self.present.get(&number);
                let baseline = self.baselines.get(&number).copied().unwrap_or_default();
                let state = delta::change(r, before, &baseline, predicts)?;
                self.present.insert(number, state);
                sink(Message::Entity(EntityUpdate {
                    number,
                    state,
                    lerp_finish: None,
                }));
            }
        }
    }

    /// Any other message; `None` for those that say nothing.
    fn plain(&mut self, r: &mut Cursor<'a>, id: u8) -> Read<Option<Message<'a>>> {
        Ok(Some(match id {
            1 => return Ok(None),
            2 => {
                self.over = true;
                Message::Disconnect
            }
            3 => Message::Stat(r.byte()?, f64::from(r.long()?)),
            4 => {
                let protocol = r.long()?;
                if let Some(dialect) = &mut self.dialect
                    && matches!(protocol, 15 | 666 | 999)
                {
                    dialect.protocol = protocol;
                }
                return Ok(None);
            }
            5 => Message::SetView(r.u16()?),
            6 => self.sound(r)?,
            7 => {
                let time = r.float()?;
                if self.dialect.is_some_and(Dialect::predicts) {
                    r.skip(2)?;
                }
                Message::Time(time)
            }
            8 => Message::Print(r.string()?),
            9 => Message::StuffText(r.string()?),
            10 => Message::SetAngle(r.angles()?),
            11 => return self.server_info(r),
            12 => Message::LightStyle(r.byte()?, r.string()?),
            13 => Message::Name(r.byte()?, r.string()?),
            14 => Message::Frags(r.byte()?, r.short()?),
            15 => Message::Client(entity::client_data(r)?),
            16 => Message::StopSound(r.u16()?),
            17 => Message::Colours(r.byte()?, r.byte()?),
            18 => particles(r)?,
            19 => Message::Damage {
                armor: r.byte()?,
                blood: r.byte()?,
                from: r.coords()?,
            },
            20 => Message::Static(entity::baseline(r, 0)?),
            22 => {
                let number = checked(u32::from(r.u16()?))?;
                self.baseline(number, entity::baseline(r, 0)?)
            }
            23 => Message::TempEntity(temp::temp_entity(r)?),
            24 => Message::Pause(r.byte()? != 0),
            25 => Message::Signon(r.byte()?),
            26 => Message::CenterPrint(r.string()?),
            27 => Message::KilledMonster,
            28 => Message::FoundSecret,
            29 => {
                let at = r.coords()?;
                let sound = u16::from(r.byte()?);
                r.skip(2)?;
                Message::StaticSound { sound, at }
            }
            30 => Message::Intermission,
            31 => Message::Finale(r.string()?),
            32 => Message::CdTrack(r.byte()?, r.byte()?),
            33 => Message::SellScreen,
            34 => Message::Cutscene(r.string()?),
            37 => Message::Skybox(r.string()?),
            40 => Message::BonusFlash,
            41 => fog(r)?,
            42 => {
                let number = checked(u32::from(r.u16()?))?;
                let bits = r.byte()?;
                self.baseline(number, entity::baseline(r, bits)?)
            }
            43 => {
                let bits = r.byte()?;
                Message::Static(entity::baseline(r, bits)?)
            }
            44 => {
                let at = r.coords()?;
                let sound = r.u16()?;
                r.skip(2)?;
                Message::StaticSound { sound, at }
            }
            52 => Message::Achievement(r.string()?),
            56 => {
                let mask = r.byte()?;
                Message::LocalSound(r.byte_or_short(mask & LARGE_SOUND != 0)?)
            }
            _ => return self.extension(r, id).map(Some),
        }))
    }

    /// Messages of FTE's and vkQuake's extensions.
    fn extension(&mut self, r: &mut Cursor<'a>, id: u8) -> Read<Message<'a>> {
        let dialect = self.dialect.unwrap_or_default();
        let known = match id {
            21 | 51 | 66 | 78 | 79 => dialect.has_deltas(),
            83 => dialect.extensions[0] & GAME_CODE != 0,
            54 | 60..=62 | 84 | 85 => dialect.extensions != [0; 2],
            _ => false,
        };
        if !known {
            return Err(Fault::Message(id));
        }
        let predicts = dialect.predicts();
        let default = EntityState::default();
        Ok(match id {
            21 => Message::Static(delta::change(r, None, &default, predicts)?),
            51 => Message::Stat(r.byte()?, f64::from(r.byte()?)),
            54 => {
                let code = r.u16()?;
                let name = r.string()?;
                let kind = match code >> 14 {
                    0 => Precache::Model,
                    1 => Precache::Effect,
                    2 => Precache::Sound,
                    _ => return Ok(Message::Ignored),
                };
                Message::Precache(kind, code & 0x3fff, name)
            }
            60 => {
                r.skip(4)?;
                r.coords()?;
                r.coords()?;
                Message::Ignored
            }
            61 => {
                r.skip(2)?;
                r.coords()?;
                r.coords()?;
                r.skip(2)?;
                Message::Ignored
            }
            62 => {
                r.skip(2)?;
                r.coords()?;
                Message::Ignored
            }
            66 => {
                let number = checked(delta::entity_number(r)?)?;
                self.baseline(number, delta::change(r, None, &default, predicts)?)
            }
            78 => Message::TextStat(r.byte()?, r.string()?),
            79 => Message::Stat(r.byte()?, f64::from(r.float()?)),
            84 => {
                r.skip(3)?;
                let size = r.u16()?;
                r.skip(usize::from(size))?;
                Message::Ignored
            }
            85 => Message::TurnAngle([r.angle16()?, r.angle16()?, r.angle16()?]),
            _ => return Err(Fault::GameCode),
        })
    }

    fn baseline(&mut self, number: u16, state: EntityState) -> Message<'a> {
        self.baselines.insert(number, state);
        Message::Baseline(number, state)
    }

    fn sound(&self, r: &mut Cursor<'_>) -> Read<Message<'a>> {
        const VOLUME: u16 = 1;
        const ATTENUATION: u16 = 2;
        const MORE: u16 = 4;
        const LARGE_ENTITY: u16 = 8;
        const DP_PITCH: u16 = 32;
        const TIME_OFFSET: u16 = 64;
        const PITCH: u16 = 128;
        const VELOCITY: u16 = 256;
        let deltas = self.entities_persist();
        let mut mask = u16::from(r.byte()?);
        if deltas && mask & MORE != 0 {
            mask |= u16::from(r.byte()?) << 8;
        }
        let mut skipped = 0;
        let sizes = [(VOLUME, 1), (ATTENUATION, 1)];
        let more = [(PITCH, 1), (TIME_OFFSET, 2), (VELOCITY, 6), (DP_PITCH, 2)];
        for (bit, size) in sizes.into_iter().chain(more.into_iter().filter(|_| deltas)) {
            skipped += if mask & bit != 0 { size } else { 0 };
        }
        r.skip(skipped)?;
        let entity = if mask & LARGE_ENTITY != 0 {
            let entity = r.u16()?;
            r.skip(1)?;
            entity
        } else {
            r.u16()? >> 3
        };
        let sound = r.byte_or_short(mask & u16::from(LARGE_SOUND) != 0)?;
        let at = r.coords()?;
        Ok(Message::Sound { entity, sound, at })
    }

    /// A level begins: all that was remembered is forgotten.
    fn server_info(&mut self, r: &mut Cursor<'a>) -> Read<Option<Message<'a>>> {
        let mut dialect = Dialect::default();
        loop {
            dialect.protocol = r.long()?;
            let mark = EXTENSION_MARKS.iter().position(|&m| m == dialect.protocol);
            let Some(set) = mark.and_then(|m| dialect.extensions.get_mut(m)) else {
                break;
            };
            *set = r.ulong()?;
        }
        if let Some(error) = unsupported(dialect) {
            self.refused = Some(error);
            self.over = true;
            return Ok(None);
        }
        if dialect.protocol == 999 {
            dialect.flags = r.ulong()?;
        }
        r.set_flags(dialect.flags);
        if dialect.predicts() {
            r.string()?; // the directory of the game
        }
        let max_players = r.byte()?;
        if max_players == 0 {
            return Err(Fault::NoPlayers);
        }
        let info = ServerInfo {
            protocol: dialect.protocol,
            flags: dialect.flags,
            extensions: dialect.extensions,
            max_players,
            game_type: r.byte()?,
            level_name: r.string()?,
            models: names(r)?,
            sounds: names(r)?,
        };
        self.dialect = Some(dialect);
        self.baselines.clear();
        self.present.clear();
        self.time = None;
        Ok(Some(Message::ServerInfo(info)))
    }
}

/// Bit of a sound's mask: its index has two bytes.
const LARGE_SOUND: u8 = 16;

/// An entity number within the table.
fn checked(number: u32) -> Read<u16> {
    match u16::try_from(number) {
        Ok(n) if n <= MAX_ENTITY => Ok(n),
        _ => Err(Fault::Entity(number)),
    }
}

/// Why a level's messages cannot be read, if so.
fn unsupported(dialect: Dialect) -> Option<FormatError> {
    let refuse = |found: String, allowed: &str| {
        let kind = ErrorKind::UnsupportedFormat;
        Some(FormatError::new(kind, "demo", found, allowed))
    };
    let Dialect { protocol, .. } = dialect;
    let maker = match protocol {
        15 | 666 | 999 => {
            let [first, second] = dialect.extensions;
            let [known_first, known_second] = READ_EXTENSIONS;
            if first & !known_first == 0 && second & !known_second == 0 {
                return None;
            }
            return refuse(
                format!("extensions {first:#x} and {second:#x} of FTE"),
                "those that vkQuake records",
            );
        }
        3500..=3504 => " of DarkPlaces",
        10_000..=10_002 => " of BJP",
        28 => " of QuakeWorld",
        _ => "",
    };
    refuse(
        format!("the unsupported protocol {protocol}{maker}"),
        "15, 666 or 999",
    )
}

fn names<'a>(r: &mut Cursor<'a>) -> Read<Vec<&'a [u8]>> {
    let mut names = Vec::new();
    loop {
        let name = r.string()?;
        if name.is_empty() {
            return Ok(names);
        }
        if names.len() == MAX_PRECACHES {
            return Err(Fault::Precaches);
        }
        names.push(name);
    }
}

fn particles<'a>(r: &mut Cursor<'_>) -> Read<Message<'a>> {
    let at = r.coords()?;
    let mut direction = [0.0; 3];
    for d in &mut direction {
        *d = f32::from(r.char()?) / 16.0;
    }
    // The last number stands for an explosion.
    let count = match r.byte()? {
        255 => 1024,
        n => u16::from(n),
    };
    Ok(Message::Particles {
        at,
        direction,
        count,
        colour: r.byte()?,
    })
}

fn fog<'a>(r: &mut Cursor<'_>) -> Read<Message<'a>> {
    let mut share = || r.byte().map(|b| f32::from(b) / 255.0);
    Ok(Message::Fog {
        density: share()?,
        colour: [share()?, share()?, share()?],
        seconds: f32::from(r.short()?.max(0)) / 100.0,
    })
}

/// Flags that are unknown are told of once.
pub(super) fn unknown_flags(flags: u32) -> Option<u32> {
    Some(flags & !flag::KNOWN).filter(|f| *f != 0)
}
