//! Lights by the formulas of the light compilers.

use crate::shading::spot_factor;
use glam::DVec3;
use scene::PointLight;
use scene::light::{COMPILER_NEAREST, COMPILER_SCALE, CompilerLight, Falloff};

/// What a compiler's light gives a point of a surface if nothing is between.
#[derive(Clone, Copy, Debug)]
pub struct CompilerSample {
    /// Irradiance; below 0 where the light takes light away.
    pub irradiance: DVec3,
    /// Unit direction to the light.
    pub direction: DVec3,
    /// Distance to it, world units; `None` for a sun, which is seen where a sky face is.
    pub distance: Option<f64>,
}

/// Share of a light's full value at `distance` world units.
#[must_use]
pub fn compiler_falloff(falloff: &Falloff, distance: f64) -> f64 {
    let k = f64::from(COMPILER_SCALE);
    match *falloff {
        Falloff::Linear { reach } => (1.0 - distance / f64::from(reach)).max(0.0),
        Falloff::Inverse { scale } => k / (f64::from(scale) * distance),
        Falloff::InverseSquare { scale } => (k / (f64::from(scale) * distance)).powi(2),
        Falloff::InverseSquareShifted { scale } => (k / (f64::from(scale) * distance + k)).powi(2),
        Falloff::Constant | Falloff::Sun(_) | Falloff::Least => 1.0,
    }
}

/// Evaluates `light`, which has the formula `compiler`, at a point with the unit normal `normal`;
/// `None` where it gives nothing. It lies in front of the surface otherwise.
#[must_use]
pub fn eval_compiler_light(
    light: &PointLight,
    compiler: &CompilerLight,
    point: DVec3,
    normal: DVec3,
) -> Option<CompilerSample> {
    let direction = direction_to(light, compiler, point);
    let distance = match compiler.falloff {
        // It adds nothing: see `crate::sums`.
        Falloff::Least => return None,
        Falloff::Sun(_) => None,
        _ => Some(light.position.as_dvec3().distance(point)),
    };
    let cos = normal.dot(direction);
    // A light in the very point has no direction.
    if cos.is_nan() || cos <= 0.0 {
        return None;
    }
    let near = distance.map_or(0.0, |d| d.max(f64::from(COMPILER_NEAREST)));
    let a = f64::from(compiler.angle_scale);
    let cone = light.spot.as_ref().map_or(1.0, |spot| {
        spot_factor(spot, spot.direction.as_dvec3().dot(-direction))
    });
    let share = compiler_falloff(&compiler.falloff, near) * ((1.0 - a) + a * cos) * cone;
    let irradiance = light.intensity.as_dvec3() * share;
    (irradiance != DVec3::ZERO).then_some(CompilerSample {
        irradiance,
        direction,
        distance,
    })
}

/// Unit direction to a light; not a number in the very place of one.
pub(crate) fn direction_to(light: &PointLight, compiler: &CompilerLight, point: DVec3) -> DVec3 {
    match compiler.falloff {
        Falloff::Sun(along) => -along.as_dvec3(),
        _ => {
            let to_light = light.position.as_dvec3() - point;
            to_light / to_light.length()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use scene::light::Spot;

    #[test]
    fn the_formulas_have_the_compilers_values() {
        // Of a light of 300 at 128 and at 256 units, before the compiler halves it.
        for (falloff, at_128, at_256) in [
            (Falloff::Linear { reach: 300.0 }, 172.0, 44.0),
            (Falloff::Linear { reach: 150.0 }, 44.0, 0.0),
            (Falloff::Inverse { scale: 1.0 }, 300.0, 150.0),
            (Falloff::InverseSquare { scale: 1.0 }, 300.0, 75.0),
            (Falloff::InverseSquare { scale: 2.0 }, 75.0, 18.75),
            (
                Falloff::InverseSquareShifted { scale: 1.0 },
                75.0,
                300.0 / 9.0,
            ),
            (Falloff::Constant, 300.0, 300.0),
        ] {
            for (distance, value) in [(128.0, at_128), (256.0, at_256)] {
                let found = 300.0 * compiler_falloff(&falloff, distance);
                assert!(
                    (found - value).abs() < 1e-9,
                    "{falloff:?} at {distance}: {found}"
                );
            }
        }
    }

    #[test]
    fn the_cosine_counts_by_its_share_and_nothing_is_lit_from_behind() {
        let light = |angle_scale, intensity| PointLight {
            position: Vec3::new(30.0, 0.0, 40.0),
            intensity: Vec3::splat(intensity),
            compiler: Some(CompilerLight {
                falloff: Falloff::Constant,
                angle_scale,
            }),
            ..PointLight::default()
        };
        let eval = |l: &PointLight, n| {
            eval_compiler_light(l, &l.compiler.unwrap(), DVec3::ZERO, n).map(|s| s.irradiance.x)
        };
        assert_eq!(eval(&light(0.0, 2.0), DVec3::Z), Some(2.0));
        assert!((eval(&light(0.5, 2.0), DVec3::Z).unwrap() - 1.8).abs() < 1e-7);
        assert!((eval(&light(1.0, -2.0), DVec3::Z).unwrap() + 1.6).abs() < 1e-7);
        assert_eq!(eval(&light(0.5, 2.0), DVec3::NEG_Z), None);
        let cone = Spot {
            direction: Vec3::NEG_Z,
            cos_inner: 0.9,
            cos_outer: 0.7,
        };
        let spot = PointLight {
            spot: Some(cone),
            ..light(0.0, 2.0)
        };
        // The cosine of 0.8 is halfway between the cones.
        assert!((eval(&spot, DVec3::Z).unwrap() - 1.0).abs() < 1e-6);
    }
}
