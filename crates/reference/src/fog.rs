//! Fog: how far light comes in it, and the light that lamps send through it along a ray.

use crate::bvh::Stack;
use crate::choice::Choice;
use crate::integrator::{PathSample, Walk};
use crate::lights::{Light, LightSample, Place, Reservoir, Scattering, arriving};
use crate::part::Sight;
use crate::passage::Depth;
use crate::rng::Rng;
use crate::shading::sample_sphere;
use crate::triangle::Ray;
use crate::world::World;
use glam::DVec3;
use scene::light::Falloff;
use scene::render::Settings;
use scene::{Fog, PointLight};

/// Phase function of fog, which scatters evenly, and its density: per steradian.
pub const PHASE: f64 = 1.0 / (4.0 * std::f64::consts::PI);
/// Share of the places along a ray that are chosen towards a light.
const TOWARDS_LIGHT: f64 = 0.5;
/// Places are chosen towards a point at this distance from the ray at least, world units: nearer to
/// the ray than light can be, and a distribution that narrow helps nobody.
const NEAREST: f64 = 0.5;

/// Distance after which a ray in fog of this extinction is stopped, from a uniform number: by the law of
/// Beer and Lambert, and less than `length`, which may be infinite.
#[must_use]
pub fn sample_free_path(extinction: f64, length: f64, u: f64) -> f64 {
    // 1 - exp(-x) and log(1 - x), exact where x is small.
    let stopped = -(-extinction * length).exp_m1();
    (-(-u * stopped).ln_1p() / extinction).min(length)
}

/// Density per world unit of [`sample_free_path`] at a distance.
#[must_use]
pub fn pdf_free_path(extinction: f64, length: f64, distance: f64) -> f64 {
    extinction * (-extinction * distance).exp() / -(-extinction * length).exp_m1()
}

/// A stretch of a ray as seen from a point: places on it in proportion to the angle that they fill
/// there, which is as one over the squared distance to the point (Kulla and Fajardo 2012).
#[derive(Clone, Copy, Debug)]
pub struct Equiangular {
    /// Distance along the ray of the place nearest to the point.
    nearest: f64,
    /// Distance of the point from the ray.
    height: f64,
    /// Angles of the beginning and the end, from the nearest place.
    angles: [f64; 2],
}

impl Equiangular {
    /// For the ray from `origin` in the unit direction `direction`, `length` long, and a point that
    /// counts as no nearer to it than `least`, which is above 0.
    #[must_use]
    pub fn new(origin: DVec3, direction: DVec3, length: f64, point: DVec3, least: f64) -> Self {
        let nearest = direction.dot(point - origin);
        let height = point.distance(origin + direction * nearest).max(least);
        let angle = |t: f64| ((t - nearest) / height).atan();
        Self {
            nearest,
            height,
            angles: [angle(0.0), angle(length)],
        }
    }

    /// The distance of a place along the ray, from a uniform number.
    #[must_use]
    pub fn sample(&self, u: f64) -> f64 {
        let [begin, end] = self.angles;
        (self.nearest + self.height * (begin + u * (end - begin)).tan()).max(0.0)
    }

    /// Its density per world unit.
    #[must_use]
    pub fn pdf(&self, distance: f64) -> f64 {
        let [begin, end] = self.angles;
        let off = distance - self.nearest;
        self.height / ((end - begin) * (self.height * self.height + off * off))
    }
}

/// A stretch of a straight ray, between places where it meets something.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    pub ray: Ray,
    /// Distances along the ray.
    pub begin: f64,
    pub end: f64,
    /// What absorbs along the ray besides the fog.
    pub depth: Depth,
}

impl Stretch {
    fn length(&self) -> f64 {
        self.end - self.begin
    }

    /// The point this far from the beginning.
    fn at(&self, distance: f64) -> DVec3 {
        self.ray.origin + self.ray.direction * (self.begin + distance)
    }
}

impl World {
    /// Share of light that fog leaves over a distance.
    pub fn clear(&self, distance: f64) -> f64 {
        match &self.fog {
            Some(fog) => (-f64::from(fog.extinction) * distance).exp(),
            None => 1.0,
        }
    }

    /// Density per world unit of the places on a stretch that are chosen towards a light; where it has
    /// no place, as fog stops light.
    fn pdf_towards(&self, stretch: &Stretch, target: Target, distance: f64) -> f64 {
        match target {
            Some(target) => towards(stretch, target).pdf(distance),
            None => pdf_free_path(self.extinction(), stretch.length(), distance),
        }
    }

    fn extinction(&self) -> f64 {
        self.fog.map_or(0.0, |fog| f64::from(fog.extinction))
    }

    /// Where a light is, and how near a ray can be to it: the point of an emitter that `u` chooses, or
    /// a lamp's centre. Suns are nowhere.
    fn target(&self, light: Light, u: [f64; 2], viewer: DVec3) -> Option<Target> {
        if let Light::Emitter { part, number } = light {
            let emitter = &self.emitters_of(part)?.list[number as usize];
            let point = self.sample_emitter_point(part, emitter, u, viewer)?;
            return Some(Some((point.position, NEAREST)));
        }
        let is_sun = |l: &&PointLight| {
            let compiler = l.compiler.as_ref();
            compiler.is_some_and(|c| matches!(c.falloff, Falloff::Sun(_)))
        };
        let sphere = light.sphere(self).filter(|l| !is_sun(l));
        let target = |l: &PointLight| (l.position.as_dvec3(), f64::from(l.radius).max(NEAREST));
        Some(sphere.map(target))
    }

    /// How lights are chosen at a point in fog.
    fn choice_at(&self, settings: &Settings, point: DVec3) -> Choice<'_> {
        Choice::at(
            &self.scene,
            settings.selection,
            point,
            DVec3::ZERO,
            self.moving.share,
        )
    }
}

