//! Convex polygons ("windings"): vertices in clockwise order as seen from the front.

use crate::math::{Plane, Vec3, add, cross, dot, scale, sub};

/// How far, in Quake units, a point may be from a plane and still count as on it.
pub(crate) const ON_EPS: f64 = 0.01;

/// Half the side of the square that stands for an endless plane, in Quake units.
const HUGE: f64 = 65536.0;

/// A convex polygon.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Winding(pub(crate) Vec<Vec3>);

impl Winding {
    /// A huge square on the plane, clockwise seen from the plane's front.
    pub(crate) fn on_plane(plane: &Plane) -> Self {
        let n = plane.normal;
        let major = (0..3).fold(0, |m, i| if n[i].abs() > n[m].abs() { i } else { m });
        let mut up = if major == 2 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 0.0, 1.0]
        };
        up = sub(up, scale(n, dot(up, n)));
        let l = dot(up, up).sqrt();
        up = scale(up, HUGE / l);
        let right = cross(up, n);
        let org = scale(n, plane.dist);
        Self(vec![
            add(sub(org, right), up),
            add(add(org, right), up),
            sub(add(org, right), up),
            sub(sub(org, right), up),
        ])
    }

    pub(crate) fn reversed(&self) -> Self {
        Self(self.0.iter().rev().copied().collect())
    }

    /// Largest and smallest signed distance of the vertices from the plane.
    pub(crate) fn extent(&self, plane: &Plane) -> (f64, f64) {
        self.0
            .iter()
            .fold((f64::NEG_INFINITY, f64::INFINITY), |(hi, lo), p| {
                let d = plane.distance(*p);
                (hi.max(d), lo.min(d))
            })
    }

    /// Splits by a plane into the parts in front of and behind it. A polygon that lies on the
    /// plane (within `eps`) gives `(None, None)`.
    pub(crate) fn split(&self, plane: &Plane, eps: f64) -> (Option<Self>, Option<Self>) {
        let dists: Vec<f64> = self.0.iter().map(|p| plane.distance(*p)).collect();
        let any_front = dists.iter().any(|d| *d > eps);
        let any_back = dists.iter().any(|d| *d < -eps);
        match (any_front, any_back) {
            (false, false) => return (None, None),
            (true, false) => return (Some(self.clone()), None),
            (false, true) => return (None, Some(self.clone())),
            (true, true) => {}
        }
        let (mut front, mut back) = (Vec::new(), Vec::new());
        let n = self.0.len();
        for i in 0..n {
            let (p, d) = (self.0[i], dists[i]);
            let (q, e) = (self.0[(i + 1) % n], dists[(i + 1) % n]);
            if d > -eps {
                front.push(p);
            }
            if d < eps {
                back.push(p);
            }
            if (d >= eps && e <= -eps) || (d <= -eps && e >= eps) {
                // Always interpolate from the front end, so that both neighbours of an edge
                // find the very same point.
                let (a, b, da, db) = if d > e { (p, q, d, e) } else { (q, p, e, d) };
                let t = da / (da - db);
                let mut mid = [0.0; 3];
                for k in 0..3 {
                    mid[k] = match plane.normal[k] {
                        1.0 => plane.dist,
                        -1.0 => -plane.dist,
                        _ => a[k] + t * (b[k] - a[k]),
                    };
                }
                front.push(mid);
                back.push(mid);
            }
        }
        let wrap = |v: Vec<Vec3>| (v.len() >= 3).then_some(Self(v));
        (wrap(front), wrap(back))
    }

    /// The part behind the plane. A polygon on the plane is kept only if `keep_on`.
    pub(crate) fn clip_back(&self, plane: &Plane, eps: f64, keep_on: bool) -> Option<Self> {
        match self.split(plane, eps) {
            (None, None) => keep_on.then(|| self.clone()),
            (_, back) => back,
        }
    }

    pub(crate) fn area(&self) -> f64 {
        let p = &self.0;
        let mut sum = [0.0; 3];
        for i in 2..p.len() {
            sum = add(sum, cross(sub(p[i - 1], p[0]), sub(p[i], p[0])));
        }
        0.5 * dot(sum, sum).sqrt()
    }
}
