//! The textures of a level into materials.

use super::appearance::{self, Beside};
use super::names::NameKind;
use super::notes::Notes;
use super::picture::{self, Indexed};
use super::rules::{Kind, Rule};
use super::sky;
use super::translucent::{self, GLASS_ALPHA, LiquidAlphas};
use super::{ImportOptions, LightMode, Lighting};
use crate::Fog;
use crate::material::{Finish, Material, MaterialId, Texture, TextureId};
use crate::sky::{ClearSky, Sky};
use bsp::Bsp;
use bsp::lmp::Palette;
use bsp::miptex::Animation;
use glam::Vec3;
use std::collections::{BTreeMap, HashMap};

/// Radiance of lava, as a part of what a fullbright texel of the same colour emits.
pub const LAVA_GLOW: f32 = 1.0;
/// Radiance of a teleporter's surface, likewise.
pub const TELEPORTER_GLOW: f32 = 0.5;
/// Radiance of slime, likewise.
pub const SLIME_GLOW: f32 = 0.1;
/// What all files of an import add their materials to.
pub struct MaterialSet {
    /// All materials so far.
    pub materials: Vec<Material>,
    /// Per material, whether a light entity beside it stands for the same lamp.
    pub lamps: Vec<bool>,
    /// All pictures so far.
    pub textures: Vec<Texture>,
    /// The sky; the first sky texture that is drawn decides.
    pub sky: Sky,
    /// Radiance that the level asks of the upper and the lower half of the sky; 0 where it does not.
    pub domes: [Vec3; 2],
    /// The level's fog.
    pub fog: Option<Fog>,
    /// The sky without it; of a level without sky, the share alone that would be fogged.
    pub clear_sky: ClearSky,
    /// The pictures of the level's skybox, until the sky is made of them.
    pub skybox: Option<Vec<Texture>>,
    /// Texels that emit, over all emission pictures.
    pub emissive_texels: usize,
    /// By kind, the first material of a liquid of the world that light passes into: it says what
    /// absorbs there.
    pub fills: BTreeMap<NameKind, MaterialId>,
    /// By texture, the entries of the materials that speak of it.
    pub ruled: BTreeMap<String, Vec<String>>,
    /// By texture, the picture that stands for it.
    pub replaced: BTreeMap<String, String>,
    liquid_alphas: LiquidAlphas,
    /// Name of the texture that decided the sky.
    pub sky_name: Option<String>,
}

impl MaterialSet {
    /// Nothing yet, for a level that asks for these sky domes, with its liquids' coverage.
    pub fn new(domes: [Vec3; 2], liquid_alphas: LiquidAlphas) -> Self {
        Self {
            materials: Vec::new(),
            lamps: Vec::new(),
            textures: Vec::new(),
            sky: Sky::default(),
            domes,
            fog: None,
            clear_sky: ClearSky::default(),
            skybox: None,
            emissive_texels: 0,
            fills: BTreeMap::new(),
            ruled: BTreeMap::new(),
            replaced: BTreeMap::new(),
            liquid_alphas,
            sky_name: None,
        }
    }

    /// Adds a picture.
    pub fn add_texture(&mut self, texture: Texture) -> TextureId {
        self.textures.push(texture);
        TextureId(self.textures.len() as u32 - 1)
    }

    /// Adds a material; `lamp` as in [`Self::lamps`].
    pub fn add(&mut self, material: Material, lamp: bool) -> MaterialId {
        self.materials.push(material);
        self.lamps.push(lamp);
        MaterialId(self.materials.len() as u32 - 1)
    }
}

/// A surface as faces need it.
#[derive(Clone, Copy, Debug)]
pub struct FaceSurface {
    /// Kind, by the texture's name.
    pub kind: NameKind,
    /// Its material; unused for tools.
    pub material: MaterialId,
    /// Texels of the shown picture per texel that the level's coordinates count, both axes.
    /// Differs from 1 only where frames of an animation have different sizes.
    pub scale: [f64; 2],
    /// Size of the shown picture.
    pub size: [u32; 2],
    /// Light passes straight through it, in part.
    pub translucent: bool,
}

