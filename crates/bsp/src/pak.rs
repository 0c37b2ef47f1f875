//! PAK archives: a directory of names, offsets and lengths over uncompressed files.
//!
//! [`PakFile`] keeps an archive open and reads entries on demand; [`Directory`] alone serves bytes
//! already in memory.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use crate::error::{ErrorKind, FormatError, Limits, WarningKind, Warnings};
use crate::reader::{Reader, latin1, until_nul};

const HEADER_SIZE: usize = 12;
const ENTRY_SIZE: u64 = 64;

/// One file of an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Name as stored, with `/` for `\`, cut at its first NUL (or all of its 56 bytes).
    pub name: String,
    /// Byte offset in the archive.
    pub offset: u64,
    /// Length in bytes; `offset + length` lies within the archive.
    pub length: u64,
}

/// The directory of an archive.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Directory {
    entries: Vec<Entry>,
    /// Indices of `entries` by case-folded name, those of one name in file order.
    by_name: Vec<u32>,
}

fn fold(name: &str) -> impl Iterator<Item = u8> {
    name.bytes().map(|b| match b {
        b'\\' => b'/',
        b => b.to_ascii_lowercase(),
    })
}

/// Whether a name can be looked up at all: relative, and without `..`.
pub(crate) fn is_safe_name(name: &str) -> bool {
    !name.is_empty()
        && !name.starts_with(['/', '\\'])
        && !name.contains(':')
        && name
            .split(['/', '\\'])
            .all(|part| !part.is_empty() && part != ".." && part != ".")
}

impl Directory {
    /// Reads the directory of an archive held in memory.
    ///
    /// # Errors
    /// A wrong signature, or a directory outside of the archive, or one of more entries than
    /// [`Limits::max_pak_entries`]. Single bad entries are left out with a warning.
    pub fn parse(
        data: &[u8],
        limits: &Limits,
        warnings: &mut Warnings,
    ) -> Result<Self, FormatError> {
        let size = data.len() as u64;
        let header = data.get(..HEADER_SIZE).unwrap_or(data);
        let (offset, length) = directory_range(header, size, limits)?;
        let table = usize::try_from(offset)
            .ok()
            .zip(usize::try_from(length).ok())
            .and_then(|(o, n)| data.get(o..o.checked_add(n)?))
            .unwrap_or_default();
        Ok(Self::from_table(table, size, warnings))
    }

    fn from_table(table: &[u8], size: u64, warnings: &mut Warnings) -> Self {
        let mut entries = Vec::with_capacity(table.len() / ENTRY_SIZE as usize);
        let (rows, _) = table.as_chunks::<{ ENTRY_SIZE as usize }>();
        for (index, row) in rows.iter().enumerate() {
            let mut reader = Reader::new(row);
            let (Some(name), Some(offset), Some(length)) =
                (reader.take(56), reader.i32(), reader.i32())
            else {
                break;
            };
            let name = latin1(until_nul(name)).replace('\\', "/");
            let range = u64::try_from(offset).ok().zip(u64::try_from(length).ok());
            let Some((offset, length)) = range.filter(|(o, n)| o + n <= size) else {
                warnings.add(WarningKind::ArchiveEntry, "range", || {
                    format!(
                        "archive entry {index} ({name:?}) claims {length} bytes at {offset} of an \
                         archive of {size} and was left out"
                    )
                });
                continue;
            };
            if !is_safe_name(&name) {
                warnings.add(WarningKind::ArchiveEntry, "name", || {
                    format!("archive entry {index} has the unusable name {name:?} and was left out")
                });
                continue;
            }
            entries.push(Entry {
                name,
                offset,
                length,
            });
        }
        if rows.is_empty() {
            warnings.add(WarningKind::ArchiveEntry, "empty", || {
                "the archive has no entries".to_owned()
            });
        }
        let mut by_name: Vec<u32> = (0..).take(entries.len()).collect();
        by_name.sort_by(|&a, &b| {
            let name = |i: u32| entries.get(i as usize).map_or("", |e| e.name.as_str());
            fold(name(a)).cmp(fold(name(b)))
        });
        Self { entries, by_name }
    }

