//! Light sampling: one emitter, one point of it, one shadow ray.

use crate::bsdf::Bsdf;
use crate::bvh::Stack;
use crate::choice::{Choice, sample_alias};
use crate::compiler::{direction_to, eval_compiler_light};
use crate::fog::PHASE;
use crate::part::Sight;
use crate::rng::Rng;
use crate::shading::{
    mis_weight, pdf_area_to_solid_angle, pdf_sphere_cone, sample_sphere_cone, spawn_origin,
    sphere_cone_height, sphere_near_distance, sphere_radiance, spot_factor,
};
use crate::triangle::Ray;
use crate::world::World;
use glam::DVec3;
use scene::PointLight;
use scene::emitter::{LightBounds, MovingLight, Shine};
use scene::light::{CompilerLight, Spot};
use scene::render::{Estimator, GUESSES_PER_CANDIDATE, MOST_CANDIDATES, Settings};

/// A light sample at a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LightSample {
    /// Radiance scattered towards the viewer.
    pub radiance: DVec3,
    /// Which of the scene's styles it shines in; its brightness is not in the radiance.
    pub style: usize,
    /// Rays that were traced.
    pub rays: u32,
}

impl LightSample {
    /// Of `radiance` if nothing is between, of which `share` arrives.
    pub fn new(radiance: DVec3, share: DVec3, style: usize, rays: u32) -> Self {
        Self {
            radiance: if share == DVec3::ZERO {
                DVec3::ZERO
            } else {
                radiance * share
            },
            style,
            rays,
        }
    }
}

/// A light sample before it is known whether anything is between.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Emitted radiance over the density, weighted.
    pub radiance: DVec3,
    /// Unit direction to it.
    pub direction: DVec3,
    /// Which of the scene's styles it shines in.
    pub style: usize,
    end: End,
}

/// Where the light comes from.
#[derive(Clone, Copy, Debug)]
enum End {
    /// A point, world space: nothing may be between.
    At(DVec3),
    /// Far away: a sky face must be the first thing in its direction.
    Sky,
}

/// Where light is sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// World space.
    pub position: DVec3,
    /// Where shadow rays start.
    pub origin: DVec3,
    /// What they meet.
    pub sight: Sight,
    /// What becomes of the light.
    pub scattering: Scattering,
}

/// What scatters light at a place.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Scattering {
    /// A surface with this normal, which light from behind does not reach.
    Surface(DVec3, Bsdf),
    /// Fog of this albedo.
    Fog(DVec3),
}

impl Scattering {
    /// Cosine that the light arrives under; in fog there is no surface to lie aslant.
    fn cos(&self, direction: DVec3) -> f64 {
        match self {
            Self::Surface(normal, _) => normal.dot(direction),
            Self::Fog(_) => 1.0,
        }
    }

    /// Scattered radiance towards the viewer, for light of radiance 1 per steradian in `direction`.
    pub fn eval(&self, direction: DVec3) -> DVec3 {
        match self {
            Self::Surface(_, bsdf) => bsdf.eval(direction),
            Self::Fog(albedo) => *albedo * PHASE,
        }
    }

    /// Density per steradian with which a path goes on in `direction`.
    fn pdf(&self, direction: DVec3) -> f64 {
        match self {
            Self::Surface(_, bsdf) => bsdf.pdf(direction),
            Self::Fog(_) => PHASE,
        }
    }

    /// Weight of a light sample in `direction` that a ray could have found, too.
    fn light_weight(&self, estimator: Estimator, pdf_light: f64, direction: DVec3) -> f64 {
        match estimator {
            Estimator::Mis => mis_weight(pdf_light, self.pdf(direction)),
            _ => 1.0,
        }
    }
}

/// Resampled importance sampling (Talbot, Cline and Egbert 2005): one of several candidates, in proportion
/// to the luminance that each would add, which stands for the mean of all.
pub(crate) struct Reservoir<T> {
    /// Candidates that are to be offered at most.
    pub count: u32,
    /// The one that is kept, its radiance, and the luminance of that.
    best: Option<(T, DVec3, f64)>,
    sum: f64,
}

impl<T> Reservoir<T> {
    pub fn new(candidates: u32) -> Self {
        Self {
            count: candidates.clamp(1, MOST_CANDIDATES),
            best: None,
            sum: 0.0,
        }
    }

    /// Offers a candidate that adds `radiance` if nothing is between.
    pub fn offer(&mut self, candidate: T, radiance: DVec3, rng: &mut Rng) {
        // Compilers know lights that take light away.
        let target = luminance(radiance.abs());
        self.sum += target;
        if rng.next() * self.sum < target {
            self.best = Some((candidate, radiance, target));
        }
    }

