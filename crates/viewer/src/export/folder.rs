//! A directory that appears complete or not at all.

use anyhow::{Context as _, Result, bail};
use serde_json::Value;
use std::fs::{self, File};
use std::io::{BufWriter, Write as _};
use std::path::{Component, Path, PathBuf};

/// The file in every export that says what it is; by it an earlier export is known.
pub const MANIFEST: &str = "runelight-export.json";

/// A directory that is filled beside its final place and moved there by [`Folder::commit`].
/// Dropped without that, it disappears, and whatever was at the final place stays.
///
/// The final place may be missing, an empty directory, or an earlier export. An earlier export is
/// replaced as a whole; files in it that the export did not write are kept.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    part: PathBuf,
    /// Paths below the directory and sizes in bytes, as written.
    files: Vec<(String, u64)>,
}

impl Folder {
    /// Prepares the directory.
    ///
    /// # Errors
    /// When `target` is a file, or a directory with files that are no earlier export, or its parent
    /// is missing or closed to writing.
    pub fn create(target: &Path) -> Result<Self> {
        let cannot = || format!("{} cannot be written", target.display());
        let target = target.canonicalize().unwrap_or_else(|_| target.to_owned());
        let Some(name) = target.file_name() else {
            bail!("{}: it names no directory", cannot())
        };
        if target.exists() {
            if !target.is_dir() {
                bail!("{}: it is not a directory", cannot());
            }
            let mut entries = fs::read_dir(&target).with_context(cannot)?;
            if entries.next().is_some() && read_manifest(&target).is_none() {
                bail!(
                    "{}: it holds files that are no earlier export; choose another directory",
                    cannot()
                );
            }
        }
        let mut part_name = std::ffi::OsString::from(".");
        part_name.push(name);
        part_name.push(format!(".{}.part", std::process::id()));
        let part = target.with_file_name(part_name);
        // Left by a process of the same number that was killed.
        let _ = fs::remove_dir_all(&part);
        fs::create_dir(&part).with_context(cannot)?;
        Ok(Self {
            target,
            part,
            files: Vec::new(),
        })
    }

    /// Writes one file; `path` is relative, with forward slashes.
    ///
    /// # Errors
    /// When the file system refuses, the writer fails, or the user asked to stop (Ctrl-C).
    // The whole directory is renamed: its files need no renaming of their own.
    #[allow(clippy::disallowed_methods)]
    pub fn write(
        &mut self,
        path: &str,
        write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
    ) -> Result<()> {
        if crate::interrupt::asked() {
            bail!("interrupted; nothing was written");
        }
        let full = self.part.join(path);
        let attempt = || -> Result<u64> {
            if let Some(parent) = full.parent() {
                fs::create_dir_all(parent)?;
            }
            let mut file = BufWriter::new(File::create(&full)?);
            write(&mut file)?;
            file.flush()?;
            Ok(file.get_ref().metadata()?.len())
        };
        let shown = self.target.join(path);
        let bytes = attempt().with_context(|| format!("{} cannot be written", shown.display()))?;
        self.files.push((path.to_owned(), bytes));
        Ok(())
    }

    /// What was written so far: paths below the directory, and sizes in bytes.
    #[must_use]
    pub fn files(&self) -> &[(String, u64)] {
        &self.files
    }

    /// The final place.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Moves the finished directory to its final place.
    ///
    /// # Errors
    /// When the file system refuses; then the earlier export, if any, is back in its place.
    pub fn commit(self) -> Result<()> {
        let cannot = || format!("{} cannot be written", self.target.display());
        if !self.target.exists() {
            return fs::rename(&self.part, &self.target).with_context(cannot);
        }
        let old = self.part.with_extension("old");
        let _ = fs::remove_dir_all(&old);
        fs::rename(&self.target, &old).with_context(cannot)?;
        if let Err(error) = fs::rename(&self.part, &self.target) {
            let _ = fs::rename(&old, &self.target);
            return Err(error).with_context(cannot);
        }
        keep_foreign_files(&old, &self.target)
            .with_context(|| format!("{} still holds files of the earlier export", old.display()))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // After a commit there is nothing left to remove.
        let _ = fs::remove_dir_all(&self.part);
    }
}

