//! WAD2 and WAD3 archives: named lumps of pictures, palettes and mip textures.

use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::lmp::{Palette, Picture};
use crate::miptex::{self, MipTex};
use crate::reader::{Reader, latin1, until_nul};

const HEADER_SIZE: usize = 12;
const ENTRY_SIZE: usize = 32;

/// Types of lumps.
pub mod lump_type {
    /// A palette.
    pub const PALETTE: u8 = 64;
    /// A picture: width, height, indices.
    pub const QPIC: u8 = 66;
    /// A sound in WAD2, a miptex with its palette in WAD3.
    pub const SOUND_OR_MIPTEX3: u8 = 67;
    /// A miptex of WAD2.
    pub const MIPTEX: u8 = 68;
}

/// Which kind of archive it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WadKind {
    /// Quake's: textures use the game's palette.
    Wad2,
    /// Half-Life's: textures carry their palettes.
    Wad3,
}

/// One lump of an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Name in lowercase, cut at its first NUL.
    pub name: String,
    /// Type, see [`lump_type`].
    pub kind: u8,
    /// Byte offset in the archive.
    pub offset: usize,
    /// Length in bytes; `offset + length` lies within the archive.
    pub length: usize,
}

/// The directory of an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wad {
    /// Which kind.
    pub kind: WadKind,
    /// The lumps in file order.
    pub entries: Vec<Entry>,
}

impl Wad {
    /// Reads the directory of an archive. Bad entries are left out with a warning.
    ///
    /// # Errors
    /// A wrong signature, or a directory outside of the archive, or one of more entries than
    /// [`Limits::max_wad_entries`].
    pub fn parse(
        data: &[u8],
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Self, FormatError> {
        limits.check_file(data.len() as u64)?;
        let mut reader = Reader::new(data);
        let fields = (reader.array::<4>(), reader.i32(), reader.i32());
        let (Some(magic), Some(count), Some(offset)) = fields else {
            return Err(FormatError::new(
                ErrorKind::Truncated,
                "WAD header",
                format!("{} bytes", data.len()),
                format!("at least {HEADER_SIZE}"),
            ));
        };
        let kind = match &magic {
            b"WAD2" => WadKind::Wad2,
            b"WAD3" => WadKind::Wad3,
            _ => {
                return Err(FormatError::new(
                    ErrorKind::UnknownFormat,
                    "WAD header",
                    format!("the signature {:?}", latin1(&magic)),
                    "\"WAD2\" or \"WAD3\"",
                )
                .at(0));
            }
        };
        let table = usize::try_from(offset)
            .ok()
            .and_then(|o| data.get(o..))
            .zip(usize::try_from(count).ok())
            .and_then(|(rest, n)| rest.get(..n.checked_mul(ENTRY_SIZE)?));
        let Some(table) = table else {
            return Err(FormatError::new(
                ErrorKind::OutOfRange,
                "WAD directory",
                format!("{count} entries at {offset}"),
                format!("a range within the archive's {} bytes", data.len()),
            )
            .at(4));
        };
        if table.len() / ENTRY_SIZE > limits.max_wad_entries {
            return Err(FormatError::new(
                ErrorKind::TooLarge,
                "WAD directory",
                format!("{count} entries"),
                format!("at most {}", limits.max_wad_entries),
            )
            .at(4));
        }
        let mut entries = Vec::with_capacity(table.len() / ENTRY_SIZE);
        for (index, row) in table.chunks_exact(ENTRY_SIZE).enumerate() {
            match entry(row, data.len()) {
                Ok(entry) => entries.push(entry),
                Err(why) => warnings.add(WarningKind::ArchiveEntry, why, || {
                    let name = latin1(until_nul(row.get(16..).unwrap_or_default()));
                    format!("WAD entry {index} ({name:?}) {why} and was left out")
                }),
            }
        }
        Ok(Self { kind, entries })
    }

    /// The lump of this name, compared without regard to case; of several the first.
    pub fn find(&self, name: &str) -> Option<&Entry> {
        self.entries
            .iter()
            .find(|e| e.name.eq_ignore_ascii_case(name))
    }

    /// The bytes of a lump in the archive's `data`.
    pub fn bytes<'a>(&self, data: &'a [u8], entry: &Entry) -> &'a [u8] {
        data.get(entry.offset..)
            .and_then(|rest| rest.get(..entry.length))
            .unwrap_or_default()
    }

    /// Whether a lump is a mip texture.
    pub fn is_texture(&self, entry: &Entry) -> bool {
        match self.kind {
            WadKind::Wad2 => entry.kind == lump_type::MIPTEX,
            WadKind::Wad3 => entry.kind == lump_type::SOUND_OR_MIPTEX3,
        }
    }

    /// The texture of this name, if there is one.
    pub fn texture(
        &self,
        data: &[u8],
        name: &str,
        limits: &Limits,
    ) -> Option<Result<MipTex, FormatError>> {
        let mut textures = self.entries.iter().filter(|e| self.is_texture(e));
        let entry = textures.find(|e| e.name.eq_ignore_ascii_case(name))?;
        Some(self.read_texture(data, entry, limits))
    }

    /// Reads a texture lump.
    ///
    /// # Errors
    /// A bad size or too few bytes.
    pub fn read_texture(
        &self,
        data: &[u8],
        entry: &Entry,
        limits: &Limits,
    ) -> Result<MipTex, FormatError> {
        let bytes = self.bytes(data, entry);
        let mut texture = MipTex::parse(bytes, limits)?;
        if self.kind == WadKind::Wad3 {
            texture.palette = wad3_palette(bytes, &texture);
        }
        Ok(texture)
    }

    /// Reads a picture lump.
    ///
    /// # Errors
    /// As for [`Picture::parse`].
    pub fn read_picture(
        &self,
        data: &[u8],
        entry: &Entry,
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Picture, FormatError> {
        Picture::parse(self.bytes(data, entry), limits, warnings)
    }
}

