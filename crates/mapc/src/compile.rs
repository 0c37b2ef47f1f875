//! The compiler itself: map in, models with trees, faces and clip hulls out.

use std::collections::HashMap;

use crate::face::{self, Face, Vertices};
use crate::map::{Brush, Entity, Map};
use crate::math::{Bounds, Plane, PlaneSet, Vec3, add, cross, dot, normalize, scale, sub};
use crate::portal::{self, OUTSIDE};
use crate::texture::Contents;
use crate::tree::{self, CompiledBrush, Side, Tree};
use crate::vis::{self, BitSet};
use crate::winding::Winding;
use crate::{CompileError, Options};

/// The hulls that players (1) and large monsters (2) are traced with, as every Quake engine has
/// them: smallest and largest corner around the origin, in Quake units.
const HULLS: [(Vec3, Vec3); 2] = [
    ([-16.0, -16.0, -24.0], [16.0, 16.0, 32.0]),
    ([-32.0, -32.0, -24.0], [32.0, 32.0, 64.0]),
];

/// One row of texinfo.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TexInfo {
    pub(crate) rows: [[f32; 4]; 2],
    /// As written in the map.
    pub(crate) texture: String,
    /// No lightmap: sky and liquids.
    pub(crate) special: bool,
}

/// A compiled model.
pub(crate) struct Model {
    pub(crate) tree: Tree,
    pub(crate) faces: Vec<Face>,
    pub(crate) bounds: Bounds,
    pub(crate) hulls: [Tree; 2],
    /// Leafs that get a number, in order; the world's come first in the file.
    pub(crate) leafs: Vec<usize>,
    /// One row for each leaf of `leafs`; empty for other models than the world.
    pub(crate) vis: Vec<BitSet>,
}

/// All of a map, ready to be written.
pub(crate) struct Compiled {
    pub(crate) planes: PlaneSet,
    pub(crate) texinfos: Vec<TexInfo>,
    pub(crate) vertices: Vertices,
    pub(crate) models: Vec<Model>,
    /// With `model` keys.
    pub(crate) entities: Vec<Entity>,
    pub(crate) warnings: Vec<String>,
}

struct Compiler<'a> {
    options: &'a Options,
    planes: PlaneSet,
    texinfos: Vec<TexInfo>,
    texinfo_index: HashMap<(String, [u32; 8]), usize>,
    vertices: Vertices,
    warnings: Vec<String>,
}

/// Names that are no surface: `clip` blocks players only, the others nothing.
fn is_clip(texture: &str) -> bool {
    texture.eq_ignore_ascii_case("clip")
}

fn is_nodraw(texture: &str) -> bool {
    ["skip", "hint", "hintskip", "nodraw", "caulk", "null"]
        .iter()
        .any(|n| texture.eq_ignore_ascii_case(n))
}

/// Compiles every model of the map.
pub(crate) fn compile(map: &Map, options: &Options) -> Result<Compiled, CompileError> {
    let mut c = Compiler {
        options,
        planes: PlaneSet::default(),
        texinfos: Vec::new(),
        texinfo_index: HashMap::new(),
        vertices: Vertices::default(),
        warnings: Vec::new(),
    };
    let mut world = Vec::new();
    let mut details = Vec::new();
    let mut points = Vec::new();
    for (i, e) in map.entities.iter().enumerate() {
        if i == 0 || e.is_world() {
            world.extend(e.brushes.iter());
            let detail = e.classname() == "func_detail";
            details.extend(std::iter::repeat_n(detail, e.brushes.len()));
        } else if e.brushes.is_empty()
            && let Some(origin) = e.vector("origin")
        {
            points.push((i, origin));
        }
    }
    let mut models = vec![c.world(map, &world, &details, &points)?];
    let mut entities = Vec::new();
    for (i, e) in map.entities.iter().enumerate() {
        let mut out = Entity {
            keys: e.keys.clone(),
            brushes: Vec::new(),
        };
        if i > 0 && e.is_world() {
            continue;
        }
        if i > 0 && !e.brushes.is_empty() {
            let brushes: Vec<&Brush> = e.brushes.iter().collect();
            out.set("model", &format!("*{}", models.len()));
            models.push(c.submodel(i, &brushes)?);
        }
        entities.push(out);
    }
    Ok(Compiled {
        planes: c.planes,
        texinfos: c.texinfos,
        vertices: c.vertices,
        models,
        entities,
        warnings: c.warnings,
    })
}

