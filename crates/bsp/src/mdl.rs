//! The header of alias models (`.mdl`, version 6): what a model claims to hold.

use crate::error::{ErrorKind, FormatError};
use crate::reader::{Reader, latin1};

/// Bytes of the header.
pub const HEADER_SIZE: usize = 84;
/// The one version there is.
pub const VERSION: i32 = 6;

/// Counts and settings of an alias model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MdlHeader {
    /// Position = byte coordinates times this, ...
    pub scale: [f32; 3],
    /// ... plus this, in Quake units.
    pub translate: [f32; 3],
    /// Unreliable bounding radius.
    pub bounding_radius: f32,
    /// Skins; a group counts as one.
    pub num_skins: u32,
    /// Width of all skins in texels.
    pub skin_width: u32,
    /// Height of all skins in texels.
    pub skin_height: u32,
    /// Vertices of each pose.
    pub num_vertices: u32,
    /// Triangles.
    pub num_triangles: u32,
    /// Frames; a group counts as one.
    pub num_frames: u32,
    /// 1: starts its animation at a random time.
    pub sync_type: i32,
    /// Effect flags.
    pub flags: u32,
}

impl MdlHeader {
    /// Reads and checks the header of a model; the counts are checked against the bytes that the
    /// file has for them.
    ///
    /// # Errors
    /// A wrong signature or version; a count of vertices, triangles, frames or skins that is not
    /// positive or that the file is too short for.
    pub fn parse(data: &[u8]) -> Result<Self, FormatError> {
        let truncated = || {
            FormatError::new(
                ErrorKind::Truncated,
                "MDL header",
                format!("{} bytes", data.len()),
                format!("at least {HEADER_SIZE}"),
            )
        };
        let mut r = Reader::new(data);
        let magic = r.array::<4>().ok_or_else(truncated)?;
        if &magic != b"IDPO" {
            return Err(FormatError::new(
                ErrorKind::UnknownFormat,
                "MDL header",
                format!("the signature {:?}", latin1(&magic)),
                "\"IDPO\"",
            )
            .at(0));
        }
        let version = r.i32().ok_or_else(truncated)?;
        if version != VERSION {
            return Err(FormatError::new(
                ErrorKind::UnsupportedFormat,
                "MDL header",
                format!("version {version}"),
                "version 6",
            )
            .at(4));
        }
        let header = read(&mut r).ok_or_else(truncated)?;
        header.check(data.len())?;
        Ok(header)
    }

    fn check(&self, size: usize) -> Result<(), FormatError> {
        let body = size.saturating_sub(HEADER_SIZE) as u64;
        // A skin may be 1 x 1; a frame is at least type, bounds, name and its vertices.
        let vertices = u64::from(self.num_vertices);
        let skin = 4 + u64::from(self.skin_width) * u64::from(self.skin_height);
        let rows = [
            ("number of skins", 48, self.num_skins, skin),
            ("skin width", 52, self.skin_width, 1),
            ("skin height", 56, self.skin_height, 1),
            ("number of vertices", 60, self.num_vertices, 12),
            ("number of triangles", 64, self.num_triangles, 16),
            ("number of frames", 68, self.num_frames, 28 + 4 * vertices),
        ];
        for (what, offset, count, each) in rows {
            let most = body / each.max(1);
            if count == 0 || u64::from(count) > most {
                return Err(FormatError::new(
                    ErrorKind::OutOfRange,
                    format!("MDL {what}"),
                    format!("{}", count.cast_signed()),
                    format!("1 to {most} in a file of {size} bytes"),
                )
                .at(offset));
            }
        }
        Ok(())
    }
}

fn read(r: &mut Reader<'_>) -> Option<MdlHeader> {
    let (scale, translate, bounding_radius) = (r.vec3()?, r.vec3()?, r.f32()?);
    r.vec3()?; // the eye position, which no engine uses
    let header = MdlHeader {
        scale,
        translate,
        bounding_radius,
        num_skins: r.u32()?,
        skin_width: r.u32()?,
        skin_height: r.u32()?,
        num_vertices: r.u32()?,
        num_triangles: r.u32()?,
        num_frames: r.u32()?,
        sync_type: r.i32()?,
        flags: r.u32()?,
    };
    r.f32()?; // the average triangle size
    Some(header)
}
