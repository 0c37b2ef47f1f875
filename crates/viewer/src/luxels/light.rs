//! Light at a point as the light compilers add it up, in the unit of lightmaps: 0 to 255.

use super::shadows::{Shadows, Way};
use glam::DVec3;
use reference::compiler::eval_compiler_light;
use scene::import::{CompilerLights, IRRADIANCE_PER_VALUE};
use std::collections::BTreeMap;

/// Values below this are not looked for: the compilers' `-gate`.
const GATE: f64 = 0.001;

/// Light by style, before it is turned into bytes.
pub type ByStyle = BTreeMap<u16, DVec3>;

/// A point that gets light.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where it is, world space.
    pub point: DVec3,
    /// Unit normal of its face.
    pub normal: DVec3,
    /// The brush model it belongs to.
    pub model: usize,
    /// Light counts from both sides: liquids, glass.
    pub two_sided: bool,
}

/// The light at a sample; `None` if some of it comes through glass.
///
/// In this order: lights that add, least light of `delay` 4, least light of the brush model or of
/// the world, lights that take away; then nothing is less than 0, and gamma.
#[must_use]
pub fn light_at(
    sample: &Sample,
    lights: &CompilerLights,
    shadows: &Shadows<'_>,
) -> Option<ByStyle> {
    let mut found = ByStyle::new();
    let keys = &shadows.models[sample.model];
    if !keys.ignores_light {
        add(sample, lights, shadows, 1.0, &mut found)?;
        for least in &lights.least {
            let at = least.position.as_dvec3();
            let value = least.irradiance.as_dvec3() / f64::from(IRRADIANCE_PER_VALUE);
            match shadows.way(sample.point, at, sample.model) {
                Way::Free => raise(&mut found, least.style, value),
                Way::Blocked => {}
                Way::Glass => return None,
            }
        }
    }
    let world = &lights.world;
    let (least, color) = if keys.least > world.least {
        (keys.least, keys.least_color)
    } else {
        (world.least, world.least_color)
    };
    if least > 0.0 {
        raise(
            &mut found,
            0,
            color.as_dvec3() * f64::from(least * world.range),
        );
    }
    if !keys.ignores_light {
        add(sample, lights, shadows, -1.0, &mut found)?;
    }
    for value in found.values_mut() {
        *value = value.max(DVec3::ZERO);
        if world.gamma != 1.0 {
            let power = |v: f64| (v / 255.0).powf(1.0 / f64::from(world.gamma)) * 255.0;
            *value = DVec3::from(value.to_array().map(power));
        }
    }
    Some(found)
}

fn raise(found: &mut ByStyle, style: u16, least: DVec3) {
    let value = found.entry(style).or_default();
    *value = value.max(least);
}

/// Adds the lights whose strength has this sign.
fn add(
    sample: &Sample,
    lights: &CompilerLights,
    shadows: &Shadows<'_>,
    sign: f32,
    found: &mut ByStyle,
) -> Option<()> {
    for light in &lights.lights {
        let Some(compiler) = &light.compiler else {
            continue;
        };
        if light.intensity.element_sum() * sign <= 0.0 {
            continue;
        }
        let from_the_front = eval_compiler_light(light, compiler, sample.point, sample.normal);
        let evaluated = match from_the_front {
            None if sample.two_sided => {
                eval_compiler_light(light, compiler, sample.point, -sample.normal)
            }
            found => found,
        };
        let Some(lit) = evaluated else { continue };
        let value = lit.irradiance / f64::from(IRRADIANCE_PER_VALUE);
        if value.abs().max_element() <= GATE {
            continue;
        }
        let way = match lit.distance {
            Some(_) => shadows.way(sample.point, light.position.as_dvec3(), sample.model),
            None => shadows.way_to_sky(sample.point, lit.direction, sample.model),
        };
        match way {
            Way::Free => *found.entry(light.style).or_default() += value,
            Way::Blocked => {}
            Way::Glass => return None,
        }
    }
    Some(())
}
