//! Particles in closed form: where one is and which colour it has is a function of its age.
//!
//! The engine moves particles frame by frame (`r_part.c`); these are the limits of its steps for
//! frames that are ever shorter, so that no frame rate shows.

use super::seed::Seed;
use glam::Vec3;

/// What pulls particles down, units per squared second: a twentieth of 800.
const GRAVITY: f32 = 40.0;

/// Palette indices of explosions, the first kind.
const RAMP1: [u8; 8] = [0x6f, 0x6d, 0x6b, 0x69, 0x67, 0x65, 0x63, 0x61];
/// The second kind.
const RAMP2: [u8; 8] = [0x6f, 0x6e, 0x6d, 0x6c, 0x6b, 0x6a, 0x68, 0x66];
/// Palette indices of fire and smoke.
const RAMP3: [u8; 6] = [0x6d, 0x6b, 0x06, 0x05, 0x04, 0x03];

/// How a particle's speed changes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    /// Not at all.
    Still,
    /// It falls.
    Fall,
    /// It rises.
    Rise,
    /// It grows by four times itself in a second, and falls.
    Burst,
    /// It shrinks by itself in a second, and falls.
    Brake,
    /// It shrinks by four times itself in a second to the sides, and falls.
    Flatten,
}

/// Which colour a particle has at an age.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Colour {
    /// The same always.
    Fixed(u8),
    /// Through a ramp, which also ends it: first entry, entries per second.
    Ramp(&'static [u8], f32, f32),
}

/// A particle as it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Born {
    id: u64,
    at: Vec3,
    velocity: Vec3,
    motion: Motion,
    colour: Colour,
    life: f32,
}

/// A particle at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// What it is from one moment to the next, hardly shared with another.
    pub id: u64,
    /// Where it is, world space.
    pub at: Vec3,
    /// Units per second.
    pub velocity: Vec3,
    /// Its colour, an index of the palette.
    pub colour: u8,
}

impl Born {
    /// The particle at an age in seconds, if it still is.
    pub fn at_age(&self, age: f32) -> Option<Particle> {
        if !(0.0..self.life).contains(&age) {
            return None;
        }
        let colour = match self.colour {
            Colour::Fixed(colour) => colour,
            Colour::Ramp(ramp, first, rate) => *ramp.get((first + age * rate) as usize)?,
        };
        Some(Particle {
            id: self.id,
            at: self.at + self.travelled(age),
            velocity: self.velocity_at(age),
            colour,
        })
    }

    /// How fast it is: the derivative of [`Born::travelled`].
    fn velocity_at(&self, t: f32) -> Vec3 {
        let v = self.velocity;
        let grown = |a: f32| v * (a * t).exp();
        let fall = |a: f32| Vec3::Z * (-GRAVITY * (a * t).exp_m1() / a);
        match self.motion {
            Motion::Still => v,
            Motion::Fall => v - Vec3::Z * (GRAVITY * t),
            Motion::Rise => v + Vec3::Z * (GRAVITY * t),
            Motion::Burst => grown(4.0) + fall(4.0),
            Motion::Brake => grown(-1.0) + fall(-1.0),
            Motion::Flatten => grown(-4.0).with_z(v.z - GRAVITY * t),
        }
    }

    /// How far it went. With the speed v and the rate of change a v, the way after t is
    /// v (exp(a t) - 1) / a, and what gravity adds is the integral of its own such growth.
    fn travelled(&self, t: f32) -> Vec3 {
        let v = self.velocity;
        let grown = |a: f32| (a * t).exp_m1() / a;
        let fall = |a: f32| Vec3::new(0.0, 0.0, -GRAVITY * (grown(a) - t) / a);
        match self.motion {
            Motion::Still => v * t,
            Motion::Fall => v * t - Vec3::Z * (GRAVITY * t * t / 2.0),
            Motion::Rise => v * t + Vec3::Z * (GRAVITY * t * t / 2.0),
            Motion::Burst => v * grown(4.0) + fall(4.0),
            Motion::Brake => v * grown(-1.0) + fall(-1.0),
            Motion::Flatten => {
                let aside = grown(-4.0);
                Vec3::new(v.x * aside, v.y * aside, v.z * t - GRAVITY * t * t / 2.0)
            }
        }
    }
}

/// What makes many particles at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Burst {
    /// Dust, blood, sparks: towards a direction, in eight neighbouring colours.
    Puff {
        direction: Vec3,
        colour: u8,
        count: u16,
    },
    /// Fire.
    Explosion,
    /// Fire in a range of colours.
    Coloured { first: u8, count: u8 },
    /// The end of a spawn.
    Blob,
    /// Lava.
    Lava,
    /// Stars of a teleport.
    Teleport,
}

