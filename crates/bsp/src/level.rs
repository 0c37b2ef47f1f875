//! A level with all that belongs to it: `.lit`, `.vis` and `.ent` companions, textures that live
//! in WADs, entities, light styles.

use std::collections::HashMap;
use std::path::Path;

use crate::bsp::{Bsp, LightSamples};
use crate::entity::{self, Entity};
use crate::error::{FormatError, Limits, WarningKind, Warnings};
use crate::miptex::Animation;
use crate::pak::is_safe_name;
use crate::search::{Found, LoadError, SearchPath, read_file};
use crate::styles::LightStyles;
use crate::wad::Wad;

/// A level ready for use.
#[derive(Debug)]
pub struct Level {
    /// Its name without directory and `.bsp`: `start`.
    pub name: String,
    /// Where it was found, for people.
    pub origin: String,
    /// The level itself, with external visibility and textures in place.
    pub bsp: Bsp,
    /// The samples that light it.
    pub light: LightSamples,
    /// Entities; the first is worldspawn. Empty for levels without entity text.
    pub entities: Vec<Entity>,
    /// Which textures animate.
    pub animation: Animation,
    /// Light styles at the start of the level.
    pub styles: LightStyles,
    /// Companion files in use, for people.
    pub companions: Vec<String>,
    /// What was odd.
    pub warnings: Warnings,
}

/// CRC-16-CCITT (polynomial 0x1021, start 0xFFFF), as engines name external entity files with.
pub fn crc16(data: &[u8]) -> u16 {
    data.iter().fold(0xffff, |crc, &byte| {
        (0..8).fold(crc ^ u16::from(byte) << 8, |crc, _| {
            if crc & 0x8000 != 0 {
                crc << 1 ^ 0x1021
            } else {
                crc << 1
            }
        })
    })
}

impl Level {
    /// Loads a level. `level` is the path of a file if there is one, else a name that is looked up
    /// in the search path: as it is, with `.bsp`, and in `maps/`. Companions of a file lie beside
    /// it; companions of a name are found in the search path and count only if their place is
    /// searched no later than the level's.
    ///
    /// # Errors
    /// [`LoadError`] if the level is not found, cannot be read, or is no level. Companions never
    /// fail a level: they are warned of.
    pub fn load(search: &SearchPath, level: &str, limits: &Limits) -> Result<Self, LoadError> {
        let path = Path::new(level);
        if path.is_file() {
            return Self::load_file(search, path, limits);
        }
        if !is_safe_name(level) {
            // It can only be meant as a path: let the file system say what is wrong with it.
            return Self::load_file(search, path, limits);
        }
        let base = level.replace('\\', "/");
        let with_extension = if has_extension(&base, ".bsp") {
            base.clone()
        } else {
            format!("{base}.bsp")
        };
        let candidates = [
            with_extension.clone(),
            format!("maps/{with_extension}"),
            base,
        ];
        for name in &candidates {
            if let Some(found) = search.read_optional(name)? {
                let dir_end = name.rfind('/').map_or(0, |slash| slash + 1);
                let places = Companions {
                    search,
                    dir: name.get(..dir_end).unwrap_or_default().to_owned(),
                    priority: found.priority,
                    game: found.game.clone(),
                };
                return Self::assemble(stem(name), found, &places, search, limits);
            }
        }
        Err(LoadError::NotFound {
            name: candidates.join(" or "),
            searched: search.describe(),
        })
    }

    /// Loads a loose level file with the companions beside it. The search path serves for WADs.
    ///
    /// # Errors
    /// As for [`Level::load`].
    pub fn load_file(search: &SearchPath, path: &Path, limits: &Limits) -> Result<Self, LoadError> {
        let found = Found {
            bytes: read_file(path, limits)?,
            origin: path.display().to_string(),
            priority: 0,
            game: None,
        };
        let dir = match path.parent() {
            Some(dir) if !dir.as_os_str().is_empty() => dir,
            _ => Path::new("."),
        };
        let beside = SearchPath::of_directory(dir, limits);
        let places = Companions {
            search: &beside,
            dir: String::new(),
            priority: 0,
            game: None,
        };
        let name = path.file_name().map(|n| n.to_string_lossy().into_owned());
        Self::assemble(
            stem(name.as_deref().unwrap_or_default()),
            found,
            &places,
            search,
            limits,
        )
    }

