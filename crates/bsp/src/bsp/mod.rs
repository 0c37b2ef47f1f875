//! Levels and brush models: BSP 29, 2PSB and BSP2.
//!
//! [`Bsp::parse`] reads and checks a whole file. Afterwards: a face without a
//! [`flaw`](Face::flaw) has all its edges and vertices in range; face ranges of models,
//! marksurface ranges of leafs and children of nodes and clipnodes are in range; what else may
//! still be bad says so at its field and has a method that deals with it.

pub mod bspx;
mod hull;
mod lighting;
mod records;
mod validate;
mod vis;

pub use hull::{HULL_BOXES, TRACE_EPSILON, Trace};
pub use lighting::{Extents, FaceLight, LUXEL, LightSamples, Lightmap, e5bgr9};
pub use records::{Clipnode, Face, FaceFlaw, Leaf, Model, Node, NodeChild, Plane, Texinfo};
pub use vis::{Pvs, decompress};

use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::miptex::{self, MipTex};
use crate::reader::{Reader, latin1};

/// Contents of leafs and hulls.
pub mod contents {
    /// Air.
    pub const EMPTY: i32 = -1;
    /// Solid.
    pub const SOLID: i32 = -2;
    /// Water.
    pub const WATER: i32 = -3;
    /// Slime.
    pub const SLIME: i32 = -4;
    /// Lava.
    pub const LAVA: i32 = -5;
    /// Sky.
    pub const SKY: i32 = -6;
    /// An origin brush.
    pub const ORIGIN: i32 = -7;
    /// A clip brush.
    pub const CLIP: i32 = -8;
    /// First of the currents, which go down to [`CURRENT_LAST`] and count as water.
    pub const CURRENT_FIRST: i32 = -9;
    /// Last of the currents.
    pub const CURRENT_LAST: i32 = -14;

    /// Currents as the water they are, everything else as it is.
    pub fn base(contents: i32) -> i32 {
        if (CURRENT_LAST..=CURRENT_FIRST).contains(&contents) {
            WATER
        } else {
            contents
        }
    }

    /// Whether it is water, slime or lava.
    pub fn is_liquid(contents: i32) -> bool {
        (LAVA..=WATER).contains(&base(contents))
    }
}

/// The formats read here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Quake's own, version 29.
    Bsp29,
    /// `2PSB` of the RMQ engine: 32-bit indices, 16-bit boxes.
    Psb2,
    /// `BSP2`: 32-bit indices, float boxes.
    Bsp2,
}

impl Format {
    /// `BSP29`, `2PSB` or `BSP2`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bsp29 => "BSP29",
            Self::Psb2 => "2PSB",
            Self::Bsp2 => "BSP2",
        }
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Names of the lumps, in file order.
pub const LUMP_NAMES: [&str; 15] = [
    "entities",
    "planes",
    "textures",
    "vertices",
    "visibility",
    "nodes",
    "texinfo",
    "faces",
    "lighting",
    "clipnodes",
    "leafs",
    "marksurfaces",
    "edges",
    "surfedges",
    "models",
];

/// Bytes of the header: version and fifteen lump ranges.
pub const HEADER_SIZE: usize = 124;

/// All lumps together may take this many times the file's bytes: lumps that share bytes exist only
/// in files made to exhaust memory.
const LUMP_BUDGET: u64 = 2;

