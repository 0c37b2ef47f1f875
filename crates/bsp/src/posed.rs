//! Models that stand for alias models: surfaces with a picture each, posed frame by frame. What MD3 and MD5 have in
//! common.

use crate::md3::Md3;
use crate::md5::Md5;

/// A part of a model with pictures of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PosedSurface {
    /// What its pictures are called after: an MD5 mesh's shader, an MD3 surface's name.
    pub name: String,
    /// Where each vertex lies on the pictures: 0 to 1 from the left and from the top, or beyond, where they repeat.
    pub uv: Vec<[f32; 2]>,
    /// Vertices of triangles, clockwise seen from outside; all are there.
    pub triangles: Vec<[u32; 3]>,
}

/// A model that stands for an alias model. Frame `i` stands for frame `i` of that.
#[derive(Clone, Debug, PartialEq)]
pub enum PosedModel {
    /// Frames that hold all vertices.
    Md3(Md3),
    /// A skeleton.
    Md5(Md5),
}

impl PosedModel {
    /// Its parts, at least one.
    pub fn surfaces(&self) -> &[PosedSurface] {
        match self {
            Self::Md3(model) => &model.surfaces,
            Self::Md5(model) => &model.surfaces,
        }
    }

    /// How many frames there are, at least one.
    pub fn frames(&self) -> usize {
        match self {
            Self::Md3(model) => model.frames,
            Self::Md5(model) => model.frames.len().max(1),
        }
    }

    /// Effect flags ([`crate::mdl::flags`]) of its own; MD5 has none.
    pub fn flags(&self) -> Option<u32> {
        match self {
            Self::Md3(model) => Some(model.flags),
            Self::Md5(_) => None,
        }
    }

    /// Where the vertices of all surfaces are in a frame, one surface after the other, in Quake units. Frames that
    /// are not there are the first.
    pub fn pose(&self, frame: usize) -> Vec<[f32; 3]> {
        let frame = if frame < self.frames() { frame } else { 0 };
        match self {
            Self::Md3(model) => model.pose(frame),
            Self::Md5(model) => model.pose(frame),
        }
    }

    /// Unit normals of the vertices that [`Self::pose`] gives, to the outside as the file has it; `None` for MD5,
    /// which has none.
    pub fn normals(&self, frame: usize) -> Option<Vec<[f32; 3]>> {
        let frame = if frame < self.frames() { frame } else { 0 };
        match self {
            Self::Md3(model) => Some(model.normals(frame)),
            Self::Md5(_) => None,
        }
    }

    /// Vertices of all surfaces.
    pub fn vertices(&self) -> usize {
        self.surfaces().iter().map(|s| s.uv.len()).sum()
    }
}