    /// A level held in memory, without companions. The search path serves for WADs.
    ///
    /// # Errors
    /// As for [`Level::load`], with `name` as the file's.
    pub fn from_bytes(
        search: &SearchPath,
        name: &str,
        bytes: Vec<u8>,
        limits: &Limits,
    ) -> Result<Self, LoadError> {
        let found = Found {
            bytes,
            origin: name.to_owned(),
            priority: 0,
            game: None,
        };
        let places = Companions {
            search: &SearchPath::default(),
            dir: String::new(),
            priority: 0,
            game: None,
        };
        Self::assemble(stem(name), found, &places, search, limits)
    }

    fn assemble(
        name: &str,
        found: Found,
        places: &Companions<'_>,
        search: &SearchPath,
        limits: &Limits,
    ) -> Result<Self, LoadError> {
        let mut warnings = Warnings::new();
        let mut bsp = Bsp::parse(&found.bytes, limits, &mut warnings)
            .map_err(|e: FormatError| e.in_file(&found.origin))?;
        let origin = found.origin;
        drop(found.bytes);
        let mut companions = Vec::new();

        let vis_names = [Some(name), places.game.as_deref()];
        for stem in vis_names.into_iter().flatten() {
            if let Some(file) = places.read(&format!("{stem}.vis"), &mut warnings)
                && bsp.apply_vis(&file.bytes, &format!("{name}.bsp"), &mut warnings)
            {
                companions.push(file.origin);
                break;
            }
        }

        // The name of an external entity file holds the sum of the text it replaces, without the
        // byte that ends it.
        let text = &bsp.entity_text;
        let sum = crc16(text.get(..text.len().saturating_sub(1)).unwrap_or_default());
        let ent_names = [format!("{name}@{sum:04x}.ent"), format!("{name}.ent")];
        if let Some(file) = ent_names.iter().find_map(|n| places.read(n, &mut warnings)) {
            bsp.entity_text = file.bytes;
            companions.push(file.origin);
        }
        let entities = match entity::parse(&bsp.entity_text, limits, &mut warnings) {
            Ok(entities) => entities,
            Err(e) => return Err(e.in_file(&origin).into()),
        };

        let mut light = None;
        if let Some(file) = places.read(&format!("{name}.lit"), &mut warnings) {
            match LightSamples::from_lit(&file.bytes, bsp.lighting.len()) {
                Ok(samples) => {
                    light = Some(samples);
                    companions.push(file.origin);
                }
                Err(why) => warnings.add(WarningKind::Companion, "lit", || {
                    format!("{} was ignored: {why}", file.origin)
                }),
            }
        }

        fill_external_textures(&mut bsp, &entities, places, search, limits, &mut warnings);
        Ok(Self {
            name: name.to_owned(),
            origin,
            light: light.unwrap_or_else(|| bsp.own_light_samples()),
            animation: Animation::new(&bsp.textures, &mut warnings),
            styles: LightStyles::at_start(&entities),
            bsp,
            entities,
            companions,
            warnings,
        })
    }

    /// The world's own entity, which holds the level's settings.
    pub fn worldspawn(&self) -> Option<&Entity> {
        self.entities.first()
    }
}

/// Where the companions of a level are.
struct Companions<'a> {
    search: &'a SearchPath,
    /// The level's directory, empty or with `/` at its end.
    dir: String,
    priority: u32,
    game: Option<String>,
}

impl Companions<'_> {
    fn read(&self, name: &str, warnings: &mut Warnings) -> Option<Found> {
        let full = format!("{}{name}", self.dir);
        match self.search.read_optional(&full) {
            Ok(Some(found)) if found.priority < self.priority => {
                warnings.add(WarningKind::Companion, name, || {
                    format!(
                        "{} was ignored: it belongs to a game directory below the level's",
                        found.origin
                    )
                });
                None
            }
            Ok(found) => found,
            // A name that cannot be looked up has no companions.
            Err(LoadError::BadName(_)) => None,
            Err(e) => {
                warnings.add(WarningKind::Companion, name, || format!("{e}: ignored"));
                None
            }
        }
    }
}

