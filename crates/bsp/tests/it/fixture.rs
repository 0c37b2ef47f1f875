//! Levels made in memory: one description, emitted as BSP 29, 2PSB or BSP2.

use bsp::bsp::Format;

pub const ALL_FORMATS: [Format; 3] = [Format::Bsp29, Format::Psb2, Format::Bsp2];

#[derive(Clone)]
pub struct FaceRow {
    pub plane: u32,
    pub side: u32,
    pub first_edge: u32,
    pub num_edges: u32,
    pub texinfo: u32,
    pub styles: [u8; 4],
    pub light_offset: i32,
}

#[derive(Clone)]
pub struct LeafRow {
    pub contents: i32,
    pub vis_offset: i32,
    pub first_mark: u32,
    pub num_marks: u32,
}

#[derive(Clone)]
pub struct ModelRow {
    pub head_nodes: [i32; 4],
    pub vis_leafs: i32,
    pub first_face: i32,
    pub num_faces: i32,
}

/// A texture of a description: name as stored, size, first offset, bytes after the header.
#[derive(Clone)]
pub struct Tex {
    pub name: [u8; 16],
    pub size: [u32; 2],
    pub first_offset: u32,
    pub pixels: Vec<u8>,
}

pub fn name16(name: &str) -> [u8; 16] {
    let mut out = [0; 16];
    out[..name.len()].copy_from_slice(name.as_bytes());
    out
}

pub fn tex(name: &str, w: u32, h: u32) -> Option<Tex> {
    Some(Tex {
        name: name16(name),
        size: [w, h],
        first_offset: 40,
        pixels: (0..w * h).map(|i| (i % 251) as u8).collect(),
    })
}

/// The texture lump of a list of textures; `None` becomes offset -1.
pub fn texture_lump(textures: &[Option<Tex>]) -> Vec<u8> {
    let mut out = (textures.len() as i32).to_le_bytes().to_vec();
    let mut bodies = Vec::new();
    let base = 4 + 4 * textures.len();
    for texture in textures {
        let Some(t) = texture else {
            out.extend((-1_i32).to_le_bytes());
            continue;
        };
        out.extend(((base + bodies.len()) as i32).to_le_bytes());
        bodies.extend(t.name);
        bodies.extend(t.size.iter().flat_map(|v| v.to_le_bytes()));
        bodies.extend(t.first_offset.to_le_bytes());
        bodies.extend([0; 12]);
        bodies.extend(&t.pixels);
    }
    out.extend(bodies);
    out
}

/// A room of 128 units: four walls, a `{` grate as floor, a sky ceiling, a water surface at -32
/// with a face on either side. 14 faces' worth of tests in 8.
#[derive(Clone)]
pub struct Room {
    pub entities: Vec<u8>,
    pub planes: Vec<([f32; 3], f32, i32)>,
    pub textures: Vec<u8>,
    pub vertices: Vec<[f32; 3]>,
    pub visibility: Vec<u8>,
    /// Plane and children; a negative child is leaf -1-n.
    pub nodes: Vec<(i32, [i32; 2])>,
    pub texinfos: Vec<([f32; 4], [f32; 4], i32, i32)>,
    pub faces: Vec<FaceRow>,
    pub lighting: Vec<u8>,
    pub clipnodes: Vec<(i32, [i32; 2])>,
    pub leafs: Vec<LeafRow>,
    pub marks: Vec<u32>,
    pub edges: Vec<[u32; 2]>,
    pub surfedges: Vec<i32>,
    pub models: Vec<ModelRow>,
    pub bspx: Vec<(&'static str, Vec<u8>)>,
}

pub const ENTITIES: &str = "{\n\"classname\" \"worldspawn\"\n\"message\" \"A room\"\n}\n\
    {\n\"classname\" \"light\"\n\"origin\" \"0 0 48\"\n\"light\" \"200\"\n}\n\0";

/// Luxels of a wall of 128 units: 9 x 9.
pub const WALL_SAMPLES: usize = 81;

impl Room {
    pub fn new() -> Self {
        let mut room = Self {
            entities: ENTITIES.into(),
            planes: Vec::new(),
            textures: texture_lump(&[
                tex("wall", 64, 64),
                tex("{grate", 16, 16),
                tex("sky1", 256, 128),
                tex("*water1", 64, 64),
            ]),
            vertices: Vec::new(),
            visibility: vec![3],
            nodes: Vec::new(),
            texinfos: Vec::new(),
            faces: Vec::new(),
            lighting: Vec::new(),
            clipnodes: Vec::new(),
            leafs: vec![
                LeafRow {
                    contents: -2,
                    vis_offset: -1,
                    first_mark: 0,
                    num_marks: 0,
                },
                LeafRow {
                    contents: -1,
                    vis_offset: 0,
                    first_mark: 0,
                    num_marks: 8,
                },
                LeafRow {
                    contents: -3,
                    vis_offset: 0,
                    first_mark: 0,
                    num_marks: 8,
                },
            ],
            marks: (0..8).collect(),
            edges: vec![[0, 0]],
            surfedges: Vec::new(),
            models: vec![ModelRow {
                head_nodes: [0, 0, 0, 0],
                vis_leafs: 2,
                first_face: 0,
                num_faces: 8,
            }],
            bspx: Vec::new(),
        };
        for i in 0..8_u32 {
            let c = |bit: u32| if i >> bit & 1 != 0 { 64.0 } else { -64.0 };
            room.vertices.push([c(0), c(1), c(2)]);
        }
        for i in 0..4_u32 {
            let c = |bit: u32| if i >> bit & 1 != 0 { 64.0 } else { -64.0 };
            room.vertices.push([c(0), c(1), -32.0]);
        }
        for axis in 0..3_usize {
            for high in [false, true] {
                let mut normal = [0.0; 3];
                normal[axis] = 1.0;
                room.planes
                    .push((normal, if high { 64.0 } else { -64.0 }, axis as i32));
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let at = |du: u32, dv: u32| u32::from(high) << axis | du << u | dv << v;
                // Counter-clockwise seen from +axis, clockwise from -axis.
                let mut ring = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                if !high {
                    ring.reverse();
                }
                let texture = match (axis, high) {
                    (2, false) => 1,
                    (2, true) => 2,
                    _ => 0,
                };
                let plane = room.planes.len() as u32 - 1;
                room.face(plane, u32::from(high), ring, [u, v], texture);
                let inside = plane as i32 + 1;
                let children = if high { [-1, inside] } else { [inside, -1] };
                room.nodes.push((plane as i32, children));
                let last = plane == 5;
                let inside = if last { -1 } else { inside };
                let children = if high { [-2, inside] } else { [inside, -2] };
                room.clipnodes.push((plane as i32, children));
            }
        }
        room.planes.push(([0.0, 0.0, 1.0], -32.0, 2));
        room.nodes.push((6, [-2, -3]));
        room.face(6, 0, [8, 10, 11, 9], [0, 1], 3);
        room.face(6, 1, [8, 9, 11, 10], [0, 1], 3);
        room
    }

