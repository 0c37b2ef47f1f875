//! Liquids and brush entities that light passes through.

use super::names::NameKind;
use super::rules::{Kind, Rule};
use crate::Media;
use crate::cells::{CELL, CellNode};
use crate::gloss::Gloss;
use crate::material::{Finish, MaterialId, Texture, srgb_to_linear};
use bsp::Bsp;
use bsp::bsp::contents;
use bsp::entity::Entity;
use glam::{DVec3, Vec3};

/// Index of refraction of liquids.
pub const LIQUID_IOR: f32 = 1.33;
/// Index of refraction of see-through entities, as of window glass.
pub const GLASS_IOR: f32 = 1.5;
/// World units of water after which white light has the hue of the water's texture, and
/// [`CLEARNESS`] of its strength.
pub const WATER_DEPTH: f32 = 192.0;
/// Likewise for what teleporters are filled with.
pub const TELEPORTER_DEPTH: f32 = 64.0;
/// Likewise for slime.
pub const SLIME_DEPTH: f32 = 48.0;
/// Likewise for lava.
pub const LAVA_DEPTH: f32 = 16.0;
/// Share of light that is left, in the channel a liquid absorbs least, at its depth.
pub const CLEARNESS: f32 = 0.8;
/// No channel of a hue counts as less.
const LEAST_HUE: f32 = 0.02;
/// Coverage of what the materials call glass, without a word on how much of it is opaque.
pub const GLASS_ALPHA: f32 = 0.1;
/// How far from a liquid's face it is asked on which side the liquid is, world units.
const BESIDE: f64 = 0.5;

/// Coverage of the level's liquids, 1 opaque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiquidAlphas {
    water: f32,
    slime: f32,
    lava: f32,
    teleporter: f32,
}

impl LiquidAlphas {
    /// As worldspawn says: `wateralpha`, and for the others their own key or else that one. 0 is as
    /// good as no key.
    pub fn of(world: Option<&Entity>) -> Self {
        let key = |name| {
            world
                .and_then(|w| w.float_loose(name))
                .filter(|&alpha| alpha > 0.0)
                .map(|alpha| alpha.min(1.0))
        };
        let water = key("wateralpha").unwrap_or(1.0);
        let or_water = |name| key(name).unwrap_or(water);
        Self {
            water,
            slime: or_water("slimealpha"),
            lava: or_water("lavaalpha"),
            teleporter: or_water("telealpha"),
        }
    }

    /// That of surfaces of this kind; 1 for what is no liquid.
    pub fn get(&self, kind: NameKind) -> f32 {
        match kind {
            NameKind::Water => self.water,
            NameKind::Slime => self.slime,
            NameKind::Lava => self.lava,
            NameKind::Teleporter => self.teleporter,
            _ => 1.0,
        }
    }
}

/// Coverage that a brush entity asks for; `None` without a wish, which is 0 too.
pub fn entity_alpha(entity: &Entity) -> Option<f32> {
    (entity.float_loose("alpha"))
        .filter(|&alpha| alpha > 0.0)
        .map(|alpha| alpha.min(1.0))
}

/// The finish of a surface of this kind and coverage that shows `picture`, as `rule` would have it.
pub fn finish(kind: NameKind, alpha: f32, picture: &Texture, rule: &Rule) -> Finish {
    let mut finish = if alpha < 1.0 {
        see_through(kind, alpha, picture)
    } else {
        Finish::default()
    };
    finish.gloss = gloss(rule);
    if alpha < 1.0 {
        finish.ior = rule.ior.unwrap_or(finish.ior);
        finish.tint = rule.tint.map_or(finish.tint, Vec3::from);
        finish.absorption = rule.absorption.map_or(finish.absorption, Vec3::from);
    }
    finish
}

/// The gloss that a rule asks for.
fn gloss(rule: &Rule) -> Option<Gloss> {
    let (roughness, metallic) = match rule.made_of {
        Some(Kind::Metal) => (0.35, 1.0),
        Some(Kind::Gloss) => (0.3, 0.0),
        Some(_) => return None,
        None if [rule.roughness, rule.metallic, rule.specular] == [None; 3] => return None,
        None => (0.5, 0.0),
    };
    Some(Gloss {
        roughness: rule.roughness.unwrap_or(roughness),
        metallic: rule.metallic.unwrap_or(metallic),
        specular: rule.specular.unwrap_or(0.5),
        roughness_map: None,
    })
}

fn see_through(kind: NameKind, alpha: f32, picture: &Texture) -> Finish {
    let hue = hue(picture);
    let depth = match kind {
        NameKind::Water => WATER_DEPTH,
        NameKind::Teleporter => TELEPORTER_DEPTH,
        NameKind::Slime => SLIME_DEPTH,
        NameKind::Lava => LAVA_DEPTH,
        _ => {
            // A pane has two sides: together they give the light its hue.
            let tint = hue.map(f32::sqrt);
            return Finish {
                alpha,
                ior: GLASS_IOR,
                tint,
                ..Finish::default()
            };
        }
    };
    Finish {
        alpha,
        ior: LIQUID_IOR,
        tint: Vec3::ONE,
        absorption: hue.map(|h| -(h * CLEARNESS).ln() / depth),
        ..Finish::default()
    }
}

/// Mean colour of a picture, linear, with its greatest channel 1; white if it is black.
fn hue(picture: &Texture) -> Vec3 {
    let table: Vec<f64> = (0..=255).map(srgb_to_linear).collect();
    let sum: DVec3 = (picture.rgba.iter())
        .filter(|t| t[3] != 0)
        .map(|t| DVec3::from([t[0], t[1], t[2]].map(|c| table[usize::from(c)])))
        .sum();
    let most = sum.max_element();
    if most > 0.0 {
        (sum / most).as_vec3().max(Vec3::splat(LEAST_HUE))
    } else {
        Vec3::ONE
    }
}

/// Whether the front of a liquid's face lies in the liquid, and its back does not: then it is the
/// inner one of the two faces that compilers make.
pub fn looks_inwards(bsp: &Bsp, model: usize, points: &[Vec3], normal: DVec3) -> bool {
    let centre = points.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / points.len().max(1) as f64;
    let is_liquid = |side: f64| {
        let at = (centre + normal * (side * BESIDE)).as_vec3().to_array();
        bsp.point_contents(model, at)
            .is_some_and(contents::is_liquid)
    };
    is_liquid(1.0) && !is_liquid(-1.0)
}

/// The liquids of a level's leafs: `nodes` are those of its tree, with the numbers of leafs, and
/// `fills` says which material fills a kind of liquid.
pub fn media(
    bsp: &Bsp,
    mut nodes: Vec<CellNode>,
    fills: impl Fn(NameKind) -> Option<MaterialId>,
) -> Media {
    let filled = |leaf: u32| {
        let kind = match contents::base(bsp.leafs.get(leaf as usize)?.contents) {
            contents::WATER => NameKind::Water,
            contents::SLIME => NameKind::Slime,
            contents::LAVA => NameKind::Lava,
            _ => return None,
        };
        fills(kind)
    };
    for child in nodes.iter_mut().flat_map(|n| &mut n.children) {
        if *child & CELL != 0 {
            *child = CELL | filled(*child & !CELL).map_or(0, |m| m.0 + 1);
        }
    }
    Media { nodes }
}
