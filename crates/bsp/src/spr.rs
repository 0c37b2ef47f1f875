//! Sprites (`.spr`, version 1): pictures on a quad that turns to the viewer.

use crate::cycle::Cycle;
use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::reader::{Reader, latin1};

/// Bytes of the header.
pub const HEADER_SIZE: usize = 36;
/// The version of Quake's sprites.
pub const VERSION: i32 = 1;

/// How a sprite turns to the viewer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SpriteType {
    /// Parallel to the view plane, upright.
    ParallelUpright,
    /// Faces the eye, upright.
    FacingUpright,
    /// Parallel to the view plane.
    Parallel,
    /// Lies as the entity's angles say.
    Oriented,
    /// Parallel to the view plane, rolled as the entity says.
    ParallelOriented,
}

/// Palette index of holes.
pub const HOLE: u8 = 255;
/// Directions that a frame of [`Times::Angled`] is seen from.
pub const ANGLES: usize = 8;

/// A sprite.
#[derive(Clone, Debug, PartialEq)]
pub struct Spr {
    /// Its header.
    pub header: SprHeader,
    /// Frames, at least one.
    pub frames: Vec<SprFrame>,
    /// Bytes after the last frame.
    pub trailing: usize,
}

/// A frame: one picture, or several.
#[derive(Clone, Debug, PartialEq)]
pub struct SprFrame {
    /// At least one; one for each part of a [`Times::Group`], [`ANGLES`] for [`Times::Angled`].
    pub pictures: Vec<SprPicture>,
    /// Which of them is shown.
    pub times: Times,
}

/// Which picture of a frame is shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Times {
    /// The only one.
    Single,
    /// One after the other.
    Group(Cycle),
    /// By the direction it is seen from.
    Angled,
}

/// A picture and where it lies on the sprite's plane.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SprPicture {
    /// Left and upper edge, in units to the right and up from the entity's origin: the quad reaches
    /// from `origin[0]` to `origin[0] + width`, and from `origin[1] - height` to `origin[1]`.
    pub origin: [i32; 2],
    /// Width in texels and units; 0 shows nothing.
    pub width: u32,
    /// Height in texels and units; 0 shows nothing.
    pub height: u32,
    /// `width * height` palette indices, rows from the top; [`HOLE`] is a hole.
    pub pixels: Vec<u8>,
}