    /// The candidate that is kept, and what it adds for the mean of all.
    pub fn kept(self) -> Option<(T, DVec3)> {
        let (candidate, radiance, target) = self.best?;
        let mean = self.sum / f64::from(self.count);
        Some((candidate, radiance * (mean / target)))
    }
}

/// A light to choose: among the scene's own, or what moves.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Light {
    /// An emitter on a part of the world, by its number there.
    Emitter { part: u32, number: u32 },
    /// A light entity of the scene.
    Entity(usize),
    /// A light that moves, by its number among all that does, and among such lights.
    Moving { entry: usize, number: usize },
    /// A sun.
    Sun(usize),
}

impl Light {
    /// Chooses one; `None` if none can light the point of the choice.
    pub fn choose(world: &World, choice: &Choice<'_>, rng: &mut Rng) -> Option<Self> {
        match Self::choose_moving(world, rng) {
            None => Some(Self::own(world, choice.sample(rng)?)),
            moving => moving,
        }
    }

    /// Chooses one out of a list by what each may add at a point of a surface with this normal, and says what a sample of it
    /// stands for: one over a probability.
    pub fn choose_by_guess(
        world: &World,
        choice: &Choice<'_>,
        (point, normal): (DVec3, DVec3),
        listed: u32,
        rng: &mut Rng,
    ) -> Option<(Self, f64)> {
        if let Some(moving) = Self::choose_moving(world, rng) {
            return Some((moving, 1.0 / moving.probability(world, choice)));
        }
        let guess = |entry: usize| {
            let bounds = &world.scene.emitters.bounds[entry];
            guess(bounds, point, normal)
        };
        let power = |entry| power_of(world, entry);
        let (entry, weight) = choice.sample_by_guess(listed, power, guess, rng)?;
        Some((Self::own(world, entry), weight))
    }

    /// One that moves, if chance says that it is to be one.
    fn choose_moving(world: &World, rng: &mut Rng) -> Option<Self> {
        let moving = &world.moving;
        if !(moving.share > 0.0 && rng.next() < f64::from(moving.share)) {
            return None;
        }
        let entry = sample_alias(&moving.alias, rng.next());
        Some(match moving.lights[entry] {
            MovingLight::Point(number) => Self::Moving {
                entry,
                number: number as usize,
            },
            MovingLight::Instance { number: part, list } => {
                let list = &world.scene.moving.lists[list as usize];
                let number = sample_alias(&list.alias, rng.next()) as u32;
                Self::Emitter { part, number }
            }
        })
    }

    /// The scene's own light with this number in the table over all.
    fn own(world: &World, entry: usize) -> Self {
        let listed = world.scene.emitters.list.len();
        let lights = world.scene.lights.len();
        if entry < listed {
            Self::Emitter {
                part: 0,
                number: entry as u32,
            }
        } else if entry < listed + lights {
            Self::Entity(entry - listed)
        } else {
            Self::Sun(entry - listed - lights)
        }
    }

    /// Probability with which [`Self::choose`] comes to it.
    pub fn probability(self, world: &World, choice: &Choice<'_>) -> f64 {
        let scene = &world.scene;
        let own = |entry: usize| choice.probability(entry as u32, power_of(world, entry));
        let listed = scene.emitters.list.len();
        match self {
            Self::Emitter { part, number } => world
                .emitter_probability(choice, part, number)
                .unwrap_or(0.0),
            Self::Entity(index) => own(listed + index),
            Self::Sun(index) => own(listed + scene.lights.len() + index),
            Self::Moving { entry, .. } => {
                let moving = &world.moving;
                f64::from(moving.share) * f64::from(moving.probabilities[entry])
            }
        }
    }

    /// The sphere that it is, if it is one.
    pub fn sphere(self, world: &World) -> Option<&PointLight> {
        match self {
            Self::Entity(index) => Some(&world.lights[index]),
            Self::Moving { number, .. } => Some(&world.frame_lights[number]),
            Self::Emitter { .. } | Self::Sun(_) => None,
        }
    }

