//! Brush entities in their static pose: what is shown, where, and whether it can move.

use super::ImportOptions;
use super::inhabitants::appears;
use super::notes::Notes;
use super::targets::Targets;
use super::translucent::entity_alpha;
use bsp::Bsp;
use bsp::bsp::Model;
use bsp::entity::Entity;
use glam::Vec3;

/// Space that a door leaves of itself when it opens, unless it says otherwise.
const DEFAULT_LIP: f32 = 8.0;

/// A brush entity that is drawn.
#[derive(Clone, Debug)]
pub struct Pose<'a> {
    /// Its brush model in the level, 1 or more.
    pub model: usize,
    /// Where the model's own origin is, world space.
    pub offset: Vec3,
    /// Its class.
    pub classname: &'a str,
    /// Whether it stays in place for good, so that it can be part of the static world.
    pub fixed: bool,
    /// Whether things rest on it.
    pub solid: bool,
    /// Whether it shows the alternate frames of animated textures.
    pub alternate: bool,
    /// Coverage that it asks for, 1 opaque.
    pub alpha: Option<f32>,
    /// Its entity.
    pub entity: &'a Entity,
}

/// All drawn brush entities in file order, with how many were left out as invisible.
pub fn poses<'a>(
    bsp: &Bsp,
    entities: &'a [Entity],
    options: &ImportOptions,
    notes: &mut Notes,
) -> (Vec<Pose<'a>>, Vec<usize>) {
    let mut shown = Vec::new();
    let mut hidden = Vec::new();
    let targets = Targets::new(entities);
    for entity in entities.iter().skip(1) {
        let Some(text) = entity.get("model").filter(|m| m.starts_with('*')) else {
            continue;
        };
        let index = entity.brush_model().filter(|&n| n > 0);
        let Some((index, model)) = index.and_then(|n| Some((n, bsp.models.get(n)?))) else {
            notes.add("no such model", || {
                format!(
                    "{} refers to brush model {text:?}, which the level does not have",
                    entity.classname()
                )
            });
            continue;
        };
        if is_hidden(entity, options) {
            hidden.push(index);
            continue;
        }
        shown.push(pose(entity, index, model, &targets, notes));
    }
    (shown, hidden)
}

fn is_hidden(entity: &Entity, options: &ImportOptions) -> bool {
    let class = entity.classname();
    let alpha = entity.float_loose("alpha").unwrap_or(0.0);
    // 0 is the key's default and means opaque.
    let invisible = alpha < 0.0 || (alpha > 0.0 && alpha < 1.0 / 255.0);
    invisible
        || !appears(entity, options)
        || ["trigger_", "info_", "func_areaportal", "func_occlude"]
            .iter()
            .any(|prefix| class.starts_with(prefix))
        || class == "func_monsterclip"
        || (class == "func_episodegate" && !options.show_episode_gates)
        || (class == "func_bossgate" && !options.show_boss_gate)
}

fn pose<'a>(
    entity: &'a Entity,
    index: usize,
    model: &Model,
    targets: &Targets<'_>,
    notes: &mut Notes,
) -> Pose<'a> {
    let classname = entity.classname();
    let origin = Vec3::from(entity.origin());
    let [mins, maxs] = [model.mins, model.maxs].map(Vec3::from);
    // Engines grow the bounds by a unit each way, and game code reckons with that.
    let size = maxs - mins + 2.0;
    let mut fixed = false;
    let offset = match classname {
        "func_wall" | "func_illusionary" | "func_episodegate" | "func_bossgate" => {
            fixed = true;
            origin
        }
        "func_door" if entity.spawnflags() & 1 != 0 => {
            let direction = Vec3::from(entity.move_direction());
            let lip = entity.float("lip").filter(|&l| l != 0.0);
            let way = direction.dot(size).abs() - lip.unwrap_or(DEFAULT_LIP);
            origin + direction * way
        }
        "func_plat" if entity.get("targetname").is_none_or(str::is_empty) => {
            let height = entity.float("height").filter(|&h| h != 0.0);
            origin - Vec3::Z * height.unwrap_or(size.z - 8.0)
        }
        "func_train" => match targets.of(entity) {
            Some(corner) => corner - (mins - 1.0),
            None => {
                notes.add("train without corner", || {
                    "a func_train has no path_corner to start from: it stays where it was built"
                        .to_owned()
                });
                origin
            }
        },
        _ => origin,
    };
    Pose {
        model: index,
        offset: if offset.is_finite() {
            offset
        } else {
            Vec3::ZERO
        },
        classname,
        fixed: fixed && offset == Vec3::ZERO,
        solid: classname.starts_with("func_") && classname != "func_illusionary",
        entity,
        alternate: entity.float("frame").is_some_and(|f| f != 0.0),
        alpha: entity_alpha(entity),
    }
}
