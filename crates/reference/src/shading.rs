//! Sampling, weights and light, as small functions of plain values.
//!
//! A distribution comes as up to three verbs: `sample_*` turns uniform numbers in `0..1` into a
//! sample, `pdf_*` gives the density it was chosen with, `eval_*` the function it is chosen for.
//! Densities are per steradian (solid angle) or per squared world unit (area), as each one says.

use glam::{DVec2, DVec3};
use scene::{Sun, Texture, light::Spot};
use std::f64::consts::{FRAC_1_PI, PI, TAU};

pub use scene::material::{srgb_to_linear, warp};
pub use scene::sky::scroll_uv;

/// A uniform point on the unit sphere (Archimedes).
#[must_use]
pub fn sample_sphere(u: [f64; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u[1]).sin_cos();
    DVec3::new(r * cos, r * sin, z)
}

/// A direction about the unit vector `n`, distributed like the cosine: `n` plus a uniform point on
/// the unit sphere, normalised. Density: [`pdf_cosine_hemisphere`].
#[must_use]
pub fn sample_cosine_hemisphere(n: DVec3, u: [f64; 2]) -> DVec3 {
    let direction = (n + sample_sphere(u)).normalize_or(n);
    // Where the two nearly cancel, rounding can put the sum below the horizon.
    if direction.dot(n) > 0.0 { direction } else { n }
}

/// Density per steradian of [`sample_cosine_hemisphere`]; `cos` is between direction and normal.
#[must_use]
pub fn pdf_cosine_hemisphere(cos: f64) -> f64 {
    cos.max(0.0) * FRAC_1_PI
}

/// A direction uniform over the hemisphere about the unit vector `n`. Density:
/// [`pdf_uniform_hemisphere`].
#[must_use]
pub fn sample_uniform_hemisphere(n: DVec3, u: [f64; 2]) -> DVec3 {
    let direction = sample_sphere(u);
    if direction.dot(n) < 0.0 {
        -direction
    } else {
        direction
    }
}

/// Density per steradian of [`sample_uniform_hemisphere`].
#[must_use]
pub fn pdf_uniform_hemisphere() -> f64 {
    1.0 / TAU
}

/// A uniform point of the disc of radius 1, by a map that keeps what is near together (Shirley and
/// Chiu 1997).
#[must_use]
pub fn sample_disk(u: [f64; 2]) -> [f64; 2] {
    let [x, y] = u.map(|u| 2.0 * u - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0; 2];
    }
    let (r, angle) = if x.abs() > y.abs() {
        (x, PI / 4.0 * (y / x))
    } else {
        (y, PI / 2.0 - PI / 4.0 * (x / y))
    };
    [r * angle.cos(), r * angle.sin()]
}

/// Density per area of [`sample_disk`].
#[must_use]
pub fn pdf_disk() -> f64 {
    FRAC_1_PI
}

/// Barycentric weights of a uniform point of a triangle (Turk 1990). Density: one over the area.
#[must_use]
pub fn sample_triangle(u: [f64; 2]) -> [f64; 3] {
    let r = u[0].sqrt();
    [1.0 - r, r * (1.0 - u[1]), r * u[1]]
}

/// Area of a triangle in squared world units.
#[must_use]
pub fn triangle_area(p: [DVec3; 3]) -> f64 {
    (p[1] - p[0]).cross(p[2] - p[0]).length() / 2.0
}

/// Height of the cap that a sphere cuts from the unit sphere of directions: `1 - cos` of half the
/// cone it subtends, where `sin2` is (radius / distance)^2 `< 1`.
///
/// Written so that nothing cancels for small and far spheres.
#[must_use]
pub fn sphere_cone_height(sin2: f64) -> f64 {
    sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt())
}

/// A direction uniform in the cone about the unit vector `axis` whose cap has height `height`
/// ([`sphere_cone_height`]), and how far below 1 its cosine with the axis is.
#[must_use]
pub fn sample_sphere_cone(axis: DVec3, height: f64, u: [f64; 2]) -> (DVec3, f64) {
    let h = u[0] * height;
    let sin = (h * (2.0 - h)).max(0.0).sqrt();
    let (tangent, bitangent) = orthonormal_basis(axis);
    let (s, c) = (TAU * u[1]).sin_cos();
    let direction = axis * (1.0 - h) + (tangent * c + bitangent * s) * sin;
    (direction.normalize(), h)
}

/// Density per steradian of [`sample_sphere_cone`].
#[must_use]
pub fn pdf_sphere_cone(height: f64) -> f64 {
    1.0 / (TAU * height)
}

/// Whether a sun's disc is seen in a direction, a unit vector. By the distance of the two points on the
/// unit sphere, which keeps its digits where a cosine is close to 1.
#[must_use]
pub fn sun_is_seen(sun: &Sun, direction: DVec3) -> bool {
    let axis = sun.direction.as_dvec3().normalize();
    direction.distance_squared(axis) <= 2.0 * f64::from(sun.one_minus_cos)
}

