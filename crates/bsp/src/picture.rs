//! True-colour pictures beside a level: TGA, PNG, JPEG and PCX, for skyboxes and for textures that
//! replace those of the level.

use crate::error::{ErrorKind, FormatError, Limits};
use crate::reader::Reader;
use crate::sniff::{FileKind, sniff};
use std::io::Cursor;

/// Endings under which a picture is looked for, in this order.
pub const EXTENSIONS: [&str; 5] = ["tga", "png", "jpg", "jpeg", "pcx"];

/// A picture of sRGB-encoded colours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgba {
    /// Texels across; at least 1.
    pub width: u32,
    /// Texels down; at least 1.
    pub height: u32,
    /// `width * height` texels, rows from the top: red, green, blue, and alpha (255 opaque).
    pub texels: Vec<[u8; 4]>,
}

/// Bytes of the file with this game path, if there is one.
pub type Files<'a> = dyn Fn(&str) -> Option<Vec<u8>> + 'a;

/// Reads the picture whose game path without ending is `stem` (`gfx/env/skyrt`): the first of
/// [`EXTENSIONS`] that `files` has. `None` if it has none; with the path that was found, else.
pub fn find(
    stem: &str,
    files: &Files<'_>,
    limits: &Limits,
) -> Option<(String, Result<Rgba, FormatError>)> {
    EXTENSIONS.iter().find_map(|extension| {
        let path = format!("{stem}.{extension}");
        let data = files(&path)?;
        let picture = decode(&path, &data, limits);
        Some((path, picture))
    })
}

/// Reads a picture. What kind it is, its first bytes say, and for TGA, which has no signature, the
/// ending of `name`; the name goes into errors.
///
/// The memory it takes is bounded by [`Limits::max_texture_side`], and for TGA and PCX by 128 times
/// the bytes of the file too.
///
/// # Errors
/// A kind that is none of the four, a variant of one that is not read (Truevision's 16-bit colours,
/// PCX of another depth than 8 bits), a size of 0 or above the limit, pixels that end too early.
pub fn decode(name: &str, data: &[u8], limits: &Limits) -> Result<Rgba, FormatError> {
    let is_tga = name
        .rsplit_once('.')
        .is_some_and(|(_, ending)| ending.eq_ignore_ascii_case("tga"));
    let decoded = match sniff(data) {
        FileKind::Png => coded(data, image::ImageFormat::Png, "PNG", limits),
        FileKind::Jpeg => coded(data, image::ImageFormat::Jpeg, "JPEG", limits),
        FileKind::Pcx => pcx(data, limits),
        _ if is_tga => tga(data, limits),
        other => Err(FormatError::new(
            ErrorKind::UnsupportedFormat,
            "picture",
            other.describe(),
            "TGA, PNG, JPEG or PCX",
        )),
    };
    decoded.map_err(|e| e.in_file(name))
}

/// Number of texels of a picture, if its size is allowed.
fn texels_of(part: &str, [width, height]: [u32; 2], limits: &Limits) -> Result<usize, FormatError> {
    let side = 1..=limits.max_texture_side;
    let count = (width as usize).checked_mul(height as usize);
    match count {
        Some(count) if side.contains(&width) && side.contains(&height) => Ok(count),
        _ => Err(FormatError::new(
            ErrorKind::OutOfRange,
            part,
            format!("a size of {width}x{height}"),
            format!("1 to {} each way", limits.max_texture_side),
        )),
    }
}

fn truncated(part: &str, found: impl Into<String>, wanted: impl Into<String>) -> FormatError {
    FormatError::new(ErrorKind::Truncated, part, found, wanted)
}

/// PNG and JPEG.
fn coded(
    data: &[u8],
    format: image::ImageFormat,
    part: &str,
    limits: &Limits,
) -> Result<Rgba, FormatError> {
    let reader = || image::ImageReader::with_format(Cursor::new(data), format);
    let broken =
        |e: image::ImageError| FormatError::new(ErrorKind::OutOfRange, part, e.to_string(), part);
    let (width, height) = reader().into_dimensions().map_err(broken)?;
    texels_of(part, [width, height], limits)?;
    // 16 bits per channel, twice: what is decoded and what is converted.
    let bytes = u64::from(width) * u64::from(height) * 16;
    let mut reader = reader();
    let mut room = image::Limits::default();
    room.max_alloc = Some(bytes + (1 << 20));
    reader.limits(room);
    let picture = reader.decode().map_err(broken)?.into_rgba8();
    let (width, height) = picture.dimensions();
    let (texels, _) = picture.as_raw().as_chunks::<4>();
    Ok(Rgba {
        width,
        height,
        texels: texels.to_vec(),
    })
}