/// How an entity wants its textures shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct Look {
    /// Alternate frames of animated textures: its `frame` is not 0.
    pub alternate: bool,
    /// Coverage, 1 opaque, for all its surfaces; without it, the level's for its liquids.
    pub alpha: Option<f32>,
    /// The face has no lightmap, where that makes a difference.
    pub unlit: bool,
    /// [`Material::least_light`].
    pub least_light: Vec3,
}

/// What tells a [`Look`] from others.
pub type LookKey = (bool, Option<u32>, bool, [u32; 3]);

impl Look {
    /// What tells looks apart.
    pub fn key(self) -> LookKey {
        let least = self.least_light.to_array().map(f32::to_bits);
        (
            self.alternate,
            self.alpha.map(f32::to_bits),
            self.unlit,
            least,
        )
    }
}

/// The textures of one file, turned into materials when a face asks for them.
pub struct Surfaces<'a> {
    bsp: &'a Bsp,
    palette: &'a Palette,
    animation: &'a Animation,
    beside: Beside<'a>,
    known: HashMap<(Option<usize>, LookKey), FaceSurface>,
}

impl<'a> Surfaces<'a> {
    /// Surfaces of `bsp`, whose textures play `animation`, with the pictures beside it.
    pub fn new(
        bsp: &'a Bsp,
        animation: &'a Animation,
        palette: &'a Palette,
        beside: Beside<'a>,
    ) -> Self {
        Self {
            bsp,
            palette,
            animation,
            beside,
            known: HashMap::new(),
        }
    }

    /// The surface of texture `index` (`None` if the file lacks it) at the import's time.
    pub fn get(
        &mut self,
        index: Option<usize>,
        look: Look,
        set: &mut MaterialSet,
        options: &ImportOptions,
        notes: &mut Notes,
    ) -> FaceSurface {
        let key = (index, look.key());
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        let made = self.make(index, look, set, options, notes);
        self.known.insert(key, made);
        made
    }

    fn make(
        &self,
        index: Option<usize>,
        look: Look,
        set: &mut MaterialSet,
        options: &ImportOptions,
        notes: &mut Notes,
    ) -> FaceSurface {
        let cycle = index.map_or(&[][..], |i| self.animation.cycle(i, look.alternate));
        if options.frames && cycle.len() > 1 {
            return self.make_cycle(index, cycle, look, set, options, notes);
        }
        let shown = index.map(|i| {
            self.animation
                .frame_at(i, f64::from(options.time), look.alternate)
        });
        self.make_shown([index, shown], look, set, options, notes)
    }

    /// A surface that shows one texture after the other.
    fn make_cycle(
        &self,
        index: Option<usize>,
        cycle: &[u32],
        look: Look,
        set: &mut MaterialSet,
        options: &ImportOptions,
        notes: &mut Notes,
    ) -> FaceSurface {
        let mut all: Vec<FaceSurface> = Vec::with_capacity(cycle.len());
        for &texture in cycle {
            let mut surface =
                self.make_shown([index, Some(texture as usize)], look, set, options, notes);
            // Coordinates are those of the first one's size.
            if let Some(first) = all.first().filter(|first| first.size != surface.size) {
                notes.add("frames of different sizes", || {
                    let name = &set.materials[first.material.0 as usize].name;
                    format!("frames of texture {name:?} have different sizes: not all of them play")
                });
                surface = *first;
            }
            all.push(surface);
        }
        let first = all[0];
        let frames: Vec<MaterialId> = all.iter().map(|s| s.material).collect();
        // They are one light, whose texels come and go.
        let of = |id: &MaterialId| id.0 as usize;
        let weights = frames
            .iter()
            .map(|id| set.materials[of(id)].emission_weight);
        let mean = weights.sum::<f32>() / frames.len() as f32;
        let lamp = frames.iter().any(|id| set.lamps[of(id)]);
        for id in &frames {
            set.materials[of(id)].emission_weight = mean;
            set.lamps[of(id)] = lamp;
        }
        if first.kind != NameKind::Tool && first.kind != NameKind::Sky {
            set.materials[of(&first.material)].frames = frames;
        }
        first
    }

