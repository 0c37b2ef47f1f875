//! The entities of a level: which one an instance is, where one can be looked at, and which are meant by a
//! word.

use super::fly::Eye;
use super::looking::survey::NONE;
use bsp::entity::Entity;
use bsp::{Bsp, Level};
use glam::Vec3;
use scene::{Instance, Mesh};

/// Farther from its entity nothing is taken for it, in units: models float and are dropped to the floor.
const NEAR: f32 = 320.0;
/// Distance that an entity is looked at from, in units, where there is room.
const AWAY: f32 = 128.0;

/// Numbers of the entities that instances are of, [`NONE`] where nobody knows. Brush models say it by their
/// name, others are of the nearest entity of their class.
#[must_use]
pub fn of_instances(instances: &[Instance], meshes: &[Mesh], level: &Level) -> Vec<u32> {
    let find = |(number, instance): (usize, &Instance)| {
        if number == 0 {
            return 0;
        }
        let name = meshes.get(instance.mesh).map_or("", |m| m.name.as_str());
        let mut all = (0..).zip(&level.entities);
        if name.starts_with('*') {
            return (all.find(|(_, e)| e.get("model") == Some(name))).map_or(NONE, |(i, _)| i);
        }
        let at = Vec3::from(instance.transform.translation);
        let distance = |e: &Entity| at.distance(Vec3::from(e.origin()));
        all.filter(|(_, e)| e.classname() == instance.name)
            .min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))
            .filter(|(_, e)| distance(e) < NEAR)
            .map_or(NONE, |(i, _)| i)
    };
    instances.iter().enumerate().map(find).collect()
}

/// The light entity at a place, of several the one with this style; lamps are moved a little where they lie in
/// solid.
#[must_use]
pub fn lamp_at(level: &Level, at: Vec3, style: u16) -> Option<usize> {
    /// Farther is another one: lamps beside walls are moved out by up to 16 units.
    const MOVED: f32 = 24.0;
    let distance = |e: &Entity| at.distance(Vec3::from(e.origin()));
    (level.entities.iter().enumerate())
        .filter(|(_, e)| e.classname().starts_with("light") && distance(e) <= MOVED)
        .min_by(|(_, a), (_, b)| {
            let is_other = |e: &Entity| style_of(e) != style;
            (is_other(a).cmp(&is_other(b))).then_with(|| distance(a).total_cmp(&distance(b)))
        })
        .map(|(i, _)| i)
}

/// The light styles that lamps of the level have, in order, with how many lamps; steady light is the first.
#[must_use]
pub fn styles_of(level: &Level) -> Vec<(u16, usize)> {
    let mut styles = std::collections::BTreeMap::from([(0, 0)]);
    let lamps = level
        .entities
        .iter()
        .filter(|e| e.classname().starts_with("light"));
    for lamp in lamps {
        *styles.entry(style_of(lamp)).or_insert(0) += 1;
    }
    styles.into_iter().collect()
}

/// The light style of a lamp, as the import takes it.
fn style_of(lamp: &Entity) -> u16 {
    match lamp.int("style").or(lamp.int("_style")) {
        Some(style) => u16::try_from(style).unwrap_or(0),
        None if lamp.classname() == "light_fluorospark" => 10,
        None => 0,
    }
}

/// Whether a word is in one of an entity's keys or values; of `key=value` both must be.
#[must_use]
pub fn matches(entity: &Entity, word: &str) -> bool {
    let has = |text: &str, part: &str| {
        text.to_ascii_lowercase()
            .contains(&part.to_ascii_lowercase())
    };
    match word.split_once('=') {
        Some((key, value)) => entity
            .iter()
            .any(|(k, v)| has(k, key.trim()) && has(v, value.trim())),
        None => entity.iter().any(|(k, v)| has(k, word) || has(v, word)),
    }
}

