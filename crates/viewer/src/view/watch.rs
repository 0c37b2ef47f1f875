//! A level's file, and whether someone has written it anew.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Seconds between looks.
const EVERY: f32 = 0.5;

/// When a file was written, and how long it is.
type Stamp = Option<(SystemTime, u64)>;

/// A file that is looked at now and then.
#[derive(Clone, Debug)]
pub struct Watch {
    path: PathBuf,
    known: Stamp,
    /// What it was at the last look: compilers write for a while.
    last: Stamp,
    wait: f32,
}

fn stamp(path: &Path) -> Stamp {
    let meta = std::fs::metadata(path).ok()?;
    Some((meta.modified().ok()?, meta.len()))
}

impl Watch {
    /// Watches a file from now on; `None` if there is no such file.
    #[must_use]
    pub fn new(path: &Path) -> Option<Self> {
        let known = stamp(path).filter(|_| path.is_file());
        known.is_some().then(|| Self {
            path: path.to_owned(),
            known,
            last: known,
            wait: EVERY,
        })
    }

    /// Time passes. Whether the file is another one since it was last told, and stays as it is.
    pub fn pass(&mut self, seconds: f32) -> bool {
        self.wait -= seconds;
        if self.wait > 0.0 {
            return false;
        }
        self.wait = EVERY;
        let now = stamp(&self.path);
        let rests = now == std::mem::replace(&mut self.last, now);
        let is_new = now.is_some() && now != self.known && rests;
        if is_new {
            self.known = now;
        }
        is_new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_told_once_when_it_is_written_and_at_rest() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bsp");
        assert!(Watch::new(&path).is_none());
        std::fs::write(&path, [1]).unwrap();
        let mut watch = Watch::new(&path).unwrap();
        let looks = |watch: &mut Watch| watch.pass(1.0);
        assert!(!looks(&mut watch) && !looks(&mut watch));
        std::fs::write(&path, [1, 2]).unwrap();
        assert!(!watch.pass(0.1), "not yet looked");
        assert!(!looks(&mut watch), "it may still be written");
        assert!(looks(&mut watch));
        assert!(!looks(&mut watch), "told once");
        std::fs::remove_file(&path).unwrap();
        assert!(
            !looks(&mut watch) && !looks(&mut watch),
            "gone is not written"
        );
        std::fs::write(&path, [1, 2, 3]).unwrap();
        assert!(!looks(&mut watch));
        assert!(looks(&mut watch));
    }
}
