//! The lumps of a compiled level (version 29), to damage them on purpose.

/// Lumps of version 29.
const COUNT: usize = 15;
/// Bytes of a face's record.
const FACE: usize = 20;

/// Number of the lump of vertices.
const VERTICES: usize = 3;
/// Number of the lump of compressed visibility rows.
const VISIBILITY: usize = 4;
/// Number of the lump of faces.
const FACES: usize = 7;
/// Number of the lump of edges.
const EDGES: usize = 12;
/// Number of the lump of surfedges.
const SURFEDGES: usize = 13;

/// A level taken apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lumps {
    lumps: Vec<Vec<u8>>,
    /// Entries of the `BSPX` directory, by name; no directory if empty.
    bspx: Vec<(String, Vec<u8>)>,
}

impl Lumps {
    /// Takes a level apart that the map compiler has written.
    ///
    /// # Panics
    /// When it is cut short.
    #[must_use]
    pub fn of(level: &[u8]) -> Self {
        let number = |at: usize| u32::from_le_bytes(four(level, at)) as usize;
        let lump = |i: usize| {
            let (offset, length) = (number(4 + 8 * i), number(8 + 8 * i));
            level[offset..offset + length].to_vec()
        };
        Self {
            lumps: (0..COUNT).map(lump).collect(),
            bspx: Vec::new(),
        }
    }

    /// The file.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = 29_u32.to_le_bytes().to_vec();
        out.resize(4 + 8 * COUNT, 0);
        for (i, lump) in self.lumps.iter().enumerate() {
            let range = [out.len(), lump.len()].map(|n| (n as u32).to_le_bytes());
            out[4 + 8 * i..12 + 8 * i].copy_from_slice(range.as_flattened());
            out.extend_from_slice(lump);
            out.resize(out.len().next_multiple_of(4), 0);
        }
        if self.bspx.is_empty() {
            return out;
        }
        out.extend_from_slice(b"BSPX");
        out.extend_from_slice(&(self.bspx.len() as u32).to_le_bytes());
        let mut at = out.len() + 32 * self.bspx.len();
        for (name, data) in &self.bspx {
            let mut field = [0; 24];
            field[..name.len()].copy_from_slice(name.as_bytes());
            out.extend_from_slice(&field);
            out.extend_from_slice(&(at as u32).to_le_bytes());
            out.extend_from_slice(&(data.len() as u32).to_le_bytes());
            at += data.len();
        }
        for (_, data) in &self.bspx {
            out.extend_from_slice(data);
        }
        out
    }

    /// The compressed visibility rows, to change them.
    pub fn visibility(&mut self) -> &mut Vec<u8> {
        &mut self.lumps[VISIBILITY]
    }

    /// How many faces there are.
    #[must_use]
    pub fn face_count(&self) -> usize {
        self.lumps[FACES].len() / FACE
    }

    /// Adds an entry to the `BSPX` directory. `name` has at most 24 bytes.
    pub fn add_bspx(&mut self, name: &str, data: Vec<u8>) {
        self.bspx.push((name.to_owned(), data));
    }

    /// Takes out of every face the corners that lie on a straight line between their neighbours:
    /// where they met corners of other faces, T-junctions are left. Returns how many were taken.
    ///
    /// # Panics
    /// When a face's edges are not there.
    pub fn strip_collinear(&mut self) -> usize {
        let vertices: Vec<[f64; 3]> = (self.lumps[VERTICES].as_chunks::<12>().0.iter())
            .map(|v| [0, 4, 8].map(|i| f64::from(f32::from_le_bytes(four(v, i)))))
            .collect();
        let corner = |edges: &[u8], surfedge: i32| {
            let at = 4 * surfedge.unsigned_abs() as usize + if surfedge < 0 { 2 } else { 0 };
            u16::from_le_bytes([edges[at], edges[at + 1]])
        };
        let mut edges = self.lumps[EDGES].clone();
        let mut surfedges: Vec<u8> = Vec::new();
        let mut taken = 0;
        let old_edges = std::mem::take(&mut self.lumps[EDGES]);
        let old_surfedges = std::mem::take(&mut self.lumps[SURFEDGES]);
        for face in self.lumps[FACES].as_chunks_mut::<FACE>().0 {
            let first = u32::from_le_bytes(four(face, 4)) as usize;
            let count = usize::from(u16::from_le_bytes([face[8], face[9]]));
            let corners: Vec<u16> = (first..first + count)
                .map(|i| corner(&old_edges, i32::from_le_bytes(four(&old_surfedges, 4 * i))))
                .collect();
            let kept: Vec<u16> = (0..count)
                .filter(|&i| {
                    let around = [i + count - 1, i, i + 1].map(|k| corners[k % count]);
                    !is_straight(around.map(|v| vertices[usize::from(v)]))
                })
                .map(|i| corners[i])
                .collect();
            taken += count - kept.len();
            face[4..8].copy_from_slice(&((surfedges.len() / 4) as u32).to_le_bytes());
            face[8..10].copy_from_slice(&(kept.len() as u16).to_le_bytes());
            for i in 0..kept.len() {
                surfedges.extend(((edges.len() / 4) as u32).to_le_bytes());
                let ends = [kept[i], kept[(i + 1) % kept.len()]];
                edges.extend(ends.map(u16::to_le_bytes).as_flattened());
            }
        }
        self.lumps[EDGES] = edges;
        self.lumps[SURFEDGES] = surfedges;
        taken
    }
}

fn four(bytes: &[u8], at: usize) -> [u8; 4] {
    std::array::from_fn(|i| bytes[at + i])
}

/// Whether `b` lies within 0.001 units of the straight line from `a` to `c`.
fn is_straight([a, b, c]: [[f64; 3]; 3]) -> bool {
    let [a, b, c] = [a, b, c].map(glam::DVec3::from);
    let along = (c - a).normalize_or_zero();
    along != glam::DVec3::ZERO && (b - a).cross(along).length() < 1e-3
}