/// Number of the half of the sky that a direction is in: 0 the upper, 1 the lower one.
#[must_use]
pub fn sky_half(direction: DVec3) -> usize {
    usize::from(direction.z < 0.0)
}

/// Two unit vectors that form a right-handed basis with the unit vector `n` (Duff et al. 2017).
#[must_use]
pub fn orthonormal_basis(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    )
}

/// BRDF of a Lambertian reflector, per steradian.
#[must_use]
pub fn eval_diffuse(albedo: DVec3) -> DVec3 {
    albedo * FRAC_1_PI
}

/// Share of unpolarised light that a smooth interface of relative index `eta >= 1` reflects, met
/// from the side of the lower index under the cosine `cos`: Fresnel's equations.
#[must_use]
pub fn fresnel_dielectric(cos: f64, eta: f64) -> f64 {
    if eta <= 1.0 {
        return 0.0;
    }
    let cos = cos.clamp(0.0, 1.0);
    // Snell's law.
    let sin_inside = (1.0 - cos * cos).sqrt() / eta;
    let cos_inside = (1.0 - sin_inside * sin_inside).sqrt();
    let across = (cos - eta * cos_inside) / (cos + eta * cos_inside);
    let along = (cos_inside - eta * cos) / (cos_inside + eta * cos);
    (across * across + along * along) / 2.0
}

/// A density per area seen as a density per steradian, from `distance2` (squared distance) away
/// under the cosine `cos` at the far end; either sign of the cosine will do.
#[must_use]
pub fn pdf_area_to_solid_angle(pdf_area: f64, distance2: f64, cos: f64) -> f64 {
    pdf_area * distance2 / cos.abs()
}

/// Weight of a sample taken with density `p` that another strategy takes with density `q`: the
/// balance heuristic (Veach 1997).
#[must_use]
pub fn mis_weight(p: f64, q: f64) -> f64 {
    p / (p + q)
}

/// Share of a spotlight's intensity in a direction with cosine `cos` to its axis: 1 inside the
/// inner cone, 0 outside the outer one, linear in the cosine between.
#[must_use]
pub fn spot_factor(spot: &Spot, cos: f64) -> f64 {
    let (inner, outer) = (f64::from(spot.cos_inner), f64::from(spot.cos_outer));
    if cos >= inner {
        1.0
    } else if cos <= outer {
        0.0
    } else {
        (cos - outer) / (inner - outer)
    }
}

/// Radiance of a sphere of the given radius with the given radiant intensity.
#[must_use]
pub fn sphere_radiance(intensity: DVec3, radius: f64) -> DVec3 {
    intensity / (PI * radius * radius)
}

/// Distance along a direction to the near surface of a sphere of radius `radius` whose centre is
/// `distance` away; `h` is how far the direction's cosine to the centre is below 1.
#[must_use]
pub fn sphere_near_distance(distance: f64, radius: f64, h: f64) -> f64 {
    let sin2 = h * (2.0 - h);
    let half_chord2 = radius * radius - distance * distance * sin2;
    distance * (1.0 - h) - half_chord2.max(0.0).sqrt()
}

/// Bound of the error of a point on a triangle and of a ray's distance to its plane, in world
/// units.
///
/// `extent` is the largest absolute coordinate involved. A coordinate difference, the weighted sum
/// of three corners and the sheared determinant each add a few roundings of 2^-53; a thin triangle
/// magnifies them by the ratio of its longest side to its height, which is bounded so that
/// degenerate triangles do not push rays away.
#[must_use]
pub fn point_error(p: [DVec3; 3], extent: f64) -> f64 {
    const ROUNDINGS: f64 = 64.0;
    let side2 = [(0, 1), (1, 2), (2, 0)]
        .map(|(i, j): (usize, usize)| p[i].distance_squared(p[j]))
        .into_iter()
        .fold(0.0, f64::max);
    let thinness = side2 / (2.0 * triangle_area(p));
    let thinness = if thinness < 1e4 { thinness } else { 1e4 };
    ROUNDINGS * f64::EPSILON / 2.0 * extent * (1.0 + thinness)
}

/// Where a ray starts (or ends) at `position` on a surface: moved by the error bound `error` to the
/// side that the unit vector `side` points to.
#[must_use]
pub fn spawn_origin(position: DVec3, side: DVec3, error: f64) -> DVec3 {
    position + side * error
}

/// Index of the texel at `uv` (in texels): nearest, wrapping.
#[must_use]
pub fn texel_index(texture: &Texture, uv: DVec2) -> usize {
    wrap(uv.y, texture.height) * texture.width as usize + wrap(uv.x, texture.width)
}

/// `floor(x)` modulo `n`.
fn wrap(x: f64, n: u32) -> usize {
    let truncated = x as i64;
    let floor = truncated.saturating_sub(i64::from(truncated as f64 > x));
    let n = i64::from(n);
    // Most textures are powers of two, and a division costs as much as the rest of the lookup.
    let wrapped = if n & (n - 1) == 0 {
        floor & (n - 1)
    } else {
        floor.rem_euclid(n)
    };
    wrapped as usize
}

#[cfg(test)]
#[path = "shading_tests.rs"]
mod tests;
