//! A level by its name on the command line: a file, a name in the search path, or the bundled one.

use crate::Usage;
use crate::bundled;
use crate::cli::Global;
use anyhow::{Context as _, Result, bail};
use bsp::lmp::Palette;
use bsp::search::SearchPathBuilder;
use bsp::{Level, Limits, SearchPath};
use scene::Scene;
use scene::import::{Cast, CastList, Files, ImportOptions, import_cast};
use sha2::{Digest as _, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Where the game has its colours.
const PALETTE: &str = "gfx/palette.lmp";

/// Where files are looked up, as the options say.
///
/// # Errors
/// When a directory or PAK of the options is missing or is none.
pub fn search_path(global: &Global) -> Result<SearchPath> {
    search(global, SearchPath::builder())
}

fn search(global: &Global, mut builder: SearchPathBuilder) -> Result<SearchPath> {
    if let Some(dir) = &global.basedir {
        builder = builder.basedir(dir);
    } else if let Some(game) = global.game.first() {
        let why = "a mod is looked up in a Quake directory; give that with --basedir";
        return Err(Usage(format!("--game {game}: {why}")).into());
    }
    for game in &global.game {
        builder = builder.game(game);
    }
    for pak in &global.pak {
        builder = builder.pak(pak);
    }
    let search = builder.build().context("--basedir, --game or --pak")?;
    for warning in search.warnings().iter() {
        tracing::warn!("{warning}");
    }
    Ok(search)
}

/// A level that was named, not read yet.
#[derive(Debug)]
pub struct Source {
    /// `None` is the bundled sample.
    wanted: Option<String>,
    search: SearchPath,
}

/// A level that was read, with what its import needs besides.
#[derive(Debug)]
pub struct Loaded {
    /// The level.
    pub level: Level,
    palette: Palette,
    search: SearchPath,
    /// Digests of the files that were read, by name.
    read: Mutex<BTreeMap<String, String>>,
}

impl Source {
    /// The level `wanted`: a file, a name to look up, or `None` for the bundled sample, whose own models
    /// come before those of a game.
    ///
    /// # Errors
    /// When the search path cannot be built.
    pub fn new(wanted: Option<&str>, global: &Global) -> Result<Self> {
        Ok(Self {
            wanted: wanted.map(str::to_owned),
            search: match wanted {
                Some(_) => search_path(global)?,
                None => search(global, SearchPath::builder().built_in(bundled::FILES))?,
            },
        })
    }

    /// The level's name without directory and extension, as output files are named.
    #[must_use]
    pub fn name(&self) -> String {
        self.wanted
            .as_deref()
            .map_or(bundled::NAME.to_owned(), |wanted| {
                let file = wanted.rsplit(['/', '\\']).next().unwrap_or(wanted);
                let stem = Path::new(file).file_stem();
                stem.map_or(file.to_owned(), |s| s.to_string_lossy().into_owned())
            })
    }

    /// The level `map` of a demo, `maps/e1m1.bsp`; the bundled one if that is what it is called and the
    /// search path has none of that name.
    ///
    /// # Errors
    /// When the search path cannot be built, or has no such level.
    pub fn of_demo(map: &str, global: &Global) -> Result<Self> {
        let source = Self::new(Some(map), global)?;
        if source.search.exists(map) {
            return Ok(source);
        }
        if map != format!("maps/{}.bsp", bundled::NAME) {
            let where_to = if source.search.is_empty() {
                "give the Quake directory with --basedir, or PAKs and directories with --pak"
            } else {
                "--basedir, --game and --pak say where levels are looked up"
            };
            bail!("the demo plays in {map}, which is not there; {where_to}");
        }
        Self::new(None, global)
    }

    /// Reads the level.
    ///
    /// # Errors
    /// When it is not found or is no level that can be read.
    pub fn load(self) -> Result<Loaded> {
        let limits = Limits::default();
        let Some(wanted) = &self.wanted else {
            return sample(self.search, &limits);
        };
        if self.search.is_empty() && !Path::new(wanted).is_file() {
            bail!(
                "{wanted}: there is no such file, and without --basedir or --pak there is nowhere \
                 to look the name up"
            );
        }
        let level = Level::load(&self.search, wanted, &limits)?;
        let palette = palette(&self.search, wanted)?;
        Ok(Loaded {
            level,
            palette,
            search: self.search,
            read: Mutex::default(),
        })
    }
}

impl Loaded {
    /// Turns the level into a scene.
    ///
    /// # Errors
    /// When there is nothing to draw.
    pub fn import(&self, options: &ImportOptions) -> Result<Scene> {
        self.with_files(|files| {
            let scene = scene::import::import(&self.level, &self.palette, files, options);
            Ok(scene?)
        })
    }

    /// Turns the level and the models of a demo into a scene that frames are shown of.
    ///
    /// # Errors
    /// When there is nothing to draw.
    pub fn import_cast(
        &self,
        options: &ImportOptions,
        list: CastList<'_>,
    ) -> Result<(Scene, Cast)> {
        self.with_files(|files| {
            let both = import_cast(&self.level, &self.palette, files, options, list);
            Ok(both?)
        })
    }

    /// Whether a file may be used: MD3 and MD5 models only if no alias model of their name comes from a place that is
    /// searched before theirs. Of the two the one that is searched first counts, and MD3 of those in one place.
    fn may_stand_in(&self, path: &str) -> bool {
        let Some((stem, ending)) = path.rsplit_once('.') else {
            return true;
        };
        let rank = |ending: &str| self.search.priority(&format!("{stem}.{ending}"));
        match ending {
            "md3" => rank("md3") >= rank("mdl") && rank("md3") >= rank("md5mesh"),
            "md5mesh" => rank("md5mesh") >= rank("mdl"),
            _ => true,
        }
    }

    /// Calls `import` with the files beside the level.
    fn with_files<T>(&self, import: impl FnOnce(&Files<'_>) -> Result<T>) -> Result<T> {
        // Most names of replacing pictures are not there: a list answers faster than the file system.
        let pictures: BTreeSet<String> = self.search.list("textures/").into_iter().collect();
        import(&|path| {
            if path.starts_with("textures/") && !pictures.contains(&path.to_ascii_lowercase()) {
                return None;
            }
            if !self.may_stand_in(path) {
                return None;
            }
            let bytes = self.search.read_optional(path).ok()??.bytes;
            let digest = sha256(&bytes);
            self.read_so_far().insert(path.to_owned(), digest);
            Some(bytes)
        })
    }

    fn read_so_far(&self) -> MutexGuard<'_, BTreeMap<String, String>> {
        self.read.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A digest of the level and its companions, of the palette, and of all files that imports have read
    /// so far: equal digests, equal scenes.
    #[must_use]
    pub fn digest(&self) -> String {
        let mut files = self.read_so_far().clone();
        let map = format!("maps/{}.bsp", self.level.name);
        let beside = ["bsp", "lit", "lux", "ent", "vis"].map(|e| Path::new(&map).with_extension(e));
        let names = beside.iter().filter_map(|p| p.to_str());
        for name in names.chain([PALETTE]) {
            if let Ok(Some(found)) = self.search.read_optional(name) {
                files.insert(name.to_owned(), sha256(&found.bytes));
            }
        }
        files.entry(map).or_insert_with(|| sha256(bundled::LEVEL));
        let list: Vec<String> = files
            .iter()
            .map(|(name, d)| format!("{name} {d}"))
            .collect();
        sha256(list.join("\n").as_bytes())
    }
}

/// SHA-256 in hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|b| format!("{b:02x}")).collect()
}

/// The sample level with its own palette.
fn sample(search: SearchPath, limits: &Limits) -> Result<Loaded> {
    Ok(Loaded {
        level: Level::from_bytes(&search, bundled::NAME, bundled::LEVEL.to_vec(), limits)?,
        palette: Palette::parse(bundled::PALETTE)?,
        search,
        read: Mutex::default(),
    })
}

/// Quake's colours out of the search path, or out of the game directory that holds a loose level.
/// Without any, the sample's colours stand in, with a warning.
fn palette(search: &SearchPath, wanted: &str) -> Result<Palette> {
    const NAME: &str = PALETTE;
    let around = || -> Option<Vec<u8>> {
        let maps = Path::new(wanted).canonicalize().ok()?.parent()?.to_owned();
        let game = (maps.file_name()? == "maps").then(|| maps.parent())??;
        let search = SearchPath::builder().pak(game).build().ok()?;
        Some(search.read_optional(NAME).ok()??.bytes)
    };
    let found = search.read_optional(NAME)?.map(|f| f.bytes).or_else(around);
    match found {
        Some(bytes) => Palette::parse(&bytes).map_err(|e| e.in_file(NAME).into()),
        None => {
            tracing::warn!(
                "there is no {NAME} to be found, so colours are wrong; give the Quake directory \
                 with --basedir"
            );
            Ok(Palette::parse(bundled::PALETTE)?)
        }
    }
}
