//! Alias models (`.mdl`, version 6): skins, triangles, and poses of byte coordinates.

use crate::cycle::Cycle;
use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::reader::{Reader, latin1, records, until_nul};

/// Bytes of the header.
pub const HEADER_SIZE: usize = 84;
/// The one version there is.
pub const VERSION: i32 = 6;
/// Most groups without parts that are shown as another.
const MAX_GAPS: usize = 16;

/// Bits of [`MdlHeader::flags`].
pub mod flags {
    /// Leaves a trail of fire, and glows.
    pub const ROCKET: u32 = 1;
    /// Leaves a trail of smoke.
    pub const GRENADE: u32 = 2;
    /// Leaves a trail of blood.
    pub const GIB: u32 = 4;
    /// Turns about itself.
    pub const ROTATE: u32 = 8;
    /// Leaves a green trail.
    pub const TRACER: u32 = 0x10;
    /// Leaves a thin trail of blood.
    pub const ZOMBIE_GIB: u32 = 0x20;
    /// Leaves an orange trail.
    pub const TRACER2: u32 = 0x40;
    /// Leaves a purple trail.
    pub const TRACER3: u32 = 0x80;
    /// Texels of index 255 are holes.
    pub const HOLES: u32 = 0x4000;
}

/// An alias model.
#[derive(Clone, Debug, PartialEq)]
pub struct Mdl {
    /// Its header.
    pub header: MdlHeader,
    /// Skins, at least one.
    pub skins: Vec<Skin>,
    /// Where each vertex lies on the skins.
    pub skin_vertices: Vec<SkinVertex>,
    /// Triangles; those with bad vertices are left out.
    pub triangles: Vec<MdlTriangle>,
    /// Frames, at least one.
    pub frames: Vec<Frame>,
    /// Bytes after the last frame: editors keep notes there.
    pub trailing: usize,
}

/// A skin: one picture, or several that follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Pictures of `skin_width * skin_height` palette indices, rows from the top; at least one.
    pub pictures: Vec<Vec<u8>>,
    /// When each is shown, if the file has a group.
    pub cycle: Option<Cycle>,
}

/// Where a vertex lies on the skins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkinVertex {
    /// Triangles that face back find it half a skin further right.
    pub on_seam: bool,
    /// Texels from the left.
    pub s: i32,
    /// Texels from the top.
    pub t: i32,
}

/// A triangle of all poses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MdlTriangle {
    /// Whether it lies on the front half of the skin.
    pub faces_front: bool,
    /// Vertices, clockwise seen from outside.
    pub vertices: [u32; 3],
}

/// A frame: one pose, or several that follow each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Poses, at least one.
    pub poses: Vec<Pose>,
    /// When each is shown, if the file has a group.
    pub cycle: Option<Cycle>,
}

/// Where all vertices are at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Pose {
    /// For people: `stand1`.
    pub name: String,
    /// Byte coordinates and the number of a normal (of 162; of no use).
    pub vertices: Vec<[u8; 4]>,
}

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

impl Mdl {
    /// Reads a model. `warnings` are told of what was repaired.
    ///
    /// # Errors
    /// What [`MdlHeader::parse`] refuses; a skin wider or higher than [`Limits::max_texture_side`],
    /// coordinates that are no numbers or beyond [`Limits::max_coordinate`]; a group of fewer than no
    /// parts; data that ends before the last frame does; no picture or no pose in all groups.
    pub fn parse(
        data: &[u8],
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Self, FormatError> {
        let header = MdlHeader::parse(data)?;
        header.check_limits(limits)?;
        let mut r = Body {
            data,
            r: Reader::at(data, HEADER_SIZE).unwrap_or(Reader::new(&[])),
            warnings,
        };
        let skins = r.skins(&header)?;
        let skin_vertices = r.skin_vertices(&header)?;
        let triangles = r.triangles(&header)?;
        let frames = r.frames(&header)?;
        Ok(Self {
            header,
            skins,
            skin_vertices,
            triangles,
            frames,
            trailing: r.r.remaining(),
        })
    }

    /// Where vertex `vertex` of a pose is, in Quake units.
    pub fn position(&self, vertex: [u8; 4]) -> [f32; 3] {
        let MdlHeader {
            scale: [sx, sy, sz],
            translate: [tx, ty, tz],
            ..
        } = self.header;
        let [x, y, z, _] = vertex.map(f32::from);
        [x * sx + tx, y * sy + ty, z * sz + tz]
    }

    /// Where a corner of a triangle lies on the skins, in texels from the top left corner; 0, 0 for a
    /// vertex that is not there.
    pub fn skin_coordinates(&self, triangle: &MdlTriangle, vertex: u32) -> [f32; 2] {
        let Some(at) = self.skin_vertices.get(vertex as usize) else {
            return [0.0; 2];
        };
        let shift = if at.on_seam && !triangle.faces_front {
            self.header.skin_width as f32 / 2.0
        } else {
            0.0
        };
        [at.s as f32 + 0.5 + shift, at.t as f32 + 0.5]
    }

    /// How many poses all frames have together.
    pub fn pose_count(&self) -> usize {
        self.frames.iter().map(|f| f.poses.len()).sum()
    }
}

/// What follows the header.
struct Body<'a, 'w> {
    data: &'a [u8],
    r: Reader<'a>,
    warnings: &'w mut Warnings,
}

impl<'a> Body<'a, '_> {
    fn offset(&self) -> u64 {
        (self.data.len() - self.r.remaining()) as u64
    }