    fn face(&mut self, plane: u32, side: u32, ring: [u32; 4], axes: [usize; 2], texture: i32) {
        let axis = |a: usize| {
            let mut row = [0.0, 0.0, 0.0, 0.0];
            row[a] = 1.0;
            row
        };
        // Sky and water have no lightmap.
        let special = texture >= 2;
        let light_offset = if special {
            -1
        } else {
            let offset = self.lighting.len() as i32;
            let brightness = 100 + self.faces.len() as u8;
            self.lighting.extend([brightness; WALL_SAMPLES]);
            offset
        };
        self.texinfos
            .push((axis(axes[0]), axis(axes[1]), texture, i32::from(special)));
        let first_edge = self.surfedges.len() as u32;
        for (i, &a) in ring.iter().enumerate() {
            let b = ring[(i + 1) % 4];
            let known = self.edges.iter().skip(1).position(|&e| e == [b, a]);
            if let Some(i) = known {
                self.surfedges.push(-(i as i32 + 1));
            } else {
                self.edges.push([a, b]);
                self.surfedges.push(self.edges.len() as i32 - 1);
            }
        }
        self.faces.push(FaceRow {
            plane,
            side,
            first_edge,
            num_edges: 4,
            texinfo: self.texinfos.len() as u32 - 1,
            styles: [0, 255, 255, 255],
            light_offset,
        });
    }

