//! One pass over a demo's messages makes the tables that a timeline answers from.

use super::fog::{AskedFog, FogChange};
use super::level::{BeamEvent, BurstEvent, Level, ModelName, Static, WeaponKey};
use super::particle::Burst;
use super::seed::Seed;
use super::text::{Command, Commands};
use super::track::{Blend, Track, Window, is_jump};
use super::view::{self, Moment};
use super::{Timeline, trail};
use bsp::dem::{
    ClientData, Demo, EntityUpdate, MAX_PRECACHES, Message, PointEffect, Precache, ServerInfo,
    TempEntity, clock_step, effect, entity_flag, plain_text,
};
use bsp::{WarningKind, Warnings};
use glam::Vec3;
use std::collections::BTreeMap;

/// Gaps between messages longer than this are waited out before things move.
const LONGEST_WINDOW: f64 = 0.1;
/// Most changes of entities that are kept: some gigabytes of them.
const MOST_KEYS: usize = 1 << 24;
/// Most statics of a level.
const MOST_STATICS: usize = 1 << 16;

/// Makes the tables of a demo. `flags` are those of models by their file's name, if it is at hand.
pub(super) fn build(
    demo: &Demo<'_>,
    flags: &dyn Fn(&str) -> Option<u32>,
    warnings: &mut Warnings,
) -> Timeline {
    let mut builder = Builder {
        out: Timeline::default(),
        flags,
        level: None,
        keys: 0,
    };
    let mut player = demo.player();
    for block in &demo.blocks {
        let angles = Vec3::from(block.view_angles);
        let persist = player.entities_persist();
        let read = player.next_block(warnings, |message| {
            builder.message(&message, angles, persist)
        });
        if read.is_none() {
            break;
        }
        builder.end_block(angles);
        if builder.keys > MOST_KEYS {
            warnings.add(WarningKind::DemoTruncated, "changes", || {
                format!("more than {MOST_KEYS} changes of entities; the demo is left there")
            });
            break;
        }
    }
    builder.end_level();
    builder.out
}

struct Builder<'a> {
    out: Timeline,
    flags: &'a dyn Fn(&str) -> Option<u32>,
    level: Option<Building>,
    keys: usize,
}

/// The level being built.
#[derive(Default)]
struct Building {
    level: Level,
    /// With the server's clock when each was last in a message.
    tracks: BTreeMap<u16, (Track, f64)>,
    /// Entities of the newest message, and of the one being read.
    shown: BTreeMap<u16, EntityUpdate>,
    next: BTreeMap<u16, EntityUpdate>,
    clock: f32,
    /// Since the newest moment there has been a time, an entity, something that turns the view.
    has_time: bool,
    has_entities: bool,
    turned: bool,
    client: ClientData,
    has_client: bool,
    view_entity: u16,
    intermission: u8,
    commands: Commands,
    /// What happens in the message being read and waits for its window.
    happens: Vec<Happening>,
}

/// What needs to know when it begins.
enum Happening {
    Burst(Burst, Vec3, bool),
    Beam(bsp::dem::BeamKind, u16, Vec3, Vec3),
    Hurt(u8, u8, Vec3),
    Bonus,
    Fog(AskedFog, f64),
}

impl Building {
    fn new(info: &ServerInfo<'_>, flags: &dyn Fn(&str) -> Option<u32>, first: usize) -> Self {
        let names = info.models.iter().map(|name| latin1(name));
        let models = std::iter::once(String::new()).chain(names);
        let models = models.map(|name| {
            let flags = flags(&name);
            ModelName::new(name, flags)
        });
        Self {
            level: Level {
                map: info.models.first().map_or(String::new(), |m| latin1(m)),
                title: plain_text(info.level_name),
                protocol: info.protocol,
                max_players: info.max_players,
                models: models.collect(),
                moments: first..first,
                ..Level::default()
            },
            view_entity: 1,
            ..Self::default()
        }
    }

    fn sky(&mut self, name: String, moment: u32) {
        let skies = &mut self.level.skies;
        let index = skies.iter().position(|s| *s == name).unwrap_or_else(|| {
            skies.push(name);
            skies.len() - 1
        });
        self.level.sky_changes.push((moment, index as u32));
    }

