//! Demos (`.dem`): what a server told the player who recorded.
//!
//! [`Demo::parse`] finds the blocks, [`Player`] reads their messages one after the other, and
//! [`Summary`] counts. Protocols 15 (with Nehahra's extension), 666 and 999 are read with all flags,
//! and vkQuake's replacement deltas; recordings in other protocols and of QuakeWorld are refused by
//! name. A demo that is cut off or damaged keeps all that comes before the damage.

mod cursor;
mod delta;
mod entity;
mod message;
mod player;
mod quakeworld;
mod summary;
mod temp;

pub use cursor::flag;
pub use message::{
    BeamKind, ClientData, EntityState, EntityUpdate, Message, PointEffect, Precache, ServerInfo,
    TempEntity, Vec3,
};
pub use player::Player;
pub(crate) use quakeworld::is_quakeworld;
pub use summary::{LevelSummary, Summary, clock_step};

use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::reader::Reader;

/// Largest number of an entity.
pub const MAX_ENTITY: u16 = 32_767;
/// Most models, and most sounds, of a level.
pub const MAX_PRECACHES: usize = 16_384;
/// Bytes of a block before its message: the length and three angles.
pub const BLOCK_HEADER: usize = 16;
/// The number of the CD track and its line feed are within so many bytes.
const LONGEST_TRACK_LINE: usize = 16;

/// Flags of [`EntityState::effects`].
pub mod effect {
    /// A sphere of particles around it.
    pub const BRIGHT_FIELD: u32 = 1;
    /// The flash of a weapon.
    pub const MUZZLE_FLASH: u32 = 2;
    /// A strong light.
    pub const BRIGHT_LIGHT: u32 = 4;
    /// A weak light.
    pub const DIM_LIGHT: u32 = 8;
}

/// Flags of [`EntityState::flags`].
pub mod entity_flag {
    /// Moves in steps ten times a second.
    pub const STEP: u8 = 1;
    /// Is a view model.
    pub const VIEW_MODEL: u8 = 4;
    /// Is not seen by the one it belongs to.
    pub const EXTERIOR: u8 = 8;
    /// Stands on the ground.
    pub const ON_GROUND: u8 = 128;
}

/// Flags of [`ClientData::items`].
pub mod item {
    /// The ring.
    pub const INVISIBILITY: u32 = 1 << 19;
    /// The pentagram.
    pub const INVULNERABILITY: u32 = 1 << 20;
    /// The suit.
    pub const SUIT: u32 = 1 << 21;
    /// Quad damage.
    pub const QUAD: u32 = 1 << 22;
}

/// One block of a demo: what arrived at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Where its header begins in the file.
    pub offset: u64,
    /// Bytes of its message.
    pub length: u32,
    /// Where the player looked: pitch (down is positive), yaw, roll in degrees.
    pub view_angles: Vec3,
}

/// A demo cut into its blocks.
#[derive(Clone, Debug)]
pub struct Demo<'a> {
    /// CD track that replaces those of the levels; -1 none.
    pub cd_track: i32,
    /// Its blocks, in order.
    pub blocks: Vec<Block>,
    bytes: &'a [u8],
}

