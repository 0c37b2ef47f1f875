//! What point entities show: the tables of the game code and of its mission packs, and what unknown
//! classes say themselves.

use super::ImportOptions;
use bsp::entity::Entity;
use glam::Vec3;
use std::borrow::Cow;

/// Idle animations of the game code play so many frames a second.
const FRAMES_PER_SECOND: f64 = 10.0;

/// A point entity that shows something.
#[derive(Clone, Debug, PartialEq)]
pub struct Inhabitant<'a> {
    /// Game path of what it shows.
    pub file: Cow<'a, str>,
    /// Its class.
    pub classname: &'a str,
    /// Where the level has it, world space.
    pub origin: Vec3,
    /// Pitch, yaw and roll in degrees.
    pub angles_deg: [f32; 3],
    /// First frame of its animation, and how many there are.
    pub frames: (u32, u32),
    /// Which skin.
    pub skin: u32,
    /// How it comes to rest.
    pub rest: Rest,
    /// Its size, 1 as the file has it.
    pub scale: f32,
    /// Coverage that it asks for, 1 opaque.
    pub alpha: Option<f32>,
    /// Whether it gives light by itself, as a light entity.
    pub is_lamp: bool,
}

/// How an entity comes to rest when a level begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// It stays where the level has it.
    Stays,
    /// An item whose box begins at its origin's height.
    Item,
    /// An item box: its origin is the box's corner.
    Corner,
    /// A barrel: likewise, but less high up.
    Barrel,
    /// A key or artifact, whose box begins 24 units below.
    Key,
    /// What walks and is as wide as a player.
    Walker,
    /// What walks and is wider.
    Wide,
}

impl Rest {
    /// By how much game code lifts it before it falls, which hull falls, and the way from its origin to
    /// the point that the hull moves; `None` if it stays.
    pub fn fall(self) -> Option<(f32, usize, Vec3)> {
        let above = Vec3::Z * 24.0;
        Some(match self {
            Self::Stays => return None,
            Self::Item => (6.0, 1, above),
            Self::Corner => (6.0, 1, Vec3::new(16.0, 16.0, 24.0)),
            Self::Barrel => (2.0, 1, Vec3::new(16.0, 16.0, 24.0)),
            Self::Key => (6.0, 1, Vec3::ZERO),
            Self::Walker => (1.0, 1, Vec3::ZERO),
            Self::Wide => (1.0, 2, Vec3::ZERO),
        })
    }
}

impl Inhabitant<'_> {
    /// The frame on show at `time` (seconds), the one that follows, and how far it is on its way there;
    /// `seed` tells entities apart that do not move in step.
    pub fn frame_at(&self, time: f64, seed: u32) -> (usize, usize, f32) {
        let (first, count) = self.frames;
        let count = count.max(1);
        if count == 1 {
            return (first as usize, first as usize, 0.0);
        }
        let ticks = time * FRAMES_PER_SECOND + f64::from(seed % count);
        let at = ticks.floor().rem_euclid(f64::from(count)) as u32;
        let frame = |i: u32| (first + i % count) as usize;
        (frame(at), frame(at + 1), (ticks - ticks.floor()) as f32)
    }
}

/// Whether an entity is there: in a single-player game of the skill asked for, or in deathmatch.
pub fn appears(entity: &Entity, options: &ImportOptions) -> bool {
    const NOT_EASY: u32 = 256;
    const NOT_DEATHMATCH: u32 = 2048;
    let flag = if options.deathmatch {
        NOT_DEATHMATCH
    } else {
        NOT_EASY << options.skill.min(2)
    };
    // Game code removes monsters from deathmatch whatever their flags say.
    let is_gone = options.deathmatch && entity.classname().starts_with("monster_");
    entity.spawnflags() & flag == 0 && !is_gone
}