/// Paths that an earlier export wrote; `None` if the directory is none.
fn read_manifest(dir: &Path) -> Option<Vec<PathBuf>> {
    const LARGEST: u64 = 64 << 20;
    let path = dir.join(MANIFEST);
    if path.metadata().ok()?.len() > LARGEST {
        return None;
    }
    let manifest: Value = serde_json::from_slice(&fs::read(path).ok()?).ok()?;
    manifest.get("runelight")?;
    let files = manifest.get("files")?.as_array()?;
    let paths = files.iter().filter_map(|f| f.get("path")?.as_str());
    // A manifest is a file like others and may be forged: it names nothing outside.
    Some(
        paths
            .map(PathBuf::from)
            .filter(|p| p.components().all(|c| matches!(c, Component::Normal(_))))
            .collect(),
    )
}

/// Removes the earlier export `old`, and moves what it did not write into `new`, unless a file of
/// that name is there.
fn keep_foreign_files(old: &Path, new: &Path) -> Result<()> {
    for path in read_manifest(old).unwrap_or_default() {
        let _ = fs::remove_file(old.join(path));
    }
    let _ = fs::remove_file(old.join(MANIFEST));
    move_rest(old, new)?;
    Ok(())
}

fn move_rest(from: &Path, to: &Path) -> std::io::Result<()> {
    let mut left = false;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if entry.file_type()?.is_dir() {
            if fs::read_dir(&source)?.next().is_some() {
                fs::create_dir_all(&target)?;
            }
            move_rest(&source, &target)?;
        } else if target.exists() {
            left = true;
        } else {
            fs::rename(source, target)?;
        }
    }
    if left { Ok(()) } else { fs::remove_dir(from) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let mut names: Vec<String> = (fs::read_dir(dir).unwrap())
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn export(target: &Path, files: &[&str]) -> Result<()> {
        let mut folder = Folder::create(target)?;
        for file in files {
            folder.write(file, |f| Ok(f.write_all(b"new")?))?;
        }
        let list: Vec<Value> = (files.iter())
            .map(|f| serde_json::json!({"path": f}))
            .collect();
        let text = serde_json::json!({"runelight": "1", "files": list}).to_string();
        folder.write(MANIFEST, |f| Ok(f.write_all(text.as_bytes())?))?;
        folder.commit()
    }

    #[test]
    fn a_failed_run_leaves_nothing_and_touches_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("out");
        let mut folder = Folder::create(&target).unwrap();
        folder.write("a/b.txt", |f| Ok(f.write_all(b"x")?)).unwrap();
        let error = folder.write("c", |_| bail!("no luck")).unwrap_err();
        assert!(format!("{error:#}").ends_with("no luck"), "{error:#}");
        drop(folder);
        assert!(names(dir.path()).is_empty());
    }

    #[test]
    fn an_earlier_export_is_replaced_and_other_files_are_kept() {
        let dir = tempfile::tempdir().unwrap();
        let target = dir.path().join("out");
        export(&target, &["scene.xml", "meshes/old.ply"]).unwrap();
        fs::write(target.join("scene.exr"), "mine").unwrap();
        fs::write(target.join("meshes/mine.ply"), "mine").unwrap();
        export(&target, &["scene.xml", "meshes/new.ply"]).unwrap();
        assert_eq!(names(&target.join("meshes")), ["mine.ply", "new.ply"]);
        assert_eq!(
            names(&target),
            ["meshes", MANIFEST, "scene.exr", "scene.xml"]
        );
        assert_eq!(names(dir.path()), ["out"]);
    }

    #[test]
    fn other_directories_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("letter.txt"), "dear").unwrap();
        let error = Folder::create(dir.path()).unwrap_err().to_string();
        assert!(error.contains("no earlier export"), "{error}");
        let error = Folder::create(&dir.path().join("letter.txt")).unwrap_err();
        assert!(error.to_string().contains("not a directory"), "{error}");
        assert_eq!(names(dir.path()), ["letter.txt"]);
        // A forged list cannot reach outside.
        let forged = dir.path().join("forged");
        fs::create_dir(&forged).unwrap();
        let text = r#"{"runelight": "1", "files": [{"path": "../letter.txt"}]}"#;
        fs::write(forged.join(MANIFEST), text).unwrap();
        export(&forged, &["a"]).unwrap();
        assert_eq!(names(dir.path()), ["forged", "letter.txt"]);
    }
}
