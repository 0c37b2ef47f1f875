//! Palette and picture lumps (`gfx/*.lmp`), and the light table `gfx/colormap.lmp`.

use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::reader::Reader;

/// First palette index that ignores lighting ("fullbright"); all up to 255 do, except that 255 is
/// a hole in textures whose name starts with `{`.
pub const FIRST_FULLBRIGHT: u8 = 224;

/// 256 colours, 8-bit display-referred RGB each.
#[derive(Clone, PartialEq, Eq)]
pub struct Palette(pub [[u8; 3]; 256]);

impl std::fmt::Debug for Palette {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Palette(..)")
    }
}

impl Palette {
    /// The colour at `index`.
    pub fn rgb(&self, index: u8) -> [u8; 3] {
        self.0.get(usize::from(index)).copied().unwrap_or_default()
    }

    /// Reads `gfx/palette.lmp`: 256 RGB triples. Bytes after them are left.
    ///
    /// # Errors
    /// [`ErrorKind::Truncated`] if there are fewer than 768 bytes.
    pub fn parse(data: &[u8]) -> Result<Self, FormatError> {
        let Some(bytes) = data.first_chunk::<768>() else {
            return Err(FormatError::new(
                ErrorKind::Truncated,
                "palette",
                format!("{} bytes", data.len()),
                "768 bytes (256 RGB triples)",
            ));
        };
        let (triples, _) = bytes.as_chunks::<3>();
        let mut out = [[0; 3]; 256];
        for (to, from) in out.iter_mut().zip(triples) {
            *to = *from;
        }
        Ok(Self(out))
    }
}

/// `gfx/colormap.lmp`: for each of 64 light levels the palette index that each palette index
/// becomes; row 0 is the brightest, about row 32 neutral, row 63 black.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colormap(Vec<u8>);

impl Colormap {
    /// Light levels of a colormap.
    pub const ROWS: usize = 64;

    /// Reads 64 rows of 256 indices; bytes after them are left.
    ///
    /// # Errors
    /// [`ErrorKind::Truncated`] if there are fewer than 16,384 bytes.
    pub fn parse(data: &[u8]) -> Result<Self, FormatError> {
        match data.get(..Self::ROWS * 256) {
            Some(rows) => Ok(Self(rows.to_vec())),
            None => Err(FormatError::new(
                ErrorKind::Truncated,
                "colormap",
                format!("{} bytes", data.len()),
                "16384 bytes (64 rows of 256)",
            )),
        }
    }

    /// What palette `index` becomes at light level `row` (0 brightest, clamped to 63).
    pub fn shade(&self, row: usize, index: u8) -> u8 {
        let at = row.min(Self::ROWS - 1) * 256 + usize::from(index);
        self.0.get(at).copied().unwrap_or(index)
    }
}

/// A picture of palette indices, rows from the top; 255 is transparent in `gfx/*.lmp`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in texels; at least 1.
    pub width: u32,
    /// Height in texels; at least 1.
    pub height: u32,
    /// `width * height` palette indices.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// Reads a picture lump: width, height, then the indices.
    ///
    /// # Errors
    /// A size of 0, or above [`Limits::max_texture_side`], or beyond the bytes given.
    pub fn parse(
        data: &[u8],
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Self, FormatError> {
        let mut reader = Reader::new(data);
        let (Some(width), Some(height)) = (reader.u32(), reader.u32()) else {
            return Err(FormatError::new(
                ErrorKind::Truncated,
                "picture header",
                format!("{} bytes", data.len()),
                "at least 8 bytes",
            ));
        };
        let side = 1..=limits.max_texture_side;
        if !side.contains(&width) || !side.contains(&height) {
            return Err(FormatError::new(
                ErrorKind::OutOfRange,
                "picture header",
                format!("a size of {width}x{height}"),
                format!("1 to {} each way", limits.max_texture_side),
            )
            .at(0));
        }
        let wanted = u64::from(width) * u64::from(height);
        let pixels = usize::try_from(wanted).ok().and_then(|n| reader.take(n));
        let Some(pixels) = pixels else {
            return Err(FormatError::new(
                ErrorKind::Truncated,
                "picture",
                format!("{} bytes of pixels", reader.remaining()),
                format!("{wanted} for {width}x{height}"),
            )
            .at(8));
        };
        if reader.remaining() > 0 {
            warnings.add(WarningKind::Picture, "", || {
                format!("picture has {} bytes after its pixels", reader.remaining())
            });
        }
        Ok(Self {
            width,
            height,
            pixels: pixels.to_vec(),
        })
    }
}
