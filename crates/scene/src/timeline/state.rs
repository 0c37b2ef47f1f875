//! The state of everything at a moment.

use super::Timeline;
use super::fog::AskedFog;
use super::level::{Level, ModelName};
use super::particle::{self, LONGEST_BURST, Particle, Trail};
use super::seed::{Digest, Seed};
use super::tint::Tint;
use super::track::{FrameBlend, Place, Pose, Track};
use super::view::{Looking, Moment, View, ViewModel, axes};
use bsp::dem::{BeamKind, EntityState, effect};
use bsp::styles::{self, Blend};
use glam::Vec3;

/// Most particles at a moment, as in QuakeSpasm.
const MOST_PARTICLES: usize = 16_384;
/// Most lights; the largest are kept.
const MOST_LIGHTS: usize = 256;
/// Most beams; the newest are kept.
const MOST_BEAMS: usize = 256;
/// Seconds that a beam is seen after its message.
const BEAM_SECONDS: f64 = 0.2;
/// Seconds that the flash of a weapon is seen after its message.
const FLASH_SECONDS: f64 = 0.1;
/// Seconds that an explosion gives light.
const EXPLOSION_SECONDS: f64 = 0.5;

/// What is shown besides what the newest message has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Entities that the server did not send, because the player could not see them.
    pub unseen: Unseen,
    /// Light styles fade from letter to letter instead of stepping.
    pub smooth_styles: bool,
}

/// Which entities stay that the newest message does not have. For cameras that leave the player's
/// eye: servers send only what the player may see.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unseen {
    /// None, as in the engine.
    #[default]
    Hidden,
    /// Doors, lifts and the like: brush models of the level, where they were last seen, or where
    /// they began.
    Brushes,
    /// All but things that fly and sprites. What was taken or destroyed unseen stays too: a demo
    /// does not tell it from what is out of sight.
    All,
}

/// Everything at a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Timeline seconds.
    pub time: f64,
    /// The server's clock, seconds; animation and light styles go by it.
    pub clock: f64,
    /// Index of the level among [`Timeline::levels`].
    pub level: usize,
    /// Index of the newest message.
    pub message: usize,
    /// Entities with a model, by their numbers. That of the view is among them.
    pub entities: Vec<Entity>,
    /// So many of the level's statics are there.
    pub statics: usize,
    /// Bolts and beams.
    pub beams: Vec<Beam>,
    /// Lights that come and go.
    pub lights: Vec<DynamicLight>,
    /// Particles.
    pub particles: Vec<Particle>,
    /// Brightness of the light styles ([`bsp::styles`]); 1 shows lightmaps as stored.
    pub styles: Vec<f32>,
    /// What colours the screen.
    pub tint: Tint,
    /// Fog that the server asked for.
    pub fog: Option<AskedFog>,
    /// Pictures of the sky that the server asked for, among the level's skies.
    pub sky: Option<u32>,
    /// Who looks.
    pub view: View,
    /// The weapon in hand, if it is seen.
    pub view_model: Option<ViewModel>,
}

/// An entity with a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entity {
    /// Its number.
    pub number: u16,
    /// Index of its model among the level's.
    pub model: u16,
    /// Where it is, world space.
    pub origin: Vec3,
    /// Pitch, yaw, roll in degrees; for alias models a positive pitch is up, for all else down.
    pub angles: Vec3,
    /// Its frames.
    pub frame: FrameBlend,
    /// Its skin.
    pub skin: u16,
    /// Colours of shirt and trousers, shirt times 16 plus trousers, if it wears a player's.
    pub colours: Option<u8>,
    /// [`bsp::dem::effect`] flags.
    pub effects: u32,
    /// Opacity, 0 to 1.
    pub alpha: f32,
    /// Size, 1 as the model has it.
    pub scale: f32,
    /// Since when it has moved without a jump, timeline seconds: what moved between two moments has
    /// an earlier value than both.
    pub since: f64,
    /// 0 to 1: where in a cycle of frames it begins, for models that are not in step.
    pub phase: f32,
    /// The newest message does not have it; it is where it was last.
    pub is_remembered: bool,
}

/// A bolt or beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Who holds it.
    pub entity: u16,
    /// What it looks like.
    pub kind: BeamKind,
    /// From here ...
    pub start: Vec3,
    /// ... to here.
    pub end: Vec3,
    seed: Seed,
}

