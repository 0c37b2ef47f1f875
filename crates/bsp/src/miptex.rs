//! Mip textures: the texture lump of a level, single textures of a WAD, and the names that make
//! textures animate.

use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::lmp::Palette;
use crate::reader::{Reader, latin1, until_nul};

/// Bytes of a miptex before its pixels: name, width, height, four offsets.
pub const HEADER_SIZE: usize = 40;

/// Pixels of all textures of a lump may take this many times the lump's bytes: textures may share
/// bytes or run past the end, but not so that a small file becomes a large memory.
const PIXEL_BUDGET: u64 = 4;

/// Frames of an animated texture per second.
pub const FRAMES_PER_SECOND: f64 = 5.0;

/// One mip texture; of its four sizes only the full one is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MipTex {
    /// Name cut at its first NUL, each byte the character of the same number.
    pub name: String,
    /// Name as stored.
    pub raw_name: [u8; 16],
    /// Width in texels; at least 1. Texture coordinates refer to it even where the pixels are
    /// replaced by others.
    pub width: u32,
    /// Height in texels; at least 1.
    pub height: u32,
    /// `width * height` palette indices, rows from the top; empty if the level names the texture
    /// without holding its pixels.
    pub pixels: Vec<u8>,
    /// The texture's own colours, in WAD3 files only.
    pub palette: Option<Box<Palette>>,
}

impl MipTex {
    /// Whether the pixels are here.
    pub fn has_pixels(&self) -> bool {
        !self.pixels.is_empty()
    }

    /// Reads a single miptex, as WADs hold them: the pixels of the full size must be complete.
    ///
    /// # Errors
    /// Fewer bytes than header and pixels, or a size of 0 or above [`Limits::max_texture_side`].
    pub fn parse(data: &[u8], limits: &Limits) -> Result<Self, FormatError> {
        let header = Header::read(data).ok_or_else(|| {
            FormatError::new(
                ErrorKind::Truncated,
                "miptex header",
                format!("{} bytes", data.len()),
                format!("at least {HEADER_SIZE}"),
            )
        })?;
        let count = header.pixel_count(limits).ok_or_else(|| {
            FormatError::new(
                ErrorKind::OutOfRange,
                "miptex header",
                format!("a size of {}x{}", header.width, header.height),
                format!("1 to {} each way", limits.max_texture_side),
            )
            .at(16)
        })?;
        let available = header.pixels(data);
        let pixels = available.get(..count).ok_or_else(|| {
            FormatError::new(
                ErrorKind::Truncated,
                "miptex pixels",
                format!("{} bytes", available.len()),
                format!("{count} for {}x{}", header.width, header.height),
            )
            .at(HEADER_SIZE as u64)
        })?;
        Ok(header.texture(pixels.to_vec()))
    }
}

struct Header {
    raw_name: [u8; 16],
    width: u32,
    height: u32,
    first_offset: u32,
}

impl Header {
    fn read(data: &[u8]) -> Option<Self> {
        let mut reader = Reader::new(data.get(..HEADER_SIZE)?);
        Some(Self {
            raw_name: reader.array()?,
            width: reader.u32()?,
            height: reader.u32()?,
            first_offset: reader.u32()?,
        })
    }

    fn pixel_count(&self, limits: &Limits) -> Option<usize> {
        let side = 1..=limits.max_texture_side;
        if !side.contains(&self.width) || !side.contains(&self.height) {
            return None;
        }
        usize::try_from(u64::from(self.width) * u64::from(self.height)).ok()
    }

    /// Everything from the first pixel on. Engines differ: QuakeSpasm ignores the offset,
    /// DarkPlaces honours it; a sane one is honoured, else pixels follow the header.
    fn pixels<'a>(&self, data: &'a [u8]) -> &'a [u8] {
        usize::try_from(self.first_offset)
            .ok()
            .filter(|&o| (HEADER_SIZE..data.len()).contains(&o))
            .and_then(|o| data.get(o..))
            .or_else(|| data.get(HEADER_SIZE..))
            .unwrap_or_default()
    }

    fn name(&self) -> String {
        latin1(until_nul(&self.raw_name))
    }

    fn texture(&self, pixels: Vec<u8>) -> MipTex {
        MipTex {
            name: self.name(),
            raw_name: self.raw_name,
            width: self.width,
            height: self.height,
            pixels,
            palette: None,
        }
    }
}