/// Longest life of a burst's particles, seconds.
pub const LONGEST_BURST: f64 = 2.63;
/// Longest life of a trail's particles, seconds.
pub const LONGEST_TRAIL: f64 = 2.0;
/// Puffs of so many are explosions.
const EXPLOSION_COUNT: u16 = 1024;

impl Burst {
    /// How many particles it makes.
    pub fn count(self) -> u32 {
        match self {
            Self::Puff { count, .. } => u32::from(count),
            Self::Explosion | Self::Blob | Self::Lava => 1024,
            Self::Coloured { .. } => 512,
            Self::Teleport => 8 * 8 * 14,
        }
    }

    /// Its particle `i`, less than [`Burst::count`].
    pub fn born(self, i: u32, at: Vec3, seed: Seed) -> Born {
        let s = seed.of(u64::from(i));
        let cube = |lane: u64, n: u32| Vec3::from_array([0, 1, 2].map(|k| s.int(lane + k, n)));
        // Within 16 units, and up to 256 units per second in each direction.
        let wild_place = at + cube(0, 32) - 16.0;
        let wild_speed = cube(3, 512) - 256.0;
        let odd = i % 2 == 1;
        let wild = |motion, colour, life| Born {
            id: s.0,
            at: wild_place,
            velocity: wild_speed,
            motion,
            colour,
            life,
        };
        match self {
            Self::Puff { count, .. } if count == EXPLOSION_COUNT => {
                Self::Explosion.born(i, at, seed)
            }
            Self::Puff {
                direction, colour, ..
            } => Born {
                id: s.0,
                at: at + cube(0, 16) - 8.0,
                velocity: direction * 15.0,
                motion: Motion::Fall,
                colour: Colour::Fixed((colour & !7) + s.below(3, 8) as u8),
                life: 0.1 * s.int(4, 5),
            },
            Self::Explosion => {
                let first = s.int(6, 4);
                if odd {
                    wild(Motion::Burst, Colour::Ramp(&RAMP1, first, 10.0), 5.0)
                } else {
                    wild(Motion::Brake, Colour::Ramp(&RAMP2, first, 15.0), 5.0)
                }
            }
            Self::Coloured { first, count } => {
                let colour = first.wrapping_add((i % u32::from(count.max(1))) as u8);
                wild(Motion::Burst, Colour::Fixed(colour), 0.3)
            }
            Self::Blob => {
                let life = 1.0 + 0.05 * (s.below(6, 16) & 8) as f32;
                let (motion, first) = if odd {
                    (Motion::Burst, 66)
                } else {
                    (Motion::Flatten, 150)
                };
                let colour = Colour::Fixed(first + s.below(7, 6) as u8);
                wild(motion, colour, life)
            }
            Self::Lava => {
                let [x, y] = [i % 32, i / 32].map(|n| n as f32 - 16.0);
                let away = Vec3::new(8.0 * x + s.int(0, 8), 8.0 * y + s.int(1, 8), 256.0);
                Born {
                    id: s.0,
                    at: at + Vec3::new(away.x, away.y, s.int(2, 64)),
                    velocity: away.normalize() * (50.0 + s.int(3, 64)),
                    motion: Motion::Fall,
                    colour: Colour::Fixed(224 + s.below(4, 8) as u8),
                    life: 2.0 + 0.02 * s.int(5, 32),
                }
            }
            Self::Teleport => {
                let [x, y, z] = [i % 8, i / 8 % 8, i / 64].map(|n| 4.0 * n as f32);
                let grid = Vec3::new(x - 16.0, y - 16.0, z - 24.0);
                let away = Vec3::new(grid.y, grid.x, grid.z).normalize_or_zero();
                Born {
                    id: s.0,
                    at: at + grid + cube(0, 4),
                    velocity: away * (50.0 + s.int(3, 64)),
                    motion: Motion::Fall,
                    colour: Colour::Fixed(7 + s.below(4, 8) as u8),
                    life: 0.2 + 0.02 * s.int(5, 8),
                }
            }
        }
    }
}

/// What things leave behind on their way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trail {
    /// Blood.
    Blood,
    /// Less blood.
    ThinBlood,
    /// Two lines of sparks, green.
    Green,
    /// The same, orange.
    Orange,
    /// Fire.
    Rocket,
    /// Smoke.
    Smoke,
    /// Sparks, purple.
    Purple,
}

