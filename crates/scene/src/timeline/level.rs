//! What a timeline keeps of one level of a demo.

use super::fog::FogChange;
use super::particle::{Burst, Trail};
use super::seed::Seed;
use super::track::{Blend, Track};
use bsp::dem::{BeamKind, EntityState};
use glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// One level of a demo.
#[derive(Clone, Debug, Default)]
pub struct Level {
    /// Its file, `maps/e1m1.bsp`.
    pub map: String,
    /// Its title.
    pub title: String,
    /// 15, 666 or 999.
    pub protocol: i32,
    /// Slots for players; entities 1 up to this are players.
    pub max_players: u8,
    /// Its models by the index that entities have; the first is empty, the second the level itself.
    pub models: Vec<ModelName>,
    /// Entities that stay for good, in the order they appear.
    pub statics: Vec<Static>,
    /// What the sky's pictures are called, in the order they are set.
    pub skies: Vec<String>,
    /// Timeline seconds from its first to its last message.
    pub span: (f64, f64),
    /// Its messages among the timeline's moments.
    pub(super) moments: Range<usize>,
    /// What entities do, by their numbers.
    pub(super) tracks: Vec<Track>,
    /// What entities are before they are seen.
    pub(super) baselines: BTreeMap<u16, EntityState>,
    pub(super) styles: BTreeMap<u8, Vec<(u32, Vec<u8>)>>,
    pub(super) colours: BTreeMap<u8, Vec<(u32, u8)>>,
    pub(super) sky_changes: Vec<(u32, u32)>,
    pub(super) fogs: Vec<FogChange>,
    pub(super) bursts: Vec<BurstEvent>,
    pub(super) beams: Vec<BeamEvent>,
    pub(super) hurts: Vec<HurtEvent>,
    pub(super) bonuses: Vec<(u32, f64)>,
    pub(super) shifts: Vec<(u32, [f32; 4])>,
    pub(super) trails: Vec<TrailRun>,
    pub(super) weapons: Vec<WeaponKey>,
}

/// A model that a level's entities can show.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelName {
    /// Its file, or `*N` for brush model N of the level.
    pub name: String,
    /// Its flags, as in the model's file ([`bsp::mdl::flags`]).
    pub flags: u32,
    /// Its poses are never blended.
    pub is_stiff: bool,
}

impl ModelName {
    /// A model by its name. Its flags are what the file says, or those that the model of that name
    /// has in the game.
    pub fn new(name: String, flags: Option<u32>) -> Self {
        const STIFF: [&str; 8] = [
            "progs/flame.mdl",
            "progs/flame2.mdl",
            "progs/braztall.mdl",
            "progs/brazshrt.mdl",
            "progs/longtrch.mdl",
            "progs/flame_pyre.mdl",
            "progs/v_saw.mdl",
            "progs/v_xfist.mdl",
        ];
        Self {
            flags: flags.unwrap_or_else(|| usual_flags(&name)),
            is_stiff: STIFF.contains(&name.as_str()),
            name,
        }
    }

    /// Whether it is a brush model, of this level or in a file of its own.
    pub fn is_brush(&self) -> bool {
        self.name.starts_with('*') || self.name.ends_with(".bsp")
    }
}

/// Flags that the game's own models have, for models whose file is not at hand.
fn usual_flags(name: &str) -> u32 {
    use bsp::mdl::flags as f;
    let stem = name.strip_prefix("progs/").unwrap_or(name);
    let stem = stem.strip_suffix(".mdl").unwrap_or(stem);
    match stem {
        "missile" | "lavaball" => f::ROCKET,
        "grenade" => f::GRENADE,
        "gib1" | "gib2" | "gib3" => f::GIB,
        "zom_gib" => f::ZOMBIE_GIB,
        "w_spike" => f::TRACER,
        "k_spike" => f::TRACER2,
        "v_spike" => f::TRACER3,
        "backpack" | "armor" | "quaddama" | "invisibl" | "invulner" | "suit" => f::ROTATE,
        "end1" | "end2" | "end3" | "end4" => f::ROTATE,
        "w_s_key" | "w_g_key" | "m_s_key" | "m_g_key" | "b_s_key" | "b_g_key" => f::ROTATE,
        _ if stem.starts_with("h_") => f::GIB,
        _ if stem.starts_with("g_") => f::ROTATE,
        _ => 0,
    }
}