/// Where an entity is: the middle of its brush model, or its origin. `None` of what is nowhere.
#[must_use]
pub fn place_of(entity: &Entity, bsp: &Bsp) -> Option<Vec3> {
    let model = entity
        .get("model")
        .and_then(|m| m.strip_prefix('*')?.parse::<usize>().ok());
    if let Some(model) = model.and_then(|m| bsp.models.get(m)) {
        let middle = (Vec3::from(model.mins) + Vec3::from(model.maxs)) / 2.0;
        return Some(middle + Vec3::from(entity.origin()));
    }
    entity.get("origin").map(|_| Vec3::from(entity.origin()))
}

/// An eye that looks at a place, from where there is most room around it.
#[must_use]
pub fn eye_on(place: Vec3, bsp: &Bsp) -> Eye {
    let free = |direction: Vec3| {
        let to = place + direction * AWAY;
        let trace = bsp.trace(0, 0, place.to_array(), to.to_array());
        let fraction = trace.map_or(1.0, |t| if t.start_solid { 0.0 } else { t.fraction });
        // Not into the wall.
        place + direction * (AWAY * fraction as f32 - 4.0).max(1.0)
    };
    let around = (0..16).map(|i| {
        let angle = std::f32::consts::TAU * (i % 8) as f32 / 8.0;
        let up = if i < 8 { 0.4 } else { -0.3 };
        Vec3::new(angle.cos(), angle.sin(), up).normalize()
    });
    let best = around
        .map(free)
        .fold(None, |best: Option<Vec3>, at| match best {
            // By more than a little: else any that comes first.
            Some(best) if best.distance(place) + 1.0 >= at.distance(place) => Some(best),
            _ => Some(at),
        });
    let position = best.unwrap_or(place);
    let to = place - position;
    Eye {
        position,
        pitch: -to.z.atan2(to.truncate().length()).to_degrees(),
        yaw: to.y.atan2(to.x).to_degrees(),
        roll: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;
    use bsp::{Limits, SearchPath};

    fn level() -> Level {
        let search = SearchPath::builder().build().expect("no files");
        let bytes = bundled::LEVEL.to_vec();
        Level::from_bytes(&search, bundled::NAME, bytes, &Limits::default()).expect("the sample")
    }

    #[test]
    fn whoever_flies_to_an_entity_sees_it() {
        let level = level();
        let mut looked_at = 0;
        for entity in &level.entities[1..] {
            let Some(place) = place_of(entity, &level.bsp) else {
                continue;
            };
            looked_at += 1;
            let eye = eye_on(place, &level.bsp);
            let [forward, ..] = eye.axes();
            let to = (place - eye.position).normalize();
            assert!(forward.dot(to) > 0.9999, "{}: {eye:?}", entity.classname());
            assert!(eye.position.distance(place) <= AWAY);
        }
        assert!(looked_at > 5, "{looked_at}");
    }

    #[test]
    fn of_two_lamps_in_one_place_the_style_decides() {
        let mut level = level();
        let mut lamps = (level.entities.iter()).filter(|e| e.classname().starts_with("light"));
        let lamp = lamps.next_back().cloned().expect("a lamp");
        let at = Vec3::from(lamp.origin());
        let found = lamp_at(&level, at + Vec3::X, style_of(&lamp)).expect("the lamp");
        assert_eq!(level.entities[found].origin(), lamp.origin());
        level.entities.push(lamp);
        assert_eq!(
            lamp_at(&level, at, 0),
            Some(found),
            "the first of two alike"
        );
        assert_eq!(
            lamp_at(&level, at + Vec3::X * 100.0, 0).filter(|&i| i == found),
            None
        );
        let styles = styles_of(&level);
        let lamps = level
            .entities
            .iter()
            .filter(|e| e.classname().starts_with("light"));
        assert_eq!(styles.iter().map(|(_, n)| n).sum::<usize>(), lamps.count());
    }

    #[test]
    fn words_find_entities_by_keys_and_values() {
        let level = level();
        let count = |word: &str| level.entities.iter().filter(|e| matches(e, word)).count();
        assert_eq!(count(""), level.entities.len());
        assert!(count("LIGHT") > 0 && count("classname=light") <= count("light"));
        assert_eq!(count("no such thing"), 0);
        assert!(
            count("origin=") < level.entities.len(),
            "the world has none"
        );
    }
}