impl Trail {
    /// What a model with these flags leaves behind. The first of several holds.
    pub fn of_flags(flags: u32) -> Option<Self> {
        use bsp::mdl::flags as f;
        [
            (f::GIB, Self::Blood),
            (f::ZOMBIE_GIB, Self::ThinBlood),
            (f::TRACER, Self::Green),
            (f::TRACER2, Self::Orange),
            (f::ROCKET, Self::Rocket),
            (f::GRENADE, Self::Smoke),
            (f::TRACER3, Self::Purple),
        ]
        .into_iter()
        .find_map(|(flag, trail)| (flags & flag != 0).then_some(trail))
    }

    /// Distance from one particle to the next, units.
    pub fn spacing(self) -> f64 {
        match self {
            Self::ThinBlood => 6.0,
            _ => 3.0,
        }
    }

    /// Particle `n` of the trail, born at `at` while moving along the unit vector `along`.
    pub fn born(self, n: u64, at: Vec3, along: Vec3, seed: Seed) -> Born {
        let s = seed.of(n);
        let cube = |n: u32| Vec3::from_array([0, 1, 2].map(|k| s.int(k, n)));
        let near = at + cube(6) - 3.0;
        let plain = |at, motion, colour, life| Born {
            id: s.0,
            at,
            velocity: Vec3::ZERO,
            motion,
            colour,
            life,
        };
        match self {
            Self::Blood | Self::ThinBlood => {
                let colour = Colour::Fixed(67 + s.below(3, 4) as u8);
                plain(near, Motion::Fall, colour, 2.0)
            }
            Self::Rocket => {
                let colour = Colour::Ramp(&RAMP3, s.int(3, 4), 5.0);
                plain(near, Motion::Rise, colour, 2.0)
            }
            Self::Smoke => {
                let colour = Colour::Ramp(&RAMP3, s.int(3, 4) + 2.0, 5.0);
                plain(near, Motion::Rise, colour, 2.0)
            }
            Self::Green | Self::Orange => {
                let first = if self == Self::Green { 52 } else { 230 };
                let aside = Vec3::new(along.y, -along.x, 0.0) * 30.0;
                Born {
                    id: s.0,
                    at,
                    velocity: if n % 2 == 1 { aside } else { -aside },
                    motion: Motion::Still,
                    colour: Colour::Fixed(first + ((n & 4) << 1) as u8),
                    life: 0.5,
                }
            }
            Self::Purple => {
                let colour = Colour::Fixed(152 + s.below(3, 4) as u8);
                plain(at + cube(16) - 8.0, Motion::Still, colour, 0.3)
            }
        }
    }
}

/// Number of directions of a bright field.
const FIELD: u32 = 162;