/// A level or brush model.
#[derive(Clone, Debug)]
pub struct Bsp {
    /// Which format it came in.
    pub format: Format,
    /// Planes.
    pub planes: Vec<Plane>,
    /// Textures in the file's numbering; `None` is missing.
    pub textures: Vec<Option<MipTex>>,
    /// Vertices; may be not finite where no good face uses them.
    pub vertices: Vec<[f32; 3]>,
    /// Nodes of hull 0.
    pub nodes: Vec<Node>,
    /// How textures lie on faces.
    pub texinfos: Vec<Texinfo>,
    /// Faces, bad ones included and marked.
    pub faces: Vec<Face>,
    /// Clipnodes of hulls 1 to 3.
    pub clipnodes: Vec<Clipnode>,
    /// Leafs; number 0 is the solid outside that all solid cells share.
    pub leafs: Vec<Leaf>,
    /// Face indices that leafs refer to; see [`Bsp::leaf_faces`].
    pub marksurfaces: Vec<u32>,
    /// Edges as pairs of vertex indices; those that good faces use are in range.
    pub edges: Vec<[u32; 2]>,
    /// Signed edge indices that faces refer to.
    pub surfedges: Vec<i32>,
    /// The world (number 0) and its brush models; never empty.
    pub models: Vec<Model>,
    /// Compressed visibility rows.
    pub visibility: Vec<u8>,
    /// Lightmap samples, one byte each.
    pub lighting: Vec<u8>,
    /// Entity text as stored.
    pub entity_text: Vec<u8>,
    /// Lumps of the `BSPX` directory.
    pub bspx: bspx::Bspx,
    /// Whether the lighting lump has three bytes for each sample: a Half-Life level that says it
    /// is of version 29.
    pub rgb_lighting: bool,
    /// For each node, whether what hangs below it must not be followed.
    bad_nodes: Vec<bool>,
    /// For each clipnode, the same.
    bad_clipnodes: Vec<bool>,
}

impl Bsp {
    /// Reads and checks a level.
    ///
    /// # Errors
    /// Formats that are not read here, each named; a header, or a planes, vertices, edges,
    /// surfedges, faces or models lump that is cut short; no model; no face that can be drawn.
    /// Everything else is repaired or left out with a warning.
    pub fn parse(
        data: &[u8],
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Self, FormatError> {
        limits.check_file(data.len() as u64)?;
        let format = detect(data)?;
        let lumps = Lumps::read(data, format, warnings)?;
        let sizes = format.sizes();
        let leafs = records::leafs(lumps.table(10, sizes.leaf, warnings)?, format);
        let (nodes, bad_children) =
            records::nodes(lumps.table(5, sizes.node, warnings)?, format, leafs.len());
        warnings.add_many(WarningKind::Tree, "child", bad_children, || {
            "a node refers to a leaf or node that is not there: the solid leaf stands in".to_owned()
        });
        let (clipnodes, bad_children) =
            records::clipnodes(lumps.table(9, sizes.clipnode, warnings)?, format);
        warnings.add_many(WarningKind::Tree, "clip child", bad_children, || {
            "a clipnode refers to a clipnode that is not there: solid stands in".to_owned()
        });
        let mut bsp = Self {
            format,
            planes: records::planes(lumps.table(1, records::PLANE, warnings)?),
            textures: miptex::parse_lump(lumps.bytes(2), limits, warnings),
            vertices: records::vertices(lumps.table(3, records::VERTEX, warnings)?),
            nodes,
            texinfos: records::texinfos(lumps.table(6, records::TEXINFO, warnings)?),
            faces: records::faces(lumps.table(7, sizes.face, warnings)?, format),
            clipnodes,
            leafs,
            marksurfaces: records::marksurfaces(
                lumps.table(11, sizes.marksurface, warnings)?,
                format,
            ),
            edges: records::edges(lumps.table(12, sizes.edge, warnings)?, format),
            surfedges: records::surfedges(lumps.table(13, records::SURFEDGE, warnings)?),
            models: records::models(lumps.table(14, records::MODEL, warnings)?),
            visibility: lumps.bytes(4).to_vec(),
            lighting: lumps.bytes(8).to_vec(),
            entity_text: lumps.bytes(0).to_vec(),
            bspx: bspx::Bspx::default(),
            rgb_lighting: false,
            bad_nodes: Vec::new(),
            bad_clipnodes: Vec::new(),
        };
        validate::validate(&mut bsp, limits, warnings)?;
        let counts = bspx::Counts::of(&bsp);
        bsp.bspx = bspx::Bspx::read(data, lumps.end(), &counts, warnings);
        bsp.check_visibility(warnings);
        bsp.check_lighting(limits, warnings);
        Ok(bsp)
    }

    /// What a level calls itself: its world's `message`, read without the rest of the file. `None` where there
    /// is none, or this is no level.
    #[must_use]
    pub fn title(data: &[u8], limits: &Limits) -> Option<String> {
        let mut warnings = Warnings::new();
        let lumps = Lumps::read(data, detect(data).ok()?, &mut warnings).ok()?;
        let entities = crate::entity::parse(lumps.bytes(0), limits, &mut warnings).ok()?;
        let message = entities.first()?.get("message")?;
        Some(crate::entity::unescape(message).trim().to_owned())
    }

    /// Vertex indices of a face in file order: clockwise seen from the front. `None` for a face
    /// that must not be drawn.
    pub fn face_vertices(&self, face: &Face) -> Option<impl ExactSizeIterator<Item = u32> + '_> {
        if !face.is_valid() {
            return None;
        }
        let first = face.first_edge as usize;
        let range = first..first.checked_add(face.num_edges as usize)?;
        let surfedges = self.surfedges.get(range)?;
        // Every good face was checked to resolve; 0 is never taken.
        Some(
            surfedges
                .iter()
                .map(|&e| self.surfedge_vertex(e).unwrap_or(0)),
        )
    }