/// One of the models that make a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamPart {
    /// Where it is.
    pub origin: Vec3,
    /// Pitch (up is positive), yaw, roll in degrees.
    pub angles: Vec3,
}

impl Beam {
    /// What its part `number` is from one moment to the next, until it crackles.
    pub(crate) fn part_id(&self, number: usize) -> u64 {
        self.seed.of(number as u64).0
    }

    /// Distance from one part to the next.
    const PART: f32 = 30.0;
    /// Most parts.
    const MOST: usize = 256;

    /// The models that make it, from its start on.
    pub fn parts(&self) -> impl Iterator<Item = BeamPart> + '_ {
        let way = self.end - self.start;
        let count = (way.length() / Self::PART).ceil() as usize;
        let along = way.normalize_or_zero();
        let pitch = way.z.atan2(way.truncate().length()).to_degrees();
        let yaw = way.y.atan2(way.x).to_degrees();
        (0..count.min(Self::MOST)).map(move |i| BeamPart {
            origin: self.start + along * (Self::PART * i as f32),
            angles: Vec3::new(pitch, yaw, self.seed.int(i as u64, 360)),
        })
    }
}

/// What a light that comes and goes belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LightKind {
    /// The flash of a weapon.
    Flash,
    /// A strong light.
    Bright,
    /// A weak light.
    Dim,
    /// A rocket.
    Rocket,
    /// An explosion.
    Explosion,
}

/// A light that comes and goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DynamicLight {
    /// What it belongs to.
    pub kind: LightKind,
    /// Entity that carries it; 0 none.
    pub entity: u16,
    /// Where it is.
    pub at: Vec3,
    /// How far it reaches in the engine, units.
    pub reach: f32,
}

/// The state at `t`, when `message` is the newest.
pub(super) fn state(timeline: &Timeline, message: usize, t: f64, options: &Options) -> State {
    let now = &timeline.moments[message];
    let level = &timeline.levels[now.level as usize];
    let before = message.checked_sub(1).map(|i| &timeline.moments[i]);
    let scene = Shown {
        level,
        moments: &timeline.moments,
        now,
        index: message as u32,
        t,
        clock: now.window.clock - (now.window.end - t),
        seed: Seed(u64::from(now.level)),
    };
    let client = &timeline.clients[now.client as usize];
    let before = before.filter(|b| b.level == now.level);
    let client_before = before.map_or(client, |b| &timeline.clients[b.client as usize]);
    let body = scene.body();
    let (view, view_model) = Looking {
        level,
        now,
        before,
        client,
        client_before,
        body,
        t,
        clock: scene.clock,
        index: scene.index,
    }
    .look();
    let (entities, lights) = scene.entities(options.unseen);
    let mut state = State {
        time: t,
        clock: scene.clock,
        level: now.level as usize,
        message,
        statics: level.statics.partition_point(|s| s.moment <= scene.index),
        beams: scene.beams(body.origin),
        lights,
        particles: scene.particles(&entities),
        entities,
        styles: scene.styles(options.smooth_styles),
        tint: Tint::at(level, client, scene.index, now.intermission, t),
        fog: scene.last(&level.fogs, |f| f.moment).map(|f| f.at(t)),
        sky: scene.last(&level.sky_changes, |s| s.0).map(|s| s.1),
        view,
        view_model,
    };
    scene.explosions(&mut state.lights);
    if state.lights.len() > MOST_LIGHTS {
        state.lights.sort_by(|a, b| b.reach.total_cmp(&a.reach));
        state.lights.truncate(MOST_LIGHTS);
    }
    state
}

/// What a state is computed from.
struct Shown<'a> {
    level: &'a Level,
    moments: &'a [Moment],
    now: &'a Moment,
    index: u32,
    t: f64,
    clock: f64,
    seed: Seed,
}

impl<'a> Shown<'a> {
    /// The last of a list's entries that the newest message knows.
    fn last<T>(&self, list: &'a [T], moment: impl Fn(&T) -> u32) -> Option<&'a T> {
        let next = list.partition_point(|e| moment(e) <= self.index);
        next.checked_sub(1).and_then(|i| list.get(i))
    }

    fn track(&self, number: u16) -> Option<&'a Track> {
        let tracks = &self.level.tracks;
        let index = tracks.binary_search_by_key(&number, |t| t.number).ok()?;
        tracks.get(index)
    }

