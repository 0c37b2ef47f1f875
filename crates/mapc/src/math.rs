//! Small f64 vector arithmetic, planes and their pool.
//!
//! All geometry is compiled in f64 and rounded to f32 once, when the file is written.

/// A point or direction in Quake units: X, Y, Z with Z up.
pub type Vec3 = [f64; 3];

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn scale(a: Vec3, s: f64) -> Vec3 {
    [a[0] * s, a[1] * s, a[2] * s]
}

pub(crate) fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// The unit vector along `a`, or `None` when `a` is (nearly) zero.
pub(crate) fn normalize(a: Vec3) -> Option<Vec3> {
    let l = length(a);
    (l > 1e-9).then(|| scale(a, 1.0 / l))
}

/// An axis-aligned box in Quake units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub mins: Vec3,
    /// Largest coordinates.
    pub maxs: Vec3,
}

impl Bounds {
    /// The empty box: every point added to it widens it.
    pub(crate) const EMPTY: Self = Self {
        mins: [f64::INFINITY; 3],
        maxs: [f64::NEG_INFINITY; 3],
    };

    pub(crate) fn add(&mut self, p: Vec3) {
        for ((lo, hi), v) in self.mins.iter_mut().zip(&mut self.maxs).zip(p) {
            *lo = lo.min(v);
            *hi = hi.max(v);
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.add_if_valid(other.mins);
        self.add_if_valid(other.maxs);
    }

    fn add_if_valid(&mut self, p: Vec3) {
        if p.iter().all(|v| v.is_finite()) {
            self.add(p);
        }
    }

    pub(crate) fn of<'a>(points: impl IntoIterator<Item = &'a Vec3>) -> Self {
        let mut b = Self::EMPTY;
        for p in points {
            b.add(*p);
        }
        b
    }

    /// Do the boxes touch when both are grown by `eps`?
    pub(crate) fn touches(&self, other: &Self, eps: f64) -> bool {
        (0..3).all(|i| self.mins[i] <= other.maxs[i] + eps && other.mins[i] <= self.maxs[i] + eps)
    }
}

/// The plane `dot(normal, p) = dist`; `normal` has length 1 and points to the front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vec3,
    /// Signed distance of the plane from the origin along the normal, in Quake units.
    pub dist: f64,
}

impl Plane {
    /// The plane through three points listed clockwise as seen from its front (the order of
    /// `.map` files); `None` when they are (nearly) collinear.
    pub(crate) fn from_points(p: &[Vec3; 3]) -> Option<Self> {
        let normal = normalize(cross(sub(p[0], p[1]), sub(p[2], p[1])))?;
        Some(Self {
            normal,
            dist: dot(normal, p[1]),
        })
    }

    pub(crate) fn distance(&self, p: Vec3) -> f64 {
        dot(self.normal, p) - self.dist
    }

    pub(crate) fn flipped(&self) -> Self {
        Self {
            normal: scale(self.normal, -1.0),
            dist: -self.dist,
        }
    }

    /// The axis (0, 1, 2) of a plane whose normal is exactly along it, if any.
    pub(crate) fn axis(&self) -> Option<usize> {
        (0..3).find(|&i| self.normal[i].abs() == 1.0)
    }

    /// Snaps a nearly axial normal to the axis and a nearly whole distance to the whole number,
    /// so that planes meant to be one become one.
    fn snapped(mut self) -> Self {
        for i in 0..3 {
            if (self.normal[i].abs() - 1.0).abs() < 1e-9 {
                let s = self.normal[i].signum();
                self.normal = [0.0; 3];
                self.normal[i] = s;
            }
        }
        if (self.dist - self.dist.round()).abs() < 1e-4 && self.axis().is_some() {
            self.dist = self.dist.round();
        }
        // No negative zeros: the file must not depend on how a plane was written.
        for n in &mut self.normal {
            *n += 0.0;
        }
        self.dist += 0.0;
        self
    }
}

/// All planes of a map. Planes come in pairs: `2k` faces along its largest normal component,
/// `2k + 1` is its opposite; so `index ^ 1` flips a plane and `index & !1` names the pair.
#[derive(Debug, Default)]
pub(crate) struct PlaneSet {
    planes: Vec<Plane>,
}

impl PlaneSet {
    pub(crate) fn find_or_add(&mut self, plane: Plane) -> usize {
        let plane = plane.snapped();
        let found = self.planes.iter().position(|p| {
            (p.dist - plane.dist).abs() < 1e-3
                && (0..3).all(|i| (p.normal[i] - plane.normal[i]).abs() < 1e-6)
        });
        if let Some(i) = found {
            return i;
        }
        let n = plane.normal;
        let major = (0..3).fold(0, |m, i| if n[i].abs() > n[m].abs() + 1e-9 { i } else { m });
        let positive = n[major] > 0.0;
        let first = self.planes.len();
        let (a, b) = if positive {
            (plane, plane.flipped())
        } else {
            (plane.flipped(), plane)
        };
        self.planes.push(a.snapped());
        self.planes.push(b.snapped());
        first + usize::from(!positive)
    }

    pub(crate) fn get(&self, index: usize) -> Plane {
        self.planes[index]
    }
}
