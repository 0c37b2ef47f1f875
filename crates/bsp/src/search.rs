//! Quake's search path: game directories with their PAKs, explicit extra PAKs or directories, and
//! the order in which they answer.
//!
//! What is added later is searched first: `id1`, then the game directories as given, then the
//! extra PAKs or directories as given. Inside a directory the highest-numbered PAK comes first,
//! `pak0` last, then loose files, or loose files first with [`SearchPathBuilder::files_first`].
//! Names are tried exactly first, then without regard to case.

use std::collections::BTreeSet;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::{FormatError, Limits, WarningKind, Warnings};
use crate::pak::{OpenError, PakFile, is_safe_name};

/// Directories below a game directory are listed to this depth.
const MAX_DEPTH: usize = 16;
/// A listing ends at this many names.
const MAX_LISTED: usize = 1 << 20;

/// Why a file could not be had.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// No place of the search path has the file.
    #[error("{name} was not found in {searched}")]
    NotFound {
        /// The name looked up.
        name: String,
        /// Where, as words.
        searched: String,
    },
    /// A name that leads out of the search path.
    #[error("{0:?} is no name of a game file: it must be relative, without \"..\"")]
    BadName(String),
    /// A directory that must be there is not.
    #[error("{path} is not a directory")]
    NoDirectory {
        /// The directory.
        path: String,
    },
    /// The file system refused.
    #[error("{path}: {source}")]
    Io {
        /// The file or directory.
        path: String,
        /// Why.
        source: io::Error,
    },
    /// The file is not what it should be.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl LoadError {
    fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.display().to_string();
        move |source| Self::Io { path, source }
    }
}

/// A file that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Where it was, for people: `id1/pak0.pak:maps/start.bsp` with the paths as given.
    pub origin: String,
    /// Rank of its game directory or extra PAK: higher is searched first. Companion files count
    /// only if theirs is at least that of the file they belong to.
    pub priority: u32,
    /// Name of its game directory, if it has one.
    pub game: Option<String>,
}

/// Files that a program brings along: names (lowercase, `/`) and bytes.
pub type BuiltIn = &'static [(&'static str, &'static [u8])];

#[derive(Debug)]
enum Source {
    Pak(PakFile),
    Directory(PathBuf),
    BuiltIn(BuiltIn),
}

#[derive(Debug)]
struct Place {
    source: Source,
    priority: u32,
    game: Option<String>,
}

/// The places where game files are looked for, in order.
#[derive(Debug, Default)]
pub struct SearchPath {
    /// First searched first.
    places: Vec<Place>,
    limits: Limits,
    warnings: Warnings,
}

/// Collects what a [`SearchPath`] consists of.
#[derive(Clone, Debug, Default)]
pub struct SearchPathBuilder {
    basedirs: Vec<PathBuf>,
    games: Vec<String>,
    paks: Vec<PathBuf>,
    built_in: BuiltIn,
    files_first: bool,
    limits: Limits,
}

impl SearchPathBuilder {
    /// Adds a Quake directory, which holds `id1` and the game directories.
    #[must_use]
    pub fn basedir(mut self, path: impl Into<PathBuf>) -> Self {
        self.basedirs.push(path.into());
        self
    }

    /// Adds a game directory (`hipnotic`, `rogue`, a mod), which must be in one of the base
    /// directories; `id1` is always there and need not be named.
    #[must_use]
    pub fn game(mut self, name: impl Into<String>) -> Self {
        self.games.push(name.into());
        self
    }

    /// Adds a PAK file, or a directory that is searched like a game directory.
    #[must_use]
    pub fn pak(mut self, path: impl Into<PathBuf>) -> Self {
        self.paks.push(path.into());
        self
    }

    /// Adds files that the program brings along; they are searched before all others.
    #[must_use]
    pub fn built_in(mut self, files: BuiltIn) -> Self {
        self.built_in = files;
        self
    }

    /// Lets loose files win over the PAKs of the same directory, as some engines do.
    #[must_use]
    pub fn files_first(mut self, yes: bool) -> Self {
        self.files_first = yes;
        self
    }

    /// Reads files under these limits instead of the default ones.
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// Opens all PAKs and reads their directories.
    ///
    /// # Errors
    /// A base directory without `id1`, a game directory that no base directory has, an explicit
    /// PAK that cannot be read. A bad PAK inside a game directory is only warned of.
    pub fn build(self) -> Result<SearchPath, LoadError> {
        let mut path = SearchPath {
            limits: self.limits.clone(),
            ..SearchPath::default()
        };
        let mut priority = 0;
        let first = std::iter::once("id1");
        let others = self.games.iter().map(String::as_str);
        for game in first.chain(others.filter(|g| !g.eq_ignore_ascii_case("id1"))) {
            if !is_safe_name(game) {
                return Err(LoadError::BadName(game.to_owned()));
            }
            let mut found = false;
            for basedir in &self.basedirs {
                if !basedir.is_dir() {
                    return Err(LoadError::NoDirectory {
                        path: basedir.display().to_string(),
                    });
                }
                if let Some(dir) = resolve(basedir, game).filter(|p| p.is_dir()) {
                    priority += 1;
                    path.add_directory(dir, Some(game), priority, self.files_first);
                    found = true;
                }
            }
            if !found && (game != "id1" || !self.basedirs.is_empty()) {
                let base = self.basedirs.first().cloned().unwrap_or_default();
                return Err(LoadError::NoDirectory {
                    path: base.join(game).display().to_string(),
                });
            }
        }
        for pak in &self.paks {
            priority += 1;
            if pak.is_dir() {
                path.add_directory(pak.clone(), None, priority, self.files_first);
                continue;
            }
            let file =
                PakFile::open(pak, &path.limits, &mut path.warnings).map_err(|e| match e {
                    OpenError::Io(source) => LoadError::io(pak)(source),
                    OpenError::Format(e) => e.into(),
                })?;
            path.push(Source::Pak(file), priority, None);
        }
        if !self.built_in.is_empty() {
            path.push(Source::BuiltIn(self.built_in), priority + 1, None);
        }
        path.places.reverse();
        Ok(path)
    }
}

