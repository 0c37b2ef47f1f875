//! Where the entities are that other entities name as their target.

use bsp::entity::Entity;
use glam::Vec3;
use std::collections::HashMap;

/// Origins of named entities; of those with the same name the first.
pub struct Targets<'a>(HashMap<&'a str, Vec3>);

impl<'a> Targets<'a> {
    /// Looks through `entities` once.
    pub fn new(entities: &'a [Entity]) -> Self {
        let mut map = HashMap::new();
        for entity in entities {
            if let Some(name) = entity.get("targetname").filter(|n| !n.is_empty()) {
                map.entry(name).or_insert_with(|| entity.origin().into());
            }
        }
        Self(map)
    }

    /// Where the target of `entity` is; `None` if it names none or one that is not there.
    pub fn of(&self, entity: &Entity) -> Option<Vec3> {
        self.0.get(entity.get("target")?).copied()
    }
}