    /// Where the entity that looks is, or was last.
    fn body(&self) -> Place {
        let place = self.track(self.now.view_entity).and_then(|track| {
            let pose = track.pose(self.index, &self.now.window, self.t);
            let last = || {
                let state = track.last_seen(self.index)?;
                Some(Place {
                    origin: state.origin.into(),
                    angles: state.angles.into(),
                })
            };
            pose.map(|p| p.place).or_else(last)
        });
        place.unwrap_or_default()
    }

    fn model(&self, index: u16) -> Option<&'a ModelName> {
        self.level
            .models
            .get(usize::from(index))
            .filter(|m| !m.name.is_empty())
    }

    /// Entities with a model, and the lights that they carry.
    fn entities(&self, unseen: Unseen) -> (Vec<Entity>, Vec<DynamicLight>) {
        let (mut entities, mut lights) = (Vec::new(), Vec::new());
        let mut unmet = self.level.baselines.iter().peekable();
        for track in &self.level.tracks {
            // Baselines of entities that never appear.
            while let Some((n, state)) = unmet.next_if(|(n, _)| **n < track.number) {
                entities.extend(self.remembered(*n, None, Some(state), unseen));
            }
            let baseline = unmet.next_if(|(n, _)| **n == track.number).map(|(_, s)| s);
            let Some(key) = track.key_at(self.index) else {
                entities.extend(self.remembered(track.number, None, baseline, unseen));
                continue;
            };
            self.old_flash(track, key, &mut lights);
            match track.pose_of(key, self.index, &self.now.window, self.t) {
                Some(pose) => {
                    if let Some(model) = self.model(pose.state.model) {
                        let entity = self.entity(track.number, &pose, model);
                        self.carried(&entity, model, &mut lights);
                        entities.push(entity);
                    }
                }
                None => {
                    let last = track.last_seen(self.index);
                    entities.extend(self.remembered(track.number, last, baseline, unseen));
                }
            }
        }
        for (n, state) in unmet {
            entities.extend(self.remembered(*n, None, Some(state), unseen));
        }
        (entities, lights)
    }

    fn entity(&self, number: u16, pose: &Pose, model: &ModelName) -> Entity {
        let state = &pose.state;
        let mut angles = pose.place.angles;
        if model.flags & bsp::mdl::flags::ROTATE != 0 {
            angles.y = (100.0 * self.clock).rem_euclid(360.0) as f32;
        }
        let frame = if model.is_stiff {
            FrameBlend::still(state.frame)
        } else {
            pose.blend
        };
        let slot = state.colormap.checked_sub(1);
        let colours = slot.and_then(|s| self.level.colours.get(&s));
        Entity {
            number,
            model: state.model,
            origin: pose.place.origin,
            angles,
            frame,
            skin: state.skin,
            colours: colours.and_then(|c| self.last(c, |c| c.0)).map(|c| c.1),
            effects: state.effects,
            alpha: state.opacity(),
            scale: f32::from(state.scale) / 16.0,
            since: pose.since,
            phase: self.seed.of(u64::from(number)).unit(u64::from(state.model)),
            is_remembered: false,
        }
    }

    /// An entity that the newest message does not have, where the options keep it.
    fn remembered(
        &self,
        number: u16,
        last: Option<&EntityState>,
        baseline: Option<&EntityState>,
        unseen: Unseen,
    ) -> Option<Entity> {
        if unseen == Unseen::Hidden || number <= u16::from(self.level.max_players) {
            return None;
        }
        let state = last.or(baseline)?;
        let model = self.model(state.model)?;
        let stays = match unseen {
            Unseen::Brushes => model.name.starts_with('*'),
            _ => Trail::of_flags(model.flags).is_none() && !model.name.ends_with(".spr"),
        };
        let pose = Pose {
            state: EntityState {
                effects: 0,
                ..*state
            },
            place: Place {
                origin: state.origin.into(),
                angles: state.angles.into(),
            },
            blend: FrameBlend::still(state.frame),
            since: self.level.span.0,
        };
        stays.then(|| Entity {
            is_remembered: true,
            ..self.entity(number, &pose, model)
        })
    }

    /// The light that an entity carries. An entity has one at most: the last of several holds.
    fn carried(&self, entity: &Entity, model: &ModelName, lights: &mut Vec<DynamicLight>) {
        /// The middle of what the engine throws dice for in every frame.
        const MIDDLE: f32 = 15.0;
        let has = |bit: u32| entity.effects & bit != 0;
        let light = |kind, at, reach| DynamicLight {
            kind,
            entity: entity.number,
            at,
            reach,
        };
        let found = if model.flags & bsp::mdl::flags::ROCKET != 0 {
            Some(light(LightKind::Rocket, entity.origin, 200.0))
        } else if has(effect::DIM_LIGHT) {
            Some(light(LightKind::Dim, entity.origin, 200.0 + MIDDLE))
        } else if has(effect::BRIGHT_LIGHT) {
            let at = entity.origin + Vec3::Z * 16.0;
            Some(light(LightKind::Bright, at, 400.0 + MIDDLE))
        } else {
            has(effect::MUZZLE_FLASH).then(|| {
                let place = Place {
                    origin: entity.origin,
                    angles: entity.angles,
                };
                self.flash(entity.number, &place, self.index)
            })
        };
        if let Some(found) = found {
            // It takes the place of a flash that fades.
            lights.retain(|l| l.entity != entity.number);
            lights.push(found);
        }
    }

    fn flash(&self, number: u16, place: &Place, moment: u32) -> DynamicLight {
        let seed = self.seed.of(u64::from(number)).of(u64::from(moment));
        let [forward, ..] = axes(place.angles);
        DynamicLight {
            kind: LightKind::Flash,
            entity: number,
            at: place.origin + Vec3::Z * 16.0 + forward * 18.0,
            reach: 200.0 + seed.int(0, 32),
        }
    }

    /// The flash of a weapon goes on a little after its message.
    fn old_flash(&self, track: &Track, key: usize, lights: &mut Vec<DynamicLight>) {
        for i in (0..key).rev() {
            let (Some(old), Some(next)) = (track.keys.get(i), track.keys.get(i + 1)) else {
                return;
            };
            let last = next.moment - 1;
            let Some(moment) = self.moments.get(last as usize) else {
                return;
            };
            if self.t >= moment.window.end + FLASH_SECONDS {
                return;
            }
            let Some(state) = &old.state else { continue };
            if state.effects & effect::MUZZLE_FLASH != 0 && self.model(state.model).is_some() {
                let place = Place {
                    origin: state.origin.into(),
                    angles: state.angles.into(),
                };
                lights.push(self.flash(track.number, &place, last));
                return;
            }
        }
    }

    /// Explosions give light that shrinks.
    fn explosions(&self, lights: &mut Vec<DynamicLight>) {
        let first = self.t - EXPLOSION_SECONDS;
        let from = self.level.bursts.partition_point(|b| b.begin <= first);
        let recent = self.level.bursts.iter().skip(from);
        for burst in recent
            .take_while(|b| b.moment <= self.index)
            .filter(|b| b.lights)
        {
            lights.push(DynamicLight {
                kind: LightKind::Explosion,
                entity: 0,
                at: burst.at,
                reach: 350.0 - 300.0 * (self.t - burst.begin) as f32,
            });
        }
    }

    fn beams(&self, eye: Vec3) -> Vec<Beam> {
        /// Times a second that beams crackle.
        const CRACKLE: f64 = 30.0;
        let tick = (self.t * CRACKLE).floor() as u64;
        let from = self
            .level
            .beams
            .partition_point(|b| b.begin <= self.t - BEAM_SECONDS);
        let next = self.level.beams.partition_point(|b| b.moment <= self.index);
        let mut found: Vec<Beam> = Vec::new();
        for beam in self
            .level
            .beams
            .get(from..next)
            .unwrap_or_default()
            .iter()
            .rev()
        {
            if found.len() == MOST_BEAMS {
                break;
            }
            if found.iter().any(|b| b.entity == beam.entity) {
                continue;
            }
            let held = beam.entity == self.now.view_entity;
            found.push(Beam {
                entity: beam.entity,
                kind: beam.kind,
                start: if held { eye } else { beam.start },
                end: beam.end,
                seed: beam.seed.of(tick),
            });
        }
        found
    }

    /// The newest first, up to the most there can be.
    fn particles(&self, entities: &[Entity]) -> Vec<Particle> {
        let mut out = Vec::new();
        for entity in entities
            .iter()
            .filter(|e| e.effects & effect::BRIGHT_FIELD != 0)
        {
            if out.len() < MOST_PARTICLES {
                particle::bright_field(entity.number, entity.origin, self.clock, &mut out);
            }
        }
        let bursts = &self.level.bursts;
        let from = bursts.partition_point(|b| b.begin <= self.t - LONGEST_BURST);
        let next = bursts.partition_point(|b| b.moment <= self.index);
        for event in bursts.get(from..next).unwrap_or_default().iter().rev() {
            if out.len() >= MOST_PARTICLES {
                break;
            }
            let age = (self.t - event.begin) as f32;
            let born = (0..event.burst.count()).map(|i| event.burst.born(i, event.at, event.seed));
            out.extend(born.filter_map(|b| b.at_age(age)));
        }
        for run in self.level.trails.iter().rev() {
            let room = MOST_PARTICLES.saturating_sub(out.len());
            if room == 0 {
                break;
            }
            run.particles(self.t, room, &mut out);
        }
        out.truncate(MOST_PARTICLES);
        out
    }

    fn styles(&self, smooth: bool) -> Vec<f32> {
        let blend = if smooth { Blend::Linear } else { Blend::Step };
        (0..styles::COUNT as u8)
            .map(|style| {
                let changes = self.level.styles.get(&style);
                let letters = changes.and_then(|c| self.last(c, |c| c.0));
                let letters = letters.map_or(&[][..], |(_, l)| l.as_slice());
                styles::brightness(letters, self.clock, blend)
            })
            .collect()
    }
}

