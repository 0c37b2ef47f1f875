//! The records of a level's lumps, the same for all formats read here.

use super::Format;
use crate::reader::{Reader, records};

/// A plane: points `p` with `dot(normal, p) = distance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal; may be zero or NaN in bad files, see [`super::Bsp::face_plane`].
    pub normal: [f32; 3],
    /// Distance from the origin along the normal, in Quake units.
    pub distance: f32,
    /// The file's hint: 0 to 2 axial, 3 to 5 nearest axis. Not relied on.
    pub kind: i32,
}

/// What a node's side leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeChild {
    /// Another node.
    Node(u32),
    /// A leaf.
    Leaf(u32),
}

/// A node of the tree of hull 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// The splitting plane; may be out of range in bad files, which disables the tree.
    pub plane: u32,
    /// In front of the plane, behind the plane. Indices are in range.
    pub children: [NodeChild; 2],
    /// Least corner of the bounds.
    pub mins: [f32; 3],
    /// Greatest corner of the bounds.
    pub maxs: [f32; 3],
    /// First face on the plane; not checked.
    pub first_face: u32,
    /// Number of faces on the plane; not checked.
    pub num_faces: u32,
}

/// How a face's texture lies on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texinfo {
    /// `s = dot(p, s.xyz) + s.w` in texels.
    pub s: [f32; 4],
    /// `t = dot(p, t.xyz) + t.w` in texels.
    pub t: [f32; 4],
    /// Index into [`super::Bsp::textures`] as stored; see [`super::Bsp::face_texture`].
    pub miptex: i32,
    /// Bit 0: special, no lightmap.
    pub flags: u32,
}

impl Texinfo {
    /// Flag of surfaces without a lightmap (sky, liquids).
    pub const SPECIAL: u32 = 1;

    /// Texture coordinates of a point in texels, computed in f64.
    pub fn st(&self, p: [f32; 3]) -> [f64; 2] {
        let eval = |[x, y, z, w]: [f32; 4]| {
            f64::from(p[0]) * f64::from(x)
                + f64::from(p[1]) * f64::from(y)
                + f64::from(p[2]) * f64::from(z)
                + f64::from(w)
        };
        [eval(self.s), eval(self.t)]
    }

    /// Whether the surface has no lightmap.
    pub fn is_special(&self) -> bool {
        self.flags & Self::SPECIAL != 0
    }
}

/// Why a face is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaceFlaw {
    /// Fewer than three edges.
    FewEdges,
    /// A surfedge, edge or vertex index is out of range.
    BadIndex,
    /// A vertex is not finite or absurdly far away.
    BadVertex,
    /// The polygon has no area.
    NoArea,
    /// Faces of the file share so many edges that drawing all would take memory out of proportion.
    TooManyEdges,
}

/// A polygon of the level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Face {
    /// Index of its plane; may be out of range in bad files, see [`super::Bsp::face_plane`].
    pub plane: u32,
    /// Whether the face looks against the plane's normal.
    pub side: bool,
    /// First of its surfedges.
    pub first_edge: u32,
    /// Number of its surfedges and vertices.
    pub num_edges: u32,
    /// Index of its texinfo; may be out of range in bad files, see [`super::Bsp::face_texinfo`].
    pub texinfo: u32,
    /// Light styles of its lightmaps; 255 ends the list.
    pub styles: [u8; 4],
    /// First sample in the lighting lump; -1 for none.
    pub light_offset: i32,
    /// Why the face must not be drawn; `None` for a good face, whose edges and vertices are all in
    /// range and finite.
    pub flaw: Option<FaceFlaw>,
}

impl Face {
    /// Whether the face can be drawn.
    pub fn is_valid(&self) -> bool {
        self.flaw.is_none()
    }
}

/// What a clipnode's side leads to, as [`Clipnode::children`] holds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clipnode {
    /// The splitting plane; may be out of range in bad files, which disables the tree.
    pub plane: u32,
    /// In front, behind: another clipnode if 0 or more (then in range), else contents.
    pub children: [i32; 2],
}

/// A convex cell of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leaf {
    /// What fills it, see [`super::contents`].
    pub contents: i32,
    /// Byte offset of its row in the visibility lump; -1 for all visible.
    pub vis_offset: i32,
    /// Least corner of the bounds.
    pub mins: [f32; 3],
    /// Greatest corner of the bounds.
    pub maxs: [f32; 3],
    /// First of its marksurfaces; in range.
    pub first_mark: u32,
    /// Number of its marksurfaces; in range.
    pub num_marks: u32,
    /// Ambient sound levels: water, sky, slime, lava.
    pub ambient: [u8; 4],
}

