//! The header of sprites (`.spr`, version 1): what a sprite claims to hold.

use crate::error::{ErrorKind, FormatError};
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