impl Spr {
    /// Reads a sprite. `warnings` are told of what was repaired.
    ///
    /// # Errors
    /// What [`SprHeader::parse`] refuses; a frame of no known type; a group without pictures, or one
    /// by direction without eight; a picture that is wider or higher than
    /// [`Limits::max_texture_side`], or further off than [`Limits::max_coordinate`]; data that ends
    /// before the last frame does.
    pub fn parse(
        data: &[u8],
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Self, FormatError> {
        let header = SprHeader::parse(data)?;
        let mut r = Reader::at(data, HEADER_SIZE).unwrap_or(Reader::new(&[]));
        let mut frames = Vec::with_capacity(header.num_frames as usize);
        for i in 0..header.num_frames as usize {
            let offset = data.len() - r.remaining();
            let frame = frame(&mut r, i, limits, warnings);
            frames.push(frame.map_err(|e| e.index(i as u64).at(offset as u64))?);
        }
        Ok(Self {
            header,
            frames,
            trailing: r.remaining(),
        })
    }

    /// How many pictures all frames have together.
    pub fn picture_count(&self) -> usize {
        self.frames.iter().map(|f| f.pictures.len()).sum()
    }
}

const PART: &str = "SPR frame";

fn frame(
    r: &mut Reader<'_>,
    index: usize,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<SprFrame, FormatError> {
    let bad = |found: String, allowed: &str| {
        FormatError::new(ErrorKind::OutOfRange, PART, found, allowed)
    };
    let (count, is_angled) = match r.i32().ok_or_else(truncated)? {
        0 => (None, false),
        kind @ (1 | 2) => (Some(r.i32().ok_or_else(truncated)?), kind == 2),
        other => return Err(bad(format!("type {other}"), "0 to 2")),
    };
    if is_angled && count != Some(ANGLES as i32) {
        let found = count.unwrap_or_default();
        return Err(bad(format!("{found} directions"), "8"));
    }
    // A part is at least its time, origin and size.
    let most = r.remaining() / 20;
    let n = usize::try_from(count.unwrap_or(1)).unwrap_or(0);
    if n == 0 || (count.is_some() && n > most) {
        let found = format!("a group of {}", count.unwrap_or_default());
        return Err(bad(
            found,
            &format!("1 to {most} in what is left of the file"),
        ));
    }
    let times = match count {
        None => Times::Single,
        Some(_) => {
            let (cycle, used) = Cycle::read(r, n).ok_or_else(truncated)?;
            if is_angled {
                Times::Angled
            } else {
                if !used {
                    warnings.add(WarningKind::Model, PART, || {
                        format!(
                            "{PART} {index} has times that do not rise: its parts take 0.1 s each"
                        )
                    });
                }
                Times::Group(cycle)
            }
        }
    };
    let mut pictures = Vec::with_capacity(n);
    for _ in 0..n {
        pictures.push(picture(r, limits)?);
    }
    Ok(SprFrame { pictures, times })
}

fn truncated() -> FormatError {
    FormatError::new(
        ErrorKind::Truncated,
        PART,
        "the end of the file",
        "the whole frame",
    )
}

fn picture(r: &mut Reader<'_>, limits: &Limits) -> Result<SprPicture, FormatError> {
    let mut number = || r.i32().ok_or_else(truncated);
    let origin = [number()?, number()?];
    let size = [number()?, number()?];
    let [width, height] = size.map(|n| u32::try_from(n).unwrap_or(u32::MAX));
    let side = limits.max_texture_side;
    let is_near = (origin.iter()).all(|o| o.unsigned_abs() as f32 <= limits.max_coordinate);
    if width.max(height) > side || !is_near {
        return Err(FormatError::new(
            ErrorKind::OutOfRange,
            PART,
            format!(
                "a picture of {}x{} at {}, {}",
                size[0], size[1], origin[0], origin[1]
            ),
            format!(
                "a size of 0 to {side} each way, at most {} off",
                limits.max_coordinate
            ),
        ));
    }
    let pixels = r.take(width as usize * height as usize);
    Ok(SprPicture {
        origin,
        width,
        height,
        pixels: pixels.ok_or_else(truncated)?.to_vec(),
    })
}

/// Counts and settings of a sprite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SprHeader {
    /// How it turns.
    pub sprite_type: SpriteType,
    /// Bounding radius in Quake units.
    pub bounding_radius: f32,
    /// Greatest width of a frame in texels.
    pub max_width: u32,
    /// Greatest height of a frame in texels.
    pub max_height: u32,
    /// Frames; a group counts as one.
    pub num_frames: u32,
    /// 1: starts its animation at a random time.
    pub sync_type: i32,
}

impl SprHeader {
    /// Reads and checks the header of a sprite.
    ///
    /// # Errors
    /// A wrong signature, version or type; a number of frames that is not positive or that the
    /// file is too short for.
    pub fn parse(data: &[u8]) -> Result<Self, FormatError> {
        let truncated = || {
            FormatError::new(
                ErrorKind::Truncated,
                "SPR header",
                format!("{} bytes", data.len()),
                format!("at least {HEADER_SIZE}"),
            )
        };
        let bad = |kind, what: &str, found: String, allowed: String, at| {
            FormatError::new(kind, format!("SPR {what}"), found, allowed).at(at)
        };
        let mut r = Reader::new(data);
        let magic = r.array::<4>().ok_or_else(truncated)?;
        if &magic != b"IDSP" {
            let found = format!("the signature {:?}", latin1(&magic));
            return Err(bad(
                ErrorKind::UnknownFormat,
                "header",
                found,
                "\"IDSP\"".to_owned(),
                0,
            ));
        }
        let version = r.i32().ok_or_else(truncated)?;
        if version != VERSION {
            let found = match version {
                2 => "version 2 (Half-Life, or 32-bit)".to_owned(),
                v => format!("version {v}"),
            };
            return Err(bad(
                ErrorKind::UnsupportedFormat,
                "version",
                found,
                "version 1".to_owned(),
                4,
            ));
        }
        let sprite_type = match r.i32().ok_or_else(truncated)? {
            0 => SpriteType::ParallelUpright,
            1 => SpriteType::FacingUpright,
            2 => SpriteType::Parallel,
            3 => SpriteType::Oriented,
            4 => SpriteType::ParallelOriented,
            v => {
                return Err(bad(
                    ErrorKind::OutOfRange,
                    "type",
                    v.to_string(),
                    "0 to 4".to_owned(),
                    8,
                ));
            }
        };
        let rest = |r: &mut Reader<'_>| {
            let (bounding_radius, max_width, max_height) = (r.f32()?, r.u32()?, r.u32()?);
            let num_frames = r.u32()?;
            r.f32()?; // the beam length, which no engine uses
            Some(SprHeader {
                sprite_type,
                bounding_radius,
                max_width,
                max_height,
                num_frames,
                sync_type: r.i32()?,
            })
        };
        let header = rest(&mut r).ok_or_else(truncated)?;
        // A frame is at least its type, origin and size.
        let most = r.remaining() / 20;
        if header.num_frames == 0 || header.num_frames as usize > most {
            return Err(bad(
                ErrorKind::OutOfRange,
                "number of frames",
                header.num_frames.cast_signed().to_string(),
                format!("1 to {most} in a file of {} bytes", data.len()),
                24,
            ));
        }
        Ok(header)
    }
}