    /// The fifteen lumps in this format.
    pub fn lumps(&self, format: Format) -> [Vec<u8>; 15] {
        let mut w = Writer {
            out: Vec::new(),
            wide: format != Format::Bsp29,
        };
        let float_boxes = format == Format::Bsp2;
        let mut lumps: [Vec<u8>; 15] = Default::default();
        lumps[0] = self.entities.clone();
        for (normal, distance, kind) in &self.planes {
            w.f32s(normal).f32s(&[*distance]).i32(*kind);
        }
        lumps[1] = w.done();
        lumps[2] = self.textures.clone();
        for v in &self.vertices {
            w.f32s(v);
        }
        lumps[3] = w.done();
        lumps[4] = self.visibility.clone();
        for (plane, children) in &self.nodes {
            w.i32(*plane);
            for &c in children {
                w.index(c as u32);
            }
            w.bounds(float_boxes).index(0).index(0);
        }
        lumps[5] = w.done();
        for (s, t, miptex, flags) in &self.texinfos {
            w.f32s(s).f32s(t).i32(*miptex).i32(*flags);
        }
        lumps[6] = w.done();
        for f in &self.faces {
            w.index(f.plane).index(f.side).i32(f.first_edge as i32);
            w.index(f.num_edges).index(f.texinfo);
            w.out.extend(f.styles);
            w.i32(f.light_offset);
        }
        lumps[7] = w.done();
        lumps[8] = self.lighting.clone();
        for (plane, children) in &self.clipnodes {
            w.i32(*plane);
            for &c in children {
                w.index(c as u32);
            }
        }
        lumps[9] = w.done();
        for l in &self.leafs {
            w.i32(l.contents).i32(l.vis_offset).bounds(float_boxes);
            w.index(l.first_mark).index(l.num_marks);
            w.out.extend([0; 4]);
        }
        lumps[10] = w.done();
        for &m in &self.marks {
            w.index(m);
        }
        lumps[11] = w.done();
        for &e in self.edges.as_flattened() {
            w.index(e);
        }
        lumps[12] = w.done();
        for &s in &self.surfedges {
            w.i32(s);
        }
        lumps[13] = w.done();
        for m in &self.models {
            w.f32s(&[-64.0; 3]).f32s(&[64.0; 3]).f32s(&[0.0; 3]);
            for &h in &m.head_nodes {
                w.i32(h);
            }
            w.i32(m.vis_leafs).i32(m.first_face).i32(m.num_faces);
        }
        lumps[14] = w.done();
        lumps
    }

    /// The whole file.
    pub fn emit(&self, format: Format) -> Vec<u8> {
        assemble(format, &self.lumps(format), &self.bspx)
    }
}

/// Lumps and `BSPX` lumps put into a file. Each lump begins at a multiple of 4.
pub fn assemble(format: Format, lumps: &[Vec<u8>; 15], bspx: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut file = match format {
        Format::Bsp29 => 29_i32.to_le_bytes().to_vec(),
        Format::Psb2 => b"2PSB".to_vec(),
        Format::Bsp2 => b"BSP2".to_vec(),
    };
    let mut at = 124;
    for lump in lumps {
        file.extend((at as i32).to_le_bytes());
        file.extend((lump.len() as i32).to_le_bytes());
        at += lump.len().next_multiple_of(4);
    }
    for lump in lumps {
        file.extend(lump);
        file.resize(file.len().next_multiple_of(4), 0);
    }
    if !bspx.is_empty() {
        file.extend(b"BSPX");
        file.extend((bspx.len() as u32).to_le_bytes());
        let mut at = file.len() + 32 * bspx.len();
        for (name, data) in bspx {
            let mut field = [0; 24];
            field[..name.len()].copy_from_slice(name.as_bytes());
            file.extend(field);
            file.extend((at as u32).to_le_bytes());
            file.extend((data.len() as u32).to_le_bytes());
            at += data.len();
        }
        for (_, data) in bspx {
            file.extend(data);
        }
    }
    file
}

/// Overwrites four bytes of a file.
pub fn patch(file: &mut [u8], at: usize, value: i32) {
    file[at..at + 4].copy_from_slice(&value.to_le_bytes());
}

/// Where the header keeps the offset of a lump; its length is 4 bytes on.
pub fn lump_header(lump: usize) -> usize {
    4 + 8 * lump
}

/// A PAK of these files, in this order.
pub fn pak(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut out = b"PACK".to_vec();
    let size: usize = files.iter().map(|(_, data)| data.len()).sum();
    out.extend((12 + size as i32).to_le_bytes());
    out.extend((64 * files.len() as i32).to_le_bytes());
    for (_, data) in files {
        out.extend(*data);
    }
    let mut at = 12;
    for (name, data) in files {
        let mut field = [0; 56];
        field[..name.len()].copy_from_slice(name.as_bytes());
        out.extend(field);
        out.extend((at as i32).to_le_bytes());
        out.extend((data.len() as i32).to_le_bytes());
        at += data.len();
    }
    out
}

struct Writer {
    out: Vec<u8>,
    wide: bool,
}

impl Writer {
    fn i32(&mut self, v: i32) -> &mut Self {
        self.out.extend(v.to_le_bytes());
        self
    }

    /// An index, of 16 bits in version 29: cut off there, as signed values are.
    fn index(&mut self, v: u32) -> &mut Self {
        if self.wide {
            self.out.extend(v.to_le_bytes());
        } else {
            self.out.extend((v as u16).to_le_bytes());
        }
        self
    }

    fn f32s(&mut self, vs: &[f32]) -> &mut Self {
        self.out.extend(vs.iter().flat_map(|v| v.to_le_bytes()));
        self
    }

    fn bounds(&mut self, float: bool) -> &mut Self {
        for v in [-64_i16, -64, -64, 64, 64, 64] {
            if float {
                self.f32s(&[v.into()]);
            } else {
                self.out.extend(v.to_le_bytes());
            }
        }
        self
    }

    fn done(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }
}
