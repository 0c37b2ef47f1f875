//! Polygons into triangles.

use glam::DVec2;

/// Cost of a triangle that has no area or is turned over: more than all good ones together, yet
/// finite, so that even a polygon without a good triangulation gets one and its border stays whole.
const BAD: f64 = 1e9;

/// Polygons with more corners are halved first: the search takes time with the cube of the corners.
const SEARCH_LIMIT: usize = 64;

/// Ways to halve a large polygon that are compared.
const HALVINGS: usize = 16;

/// Triangulates a counter-clockwise polygon that is convex but for rounding, and may have corners
/// on its straight edges. Returns `n - 2` triangles of corner indices, counter-clockwise.
///
/// Every corner and every edge of the border is used as it is, so neighbours that share an edge
/// still share it. Among all triangulations the one with the smallest sum of inverse heights is
/// taken (dynamic programming, Klincsek 1980), which avoids slivers wherever that is possible.
pub fn triangulate(polygon: &[DVec2]) -> Vec<[usize; 3]> {
    let n = polygon.len();
    let mut out = Vec::with_capacity(n.saturating_sub(2));
    match n {
        0..3 => {}
        3 => out.push([0, 1, 2]),
        _ => {
            let corners: Vec<usize> = (0..n).collect();
            halve(polygon, &corners, &mut out);
        }
    }
    out
}

fn halve(polygon: &[DVec2], corners: &[usize], out: &mut Vec<[usize; 3]>) {
    let n = corners.len();
    if n <= SEARCH_LIMIT {
        return search(polygon, corners, out);
    }
    let area = |part: &[usize]| {
        let p = |i: usize| polygon[part[i]] - polygon[part[0]];
        (1..part.len() - 1)
            .map(|i| p(i).perp_dot(p(i + 1)))
            .sum::<f64>()
    };
    let half = n / 2;
    let cut = |i: usize| {
        let rotated: Vec<usize> = (0..n).map(|k| corners[(i + k) % n]).collect();
        let first = rotated[..=half].to_vec();
        let mut second = rotated[half..].to_vec();
        second.push(rotated[0]);
        let diagonal = polygon[first[0]].distance(polygon[first[half]]);
        let worth = area(&first).min(area(&second)) / diagonal.max(1e-9);
        (worth, first, second)
    };
    let best = (0..HALVINGS.min(n - half))
        .map(|k| cut(k * (n - half) / HALVINGS.min(n - half)))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((_, first, second)) = best {
        halve(polygon, &first, out);
        halve(polygon, &second, out);
    }
}

/// Inverse height of a triangle over its longest side.
fn cost(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let twice_area = (b - a).perp_dot(c - a);
    let longest2 = a
        .distance_squared(b)
        .max(b.distance_squared(c))
        .max(c.distance_squared(a));
    let longest = longest2.sqrt();
    // A height below a millionth of the side is rounding.
    if twice_area <= 1e-6 * longest2 {
        return BAD * (1.0 + (-twice_area / longest.max(1e-9)).max(0.0));
    }
    longest / twice_area
}

fn search(polygon: &[DVec2], corners: &[usize], out: &mut Vec<[usize; 3]>) {
    let n = corners.len();
    let at = |i: usize| polygon[corners[i]];
    // best[i * n + j]: cost of the part from corner i to corner j, and the corner that makes the
    // triangle on its closing edge.
    let mut best = vec![(0.0_f64, 0_u8); n * n];
    for gap in 2..n {
        for i in 0..n - gap {
            let j = i + gap;
            let mut least = (f64::INFINITY, 0);
            for k in i + 1..j {
                let sides = best[i * n + k].0 + best[k * n + j].0;
                if sides >= least.0 {
                    continue;
                }
                let total = sides + cost(at(i), at(k), at(j));
                if total < least.0 {
                    least = (total, k as u8);
                }
            }
            best[i * n + j] = least;
        }
    }
    let mut stack = vec![(0, n - 1)];
    while let Some((i, j)) = stack.pop() {
        if j - i < 2 {
            continue;
        }
        let k = usize::from(best[i * n + j].1);
        out.push([corners[i], corners[k], corners[j]]);
        stack.extend([(i, k), (k, j)]);
    }
}
