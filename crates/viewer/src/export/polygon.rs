//! Convex polygons with texture coordinates: clipped to rectangles of texels, cut up evenly.

use super::PlacedTriangle;
use glam::{DVec2, DVec3};

/// A corner: a place, and its texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Place, world units.
    pub p: DVec3,
    /// Texture coordinates, texels.
    pub uv: DVec2,
}

impl Corner {
    fn lerp(self, other: Self, t: f64) -> Self {
        Self {
            p: self.p.lerp(other.p, t),
            uv: self.uv.lerp(other.uv, t),
        }
    }
}

/// The corners of a triangle.
pub fn corners(triangle: &PlacedTriangle) -> [Corner; 3] {
    std::array::from_fn(|i| Corner {
        p: triangle.p[i],
        uv: triangle.uv[i],
    })
}

/// The part of a convex polygon whose texture coordinates lie in `lo..=hi` (Sutherland and Hodgman
/// 1974). Texture coordinates are an affine function of the place, so this is exact but for
/// rounding; empty if nothing with an area is left.
pub fn clip(polygon: &[Corner], lo: DVec2, hi: DVec2) -> Vec<Corner> {
    let sides: [(usize, f64, f64); 4] = [
        (0, lo.x, 1.0),
        (0, hi.x, -1.0),
        (1, lo.y, 1.0),
        (1, hi.y, -1.0),
    ];
    let mut rest = polygon.to_vec();
    for (axis, at, sign) in sides {
        let height = |c: &Corner| (c.uv[axis] - at) * sign;
        let mut kept = Vec::with_capacity(rest.len() + 1);
        for (i, a) in rest.iter().enumerate() {
            let b = &rest[(i + 1) % rest.len()];
            let (ha, hb) = (height(a), height(b));
            if ha >= 0.0 {
                kept.push(*a);
            }
            if (ha > 0.0 && hb < 0.0) || (ha < 0.0 && hb > 0.0) {
                // From the same end whichever way the edge is walked, so that neighbours agree.
                let mut cut = if ha > 0.0 {
                    a.lerp(*b, ha / (ha - hb))
                } else {
                    b.lerp(*a, hb / (hb - ha))
                };
                cut.uv[axis] = at;
                kept.push(cut);
            }
        }
        rest = kept;
        if rest.len() < 3 {
            return Vec::new();
        }
    }
    if area(&rest) > 0.0 { rest } else { Vec::new() }
}

/// Area of a convex polygon in squared world units.
pub fn area(polygon: &[Corner]) -> f64 {
    fan(polygon)
        .map(|[a, b, c]| (b.p - a.p).cross(c.p - a.p).length() / 2.0)
        .sum()
}

/// A convex polygon as triangles.
pub fn fan(polygon: &[Corner]) -> impl Iterator<Item = [Corner; 3]> + '_ {
    let first = polygon.first().copied();
    polygon
        .get(1..)
        .unwrap_or_default()
        .windows(2)
        .filter_map(move |w| Some([first?, w[0], w[1]]))
}

/// Cuts a triangle in halves until no edge is longer than `step` in texture coordinates. Edges are
/// cut in the middle and only for their own length, so that neighbours get the same points.
pub fn subdivide(triangle: [Corner; 3], step: f64, emit: &mut impl FnMut([Corner; 3])) {
    /// Halvings of one edge; enough for coordinates of any size that is left after them.
    const DEEPEST: usize = 64;
    let mut stack = vec![(triangle, 0)];
    while let Some(([a, b, c], depth)) = stack.pop() {
        let lengths = [(a, b), (b, c), (c, a)].map(|(u, v)| u.uv.distance(v.uv));
        let longest = (0..3).fold(
            0,
            |best, i| if lengths[i] > lengths[best] { i } else { best },
        );
        let is_long = lengths[longest] > step;
        if !is_long || depth > DEEPEST {
            emit([a, b, c]);
            continue;
        }
        let [a, b, c] = match longest {
            0 => [a, b, c],
            1 => [b, c, a],
            _ => [c, a, b],
        };
        let middle = a.lerp(b, 0.5);
        stack.push(([middle, b, c], depth + 1));
        stack.push(([a, middle, c], depth + 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(x: f64, y: f64) -> Corner {
        Corner {
            p: DVec3::new(x, 2.0 * y, x + y),
            uv: DVec2::new(x, y),
        }
    }

    const fn v(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    #[test]
    fn pieces_of_a_triangle_make_up_the_triangle() {
        let triangle = [corner(-3.3, -1.0), corner(9.1, 0.2), corner(2.0, 7.7)];
        let whole = area(&triangle);
        let mut sum = 0.0;
        for y in -2..9 {
            for x in -5..11 {
                let (x, y) = (f64::from(x), f64::from(y));
                let piece = clip(&triangle, v(x, y), v(x + 1.0, y + 1.0));
                for c in &piece {
                    assert!((c.uv.x - x - 0.5).abs() < 0.5 + 1e-12, "{c:?}");
                    assert!((c.uv.y - y - 0.5).abs() < 0.5 + 1e-12, "{c:?}");
                    // Place and coordinates stay together.
                    assert!((c.p - corner(c.uv.x, c.uv.y).p).length() < 1e-12);
                }
                sum += area(&piece);
            }
        }
        assert!((sum / whole - 1.0).abs() < 1e-12, "{sum} of {whole}");
    }

    #[test]
    fn a_rectangle_inside_stays_whole_and_one_outside_is_empty() {
        let triangle = [corner(0.0, 0.0), corner(100.0, 0.0), corner(0.0, 100.0)];
        assert_eq!(clip(&triangle, v(10.0, 10.0), v(20.0, 30.0)).len(), 4);
        assert!(clip(&triangle, v(60.0, 60.0), v(70.0, 70.0)).is_empty());
        assert!(clip(&triangle, v(-10.0, 0.0), v(0.0, 50.0)).is_empty());
    }

    #[test]
    fn halves_keep_the_area_and_the_orientation() {
        let triangle = [corner(0.0, 0.0), corner(30.0, 0.0), corner(0.0, 17.0)];
        let front = |[a, b, c]: [Corner; 3]| (b.p - a.p).cross(c.p - a.p);
        let (mut sum, mut count) = (0.0, 0);
        subdivide(triangle, 2.0, &mut |t| {
            assert!(front(t).dot(front(triangle)) > 0.0);
            assert!(t[0].uv.distance(t[1].uv) <= 2.0);
            sum += area(&t);
            count += 1;
        });
        assert!((sum / area(&triangle) - 1.0).abs() < 1e-12);
        assert!(count > 30 * 17 / 4);
        // Coordinates that are no numbers do not go on for ever.
        let mut odd = triangle;
        odd[1].uv.x = f64::NAN;
        subdivide(odd, 2.0, &mut |_| {});
    }
}
