//! The `BSPX` directory: named lumps after the ordinary ones that carry what version 29 has no
//! room for. Every lump known here is checked for its size; one that does not fit its level is
//! ignored with a warning.

use super::Bsp;
use crate::error::{WarningKind, Warnings};
use crate::reader::{Reader, latin1, records, until_nul};

const ENTRY_SIZE: usize = 32;

/// Bytes kept of all lumps together, as a multiple of the file's: lumps may not share bytes so
/// that a small file becomes a large memory.
const BUDGET: u64 = 2;

/// Names of the lumps known here.
pub const KNOWN: [&str; 12] = [
    "RGBLIGHTING",
    "LIGHTING_E5BGR9",
    "LIGHTINGDIR",
    "LMSHIFT",
    "LMOFFSET",
    "LMSTYLE",
    "LMSTYLE16",
    "DECOUPLED_LM",
    "FACENORMALS",
    "VERTEXNORMALS",
    "BRUSHLIST",
    "LIGHTGRID_OCTREE",
];

/// One entry of the directory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BspxLump {
    /// Name, cut at its first NUL.
    pub name: String,
    /// Byte offset in the file.
    pub offset: u32,
    /// Length in bytes.
    pub length: u32,
    /// Whether the lump is known here and its size fits the level.
    pub is_usable: bool,
}

/// All entries of the directory; empty if the file has none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bspx {
    lumps: Vec<BspxLump>,
    /// The bytes of usable lumps, as [`KNOWN`] names them.
    data: [Option<Vec<u8>>; KNOWN.len()],
}

/// A face's own lightmap size and mapping (`DECOUPLED_LM`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decoupled {
    /// Luxels across.
    pub width: u16,
    /// Luxels down.
    pub height: u16,
    /// First sample; -1 for none.
    pub offset: i32,
    /// Luxel coordinates of a point: `dot(p, axis.xyz) + axis.w`; whole numbers are sample centres.
    pub axes: [[f32; 4]; 2],
}

/// Brushes of one brush model (`BRUSHLIST`).
#[derive(Clone, Debug, PartialEq)]
pub struct BrushModel {
    /// Which model.
    pub model: i32,
    /// Its brushes.
    pub brushes: Vec<Brush>,
}

/// A convex solid: a box cut by planes.
#[derive(Clone, Debug, PartialEq)]
pub struct Brush {
    /// Least corner; the six axial planes are implied.
    pub mins: [f32; 3],
    /// Greatest corner.
    pub maxs: [f32; 3],
    /// Contents, see [`super::contents`].
    pub contents: i16,
    /// Further planes: normal and distance.
    pub planes: Vec<([f32; 3], f32)>,
}

/// Normals of the corners of faces (`FACENORMALS`).
#[derive(Clone, Debug, PartialEq)]
pub struct FaceNormals {
    /// The normals, tangents and bitangents that are referred to.
    pub vectors: Vec<[f32; 3]>,
    /// For each edge of each face, in the order of the faces: indices of normal, tangent and
    /// bitangent, in range.
    pub corners: Vec<[u32; 3]>,
}

/// Where the bytes of a known lump are kept.
fn slot(name: &str) -> Option<usize> {
    KNOWN.iter().position(|known| *known == name)
}

/// What the sizes of the lumps are measured by.
pub(super) struct Counts {
    pub faces: usize,
    pub vertices: usize,
    pub light_samples: usize,
    pub face_edges: u64,
}

impl Counts {
    pub fn of(bsp: &Bsp) -> Self {
        Self {
            faces: bsp.faces.len(),
            vertices: bsp.vertices.len(),
            light_samples: bsp.lighting.len(),
            face_edges: bsp.faces.iter().map(|f| u64::from(f.num_edges)).sum(),
        }
    }

