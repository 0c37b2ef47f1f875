//! The one place that doubts a level: marks faces that cannot be drawn, cuts ranges, and finds
//! trees that must not be walked.

use super::{Bsp, FaceFlaw, NodeChild, Plane};
use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};

/// Most leafs that QuakeSpasm takes in version 29.
const MAX_LEAFS_29: usize = 32767;

/// Faces may use this many times the surfedges there are, all together.
const EDGE_BUDGET: u64 = 4;

pub(super) fn validate(
    bsp: &mut Bsp,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<(), FormatError> {
    if bsp.models.is_empty() {
        return Err(FormatError::new(
            ErrorKind::Missing,
            "lump 14 (models)",
            "no model",
            "at least the world",
        ));
    }
    faces(bsp, limits, warnings);
    if !bsp.faces.iter().any(super::Face::is_valid) {
        return Err(FormatError::new(
            ErrorKind::Missing,
            "lump 7 (faces)",
            format!("{} faces, none of which can be drawn", bsp.faces.len()),
            "at least one good face",
        ));
    }
    surfaces(bsp, warnings);
    models(bsp, warnings);
    leafs(bsp, warnings);
    trees(bsp, warnings);
    Ok(())
}

fn length2(plane: &Plane) -> f32 {
    plane.normal.iter().map(|c| c * c).sum()
}

/// Whether a plane can give a face its normal: finite, and a unit vector to within half a percent,
/// which all that compilers write are.
pub(super) fn is_usable(plane: &Plane) -> bool {
    (0.99..=1.01).contains(&length2(plane)) && plane.distance.is_finite()
}

/// Whether a plane can split space: finite and not zero.
fn is_split(plane: &Plane) -> bool {
    let length2 = length2(plane);
    length2 > 0.0 && length2.is_finite() && plane.distance.is_finite()
}

/// Area vector (Newell's method, in f64) of a polygon whose vertices run clockwise seen from the
/// front: it points to the front, its length is twice the area.
pub(super) fn area_vector(points: impl Iterator<Item = [f32; 3]>) -> [f64; 3] {
    let mut points = points.map(|p| p.map(f64::from));
    let Some(origin) = points.next() else {
        return [0.0; 3];
    };
    let mut sum = [0.0; 3];
    let mut last: Option<[f64; 3]> = None;
    for p in points {
        let b = [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]];
        if let Some(a) = last {
            // b x a rather than a x b: clockwise.
            sum[0] += b[1] * a[2] - b[2] * a[1];
            sum[1] += b[2] * a[0] - b[0] * a[2];
            sum[2] += b[0] * a[1] - b[1] * a[0];
        }
        last = Some(b);
    }
    sum
}

fn faces(bsp: &mut Bsp, limits: &Limits, warnings: &mut Warnings) {
    let mut budget = (bsp.surfedges.len() as u64).saturating_mul(EDGE_BUDGET);
    let mut faces = std::mem::take(&mut bsp.faces);
    for (index, face) in faces.iter_mut().enumerate() {
        face.flaw = flaw(bsp, face, limits, &mut budget);
        if let Some(flaw) = face.flaw {
            let why = match flaw {
                FaceFlaw::FewEdges => "fewer than three edges",
                FaceFlaw::BadIndex => "an edge or vertex that is not there",
                FaceFlaw::BadVertex => "a vertex that is not finite or absurdly far away",
                FaceFlaw::NoArea => "no area",
                FaceFlaw::TooManyEdges => "more edges than the file accounts for",
            };
            warnings.add(WarningKind::FaceDropped, why, || {
                format!("face {index} has {why} and is left out")
            });
        }
    }
    bsp.faces = faces;
}