/// Reads the texture lump of a level. The result keeps the file's numbering: `None` is a texture
/// that is missing or unusable, which engines draw as a checkerboard.
pub(crate) fn parse_lump(
    lump: &[u8],
    limits: &Limits,
    warnings: &mut Warnings,
) -> Vec<Option<MipTex>> {
    let missing = |warnings: &mut Warnings, index: usize, why: &str| {
        warnings.add(WarningKind::TextureMissing, why, || {
            format!("texture {index} {why}: it is shown as missing")
        });
    };
    let mut reader = Reader::new(lump);
    let Some(claimed) = reader.i32() else {
        warnings.add(WarningKind::TextureMissing, "lump", || {
            "the textures lump is empty: all textures are missing".to_owned()
        });
        return Vec::new();
    };
    let mut count = usize::try_from(claimed).unwrap_or(0);
    let most = (reader.remaining() / 4).min(limits.max_textures);
    if claimed < 0 || count > most {
        warnings.add(WarningKind::LumpRange, "textures", || {
            format!("the textures lump claims {claimed} textures where at most {most} can be")
        });
        count = count.min(most);
    }
    let directory_end = 4 + 4 * count;
    let mut budget = (lump.len() as u64).saturating_mul(PIXEL_BUDGET);
    let mut out = Vec::with_capacity(count);
    for index in 0..count {
        let offset = reader.i32().unwrap_or(-1);
        let Some(start) = usize::try_from(offset).ok().filter(|&o| o >= directory_end) else {
            let why = if offset == -1 {
                "has no data (offset -1)"
            } else {
                "has an offset inside of the lump's directory"
            };
            missing(warnings, index, why);
            out.push(None);
            continue;
        };
        let data = lump.get(start..).unwrap_or_default();
        let Some(header) = Header::read(data) else {
            missing(warnings, index, "has its header past the end of the lump");
            out.push(None);
            continue;
        };
        let Some(wanted) = header.pixel_count(limits) else {
            missing(warnings, index, "has an impossible size");
            out.push(None);
            continue;
        };
        if header.width % 16 != 0 || header.height % 16 != 0 {
            warnings.add(WarningKind::TextureRepaired, "size", || {
                format!(
                    "texture {:?} is {}x{}, not a multiple of 16 each way",
                    header.name(),
                    header.width,
                    header.height
                )
            });
        }
        let external = header.first_offset == 0;
        let cost = HEADER_SIZE as u64 + if external { 0 } else { wanted as u64 };
        if cost > budget {
            missing(warnings, index, "claims more pixels than the file can hold");
            out.push(None);
            continue;
        }
        budget -= cost;
        // An offset of 0 says that a WAD has the pixels.
        if external {
            out.push(Some(header.texture(Vec::new())));
            continue;
        }
        let available = header.pixels(data);
        if available.is_empty() {
            missing(warnings, index, "has its pixels past the end of the lump");
            out.push(None);
            continue;
        }
        let mut pixels = available.get(..wanted).unwrap_or(available).to_vec();
        if pixels.len() < wanted {
            warnings.add(WarningKind::TextureRepaired, "short", || {
                format!(
                    "texture {:?} has {} of {wanted} pixels: the last one is repeated",
                    header.name(),
                    pixels.len()
                )
            });
            let last = pixels.last().copied().unwrap_or(0);
            pixels.resize(wanted, last);
        }
        out.push(Some(header.texture(pixels)));
    }
    out
}

/// The frames that a texture plays.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sequence {
    /// Texture indices of `+0name`, `+1name`, ...; never empty in a [`Animation`]'s sequences
    /// that exist.
    pub primary: Vec<u32>,
    /// Texture indices of `+aname`, `+bname`, ..., shown by entities whose `frame` is not 0;
    /// empty if there are none.
    pub alternate: Vec<u32>,
}

/// Which textures animate and how.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Animation {
    sequences: Vec<Sequence>,
    /// For each texture the index of its sequence.
    of_texture: Vec<Option<u32>>,
}

/// One frame of a sequence; sorts into groups, sets, and the order they play in.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Frame {
    /// The name behind the frame letter, in lowercase.
    key: [u8; 14],
    alternate: bool,
    number: u8,
    texture: u32,
}