/// A brush model: the world (number 0) or a part of it that can move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// Least corner of the bounds; engines take 1 unit off.
    pub mins: [f32; 3],
    /// Greatest corner of the bounds; engines add 1 unit.
    pub maxs: [f32; 3],
    /// Origin, normally 0: geometry is in the level's space already.
    pub origin: [f32; 3],
    /// Roots: a node for hull 0, clipnodes for hulls 1 to 3. Not checked: the methods that follow
    /// them do.
    pub head_nodes: [i32; 4],
    /// Leafs that have visibility rows (of model 0).
    pub vis_leafs: i32,
    /// First of its faces; in range.
    pub first_face: u32,
    /// Number of its faces; in range.
    pub num_faces: u32,
}

impl Model {
    /// Its faces as indices into [`super::Bsp::faces`].
    pub fn faces(&self) -> std::ops::Range<usize> {
        let first = self.first_face as usize;
        first..first.saturating_add(self.num_faces as usize)
    }
}

/// Sizes of the records that differ between formats, in bytes.
pub(super) struct Sizes {
    pub node: usize,
    pub face: usize,
    pub clipnode: usize,
    pub leaf: usize,
    pub marksurface: usize,
    pub edge: usize,
}

pub(super) const PLANE: usize = 20;
pub(super) const VERTEX: usize = 12;
pub(super) const TEXINFO: usize = 40;
pub(super) const SURFEDGE: usize = 4;
pub(super) const MODEL: usize = 64;

impl Format {
    pub(super) fn sizes(self) -> Sizes {
        match self {
            Self::Bsp29 => Sizes {
                node: 24,
                face: 20,
                clipnode: 8,
                leaf: 28,
                marksurface: 2,
                edge: 4,
            },
            Self::Psb2 => Sizes {
                node: 32,
                face: 28,
                clipnode: 12,
                leaf: 32,
                marksurface: 4,
                edge: 8,
            },
            Self::Bsp2 => Sizes {
                node: 44,
                leaf: 44,
                ..Self::Psb2.sizes()
            },
        }
    }
}

pub(super) fn planes(lump: &[u8]) -> Vec<Plane> {
    records(lump, PLANE, |r| {
        Some(Plane {
            normal: r.vec3()?,
            distance: r.f32()?,
            kind: r.i32()?,
        })
    })
}

pub(super) fn vertices(lump: &[u8]) -> Vec<[f32; 3]> {
    records(lump, VERTEX, Reader::vec3)
}

pub(super) fn texinfos(lump: &[u8]) -> Vec<Texinfo> {
    records(lump, TEXINFO, |r| {
        Some(Texinfo {
            s: r.vec4()?,
            t: r.vec4()?,
            miptex: r.i32()?,
            flags: r.u32()?,
        })
    })
}

pub(super) fn surfedges(lump: &[u8]) -> Vec<i32> {
    records(lump, SURFEDGE, Reader::i32)
}

pub(super) fn models(lump: &[u8]) -> Vec<Model> {
    records(lump, MODEL, |r| {
        Some(Model {
            mins: r.vec3()?,
            maxs: r.vec3()?,
            origin: r.vec3()?,
            head_nodes: [r.i32()?, r.i32()?, r.i32()?, r.i32()?],
            vis_leafs: r.i32()?,
            // A negative value becomes a huge one and is cut by validation.
            first_face: r.u32()?,
            num_faces: r.u32()?,
        })
    })
}

pub(super) fn edges(lump: &[u8], format: Format) -> Vec<[u32; 2]> {
    if format == Format::Bsp29 {
        records(lump, 4, |r| Some([r.u16()?.into(), r.u16()?.into()]))
    } else {
        records(lump, 8, |r| Some([r.u32()?, r.u32()?]))
    }
}

pub(super) fn marksurfaces(lump: &[u8], format: Format) -> Vec<u32> {
    if format == Format::Bsp29 {
        records(lump, 2, |r| r.u16().map(u32::from))
    } else {
        records(lump, 4, Reader::u32)
    }
}

pub(super) fn faces(lump: &[u8], format: Format) -> Vec<Face> {
    let wide = format != Format::Bsp29;
    records(lump, format.sizes().face, |r| {
        Some(Face {
            plane: narrow_or_wide(r, wide)?,
            side: narrow_or_wide(r, wide)? != 0,
            first_edge: r.u32()?,
            num_edges: narrow_or_wide(r, wide)?,
            texinfo: narrow_or_wide(r, wide)?,
            styles: r.array()?,
            light_offset: r.i32()?,
            flaw: None,
        })
    })
}

fn narrow_or_wide(r: &mut Reader<'_>, wide: bool) -> Option<u32> {
    if wide {
        r.u32()
    } else {
        r.u16().map(u32::from)
    }
}

fn corner(r: &mut Reader<'_>, format: Format) -> Option<[f32; 3]> {
    if format == Format::Bsp2 {
        r.vec3()
    } else {
        Some([r.i16()?.into(), r.i16()?.into(), r.i16()?.into()])
    }
}

