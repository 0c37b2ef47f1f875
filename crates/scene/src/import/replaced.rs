//! MD3 and MD5 models that stand for alias models, with the pictures beside them.

use super::Lighting;
use super::appearance::{self, LEAST_GLOW};
use super::models::AliasPart;
use super::picture::Indexed;
use super::world::World;
use crate::alias::AliasModel;
use crate::material::Texture;
use bsp::lmp::Picture;
use bsp::md3::Md3;
use bsp::md5::Md5;
use bsp::mdl::{Mdl, flags};
use bsp::miptex::MipTex;
use bsp::posed::PosedModel;
use bsp::{FormatError, Warnings};
use glam::Vec3;

/// Most vertices that a model may have in all its frames together: small files can ask for many.
const MAX_PLACES: usize = 1 << 23;
/// Most skins, and most pictures that a skin may have, as engines have it.
const MAX_SKINS: usize = 32;
const MAX_PICTURES: usize = 4;

/// Pictures of one surface.
pub enum Skins {
    /// Those of the alias model.
    Own(Mdl),
    /// Pictures beside the model: of each skin those that follow each other. All have one size.
    Beside(Vec<Vec<Shown>>),
}

/// A picture beside a model.
pub struct Shown {
    /// Its colours, and its holes.
    pub base: Texture,
    /// What of it shines, and how many texels.
    pub emission: Option<(Texture, usize)>,
}