    /// The entries in file order.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The entry of this name: an exact match first, else one that differs in case or in the kind
    /// of slash; of several the first of the archive.
    pub fn find(&self, name: &str) -> Option<&Entry> {
        let start = self.by_name.partition_point(|&i| {
            self.entries
                .get(i as usize)
                .is_some_and(|e| fold(&e.name).lt(fold(name)))
        });
        let same = self
            .by_name
            .iter()
            .skip(start)
            .map_while(|&i| self.entries.get(i as usize))
            .take_while(|e| fold(&e.name).eq(fold(name)));
        let mut first = None;
        for entry in same {
            if entry.name == name {
                return Some(entry);
            }
            first = first.or(Some(entry));
        }
        first
    }
}

/// Byte offset and length of the directory, proven to lie in an archive of `size` bytes.
fn directory_range(header: &[u8], size: u64, limits: &Limits) -> Result<(u64, u64), FormatError> {
    let mut reader = Reader::new(header);
    let fields = (reader.array::<4>(), reader.i32(), reader.i32());
    let (Some(magic), Some(offset), Some(length)) = fields else {
        return Err(FormatError::new(
            ErrorKind::Truncated,
            "PAK header",
            format!("{} bytes", header.len()),
            format!("at least {HEADER_SIZE}"),
        ));
    };
    if &magic != b"PACK" {
        return Err(FormatError::new(
            ErrorKind::UnknownFormat,
            "PAK header",
            format!("the signature {:?}", latin1(&magic)),
            "\"PACK\"",
        )
        .at(0));
    }
    let range = u64::try_from(offset)
        .ok()
        .zip(u64::try_from(length).ok())
        .filter(|(o, n)| o + n <= size);
    let Some((offset, length)) = range else {
        return Err(FormatError::new(
            ErrorKind::OutOfRange,
            "PAK directory",
            format!("{length} bytes at {offset}"),
            format!("a range within the archive's {size} bytes"),
        )
        .at(4));
    };
    let count = length / ENTRY_SIZE;
    if count > limits.max_pak_entries as u64 {
        return Err(FormatError::new(
            ErrorKind::TooLarge,
            "PAK directory",
            format!("{count} entries"),
            format!("at most {}", limits.max_pak_entries),
        )
        .at(8));
    }
    Ok((offset, length))
}

/// An open archive whose entries are read on demand.
#[derive(Debug)]
pub struct PakFile {
    path: PathBuf,
    file: Mutex<File>,
    directory: Directory,
}

/// Why an archive could not be opened: the file system's reason or the format's.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The file could not be opened or read.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The file is no usable archive.
    #[error(transparent)]
    Format(#[from] FormatError),
}

impl PakFile {
    /// Opens an archive and reads its directory.
    ///
    /// # Errors
    /// [`OpenError`] if the file cannot be read or is no PAK.
    pub fn open(path: &Path, limits: &Limits, warnings: &mut Warnings) -> Result<Self, OpenError> {
        let name = path.display().to_string();
        let mut file = File::open(path)?;
        let size = file.metadata()?.len();
        let mut header = Vec::with_capacity(HEADER_SIZE);
        Read::by_ref(&mut file)
            .take(HEADER_SIZE as u64)
            .read_to_end(&mut header)?;
        let (offset, length) =
            directory_range(&header, size, limits).map_err(|e| e.in_file(&name))?;
        file.seek(SeekFrom::Start(offset))?;
        let mut table = Vec::new();
        Read::by_ref(&mut file)
            .take(length)
            .read_to_end(&mut table)?;
        Ok(Self {
            path: path.to_owned(),
            file: Mutex::new(file),
            directory: Directory::from_table(&table, size, warnings),
        })
    }

    /// Where the archive lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its directory.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// Reads the bytes of an entry of this archive's directory.
    ///
    /// # Errors
    /// What the file system says, also if the archive has become shorter since it was opened.
    pub fn read(&self, entry: &Entry) -> io::Result<Vec<u8>> {
        let size = usize::try_from(entry.length).map_err(io::Error::other)?;
        let mut file = match self.file.lock() {
            Ok(file) => file,
            // The position is set anew for each read: a panic elsewhere leaves nothing broken.
            Err(poisoned) => poisoned.into_inner(),
        };
        file.seek(SeekFrom::Start(entry.offset))?;
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size).map_err(io::Error::other)?;
        Read::by_ref(&mut *file)
            .take(entry.length)
            .read_to_end(&mut bytes)?;
        if bytes.len() < size {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(bytes)
    }
}
