//! What can go wrong with a file: errors that stop it, warnings that do not, and the limits it is
//! read under.

use std::fmt;

/// What class of trouble a [`FormatError`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// The file is of no kind known here.
    UnknownFormat,
    /// The file is of a known kind that this reader does not read.
    UnsupportedFormat,
    /// The file ends before something it promises.
    Truncated,
    /// A value lies outside its range.
    OutOfRange,
    /// A size lies above the [`Limits`] given.
    TooLarge,
    /// Something that must be there is not.
    Missing,
}

/// Why a file cannot be read, as one sentence that names the file, the part (lump or entry), the
/// index in that part, the byte offset, the value found and the value allowed, each where known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FormatError(Box<Inner>);

#[derive(Clone, Debug, PartialEq, Eq)]
struct Inner {
    kind: ErrorKind,
    file: Option<String>,
    part: String,
    index: Option<u64>,
    offset: Option<u64>,
    found: String,
    allowed: String,
}

impl FormatError {
    /// An error about `part` (a lump, an entry, the header): `found` is what is there, `allowed`
    /// what should be.
    pub fn new(
        kind: ErrorKind,
        part: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        Self(Box::new(Inner {
            kind,
            file: None,
            part: part.into(),
            index: None,
            offset: None,
            found: found.into(),
            allowed: allowed.into(),
        }))
    }

    /// The same error, at byte `offset` of the file.
    #[must_use]
    pub fn at(mut self, offset: u64) -> Self {
        self.0.offset = Some(offset);
        self
    }

    /// The same error, at entry `index` of the part.
    #[must_use]
    pub fn index(mut self, index: u64) -> Self {
        self.0.index = Some(index);
        self
    }

    /// The same error with the file's name, unless it has one already.
    #[must_use]
    pub fn in_file(mut self, name: impl Into<String>) -> Self {
        if self.0.file.is_none() {
            self.0.file = Some(name.into());
        }
        self
    }

    /// What class of trouble this is.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// The file's name, where the caller gave it.
    pub fn file(&self) -> Option<&str> {
        self.0.file.as_deref()
    }

    /// The byte offset in the file, where known.
    pub fn offset(&self) -> Option<u64> {
        self.0.offset
    }
}

impl fmt::Display for FormatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let e = &*self.0;
        if let Some(file) = &e.file {
            write!(f, "{file}: ")?;
        }
        write!(f, "{}", e.part)?;
        if let Some(index) = e.index {
            write!(f, " {index}")?;
        }
        if let Some(offset) = e.offset {
            write!(f, " at byte {offset}")?;
        }
        write!(f, ": found {}, allowed is {}", e.found, e.allowed)
    }
}

impl std::error::Error for FormatError {}

/// The most a file may ask for. The defaults are far above every level known and far below what
/// would trouble a desktop machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Largest file read into memory, in bytes (default 1 GiB).
    pub max_file_bytes: u64,
    /// Most entries of a PAK directory (default 262,144).
    pub max_pak_entries: usize,
    /// Most entries of a WAD directory (default 65,536).
    pub max_wad_entries: usize,
    /// Most textures of a level (default 65,536).
    pub max_textures: usize,
    /// Longest side of a texture or picture, in texels (default 8,192).
    pub max_texture_side: u32,
    /// Longest entity text, in bytes (default 64 MiB).
    pub max_entity_bytes: usize,
    /// Most luxels of a lightmap along one axis (default 8,192).
    pub max_luxels_per_axis: u32,
    /// Largest absolute vertex coordinate, in Quake units (default 100,000); a face that has a
    /// vertex beyond it is left out.
    pub max_coordinate: f32,
    /// Longest message of a demo's block, in bytes (default 256 KiB; no engine writes a quarter of
    /// that).
    pub max_demo_block_bytes: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_file_bytes: 1 << 30,
            max_pak_entries: 1 << 18,
            max_wad_entries: 1 << 16,
            max_textures: 1 << 16,
            max_texture_side: 8192,
            max_entity_bytes: 64 << 20,
            max_luxels_per_axis: 8192,
            max_coordinate: 1.0e5,
            max_demo_block_bytes: 1 << 18,
        }
    }
}

impl Limits {
    /// Checks the size of a whole file.
    ///
    /// # Errors
    /// [`ErrorKind::TooLarge`] if `bytes` is above [`Limits::max_file_bytes`].
    pub fn check_file(&self, bytes: u64) -> Result<(), FormatError> {
        if bytes > self.max_file_bytes {
            return Err(FormatError::new(
                ErrorKind::TooLarge,
                "file size",
                format!("{bytes} bytes"),
                format!("at most {} bytes", self.max_file_bytes),
            ));
        }
        Ok(())
    }
}