    /// What is wrong with a lump's size, if anything.
    fn flaw(&self, name: &str, data: &[u8]) -> Option<String> {
        let exactly = |wanted: Option<usize>| {
            (wanted != Some(data.len())).then(|| match wanted {
                Some(wanted) => format!("has {} bytes where {wanted} are due", data.len()),
                None => "is of an impossible size".to_owned(),
            })
        };
        let per_face = |size: usize| {
            let stride = self.faces.checked_mul(size);
            let fits =
                stride.is_some_and(|s| s > 0 && !data.is_empty() && data.len().is_multiple_of(s));
            (!fits).then(|| format!("has {} bytes, no multiple of the faces'", data.len()))
        };
        match name {
            "RGBLIGHTING" | "LIGHTINGDIR" => exactly(self.light_samples.checked_mul(3)),
            "LIGHTING_E5BGR9" => exactly(self.light_samples.checked_mul(4)),
            "LMSHIFT" => exactly(Some(self.faces)),
            "LMOFFSET" => exactly(self.faces.checked_mul(4)),
            "LMSTYLE" => per_face(1),
            "LMSTYLE16" => per_face(2),
            "DECOUPLED_LM" => exactly(self.faces.checked_mul(40)),
            "VERTEXNORMALS" => exactly(self.vertices.checked_mul(12)),
            "FACENORMALS" => {
                let vectors = Reader::new(data).u32().map_or(0, u64::from);
                let wanted = 4 + 12 * vectors + 12 * self.face_edges;
                exactly(usize::try_from(wanted).ok())
            }
            "BRUSHLIST" => (walk_brushes(data, |_, _| (), |_| ()).is_none())
                .then(|| "ends inside of a brush".to_owned()),
            "LIGHTGRID_OCTREE" => (walk_light_grid(data).is_none())
                .then(|| "ends too early, or has more than it says".to_owned()),
            _ => None,
        }
    }
}

/// Walks a `LIGHTGRID_OCTREE` to its last byte.
fn walk_light_grid(data: &[u8]) -> Option<()> {
    let mut r = Reader::new(data);
    // Step, size and least corner; the number of styles and the root.
    r.take(36)?;
    r.take(5)?;
    let nodes = r.u32()? as usize;
    r.take(nodes.checked_mul(44)?)?;
    for _ in 0..r.u32()? {
        r.take(12)?;
        let size = [r.u32()?, r.u32()?, r.u32()?].map(u64::from);
        let points = size.iter().try_fold(1_u64, |n, &c| n.checked_mul(c))?;
        // Each point takes a byte or more.
        if points > r.remaining() as u64 {
            return None;
        }
        for _ in 0..points {
            let styles = r.u8()?;
            if styles != u8::MAX {
                r.take(usize::from(styles) * 4)?;
            }
        }
    }
    (r.remaining() == 0).then_some(())
}

/// Walks a `BRUSHLIST`; `None` if it ends early or has another version.
fn walk_brushes(
    data: &[u8],
    mut model: impl FnMut(i32, usize),
    mut brush: impl FnMut(Brush),
) -> Option<()> {
    let mut r = Reader::new(data);
    while r.remaining() > 0 {
        let (version, number) = (r.i32()?, r.i32()?);
        let (brushes, _planes) = (r.u32()?, r.u32()?);
        if version != 1 {
            return None;
        }
        model(number, (brushes as usize).min(r.remaining() / 28));
        for _ in 0..brushes {
            let (mins, maxs) = (r.vec3()?, r.vec3()?);
            let contents = r.i16()?;
            let planes = usize::from(r.u16()?);
            let bytes = r.take(planes * 16)?;
            brush(Brush {
                mins,
                maxs,
                contents,
                planes: records(bytes, 16, |r| Some((r.vec3()?, r.f32()?))),
            });
        }
    }
    Some(())
}

impl Bspx {
    /// Reads the directory that begins at the first multiple of 4 from `lumps_end`, the end of the
    /// ordinary lumps. Without one, or with a bad one, there are no lumps.
    pub(super) fn read(
        file: &[u8],
        lumps_end: usize,
        counts: &Counts,
        warnings: &mut Warnings,
    ) -> Self {
        let Some(mut reader) = Reader::at(file, lumps_end.next_multiple_of(4)) else {
            return Self::default();
        };
        if reader.array::<4>() != Some(*b"BSPX") {
            return Self::default();
        }
        let claimed = reader.u32().unwrap_or(0) as usize;
        let most = reader.remaining() / ENTRY_SIZE;
        if claimed > most {
            warnings.add(WarningKind::Bspx, "directory", || {
                format!("the BSPX directory claims {claimed} lumps where at most {most} can be")
            });
        }
        let mut budget = (file.len() as u64).saturating_mul(BUDGET);
        let mut this = Self {
            lumps: Vec::with_capacity(claimed.min(most)),
            ..Self::default()
        };
        for _ in 0..claimed.min(most) {
            let (Some(name), Some(offset), Some(length)) =
                (reader.take(24), reader.u32(), reader.u32())
            else {
                break;
            };
            let name = latin1(until_nul(name));
            let mut is_usable = false;
            if let Some(slot) = slot(&name).and_then(|i| this.data.get_mut(i)) {
                let bytes = (offset as usize)
                    .checked_add(length as usize)
                    .and_then(|end| file.get(offset as usize..end));
                let flaw = match bytes {
                    None => Some("lies outside of the file".to_owned()),
                    Some(_) if slot.is_some() => Some("is there twice".to_owned()),
                    Some(bytes) if bytes.len() as u64 > budget => {
                        Some("shares its bytes with too many others".to_owned())
                    }
                    Some(bytes) => counts.flaw(&name, bytes),
                };
                if let Some(flaw) = flaw {
                    warnings.add(WarningKind::Bspx, &name, || {
                        format!("the BSPX lump {name} {flaw}: it is ignored")
                    });
                } else if let Some(bytes) = bytes {
                    budget -= bytes.len() as u64;
                    *slot = Some(bytes.to_vec());
                    is_usable = true;
                }
            }
            this.lumps.push(BspxLump {
                name,
                offset,
                length,
                is_usable,
            });
        }
        this
    }