fn flaw(bsp: &Bsp, face: &super::Face, limits: &Limits, budget: &mut u64) -> Option<FaceFlaw> {
    if face.num_edges < 3 {
        return Some(FaceFlaw::FewEdges);
    }
    let first = face.first_edge as usize;
    let range = first..first.saturating_add(face.num_edges as usize);
    let Some(surfedges) = bsp.surfedges.get(range) else {
        return Some(FaceFlaw::BadIndex);
    };
    match budget.checked_sub(u64::from(face.num_edges)) {
        Some(rest) => *budget = rest,
        None => return Some(FaceFlaw::TooManyEdges),
    }
    for &surfedge in surfedges {
        let Some(point) = bsp
            .surfedge_vertex(surfedge)
            .and_then(|v| bsp.vertices.get(v as usize))
        else {
            return Some(FaceFlaw::BadIndex);
        };
        if !point.iter().all(|c| c.abs() <= limits.max_coordinate) {
            return Some(FaceFlaw::BadVertex);
        }
    }
    let points = surfedges
        .iter()
        .filter_map(|&e| bsp.vertices.get(bsp.surfedge_vertex(e)? as usize).copied());
    let area2: f64 = area_vector(points).iter().map(|c| c * c).sum();
    (area2 <= 0.0 || !area2.is_finite()).then_some(FaceFlaw::NoArea)
}

/// Planes and texinfos that good faces use but that are unusable.
fn surfaces(bsp: &Bsp, warnings: &mut Warnings) {
    for (index, face) in bsp.faces.iter().enumerate().filter(|(_, f)| f.is_valid()) {
        if !bsp.planes.get(face.plane as usize).is_some_and(is_usable) {
            warnings.add(WarningKind::Plane, "", || {
                format!(
                    "face {index} has the unusable plane {}: its normal comes from its vertices",
                    face.plane
                )
            });
        }
        let Some(texinfo) = bsp.face_texinfo(face) else {
            warnings.add(WarningKind::Texinfo, "index", || {
                format!(
                    "face {index} refers to texinfo {} of {}: its texture is missing",
                    face.texinfo,
                    bsp.texinfos.len()
                )
            });
            continue;
        };
        if bsp.face_texture(face).is_none() {
            warnings.add(WarningKind::TextureMissing, "face", || {
                format!(
                    "face {index} has texture {}, which is missing",
                    texinfo.miptex
                )
            });
        }
        let axes = texinfo.s.iter().chain(&texinfo.t);
        let is_zero = |axis: &[f32; 4]| axis.iter().take(3).all(|&c| c == 0.0);
        if is_zero(&texinfo.s) || is_zero(&texinfo.t) || !axes.clone().all(|c| c.is_finite()) {
            warnings.add(WarningKind::Texinfo, "axes", || {
                format!(
                    "texinfo {} of face {index} has unusable axes: coordinates are 0",
                    face.texinfo
                )
            });
        }
    }
}

/// Start and length cut to a table of `len` entries, and whether that changed them.
fn cut(first: u32, count: u32, len: usize) -> (u32, u32, bool) {
    let len = u32::try_from(len).unwrap_or(u32::MAX);
    let start = first.min(len);
    let n = count.min(len - start);
    (start, n, (start, n) != (first, count) && count != 0)
}

fn models(bsp: &mut Bsp, warnings: &mut Warnings) {
    let faces = bsp.faces.len();
    for (index, model) in bsp.models.iter_mut().enumerate() {
        let (first, count, bad) = cut(model.first_face, model.num_faces, faces);
        if bad {
            warnings.add(WarningKind::ModelRange, "", || {
                format!(
                    "model {index} claims {} faces from {} of {faces}: cut to what is there",
                    model.num_faces, model.first_face
                )
            });
        }
        (model.first_face, model.num_faces) = (first, count);
    }
}

pub(super) fn leafs(bsp: &mut Bsp, warnings: &mut Warnings) {
    let marks = bsp.marksurfaces.len();
    let count = bsp.leafs.len();
    if bsp.format == super::Format::Bsp29 && count > MAX_LEAFS_29 {
        warnings.add(WarningKind::LeafCount, "", || {
            format!("{count} leafs: original engines take at most {MAX_LEAFS_29} in version 29")
        });
    }
    for (index, leaf) in bsp.leafs.iter_mut().enumerate() {
        let (first, num, bad) = cut(leaf.first_mark, leaf.num_marks, marks);
        if bad {
            warnings.add(WarningKind::Marksurface, "range", || {
                format!(
                    "leaf {index} claims {} marksurfaces from {} of {marks}: cut to what is there",
                    leaf.num_marks, leaf.first_mark
                )
            });
        }
        (leaf.first_mark, leaf.num_marks) = (first, num);
    }
    let faces = bsp.faces.len();
    let bad = bsp
        .marksurfaces
        .iter()
        .filter(|&&m| m as usize >= faces)
        .count();
    warnings.add_many(WarningKind::Marksurface, "face", bad as u64, || {
        format!("a marksurface refers to a face beyond the {faces} there are and is passed over")
    });
}