/// All point entities that show something, with their numbers, in file order.
pub fn inhabitants<'a>(
    entities: &'a [Entity],
    options: &'a ImportOptions,
) -> impl Iterator<Item = (usize, Inhabitant<'a>)> {
    let world_type = (entities.first())
        .and_then(|w| w.float("worldtype"))
        .map_or(0, |t| t.clamp(0.0, 2.0) as usize);
    (entities.iter().enumerate().skip(1))
        .filter(|(_, e)| appears(e, options))
        .filter_map(move |(i, e)| Some((i, inhabitant(e, world_type)?)))
}

/// Class, file, first frame and count, and how it comes to rest.
type Row = (&'static str, &'static str, (u32, u32), Rest);

const STILL: (u32, u32) = (0, 1);

/// Classes that always show the same: those of the game, then those of its mission packs.
#[rustfmt::skip]
const CLASSES: &[Row] = &[
    ("item_armor1", "progs/armor.mdl", STILL, Rest::Item),
    ("item_armor2", "progs/armor.mdl", STILL, Rest::Item),
    ("item_armorInv", "progs/armor.mdl", STILL, Rest::Item),
    ("item_artifact_invulnerability", "progs/invulner.mdl", STILL, Rest::Key),
    ("item_artifact_envirosuit", "progs/suit.mdl", STILL, Rest::Key),
    ("item_artifact_invisibility", "progs/invisibl.mdl", STILL, Rest::Key),
    ("item_artifact_super_damage", "progs/quaddama.mdl", STILL, Rest::Key),
    ("weapon_supershotgun", "progs/g_shot.mdl", STILL, Rest::Item),
    ("weapon_nailgun", "progs/g_nail.mdl", STILL, Rest::Item),
    ("weapon_supernailgun", "progs/g_nail2.mdl", STILL, Rest::Item),
    ("weapon_grenadelauncher", "progs/g_rock.mdl", STILL, Rest::Item),
    ("weapon_rocketlauncher", "progs/g_rock2.mdl", STILL, Rest::Item),
    ("weapon_lightning", "progs/g_light.mdl", STILL, Rest::Item),
    ("misc_explobox", "maps/b_explob.bsp", STILL, Rest::Barrel),
    ("misc_explobox2", "maps/b_exbox2.bsp", STILL, Rest::Barrel),
    ("light_torch_small_walltorch", "progs/flame.mdl", STILL, Rest::Stays),
    ("light_flame_large_yellow", "progs/flame2.mdl", (1, 1), Rest::Stays),
    ("light_flame_small_yellow", "progs/flame2.mdl", STILL, Rest::Stays),
    ("light_flame_small_white", "progs/flame2.mdl", STILL, Rest::Stays),
    ("light_globe", "progs/s_light.spr", STILL, Rest::Stays),
    ("misc_teleporttrain", "progs/teleport.mdl", STILL, Rest::Stays),
    ("viewthing", "progs/player.mdl", STILL, Rest::Stays),
    ("monster_army", "progs/soldier.mdl", (0, 8), Rest::Walker),
    ("monster_dog", "progs/dog.mdl", (69, 9), Rest::Wide),
    ("monster_ogre", "progs/ogre.mdl", (0, 9), Rest::Wide),
    ("monster_ogre_marksman", "progs/ogre.mdl", (0, 9), Rest::Wide),
    ("monster_knight", "progs/knight.mdl", (0, 9), Rest::Walker),
    ("monster_hell_knight", "progs/hknight.mdl", (0, 9), Rest::Walker),
    ("monster_demon1", "progs/demon.mdl", (0, 13), Rest::Wide),
    ("monster_wizard", "progs/wizard.mdl", (0, 8), Rest::Stays),
    ("monster_shambler", "progs/shambler.mdl", (0, 17), Rest::Wide),
    ("monster_shalrath", "progs/shalrath.mdl", (23, 1), Rest::Wide),
    ("monster_tarbaby", "progs/tarbaby.mdl", STILL, Rest::Walker),
    ("monster_enforcer", "progs/enforcer.mdl", (0, 7), Rest::Walker),
    ("monster_fish", "progs/fish.mdl", (39, 18), Rest::Stays),
    ("monster_oldone", "progs/oldone.mdl", (0, 46), Rest::Stays),
    ("monster_gremlin", "progs/grem.mdl", STILL, Rest::Walker),
    ("monster_scourge", "progs/scor.mdl", STILL, Rest::Wide),
    ("monster_armagon", "progs/armabody.mdl", STILL, Rest::Wide),
    ("spikemine", "progs/spikmine.mdl", STILL, Rest::Stays),
    ("monster_spikemine", "progs/spikmine.mdl", STILL, Rest::Stays),
    ("item_artifact_wetsuit", "progs/wetsuit.mdl", STILL, Rest::Key),
    ("item_artifact_empathy_shields", "progs/empathy.mdl", STILL, Rest::Key),
    ("item_hornofconjuring", "progs/horn.mdl", STILL, Rest::Key),
    ("weapon_mjolnir", "progs/g_hammer.mdl", STILL, Rest::Item),
    ("weapon_laser_gun", "progs/g_laserg.mdl", STILL, Rest::Item),
    ("weapon_proximity_gun", "progs/g_prox.mdl", STILL, Rest::Item),
    ("monster_eel", "progs/eel2.mdl", STILL, Rest::Stays),
    ("monster_lava_man", "progs/lavaman.mdl", STILL, Rest::Wide),
    ("monster_mummy", "progs/mummy.mdl", STILL, Rest::Walker),
    ("monster_wrath", "progs/wrath.mdl", STILL, Rest::Stays),
    ("monster_super_wrath", "progs/s_wrath.mdl", STILL, Rest::Stays),
    ("monster_sword", "progs/sword.mdl", STILL, Rest::Stays),
    ("monster_dragon", "progs/dragon.mdl", STILL, Rest::Stays),
    ("item_plasma", "maps/b_plas0.bsp", STILL, Rest::Corner),
    ("item_powerup_belt", "progs/beltup.mdl", STILL, Rest::Key),
    ("item_powerup_shield", "progs/shield.mdl", STILL, Rest::Key),
    ("item_sphere", "progs/sphere.mdl", STILL, Rest::Key),
    ("buzzsaw", "progs/buzzsaw.mdl", STILL, Rest::Stays),
    ("light_lantern", "progs/lantern.mdl", STILL, Rest::Stays),
    ("light_candle", "progs/candle.mdl", STILL, Rest::Stays),
    ("light_flame_gas", "progs/flame3.mdl", STILL, Rest::Stays),
];