    /// Notes what a point effect looks like.
    fn point(&mut self, kind: PointEffect, at: Vec3) {
        let puff = |colour, count| Burst::Puff {
            direction: Vec3::ZERO,
            colour,
            count,
        };
        let burst = match kind {
            PointEffect::Spike => puff(0, 10),
            PointEffect::SuperSpike | PointEffect::Gunshot => puff(0, 20),
            PointEffect::WizardSpike => puff(20, 30),
            PointEffect::KnightSpike => puff(226, 20),
            PointEffect::Explosion => Burst::Explosion,
            PointEffect::TarExplosion => Burst::Blob,
            PointEffect::LavaSplash => Burst::Lava,
            PointEffect::Teleport => Burst::Teleport,
        };
        let lights = kind == PointEffect::Explosion;
        self.happens.push(Happening::Burst(burst, at, lights));
    }

    fn effect(&mut self, effect: &TempEntity) {
        match *effect {
            TempEntity::Point { kind, at } => self.point(kind, at.into()),
            TempEntity::ColouredExplosion { at, first, count } => {
                let burst = Burst::Coloured { first, count };
                self.happens.push(Happening::Burst(burst, at.into(), true));
            }
            TempEntity::Beam {
                kind,
                entity,
                start,
                end,
            } => {
                let beam = Happening::Beam(kind, entity, start.into(), end.into());
                self.happens.push(beam);
            }
            TempEntity::Weather => {}
        }
    }

    fn command(&mut self, command: Command, moment: u32) {
        match command {
            Command::Bonus => self.happens.push(Happening::Bonus),
            Command::Shift(shift) => self.level.shifts.push((moment, shift)),
            Command::Fog(fog, seconds) => self.happens.push(Happening::Fog(fog, seconds)),
            Command::Sky(name) => self.sky(name, moment),
        }
    }

    /// Gives what happened its time.
    fn settle(&mut self, moment: u32, window: &Window, angles: Vec3, level: u64) {
        let begin = window.start;
        let seed = Seed(level).of(u64::from(moment));
        let happens = std::mem::take(&mut self.happens);
        for (i, happening) in happens.into_iter().enumerate() {
            let seed = seed.of(i as u64);
            match happening {
                Happening::Burst(burst, at, lights) => self.level.bursts.push(BurstEvent {
                    moment,
                    begin,
                    at,
                    burst,
                    seed,
                    lights,
                }),
                Happening::Beam(kind, entity, start, end) => self.level.beams.push(BeamEvent {
                    moment,
                    begin,
                    entity,
                    kind,
                    start,
                    end,
                    seed,
                }),
                Happening::Hurt(armor, blood, from) => {
                    let origin = self.view_origin();
                    let hurts = &mut self.level.hurts;
                    let left = hurts.last().map_or(0.0, |h| h.percent_at(begin));
                    hurts.push(
                        view::hurt(armor, blood, from - origin, angles, left).at(moment, begin),
                    );
                }
                Happening::Bonus => self.level.bonuses.push((moment, begin)),
                Happening::Fog(to, seconds) => {
                    let last = self.level.fogs.last();
                    let from = last.map_or(AskedFog::LEVEL, |f| f.at(begin));
                    self.level.fogs.push(FogChange {
                        moment,
                        begin,
                        from,
                        to,
                        seconds,
                    });
                }
            }
        }
    }

    fn view_state(&self) -> Option<&EntityUpdate> {
        let now = self.next.get(&self.view_entity);
        now.or_else(|| self.shown.get(&self.view_entity))
    }

    fn view_origin(&self) -> Vec3 {
        self.view_state()
            .map_or(Vec3::ZERO, |u| u.state.origin.into())
    }

