//! Closed forms that pictures are compared with.

use std::f64::consts::{PI, TAU};

/// Radiance in a closed box whose walls emit `emitted` and reflect the share `albedo`: the
/// geometric series over `depth` path vertices, all of them if `depth` is 0.
#[must_use]
pub fn closed_box(emitted: f64, albedo: f64, depth: u32) -> f64 {
    let reached = match depth {
        0 => 1.0,
        n => 1.0 - albedo.powi(i32::try_from(n).unwrap_or(i32::MAX)),
    };
    emitted * reached / (1.0 - albedo)
}

/// Form factor from a point, its normal up, to a rectangle `height` above that faces down and spans
/// `x0..x1`, `y0..y1` relative to the point (Howell, A Catalog of Radiation Heat Transfer
/// Configuration Factors, B-4, with signs for the four corners).
#[must_use]
pub fn rectangle_form_factor(x: [f64; 2], y: [f64; 2], height: f64) -> f64 {
    let corner = |x: f64, y: f64| {
        let (a, b) = (x / height, y / height);
        let (p, q) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
        (a / p * (b / p).atan() + b / q * (a / q).atan()) / TAU
    };
    corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0])
}

/// A lamp beside a ray: how far along the ray it is nearest, how far from the ray, and its radius.
#[derive(Clone, Copy, Debug)]
pub struct LampBeside {
    /// Distance along the ray.
    pub along: f64,
    /// Distance from the ray, more than the radius.
    pub height: f64,
    /// Radius.
    pub radius: f64,
}

/// Radiance that white fog scatters once along a ray of this length, from a lamp of radiant intensity 1
/// times `factor` of the distance along the ray. The integral is taken over the angle that the ray fills as
/// seen from the lamp, by the midpoint rule.
#[must_use]
pub fn airlight(
    extinction: f64,
    length: f64,
    lamp: LampBeside,
    factor: impl Fn(f64) -> f64,
) -> f64 {
    const STEPS: u32 = 20_000;
    let LampBeside {
        along,
        height,
        radius,
    } = lamp;
    let [begin, end] = [0.0, length].map(|t| ((t - along) / height).atan());
    let step = (end - begin) / f64::from(STEPS);
    let radiance = 1.0 / (PI * radius * radius);
    (0..STEPS)
        .map(|i| {
            let angle = begin + (f64::from(i) + 0.5) * step;
            let (t, distance) = (along + height * angle.tan(), height / angle.cos());
            let sin2 = (radius / distance).powi(2);
            let solid_angle = TAU * sin2 / (1.0 + (1.0 - sin2).sqrt());
            // The lamp's near side is nearer than its middle, by two thirds of the radius on average.
            let way = t + distance - radius * 2.0 / 3.0;
            let scattered = extinction / (4.0 * PI) * solid_angle * (-extinction * way).exp();
            scattered * factor(t) * distance * distance / height * step
        })
        .sum::<f64>()
        * radiance
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_form_factor_is_the_integral_it_stands_for() {
        // Midpoint rule over cos^2 / (pi d^2); its error falls with the square of the step.
        let (x, y, h) = ([-3.0, 17.0], [4.0, 9.0], 12.0);
        let n = 400;
        let step = |range: [f64; 2]| (range[1] - range[0]) / f64::from(n);
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let u = x[0] + (f64::from(i) + 0.5) * step(x);
                let v = y[0] + (f64::from(j) + 0.5) * step(y);
                let d2 = u * u + v * v + h * h;
                sum += h * h / (PI * d2 * d2);
            }
        }
        let integral = sum * step(x) * step(y);
        let found = rectangle_form_factor(x, y, h);
        assert!((found / integral - 1.0).abs() < 1e-5, "{found} {integral}");
        // All of the hemisphere.
        let everything = rectangle_form_factor([-1e9, 1e9], [-1e9, 1e9], 1.0);
        assert!((everything - 1.0).abs() < 1e-8);
    }

    #[test]
    fn airlight_of_a_far_lamp_is_that_of_even_light() {
        // From so far away light is even along the ray: the integral has a closed form.
        let (sigma, length, height) = (1e-3, 500.0, 1e5);
        let lamp = LampBeside {
            along: 100.0,
            height,
            radius: 1.0,
        };
        let found = airlight(sigma, length, lamp, |_| 1.0) * (sigma * height).exp();
        let expected = (1.0 - (-sigma * length).exp()) / (4.0 * PI * height * height);
        assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
    }

    #[test]
    fn a_series_is_its_sum() {
        let sum: f64 = (0..4).map(|k| 2.0 * 0.3_f64.powi(k)).sum();
        assert!((closed_box(2.0, 0.3, 4) - sum).abs() < 1e-12);
        assert!((closed_box(2.0, 0.3, 60) - closed_box(2.0, 0.3, 0)).abs() < 1e-12);
    }
}
