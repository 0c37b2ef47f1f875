//! Liquid surfaces: compilers write each twice, once for each side. A path tracer wants one
//! interface, or light would be sampled twice from the same place.

use super::geometry::FacePolygon;
use glam::{DVec2, DVec3};

/// Faces whose planes are this close (world units) lie in one plane.
const SAME_PLANE: f64 = 0.05;
/// A face is a twin if this part of it is covered by faces that look the other way. The two sides
/// are often cut up differently, but cover the same.
const COVERED: f64 = 0.5;
/// Most pairs of faces compared; real levels have less than a million. Beyond, all faces stay.
const MAX_PAIRS: usize = 1 << 24;

/// A liquid face in its plane.
struct Flat {
    index: usize,
    /// Whether it looks along the plane's normal.
    front: bool,
    /// Counter-clockwise seen along the plane's normal from the front.
    points: Vec<DVec2>,
    area: f64,
    lo: DVec2,
    hi: DVec2,
}

/// For each polygon, whether it is the back of a liquid surface whose other side is there. Of the
/// two sides of a plane the one with more area stays, then the one with the first face.
pub fn twins(polygons: &[FacePolygon]) -> Vec<bool> {
    let mut out = vec![false; polygons.len()];
    let mut liquids: Vec<(DVec3, f64, usize)> = polygons
        .iter()
        .enumerate()
        .filter(|(_, p)| p.liquid)
        .map(|(i, p)| {
            let normal = canonical(p.normal);
            let n = p.points.len().max(1) as f64;
            let centre: DVec3 = p.points.iter().map(|q| q.as_dvec3()).sum::<DVec3>() / n;
            (normal, normal.dot(centre), i)
        })
        .collect();
    let direction = |n: DVec3| (n * 1000.0).round().as_ivec3().to_array();
    liquids.sort_by(|a, b| {
        direction(a.0)
            .cmp(&direction(b.0))
            .then(a.1.total_cmp(&b.1))
            .then(a.2.cmp(&b.2))
    });
    let mut pairs = 0;
    for plane in
        liquids.chunk_by(|a, b| direction(a.0) == direction(b.0) && (a.1 - b.1).abs() <= SAME_PLANE)
    {
        let (x, y) = plane[0].0.any_orthonormal_pair();
        let faces: Vec<Flat> = plane
            .iter()
            .map(|&(normal, _, index)| flatten(&polygons[index], index, normal, x, y))
            .collect();
        let area = |front| -> f64 {
            (faces.iter().filter(|f| f.front == front))
                .map(|f| f.area)
                .sum()
        };
        let (fronts, backs) = (area(true), area(false));
        let first = faces.iter().min_by_key(|f| f.index);
        // Equal but for rounding: the first face decides.
        let keep_front = if (fronts - backs).abs() <= 1e-6 * (fronts + backs) {
            first.is_none_or(|f| f.front)
        } else {
            fronts > backs
        };
        let kept: Vec<&Flat> = faces.iter().filter(|f| f.front == keep_front).collect();
        for face in faces.iter().filter(|f| f.front != keep_front) {
            pairs += kept.len();
            if pairs > MAX_PAIRS {
                return out;
            }
            let covered: f64 = kept.iter().map(|k| overlap(face, k)).sum();
            out[face.index] = covered >= COVERED * face.area;
        }
    }
    out
}

/// The normal or its opposite, so that both sides of a plane agree.
fn canonical(n: DVec3) -> DVec3 {
    let largest = n.abs().max_element();
    let leads = n.to_array().into_iter().find(|c| c.abs() == largest);
    if leads.is_some_and(|c| c < 0.0) {
        -n
    } else {
        n
    }
}

fn flatten(polygon: &FacePolygon, index: usize, normal: DVec3, x: DVec3, y: DVec3) -> Flat {
    let mut points: Vec<DVec2> = polygon
        .points
        .iter()
        .map(|p| DVec2::new(p.as_dvec3().dot(x), p.as_dvec3().dot(y)))
        .collect();
    let front = polygon.normal.dot(normal) > 0.0;
    if !front {
        points.reverse();
    }
    Flat {
        index,
        front,
        area: area(&points),
        lo: points.iter().copied().fold(DVec2::INFINITY, DVec2::min),
        hi: points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max),
        points,
    }
}

fn area(points: &[DVec2]) -> f64 {
    let Some(&o) = points.first() else { return 0.0 };
    points
        .windows(2)
        .map(|w| (w[0] - o).perp_dot(w[1] - o))
        .sum::<f64>()
        / 2.0
}

/// Area of the intersection of two convex counter-clockwise polygons (Sutherland and Hodgman 1974).
fn overlap(a: &Flat, b: &Flat) -> f64 {
    if a.lo.cmpgt(b.hi).any() || b.lo.cmpgt(a.hi).any() {
        return 0.0;
    }
    let mut rest = a.points.clone();
    for (i, &p) in b.points.iter().enumerate() {
        let q = b.points[(i + 1) % b.points.len()];
        let height = |c: DVec2| (q - p).perp_dot(c - p);
        let mut inside = Vec::with_capacity(rest.len() + 1);
        for (k, &u) in rest.iter().enumerate() {
            let v = rest[(k + 1) % rest.len()];
            let (hu, hv) = (height(u), height(v));
            if hu >= 0.0 {
                inside.push(u);
            }
            if (hu >= 0.0) != (hv >= 0.0) {
                inside.push(u.lerp(v, hu / (hu - hv)));
            }
        }
        rest = inside;
        if rest.len() < 3 {
            return 0.0;
        }
    }
    area(&rest)
}