impl<'a> Demo<'a> {
    /// Finds the blocks of a demo and looks into them as far as the first level.
    ///
    /// A demo that ends within a block, or has a block of impossible length, keeps the blocks before
    /// it; `warnings` tells of it.
    ///
    /// # Errors
    /// No line with a CD track, recordings of QuakeWorld and compressed ones, or a first level in
    /// a protocol that is not read here.
    pub fn parse(
        bytes: &'a [u8],
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Self, FormatError> {
        limits.check_file(bytes.len() as u64)?;
        let Some((cd_track, start)) = track_line(bytes) else {
            return Err(no_demo(bytes));
        };
        let mut demo = Self {
            cd_track,
            blocks: Vec::new(),
            bytes,
        };
        demo.find_blocks(start, limits, warnings);
        let mut level = None;
        let mut player = demo.player();
        let mut unheard = Warnings::new();
        while level.is_none() {
            let block = player.next_block(&mut unheard, |message| {
                if let Message::ServerInfo(info) = message {
                    level.get_or_insert(info.flags);
                }
            });
            if block.is_none() {
                break;
            }
        }
        if let (None, Some(error)) = (level, player.refused()) {
            return Err(error.clone());
        }
        if let Some(unknown) = level.and_then(player::unknown_flags) {
            warnings.add(WarningKind::DemoValue, "flags", || {
                format!("protocol 999 with unknown flags {unknown:#x}")
            });
        }
        Ok(demo)
    }

    fn find_blocks(&mut self, start: usize, limits: &Limits, warnings: &mut Warnings) {
        let mut at = start;
        let bytes = self.bytes;
        while at < bytes.len() {
            let index = self.blocks.len();
            let mut cut = |what: &str| {
                warnings.add(WarningKind::DemoTruncated, "", || {
                    format!("the demo ends within {what} of block {index} at byte {at}")
                });
            };
            let header = Reader::at(bytes, at).and_then(|mut r| Some((r.i32()?, r.vec3()?)));
            let Some((length, angles)) = header else {
                return cut("the header");
            };
            let Some(size) = usize::try_from(length)
                .ok()
                .filter(|&n| n <= limits.max_demo_block_bytes)
            else {
                let most = limits.max_demo_block_bytes;
                return warnings.add(WarningKind::DemoBlock, "length", || {
                    format!(
                        "block {index} at byte {at} has {length} bytes, allowed are 0 to {most}; \
                         the demo is left there"
                    )
                });
            };
            let body = at.saturating_add(BLOCK_HEADER);
            if bytes.len().saturating_sub(body) < size {
                return cut("the message");
            }
            // An angle that is none keeps the view where it was.
            let before = self.blocks.last().map_or([0.0; 3], |b| b.view_angles);
            let tame = |(new, old): (f32, f32)| if new.abs() <= 1.0e6 { new } else { old };
            let [p, y, r] = angles;
            let [p0, y0, r0] = before;
            self.blocks.push(Block {
                offset: at as u64,
                length: size as u32,
                view_angles: [tame((p, p0)), tame((y, y0)), tame((r, r0))],
            });
            at = body + size;
        }
    }

    /// Reads the messages from the beginning.
    pub fn player(&self) -> Player<'_> {
        Player::new(self)
    }

    /// Bytes of a block's message.
    fn bytes_of(&self, block: &Block) -> &'a [u8] {
        let start = block.offset as usize + BLOCK_HEADER;
        let end = start + block.length as usize;
        self.bytes.get(start..end).unwrap_or_default()
    }
}

/// The number in the first line, and where the blocks begin.
pub(crate) fn track_line(bytes: &[u8]) -> Option<(i32, usize)> {
    let head = bytes.get(..bytes.len().min(LONGEST_TRACK_LINE))?;
    let end = head.iter().position(|&b| b == b'\n')?;
    let line = std::str::from_utf8(head.get(..end)?).ok()?;
    Some((line.trim().parse().ok()?, end + 1))
}

/// Why some bytes are no demo.
fn no_demo(bytes: &[u8]) -> FormatError {
    let (kind, found) = if bytes.starts_with(&[0x1f, 0x8b]) || bytes.starts_with(b"DZ") {
        let found = "a compressed file, which has to be unpacked first";
        (ErrorKind::UnsupportedFormat, found)
    } else if is_quakeworld(bytes) {
        let found = "a recording of QuakeWorld (.qwd or .mvd), which is not read yet";
        (ErrorKind::UnsupportedFormat, found)
    } else {
        let found = "no line with the number of a CD track";
        (ErrorKind::UnknownFormat, found)
    };
    FormatError::new(kind, "demo", found, "a demo of Quake (.dem)").at(0)
}

/// Text in the charset of the game as plain text: gold letters are like others, and pictures of
/// letters and frames become what they look like.
pub fn plain_text(bytes: &[u8]) -> String {
    let plain = |b: &u8| match b & 0x7f {
        b'\n' => '\n',
        c @ 18..=27 => char::from(b'0' + (c - 18)),
        16 => '[',
        17 => ']',
        5 | 14 | 15 | 28 => '.',
        29..=31 | 13 => '-',
        c @ 32..=126 => char::from(c),
        _ => ' ',
    };
    bytes.iter().map(plain).collect()
}