    /// Positions of [`Bsp::face_vertices`].
    pub fn face_points(&self, face: &Face) -> Option<impl ExactSizeIterator<Item = [f32; 3]> + '_> {
        let vertices = self.face_vertices(face)?;
        Some(vertices.map(|v| self.vertices.get(v as usize).copied().unwrap_or_default()))
    }

    /// The vertex that a surfedge starts at: of edge `e` the first, or of edge `-e` the second.
    pub(crate) fn surfedge_vertex(&self, surfedge: i32) -> Option<u32> {
        let [first, second] = *self.edges.get(surfedge.unsigned_abs() as usize)?;
        let vertex = if surfedge >= 0 { first } else { second };
        ((vertex as usize) < self.vertices.len()).then_some(vertex)
    }

    /// Good faces of a model with their indices; none if there is no such model.
    pub fn drawable_faces(&self, model: usize) -> impl Iterator<Item = (usize, &Face)> {
        let range = self.models.get(model).map_or(0..0, Model::faces);
        let first = range.start;
        self.faces
            .get(range)
            .unwrap_or_default()
            .iter()
            .enumerate()
            .filter(|(_, face)| face.is_valid())
            .map(move |(i, face)| (first + i, face))
    }

    /// The texinfo of a face; `None` if out of range: its texture is missing and coordinates are
    /// 0.
    pub fn face_texinfo(&self, face: &Face) -> Option<&Texinfo> {
        self.texinfos.get(face.texinfo as usize)
    }

    /// The index of a face's texture if it is there; `None` is drawn as a checkerboard.
    pub fn face_texture(&self, face: &Face) -> Option<usize> {
        let index = usize::try_from(self.face_texinfo(face)?.miptex).ok()?;
        self.textures.get(index)?.as_ref().map(|_| index)
    }

    /// The plane of a face as the face looks: normal turned to its front and of unit length.
    /// Where the stored plane is unusable, it is computed from the vertices. `None` only for a
    /// face that must not be drawn.
    pub fn face_plane(&self, face: &Face) -> Option<Plane> {
        let flip = |v: f32| if face.side { -v } else { v };
        if let Some(plane) = self.planes.get(face.plane as usize)
            && validate::is_usable(plane)
        {
            return Some(Plane {
                normal: plane.normal.map(flip),
                distance: flip(plane.distance),
                kind: plane.kind,
            });
        }
        let area = validate::area_vector(self.face_points(face)?);
        let length = area.iter().map(|c| c * c).sum::<f64>().sqrt();
        let normal = area.map(|c| c / length);
        let p = self.face_points(face)?.next()?;
        let distance: f64 = normal.iter().zip(p).map(|(n, c)| n * f64::from(c)).sum();
        Some(Plane {
            normal: normal.map(|c| c as f32),
            distance: distance as f32,
            kind: 5,
        })
    }

    /// Indices of the faces that a leaf touches; bad references are passed over.
    pub fn leaf_faces(&self, leaf: &Leaf) -> impl Iterator<Item = usize> + '_ {
        let first = leaf.first_mark as usize;
        self.marksurfaces
            .get(first..first.saturating_add(leaf.num_marks as usize))
            .unwrap_or_default()
            .iter()
            .map(|&m| m as usize)
            .filter(|&m| m < self.faces.len())
    }
}