/// Nodes as stored, children widened but not yet told apart.
pub(super) fn nodes(lump: &[u8], format: Format, leafs: usize) -> (Vec<Node>, u64) {
    let size = format.sizes().node;
    let count = lump.len() / size;
    let bad = std::cell::Cell::new(0_u64);
    let child = |r: &mut Reader<'_>| {
        let (child, ok) = if format == Format::Bsp29 {
            node_child16(r.u16()?, count, leafs)
        } else {
            node_child32(r.i32()?, count, leafs)
        };
        bad.set(bad.get() + u64::from(!ok));
        Some(child)
    };
    let nodes = records(lump, size, |r| {
        Some(Node {
            plane: r.u32()?,
            children: [child(r)?, child(r)?],
            mins: corner(r, format)?,
            maxs: corner(r, format)?,
            first_face: narrow_or_wide(r, format != Format::Bsp29)?,
            num_faces: narrow_or_wide(r, format != Format::Bsp29)?,
        })
    });
    (nodes, bad.get())
}

/// A 16-bit child: a node if there is one of that number, else a leaf counted down from 65535.
/// The flag is false where there is no such leaf either and leaf 0 stands in.
pub(super) fn node_child16(raw: u16, nodes: usize, leafs: usize) -> (NodeChild, bool) {
    if usize::from(raw) < nodes {
        return (NodeChild::Node(raw.into()), true);
    }
    leaf_child(u32::from(u16::MAX - raw), leafs)
}

/// A 32-bit child: a node from 0 up, leaf -1-n below. The flag is as for [`node_child16`].
pub(super) fn node_child32(raw: i32, nodes: usize, leafs: usize) -> (NodeChild, bool) {
    match u32::try_from(raw) {
        Ok(n) if (n as usize) < nodes => (NodeChild::Node(n), true),
        Ok(_) => (NodeChild::Leaf(0), false),
        Err(_) => leaf_child((-1 - raw).unsigned_abs(), leafs),
    }
}

fn leaf_child(leaf: u32, leafs: usize) -> (NodeChild, bool) {
    if (leaf as usize) < leafs {
        (NodeChild::Leaf(leaf), true)
    } else {
        (NodeChild::Leaf(0), false)
    }
}

pub(super) fn clipnodes(lump: &[u8], format: Format) -> (Vec<Clipnode>, u64) {
    let size = format.sizes().clipnode;
    let count = lump.len() / size;
    let bad = std::cell::Cell::new(0_u64);
    let child = |r: &mut Reader<'_>| {
        let value = if format == Format::Bsp29 {
            clip_child16(r.u16()?, count)
        } else {
            r.i32()?
        };
        if usize::try_from(value).is_ok_and(|v| v >= count) {
            bad.set(bad.get() + 1);
            return Some(super::contents::SOLID);
        }
        Some(value)
    };
    let nodes = records(lump, size, |r| {
        Some(Clipnode {
            plane: r.u32()?,
            children: [child(r)?, child(r)?],
        })
    });
    (nodes, bad.get())
}

/// A 16-bit clipnode child: a clipnode if there is one of that number, else contents.
pub(super) fn clip_child16(raw: u16, clipnodes: usize) -> i32 {
    if usize::from(raw) < clipnodes {
        i32::from(raw)
    } else {
        i32::from(raw) - 0x1_0000
    }
}

pub(super) fn leafs(lump: &[u8], format: Format) -> Vec<Leaf> {
    let wide = format != Format::Bsp29;
    records(lump, format.sizes().leaf, |r| {
        Some(Leaf {
            contents: r.i32()?,
            vis_offset: r.i32()?,
            mins: corner(r, format)?,
            maxs: corner(r, format)?,
            first_mark: narrow_or_wide(r, wide)?,
            num_marks: narrow_or_wide(r, wide)?,
            ambient: r.array()?,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_of_16_bits_are_unsigned() {
        assert_eq!(node_child16(3, 10, 5), (NodeChild::Node(3), true));
        assert_eq!(node_child16(0xffff, 10, 5), (NodeChild::Leaf(0), true));
        assert_eq!(node_child16(0xfffd, 10, 5), (NodeChild::Leaf(2), true));
        assert_eq!(node_child16(0xfff0, 10, 5), (NodeChild::Leaf(0), false));
        assert_eq!(clip_child16(0x9000, 40_000), 36_864);
        assert_eq!(clip_child16(0xfffe, 40_000), -2);
    }

    #[test]
    fn children_of_32_bits_are_signed() {
        assert_eq!(node_child32(9, 10, 5), (NodeChild::Node(9), true));
        assert_eq!(node_child32(10, 10, 5), (NodeChild::Leaf(0), false));
        assert_eq!(node_child32(-5, 10, 5), (NodeChild::Leaf(4), true));
        assert_eq!(node_child32(i32::MIN, 10, 5), (NodeChild::Leaf(0), false));
    }
}