/// The path of `name` below `dir`: as spelled if that exists, else found without regard to case.
fn resolve(dir: &Path, name: &str) -> Option<PathBuf> {
    let exact = dir.join(name);
    if exact.exists() {
        return Some(exact);
    }
    let mut at = dir.to_owned();
    for part in name.split('/') {
        let exact = at.join(part);
        if exact.exists() {
            at = exact;
            continue;
        }
        // Of several spellings the least, so that the answer does not depend on the file system.
        at = fs::read_dir(&at)
            .ok()?
            .filter_map(Result::ok)
            .filter(|entry| {
                entry
                    .file_name()
                    .to_str()
                    .is_some_and(|n| n.eq_ignore_ascii_case(part))
            })
            .map(|entry| entry.path())
            .min()?;
    }
    Some(at)
}

/// Reads a whole file under the size limit.
pub(crate) fn read_file(path: &Path, limits: &Limits) -> Result<Vec<u8>, LoadError> {
    let file = fs::File::open(path).map_err(LoadError::io(path))?;
    let meta = file.metadata().map_err(LoadError::io(path))?;
    if meta.is_dir() {
        return Err(LoadError::io(path)(io::ErrorKind::IsADirectory.into()));
    }
    let named = |e: FormatError| e.in_file(path.display().to_string());
    limits.check_file(meta.len()).map_err(named)?;
    let mut bytes = Vec::new();
    // A device or a growing file may have more than its metadata says.
    file.take(limits.max_file_bytes.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(LoadError::io(path))?;
    limits.check_file(bytes.len() as u64).map_err(named)?;
    Ok(bytes)
}

impl SearchPath {
    /// Starts a search path.
    pub fn builder() -> SearchPathBuilder {
        SearchPathBuilder::default()
    }

    /// A search path of one directory without its PAKs: for the siblings of a loose file.
    pub(crate) fn of_directory(path: &Path, limits: &Limits) -> Self {
        let mut this = Self {
            limits: limits.clone(),
            ..Self::default()
        };
        this.push(Source::Directory(path.to_owned()), 0, None);
        this
    }

    /// Oddities of the PAKs.
    pub fn warnings(&self) -> &Warnings {
        &self.warnings
    }

    /// The limits that files are read under.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Whether there is no place to look in.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// The places in the order they are searched, for people.
    pub fn places(&self) -> impl Iterator<Item = String> + '_ {
        self.places.iter().map(Place::label)
    }

    fn push(&mut self, source: Source, priority: u32, game: Option<&str>) {
        self.places.push(Place {
            source,
            priority,
            game: game.map(str::to_owned),
        });
    }

    /// Adds a game directory's places; those searched first come last here.
    fn add_directory(
        &mut self,
        dir: PathBuf,
        game: Option<&str>,
        priority: u32,
        files_first: bool,
    ) {
        if !files_first {
            self.push(Source::Directory(dir.clone()), priority, game);
        }
        for number in 0_u32.. {
            let Some(path) = resolve(&dir, &format!("pak{number}.pak")).filter(|p| p.is_file())
            else {
                break;
            };
            match PakFile::open(&path, &self.limits, &mut self.warnings) {
                Ok(pak) => self.push(Source::Pak(pak), priority, game),
                Err(e) => {
                    let label = path.display().to_string();
                    self.warnings.add(WarningKind::ArchiveEntry, &label, || {
                        format!("{label} was left out: {e}")
                    });
                }
            }
        }
        if files_first {
            self.push(Source::Directory(dir), priority, game);
        }
    }

    fn checked(name: &str) -> Result<String, LoadError> {
        let name = name.replace('\\', "/");
        if is_safe_name(&name) {
            Ok(name)
        } else {
            Err(LoadError::BadName(name))
        }
    }

    /// Rank of the place that has the file ([`Found::priority`]).
    pub fn priority(&self, name: &str) -> Option<u32> {
        let name = Self::checked(name).ok()?;
        let place = self.places.iter().find(|place| place.has(&name));
        place.map(|place| place.priority)
    }

    /// Whether some place has the file.
    pub fn exists(&self, name: &str) -> bool {
        Self::checked(name).is_ok_and(|name| self.places.iter().any(|place| place.has(&name)))
    }

    /// Reads a file from the first place that has it.
    ///
    /// # Errors
    /// [`LoadError::NotFound`] if none has it, else what hindered reading.
    pub fn read(&self, name: &str) -> Result<Found, LoadError> {
        let name = Self::checked(name)?;
        for place in &self.places {
            if let Some(found) = place.read(&name, &self.limits)? {
                return Ok(found);
            }
        }
        Err(LoadError::NotFound {
            name,
            searched: self.describe(),
        })
    }

    /// Reads a file if there is one; `None` if no place has it.
    ///
    /// # Errors
    /// What hindered reading.
    pub fn read_optional(&self, name: &str) -> Result<Option<Found>, LoadError> {
        match self.read(name) {
            Ok(found) => Ok(Some(found)),
            Err(LoadError::NotFound { .. }) => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// Names of all files that begin with `prefix` (lowercase, `/`), sorted, each once, over all
    /// places.
    pub fn list(&self, prefix: &str) -> Vec<String> {
        let prefix = prefix.replace('\\', "/").to_ascii_lowercase();
        let mut names = BTreeSet::new();
        for place in &self.places {
            match &place.source {
                Source::Pak(pak) => {
                    let entries = pak.directory().entries().iter();
                    names.extend(
                        entries
                            .map(|e| e.name.to_ascii_lowercase())
                            .filter(|n| n.starts_with(&prefix)),
                    );
                }
                Source::Directory(dir) => list_directory(dir, "", &prefix, 0, &mut names),
                Source::BuiltIn(files) => {
                    let files = files.iter().map(|(name, _)| (*name).to_owned());
                    names.extend(files.filter(|n| n.starts_with(&prefix)));
                }
            }
        }
        names.into_iter().collect()
    }

    pub(crate) fn describe(&self) -> String {
        let places: Vec<String> = self.places().collect();
        if places.is_empty() {
            "an empty search path (no base directory and no PAK was given)".to_owned()
        } else {
            places.join(", ")
        }
    }
}

fn list_directory(
    dir: &Path,
    below: &str,
    prefix: &str,
    depth: usize,
    names: &mut BTreeSet<String>,
) {
    let Ok(entries) = fs::read_dir(dir) else {
        return;
    };
    for entry in entries.filter_map(Result::ok) {
        if names.len() >= MAX_LISTED {
            return;
        }
        let Some(name) = entry.file_name().to_str().map(str::to_ascii_lowercase) else {
            continue;
        };
        let name = format!("{below}{name}");
        let Ok(kind) = entry.file_type() else {
            continue;
        };
        if kind.is_dir() {
            let name = name + "/";
            let related = name.starts_with(prefix) || prefix.starts_with(&name);
            if depth < MAX_DEPTH && related {
                list_directory(&entry.path(), &name, prefix, depth + 1, names);
            }
        } else if name.starts_with(prefix) && entry.path().is_file() {
            names.insert(name);
        }
    }
}

/// Where files that the program brings along are, for people.
const BUILT_IN: &str = "the bundled files";

fn built_in(files: BuiltIn, name: &str) -> Option<&'static [u8]> {
    let found = files.iter().find(|f| f.0.eq_ignore_ascii_case(name));
    found.map(|f| f.1)
}

impl Place {
    fn label(&self) -> String {
        match &self.source {
            Source::Pak(pak) => pak.path().display().to_string(),
            Source::Directory(dir) => dir.display().to_string(),
            Source::BuiltIn(_) => BUILT_IN.to_owned(),
        }
    }

    fn has(&self, name: &str) -> bool {
        match &self.source {
            Source::Pak(pak) => pak.directory().find(name).is_some(),
            Source::Directory(dir) => resolve(dir, name).is_some_and(|p| p.is_file()),
            Source::BuiltIn(files) => built_in(files, name).is_some(),
        }
    }

    fn read(&self, name: &str, limits: &Limits) -> Result<Option<Found>, LoadError> {
        let (bytes, origin) = match &self.source {
            Source::Pak(pak) => {
                let Some(entry) = pak.directory().find(name) else {
                    return Ok(None);
                };
                let origin = format!("{}:{}", pak.path().display(), entry.name);
                limits
                    .check_file(entry.length)
                    .map_err(|e| e.in_file(&origin))?;
                let bytes = pak.read(entry).map_err(|source| LoadError::Io {
                    path: origin.clone(),
                    source,
                })?;
                (bytes, origin)
            }
            Source::Directory(dir) => {
                let Some(path) = resolve(dir, name).filter(|p| p.is_file()) else {
                    return Ok(None);
                };
                (read_file(&path, limits)?, path.display().to_string())
            }
            Source::BuiltIn(files) => {
                let Some(bytes) = built_in(files, name) else {
                    return Ok(None);
                };
                (bytes.to_vec(), format!("{BUILT_IN}:{name}"))
            }
        };
        Ok(Some(Found {
            bytes,
            origin,
            priority: self.priority,
            game: self.game.clone(),
        }))
    }
}