/// Which of the formats read here a file is.
fn detect(data: &[u8]) -> Result<Format, FormatError> {
    let Some(magic) = data.first_chunk::<4>() else {
        return Err(header_error(data.len()));
    };
    let format = match magic {
        b"BSP2" => Format::Bsp2,
        b"2PSB" => Format::Psb2,
        [29, 0, 0, 0] => Format::Bsp29,
        _ => return Err(foreign(data, magic)),
    };
    if data.len() < HEADER_SIZE {
        return Err(header_error(data.len()));
    }
    Ok(format)
}

fn header_error(len: usize) -> FormatError {
    FormatError::new(
        ErrorKind::Truncated,
        "BSP header",
        format!("{len} bytes"),
        format!("at least {HEADER_SIZE}"),
    )
}

fn foreign(data: &[u8], magic: &[u8; 4]) -> FormatError {
    let version = Reader::at(data, 4).and_then(|mut r| r.i32());
    let (kind, found) = match (magic, version) {
        ([30, 0, 0, 0], _) => (
            ErrorKind::UnsupportedFormat,
            "a Half-Life level (version 30)".to_owned(),
        ),
        (b" 46Q", _) => (
            ErrorKind::UnsupportedFormat,
            "a Quake 64 level (\" 46Q\")".to_owned(),
        ),
        (b"IBSP", Some(38)) => (
            ErrorKind::UnsupportedFormat,
            "a Quake II level (IBSP version 38)".to_owned(),
        ),
        (b"IBSP", Some(46 | 47)) => (
            ErrorKind::UnsupportedFormat,
            "a Quake III level (IBSP version 46 or 47)".to_owned(),
        ),
        (b"IBSP" | b"VBSP" | b"RBSP", version) => (
            ErrorKind::UnsupportedFormat,
            format!("a level of format {} version {version:?}", latin1(magic)),
        ),
        _ => (
            ErrorKind::UnknownFormat,
            format!(
                "the bytes {magic:02x?} ({:?}, as a number {})",
                latin1(magic),
                i32::from_le_bytes(*magic)
            ),
        ),
    };
    FormatError::new(
        kind,
        "BSP version",
        found,
        "version 29 (Quake), \"2PSB\" or \"BSP2\"",
    )
    .at(0)
}

/// The lump directory, ranges proven.
struct Lumps<'a> {
    lumps: [(u64, &'a [u8]); 15],
}

/// Lumps without which nothing can be drawn.
fn is_structural(lump: usize) -> bool {
    matches!(lump, 1 | 3 | 7 | 12 | 13 | 14)
}

fn lump_name(lump: usize) -> &'static str {
    LUMP_NAMES.get(lump).copied().unwrap_or("?")
}