fn has_extension(name: &str, extension: &str) -> bool {
    let at = name.len().checked_sub(extension.len());
    at.and_then(|at| name.get(at..))
        .is_some_and(|end| end.eq_ignore_ascii_case(extension))
}

/// A file's name without directory and extension.
fn stem(name: &str) -> &str {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

/// No level lists more WADs than this; each costs a search.
const MAX_WADS: usize = 256;

/// Names of the WADs that worldspawn lists, the last listed first, without their directories.
fn wad_names(worldspawn: Option<&Entity>) -> Vec<String> {
    let list = worldspawn.and_then(|w| w.get_loose("wad")).unwrap_or("");
    let names = list.rsplit(';').map(str::trim).filter(|n| !n.is_empty());
    names
        .take(MAX_WADS)
        .map(|n| format!("{}.wad", stem(n)))
        .collect()
}

/// Takes the pixels of textures that the level only names from the WADs it lists.
fn fill_external_textures(
    bsp: &mut Bsp,
    entities: &[Entity],
    places: &Companions<'_>,
    search: &SearchPath,
    limits: &Limits,
    warnings: &mut Warnings,
) {
    let is_external = |t: &crate::miptex::MipTex| !t.has_pixels();
    if !bsp.textures.iter().flatten().any(is_external) {
        return;
    }
    for name in wad_names(entities.first()) {
        let candidates = [name.clone(), format!("gfx/{name}")];
        let found = places
            .search
            .read_optional(&name)
            .ok()
            .flatten()
            .or_else(|| {
                candidates
                    .iter()
                    .find_map(|n| search.read_optional(n).ok().flatten())
            });
        let Some(found) = found else {
            warnings.add(WarningKind::FileMissing, &name, || {
                format!("{name}, which the level lists for its textures, was not found")
            });
            continue;
        };
        let wad = match Wad::parse(&found.bytes, limits, warnings) {
            Ok(wad) => wad,
            Err(e) => {
                warnings.add(WarningKind::FileMissing, &name, || {
                    format!("{} was ignored: {e}", found.origin)
                });
                continue;
            }
        };
        let in_wad: HashMap<&str, &crate::wad::Entry> = wad
            .entries
            .iter()
            .rev() // of several of one name the first stays
            .filter(|e| wad.is_texture(e))
            .map(|e| (e.name.as_str(), e))
            .collect();
        let missing = bsp.textures.iter_mut().flatten().filter(|t| is_external(t));
        for texture in missing {
            if let Some(entry) = in_wad.get(texture.name.to_ascii_lowercase().as_str())
                && let Ok(own) = wad.read_texture(&found.bytes, entry, limits)
                && (own.width, own.height) == (texture.width, texture.height)
            {
                texture.pixels = own.pixels;
                texture.palette = own.palette;
            }
        }
    }
    let missing = bsp.textures.iter().flatten().filter(|t| is_external(t));
    let names: Vec<&str> = missing.map(|t| t.name.as_str()).collect();
    warnings.add_many(WarningKind::TextureExternal, "", names.len() as u64, || {
        let shown = names.get(..8).unwrap_or(&names).join(", ");
        let more = if names.len() > 8 { ", ..." } else { "" };
        format!("textures without pixels, shown as missing: {shown}{more}")
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc_of_the_standard_text() {
        assert_eq!(crc16(b"123456789"), 0x29b1);
    }

    #[test]
    fn wads_lose_their_directories_and_the_last_comes_first() {
        let text = br#"{ "classname" "worldspawn" "wad" "C:\q\a.wad;/x/gfx/b;;c.WAD" }"#;
        let entities = entity::parse(text, &Limits::default(), &mut Warnings::new()).unwrap();
        assert_eq!(wad_names(entities.first()), ["c.wad", "b.wad", "a.wad"]);
    }
}
