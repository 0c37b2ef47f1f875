//! Quake III's models (`.md3`, version 15), as engines read them in the place of alias models: surfaces of vertices
//! in every frame. Tags, level of detail and shaders have no use here.

use crate::error::{ErrorKind, FormatError, Limits};
use crate::posed::PosedSurface;
use crate::reader::{Reader, latin1, until_nul};
use std::f32::consts::TAU;

/// The one version there is.
pub const VERSION: i32 = 15;
/// Units of a vertex coordinate.
const SCALE: f32 = 1.0 / 64.0;
/// Bytes of the header, and of a surface's.
const HEADER: usize = 108;

/// A model of Quake III.
#[derive(Clone, Debug, PartialEq)]
pub struct Md3 {
    /// Effect flags, as those of alias models.
    pub flags: u32,
    /// Frames, at least one.
    pub frames: usize,
    /// Surfaces, at least one.
    pub surfaces: Vec<PosedSurface>,
    /// For each surface the vertices of all frames.
    vertices: Vec<Vec<Vertex>>,
}

/// A vertex in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Vertex {
    /// In 64ths of a unit.
    place: [i16; 3],
    /// Its normal: angle to +z and angle about z from +x, both in 255ths of a turn.
    angles: [u8; 2],
}

impl Md3 {
    /// Reads a model.
    ///
    /// # Errors
    /// Another version; no frame or no surface; a surface with another number of frames, or with data outside the
    /// file; a triangle whose vertices are not there; texture coordinates that are no numbers.
    pub fn parse(data: &[u8], limits: &Limits) -> Result<Self, FormatError> {
        limits.check_file(data.len() as u64)?;
        let mut r = Part::new(data, 0, "MD3 header", 0)?;
        let magic = r.get(Reader::array::<4>)?;
        let version = r.get(Reader::i32)?;
        if (&magic, version) != (b"IDP3", VERSION) {
            let found = format!("version {version} of {:?}", latin1(&magic));
            return Err(r.error(
                ErrorKind::UnsupportedFormat,
                found,
                "version 15 of \"IDP3\"",
            ));
        }
        r.get(|r| r.take(64))?;
        let flags = r.get(Reader::u32)?;
        let [frames, _, count, _] = r.counts()?;
        let [_, _, start, _] = r.counts()?;
        // Each takes 8 bytes of vertices or 108 of a surface's header.
        let frames = r.between("frames", frames, data.len() / 8)?;
        let count = r.between("surfaces", count, data.len() / HEADER)?;
        let mut model = Self {
            flags,
            frames,
            surfaces: Vec::with_capacity(count),
            vertices: Vec::with_capacity(count),
        };
        let mut at = start as usize;
        for i in 0..count {
            at += model.surface(data, at, i)?;
        }
        Ok(model)
    }