/// Classes that show nothing until something happens, whatever keys they have.
const UNSEEN: [&str; 4] = ["info_", "trigger_", "ambient_", "path_"];

fn inhabitant<'a>(entity: &'a Entity, world_type: usize) -> Option<Inhabitant<'a>> {
    let classname = entity.classname();
    let known = |file: &'static str, frames, rest| Inhabitant {
        file: Cow::Borrowed(file),
        classname,
        origin: Vec3::from(entity.origin()),
        angles_deg: [0.0, entity.angles_deg().map_or(0.0, |a| a[1]), 0.0],
        frames,
        skin: match classname {
            "item_armor2" => 1,
            "item_armorInv" => 2,
            _ => 0,
        },
        rest,
        scale: 1.0,
        alpha: None,
        is_lamp: classname.starts_with("light"),
    };
    if let Some(&(_, file, frames, rest)) = CLASSES.iter().find(|row| row.0 == classname) {
        return Some(known(file, frames, rest));
    }
    if let Some((file, frames, rest)) = by_flags(entity, world_type) {
        return Some(known(file?, frames, rest));
    }
    if UNSEEN.iter().any(|prefix| classname.starts_with(prefix)) || classname == "monster_boss" {
        return None;
    }
    // What no table knows shows what it says.
    let file = entity.get("model")?;
    let ending = file.rsplit_once('.')?.1.to_ascii_lowercase();
    let is_model = ["mdl", "spr", "bsp"].contains(&ending.as_str());
    let number = |key| entity.float(key).filter(|n| *n >= 0.0);
    let alpha = entity.float_loose("alpha").filter(|&a| a != 0.0);
    let is_seen = alpha.is_none_or(|a| a >= 1.0 / 255.0);
    (is_model && is_seen).then(|| Inhabitant {
        file: Cow::Owned(file.replace('\\', "/").to_ascii_lowercase()),
        classname,
        origin: Vec3::from(entity.origin()),
        angles_deg: entity.angles_deg().unwrap_or_default(),
        frames: (number("frame").unwrap_or(0.0) as u32, 1),
        skin: number("skin").unwrap_or(0.0) as u32,
        rest: Rest::Stays,
        scale: number("scale")
            .filter(|&s| s > 0.0)
            .map_or(1.0, |s| s.clamp(1.0 / 16.0, 16.0)),
        alpha: alpha.map(|a| a.min(1.0)),
        is_lamp: classname.starts_with("light"),
    })
}