fn trees(bsp: &mut Bsp, warnings: &mut Warnings) {
    let planes = bsp.planes.len();
    let usable = |plane: u32| bsp.planes.get(plane as usize).is_some_and(is_split);
    let child = |child: NodeChild| match child {
        NodeChild::Node(n) => Some(n),
        NodeChild::Leaf(_) => None,
    };
    let bad_nodes = unwalkable(bsp.nodes.len(), |i| {
        let node = bsp.nodes.get(i as usize)?;
        usable(node.plane).then(|| node.children.map(child))
    });
    let bad_clipnodes = unwalkable(bsp.clipnodes.len(), |i| {
        let node = bsp.clipnodes.get(i as usize)?;
        usable(node.plane).then(|| node.children.map(|c| u32::try_from(c).ok()))
    });
    for (name, bad) in [("node", &bad_nodes), ("clipnode", &bad_clipnodes)] {
        let count = bad.iter().filter(|&&b| b).count() as u64;
        warnings.add_many(WarningKind::Tree, name, count, || {
            format!(
                "a {name} leads into a loop, too deep, or to a plane that is not usable ({planes} \
                 planes): the tree above it is not walked"
            )
        });
    }
    bsp.bad_nodes = bad_nodes;
    bsp.bad_clipnodes = bad_clipnodes;
}

/// Trees deeper than this are not walked: compilers make them a few dozen to a few hundred deep,
/// and each query costs the depth.
const MAX_DEPTH: u16 = 4096;

/// For each node of a graph, whether it is too deep, or a loop or a bad node (`children` gives `None`) can be reached
/// from it. One depth-first pass without recursion: a node that reaches a loop either meets a node
/// still open, or one already found bad.
fn unwalkable(count: usize, children: impl Fn(u32) -> Option<[Option<u32>; 2]>) -> Vec<bool> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Good,
        Bad,
    }
    let mut state = vec![State::New; count];
    // Steps from each finished node down to its farthest leaf.
    let mut height = vec![0_u16; count];
    // Node, next child to visit, whether something bad was met below.
    let mut stack: Vec<(u32, usize, bool)> = Vec::new();
    for root in (0_u32..).take(count) {
        if state.get(root as usize) != Some(&State::New) {
            continue;
        }
        stack.push((root, 0, false));
        while let Some((node, next, bad)) = stack.last_mut() {
            let id = *node as usize;
            let Some(slots) = children(*node) else {
                set(&mut state, id, State::Bad);
                stack.pop();
                mark(&mut stack, true);
                continue;
            };
            set(&mut state, id, State::Open);
            if let Some(slot) = slots.get(*next) {
                *next += 1;
                let Some(child) = *slot else { continue };
                match state.get(child as usize) {
                    Some(State::New) => stack.push((child, 0, false)),
                    Some(State::Good) => {}
                    _ => *bad = true,
                }
            } else {
                let below = slots
                    .iter()
                    .flatten()
                    .filter_map(|&c| height.get(c as usize));
                let own = below.max().map_or(0, |&h| h.saturating_add(1));
                let bad = *bad || own > MAX_DEPTH;
                set(&mut height, id, own);
                set(&mut state, id, if bad { State::Bad } else { State::Good });
                stack.pop();
                mark(&mut stack, bad);
            }
        }
    }
    fn set<T>(state: &mut [T], at: usize, to: T) {
        if let Some(s) = state.get_mut(at) {
            *s = to;
        }
    }
    fn mark(stack: &mut [(u32, usize, bool)], bad: bool) {
        if let Some((_, _, flag)) = stack.last_mut() {
            *flag |= bad;
        }
    }
    state.into_iter().map(|s| s == State::Bad).collect()
}
