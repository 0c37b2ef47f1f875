//! Files that appear complete or not at all.

use anyhow::{Context as _, Result, bail};
use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// How the names of unfinished files end.
const PART: &str = ".part";

/// The file that `name` is an unfinished file of, if it is one.
#[must_use]
pub fn part_of(name: &str) -> Option<&str> {
    let (of, process) = name
        .strip_prefix('.')?
        .strip_suffix(PART)?
        .rsplit_once('.')?;
    process.bytes().all(|b| b.is_ascii_digit()).then_some(of)
}

/// Unfinished files of this process, for [`remove_unfinished`].
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file that is written beside its final place and renamed to it by [`PartFile::commit`].
/// Dropped without that, it disappears and whatever was at the final place stays.
#[derive(Debug)]
pub struct PartFile {
    /// As the user gave it.
    path: PathBuf,
    /// The final place, links followed.
    target: PathBuf,
    part: PathBuf,
    file: File,
}

impl PartFile {
    /// Creates the unfinished file in the directory of `path`.
    ///
    /// # Errors
    /// When `path` cannot become a file: its directory is missing or closed to writing, or it is
    /// something else than a regular file.
    pub fn create(path: &Path) -> Result<Self> {
        // A link is followed, so that it still is one afterwards.
        let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        match target.metadata() {
            Ok(found) if !found.is_file() => {
                bail!(
                    "{} cannot be written: it is not a regular file",
                    path.display()
                )
            }
            Ok(found) if found.permissions().readonly() => {
                bail!("{} cannot be written: it is read-only", path.display())
            }
            _ => {}
        }
        let Some(name) = target.file_name() else {
            bail!("{} cannot be written: it names no file", path.display())
        };
        let mut part_name = std::ffi::OsString::from(".");
        part_name.push(name);
        part_name.push(format!(".{}{PART}", std::process::id()));
        let part = target.with_file_name(part_name);
        let file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .open(&part)
            .with_context(|| format!("{} cannot be written", path.display()))?;
        unfinished().push(part.clone());
        Ok(Self {
            path: path.to_owned(),
            target,
            part,
            file,
        })
    }

    /// The final place, as the user gave it.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The open file, at its beginning.
    pub fn file(&mut self) -> &mut File {
        &mut self.file
    }

    /// Moves the finished file to its final place.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn commit(self) -> Result<()> {
        (self.file.sync_all())
            .and_then(|()| std::fs::rename(&self.part, &self.target))
            .with_context(|| format!("{} cannot be written", self.path.display()))
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        unfinished().retain(|p| *p != self.part);
        // After a commit there is nothing left to remove.
        let _ = std::fs::remove_file(&self.part);
    }
}

/// Removes the unfinished files of this process; for a process that is about to be aborted.
pub fn remove_unfinished() {
    for part in unfinished().drain(..) {
        let _ = std::fs::remove_file(part);
    }
}

fn unfinished() -> std::sync::MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> = (std::fs::read_dir(dir).unwrap())
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        std::fs::write(&path, "old").unwrap();
        let mut part = PartFile::create(&path).unwrap();
        part.file().write_all(b"half").unwrap();
        drop(part);
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(names(dir.path()), ["a.png"]);

        let mut part = PartFile::create(&path).unwrap();
        part.file().write_all(b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        part.commit().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(names(dir.path()), ["a.png"]);
    }

    #[test]
    fn what_cannot_be_a_file_is_said_at_once() {
        let dir = tempfile::tempdir().unwrap();
        let error = PartFile::create(dir.path()).unwrap_err().to_string();
        assert!(error.ends_with("it is not a regular file"), "{error}");
        let missing = dir.path().join("no/such/a.png");
        let error = PartFile::create(&missing).unwrap_err().to_string();
        assert!(error.contains("a.png cannot be written"), "{error}");
        assert!(names(dir.path()).is_empty());
    }
}
