//! A compiled map as the bytes of a BSP 29 file.

use std::collections::HashMap;

use crate::CompileError;
use crate::compile::{Compiled, Model};
use crate::texture::{Contents, Texture};
use crate::tree::Tree;
use crate::vis;

/// Lumps of the format.
const LUMPS: usize = 15;

#[derive(Default)]
struct Lumps {
    entities: Vec<u8>,
    planes: Vec<u8>,
    textures: Vec<u8>,
    vertices: Vec<u8>,
    visibility: Vec<u8>,
    nodes: Vec<u8>,
    texinfo: Vec<u8>,
    faces: Vec<u8>,
    lighting: Vec<u8>,
    clipnodes: Vec<u8>,
    leafs: Vec<u8>,
    marksurfaces: Vec<u8>,
    edges: Vec<u8>,
    surfedges: Vec<u8>,
    models: Vec<u8>,
}

trait Put {
    fn i16(&mut self, v: i16);
    fn u16(&mut self, v: u16);
    fn i32(&mut self, v: i32);
    fn f32(&mut self, v: f64);
}

impl Put for Vec<u8> {
    fn i16(&mut self, v: i16) {
        self.extend_from_slice(&v.to_le_bytes());
    }
    fn u16(&mut self, v: u16) {
        self.extend_from_slice(&v.to_le_bytes());
    }
    fn i32(&mut self, v: i32) {
        self.extend_from_slice(&v.to_le_bytes());
    }
    fn f32(&mut self, v: f64) {
        self.extend_from_slice(&(v as f32 + 0.0).to_le_bytes());
    }
}

fn limit<T: TryFrom<usize>>(what: &'static str, count: usize) -> Result<T, CompileError> {
    T::try_from(count).map_err(|_| CompileError::TooMany { what, count })
}

struct Writer<'a> {
    map: &'a Compiled,
    lumps: Lumps,
    plane_index: HashMap<usize, i32>,
    node_count: usize,
    clipnode_count: usize,
    leaf_count: usize,
    mark_count: usize,
    face_count: usize,
    edge_count: usize,
    surfedge_count: usize,
    /// Edges drawn once so far, by their vertices in the direction drawn.
    open_edges: HashMap<(u32, u32), i32>,
}

/// Writes the file.
pub(crate) fn write(map: &Compiled, textures: &[Texture]) -> Result<Vec<u8>, CompileError> {
    let mut w = Writer {
        map,
        lumps: Lumps::default(),
        plane_index: HashMap::new(),
        node_count: 0,
        clipnode_count: 0,
        leaf_count: 1,
        mark_count: 0,
        face_count: 0,
        edge_count: 1,
        surfedge_count: 0,
        open_edges: HashMap::new(),
    };
    w.entities();
    let texture_of = w.textures(textures)?;
    for t in &map.texinfos {
        for v in t.rows.iter().flatten() {
            w.lumps.texinfo.extend_from_slice(&v.to_le_bytes());
        }
        w.lumps
            .texinfo
            .i32(texture_of[&t.texture.to_ascii_lowercase()]);
        w.lumps.texinfo.i32(i32::from(t.special));
    }
    // Leaf 0 is all that is solid; edge 0 is never used, since its sign would be lost.
    w.leaf_record(Contents::Solid, -1, None, 0, 0)?;
    w.lumps.edges.extend_from_slice(&[0; 4]);
    for (i, model) in map.models.iter().enumerate() {
        w.model(model, i == 0)?;
    }
    let _: u16 = limit("vertices", map.vertices.points.len())?;
    for p in &map.vertices.points {
        for v in p {
            w.lumps.vertices.f32(*v);
        }
    }
    Ok(w.finish())
}

