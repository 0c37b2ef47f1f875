//! A plain reader of BSP 29, written from the format alone: it shares nothing with the writer.

use std::collections::HashMap;

pub struct Bsp<'a> {
    bytes: &'a [u8],
    planes: Vec<([f64; 3], f64)>,
}

pub struct Face {
    pub plane: usize,
    pub side: bool,
    pub texinfo: usize,
    pub vertices: Vec<usize>,
}

pub struct Leaf {
    pub contents: i32,
    pub visofs: i32,
    pub marks: Vec<usize>,
}

fn rd<const N: usize>(b: &[u8], at: usize) -> [u8; N] {
    b[at..at + N].try_into().unwrap()
}

fn i32_at(b: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(rd(b, at))
}

fn u16_at(b: &[u8], at: usize) -> usize {
    usize::from(u16::from_le_bytes(rd(b, at)))
}

fn i16_at(b: &[u8], at: usize) -> i32 {
    i32::from(i16::from_le_bytes(rd(b, at)))
}

fn vec_at(b: &[u8], at: usize) -> [f64; 3] {
    [0, 4, 8].map(|o| f64::from(f32::from_le_bytes(rd(b, at + o))))
}

impl<'a> Bsp<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        assert_eq!(i32_at(bytes, 0), 29);
        let mut bsp = Self {
            bytes,
            planes: Vec::new(),
        };
        bsp.planes = bsp
            .records(1, 20)
            .iter()
            .map(|r| (vec_at(r, 0), f64::from(f32::from_le_bytes(rd(r, 12)))))
            .collect();
        bsp
    }

    pub fn lump(&self, i: usize) -> &'a [u8] {
        let at = i32_at(self.bytes, 4 + 8 * i) as usize;
        let len = i32_at(self.bytes, 8 + 8 * i) as usize;
        assert_eq!(at % 4, 0);
        &self.bytes[at..at + len]
    }

    fn records(&self, lump: usize, size: usize) -> Vec<&'a [u8]> {
        let l = self.lump(lump);
        assert_eq!(l.len() % size, 0, "lump {lump}");
        l.chunks(size).collect()
    }

    pub fn entities(&self) -> String {
        let l = self.lump(0);
        assert_eq!(l.last(), Some(&0));
        String::from_utf8(l[..l.len() - 1].to_vec()).unwrap()
    }

    pub fn vertices(&self) -> Vec<[f64; 3]> {
        self.records(3, 12).iter().map(|r| vec_at(r, 0)).collect()
    }

    pub fn planes(&self) -> &[([f64; 3], f64)] {
        &self.planes
    }

    /// Walks a tree of records with a plane and two children of 16 bits.
    fn walk(&self, lump: usize, size: usize, head: i32, p: [f64; 3]) -> i32 {
        let nodes = self.lump(lump);
        let mut n = head;
        while n >= 0 {
            let r = &nodes[n as usize * size..];
            let (normal, dist) = self.planes[i32_at(r, 0) as usize];
            let d: f64 = (0..3).map(|i| normal[i] * p[i]).sum::<f64>() - dist;
            n = i16_at(r, if d >= 0.0 { 4 } else { 6 });
        }
        n
    }

    pub fn texinfo(&self, i: usize) -> ([[f64; 4]; 2], usize, i32) {
        let r = self.records(6, 40)[i];
        let f = |k: usize| f64::from(f32::from_le_bytes(rd(r, 4 * k)));
        let rows = [[f(0), f(1), f(2), f(3)], [f(4), f(5), f(6), f(7)]];
        (rows, i32_at(r, 32) as usize, i32_at(r, 36))
    }

    pub fn texture_names(&self) -> Vec<String> {
        let l = self.lump(2);
        (0..i32_at(l, 0) as usize)
            .map(|i| {
                let at = i32_at(l, 4 + 4 * i);
                if at < 0 {
                    return String::new();
                }
                let name = &l[at as usize..at as usize + 16];
                let end = name.iter().position(|b| *b == 0).unwrap();
                String::from_utf8(name[..end].to_vec()).unwrap()
            })
            .collect()
    }

    pub fn faces(&self) -> Vec<Face> {
        let edges = self.records(12, 4);
        let surfedges: Vec<i32> = self.records(13, 4).iter().map(|r| i32_at(r, 0)).collect();
        self.records(7, 20)
            .iter()
            .map(|r| {
                let (first, n) = (i32_at(r, 4) as usize, u16_at(r, 8));
                let vertex = |e: &i32| {
                    assert_ne!(*e, 0);
                    let edge = edges[e.unsigned_abs() as usize];
                    u16_at(edge, if *e > 0 { 0 } else { 2 })
                };
                Face {
                    plane: u16_at(r, 0),
                    side: i16_at(r, 2) != 0,
                    texinfo: u16_at(r, 10),
                    vertices: surfedges[first..first + n].iter().map(vertex).collect(),
                }
            })
            .collect()
    }

    /// First face and number of faces, head nodes, visleafs of each model.
    pub fn models(&self) -> Vec<(usize, usize, [i32; 4], usize)> {
        self.records(14, 64)
            .iter()
            .map(|r| {
                let heads = [36, 40, 44, 48].map(|o| i32_at(r, o));
                let n = |o| i32_at(r, o) as usize;
                (n(56), n(60), heads, n(52))
            })
            .collect()
    }

    pub fn leafs(&self) -> Vec<Leaf> {
        let marks: Vec<usize> = self.records(11, 2).iter().map(|r| u16_at(r, 0)).collect();
        self.records(10, 28)
            .iter()
            .map(|r| {
                let (first, n) = (u16_at(r, 20), u16_at(r, 22));
                Leaf {
                    contents: i32_at(r, 0),
                    visofs: i32_at(r, 4),
                    marks: marks[first..first + n].to_vec(),
                }
            })
            .collect()
    }

    pub fn leaf_at(&self, head: i32, p: [f64; 3]) -> usize {
        (-1 - self.walk(5, 24, head, p)) as usize
    }

    pub fn clip_contents(&self, head: i32, p: [f64; 3]) -> i32 {
        self.walk(9, 8, head, p)
    }

    /// Which of the leafs 1.. (bit 0 is leaf 1) a leaf sees.
    pub fn pvs(&self, visofs: i32, visleafs: usize) -> Vec<bool> {
        let vis = self.lump(4);
        let mut at = visofs as usize;
        let mut row = Vec::new();
        while row.len() < visleafs.div_ceil(8) {
            if vis[at] == 0 {
                row.extend(std::iter::repeat_n(0, usize::from(vis[at + 1])));
                at += 2;
            } else {
                row.push(vis[at]);
                at += 1;
            }
        }
        (0..visleafs)
            .map(|i| row[i / 8] >> (i % 8) & 1 != 0)
            .collect()
    }

    /// For each pair of vertices, how often faces run from the first to the second.
    pub fn directed_edges(&self, first: usize, count: usize) -> HashMap<(usize, usize), usize> {
        let mut out = HashMap::new();
        for f in &self.faces()[first..first + count] {
            for (i, v) in f.vertices.iter().enumerate() {
                *out.entry((*v, f.vertices[(i + 1) % f.vertices.len()]))
                    .or_insert(0) += 1;
            }
        }
        out
    }
}

/// Random numbers, the same every time (splitmix64).
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, n: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 * n
    }

    pub fn point(&mut self, mins: [f64; 3], maxs: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| mins[i] + self.below(maxs[i] - mins[i]))
    }
}
