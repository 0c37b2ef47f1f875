//! What kind of file some bytes are, by their content: names lie.

use crate::bsp::Format;
use crate::dem;
use crate::reader::Reader;

/// Kinds of files of Quake and its relatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FileKind {
    /// A PAK archive.
    Pak,
    /// A WAD2 archive.
    Wad2,
    /// A WAD3 archive.
    Wad3,
    /// A level of a format read here. Hexen II levels look the same until they are parsed.
    Bsp(Format),
    /// A Half-Life level (version 30).
    BspHalfLife,
    /// A Quake 64 level.
    BspQuake64,
    /// A Quake II level (IBSP version 38).
    BspQuake2,
    /// A level of a later engine (other IBSP, VBSP, RBSP).
    BspOther,
    /// An alias model (`IDPO`), of whatever version.
    Mdl,
    /// A sprite of Quake (`IDSP` version 1).
    Spr,
    /// A sprite of Half-Life (`IDSP` version 2), or one of another version.
    SprOther,
    /// A Quake II model (`IDP2`).
    Md2,
    /// A Quake II sprite (`IDS2`).
    Sp2,
    /// A Quake III model (`IDP3`).
    Md3,
    /// A Half-Life studio model (`IDST`, `IDSQ`).
    StudioModel,
    /// A Doom 3 mesh or animation (text).
    Md5,
    /// Coloured lightmaps (`QLIT`): `.lit` or `.lux`.
    Lit,
    /// A demo.
    Demo,
    /// A recording of QuakeWorld (`.qwd`, `.mvd`).
    DemoQuakeWorld,
    /// Entity text: `.ent`, or a `.map`.
    EntityText,
    /// A palette: 768 bytes.
    Palette,
    /// A picture lump: width, height, indices.
    Picture,
    /// A PNG picture.
    Png,
    /// A JPEG picture.
    Jpeg,
    /// A PCX picture.
    Pcx,
    /// None of these.
    Unknown,
}

impl FileKind {
    /// What the kind is called, with its article: `a PAK archive`.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Pak => "a PAK archive",
            Self::Wad2 => "a WAD2 archive",
            Self::Wad3 => "a WAD3 archive",
            Self::Bsp(Format::Bsp29) => "a Quake level (BSP 29)",
            Self::Bsp(Format::Psb2) => "a Quake level (2PSB)",
            Self::Bsp(Format::Bsp2) => "a Quake level (BSP2)",
            Self::BspHalfLife => "a Half-Life level (BSP 30)",
            Self::BspQuake64 => "a Quake 64 level",
            Self::BspQuake2 => "a Quake II level (IBSP 38)",
            Self::BspOther => "a level of a later engine",
            Self::Mdl => "an alias model (MDL)",
            Self::Spr => "a sprite (SPR)",
            Self::SprOther => "a sprite of another version than 1",
            Self::Md2 => "a Quake II model (MD2)",
            Self::Sp2 => "a Quake II sprite (SP2)",
            Self::Md3 => "a Quake III model (MD3)",
            Self::StudioModel => "a Half-Life studio model",
            Self::Md5 => "an MD5 mesh or animation",
            Self::Lit => "coloured lightmaps (LIT)",
            Self::Demo => "a demo (DEM)",
            Self::DemoQuakeWorld => "a recording of QuakeWorld (QWD or MVD)",
            Self::EntityText => "entity text",
            Self::Palette => "a palette",
            Self::Picture => "a picture lump (LMP)",
            Self::Png => "a PNG picture",
            Self::Jpeg => "a JPEG picture",
            Self::Pcx => "a PCX picture",
            Self::Unknown => "a file of no known kind",
        }
    }
}

/// Tells what kind of file some bytes are. The beginning of a file is enough, except for the kinds
/// that only their whole size tells ([`FileKind::Palette`], [`FileKind::Picture`]).
pub fn sniff(data: &[u8]) -> FileKind {
    let Some(magic) = data.first_chunk::<4>() else {
        return FileKind::Unknown;
    };
    let version = Reader::at(data, 4).and_then(|mut r| r.i32());
    match magic {
        b"PACK" => FileKind::Pak,
        b"WAD2" => FileKind::Wad2,
        b"WAD3" => FileKind::Wad3,
        b"BSP2" => FileKind::Bsp(Format::Bsp2),
        b"2PSB" => FileKind::Bsp(Format::Psb2),
        [29, 0, 0, 0] => FileKind::Bsp(Format::Bsp29),
        [30, 0, 0, 0] => FileKind::BspHalfLife,
        b" 46Q" => FileKind::BspQuake64,
        b"IBSP" if version == Some(38) => FileKind::BspQuake2,
        b"IBSP" | b"VBSP" | b"RBSP" => FileKind::BspOther,
        b"IDPO" => FileKind::Mdl,
        b"IDSP" if version == Some(1) => FileKind::Spr,
        b"IDSP" => FileKind::SprOther,
        b"IDP2" => FileKind::Md2,
        b"IDS2" => FileKind::Sp2,
        b"IDP3" => FileKind::Md3,
        b"IDST" | b"IDSQ" => FileKind::StudioModel,
        b"MD5V" => FileKind::Md5,
        b"QLIT" => FileKind::Lit,
        b"\x89PNG" => FileKind::Png,
        [0xff, 0xd8, 0xff, _] => FileKind::Jpeg,
        [0x0a, 5, 1, 8] => FileKind::Pcx,
        _ if is_demo(data) => FileKind::Demo,
        _ if is_picture(data) => FileKind::Picture,
        _ if data.len() == 768 => FileKind::Palette,
        _ if is_entity_text(data) => FileKind::EntityText,
        _ if dem::is_quakeworld(data) => FileKind::DemoQuakeWorld,
        _ => FileKind::Unknown,
    }
}

/// A demo begins with the number of a CD track as a line of text, then blocks: a length, three
/// view angles, a message.
fn is_demo(data: &[u8]) -> bool {
    let Some((_, start)) = dem::track_line(data) else {
        return false;
    };
    let block = Reader::at(data, start).and_then(|mut r| Some((r.i32()?, r.vec3()?)));
    // No engine writes messages of 256 KiB or more.
    block.is_some_and(|(length, angles)| {
        (0..1 << 18).contains(&length) && angles.iter().all(|a| a.is_finite())
    })
}

/// A picture's size accounts for its bytes; a few bytes more happen.
fn is_picture(data: &[u8]) -> bool {
    let mut r = Reader::new(data);
    let (Some(width), Some(height)) = (r.u32(), r.u32()) else {
        return false;
    };
    let wanted = u64::from(width) * u64::from(height);
    let have = r.remaining() as u64;
    wanted > 0 && width <= 1 << 16 && (wanted..=wanted + 3).contains(&have)
}

fn is_entity_text(data: &[u8]) -> bool {
    let head = data.get(..data.len().min(4096)).unwrap_or_default();
    let text = head.trim_ascii_start();
    let begins = text.starts_with(b"{") || text.starts_with(b"//");
    let printable = |b: &u8| *b >= b' ' || matches!(b, b'\t' | b'\n' | b'\r' | 0);
    begins && text.iter().all(printable) && text.contains(&b'{')
}
