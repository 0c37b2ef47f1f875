//! Shaders that someone is working on, in development builds: written anew they are compiled anew, and the
//! picture is made by them. What does not compile is said, and the picture stays.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::SystemTime;

/// Seconds between looks.
const EVERY: f32 = 0.5;

/// The sources, and whether they are being compiled.
pub struct Hot {
    folder: PathBuf,
    /// When the newest of the files was written, at the last look and when it was compiled last.
    seen: Option<SystemTime>,
    compiled: Option<SystemTime>,
    wait: f32,
    under_way: Option<Receiver<Result<(), String>>>,
}

impl Hot {
    /// Watches the shaders' sources; `None` where there are none.
    #[must_use]
    pub fn new() -> Option<Self> {
        Some(Self::of(source()?))
    }

    /// Watches the shaders in a folder, for what is written from now on.
    #[must_use]
    pub fn of(folder: PathBuf) -> Self {
        let now = newest(&folder);
        Self {
            folder,
            seen: now,
            compiled: now,
            wait: EVERY,
            under_way: None,
        }
    }

    /// Time passes. What became of shaders that were written, once.
    pub fn pass(&mut self, seconds: f32) -> Option<Result<(), String>> {
        if let Some(under_way) = &self.under_way {
            let told = match under_way.try_recv() {
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => Err("the compiler ended without a word".into()),
                Ok(told) => told,
            };
            self.under_way = None;
            return Some(told);
        }
        self.wait -= seconds;
        if self.wait > 0.0 {
            return None;
        }
        self.wait = EVERY;
        let now = newest(&self.folder);
        let rests = std::mem::replace(&mut self.seen, now) == now;
        if rests && now != self.compiled {
            self.compiled = now;
            let (sender, receiver) = channel();
            let folder = self.folder.clone();
            std::thread::spawn(move || {
                // Nobody waits any more if the receiver is gone.
                let _ = sender.send(recompile(&folder));
            });
            self.under_way = Some(receiver);
        }
        None
    }
}

#[cfg(debug_assertions)]
fn source() -> Option<PathBuf> {
    rt::hot::shader_folder()
}

#[cfg(debug_assertions)]
fn recompile(folder: &Path) -> Result<(), String> {
    rt::hot::recompile_shaders(folder)
}

#[cfg(not(debug_assertions))]
fn source() -> Option<PathBuf> {
    None
}

#[cfg(not(debug_assertions))]
fn recompile(_: &Path) -> Result<(), String> {
    Err("this build has no compiler".into())
}

/// When the newest file of a folder and those in it was written.
fn newest(folder: &Path) -> Option<SystemTime> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let times = entries.filter_map(|entry| {
        let meta = entry.metadata().ok()?;
        if meta.is_dir() {
            newest(&entry.path())
        } else {
            meta.modified().ok()
        }
    });
    times.max()
}