type ByFlags = (Option<&'static str>, (u32, u32), Rest);

/// Classes that show one thing or another; `None` for those that are none of them. A file of `None`
/// shows nothing.
fn by_flags(entity: &Entity, world_type: usize) -> Option<ByFlags> {
    let flags = entity.spawnflags();
    let big = |small, big| Some(if flags & 1 != 0 { big } else { small });
    let by_world = |files: [&'static str; 3]| files.get(world_type).copied();
    let file = match entity.classname() {
        "item_health" if flags & 1 != 0 => Some("maps/b_bh10.bsp"),
        "item_health" if flags & 2 != 0 => Some("maps/b_bh100.bsp"),
        "item_health" => Some("maps/b_bh25.bsp"),
        "item_shells" => big("maps/b_shell0.bsp", "maps/b_shell1.bsp"),
        "item_spikes" => big("maps/b_nail0.bsp", "maps/b_nail1.bsp"),
        "item_rockets" => big("maps/b_rock0.bsp", "maps/b_rock1.bsp"),
        "item_cells" => big("maps/b_batt0.bsp", "maps/b_batt1.bsp"),
        "item_lava_spikes" => big("maps/b_lnail0.bsp", "maps/b_lnail1.bsp"),
        "item_multi_rockets" => big("maps/b_mrock0.bsp", "maps/b_mrock1.bsp"),
        // The ammunition box of early levels.
        "item_weapon" => match (flags & 7, flags & 8 != 0) {
            (1, false) => Some("maps/b_shell0.bsp"),
            (1, true) => Some("maps/b_shell1.bsp"),
            (2, false) => Some("maps/b_rock0.bsp"),
            (2, true) => Some("maps/b_rock1.bsp"),
            (4, false) => Some("maps/b_nail0.bsp"),
            (4, true) => Some("maps/b_nail1.bsp"),
            _ => None,
        },
        "item_key1" => {
            let keys = [
                "progs/w_s_key.mdl",
                "progs/m_s_key.mdl",
                "progs/b_s_key.mdl",
            ];
            return Some((by_world(keys), STILL, Rest::Key));
        }
        "item_key2" => {
            let keys = [
                "progs/w_g_key.mdl",
                "progs/m_g_key.mdl",
                "progs/b_g_key.mdl",
            ];
            return Some((by_world(keys), STILL, Rest::Key));
        }
        "item_sigil" => {
            let runes = [
                "progs/end1.mdl",
                "progs/end2.mdl",
                "progs/end3.mdl",
                "progs/end4.mdl",
            ];
            let rune = runes.get(flags.trailing_zeros() as usize).copied();
            return Some((rune, STILL, Rest::Key));
        }
        "monster_zombie" => {
            const CRUCIFIED: u32 = 1;
            let (frames, rest) = if flags & CRUCIFIED != 0 {
                ((192, 6), Rest::Stays)
            } else {
                ((0, 15), Rest::Walker)
            };
            return Some((Some("progs/zombie.mdl"), frames, rest));
        }
        _ => return None,
    };
    Some((file, STILL, Rest::Corner))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bsp::{Limits, Warnings, entity};

    fn shown(text: &str, options: &ImportOptions) -> Vec<(String, (u32, u32), u32)> {
        let text = format!("{{\"classname\" \"worldspawn\" \"worldtype\" \"2\"}} {text}");
        let entities = entity::parse(text.as_bytes(), &Limits::default(), &mut Warnings::new())
            .expect("entities");
        inhabitants(&entities, options)
            .map(|(_, i)| (i.file.into_owned(), i.frames, i.skin))
            .collect()
    }

    #[test]
    fn classes_show_what_the_game_code_says() {
        let options = ImportOptions::default();
        for (text, file, frames, skin) in [
            (
                "classname item_health spawnflags 2",
                "maps/b_bh100.bsp",
                (0, 1),
                0,
            ),
            ("classname item_armorInv", "progs/armor.mdl", (0, 1), 2),
            ("classname item_key2", "progs/b_g_key.mdl", (0, 1), 0),
            (
                "classname item_sigil spawnflags 4",
                "progs/end3.mdl",
                (0, 1),
                0,
            ),
            (
                "classname monster_zombie spawnflags 1",
                "progs/zombie.mdl",
                (192, 6),
                0,
            ),
            ("classname monster_fish", "progs/fish.mdl", (39, 18), 0),
            (
                "classname light_flame_large_yellow",
                "progs/flame2.mdl",
                (1, 1),
                0,
            ),
            (
                "classname x model \"progs/a.MDL\" frame 3 skin 2",
                "progs/a.mdl",
                (3, 1),
                2,
            ),
        ] {
            let found = shown(&format!("{{{text}}}"), &options);
            assert_eq!(found, [(file.to_owned(), frames, skin)], "{text}");
        }
        for nothing in [
            "classname light",
            "classname monster_boss model progs/boss.mdl",
            "classname info_player_start model progs/player.mdl",
            "classname func_wall model *1",
            "classname x model progs/a.txt",
            "classname x model progs/a.mdl alpha -1",
            "classname item_sigil",
            "classname item_weapon",
        ] {
            assert_eq!(shown(&format!("{{{nothing}}}"), &options), [], "{nothing}");
        }
    }

    #[test]
    fn skill_and_deathmatch_decide_who_is_there() {
        let text = "{classname monster_army spawnflags 256} {classname item_armor1 spawnflags 2048}
            {classname monster_dog} {classname item_armor2 spawnflags 1792}";
        let files = |options: &ImportOptions| -> Vec<String> {
            shown(text, options).into_iter().map(|(f, ..)| f).collect()
        };
        let mut options = ImportOptions {
            skill: 0,
            ..ImportOptions::default()
        };
        assert_eq!(files(&options), ["progs/armor.mdl", "progs/dog.mdl"]);
        options.skill = 3;
        let all = ["progs/soldier.mdl", "progs/armor.mdl", "progs/dog.mdl"];
        assert_eq!(files(&options), all);
        options.deathmatch = true;
        assert_eq!(files(&options), ["progs/armor.mdl"]);
        assert_eq!(shown(text, &options)[0].2, 1);
    }

    #[test]
    fn idle_animations_play_ten_frames_a_second_and_begin_again() {
        let text = "{classname worldspawn} {classname monster_dog}";
        let entities = entity::parse(text.as_bytes(), &Limits::default(), &mut Warnings::new())
            .expect("entities");
        let options = ImportOptions::default();
        let (_, dog) = inhabitants(&entities, &options).next().expect("a dog");
        assert_eq!(dog.frame_at(0.0, 0), (69, 70, 0.0));
        let (from, to, fraction) = dog.frame_at(0.85, 0);
        assert_eq!((from, to), (77, 69));
        assert!((fraction - 0.5).abs() < 1e-3);
        assert_eq!(dog.frame_at(0.0, 10).0, 70);
    }
}