impl Writer<'_> {
    fn entities(&mut self) {
        let out = &mut self.lumps.entities;
        for e in &self.map.entities {
            out.extend_from_slice(b"{\n");
            for (k, v) in &e.keys {
                out.extend_from_slice(format!("\"{k}\" \"{v}\"\n").as_bytes());
            }
            out.extend_from_slice(b"}\n");
        }
        out.push(0);
    }

    /// Writes the textures that are used, and the other frames of animated ones; returns the
    /// number of each name (in lower case).
    fn textures(&mut self, given: &[Texture]) -> Result<HashMap<String, i32>, CompileError> {
        let mut names: Vec<String> = Vec::new();
        for t in &self.map.texinfos {
            let name = t.texture.to_ascii_lowercase();
            if !names.contains(&name) {
                names.push(name);
            }
        }
        for t in given {
            let name = t.name.to_ascii_lowercase();
            let frame_of = |used: &str| used.starts_with('+') && used.get(2..) == name.get(2..);
            let extra = name.starts_with('+') && names.iter().any(|n| frame_of(n));
            if extra && !names.contains(&name) {
                names.push(name);
            }
        }
        let mut body = Vec::new();
        let start = 4 + 4 * names.len();
        let mut index = HashMap::new();
        self.lumps.textures.i32(limit("textures", names.len())?);
        for (i, name) in names.into_iter().enumerate() {
            match given.iter().find(|t| t.name.eq_ignore_ascii_case(&name)) {
                Some(t) => {
                    t.check()?;
                    self.lumps
                        .textures
                        .i32(limit("bytes of textures", start + body.len())?);
                    body.extend(t.to_miptex());
                    while body.len() % 4 != 0 {
                        body.push(0);
                    }
                }
                None => self.lumps.textures.i32(-1),
            }
            index.insert(name, i as i32);
        }
        self.lumps.textures.extend(body);
        Ok(index)
    }

    /// The number of a plane in the file; only the one that faces along its major axis is there.
    fn plane(&mut self, plane: usize) -> i32 {
        let pair = plane & !1;
        let next = self.plane_index.len() as i32;
        let known = *self.plane_index.entry(pair).or_insert(next);
        if known == next {
            let p = self.map.planes.get(pair);
            let out = &mut self.lumps.planes;
            for v in p.normal {
                out.f32(v);
            }
            out.f32(p.dist);
            let n = p.normal;
            let major = (0..3).fold(0, |m, i| if n[i].abs() > n[m].abs() { i } else { m });
            out.i32(p.axis().unwrap_or(3 + major) as i32);
        }
        known
    }

    fn leaf_record(
        &mut self,
        contents: Contents,
        visofs: i32,
        bounds: Option<crate::math::Bounds>,
        first_mark: usize,
        marks: usize,
    ) -> Result<(), CompileError> {
        let out = &mut self.lumps.leafs;
        out.i32(contents.code());
        out.i32(visofs);
        put_bounds(out, bounds);
        out.u16(limit("marksurfaces", first_mark)?);
        out.u16(limit("marksurfaces", marks)?);
        out.extend_from_slice(&[0; 4]);
        Ok(())
    }

    fn model(&mut self, model: &Model, world: bool) -> Result<(), CompileError> {
        let first_face = self.face_count;
        let head = self.nodes(model)?;
        let clip = [
            self.clipnodes(&model.hulls[0])?,
            self.clipnodes(&model.hulls[1])?,
        ];
        let out = &mut self.lumps.models;
        for v in model.bounds.mins.iter().chain(&model.bounds.maxs) {
            out.f32(*v);
        }
        out.extend_from_slice(&[0; 12]);
        for h in [head, clip[0], clip[1], 0] {
            out.i32(h);
        }
        out.i32(if world {
            limit("leafs", model.leafs.len())?
        } else {
            0
        });
        out.i32(limit("faces", first_face)?);
        out.i32(limit("faces", self.face_count - first_face)?);
        Ok(())
    }

    /// Writes a model's nodes, faces and leafs; returns the head node.
    fn nodes(&mut self, model: &Model) -> Result<i32, CompileError> {
        let tree = &model.tree;
        let order = node_order(tree);
        let mut node_number = HashMap::new();
        for (i, n) in order.iter().enumerate() {
            node_number.insert(*n, self.node_count + i);
        }
        let mut leaf_number = HashMap::new();
        for (i, l) in model.leafs.iter().enumerate() {
            leaf_number.insert(*l, self.leaf_count + i);
        }
        // Faces are sorted by node in the tree's order of making, which is also the file's.
        let mut marks: HashMap<usize, Vec<u16>> = HashMap::new();
        let child = |n: usize| -> Result<i16, CompileError> {
            match (node_number.get(&n), leaf_number.get(&n)) {
                (Some(i), _) => limit("nodes", *i),
                (None, Some(l)) => limit::<i16>("leafs", *l).map(|l| -1 - l),
                (None, None) => Ok(-1),
            }
        };
        let head = self.node_count;
        for &n in &order {
            let Some(split) = tree.nodes[n].split else {
                continue;
            };
            let first = self.face_count;
            let start = model.faces.partition_point(|f| f.node < n);
            for f in model.faces[start..].iter().take_while(|f| f.node == n) {
                for (leaf, _) in &f.leafs {
                    let list = marks.entry(*leaf).or_default();
                    let number = limit("faces", self.face_count)?;
                    if list.last() != Some(&number) {
                        list.push(number);
                    }
                }
                self.face(f)?;
            }
            let plane = self.plane(split.plane);
            let out = &mut self.lumps.nodes;
            out.i32(plane);
            out.i16(child(split.children[0])?);
            out.i16(child(split.children[1])?);
            put_bounds(out, Some(tree.nodes[n].bounds));
            out.u16(limit("faces", first)?);
            out.u16(limit("faces", self.face_count - first)?);
        }
        self.node_count += order.len();
        if order.is_empty() {
            return Err(CompileError::NoSpace);
        }
        for (i, &l) in model.leafs.iter().enumerate() {
            let visofs = match model.vis.get(i) {
                None => -1,
                Some(row) => {
                    let at = self.lumps.visibility.len();
                    let packed = vis::compress(row, model.leafs.len());
                    self.lumps.visibility.extend(packed);
                    limit("bytes of visibility", at)?
                }
            };
            let list = marks.remove(&l).unwrap_or_default();
            let node = &tree.nodes[l];
            self.leaf_record(
                node.contents,
                visofs,
                Some(node.bounds),
                self.mark_count,
                list.len(),
            )?;
            self.mark_count += list.len();
            for m in list {
                self.lumps.marksurfaces.u16(m);
            }
        }
        self.leaf_count += model.leafs.len();
        limit("nodes", head)
    }

    fn face(&mut self, f: &crate::face::Face) -> Result<(), CompileError> {
        let first = self.surfedge_count;
        let n = f.vertices.len();
        for i in 0..n {
            let (a, b) = (f.vertices[i], f.vertices[(i + 1) % n]);
            // A neighbour that ran along this edge the other way shares it.
            let surfedge = match self.open_edges.remove(&(b, a)) {
                Some(e) => -e,
                None => {
                    let e = limit::<i32>("edges", self.edge_count)?;
                    self.edge_count += 1;
                    self.lumps.edges.u16(limit("vertices", a as usize)?);
                    self.lumps.edges.u16(limit("vertices", b as usize)?);
                    self.open_edges.entry((a, b)).or_insert(e);
                    e
                }
            };
            self.lumps.surfedges.i32(surfedge);
            self.surfedge_count += 1;
        }
        let plane = self.plane(f.plane);
        let out = &mut self.lumps.faces;
        out.u16(limit("planes", plane as usize)?);
        out.i16((f.plane & 1) as i16);
        out.i32(limit("surfedges", first)?);
        out.u16(limit("edges of a face", n)?);
        out.u16(limit("texinfos", f.texinfo)?);
        out.extend_from_slice(&[255; 4]);
        out.i32(-1);
        self.face_count += 1;
        Ok(())
    }

    /// Writes a clip hull; returns its head.
    fn clipnodes(&mut self, tree: &Tree) -> Result<i32, CompileError> {
        let order = node_order(tree);
        let head = self.clipnode_count;
        if order.is_empty() {
            // Engines need a node to start from: one with the same on both sides.
            let plane = self.plane(0);
            let code = tree.nodes[0].contents.code() as i16;
            self.clipnode_count += 1;
            let out = &mut self.lumps.clipnodes;
            out.i32(plane);
            out.i16(code);
            out.i16(code);
            return limit("clipnodes", head);
        }
        let number: HashMap<usize, usize> = order
            .iter()
            .enumerate()
            .map(|(i, n)| (*n, head + i))
            .collect();
        for &n in &order {
            let Some(split) = tree.nodes[n].split else {
                continue;
            };
            let plane = self.plane(split.plane);
            self.lumps.clipnodes.i32(plane);
            for c in split.children {
                let child = match number.get(&c) {
                    Some(i) => limit("clipnodes", *i)?,
                    None => tree.nodes[c].contents.code() as i16,
                };
                self.lumps.clipnodes.i16(child);
            }
        }
        self.clipnode_count += order.len();
        limit("clipnodes", head)
    }

    fn finish(self) -> Vec<u8> {
        let l = self.lumps;
        let lumps: [Vec<u8>; LUMPS] = [
            l.entities,
            l.planes,
            l.textures,
            l.vertices,
            l.visibility,
            l.nodes,
            l.texinfo,
            l.faces,
            l.lighting,
            l.clipnodes,
            l.leafs,
            l.marksurfaces,
            l.edges,
            l.surfedges,
            l.models,
        ];
        let mut out = 29i32.to_le_bytes().to_vec();
        let mut at = 4 + 8 * LUMPS;
        for lump in &lumps {
            out.i32(at as i32);
            out.i32(lump.len() as i32);
            at += lump.len().next_multiple_of(4);
        }
        for lump in &lumps {
            out.extend_from_slice(lump);
            out.resize(out.len().next_multiple_of(4), 0);
        }
        out
    }
}

/// The nodes (not leafs) that are still in use, parents first, front before back.
fn node_order(tree: &Tree) -> Vec<usize> {
    let mut out = Vec::new();
    let mut todo = vec![0];
    while let Some(n) = todo.pop() {
        if let Some(split) = tree.nodes[n].split {
            out.push(n);
            todo.extend([split.children[1], split.children[0]]);
        }
    }
    out
}

fn put_bounds(out: &mut Vec<u8>, bounds: Option<crate::math::Bounds>) {
    let clamp = |v: f64| v.clamp(f64::from(i16::MIN), f64::from(i16::MAX)) as i16;
    match bounds.filter(|b| b.mins[0] <= b.maxs[0]) {
        Some(b) => {
            for v in b.mins {
                out.i16(clamp(v.floor()));
            }
            for v in b.maxs {
                out.i16(clamp(v.ceil()));
            }
        }
        None => out.extend_from_slice(&[0; 12]),
    }
}