/// Reads a directory row; the error says what is wrong with the entry.
fn entry(row: &[u8], size: usize) -> Result<Entry, &'static str> {
    let mut r = Reader::new(row);
    let truncated = "is cut short";
    let offset = r.i32().ok_or(truncated)?;
    let on_disk = r.i32().ok_or(truncated)?;
    let length = r.i32().ok_or(truncated)?;
    let kind = r.u8().ok_or(truncated)?;
    let compression = r.u8().ok_or(truncated)?;
    r.u16().ok_or(truncated)?;
    let name = r.take(16).ok_or(truncated)?;
    if compression != 0 {
        return Err("is compressed");
    }
    let fits = |length: i32| {
        let offset = usize::try_from(offset).ok()?;
        let length = usize::try_from(length).ok()?;
        (offset.checked_add(length)? <= size).then_some((offset, length))
    };
    // Where the size overruns the archive but the size on disk fits, engines use that.
    let (offset, length) = fits(length)
        .or_else(|| fits(on_disk))
        .ok_or("lies outside of the archive")?;
    Ok(Entry {
        name: latin1(until_nul(name)).to_ascii_lowercase(),
        kind,
        offset,
        length,
    })
}

/// The palette behind the four sizes of a WAD3 texture: a count, normally 256, then RGB triples.
fn wad3_palette(bytes: &[u8], texture: &MipTex) -> Option<Box<Palette>> {
    let pixels = u64::from(texture.width) * u64::from(texture.height) / 64 * 85;
    let at = usize::try_from(pixels)
        .ok()?
        .checked_add(miptex::HEADER_SIZE)?;
    let mut r = Reader::at(bytes, at)?;
    let count = usize::from(r.u16()?).min(256);
    let mut palette = Palette([[0; 3]; 256]);
    for colour in palette.0.iter_mut().take(count) {
        *colour = r.array()?;
    }
    Some(Box::new(palette))
}