/// How a TGA spells one texel.
enum TgaTexel {
    Grey,
    /// An index into colours, of which the first has this number.
    Mapped(usize, Vec<[u8; 4]>),
    Bgr,
    Bgra,
}

impl TgaTexel {
    fn read(&self, r: &mut Reader<'_>) -> Option<[u8; 4]> {
        match self {
            Self::Grey => r.u8().map(|v| [v, v, v, 255]),
            Self::Mapped(first, colours) => {
                let index = usize::from(r.u8()?).checked_sub(*first);
                // An index without a colour is black, as a short palette's is.
                let colour = index.and_then(|i| colours.get(i));
                Some(colour.copied().unwrap_or([0, 0, 0, 255]))
            }
            Self::Bgr => r.array().map(|[b, g, r]| [r, g, b, 255]),
            Self::Bgra => r.array().map(|[b, g, r, a]| [r, g, b, a]),
        }
    }
}

/// Truevision TGA: 8-bit grey, 8-bit indices into colours, 24 or 32 bits; plain or run-length coded.
fn tga(data: &[u8], limits: &Limits) -> Result<Rgba, FormatError> {
    const HEADER: usize = 18;
    let mut r = Reader::new(data);
    let Some(header) = r.array::<HEADER>() else {
        let found = format!("{} bytes", data.len());
        return Err(truncated("TGA header", found, format!("at least {HEADER}")));
    };
    #[rustfmt::skip]
    let [id, mapped, kind, f0, f1, n0, n1, map_bits, _, _, _, _, w0, w1, h0, h1, bits, descriptor] =
        header;
    let word = |lo, hi| u16::from_le_bytes([lo, hi]);
    let [width, height] = [word(w0, w1), word(h0, h1)].map(u32::from);
    let count = texels_of("TGA header", [width, height], limits).map_err(|e| e.at(12))?;
    let unsupported = |found: String, allowed: &str, at| {
        FormatError::new(ErrorKind::UnsupportedFormat, "TGA header", found, allowed).at(at)
    };
    if r.take(usize::from(id)).is_none() {
        let found = format!("{} bytes", r.remaining());
        return Err(truncated("TGA name", found, format!("{id}")));
    }
    let mut colours = Vec::new();
    if mapped == 1 {
        let texel = match map_bits {
            24 => TgaTexel::Bgr,
            32 => TgaTexel::Bgra,
            _ => {
                let found = format!("a palette of {map_bits} bits");
                return Err(unsupported(found, "24 or 32", 7));
            }
        };
        for index in 0..word(n0, n1) {
            let Some(colour) = texel.read(&mut r) else {
                let wanted = format!("{} colours", word(n0, n1));
                return Err(truncated("TGA palette", format!("{index} colours"), wanted));
            };
            colours.push(colour);
        }
    }
    let texel = match (kind, bits) {
        (1 | 9, 8) if mapped == 1 => TgaTexel::Mapped(usize::from(word(f0, f1)), colours),
        (2 | 10, 24) => TgaTexel::Bgr,
        (2 | 10, 32) => TgaTexel::Bgra,
        (3 | 11, 8) => TgaTexel::Grey,
        _ => {
            let found = format!("type {kind} with {bits} bits per texel");
            let allowed = "types 1, 3, 9, 11 with 8 bits and 2, 10 with 24 or 32";
            return Err(unsupported(found, allowed, 2));
        }
    };
    let pixels_at = (data.len() - r.remaining()) as u64;
    let stored = if kind >= 8 {
        tga_runs(&mut r, &texel, count)
    } else {
        // No more than the bytes justify: a texel is one at least.
        (count <= r.remaining()).then(|| (0..count).map_while(|_| texel.read(&mut r)).collect())
    };
    let stored: Vec<[u8; 4]> = stored
        .filter(|s: &Vec<_>| s.len() == count)
        .ok_or_else(|| {
            let found = format!("{} bytes", data.len() as u64 - pixels_at);
            truncated("TGA pixels", found, format!("{width}x{height} texels")).at(pixels_at)
        })?;
    // Rows go up unless the descriptor says otherwise; columns go right.
    let mut rows: Vec<Vec<[u8; 4]>> = stored
        .chunks(width as usize)
        .map(<[[u8; 4]]>::to_vec)
        .collect();
    if descriptor & 0x20 == 0 {
        rows.reverse();
    }
    if descriptor & 0x10 != 0 {
        rows.iter_mut().for_each(|row| row.reverse());
    }
    Ok(Rgba {
        width,
        height,
        texels: rows.concat(),
    })
}