    /// A sample of it as seen from a place, where it is chosen with this probability; `None` if it can
    /// add nothing.
    pub fn sample(
        self,
        world: &World,
        estimator: Estimator,
        place: &Place,
        probability: f64,
        u: [f64; 2],
    ) -> Option<Candidate> {
        if probability <= 0.0 {
            return None;
        }
        match self {
            Self::Emitter { part, number } => {
                sample_emitter(world, estimator, place, (part, number), probability, u)
            }
            Self::Sun(index) => sample_sun(world, estimator, place, index, probability, u),
            Self::Moving { number, .. } => {
                sample_point_light(place, &world.frame_lights[number], probability, u)
            }
            Self::Entity(index) => {
                let light = &world.lights[index];
                let candidate = match &light.compiler {
                    None => sample_point_light(place, light, probability, u),
                    Some(compiler) => compiler_candidate(place, light, compiler, probability),
                }?;
                Some(Candidate {
                    style: world.scene.style_of(light),
                    ..candidate
                })
            }
        }
    }
}

/// Samples one light as seen from a place of absorption `absorption` on a surface, out of several candidates by
/// the choice there. The weights against hitting the light are those of a single candidate by the table.
pub(crate) fn sample_light(
    world: &World,
    settings: &Settings,
    choice: &Choice<'_>,
    place: &Place,
    absorption: DVec3,
    rng: &mut Rng,
    stack: &mut Stack,
) -> LightSample {
    if !world.has_lights() {
        return LightSample::default();
    }
    let guesses = match place.scattering {
        Scattering::Surface(normal, _) if choice.has_list() && settings.candidates > 1 => {
            Some(normal)
        }
        _ => None,
    };
    let mut reservoir = Reservoir::new(guesses.map_or(settings.candidates, |_| 1));
    for _ in 0..reservoir.count {
        let chosen = match guesses {
            Some(normal) => {
                let listed = GUESSES_PER_CANDIDATE * settings.candidates - 1;
                Light::choose_by_guess(world, choice, (place.position, normal), listed, rng)
            }
            None => Light::choose(world, choice, rng)
                .map(|light| (light, 1.0 / light.probability(world, choice))),
        };
        let Some((light, weight)) = chosen else {
            continue;
        };
        let u = rng.next2();
        let probability = light.probability(world, choice);
        let sample = light.sample(world, settings.estimator, place, probability, u);
        if let Some(candidate) = sample {
            // Both ways to find the light are weighted by the probability; it stands for something else.
            let stands_for = candidate.radiance * (probability * weight);
            let radiance = stands_for * place.scattering.eval(candidate.direction);
            reservoir.offer(candidate, radiance, rng);
        }
    }
    let Some((candidate, radiance)) = reservoir.kept() else {
        return LightSample::default();
    };
    let (share, rays) = arriving(world, &candidate, absorption, place, stack);
    LightSample::new(radiance, share, candidate.style, rays)
}

/// Share of a candidate's light that arrives at a place, whose space has this absorption, and how many
/// rays were traced to know.
pub(crate) fn arriving(
    world: &World,
    candidate: &Candidate,
    absorption: DVec3,
    place: &Place,
    stack: &mut Stack,
) -> (DVec3, u32) {
    let Place { origin, sight, .. } = *place;
    match candidate.end {
        End::At(end) => {
            let share = world.transmittance(absorption, origin, end, sight, stack);
            (share, 1)
        }
        End::Sky => {
            let ray = Ray::new(origin, candidate.direction);
            world.transmittance_of_sky(absorption, &ray, sight, stack)
        }
    }
}

/// Share of the power that one of the scene's own lights has among these. A style that is dark now does not
/// change it.
fn power_of(world: &World, entry: usize) -> f64 {
    let emitters = &world.scene.emitters;
    f64::from(emitters.bounds[entry].power) / f64::from(emitters.total_weight)
}

/// What a light may add at a point of a surface with this normal, by the formula of [`LightBounds`].
pub(crate) fn guess(light: &LightBounds, point: DVec3, normal: DVec3) -> f64 {
    let (weight, radius) = (f64::from(light.weight), f64::from(light.radius));
    let axis = light.axis.as_dvec3();
    if light.shine == Shine::Distant {
        return weight * (normal.dot(axis) + radius).clamp(0.0, 1.0);
    }
    let to_centre = light.centre.as_dvec3() - point;
    let distance = to_centre.length().max(radius);
    let cosine = |height: f64, slack: f64| ((height + slack) / distance).min(1.0);
    let here = cosine(normal.dot(to_centre), radius).max(0.0);
    let height = -axis.dot(to_centre);
    let there = match light.shine {
        Shine::Front if height <= 0.0 => 0.0,
        Shine::Front | Shine::BothSides => cosine(height.abs(), 0.25 * radius),
        Shine::Cone {
            cos_inner,
            cos_outer,
        } => {
            let direction = light.axis;
            let spot = Spot {
                direction,
                cos_inner,
                cos_outer,
            };
            spot_factor(&spot, height / to_centre.length())
        }
        Shine::AllRound | Shine::Distant => 1.0,
    };
    weight * here * there / (distance * distance)
}