impl Compiler<'_> {
    fn world(
        &mut self,
        map: &Map,
        brushes: &[&Brush],
        details: &[bool],
        points: &[(usize, Vec3)],
    ) -> Result<Model, CompileError> {
        let (mut drawn, mut solid) = (Vec::new(), Vec::new());
        for (brush, &detail) in brushes.iter().zip(details) {
            let before = drawn.len();
            self.compile_brushes(0, &[brush], &mut drawn, &mut solid)?;
            for b in &mut drawn[before..] {
                // Liquid and sky always count.
                b.detail = detail && b.contents == Contents::Solid;
            }
        }
        if drawn.is_empty() {
            return Err(CompileError::NoBrushes { entity: 0 });
        }
        let origins: Vec<Vec3> = points.iter().map(|p| p.1).collect();
        // Two rounds: the first finds out which sides are seen, so that the second can split by
        // them first. Its tree is smaller and its faces are cut less.
        let mut round = 0;
        let (mut tree, faces) = loop {
            let mut tree = tree::build(&self.planes, &drawn, true);
            let portals = portal::build(&mut tree, &self.planes);
            let flood = portal::flood(&tree, &self.planes, &portals, &origins);
            match flood.leak {
                Some(i) if !self.options.allow_leaks => {
                    let (entity, origin) = points[i];
                    let classname = map.entities[entity].classname().to_owned();
                    return Err(CompileError::Leak {
                        entity,
                        classname,
                        origin,
                    });
                }
                Some(i) if round == 1 => {
                    let (entity, _) = points[i];
                    let name = map.entities[entity].classname();
                    self.warnings.push(format!(
                        "the map leaks: entity {entity} ({name}) reaches outside"
                    ));
                }
                Some(_) => {}
                None if flood.any => portal::fill_unreached(&mut tree, &flood),
                None => {
                    if round == 1 {
                        self.warnings
                            .push("no entity inside: the outside is not filled".into());
                    }
                }
            }
            let mut seen = Vec::new();
            let faces = face::from_portals(&tree, &self.planes, &drawn, &portals, |b, s| {
                seen.push((b, s))
            });
            if round == 1 {
                break (tree, faces);
            }
            for (b, s) in seen {
                drawn[b].sides[s].visible = true;
            }
            round += 1;
        };
        let faces = self.finish_faces(faces);
        prune(&mut tree, &faces);
        let leafs = numbered_leafs(&tree);
        let vis = if self.options.vis {
            self.visibility(&drawn, &origins, &tree, &leafs)
        } else {
            Vec::new()
        };
        let hulls = [0, 1].map(|h| self.clip_hull(&solid, h, Some(&origins)));
        let bounds = tree.bounds;
        Ok(Model {
            tree,
            faces,
            bounds,
            hulls,
            leafs,
            vis,
        })
    }

    fn submodel(&mut self, entity: usize, brushes: &[&Brush]) -> Result<Model, CompileError> {
        let (mut drawn, mut solid) = (Vec::new(), Vec::new());
        self.compile_brushes(entity, brushes, &mut drawn, &mut solid)?;
        if drawn.is_empty() {
            return Err(CompileError::NoBrushes { entity });
        }
        let mut tree = tree::build(&self.planes, &drawn, true);
        let portals = portal::build(&mut tree, &self.planes);
        let faces = face::from_portals(&tree, &self.planes, &drawn, &portals, |_, _| {});
        let faces = self.finish_faces(faces);
        prune(&mut tree, &faces);
        let leafs = numbered_leafs(&tree);
        let hulls = [0, 1].map(|h| self.clip_hull(&solid, h, None));
        let bounds = tree.bounds;
        Ok(Model {
            tree,
            faces,
            bounds,
            hulls,
            leafs,
            vis: Vec::new(),
        })
    }

    fn finish_faces(&mut self, faces: Vec<Face>) -> Vec<Face> {
        let mut faces = face::merge(faces, &self.planes);
        if let Some(size) = self.options.subdivide {
            let infos = &self.texinfos;
            faces = face::subdivide(faces, size, |t| {
                let rows = infos[t].rows.map(|r| r.map(f64::from));
                (!infos[t].special).then_some(rows)
            });
        }
        face::close(&mut faces, &mut self.vertices);
        faces.sort_by_key(|f| f.node);
        faces
    }

    fn compile_brushes(
        &mut self,
        entity: usize,
        brushes: &[&Brush],
        drawn: &mut Vec<CompiledBrush>,
        solid: &mut Vec<CompiledBrush>,
    ) -> Result<(), CompileError> {
        for (i, brush) in brushes.iter().enumerate() {
            let compiled = self
                .compile_brush(brush)
                .map_err(|problem| CompileError::Brush {
                    entity,
                    brush: i,
                    problem,
                })?;
            let name = brush.faces.first().map_or("", |f| f.texture.as_str());
            if matches!(compiled.contents, Contents::Solid | Contents::Sky) {
                solid.push(CompiledBrush {
                    contents: Contents::Solid,
                    ..compiled.clone()
                });
            }
            if !is_clip(name) {
                drawn.push(compiled);
            }
        }
        Ok(())
    }

    fn compile_brush(&mut self, brush: &Brush) -> Result<CompiledBrush, String> {
        let mut sides: Vec<Side> = Vec::new();
        for (i, f) in brush.faces.iter().enumerate() {
            let plane = Plane::from_points(&f.points)
                .ok_or_else(|| format!("the three points of face {i} lie on a line"))?;
            let index = self.planes.find_or_add(plane);
            if sides.iter().any(|s| s.plane == index) {
                continue;
            }
            let rows = f.projection.texinfo_rows(self.planes.get(index).normal);
            sides.push(Side {
                plane: index,
                texinfo: self.texinfo(&f.texture, rows),
                winding: None,
                visible: false,
                nodraw: is_nodraw(&f.texture),
            });
        }
        let contents = Contents::of_texture(brush.faces.first().map_or("", |f| &f.texture));
        self.with_windings(sides, contents)
    }

    /// Gives the sides their polygons and drops sides that have none.
    fn with_windings(
        &self,
        mut sides: Vec<Side>,
        contents: Contents,
    ) -> Result<CompiledBrush, String> {
        let indices: Vec<usize> = sides.iter().map(|s| s.plane).collect();
        let windings = tree::brush_windings(&self.planes, &indices);
        for (s, w) in sides.iter_mut().zip(windings) {
            s.winding = w;
        }
        sides.retain(|s| s.winding.is_some());
        let bounds = Bounds::of(
            sides
                .iter()
                .flat_map(|s| s.winding.iter())
                .flat_map(|w| &w.0),
        );
        let closed = sides.len() >= 4
            && bounds
                .mins
                .iter()
                .chain(&bounds.maxs)
                .all(|v| v.abs() < 32_000.0);
        if closed {
            Ok(CompiledBrush {
                sides,
                contents,
                bounds,
                detail: false,
            })
        } else {
            Err("the faces enclose no volume within 32000 units of the origin".to_owned())
        }
    }

    fn texinfo(&mut self, texture: &str, rows: [[f64; 4]; 2]) -> usize {
        let rows = rows.map(|r| r.map(|v| v as f32 + 0.0));
        let mut bits = [0; 8];
        for (b, v) in bits.iter_mut().zip(rows.iter().flatten()) {
            *b = v.to_bits();
        }
        let special = Contents::of_texture(texture) != Contents::Solid;
        let infos = &mut self.texinfos;
        *self
            .texinfo_index
            .entry((texture.to_ascii_lowercase(), bits))
            .or_insert_with(|| {
                infos.push(TexInfo {
                    rows,
                    texture: texture.to_owned(),
                    special,
                });
                infos.len() - 1
            })
    }

    /// One row for each numbered leaf. Sight is worked out in the tree without details, whose
    /// leafs are fewer; each leaf of the full tree lies within one of them.
    fn visibility(
        &self,
        drawn: &[CompiledBrush],
        origins: &[Vec3],
        full: &Tree,
        full_leafs: &[usize],
    ) -> Vec<BitSet> {
        let plain: Vec<CompiledBrush> = drawn.iter().filter(|b| !b.detail).cloned().collect();
        let mut tree = tree::build(&self.planes, &plain, true);
        let portals = portal::build(&mut tree, &self.planes);
        let flood = portal::flood(&tree, &self.planes, &portals, origins);
        if flood.any && flood.leak.is_none() {
            portal::fill_unreached(&mut tree, &flood);
        }
        let leafs = numbered_leafs(&tree);
        let mut number = vec![usize::MAX; tree.nodes.len()];
        for (i, l) in leafs.iter().enumerate() {
            number[*l] = i;
        }
        let mut doors = Vec::new();
        for p in &portals {
            let Some(split) = p.on_node.and_then(|n| tree.nodes[n].split) else {
                continue;
            };
            let open = |l: usize| l != OUTSIDE && !tree.nodes[l].contents.is_opaque();
            if p.leafs.iter().all(|&l| open(l)) {
                let plane = self.planes.get(split.plane);
                doors.push((p.winding.clone(), plane, p.leafs.map(|l| number[l])));
            }
        }
        let rows = vis::leaf_rows(leafs.len(), &doors);
        let home: Vec<usize> = full_leafs
            .iter()
            .map(|&l| number[tree.leaf_at(&self.planes, full.nodes[l].middle)])
            .collect();
        home.iter()
            .enumerate()
            .map(|(i, &a)| {
                let mut row = BitSet::new(home.len());
                for (j, &b) in home.iter().enumerate() {
                    // A sliver that fell into solid counts as seen from everywhere.
                    let lost = a == usize::MAX || b == usize::MAX;
                    if i == j || lost || rows[a].get(b) {
                        row.set(j);
                    }
                }
                row
            })
            .collect()
    }

    /// The tree in which a point stands for a whole box: brushes grown by the box's size.
    fn clip_hull(&mut self, solid: &[CompiledBrush], hull: usize, fill: Option<&[Vec3]>) -> Tree {
        let (mins, maxs) = HULLS[hull];
        let mut grown = Vec::new();
        for brush in solid {
            let sides = self.grown_sides(brush, mins, maxs);
            if let Ok(b) = self.with_windings(sides, Contents::Solid) {
                grown.push(b);
            }
        }
        let mut tree = tree::build(&self.planes, &grown, false);
        if let Some(points) = fill {
            let portals = portal::build(&mut tree, &self.planes);
            let flood = portal::flood(&tree, &self.planes, &portals, points);
            if flood.any && flood.leak.is_none() {
                portal::fill_unreached(&mut tree, &flood);
            }
        }
        prune(&mut tree, &[]);
        tree
    }

    /// The sides of a brush moved out so far that the box just touches it, with the bevels that
    /// keep corners and edges from growing too far.
    fn grown_sides(&mut self, brush: &CompiledBrush, mins: Vec3, maxs: Vec3) -> Vec<Side> {
        let points: Vec<Vec3> = brush
            .sides
            .iter()
            .filter_map(|s| s.winding.as_ref())
            .flat_map(|w| w.0.clone())
            .collect();
        let mut planes: Vec<Plane> = brush
            .sides
            .iter()
            .map(|s| self.planes.get(s.plane))
            .collect();
        let mut bevel = |normal: Vec3| {
            let dist = points
                .iter()
                .map(|p| dot(*p, normal))
                .fold(f64::NEG_INFINITY, f64::max);
            let known = planes
                .iter()
                .any(|p| (0..3).all(|i| (p.normal[i] - normal[i]).abs() < 1e-6));
            if !known {
                planes.push(Plane { normal, dist });
            }
        };
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut normal = [0.0; 3];
                normal[axis] = sign;
                bevel(normal);
            }
        }
        for w in brush.sides.iter().filter_map(|s| s.winding.as_ref()) {
            for normal in edge_bevels(w, &points) {
                bevel(normal);
            }
        }
        planes
            .into_iter()
            .map(|p| {
                let n = p.normal;
                let reach: f64 = (0..3).map(|i| (-mins[i] * n[i]).max(-maxs[i] * n[i])).sum();
                let plane = Plane {
                    normal: n,
                    dist: p.dist + reach,
                };
                Side {
                    plane: self.planes.find_or_add(plane),
                    texinfo: 0,
                    winding: None,
                    visible: false,
                    nodraw: true,
                }
            })
            .collect()
    }
}