/// Run-length coded texels: packets of up to 128, each a repeated texel or a row of them.
fn tga_runs(r: &mut Reader<'_>, texel: &TgaTexel, count: usize) -> Option<Vec<[u8; 4]>> {
    let mut out = Vec::new();
    while out.len() < count {
        let head = r.u8()?;
        let length = (usize::from(head & 0x7f) + 1).min(count - out.len());
        if head & 0x80 != 0 {
            out.extend(std::iter::repeat_n(texel.read(r)?, length));
        } else {
            for _ in 0..length {
                out.push(texel.read(r)?);
            }
        }
    }
    Some(out)
}

/// ZSoft PCX of 8 bits per channel: one plane of indices into the 256 colours at the file's end, or
/// three planes.
fn pcx(data: &[u8], limits: &Limits) -> Result<Rgba, FormatError> {
    const HEADER: usize = 128;
    const PALETTE: usize = 768;
    let header = || {
        let mut at = Reader::at(data, 4)?;
        let corners = [at.u16()?, at.u16()?, at.u16()?, at.u16()?];
        let mut at = Reader::at(data, 65)?;
        let (planes, bytes_per_line) = (at.u8()?, at.u16()?);
        Some((corners, planes, bytes_per_line, Reader::at(data, HEADER)?))
    };
    let Some(([x0, y0, x1, y1], planes, bytes_per_line, mut r)) = header() else {
        let found = format!("{} bytes", data.len());
        return Err(truncated("PCX header", found, format!("at least {HEADER}")));
    };
    // A corner before the other wraps to a size above every limit.
    let side = |lo: u16, hi: u16| (u32::from(hi) + 1).wrapping_sub(u32::from(lo));
    let [width, height] = [side(x0, x1), side(y0, y1)];
    texels_of("PCX header", [width, height], limits).map_err(|e| e.at(4))?;
    let wide = u32::from(bytes_per_line) >= width;
    if !matches!(planes, 1 | 3) || !wide {
        let found = format!("{planes} planes of {bytes_per_line} bytes per row");
        let allowed = format!("1 or 3 planes of at least {width}");
        let e = FormatError::new(ErrorKind::UnsupportedFormat, "PCX header", found, allowed);
        return Err(e.at(65));
    }
    let colours = match data.last_chunk::<PALETTE>() {
        Some(bytes) if planes == 1 => bytes.as_chunks::<3>().0,
        _ => &[],
    };
    let line = usize::from(bytes_per_line) * usize::from(planes);
    let mut run = (0_usize, 0_u8);
    let mut row = Vec::with_capacity(line);
    let mut texels = Vec::new();
    for y in 0..height {
        row.clear();
        // A run may go on in the next row.
        while row.len() < line {
            if run.0 == 0 {
                let byte = r.u8();
                run = match byte {
                    Some(b) if b >= 0xc0 => (usize::from(b & 0x3f), r.u8().unwrap_or(0)),
                    Some(b) => (1, b),
                    None => {
                        let wanted = format!("{height} rows");
                        return Err(truncated("PCX pixels", format!("{y} rows"), wanted));
                    }
                };
            }
            let length = run.0.min(line - row.len());
            row.extend(std::iter::repeat_n(run.1, length));
            run.0 -= length;
        }
        let plane = |p: u8| {
            let begin = usize::from(p) * usize::from(bytes_per_line);
            row.get(begin..).unwrap_or_default().iter()
        };
        let width = width as usize;
        if planes == 1 {
            texels.extend(plane(0).take(width).map(|&i| {
                let [r, g, b] = colours.get(usize::from(i)).copied().unwrap_or_default();
                [r, g, b, 255]
            }));
        } else {
            let colours = plane(0).zip(plane(1)).zip(plane(2));
            texels.extend(colours.take(width).map(|((&r, &g), &b)| [r, g, b, 255]));
        }
    }
    Ok(Rgba {
        width,
        height,
        texels,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Upper left, upper right, lower left, lower right.
    const FOUR: [[u8; 4]; 4] = [
        [255, 0, 0, 255],
        [0, 255, 0, 255],
        [0, 0, 255, 255],
        [9, 90, 200, 255],
    ];

    fn read(name: &str, data: &[u8]) -> Rgba {
        decode(name, data, &Limits::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    fn tga_file(kind: u8, bits: u8, descriptor: u8, body: &[u8]) -> Vec<u8> {
        let mut file = vec![3, 0, kind, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 2, 0, bits];
        file.push(descriptor);
        file.extend(b"id!");
        file.extend(body);
        file
    }

    fn bgr(order: [usize; 4]) -> Vec<u8> {
        let texel = |i: usize| [FOUR[i][2], FOUR[i][1], FOUR[i][0]];
        order.iter().flat_map(|&i| texel(i)).collect()
    }

    fn pcx_file(planes: u8, rows: &[u8], palette: &[u8]) -> Vec<u8> {
        let mut file = vec![10, 5, 1, 8, 0, 0, 0, 0, 1, 0, 1, 0];
        file.resize(65, 0);
        file.extend([planes, 3, 0]);
        file.resize(128, 0);
        file.extend(rows);
        file.extend(palette);
        file
    }

    #[test]
    fn every_kind_gives_the_same_picture() {
        let expected = Rgba {
            width: 2,
            height: 2,
            texels: FOUR.to_vec(),
        };
        // TGA: bottom-up, top-down, mirrored; coded in runs, with alpha; indices into colours.
        for (descriptor, order) in [
            (0, [2, 3, 0, 1]),
            (0x20, [0, 1, 2, 3]),
            (0x30, [1, 0, 3, 2]),
        ] {
            let file = tga_file(2, 24, descriptor, &bgr(order));
            assert_eq!(read("a.TGA", &file), expected);
        }
        let mut runs = vec![0x82, 1, 2, 3, 4, 0, 5, 6, 7, 8];
        let picture = read("a.tga", &tga_file(10, 32, 0x20, &runs));
        let (a, b) = ([3, 2, 1, 4], [7, 6, 5, 8]);
        assert_eq!(picture.texels, [a, a, a, b]);
        runs.truncate(9);
        let e = decode("a.tga", &tga_file(10, 32, 0x20, &runs), &Limits::default());
        assert_eq!(
            e.unwrap_err().to_string(),
            "a.tga: TGA pixels at byte 21: found 9 bytes, allowed is 2x2 texels"
        );
        let mut mapped = tga_file(1, 8, 0x20, &bgr([0, 1, 2, 3]));
        // Four colours, of which the first has number 1.
        mapped[1..8].copy_from_slice(&[1, 1, 1, 0, 4, 0, 24]);
        mapped.extend([1, 2, 3, 4]);
        assert_eq!(read("a.tga", &mapped), expected);

        // PCX: a row of three bytes, of which the last is padding; a run across rows.
        let mut palette = [0; 768];
        for (i, c) in FOUR.iter().enumerate() {
            palette[3 * i..][..3].copy_from_slice(&c[..3]);
        }
        let file = pcx_file(1, &[0, 1, 2, 2, 3, 0], &palette);
        assert_eq!(read("a.pcx", &file), expected);
        let file = pcx_file(1, &[1, 0xc4, 2, 0], &palette);
        let [g, b] = [FOUR[1], FOUR[2]];
        assert_eq!(read("a.pcx", &file).texels, [g, b, b, b]);
        let planes = [
            0xc1, 255, 0, 0, 0, 0xc1, 255, 0, 0, 0, 0, 0, 9, 0, 0, 90, 0, 0xc1, 255, 0xc1, 200, 0,
        ];
        assert_eq!(read("a.pcx", &pcx_file(3, &planes, &[])), expected);

        // PNG by its signature, whatever its name.
        let mut file = Cursor::new(Vec::new());
        let colours = FOUR.concat();
        image::write_buffer_with_format(
            &mut file,
            &colours,
            2,
            2,
            image::ColorType::Rgba8,
            image::ImageFormat::Png,
        )
        .expect("a PNG");
        assert_eq!(read("a.tga", file.get_ref()), expected);
        // JPEG loses a little: a plain picture stays what it is to a few codes.
        let mut file = Cursor::new(Vec::new());
        let grey = [120_u8; 3 * 64];
        image::write_buffer_with_format(
            &mut file,
            &grey,
            8,
            8,
            image::ColorType::Rgb8,
            image::ImageFormat::Jpeg,
        )
        .expect("a JPEG");
        let picture = read("a.jpg", file.get_ref());
        assert_eq!((picture.width, picture.height), (8, 8));
        assert!((picture.texels.iter().flatten()).all(|&c| c == 255 || c.abs_diff(120) < 4));
    }

    #[test]
    fn the_first_ending_that_is_there_counts() {
        let tga = tga_file(2, 24, 0x20, &bgr([0, 1, 2, 3]));
        let files = |path: &str| match path {
            "sky/up.tga" => Some(tga.clone()),
            "sky/up.png" | "sky/dn.pcx" => Some(b"no picture".to_vec()),
            _ => None,
        };
        let limits = Limits::default();
        let (path, picture) = find("sky/up", &files, &limits).expect("a file");
        assert!(path == "sky/up.tga" && picture.is_ok());
        let (_, broken) = find("sky/dn", &files, &limits).expect("a file");
        assert_eq!(
            broken.expect_err("no picture").to_string(),
            "sky/dn.pcx: picture: found a file of no known kind, allowed is TGA, PNG, JPEG or PCX"
        );
        assert!(find("sky/lf", &files, &limits).is_none());
    }

    #[test]
    fn pictures_that_promise_too_much_are_refused_before_memory_is_asked_for() {
        let limits = Limits::default();
        let kind = |name: &str, data: &[u8]| decode(name, data, &limits).expect_err(name).kind();
        // 65,535 each way; 8,192 each way without a byte of pixels.
        let mut huge = tga_file(2, 24, 0, &[]);
        huge[12..16].fill(255);
        assert_eq!(kind("a.tga", &huge), ErrorKind::OutOfRange);
        huge[12..16].copy_from_slice(&[0, 32, 0, 32]);
        assert_eq!(kind("a.tga", &huge), ErrorKind::Truncated);
        huge[2] = 10;
        assert_eq!(kind("a.tga", &huge), ErrorKind::Truncated);
        let mut pcx = pcx_file(1, &[], &[0; 768]);
        pcx[4..8].copy_from_slice(&[2, 0, 2, 0]);
        assert_eq!(kind("a.pcx", &pcx), ErrorKind::OutOfRange);
        pcx[4..12].copy_from_slice(&[0, 0, 0, 0, 255, 31, 255, 31]);
        pcx[66..68].copy_from_slice(&[0, 32]);
        assert_eq!(kind("a.pcx", &pcx), ErrorKind::Truncated);
        // A PNG whose header says 65,536 each way.
        let png = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\x01\0\0\0\x01\0\0\x08\x06\0\0\0\0\0\0\0";
        assert_eq!(kind("a.png", png), ErrorKind::OutOfRange);
        assert_eq!(kind("a.jpg", b"\xff\xd8\xff\xe0"), ErrorKind::OutOfRange);
        // Every beginning of a good file is an error or a picture, never a panic.
        let mut mapped = tga_file(9, 8, 0, &bgr([0, 1, 2, 3]));
        mapped[1..8].copy_from_slice(&[1, 1, 1, 0, 4, 0, 24]);
        mapped.extend([0x83, 9]);
        for file in [mapped, pcx] {
            for end in 0..file.len() {
                let _ = decode("a.tga", file.get(..end).unwrap_or_default(), &limits);
            }
        }
    }
}