    /// The surface of a texture, while it shows that one or another.
    fn make_shown(
        &self,
        [named, shown]: [Option<usize>; 2],
        look: Look,
        set: &mut MaterialSet,
        options: &ImportOptions,
        notes: &mut Notes,
    ) -> FaceSurface {
        let texture_at = |i: usize| self.bsp.textures.get(i).and_then(Option::as_ref);
        let (Some(named), Some(shown)) = (named.and_then(texture_at), shown.and_then(texture_at))
        else {
            return missing("no texture", NameKind::Plain, set, options, notes);
        };
        // Other light than a renderer's own is there to be compared: it shows the level as it is.
        let rule = match options.lighting {
            Lighting::Physical => options.materials.of(&named.name),
            _ => Rule::default(),
        };
        let kind = drawn_as(NameKind::of(&named.name), &rule);
        if kind == NameKind::Tool {
            return FaceSurface {
                kind,
                material: MaterialId(0),
                scale: [1.0; 2],
                size: [1; 2],
                translucent: false,
            };
        }
        if !rule.entries.is_empty() {
            set.ruled.insert(named.name.clone(), rule.entries.clone());
        }
        if kind == NameKind::Sky {
            let indexed = (shown.has_pixels()).then(|| Indexed::new(shown, self.palette, false));
            return sky::surface(indexed, &named.name, set, notes);
        }
        let seen = appearance::of(
            shown,
            self.palette,
            kind,
            &rule,
            &self.beside,
            options,
            notes,
        );
        let Some(seen) = seen else {
            return missing(&shown.name, kind, set, options, notes);
        };
        if let Some(path) = seen.replaced_by {
            set.replaced.insert(shown.name.clone(), path);
        }
        let base = seen.base;
        let size = [base.width, base.height];
        // The materials know better than the level, and an entity better than its texture.
        let glass = (rule.made_of == Some(Kind::Glass)).then_some(GLASS_ALPHA);
        let alpha =
            (rule.alpha.or(look.alpha).or(glass)).unwrap_or_else(|| set.liquid_alphas.get(kind));
        let mut finish = translucent::finish(kind, alpha, &base, &rule);
        // All of a kind absorbs alike: what enters through one surface may leave through another.
        if let Some(first) = set
            .fills
            .get(&kind)
            .filter(|_| finish.absorption != Vec3::ZERO && rule.absorption.is_none())
        {
            finish.absorption = set.materials[first.0 as usize].finish.absorption;
        }
        finish.normals = seen.normals.map(|t| set.add_texture(t));
        if let (Some(gloss), Some(picture)) = (&mut finish.gloss, seen.roughness) {
            gloss.roughness_map = Some(set.add_texture(picture));
        }
        let mut material = Material {
            // Only what is painted shines.
            emission_scale: options.emission_scale * finish.alpha * rule.emission.unwrap_or(1.0),
            alpha_tested: kind == NameKind::Fence,
            two_sided: kind.is_liquid(),
            warped: kind.is_liquid(),
            least_light: look.least_light,
            finish,
            ..Material::new(named.name.clone(), set.add_texture(base))
        };
        match options.lighting {
            Lighting::Physical if options.lights != LightMode::Entities => {
                emit(&mut material, seen.emission, kind, &rule, set);
            }
            Lighting::Physical => {}
            lighting => {
                let indexed = Indexed::new(shown, self.palette, kind == NameKind::Fence);
                show(&mut material, &indexed, look.unlit, set, lighting);
            }
        }
        let lamp = material.emission_weight > 0.0 && kind != NameKind::Slime;
        // Coordinates count texels of the picture that the face names, even while another frame
        // of another size is shown, or a finer picture in its place.
        let scale = [
            f64::from(size[0]) / f64::from(named.width.max(1)),
            f64::from(size[1]) / f64::from(named.height.max(1)),
        ];
        let material = set.add(material, lamp);
        if finish.absorption != Vec3::ZERO && look.alpha.is_none() {
            set.fills.entry(kind).or_insert(material);
        }
        FaceSurface {
            kind,
            scale,
            size,
            material,
            translucent: finish.alpha < 1.0,
        }
    }
}