    /// Reads the surface at `at`; how many bytes on the next one is.
    fn surface(&mut self, data: &[u8], at: usize, index: usize) -> Result<usize, FormatError> {
        let mut r = Part::new(data, at, "MD3 surface", index)?;
        let magic = r.get(Reader::array::<4>)?;
        if &magic != b"IDP3" {
            let found = format!("a part of {:?}", latin1(&magic));
            return Err(r.error(ErrorKind::OutOfRange, found, "\"IDP3\""));
        }
        let name = r.get(|r| r.take(64))?;
        let name = latin1(until_nul(name)).trim().to_owned();
        r.get(Reader::i32)?;
        let [frames, _, vertices, triangles] = r.counts()?;
        let [at_triangles, _, at_uv, at_vertices] = r.counts()?;
        let end = r.get(Reader::u32)?;
        if frames as usize != self.frames {
            let allowed = format!("{}, as the header says", self.frames);
            return Err(r.error(ErrorKind::OutOfRange, format!("{frames} frames"), allowed));
        }
        // A surface may have nothing to show; the others do.
        let vertices = r.between("vertices", vertices, data.len() / 8)?;
        let table = |what: &'static str, offset: u32, count: usize, size: usize| {
            let begin = at.checked_add(offset as usize);
            let bytes = begin.zip(count.checked_mul(size));
            let found = bytes.and_then(|(begin, bytes)| data.get(begin..begin.checked_add(bytes)?));
            found.ok_or_else(|| {
                let part = format!("MD3 surface {index}");
                let found = format!("{count} {what} from byte {offset} of it on");
                let allowed = format!("what a file of {} bytes holds", data.len());
                FormatError::new(ErrorKind::Truncated, part, found, allowed).at(at as u64)
            })
        };
        let corners = table("triangles", at_triangles, triangles as usize, 12)?;
        let mut indices = Vec::with_capacity(triangles as usize);
        for (i, bytes) in corners.chunks_exact(12).enumerate() {
            let mut t = Reader::new(bytes);
            let corner = (t.u32(), t.u32(), t.u32());
            let (Some(a), Some(b), Some(c)) = corner else {
                break;
            };
            if [a, b, c].iter().any(|&v| v as usize >= vertices) {
                let part = format!("MD3 surface {index}, triangle");
                let found = format!("vertices {a}, {b}, {c}");
                let allowed = format!("0 to {}", vertices - 1);
                let error = FormatError::new(ErrorKind::OutOfRange, part, found, allowed);
                return Err(error.index(i as u64));
            }
            indices.push([a, b, c]);
        }
        let mut uv = Vec::with_capacity(vertices);
        for (i, bytes) in table("texture coordinates", at_uv, vertices, 8)?
            .chunks_exact(8)
            .enumerate()
        {
            let mut t = Reader::new(bytes);
            let (Some(s), Some(t)) = (t.f32(), t.f32()) else {
                break;
            };
            if !s.is_finite() || !t.is_finite() {
                let part = format!("MD3 surface {index}, texture coordinate");
                let error =
                    FormatError::new(ErrorKind::OutOfRange, part, format!("{s}, {t}"), "numbers");
                return Err(error.index(i as u64));
            }
            uv.push([s, t]);
        }
        let all = vertices.saturating_mul(self.frames);
        let places = table("vertices of all frames", at_vertices, all, 8)?;
        let place = |bytes: &[u8]| {
            let mut v = Reader::new(bytes);
            Some(Vertex {
                place: [v.i16()?, v.i16()?, v.i16()?],
                angles: v.array()?,
            })
        };
        self.vertices
            .push(places.chunks_exact(8).filter_map(place).collect());
        self.surfaces.push(PosedSurface {
            name,
            uv,
            triangles: indices,
        });
        Ok(end as usize)
    }

    /// Where the vertices of all surfaces are in a frame that is there.
    pub(crate) fn pose(&self, frame: usize) -> Vec<[f32; 3]> {
        let place = |v: &Vertex| v.place.map(|c| f32::from(c) * SCALE);
        self.frame(frame).map(place).collect()
    }

    /// Unit normals of the vertices of all surfaces in a frame that is there.
    pub(crate) fn normals(&self, frame: usize) -> Vec<[f32; 3]> {
        let normal = |v: &Vertex| {
            let [from_up, about] = v.angles.map(|a| f32::from(a) * (TAU / 255.0));
            let (sin, cos) = from_up.sin_cos();
            [about.cos() * sin, about.sin() * sin, cos]
        };
        self.frame(frame).map(normal).collect()
    }

    fn frame(&self, frame: usize) -> impl Iterator<Item = &Vertex> {
        let surfaces = self.surfaces.iter().zip(&self.vertices);
        surfaces.flat_map(move |(surface, all)| {
            let n = surface.uv.len();
            all.chunks_exact(n.max(1)).nth(frame).unwrap_or_default()
        })
    }
}

/// A part of the file with a name for errors.
struct Part<'a> {
    data: &'a [u8],
    r: Reader<'a>,
    name: &'static str,
    index: usize,
    at: usize,
}

impl<'a> Part<'a> {
    fn new(
        data: &'a [u8],
        at: usize,
        name: &'static str,
        index: usize,
    ) -> Result<Self, FormatError> {
        let r = Reader::at(data, at);
        let part = Self {
            data,
            r: r.unwrap_or(Reader::new(&[])),
            name,
            index,
            at,
        };
        match r {
            Some(_) => Ok(part),
            None => Err(part.truncated()),
        }
    }

    fn error(
        &self,
        kind: ErrorKind,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> FormatError {
        let error = FormatError::new(kind, self.name, found, allowed);
        error.index(self.index as u64).at(self.at as u64)
    }

    fn truncated(&self) -> FormatError {
        let found = format!("a file of {} bytes", self.data.len());
        self.error(ErrorKind::Truncated, found, "one that holds it whole")
    }

    fn get<T>(
        &mut self,
        read: impl FnOnce(&mut Reader<'a>) -> Option<T>,
    ) -> Result<T, FormatError> {
        read(&mut self.r).ok_or_else(|| self.truncated())
    }

    /// Four numbers.
    fn counts(&mut self) -> Result<[u32; 4], FormatError> {
        self.get(|r| Some([r.u32()?, r.u32()?, r.u32()?, r.u32()?]))
    }

    /// A count of 1 to `most`.
    fn between(&self, what: &str, count: u32, most: usize) -> Result<usize, FormatError> {
        if count == 0 || count as usize > most {
            let found = format!("{count} {what}");
            let allowed = format!("1 to {most} in a file of {} bytes", self.data.len());
            return Err(self.error(ErrorKind::OutOfRange, found, allowed));
        }
        Ok(count as usize)
    }
}