    /// All entries in file order, those that are unknown or do not fit included.
    pub fn lumps(&self) -> &[BspxLump] {
        &self.lumps
    }

    /// The bytes of a lump that is known and fits the level.
    pub fn get(&self, name: &str) -> Option<&[u8]> {
        self.data.get(slot(name)?)?.as_deref()
    }

    /// `LMSHIFT`: a luxel of the face is `1 << shift` units instead of 16.
    pub fn lm_shift(&self, face: usize) -> Option<u8> {
        self.get("LMSHIFT")?.get(face).copied()
    }

    /// `LMOFFSET`: the face's first sample instead of the stored one.
    pub fn lm_offset(&self, face: usize) -> Option<i32> {
        let data = self.get("LMOFFSET")?;
        Reader::at(data, face.checked_mul(4)?)?.i32()
    }

    /// `LMSTYLE16` or `LMSTYLE`: the face's light styles instead of the four stored ones, up to
    /// the mark that ends them. `faces` is the number of faces of the level.
    pub fn lm_styles(&self, face: usize, faces: usize) -> Option<Vec<u16>> {
        if let Some(data) = self.get("LMSTYLE16") {
            let n = data.len().checked_div(faces.checked_mul(2)?)?;
            let row = data.get(face.checked_mul(n * 2)?..)?.get(..n * 2)?;
            let styles = records(row, 2, Reader::u16);
            return Some(styles.into_iter().take_while(|&s| s != u16::MAX).collect());
        }
        let data = self.get("LMSTYLE")?;
        let n = data.len().checked_div(faces)?;
        let row = data.get(face.checked_mul(n)?..)?.get(..n)?;
        Some(
            row.iter()
                .take_while(|&&s| s != u8::MAX)
                .map(|&s| s.into())
                .collect(),
        )
    }

    /// `DECOUPLED_LM`: the face's own lightmap size and mapping.
    pub fn decoupled(&self, face: usize) -> Option<Decoupled> {
        let data = self.get("DECOUPLED_LM")?;
        let mut r = Reader::at(data, face.checked_mul(40)?)?;
        Some(Decoupled {
            width: r.u16()?,
            height: r.u16()?,
            offset: r.i32()?,
            axes: [r.vec4()?, r.vec4()?],
        })
    }

    /// `FACENORMALS`; `None` also if an index is out of range.
    pub fn face_normals(&self) -> Option<FaceNormals> {
        let mut r = Reader::new(self.get("FACENORMALS")?);
        let count = r.u32()? as usize;
        let vectors = records(r.take(count.checked_mul(12)?)?, 12, Reader::vec3);
        let rest = r.take(r.remaining())?;
        let corners = records(rest, 12, |r| Some([r.u32()?, r.u32()?, r.u32()?]));
        let ok = corners.iter().flatten().all(|&i| (i as usize) < count);
        ok.then_some(FaceNormals { vectors, corners })
    }

    /// `VERTEXNORMALS`: a normal for each vertex, to be used only on faces whose texinfo has flag
    /// 0x800.
    pub fn vertex_normals(&self) -> Option<Vec<[f32; 3]>> {
        Some(records(self.get("VERTEXNORMALS")?, 12, Reader::vec3))
    }

    /// `BRUSHLIST`: the brushes of the level's models; none if there is no such lump.
    pub fn brush_list(&self) -> Vec<BrushModel> {
        let models = std::cell::RefCell::new(Vec::<BrushModel>::new());
        // The lump was walked to its end when it was checked.
        let _ = walk_brushes(
            self.get("BRUSHLIST").unwrap_or_default(),
            |model, count| {
                models.borrow_mut().push(BrushModel {
                    model,
                    brushes: Vec::with_capacity(count),
                });
            },
            |brush| {
                if let Some(model) = models.borrow_mut().last_mut() {
                    model.brushes.push(brush);
                }
            },
        );
        models.into_inner()
    }
}