/// What a texture is drawn as: as its name says, unless the materials say otherwise.
fn drawn_as(named: NameKind, rule: &Rule) -> NameKind {
    match rule.drawn_as {
        Some(Kind::Liquid) if !named.is_liquid() => NameKind::Water,
        Some(Kind::Fence) => NameKind::Fence,
        Some(Kind::Sky) => NameKind::Sky,
        Some(Kind::Solid) => NameKind::Plain,
        _ => named,
    }
}

fn missing(
    name: &str,
    kind: NameKind,
    set: &mut MaterialSet,
    options: &ImportOptions,
    notes: &mut Notes,
) -> FaceSurface {
    notes.add("missing textures", || {
        format!("texture {name:?} has no pixels here: a checkerboard stands in")
    });
    let picture = picture::checkerboard(name);
    let size = [picture.width, picture.height];
    let base = set.add_texture(picture);
    let shows = matches!(options.lighting, Lighting::Lightmap | Lighting::Fullbright);
    let material = Material {
        emission: shows.then_some(base),
        emission_scale: 1.0,
        two_sided: kind.is_liquid(),
        warped: kind.is_liquid(),
        ..Material::new(name, base)
    };
    FaceSurface {
        kind,
        material: set.add(material, false),
        scale: [1.0; 2],
        size,
        translucent: false,
    }
}

/// Lets a material emit: glowing liquids as a whole, others where texels are fullbright.
pub fn emit(
    material: &mut Material,
    picture: Option<(Texture, usize)>,
    kind: NameKind,
    rule: &Rule,
    set: &mut MaterialSet,
) {
    let glow = match kind {
        NameKind::Lava => Some(LAVA_GLOW),
        NameKind::Teleporter => Some(TELEPORTER_GLOW),
        NameKind::Slime => Some(SLIME_GLOW),
        _ => None,
    };
    let emission = if let Some(glow) = glow {
        material.emission_scale *= glow;
        let base = &set.textures[material.base.0 as usize];
        set.emissive_texels += base.rgba.len();
        match rule.emission_color {
            Some(colour) => {
                let mut picture = base.clone();
                appearance::tint(&mut picture, colour);
                set.add_texture(picture)
            }
            None => material.base,
        }
    } else if let Some((picture, texels)) = picture {
        set.emissive_texels += texels;
        set.add_texture(picture)
    } else {
        return;
    };
    let mean = picture::mean_luminance(&set.textures[emission.0 as usize]);
    let sides = if material.two_sided { 2.0 } else { 1.0 };
    let weight = mean * material.emission_scale * sides;
    if weight > 0.0 {
        material.emission_weight = weight;
        material.emission = Some(emission);
    }
}

/// Shows a surface as Quake does: what is not lit emits its texture as it is stored. No light
/// comes from it.
pub fn show(
    material: &mut Material,
    indexed: &Indexed<'_>,
    unlit: bool,
    set: &mut MaterialSet,
    lighting: Lighting,
) {
    // Engines blend, and know no mirror.
    material.finish = Finish {
        alpha: material.finish.alpha,
        ior: 1.0,
        ..Finish::default()
    };
    material.emission_scale = material.finish.alpha;
    match lighting {
        Lighting::Fullbright => material.emission = Some(material.base),
        Lighting::Lightmap => {
            let unlit = set.add_texture(indexed.base_without_fullbright_alpha());
            material.emission = Some(unlit);
        }
        _ if unlit => {
            material.emission = Some(material.base);
            material.base = set.add_texture(indexed.base_without(|_| true));
        }
        _ => {
            if let Some((picture, _)) = indexed.emission(0.0) {
                material.emission = Some(set.add_texture(picture));
                material.base = set.add_texture(indexed.base_without(|i| indexed.emits(i, 0.0)));
            }
        }
    }
}
