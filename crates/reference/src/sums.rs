//! Compiler lights where not all of them add up: least light, lights that take light away, gamma.

use crate::bvh::Stack;
use crate::compiler::eval_compiler_light;
use crate::lights::{LightSample, Place};
use crate::triangle::Ray;
use crate::world::World;
use glam::DVec3;
use scene::PointLight;
use scene::light::{COMPILER_GATE, Falloff, IRRADIANCE_PER_VALUE, LightSums, StyleSum};

/// The light of each style at a place with the unit normal `normal`, scattered towards the viewer: all lights are
/// asked. `own` is the surface's own least irradiance in steady light, if it is not black. The place's space has
/// this absorption.
pub(crate) fn light_of_styles(
    world: &World,
    sums: &LightSums,
    place: &Place,
    (normal, own): (DVec3, DVec3),
    absorption: DVec3,
    stack: &mut Stack,
) -> Vec<LightSample> {
    // Light of the compilers has no direction once it is added up: it counts as if from straight above.
    let scattered = place.scattering.eval(normal);
    (sums.styles.iter())
        .map(|style| {
            let mut rays = 0;
            let mut style = *style;
            if style.style == 0 && own != DVec3::ZERO {
                style.least = own.as_vec3();
            }
            let irradiance = irradiance(world, &style, place, normal, absorption, &mut rays, stack);
            let irradiance = with_gamma(irradiance, sums.gamma, style.brightness);
            let shown = world
                .scene
                .styles
                .iter()
                .position(|s| s.number == style.style);
            LightSample::new(scattered, irradiance, shown.unwrap_or(0), rays)
        })
        .collect()
}

fn irradiance(
    world: &World,
    style: &StyleSum,
    place: &Place,
    normal: DVec3,
    absorption: DVec3,
    rays: &mut u32,
    stack: &mut Stack,
) -> DVec3 {
    let (mut adding, mut taking) = (DVec3::ZERO, DVec3::ZERO);
    let mut least = style.least.as_dvec3();
    let (first, count) = (style.first as usize, style.count as usize);
    for light in &world.lights[first..first + count] {
        let Some((irradiance, arrives)) =
            arriving(world, light, place, normal, absorption, rays, stack)
        else {
            continue;
        };
        let value = irradiance * arrives;
        if light.compiler.is_some_and(|c| c.falloff == Falloff::Least) {
            least = least.max(value);
        } else if light.is_negative() {
            taking += value;
        } else {
            adding += value;
        }
    }
    (adding.max(least) + taking).max(DVec3::ZERO)
}

/// What a light gives if nothing is between, and what of that arrives; `None` if it gives nothing.
fn arriving(
    world: &World,
    light: &PointLight,
    place: &Place,
    normal: DVec3,
    absorption: DVec3,
    rays: &mut u32,
    stack: &mut Stack,
) -> Option<(DVec3, DVec3)> {
    let compiler = light.compiler.as_ref()?;
    let (irradiance, to_sky) = match compiler.falloff {
        Falloff::Least => (light.intensity.as_dvec3(), None),
        _ => {
            let sample = eval_compiler_light(light, compiler, place.position, normal)?;
            let to_sky = sample.distance.is_none().then_some(sample.direction);
            (sample.irradiance, to_sky)
        }
    };
    if irradiance.abs().max_element() <= f64::from(COMPILER_GATE * IRRADIANCE_PER_VALUE) {
        return None;
    }
    let (share, traced) = match to_sky {
        Some(direction) => {
            let ray = Ray::new(place.origin, direction);
            world.transmittance_of_sky(absorption, &ray, place.sight, stack)
        }
        None => {
            let end = light.position.as_dvec3();
            (
                world.transmittance(absorption, place.origin, end, place.sight, stack),
                1,
            )
        }
    };
    *rays += traced;
    Some((irradiance, share))
}

/// What a lightmap with this gamma shows of an irradiance that has the brightness of its style.
fn with_gamma(irradiance: DVec3, gamma: f32, brightness: f32) -> DVec3 {
    if gamma == 1.0 {
        return irradiance;
    }
    let white = 255.0 * f64::from(IRRADIANCE_PER_VALUE) * f64::from(brightness);
    DVec3::from(
        irradiance
            .to_array()
            .map(|e| white * (e / white).powf(1.0 / f64::from(gamma))),
    )
}