/// Luminance of linear RGB.
fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Estimate of the light from a point of an emitter: part and number there.
fn sample_emitter(
    world: &World,
    estimator: Estimator,
    place: &Place,
    (part, number): (u32, u32),
    probability: f64,
    u: [f64; 2],
) -> Option<Candidate> {
    let emitters = world.emitters_of(part)?;
    let emitter = &emitters.list[number as usize];
    let light = world.sample_emitter_point(part, emitter, u, place.position)?;
    // Poses can collapse a triangle that has an area in the one that emitters are listed in.
    if light.area <= 0.0 {
        return None;
    }
    let to_light = light.position - place.position;
    let distance2 = to_light.length_squared();
    let direction = to_light / distance2.sqrt();
    let cos_light = light.normal.dot(direction);
    // Not the complement: none of this must pass if it is not a number.
    if !(place.scattering.cos(direction) > 0.0 && cos_light != 0.0) {
        return None;
    }
    let emitted = world.emitted(&light, direction);
    if emitted == DVec3::ZERO {
        return None;
    }
    let pdf_area = probability * world.pdf_emitter_point(emitters, emitter, &light);
    let pdf_light = pdf_area_to_solid_angle(pdf_area, distance2, cos_light);
    let weight = place
        .scattering
        .light_weight(estimator, pdf_light, direction);
    Some(Candidate {
        radiance: emitted * (weight / pdf_light),
        direction,
        style: 0,
        end: End::At(spawn_origin(
            light.position,
            light.facing_normal(),
            light.error,
        )),
    })
}

/// Estimate of the light from a uniform direction to a sphere; `probability` is that of its choice
/// among the lights.
fn sample_point_light(
    place: &Place,
    light: &PointLight,
    probability: f64,
    u: [f64; 2],
) -> Option<Candidate> {
    let radius = f64::from(light.radius);
    let to_centre = light.position.as_dvec3() - place.position;
    let distance = to_centre.length();
    if distance <= radius {
        return None;
    }
    let axis = to_centre / distance;
    let factor = light.spot.as_ref().map_or(1.0, |spot| {
        spot_factor(spot, spot.direction.as_dvec3().dot(-axis))
    });
    let height = sphere_cone_height((radius / distance).powi(2));
    let (direction, h) = sample_sphere_cone(axis, height, u);
    if !(place.scattering.cos(direction) > 0.0 && factor > 0.0) {
        return None;
    }
    let pdf_light = probability * pdf_sphere_cone(height);
    let emitted = sphere_radiance(light.intensity.as_dvec3(), radius) * factor;
    Some(Candidate {
        radiance: emitted / pdf_light,
        direction,
        style: 0,
        end: End::At(place.position + direction * sphere_near_distance(distance, radius, h)),
    })
}

/// Irradiance from a light by a compiler's formula, which was chosen with this probability. Fog gets
/// what a surface gets that faces the light.
fn compiler_candidate(
    place: &Place,
    light: &PointLight,
    compiler: &CompilerLight,
    probability: f64,
) -> Option<Candidate> {
    let at = place.position;
    let normal = match place.scattering {
        Scattering::Surface(normal, _) => normal,
        Scattering::Fog(_) => direction_to(light, compiler, at),
    };
    let sample = eval_compiler_light(light, compiler, at, normal)?;
    Some(Candidate {
        // The irradiance counts the cosine in its own way.
        radiance: sample.irradiance / (normal.dot(sample.direction) * probability),
        direction: sample.direction,
        style: 0,
        end: match sample.distance {
            Some(distance) => End::At(at + sample.direction * distance),
            None => End::Sky,
        },
    })
}

/// Estimate of the light from a uniform direction to a sun.
fn sample_sun(
    world: &World,
    estimator: Estimator,
    place: &Place,
    index: usize,
    probability: f64,
    u: [f64; 2],
) -> Option<Candidate> {
    let sun = &world.scene.sky.suns[index];
    let axis = sun.direction.as_dvec3().normalize();
    let height = f64::from(sun.one_minus_cos);
    let (direction, _) = sample_sphere_cone(axis, height, u);
    if place.scattering.cos(direction) <= 0.0 {
        return None;
    }
    let pdf_light = probability * pdf_sphere_cone(height);
    let weight = place
        .scattering
        .light_weight(estimator, pdf_light, direction);
    Some(Candidate {
        radiance: sun.radiance.as_dvec3() * (weight / pdf_light),
        direction,
        style: 0,
        end: End::Sky,
    })
}
