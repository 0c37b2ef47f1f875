//! The watertight test of a ray against a triangle.
//!
//! Woop, Benthin, Wald: "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013. The ray is
//! sheared onto an axis; three edge functions of the projected corners then decide. Two triangles
//! that share an edge compute the same products for it, with opposite signs, and rounding to
//! nearest keeps the order of the two products: the sign of an edge function is right or the
//! function is zero. Zero counts as inside for both, so a ray at a shared edge meets at least one
//! of them and a closed mesh loses no ray. Plain multiplications are essential; a fused one would
//! break the symmetry.

use glam::DVec3;

/// A triangle as the traversal reads it: corners in world space, each with one spare lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(16))]
pub struct PackedTriangle {
    corners: [[f32; 4]; 3],
}

impl PackedTriangle {
    /// Packs three corners and says whether a hit must pass the alpha test.
    pub fn new(corners: [[f32; 3]; 3], alpha_tested: bool) -> Self {
        let flag = if alpha_tested { 1.0 } else { 0.0 };
        Self {
            corners: corners.map(|[x, y, z]| [x, y, z, flag]),
        }
    }

    /// The corners, exact.
    pub fn corners(&self) -> [DVec3; 3] {
        self.corners
            .map(|[x, y, z, _]| DVec3::new(f64::from(x), f64::from(y), f64::from(z)))
    }

    /// Whether a hit must pass the alpha test.
    #[inline]
    pub fn alpha_tested(&self) -> bool {
        self.corners[0][3] != 0.0
    }
}

/// A ray prepared for the test.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, world space.
    pub origin: DVec3,
    /// Unit direction, world space.
    pub direction: DVec3,
    /// Axes in the order x, y, z of the sheared space; z is the direction's largest component.
    axes: [usize; 3],
    /// The shear's x, y and scale of z.
    shear: DVec3,
    /// The origin with its axes in the sheared order.
    permuted: DVec3,
}

impl Ray {
    /// Prepares a ray from `origin` in the unit direction `direction`.
    #[inline]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let a = direction.abs();
        let kz = if a.x > a.y {
            if a.x > a.z { 0 } else { 2 }
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (mut kx, mut ky) = [(1, 2), (2, 0), (0, 1)][kz];
        let (d, o) = (direction.to_array(), origin.to_array());
        // Keeps the winding, so that the sign of the determinant tells the side.
        if d[kz] < 0.0 {
            (kx, ky) = (ky, kx);
        }
        let scale = 1.0 / d[kz];
        Self {
            origin,
            direction,
            axes: [kx, ky, kz],
            shear: DVec3::new(d[kx] * scale, d[ky] * scale, scale),
            permuted: DVec3::new(o[kx], o[ky], o[kz]),
        }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug)]
pub struct TriangleHit {
    /// Distance along the ray.
    pub t: f64,
    /// Weights of the three corners; they sum to 1 and none is negative.
    pub weights: [f64; 3],
    /// Whether the corners are counter-clockwise as seen from the ray's origin.
    pub counter_clockwise: bool,
}

/// The hit of `ray` with `triangle` at a distance in `0 < t < t_max`, from either side.
#[inline(always)]
pub fn intersect(ray: &Ray, triangle: &PackedTriangle, t_max: f64) -> Option<TriangleHit> {
    // Masks with 3 instead of a bounds check; the fourth lane is never chosen.
    let [kx, ky, kz] = ray.axes.map(|k| k & 3);
    let sheared = |c: &[f32; 4]| {
        let z = f64::from(c[kz]) - ray.permuted.z;
        let x = f64::from(c[kx]) - ray.permuted.x - ray.shear.x * z;
        let y = f64::from(c[ky]) - ray.permuted.y - ray.shear.y * z;
        (x, y, z)
    };
    let (ax, ay, az) = sheared(&triangle.corners[0]);
    let (bx, by, bz) = sheared(&triangle.corners[1]);
    let (cx, cy, cz) = sheared(&triangle.corners[2]);
    let u = cx * by - cy * bx;
    let v = ax * cy - ay * cx;
    let w = bx * ay - by * ax;
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let det = u + v + w;
    let inverse = 1.0 / det;
    let t = (u * az + v * bz + w * cz) * ray.shear.z * inverse;
    // Also false if the determinant is 0 (edge-on) and `t` therefore not a number or infinite.
    if !(t > 0.0 && t < t_max && det != 0.0) {
        return None;
    }
    Some(TriangleHit {
        t,
        weights: [u * inverse, v * inverse, w * inverse],
        counter_clockwise: det > 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f32; 3]; 3]) -> PackedTriangle {
        PackedTriangle::new(corners, false)
    }

    #[test]
    fn distance_weights_and_side_are_right_along_every_axis() {
        for axis in 0..3 {
            // Counter-clockwise seen from the positive axis.
            let turn = |p: [f32; 3]| {
                let mut q = [0.0; 3];
                (0..3).for_each(|i| q[(i + axis + 1) % 3] = p[i]);
                q
            };
            let t = triangle([[0., 0., 1.], [4., 0., 1.], [0., 4., 1.]].map(turn));
            for (from, front) in [(5.0, true), (-5.0, false)] {
                let o = DVec3::from_array(turn([1.0, 2.0, from]).map(f64::from));
                let d = DVec3::from_array(turn([0.0, 0.0, -from.signum()]).map(f64::from));
                let hit = intersect(&Ray::new(o, d), &t, 100.0).unwrap();
                assert_eq!(hit.t, (f64::from(from) - 1.0).abs());
                assert_eq!(hit.weights, [0.25, 0.25, 0.5]);
                assert_eq!(hit.counter_clockwise, front, "axis {axis} from {from}");
                assert!(intersect(&Ray::new(o, -d), &t, 100.0).is_none());
                assert!(intersect(&Ray::new(o, d), &t, hit.t).is_none());
            }
        }
    }

    #[test]
    fn a_ray_at_a_shared_corner_or_edge_meets_the_fan() {
        // A fan with coordinates that are not exact sums; rays aimed at its centre and at points
        // of its spokes must meet at least one triangle.
        let n = 7;
        let centre = [0.1_f32, 0.2, 0.3];
        let rim: Vec<[f32; 3]> = (0..n)
            .map(|i| {
                let a = i as f32 / n as f32 * std::f32::consts::TAU;
                [
                    0.1 + a.cos() * 3.3,
                    0.2 + a.sin() * 3.3,
                    0.3 + 0.17 * a.sin(),
                ]
            })
            .collect();
        let fan: Vec<_> = (0..n)
            .map(|i| triangle([centre, rim[i], rim[(i + 1) % n]]))
            .collect();
        let at = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
        for i in 0..20_000 {
            let k = f64::from(i);
            let origin = DVec3::new((k * 0.377).sin() * 2.0, (k * 0.771).cos() * 2.0, 5.0);
            let along = (k * 0.618) % 1.0 * 0.99;
            let target = at(centre).lerp(at(rim[i as usize % n]), along);
            let ray = Ray::new(origin, (target - origin).normalize());
            assert!(
                fan.iter().any(|t| intersect(&ray, t, 1e3).is_some()),
                "lost ray {i}"
            );
        }
    }
}
