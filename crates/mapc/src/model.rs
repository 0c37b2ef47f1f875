//! Writes alias models (`.mdl`, version 6).

use crate::Vec3;

/// An alias model to be written.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Model {
    /// Width and height of all skins in texels.
    pub skin_size: [u32; 2],
    /// Skins, at least one.
    pub skins: Vec<ModelSkin>,
    /// Where each vertex lies on the skins.
    pub skin_vertices: Vec<ModelSkinVertex>,
    /// Triangles: whether one lies on the front half of the skin, and its vertices, clockwise seen from
    /// outside.
    pub triangles: Vec<(bool, [u32; 3])>,
    /// Frames, at least one; all poses have a place for each vertex.
    pub frames: Vec<ModelFrame>,
    /// Effects, such as 8 for a model that turns.
    pub flags: u32,
    /// Whether its groups begin at a random time.
    pub random_start: bool,
}

/// A skin: palette indices, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelSkin {
    /// One picture.
    Single(Vec<u8>),
    /// Pictures that follow each other, each with the second it is shown until.
    Group(Vec<(f32, Vec<u8>)>),
}

/// Where a vertex lies on the skins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelSkinVertex {
    /// Triangles on the back half find it half a skin further right.
    pub on_seam: bool,
    /// Texels from the left and from the top.
    pub at: [i32; 2],
}

/// A frame of a model.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelFrame {
    /// One pose.
    Single(ModelPose),
    /// Poses that follow each other, each with the second it is shown until.
    Group(Vec<(f32, ModelPose)>),
}

/// Where all vertices are.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelPose {
    /// Up to 15 bytes.
    pub name: String,
    /// In Quake units.
    pub positions: Vec<Vec3>,
}

impl ModelFrame {
    fn poses(&self) -> Vec<&ModelPose> {
        match self {
            Self::Single(pose) => vec![pose],
            Self::Group(poses) => poses.iter().map(|(_, pose)| pose).collect(),
        }
    }
}

impl Model {
    /// The bytes of the file. Coordinates are rounded to the 256 steps along each axis that the format
    /// has between the least and the greatest of all poses.
    #[must_use]
    pub fn write(&self) -> Vec<u8> {
        let grid = Grid::around(self.frames.iter().flat_map(ModelFrame::poses));
        let mut out = Vec::new();
        out.extend(b"IDPO");
        ints(&mut out, &[6]);
        floats(&mut out, &grid.step);
        floats(&mut out, &grid.low);
        let radius = (0..3).map(|a| {
            grid.low[a]
                .abs()
                .max((grid.low[a] + 255.0 * grid.step[a]).abs())
        });
        floats(&mut out, &[radius.map(|r| r * r).sum::<f64>().sqrt()]);
        floats(&mut out, &[0.0; 3]);
        let [width, height] = self.skin_size.map(u32::cast_signed);
        let counts = [
            self.skins.len(),
            self.skin_vertices.len(),
            self.triangles.len(),
            self.frames.len(),
        ]
        .map(|n| n as i32);
        ints(
            &mut out,
            &[counts[0], width, height, counts[1], counts[2], counts[3]],
        );
        ints(
            &mut out,
            &[i32::from(self.random_start), self.flags.cast_signed()],
        );
        floats(&mut out, &[1.0]);
        for skin in &self.skins {
            match skin {
                ModelSkin::Single(pixels) => {
                    ints(&mut out, &[0]);
                    out.extend(pixels);
                }
                ModelSkin::Group(pictures) => {
                    ints(&mut out, &[1, pictures.len() as i32]);
                    pictures
                        .iter()
                        .for_each(|(end, _)| floats(&mut out, &[f64::from(*end)]));
                    pictures.iter().for_each(|(_, pixels)| out.extend(pixels));
                }
            }
        }
        for v in &self.skin_vertices {
            ints(
                &mut out,
                &[if v.on_seam { 0x20 } else { 0 }, v.at[0], v.at[1]],
            );
        }
        for (front, vertices) in &self.triangles {
            ints(&mut out, &[i32::from(*front)]);
            ints(&mut out, &vertices.map(u32::cast_signed));
        }
        for frame in &self.frames {
            match frame {
                ModelFrame::Single(pose) => {
                    ints(&mut out, &[0]);
                    grid.pose(&mut out, pose);
                }
                ModelFrame::Group(poses) => {
                    ints(&mut out, &[1, poses.len() as i32]);
                    let all: Vec<[u8; 4]> = (poses.iter())
                        .flat_map(|(_, p)| p.positions.iter().map(|q| grid.at(*q)))
                        .collect();
                    bounds(&mut out, &all);
                    poses
                        .iter()
                        .for_each(|(end, _)| floats(&mut out, &[f64::from(*end)]));
                    poses.iter().for_each(|(_, pose)| grid.pose(&mut out, pose));
                }
            }
        }
        out
    }
}

/// The places that byte coordinates stand for.
struct Grid {
    low: [f64; 3],
    step: [f64; 3],
}

impl Grid {
    fn around<'a>(poses: impl Iterator<Item = &'a ModelPose>) -> Self {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for p in poses.flat_map(|p| &p.positions) {
            for (axis, c) in p.iter().copied().enumerate() {
                low[axis] = low[axis].min(c);
                high[axis] = high[axis].max(c);
            }
        }
        let step = [0, 1, 2].map(|a| ((high[a] - low[a]) / 255.0).max(1e-4));
        Self { low, step }
    }

    fn at(&self, p: Vec3) -> [u8; 4] {
        let byte = |c: f64, axis: usize| ((c - self.low[axis]) / self.step[axis]).round() as u8;
        [byte(p[0], 0), byte(p[1], 1), byte(p[2], 2), 0]
    }

    fn pose(&self, out: &mut Vec<u8>, pose: &ModelPose) {
        let vertices: Vec<[u8; 4]> = pose.positions.iter().map(|p| self.at(*p)).collect();
        bounds(out, &vertices);
        let mut name = [0; 16];
        for (to, from) in name.iter_mut().take(15).zip(pose.name.bytes()) {
            *to = from;
        }
        out.extend(name);
        vertices.iter().for_each(|v| out.extend(v));
    }
}

fn bounds(out: &mut Vec<u8>, vertices: &[[u8; 4]]) {
    let ends: [fn(u8, u8) -> u8; 2] = [u8::min, u8::max];
    for end in ends {
        let of = |axis: usize| vertices.iter().map(|v| v[axis]).reduce(end).unwrap_or(0);
        out.extend([of(0), of(1), of(2), 0]);
    }
}

pub(crate) fn ints(out: &mut Vec<u8>, values: &[i32]) {
    values.iter().for_each(|v| out.extend(v.to_le_bytes()));
}

pub(crate) fn floats(out: &mut Vec<u8>, values: &[f64]) {
    values
        .iter()
        .for_each(|v| out.extend((*v as f32).to_le_bytes()));
}