    /// What `read` reads, or that entry `index` of `part` is not all there.
    fn get<T>(
        &mut self,
        part: &str,
        index: usize,
        read: impl FnOnce(&mut Reader<'a>) -> Option<T>,
    ) -> Result<T, FormatError> {
        let offset = self.offset();
        read(&mut self.r).ok_or_else(|| {
            FormatError::new(
                ErrorKind::Truncated,
                part,
                format!("a file of {} bytes", self.data.len()),
                "one that holds it whole",
            )
            .index(index as u64)
            .at(offset)
        })
    }

    /// Reads the type of a skin or frame, and how many parts it has, if it is a group. Each part takes
    /// `each` bytes or more.
    fn group(
        &mut self,
        part: &str,
        index: usize,
        each: usize,
    ) -> Result<Option<usize>, FormatError> {
        if self.get(part, index, Reader::i32)? == 0 {
            return Ok(None);
        }
        let offset = self.offset();
        let parts = self.get(part, index, Reader::i32)?;
        let most = self.r.remaining() / each.max(1);
        match usize::try_from(parts) {
            Ok(n) if n <= most => Ok(Some(n)),
            _ => Err(FormatError::new(
                ErrorKind::OutOfRange,
                part,
                format!("a group of {parts}"),
                format!("0 to {most} in a file of {} bytes", self.data.len()),
            )
            .index(index as u64)
            .at(offset)),
        }
    }

    fn cycle(&mut self, part: &str, index: usize, n: usize) -> Result<Cycle, FormatError> {
        let (cycle, used) = self.get(part, index, |r| Cycle::read(r, n))?;
        if !used && n > 0 {
            self.warnings.add(WarningKind::Model, part, || {
                format!("{part} {index} has times that do not rise: its parts take 0.1 s each")
            });
        }
        Ok(cycle)
    }

    fn skins(&mut self, header: &MdlHeader) -> Result<Vec<Skin>, FormatError> {
        const PART: &str = "MDL skin";
        let size = header.skin_width as usize * header.skin_height as usize;
        let mut skins = Vec::with_capacity(header.num_skins as usize);
        for i in 0..header.num_skins as usize {
            let group = self.group(PART, i, 4 + size)?;
            let cycle = group.map(|n| self.cycle(PART, i, n)).transpose()?;
            let n = group.unwrap_or(1);
            let mut pictures = Vec::with_capacity(n);
            for _ in 0..n {
                pictures.push(self.get(PART, i, |r| r.take(size))?.to_vec());
            }
            skins.push(Skin { pictures, cycle });
        }
        let is_empty = |s: &Skin| s.pictures.is_empty();
        self.fill_gaps(PART, &mut skins, is_empty, |s| Skin {
            pictures: s.pictures.iter().take(1).cloned().collect(),
            cycle: None,
        })?;
        Ok(skins)
    }

    /// Empty groups become the first part of what follows, as in engines, or of what came before.
    fn fill_gaps<T>(
        &mut self,
        part: &str,
        all: &mut [T],
        is_empty: impl Fn(&T) -> bool,
        first_part: impl Fn(&T) -> T,
    ) -> Result<(), FormatError> {
        let gaps: Vec<usize> = (all.iter().enumerate())
            .filter_map(|(i, entry)| is_empty(entry).then_some(i))
            .collect();
        let Some(&first) = gaps.first() else {
            return Ok(());
        };
        self.warnings
            .add_many(WarningKind::Model, part, gaps.len() as u64, || {
                format!("{part} {first} is an empty group: another is shown")
            });
        // Many copies of a large part would be more memory than the file justifies.
        if gaps.len() > MAX_GAPS || gaps.len() == all.len() {
            return Err(FormatError::new(
                ErrorKind::OutOfRange,
                part,
                format!("{} empty groups of {}", gaps.len(), all.len()),
                format!("at most {MAX_GAPS}, and not all"),
            )
            .index(first as u64));
        }
        for gap in gaps.into_iter().rev() {
            let after = all.iter().skip(gap + 1).find(|e| !is_empty(e));
            let other = after.or_else(|| all.iter().take(gap).rfind(|e| !is_empty(e)));
            let copy = other.map(&first_part);
            if let (Some(entry), Some(copy)) = (all.get_mut(gap), copy) {
                *entry = copy;
            }
        }
        Ok(())
    }

    fn skin_vertices(&mut self, header: &MdlHeader) -> Result<Vec<SkinVertex>, FormatError> {
        self.table("MDL skin vertex", header.num_vertices, 12, |r| {
            Some(SkinVertex {
                on_seam: r.i32()? != 0,
                s: r.i32()?,
                t: r.i32()?,
            })
        })
    }

    fn triangles(&mut self, header: &MdlHeader) -> Result<Vec<MdlTriangle>, FormatError> {
        const PART: &str = "MDL triangle";
        let mut triangles = self.table(PART, header.num_triangles, 16, |r| {
            Some(MdlTriangle {
                faces_front: r.i32()? != 0,
                vertices: [r.u32()?, r.u32()?, r.u32()?],
            })
        })?;
        let is_good = |t: &MdlTriangle| t.vertices.iter().all(|&v| v < header.num_vertices);
        let first = triangles.iter().position(|t| !is_good(t));
        if let Some(first) = first {
            triangles.retain(is_good);
            let dropped = u64::from(header.num_triangles) - triangles.len() as u64;
            self.warnings
                .add_many(WarningKind::Model, PART, dropped, || {
                    format!(
                        "{PART} {first} is left out: it has a vertex beyond the {} there are",
                        header.num_vertices
                    )
                });
        }
        Ok(triangles)
    }

    fn table<T>(
        &mut self,
        part: &str,
        count: u32,
        size: usize,
        read: impl Fn(&mut Reader<'a>) -> Option<T>,
    ) -> Result<Vec<T>, FormatError> {
        let whole = self.r.remaining() / size;
        let bytes = (count as usize).checked_mul(size);
        let bytes = self.get(part, whole, |r| r.take(bytes?))?;
        Ok(records(bytes, size, read))
    }

    fn frames(&mut self, header: &MdlHeader) -> Result<Vec<Frame>, FormatError> {
        const PART: &str = "MDL frame";
        let vertices = header.num_vertices as usize;
        let mut frames = Vec::with_capacity(header.num_frames as usize);
        for i in 0..header.num_frames as usize {
            let group = self.group(PART, i, 28 + 4 * vertices)?;
            let cycle = match group {
                Some(n) => {
                    // The group's own bounds, which poses tell better.
                    self.get(PART, i, |r| r.take(8))?;
                    Some(self.cycle(PART, i, n)?)
                }
                None => None,
            };
            let n = group.unwrap_or(1);
            let mut poses = Vec::with_capacity(n);
            for _ in 0..n {
                poses.push(self.get(PART, i, |r| pose(r, vertices))?);
            }
            frames.push(Frame { poses, cycle });
        }
        let is_empty = |f: &Frame| f.poses.is_empty();
        self.fill_gaps(PART, &mut frames, is_empty, |f| Frame {
            poses: f.poses.iter().take(1).cloned().collect(),
            cycle: None,
        })?;
        Ok(frames)
    }
}

fn pose(r: &mut Reader<'_>, vertices: usize) -> Option<Pose> {
    r.take(8)?; // bounds
    let name = latin1(until_nul(&r.array::<16>()?));
    let bytes = r.take(vertices.checked_mul(4)?)?;
    let (vertices, _) = bytes.as_chunks::<4>();
    Some(Pose {
        name,
        vertices: vertices.to_vec(),
    })
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

    /// Checks what a renderer could not live with.
    fn check_limits(&self, limits: &Limits) -> Result<(), FormatError> {
        let most = limits.max_texture_side;
        if self.skin_width.max(self.skin_height) > most {
            return Err(FormatError::new(
                ErrorKind::TooLarge,
                "MDL skin size",
                format!("{}x{}", self.skin_width, self.skin_height),
                format!("at most {most} each way"),
            )
            .at(52));
        }
        // False for what is no number, too.
        let is_near = |c: f32| c.abs() <= limits.max_coordinate;
        let is_good = (self.scale.iter().zip(self.translate))
            .all(|(s, t)| is_near(t) && is_near(255.0 * s + t));
        if !is_good {
            return Err(FormatError::new(
                ErrorKind::OutOfRange,
                "MDL scale and origin",
                format!("{:?} and {:?}", self.scale, self.translate),
                format!("coordinates of at most {}", limits.max_coordinate),
            )
            .at(8));
        }
        Ok(())
    }

    fn check(&self, size: usize) -> Result<(), FormatError> {
        let body = size.saturating_sub(HEADER_SIZE) as u64;
        // A skin may be 1 x 1; a frame is at least type, bounds, name and its vertices.
        let vertices = u64::from(self.num_vertices);
        let skin = 4 + u64::from(self.skin_width) * u64::from(self.skin_height);
        let rows = [
            ("skin width", 52, self.skin_width, 1),
            ("skin height", 56, self.skin_height, 1),
            ("number of skins", 48, self.num_skins, skin),
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