/// An entity that stays for good.
#[derive(Clone, Debug, PartialEq)]
pub struct Static {
    /// What it is.
    pub state: EntityState,
    /// First message that shows it.
    pub(super) moment: u32,
}

/// Many particles at once, and the light of some of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BurstEvent {
    pub moment: u32,
    pub begin: f64,
    pub at: Vec3,
    pub burst: Burst,
    pub seed: Seed,
    /// It gives light.
    pub lights: bool,
}

/// A beam appears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BeamEvent {
    pub moment: u32,
    pub begin: f64,
    pub entity: u16,
    pub kind: BeamKind,
    pub start: Vec3,
    pub end: Vec3,
    pub seed: Seed,
}

/// The player is hurt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HurtEvent {
    pub moment: u32,
    pub begin: f64,
    /// Percent of red afterwards, with what is left of earlier ones.
    pub percent: f32,
    pub colour: Vec3,
    /// Degrees that the view is kicked by.
    pub pitch: f32,
    pub roll: f32,
}

/// An entity that leaves a trail, from where it appears or jumps to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrailRun {
    pub trail: Trail,
    pub seed: Seed,
    pub points: Vec<TrailPoint>,
}

/// Where a trail passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TrailPoint {
    pub time: f64,
    pub at: Vec3,
    /// Way from the trail's beginning, units.
    pub way: f64,
}

/// The view model from a message on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WeaponKey {
    pub moment: u32,
    pub model: u16,
    pub blend: Blend,
    pub flash: bool,
}

impl Level {
    /// Whether the server changes the fog.
    pub fn changes_fog(&self) -> bool {
        !self.fogs.is_empty()
    }

    /// Every model that entities, statics and the player's hand ever show, with the opacity that it has.
    pub(crate) fn shown(&self) -> impl Iterator<Item = (u16, f32)> {
        let keys = self.tracks.iter().flat_map(|t| &t.keys);
        let states = keys.filter_map(|k| k.state.as_ref());
        let statics = self.statics.iter().map(|s| &s.state);
        let all = states.chain(statics).chain(self.baselines.values());
        let hands = self.weapons.iter().map(|w| (w.model, 0));
        let seen: BTreeSet<(u16, u8)> = all.map(|s| (s.model, s.alpha)).chain(hands).collect();
        seen.into_iter().map(|(model, alpha)| {
            let state = EntityState {
                alpha,
                ..EntityState::default()
            };
            (model, state.opacity())
        })
    }

    /// Colours that players ever wear.
    pub(crate) fn worn(&self) -> impl Iterator<Item = u8> + '_ {
        self.colours.values().flatten().map(|(_, colours)| *colours)
    }

    /// Bolts and beams that appear.
    pub(crate) fn beam_kinds(&self) -> impl Iterator<Item = BeamKind> + '_ {
        self.beams.iter().map(|b| b.kind)
    }
}

impl Static {
    /// It as an entity; `index` tells it from others.
    pub(crate) fn entity(&self, index: usize, level: &Level) -> super::Entity {
        let state = &self.state;
        super::Entity {
            number: 0,
            model: state.model,
            origin: state.origin.into(),
            angles: state.angles.into(),
            frame: super::FrameBlend::still(state.frame),
            skin: state.skin,
            colours: None,
            effects: state.effects,
            alpha: state.opacity(),
            scale: f32::from(state.scale) / 16.0,
            since: level.span.0,
            phase: Seed(index as u64).unit(u64::from(state.model)),
            is_remembered: false,
        }
    }
}