impl Frame {
    fn of(texture: &MipTex, index: u32) -> Option<Self> {
        let [b'+', letter, key @ ..] = texture.raw_name else {
            return None;
        };
        let (alternate, number) = match letter.to_ascii_lowercase() {
            d @ b'0'..=b'9' => (false, d - b'0'),
            d @ b'a'..=b'j' => (true, d - b'a'),
            _ => return None,
        };
        // What follows a name's end is garbage.
        let end = key.iter().position(|&b| b == 0).unwrap_or(key.len());
        let mut name = [0; 14];
        for (to, from) in name.iter_mut().zip(key).take(end) {
            *to = from.to_ascii_lowercase();
        }
        Some(Self {
            key: name,
            alternate,
            number,
            texture: index,
        })
    }
}

impl Animation {
    /// Groups textures by name: `+0name` to `+9name` are primary frames, `+aname` to `+jname`
    /// alternate ones, compared without regard to case. Where a frame is missing, the frames that
    /// are there play, with a warning (the original engines stop).
    pub fn new(textures: &[Option<MipTex>], warnings: &mut Warnings) -> Self {
        let mut frames: Vec<Frame> = Vec::new();
        for (texture, index) in textures.iter().zip(0_u32..) {
            let Some(texture) = texture.as_ref().filter(|t| t.name.starts_with('+')) else {
                continue;
            };
            if let Some(frame) = Frame::of(texture, index) {
                frames.push(frame);
            } else {
                warnings.add(WarningKind::TextureAnimation, &texture.name, || {
                    format!(
                        "texture {:?} has no frame letter after its +: it stays still",
                        texture.name
                    )
                });
            }
        }
        // Of two textures of the same name the first one plays.
        frames.sort_unstable();
        let groups = || frames.chunk_by(|a, b| a.key == b.key);
        let mut of_texture = vec![None; textures.len()];
        let mut sequences = Vec::with_capacity(groups().count());
        for (group, number) in groups().zip(0_u32..) {
            let mut sequence = Sequence::default();
            for set in group.chunk_by(|a, b| a.alternate == b.alternate) {
                let first_of_each = set.chunk_by(|a, b| a.number == b.number);
                let played: Vec<Frame> = first_of_each
                    .filter_map(|same| same.first().copied())
                    .collect();
                if played
                    .iter()
                    .zip(0..)
                    .any(|(frame, due)| frame.number != due)
                {
                    let name = latin1(until_nul(&set.first().map_or([0; 14], |f| f.key)));
                    warnings.add(WarningKind::TextureAnimation, &name, || {
                        format!("the animated texture {name:?} lacks a frame: the others play")
                    });
                }
                let alternate = played.first().is_some_and(|f| f.alternate);
                let textures = played.iter().map(|f| f.texture).collect();
                if alternate {
                    sequence.alternate = textures;
                } else {
                    sequence.primary = textures;
                }
            }
            for frame in group {
                if let Some(of) = of_texture.get_mut(frame.texture as usize) {
                    *of = Some(number);
                }
            }
            sequences.push(sequence);
        }
        Self {
            sequences,
            of_texture,
        }
    }

    /// The sequence that a texture belongs to; `None` if it stays still.
    pub fn sequence(&self, texture: usize) -> Option<&Sequence> {
        let index = (*self.of_texture.get(texture)?)?;
        self.sequences.get(index as usize)
    }

    /// All sequences.
    pub fn sequences(&self) -> &[Sequence] {
        &self.sequences
    }

    /// What `texture` shows in turn, [`FRAMES_PER_SECOND`]; empty if it stays still. `alternate` is for
    /// entities whose `frame` is not 0; a set without frames gives way to the other.
    pub fn cycle(&self, texture: usize, alternate: bool) -> &[u32] {
        let Some(sequence) = self.sequence(texture) else {
            return &[];
        };
        let (wanted, other) = if alternate {
            (&sequence.alternate, &sequence.primary)
        } else {
            (&sequence.primary, &sequence.alternate)
        };
        if wanted.is_empty() { other } else { wanted }
    }

    /// The texture to show for `texture` at `time` seconds: that of [`Animation::cycle`] whose turn it is
    /// ([`turn`]). A texture that stays still is itself.
    pub fn frame_at(&self, texture: usize, time: f64, alternate: bool) -> usize {
        let frames = self.cycle(texture, alternate);
        (frames.get(turn(frames.len(), time))).map_or(texture, |&i| i as usize)
    }
}

/// Whose turn it is at `time` seconds among `count` frames that show for a fifth of a second each:
/// `floor(5 time) % count`.
pub fn turn(count: usize, time: f64) -> usize {
    let step = (time * FRAMES_PER_SECOND).floor();
    if step.is_finite() && count > 0 {
        step.rem_euclid(count as f64) as usize
    } else {
        0
    }
}