impl State {
    /// A number that two states share if they are equal in every bit, and hardly otherwise.
    pub fn hash(&self) -> u64 {
        let mut d = Digest::new();
        d.add_f64(self.time);
        d.add_f64(self.clock);
        for n in [self.level, self.message, self.statics, self.entities.len()] {
            d.add(n as u64);
        }
        for e in &self.entities {
            for n in [e.number, e.model, e.skin] {
                d.add(u64::from(n));
            }
            add_place(&mut d, e.origin, e.angles, e.frame);
            d.add(e.colours.map_or(256, u64::from));
            d.add(u64::from(e.effects) << 1 | u64::from(e.is_remembered));
            d.add_f32(e.alpha);
            d.add_f32(e.scale);
            d.add_f32(e.phase);
            d.add_f64(e.since);
        }
        d.add(self.beams.len() as u64);
        for b in &self.beams {
            d.add(u64::from(b.entity));
            d.add(b.kind as u64);
            d.add_vec(b.start);
            d.add_vec(b.end);
            d.add(b.seed.0);
        }
        d.add(self.lights.len() as u64);
        for l in &self.lights {
            d.add(u64::from(l.entity) << 8 | l.kind as u64);
            d.add_vec(l.at);
            d.add_f32(l.reach);
        }
        d.add(self.particles.len() as u64);
        for p in &self.particles {
            d.add(p.id);
            d.add_vec(p.at);
            d.add_vec(p.velocity);
            d.add(u64::from(p.colour));
        }
        let fog = self.fog.iter().flat_map(AskedFog::numbers);
        for s in self.styles.iter().copied().chain(fog) {
            d.add_f32(s);
        }
        self.tint.digest(&mut d);
        d.add(self.sky.map_or(u64::MAX, u64::from));
        let v = &self.view;
        d.add(u64::from(v.entity) << 8 | u64::from(v.intermission));
        d.add_vec(v.eye);
        d.add_vec(v.angles);
        d.add_f64(v.since);
        d.add(v.health as u64);
        if let Some(w) = &self.view_model {
            d.add(u64::from(w.model));
            add_place(&mut d, w.origin, w.angles, w.frame);
            d.add_f32(w.alpha);
        }
        d.finish()
    }
}

fn add_place(d: &mut Digest, origin: Vec3, angles: Vec3, frame: FrameBlend) {
    d.add_vec(origin);
    d.add_vec(angles);
    d.add(u64::from(frame.from) << 16 | u64::from(frame.to));
    d.add_f32(frame.fraction);
}