impl<'a> Lumps<'a> {
    fn read(data: &'a [u8], format: Format, warnings: &mut Warnings) -> Result<Self, FormatError> {
        let mut reader = Reader::at(data, 4).ok_or_else(|| header_error(data.len()))?;
        let mut lumps: [(u64, &[u8]); 15] = [(0, &[]); 15];
        let mut total = 0;
        for (index, lump) in lumps.iter_mut().enumerate() {
            let header_at = 4 + 8 * index as u64;
            let (Some(offset), Some(length)) = (reader.i32(), reader.i32()) else {
                return Err(header_error(data.len()));
            };
            if length == 0 {
                continue;
            }
            let range = usize::try_from(offset)
                .ok()
                .zip(usize::try_from(length).ok());
            let bytes = range.and_then(|(o, n)| data.get(o..o.checked_add(n)?));
            let bytes = match bytes {
                Some(bytes) => bytes,
                None if is_structural(index) => {
                    return Err(FormatError::new(
                        ErrorKind::Truncated,
                        format!("lump {index} ({})", lump_name(index)),
                        format!("{length} bytes at {offset}"),
                        format!("a range within the file's {} bytes", data.len()),
                    )
                    .at(header_at));
                }
                None => {
                    warnings.add(WarningKind::LumpRange, lump_name(index), || {
                        format!(
                            "lump {index} ({}) claims {length} bytes at {offset} of a file of {}: \
                             only what is there is used",
                            lump_name(index),
                            data.len()
                        )
                    });
                    range.and_then(|(o, _)| data.get(o..)).unwrap_or_default()
                }
            };
            total += bytes.len() as u64;
            *lump = (u64::try_from(offset).unwrap_or(0), bytes);
        }
        if total > LUMP_BUDGET * data.len() as u64 {
            return Err(FormatError::new(
                ErrorKind::TooLarge,
                "lump directory",
                format!("lumps of {total} bytes together in {} bytes", data.len()),
                format!("at most {LUMP_BUDGET} times the file"),
            )
            .at(4));
        }
        let this = Self { lumps };
        this.reject_hexen2(format)?;
        Ok(this)
    }

    fn get(&self, lump: usize) -> (u64, &'a [u8]) {
        self.lumps.get(lump).copied().unwrap_or_default()
    }

    /// Where the last lump ends.
    fn end(&self) -> usize {
        let ends = self.lumps.iter().map(|(o, b)| *o as usize + b.len());
        ends.max().unwrap_or(0).max(HEADER_SIZE)
    }

    fn bytes(&self, lump: usize) -> &'a [u8] {
        self.get(lump).1
    }

    /// The bytes of a table of records. A size that is no multiple of the record's is cut to one.
    fn table(
        &self,
        lump: usize,
        record: usize,
        warnings: &mut Warnings,
    ) -> Result<&'a [u8], FormatError> {
        let (offset, bytes) = self.get(lump);
        if bytes.len() % record != 0 {
            warnings.add(WarningKind::LumpRange, lump_name(lump), || {
                format!(
                    "lump {lump} ({}) at byte {offset} has {} bytes, no multiple of {record}: the \
                     last {} are left",
                    lump_name(lump),
                    bytes.len(),
                    bytes.len() % record
                )
            });
        }
        Ok(bytes)
    }

    /// Hexen II writes version 29 too, with models of 80 bytes and eight roots.
    fn reject_hexen2(&self, format: Format) -> Result<(), FormatError> {
        let (offset, models) = self.get(14);
        if format != Format::Bsp29 || models.is_empty() || models.len() % 80 != 0 {
            return Ok(());
        }
        // The face ranges of all models follow each other from 0: under the right record size they
        // do, under the wrong one they do not.
        let size = format.sizes().face;
        let faces = (self.bytes(7).len() / size) as u64;
        let tiles = |record: usize| {
            let mut next = 0;
            models.chunks_exact(record).all(|model| {
                let range =
                    Reader::at(model, record - 8).and_then(|mut r| Some((r.u32()?, r.u32()?)));
                range.is_some_and(|(first, count)| {
                    let ok = u64::from(first) == next;
                    next += u64::from(count);
                    ok && next <= faces
                })
            })
        };
        if tiles(80) && (models.len() % 64 != 0 || !tiles(64)) {
            return Err(FormatError::new(
                ErrorKind::UnsupportedFormat,
                "lump 14 (models)",
                "a Hexen II level (version 29 with models of 80 bytes)",
                "version 29 of Quake, with models of 64 bytes",
            )
            .at(offset));
        }
        Ok(())
    }
}