impl World<'_> {
    /// What is drawn for the alias model `path`: itself, or what stands for it.
    pub(super) fn alias_parts(&mut self, path: &str, file: Mdl) -> Vec<AliasPart> {
        let is_wanted =
            self.options.model_replacements && self.options.lighting == Lighting::Physical;
        let stem = path.rsplit_once('.').map_or(path, |(stem, _)| stem);
        let found = is_wanted.then(|| {
            (["md3", "md5mesh"].iter()).find_map(|ending| {
                let name = format!("{stem}.{ending}");
                (self.files)(&name).map(|data| (name, data))
            })
        });
        if let Some((name, data)) = found.flatten() {
            match self.replacement(stem, &name, &data, &file) {
                Ok(parts) => {
                    self.models.replaced.insert(path.to_owned(), name);
                    return parts;
                }
                Err(why) => (self.notes).add(&name, || {
                    format!("{name} is not shown in the place of {path}: {why}")
                }),
            }
        }
        // Skins are painted when they are shown.
        let mut model = AliasModel::new(path, &file, |_, _, _| crate::MaterialId(0));
        if self.shades_round() {
            model.mesh.make_smooth();
        }
        vec![AliasPart {
            name: path.to_owned(),
            model,
            skins: Skins::Own(file),
        }]
    }

    fn shades_round(&self) -> bool {
        self.options.smooth_models && self.options.lighting == Lighting::Physical
    }

    fn replacement(
        &mut self,
        stem: &str,
        name: &str,
        data: &[u8],
        file: &Mdl,
    ) -> Result<Vec<AliasPart>, String> {
        let limits = &self.options.limits;
        let wrong = |e: FormatError| e.to_string();
        let is_md3 = name.ends_with(".md3");
        let model = if is_md3 {
            PosedModel::Md3(Md3::parse(data, limits).map_err(wrong)?)
        } else {
            let anim = (self.files)(&format!("{stem}.md5anim"));
            PosedModel::Md5(Md5::parse(data, anim.as_deref(), limits).map_err(wrong)?)
        };
        let places = model.vertices().saturating_mul(model.frames());
        if places > MAX_PLACES {
            return Err(format!(
                "found {places} vertices in all frames together, allowed are {MAX_PLACES}"
            ));
        }
        // A skeleton says nothing of trails and turning, and engines take that from the alias model.
        let flags = model.flags().unwrap_or(file.header.flags);
        let poses: Vec<_> = (0..model.frames()).map(|frame| model.pose(frame)).collect();
        let round = self.shades_round();
        let normals = |frame| model.normals(frame).filter(|_| round);
        let normals: Option<Vec<_>> = (0..model.frames()).map(normals).collect();
        let lists = if is_md3 {
            self.skin_files(stem)
        } else {
            Vec::new()
        };
        let mut first = 0;
        let mut parts = Vec::with_capacity(model.surfaces().len());
        for (number, surface) in model.surfaces().iter().enumerate() {
            let names = if is_md3 {
                md3_names(stem, &surface.name, number, &lists)
            } else {
                vec![Names::Numbered {
                    stem: surface.name.clone(),
                    digits: 2,
                    groups: true,
                }]
            };
            let skins = self.skins_beside(stem, &names, flags);
            let Some(size) = skins.first().and_then(|s| s.first()).map(|p| &p.base) else {
                return Err(format!(
                    "there is no picture for its surface {:?}",
                    surface.name
                ));
            };
            let size = [size.width, size.height];
            let pictures: Vec<usize> = skins.iter().map(Vec::len).collect();
            let mut alias =
                AliasModel::posed_surface(name, surface, &poses, first, size, &pictures, flags);
            match &normals {
                Some(normals) => {
                    let own = first..first + surface.uv.len();
                    let of_pose = |all: &Vec<[f32; 3]>| -> Vec<Vec3> {
                        let own = all.get(own.clone()).unwrap_or_default();
                        own.iter().map(|&n| n.into()).collect()
                    };
                    let of_poses: Vec<_> = normals.iter().map(of_pose).collect();
                    alias.mesh.shade_with(&of_poses);
                }
                None if round => alias.mesh.make_smooth(),
                None => {}
            }
            parts.push(AliasPart {
                name: format!("{name} surface {number}"),
                model: alias,
                skins: Skins::Beside(skins),
            });
            first += surface.uv.len();
        }
        Ok(parts)
    }

    /// The skins of a surface by the first way of naming them that leads to a picture.
    fn skins_beside(&mut self, stem: &str, names: &[Names], flags: u32) -> Vec<Vec<Shown>> {
        let folder = stem.rsplit_once('/').map_or("", |(folder, _)| folder);
        for names in names {
            let mut skins: Vec<Vec<Shown>> = Vec::new();
            for skin in 0..MAX_SKINS {
                let mut pictures = Vec::new();
                for part in 0..MAX_PICTURES {
                    let name = names.of(skin, part);
                    let shown = name.and_then(|name| self.skin_picture(folder, &name, flags));
                    let Some(mut shown) = shown else { break };
                    // Coordinates count texels of the first.
                    let first = skins.iter().flatten().chain(&pictures).next();
                    if let Some(Shown { base, .. }) = first {
                        let (w, h) = (base.width, base.height);
                        appearance::resize(&mut shown.base, w, h);
                    }
                    let (w, h) = (shown.base.width, shown.base.height);
                    if let Some((picture, _)) = &mut shown.emission {
                        appearance::resize(picture, w, h);
                    }
                    pictures.push(shown);
                }
                if pictures.is_empty() {
                    break;
                }
                skins.push(pictures);
            }
            if !skins.is_empty() {
                return skins;
            }
        }
        Vec::new()
    }

    /// A picture of a skin: by the name itself, beside the model, or in the usual folders.
    fn skin_picture(&mut self, folder: &str, name: &str, flags: u32) -> Option<Shown> {
        let places = [
            name.to_owned(),
            format!("{folder}/{name}"),
            format!("progs/{name}"),
            format!("textures/{name}"),
        ];
        let beside = self.beside();
        let has_holes = flags & flags::HOLES != 0;
        let find = |suffix: &str, world: &mut Self| {
            places.iter().find_map(|place| {
                let stem = format!("{place}{suffix}");
                beside.picture(&stem, world.options, &mut world.notes)
            })
        };
        if let Some((_, mut base)) = find("", self) {
            for texel in &mut base.rgba {
                texel[3] = if has_holes && texel[3] < appearance::HOLE {
                    0
                } else {
                    255
                };
            }
            let glow = find("_glow", self).or_else(|| find("_luma", self));
            let emission = glow.and_then(|(_, glow)| {
                let mut bright = appearance::bright_part(&glow, LEAST_GLOW);
                appearance::resize(&mut bright, base.width, base.height);
                appearance::only_light(bright, &base)
            });
            return Some(Shown { base, emission });
        }
        // Palette indices, whose last colours shine.
        places.iter().find_map(|place| {
            let path = format!("{place}.lmp");
            let data = (self.files)(&path)?;
            let picture = Picture::parse(&data, &self.options.limits, &mut Warnings::new());
            let picture = match picture {
                Ok(picture) => picture,
                Err(error) => {
                    (self.notes).add(&path, || {
                        format!("{path}: {error}: the picture is not used")
                    });
                    return None;
                }
            };
            let left = beside.room.get().checked_sub(picture.pixels.len() as u64)?;
            beside.room.set(left);
            let miptex = MipTex {
                name: path,
                raw_name: [0; 16],
                width: picture.width,
                height: picture.height,
                pixels: picture.pixels,
                palette: None,
            };
            let indexed = Indexed::new(&miptex, self.palette, has_holes);
            Some(Shown {
                base: indexed.base(),
                emission: indexed.emission(0.0),
            })
        })
    }

    /// What the `.skin` files of a model say: surface, skin, and the picture's name.
    fn skin_files(&self, stem: &str) -> Vec<(String, usize, String)> {
        /// Most bytes of such a file.
        const LONGEST: usize = 1 << 20;
        let mut said = Vec::new();
        let mut read = |number: Option<usize>| {
            let suffix = number.map_or(String::new(), |n| format!("_{n}"));
            let names = [".md3", ""].map(|md3| format!("{stem}{md3}{suffix}.skin"));
            let Some(data) = names.iter().find_map(|name| (self.files)(name)) else {
                return false;
            };
            let text =
                String::from_utf8_lossy(data.get(..data.len().min(LONGEST)).unwrap_or(&data));
            for line in text.lines() {
                let mut fields = line.split(',').map(str::trim);
                let surface = fields.next().unwrap_or_default().to_owned();
                for (i, name) in fields.enumerate().take(MAX_SKINS) {
                    said.push((surface.clone(), number.unwrap_or(i), name.to_owned()));
                }
            }
            true
        };
        if !read(None) {
            for number in 0..MAX_SKINS {
                if !read(Some(number)) {
                    break;
                }
            }
        }
        said
    }
}