/// A point, and how near a ray can be to it; `None` if it is infinitely far away.
type Target = Option<(DVec3, f64)>;

fn towards(stretch: &Stretch, (point, least): (DVec3, f64)) -> Equiangular {
    let direction = stretch.ray.direction;
    Equiangular::new(stretch.at(0.0), direction, stretch.length(), point, least)
}

/// What fog does to a path on its way to the next surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Met {
    /// Nothing: of the paths that may scatter, as many come through as fog leaves of the light.
    Nothing,
    /// It takes light, and can't scatter the path any more.
    Absorption,
    /// It scatters the path; whether that goes on.
    Scattering(bool),
}

impl<'a> Walk<'a> {
    /// Leads the path through fog, up to the distance `end` along its ray, and adds what lights send into
    /// it there: always on the camera's ray, else as often as the path scatters.
    pub fn meet_fog(
        &mut self,
        world: &'a World,
        settings: &Settings,
        end: f64,
        sample: &mut PathSample,
        rng: &mut Rng,
        stack: &mut Stack,
    ) -> Met {
        let Some(fog) = &world.fog else {
            return Met::Nothing;
        };
        if self.is_scattered || self.k == settings.depth {
            return Met::Absorption;
        }
        let begin = self.passed;
        let free = sample_free_path(f64::from(fog.extinction), f64::INFINITY, rng.next());
        let is_stopped = begin + free < end;
        let samples_lights = settings.estimator.samples_lights();
        if samples_lights && (self.k == 1 || is_stopped) {
            let stretch = Stretch {
                ray: self.ray,
                begin,
                end,
                depth: self.depth,
            };
            let often = match self.k {
                1 => 1.0,
                _ => 1.0 - world.clear(end - begin),
            };
            let light = sample_airlight(world, settings, fog, &stretch, rng, stack);
            sample.add_sampled(self.k + 1, self.throughput / often, &light, world);
        }
        if !is_stopped {
            return Met::Nothing;
        }
        let place = self.ray.origin + self.ray.direction * (begin + free);
        self.throughput *= self.depth.transmittance(begin + free) * fog.albedo.as_dvec3();
        self.is_scattered = true;
        self.is_found_alone = false;
        self.pdf_direction = PHASE;
        if samples_lights {
            self.choice = world.choice_at(settings, place);
        }
        let direction = sample_sphere(rng.next2());
        let is_black = self.throughput == DVec3::ZERO;
        Met::Scattering(!is_black && self.go_on((place, Sight::OTHERS), direction, settings, rng))
    }
}

/// Samples the light that comes straight from a light to a stretch of a ray and is scattered there
/// along it, towards the ray's origin.
///
/// One of several candidates is kept, as at surfaces. Of each, the place on the stretch and the light
/// are chosen in one of two ways, at random: the place as fog stops light, and then a light as seen
/// from there; or a light as seen from the middle of what the fog stops, and then the place
/// equiangularly towards it. The density is that of both ways together.
pub(crate) fn sample_airlight(
    world: &World,
    settings: &Settings,
    fog: &Fog,
    stretch: &Stretch,
    rng: &mut Rng,
    stack: &mut Stack,
) -> LightSample {
    if !world.has_lights() || stretch.length() <= 0.0 {
        return LightSample::default();
    }
    let extinction = f64::from(fog.extinction);
    let length = stretch.length();
    let middle = stretch.at(sample_free_path(extinction, length, 0.5));
    let middle = world.choice_at(settings, middle);
    let mut reservoir = Reservoir::new(settings.candidates);
    for _ in 0..reservoir.count {
        let (is_towards, u_place) = (rng.next() < TOWARDS_LIGHT, rng.next());
        let free = sample_free_path(extinction, length, u_place);
        let light = if is_towards {
            Light::choose(world, &middle, rng)
        } else {
            Light::choose(world, &world.choice_at(settings, stretch.at(free)), rng)
        };
        let u = rng.next2();
        let Some(light) = light else { continue };
        let Some(target) = world.target(light, u, stretch.at(free)) else {
            continue;
        };
        let distance = match target {
            Some(target) if is_towards => towards(stretch, target).sample(u_place),
            _ => free,
        };
        let place = Place {
            position: stretch.at(distance),
            origin: stretch.at(distance),
            sight: Sight::OTHERS,
            scattering: Scattering::Fog(fog.albedo.as_dvec3()),
        };
        // Where a light is never chosen it gives nothing.
        let here = light.probability(world, &world.choice_at(settings, place.position));
        let Some(candidate) = light.sample(world, settings.estimator, &place, here, u) else {
            continue;
        };
        // The candidate is divided by the probability of the choice here, in place of the density.
        let as_stopped = here * pdf_free_path(extinction, length, distance);
        let as_seen =
            light.probability(world, &middle) * world.pdf_towards(stretch, target, distance);
        let density = (1.0 - TOWARDS_LIGHT) * as_stopped + TOWARDS_LIGHT * as_seen;
        let scattered = extinction * (-extinction * distance).exp() * here / density;
        let radiance = candidate.radiance
            * place.scattering.eval(candidate.direction)
            * stretch.depth.transmittance(stretch.begin + distance)
            * scattered;
        reservoir.offer((candidate, place), radiance, rng);
    }
    let Some(((candidate, place), radiance)) = reservoir.kept() else {
        return LightSample::default();
    };
    let absorption = stretch.depth.absorption();
    let (share, rays) = arriving(world, &candidate, absorption, &place, stack);
    LightSample::new(radiance, share, candidate.style, rays)
}

#[cfg(test)]
#[path = "fog_tests.rs"]
mod tests;