    /// What the view model shows from this message on.
    fn weapon(&mut self, moment: u32, window: &Window) {
        let view = self.next.get(&self.view_entity);
        let flash = view.is_some_and(|u| u.state.effects & effect::MUZZLE_FLASH != 0);
        let finish = view.and_then(|u| u.lerp_finish);
        let finish = finish.map(|s| window.end + f64::from(s));
        let (model, frame) = (self.client.weapon, self.client.weapon_frame);
        let last = self.level.weapons.last();
        let blend = match last {
            Some(key) if key.model == model => key.blend.next(frame, flash, window, finish),
            _ => Blend::still(frame),
        };
        let key = WeaponKey {
            moment,
            model,
            blend,
            flash,
        };
        if last.is_none_or(|l| (l.model, l.blend) != (model, blend)) {
            self.level.weapons.push(key);
        }
    }
}

impl Builder<'_> {
    fn message(&mut self, message: &Message<'_>, angles: Vec3, persist: bool) {
        if let Message::ServerInfo(info) = message {
            self.end_level();
            let first = self.out.moments.len();
            self.level = Some(Building::new(info, self.flags, first));
            return;
        }
        let moment = self.out.moments.len() as u32;
        let Some(now) = &mut self.level else {
            return;
        };
        match message {
            Message::Time(time) => {
                if now.has_entities && now.has_time {
                    self.end_moment(angles);
                }
                let Some(now) = &mut self.level else {
                    return;
                };
                now.clock = *time;
                now.has_time = true;
                if !persist {
                    now.next.clear();
                }
            }
            Message::Entity(update) => {
                now.next.insert(update.number, *update);
                now.has_entities = true;
            }
            Message::Remove(number) => {
                now.next.remove(number);
                now.has_entities = true;
            }
            Message::RemoveAll => now.next.clear(),
            Message::Client(client) => {
                now.client = *client;
                now.has_client = true;
            }
            Message::Stat(index, value) => now.client.set_stat(*index, *value),
            Message::SetView(number) => now.view_entity = *number,
            Message::SetAngle(_) => now.turned = true,
            Message::Intermission => now.intermission = 1,
            Message::Finale(_) => now.intermission = 2,
            Message::Cutscene(_) => now.intermission = 3,
            Message::LightStyle(style, letters) => {
                let styles = now.level.styles.entry(*style).or_default();
                styles.push((moment, letters.to_vec()));
            }
            Message::Colours(slot, colours) => {
                let changes = now.level.colours.entry(*slot).or_default();
                changes.push((moment, *colours));
            }
            Message::Baseline(number, state) => drop(now.level.baselines.insert(*number, *state)),
            Message::Static(state) if now.level.statics.len() < MOST_STATICS => {
                let state = *state;
                now.level.statics.push(Static { state, moment });
            }
            Message::TempEntity(effect) => now.effect(effect),
            Message::Particles {
                at,
                direction,
                count,
                colour,
            } => {
                let burst = Burst::Puff {
                    direction: Vec3::from(*direction),
                    colour: *colour,
                    count: *count,
                };
                let at = Vec3::from(*at);
                now.happens.push(Happening::Burst(burst, at, false));
            }
            Message::Damage { armor, blood, from } => {
                let hurt = Happening::Hurt(*armor, *blood, Vec3::from(*from));
                now.happens.push(hurt);
            }
            Message::BonusFlash => now.happens.push(Happening::Bonus),
            Message::Fog {
                density,
                colour: [r, g, b],
                seconds,
            } => {
                let fog = AskedFog::of([*density, *r, *g, *b]);
                // Commands that leave out a part of it go on from here.
                now.commands.fog = fog;
                now.happens.push(Happening::Fog(fog, f64::from(*seconds)));
            }
            Message::Skybox(name) => now.sky(plain_text(name), moment),
            Message::StuffText(text) => {
                for command in now.commands.read(text) {
                    now.command(command, moment);
                }
            }
            Message::Precache(Precache::Model, index, name) => {
                let index = usize::from(*index);
                if index > 0 && index <= MAX_PRECACHES {
                    let models = &mut now.level.models;
                    if models.len() <= index {
                        models.resize(index + 1, ModelName::default());
                    }
                    let name = latin1(name);
                    let flags = (self.flags)(&name);
                    models[index] = ModelName::new(name, flags);
                }
            }
            _ => {}
        }
    }

    fn end_block(&mut self, angles: Vec3) {
        if let Some(now) = &self.level {
            // A level begins to show with its first entities.
            let shows = !now.level.moments.is_empty();
            if now.has_entities || shows && now.has_time {
                self.end_moment(angles);
            }
        }
    }

    /// The message read is the newest now.
    fn end_moment(&mut self, angles: Vec3) {
        let index = self.out.moments.len();
        let moment = index as u32;
        let levels = self.out.levels.len() as u64;
        let Some(now) = &mut self.level else {
            return;
        };
        let is_first = now.level.moments.is_empty();
        let last = self.out.moments.last();
        let window = match last {
            Some(last) if !is_first => {
                let end = last.window.end + clock_step(last.window.clock as f32, now.clock);
                Window {
                    start: last.window.end.max(end - LONGEST_WINDOW),
                    end,
                    clock: f64::from(now.clock),
                }
            }
            _ => {
                let at = last.map_or(0.0, |m| m.window.end);
                Window {
                    start: at,
                    end: at,
                    clock: f64::from(now.clock),
                }
            }
        };
        for (number, update) in &now.next {
            let (track, seen) = now.tracks.entry(*number).or_insert_with(|| {
                let number = *number;
                let keys = Vec::new();
                (Track { number, keys }, f64::NEG_INFINITY)
            });
            let last_seen = seen.is_finite().then_some(*seen);
            self.keys += usize::from(track.see(moment, &window, update, last_seen));
            *seen = window.clock;
        }
        for number in now.shown.keys() {
            if !now.next.contains_key(number)
                && let Some((track, _)) = now.tracks.get_mut(number)
            {
                self.keys += usize::from(track.miss(moment));
            }
        }
        now.settle(moment, &window, angles, levels);
        now.weapon(moment, &window);
        let view = now.next.get(&now.view_entity).map(|u| u.state);
        if !now.has_client
            && let Some(state) = view
        {
            // Where the player's own data is not sent, its entity has the speed.
            now.client.velocity = state.velocity;
            now.client.on_ground = state.flags & entity_flag::ON_GROUND != 0;
        }
        if self.out.clients.last() != Some(&now.client) {
            self.out.clients.push(now.client);
        }
        let before = last.filter(|_| !is_first);
        let origin = Vec3::from(now.view_state().map_or([0.0; 3], |u| u.state.origin));
        let jumps = before
            .is_none_or(|b| b.view_entity != now.view_entity || is_jump(b.view_origin, origin));
        let lag = before.filter(|_| !jumps && now.client.on_ground);
        let lag = lag.map_or(0.0, |b| {
            b.lag_after(origin.z - b.view_origin.z, window.end - b.window.end)
        });
        let turned = jumps || now.turned;
        let since = before.filter(|_| !turned).map_or(window.start, |b| b.since);
        self.out.moments.push(Moment {
            window,
            level: levels as u32,
            angles,
            turned,
            since,
            view_entity: now.view_entity,
            view_origin: origin,
            client: self.out.clients.len() as u32 - 1,
            lag,
            jumps,
            intermission: now.intermission,
            entities: now.next.len() as u32,
        });
        now.level.moments.end = index + 1;
        now.shown = now.next.clone();
        (now.has_time, now.has_entities, now.turned) = (false, false, false);
    }

    /// The level is complete.
    fn end_level(&mut self) {
        let Some(building) = self.level.take() else {
            return;
        };
        let mut level = building.level;
        level.tracks = building.tracks.into_values().map(|(t, _)| t).collect();
        let moments = self.out.moments.get(level.moments.clone());
        let moments = moments.unwrap_or_default();
        let at = |m: Option<&Moment>| m.map_or(0.0, |m| m.window.end);
        level.span = (at(moments.first()), at(moments.last()));
        level.trails = trail::runs(&level, moments, self.out.levels.len() as u64);
        self.out.levels.push(level);
    }
}

/// Bytes as text, each byte the character of the same number.
fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&b| char::from(b)).collect()
}