/// What kind of oddity a [`Warning`] tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum WarningKind {
    /// An archive entry was left out.
    ArchiveEntry,
    /// A lump lies outside the file, or its size is no multiple of its record.
    LumpRange,
    /// A texture is missing or unusable.
    TextureMissing,
    /// A texture's pixels are elsewhere (a WAD) and were not found.
    TextureExternal,
    /// A texture's size or data is odd and was repaired.
    TextureRepaired,
    /// An animation sequence has a gap or a bad name.
    TextureAnimation,
    /// A texinfo record is out of range or unusable.
    Texinfo,
    /// Faces were left out.
    FaceDropped,
    /// A plane's normal is unusable and is computed from vertices.
    Plane,
    /// A model's face range was cut.
    ModelRange,
    /// A node, leaf or clipnode has a bad reference or forms a loop.
    Tree,
    /// More leafs than the original engines take.
    LeafCount,
    /// A leaf's marksurfaces are out of range.
    Marksurface,
    /// Visibility data is missing or cut short.
    Visibility,
    /// A face's lightmap is unusable.
    Lightmap,
    /// A companion file (`.lit`, `.vis`, `.ent`) was ignored.
    Companion,
    /// A `BSPX` lump was ignored.
    Bspx,
    /// The file looks like another format under this one's version.
    Mislabelled,
    /// Entity text is malformed.
    EntitySyntax,
    /// An entity was left out.
    EntityDropped,
    /// A file that the level names was not found.
    FileMissing,
    /// A picture or palette is odd.
    Picture,
    /// A part of a model or sprite was repaired or left out.
    Model,
    /// A demo ends in the middle of a block.
    DemoTruncated,
    /// A block of a demo cannot be read to its end.
    DemoBlock,
    /// A number in a demo is out of range and was replaced.
    DemoValue,
}

/// One oddity: what kind, one sentence about its first occurrence, how often it occurred.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What kind of oddity.
    pub kind: WarningKind,
    /// One sentence, about the first occurrence.
    pub text: String,
    /// How many occurrences of the same kind and subject there were; at least 1.
    pub count: u64,
    subject: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.text)?;
        if self.count > 1 {
            write!(f, " ({} times)", self.count)?;
        }
        Ok(())
    }
}

/// Collects oddities that do not stop a file. Those of the same kind and subject are told once and
/// counted, and no more than [`Warnings::MAX_DISTINCT`] different ones are kept.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Warnings {
    list: Vec<Warning>,
    suppressed: u64,
}

impl Warnings {
    /// Most different warnings kept; the rest is only counted.
    pub const MAX_DISTINCT: usize = 200;

    /// An empty collector.
    pub fn new() -> Self {
        Self::default()
    }

    /// Tells of one occurrence. `subject` separates oddities of one kind that deserve a sentence
    /// each (a texture's name, say); leave it empty to tell a kind once. `text` is called only for
    /// the first occurrence.
    pub fn add(&mut self, kind: WarningKind, subject: &str, text: impl FnOnce() -> String) {
        self.add_many(kind, subject, 1, text);
    }

    /// Like [`Warnings::add`] for `count` occurrences at once; none if `count` is 0.
    pub fn add_many(
        &mut self,
        kind: WarningKind,
        subject: &str,
        count: u64,
        text: impl FnOnce() -> String,
    ) {
        if count == 0 {
            return;
        }
        if let Some(old) = self
            .list
            .iter_mut()
            .find(|w| w.kind == kind && w.subject == subject)
        {
            old.count = old.count.saturating_add(count);
        } else if self.list.len() < Self::MAX_DISTINCT {
            self.list.push(Warning {
                kind,
                text: text(),
                count,
                subject: subject.to_owned(),
            });
        } else {
            self.suppressed = self.suppressed.saturating_add(count);
        }
    }

    /// The different warnings, in order of first occurrence.
    pub fn iter(&self) -> impl Iterator<Item = &Warning> {
        self.list.iter()
    }

    /// Number of different warnings kept.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether nothing was odd.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Occurrences that were counted but not kept, because there were too many different ones.
    pub fn suppressed(&self) -> u64 {
        self.suppressed
    }

    /// Whether there is a warning of this kind.
    pub fn has(&self, kind: WarningKind) -> bool {
        self.list.iter().any(|w| w.kind == kind)
    }

    /// Occurrences of this kind, over all subjects.
    pub fn count(&self, kind: WarningKind) -> u64 {
        self.list
            .iter()
            .filter(|w| w.kind == kind)
            .fold(0, |sum, w| sum.saturating_add(w.count))
    }

    /// Takes in all warnings of another collector.
    pub fn extend(&mut self, other: Warnings) {
        for w in other.list {
            let text = w.text;
            self.add_many(w.kind, &w.subject, w.count, || text);
        }
        self.suppressed = self.suppressed.saturating_add(other.suppressed);
    }
}