/// The sphere of particles around entity `number` at `time` seconds of the server's clock. They have the
/// velocity of their turning alone.
pub fn bright_field(number: u16, origin: Vec3, time: f64, out: &mut Vec<Particle>) {
    /// The particles' distance from the middle.
    const RADIUS: f32 = 64.0;
    /// Length of the beam each turns on.
    const BEAM: f32 = 16.0;
    /// Angle between neighbours on Vogel's spiral, which covers a sphere evenly.
    const GOLDEN: f32 = 2.399_963_2;
    let seed = Seed(FIELD.into());
    for i in 0..FIELD {
        let z = 1.0 - (2.0 * i as f32 + 1.0) / FIELD as f32;
        let (sin, cos) = (GOLDEN * i as f32).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        let n = Vec3::new(flat * cos, flat * sin, z);
        // Rates of 0 to 2.55 radians per second about two axes.
        let turn = |lane| {
            let rate = 0.01 * f64::from(seed.of(i.into()).below(lane, 256));
            let angle = (time * rate) % std::f64::consts::TAU;
            (rate as f32, (angle as f32).sin_cos())
        };
        let ((pitching, (sp, cp)), (yawing, (sy, cy))) = (turn(0), turn(1));
        let along = Vec3::new(cp * cy, cp * sy, -sp);
        let turning = Vec3::new(-sp * cy, -sp * sy, -cp) * pitching
            + Vec3::new(-cp * sy, cp * cy, 0.0) * yawing;
        out.push(Particle {
            id: seed.of(number.into()).of(i.into()).0,
            at: origin + n * RADIUS + along * BEAM,
            velocity: turning * BEAM,
            colour: 0x6f,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The engine's loop with a very short frame.
    fn stepped(born: &Born, age: f32) -> Vec3 {
        let steps = 100_000;
        let dt = f64::from(age) / f64::from(steps);
        let (mut at, mut v) = (born.at.as_dvec3(), born.velocity.as_dvec3());
        let grav = f64::from(GRAVITY) * dt;
        for _ in 0..steps {
            at += v * dt;
            match born.motion {
                Motion::Still => {}
                Motion::Fall => v.z -= grav,
                Motion::Rise => v.z += grav,
                Motion::Burst => {
                    v += v * 4.0 * dt;
                    v.z -= grav;
                }
                Motion::Brake => {
                    v -= v * dt;
                    v.z -= grav;
                }
                Motion::Flatten => {
                    v.x -= v.x * 4.0 * dt;
                    v.y -= v.y * 4.0 * dt;
                    v.z -= grav;
                }
            }
        }
        at.as_vec3()
    }

    #[test]
    fn closed_forms_are_the_limit_of_the_engines_steps() {
        for motion in [
            Motion::Still,
            Motion::Fall,
            Motion::Rise,
            Motion::Burst,
            Motion::Brake,
            Motion::Flatten,
        ] {
            let born = Born {
                id: 0,
                at: Vec3::new(1.0, 2.0, 3.0),
                velocity: Vec3::new(200.0, -100.0, 50.0),
                motion,
                colour: Colour::Fixed(0),
                life: 9.0,
            };
            for age in [0.0, 0.1, 0.7] {
                let found = born.at_age(age).unwrap().at;
                let off = (found - stepped(&born, age)).length();
                assert!(off < 0.05, "{motion:?} after {age} s: {off} away");
                // The middle of two places has the velocity of its moment, up to third derivatives.
                let near = |s: f32| (born.at + born.travelled(age + s)).as_dvec3();
                let step = 1.0 / 64.0;
                let slope = (near(step) - near(-step)) / f64::from(2.0 * step);
                let off = (slope.as_vec3() - born.velocity_at(age)).length();
                let fast = born.velocity_at(age).length();
                assert!(
                    off < 2e-3 * fast,
                    "{motion:?} after {age} s: {off} of {fast}"
                );
            }
        }
    }

    #[test]
    fn bursts_keep_to_their_colours_places_and_lives() {
        let at = Vec3::new(100.0, 0.0, -50.0);
        let colours = |burst: Burst, age: f32| -> Vec<u8> {
            let born = (0..burst.count()).map(|i| burst.born(i, at, Seed(7)));
            born.filter_map(|b| b.at_age(age))
                .map(|p| p.colour)
                .collect()
        };
        let puff = Burst::Puff {
            direction: Vec3::X,
            colour: 73,
            count: 200,
        };
        let found = colours(puff, 0.0);
        assert!(found.iter().all(|c| (72..80).contains(c)));
        // Lives of 0 to 0.4 seconds, evenly.
        assert!((120..200).contains(&found.len()), "{}", found.len());
        assert!(colours(puff, 0.4).is_empty());
        let lava = colours(Burst::Lava, LONGEST_BURST as f32 - 0.02);
        assert!(!lava.is_empty() && lava.iter().all(|c| *c >= 224));
        assert!(colours(Burst::Lava, LONGEST_BURST as f32).is_empty());
        let fire = colours(Burst::Explosion, 0.0);
        assert_eq!(fire.len(), 1024);
        // The slow half runs through its ramp in half a second, the other in 0.8.
        assert!((300..512).contains(&colours(Burst::Explosion, 0.534).len()));
        assert!(colours(Burst::Explosion, 0.81).is_empty());
        let range = Burst::Coloured {
            first: 10,
            count: 3,
        };
        assert!(colours(range, 0.1).iter().all(|c| (10..13).contains(c)));
        assert_eq!(colours(Burst::Teleport, 0.1).len(), 896);
        let mut field = Vec::new();
        bright_field(3, at, 1234.5, &mut field);
        assert_eq!(field.len(), 162);
        let mut later = Vec::new();
        bright_field(3, at, 1234.5 + 1.0 / 128.0, &mut later);
        for (a, b) in field.iter().zip(&later) {
            assert_eq!(a.id, b.id);
            let slope = (b.at - a.at) * 128.0;
            let mean = (a.velocity + b.velocity) / 2.0;
            assert!((slope - mean).length() < 0.02, "{slope} {mean}");
        }
        assert!(
            field
                .iter()
                .all(|p| (47.9..80.1).contains(&(p.at - at).length()))
        );
    }
}