/// Normals of planes through a slanted edge and along an axis that have the whole brush behind.
fn edge_bevels(w: &Winding, points: &[Vec3]) -> Vec<Vec3> {
    let mut out = Vec::new();
    let n = w.0.len();
    for i in 0..n {
        let Some(edge) = normalize(sub(w.0[(i + 1) % n], w.0[i])) else {
            continue;
        };
        if edge.iter().any(|v| v.abs() > 1.0 - 1e-6) {
            continue;
        }
        for axis in 0..3 {
            let mut unit = [0.0; 3];
            unit[axis] = 1.0;
            let Some(normal) = normalize(cross(edge, unit)) else {
                continue;
            };
            for normal in [normal, scale(normal, -1.0)] {
                let at = dot(w.0[i], normal);
                if points.iter().all(|p| dot(*p, normal) <= at + 0.01) {
                    out.push(add(normal, [0.0; 3]));
                }
            }
        }
    }
    out
}

/// Turns nodes with nothing but solid (or nothing but sky) below into leafs.
fn prune(tree: &mut Tree, faces: &[Face]) {
    let mut has_faces = vec![false; tree.nodes.len()];
    for f in faces {
        has_faces[f.node] = true;
    }
    // Children come after their parent in the list.
    for i in (0..tree.nodes.len()).rev() {
        let Some(split) = tree.nodes[i].split else {
            continue;
        };
        let [a, b] = split.children.map(|c| &tree.nodes[c]);
        let alike = a.split.is_none() && b.split.is_none() && a.contents == b.contents;
        if alike && a.contents.is_opaque() && !has_faces[i] {
            tree.nodes[i].contents = a.contents;
            tree.nodes[i].split = None;
        }
    }
}

/// The leafs that are not solid, in the order of the tree.
fn numbered_leafs(tree: &Tree) -> Vec<usize> {
    let mut out = Vec::new();
    let mut todo = vec![0];
    while let Some(n) = todo.pop() {
        match tree.nodes[n].split {
            Some(split) => todo.extend([split.children[1], split.children[0]]),
            None if tree.nodes[n].contents != Contents::Solid => out.push(n),
            None => {}
        }
    }
    out
}