/// A way of naming a surface's pictures.
enum Names {
    /// As `.skin` files list them: by skin.
    Listed(Vec<(usize, String)>),
    /// A name with the number of the skin and, with `groups`, of the picture in it.
    Numbered {
        stem: String,
        digits: usize,
        groups: bool,
    },
    /// One name for the only picture.
    Single(String),
}

impl Names {
    /// The name of a picture of a skin, without its ending.
    fn of(&self, skin: usize, part: usize) -> Option<String> {
        match self {
            Self::Listed(names) => {
                let mut of_skin = names.iter().filter(|(s, _)| *s == skin);
                of_skin
                    .nth(part)
                    .map(|(_, name)| without_ending(name).to_owned())
            }
            Self::Numbered {
                stem,
                digits,
                groups: true,
            } => Some(format!("{stem}_{skin:0digits$}_{part:0digits$}")),
            Self::Numbered { stem, digits, .. } => {
                (part == 0).then(|| format!("{stem}_{skin:0digits$}"))
            }
            Self::Single(name) => (skin == 0 && part == 0).then(|| name.clone()),
        }
    }
}

/// The ways in which pictures of an MD3 surface are named, the first that finds any counts.
fn md3_names(
    stem: &str,
    surface: &str,
    number: usize,
    lists: &[(String, usize, String)],
) -> Vec<Names> {
    let listed = lists.iter().filter(|(name, ..)| name == surface);
    let plain = without_ending(surface).to_owned();
    let numbered = |stem: String, groups| Names::Numbered {
        stem,
        digits: 1,
        groups,
    };
    vec![
        Names::Listed(
            listed
                .map(|(_, skin, name)| (*skin, name.clone()))
                .collect(),
        ),
        numbered(plain.clone(), true),
        numbered(plain.clone(), false),
        Names::Single(plain),
        numbered(format!("{stem}.md3_{number}"), true),
    ]
}

/// A name without the ending of its file.
fn without_ending(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((stem, ending)) if !ending.contains('/') => stem,
        _ => name,
    }
}
