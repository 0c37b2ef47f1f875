//! A flight that is recorded: keys of a camera path, played, edited, and kept in the file that
//! `--camera-path` reads.

use super::app::App;
use super::fly::Eye;
use crate::output::PartFile;
use anyhow::{Context as _, Result, bail};
use scene::camera_path::{CameraPath, Key};
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// Seconds from one key to the next, where nothing else says when it is.
pub const STEP: f64 = 2.0;
/// Keys nearer than this are one, in seconds.
const SAME: f64 = 1e-3;

/// A flight, and how far it is played.
#[derive(Default)]
pub struct FlightPath {
    keys: Vec<Key>,
    /// Through the keys; `None` without any.
    path: Option<CameraPath>,
    /// Seconds of the path.
    pub time: f64,
    /// Whether it is flown: by its own time, or by that of a demo.
    pub flies: bool,
    /// Where it is kept.
    pub file: String,
    /// Whether the file holds it as it is.
    pub is_saved: bool,
}

impl FlightPath {
    /// The keys, in order of time.
    #[must_use]
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// The flight through them.
    #[must_use]
    pub fn path(&self) -> Option<&CameraPath> {
        self.path.as_ref()
    }

    /// When the next key is, where nothing else says so.
    #[must_use]
    pub fn next_time(&self) -> f64 {
        self.keys.last().map_or(0.0, |k| k.time + STEP)
    }

    /// Puts a key in its place; one at the same time goes.
    ///
    /// # Errors
    /// When a number of it is out of range; the flight stays as it was.
    pub fn put(&mut self, key: Key) -> Result<()> {
        let mut keys = self.keys.clone();
        keys.retain(|k| (k.time - key.time).abs() > SAME);
        let at = keys.partition_point(|k| k.time < key.time);
        keys.insert(at, key);
        self.take(keys)
    }

    /// Gives a key another time; it takes its place there.
    ///
    /// # Errors
    /// When there is another key at that time, or that is out of range.
    pub fn retime(&mut self, index: usize, time: f64) -> Result<()> {
        let mut keys = self.keys.clone();
        if index >= keys.len() {
            return Ok(());
        }
        let key = Key {
            time,
            ..keys.remove(index)
        };
        if keys.iter().any(|k| (k.time - time).abs() <= SAME) {
            bail!("there is another key at {time:.3} s");
        }
        keys.insert(keys.partition_point(|k| k.time < time), key);
        self.take(keys)
    }

    /// Removes a key.
    pub fn remove(&mut self, index: usize) {
        if index < self.keys.len() {
            self.keys.remove(index);
            self.path = CameraPath::new(self.keys.clone()).ok();
            self.flies &= self.path.is_some();
            self.is_saved = false;
        }
    }

    /// Removes all keys.
    pub fn clear(&mut self) {
        *self = Self {
            file: std::mem::take(&mut self.file),
            ..Self::default()
        };
    }

    fn take(&mut self, keys: Vec<Key>) -> Result<()> {
        self.path = Some(CameraPath::new(keys.clone())?);
        self.keys = keys;
        self.is_saved = false;
        Ok(())
    }

    /// Writes the file.
    ///
    /// # Errors
    /// When there is nothing to write, or that can't be done.
    pub fn save(&mut self, path: &Path) -> Result<()> {
        let flight = self.path.as_ref().context("there is no key yet")?;
        let mut file = PartFile::create(path)?;
        file.file().write_all(flight.to_toml().as_bytes())?;
        file.commit()?;
        self.is_saved = true;
        Ok(())
    }

    /// Reads a file.
    ///
    /// # Errors
    /// When it can't be read or is no camera path; the flight stays as it was.
    pub fn load(&mut self, path: &Path) -> Result<()> {
        let text = crate::cli::read_text(path).with_context(|| path.display().to_string())?;
        let flight = CameraPath::parse(&path.display().to_string(), &text)?;
        self.keys = flight.keys().to_vec();
        self.path = Some(flight);
        (self.is_saved, self.time, self.flies) = (true, 0.0, false);
        Ok(())
    }
}

impl App {
    /// The file of the flight, in the folder for pictures unless it says another.
    #[must_use]
    pub fn path_file(&self) -> PathBuf {
        let named = self.flight_path.file.trim();
        if named.is_empty() {
            let name = (self.stage.as_ref()).map_or("sample", |s| s.scene.name.as_str());
            return (self.folder).join(format!("{}.path.toml", super::save::file_name(name)));
        }
        self.folder.join(named)
    }

    /// Records where the eye is now: at the demo's time, else some seconds after the last key.
    pub fn add_key(&mut self) {
        let time = (self.player.as_ref()).map_or(self.flight_path.next_time(), |p| p.time);
        self.put_key(time);
    }

    /// Records where the eye is now as the key of a time.
    pub fn put_key(&mut self, time: f64) {
        let Some(settings) = self.settings() else {
            return;
        };
        let key = Key::new(time, &settings.camera);
        if let Err(error) = self.flight_path.put(key) {
            self.notices.error(format!("{error:#}"));
        }
    }

    /// Starts or stops to fly the path.
    pub fn fly_path(&mut self, flies: bool) {
        let flight = &mut self.flight_path;
        let Some(path) = flight.path().filter(|_| flies) else {
            flight.flies = false;
            return;
        };
        let [from, to] = path.times();
        if flight.time < from || flight.time >= to {
            flight.time = from;
        }
        flight.flies = true;
        if let Some(player) = &mut self.player {
            player.follows = false;
        }
        self.flight.stop();
        self.set_walking(false);
    }

    /// Flies on for so many seconds, unless hands take over.
    pub(super) fn pass_path(&mut self, seconds: f32, hands: bool) {
        self.flight_path.flies &= !hands;
        let follows = self.player.as_ref().is_some_and(|p| p.follows);
        self.flight_path.flies &= !follows;
        if !self.flight_path.flies {
            return;
        }
        let flight = &mut self.flight_path;
        let Some(path) = &flight.path else { return };
        match &self.player {
            Some(player) => flight.time = player.time,
            None => {
                let end = path.times()[1];
                flight.time += f64::from(seconds);
                flight.flies = flight.time < end;
                flight.time = flight.time.min(end);
            }
        }
        let camera = path.at(flight.time);
        self.eye = Eye::of(&camera);
        self.args.picture.view.take_lens(&camera);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(time: f64, x: f32) -> Key {
        Key {
            time,
            position: glam::Vec3::new(x, 0.0, 0.0),
            angles_deg: [0.0; 3],
            fov_deg: 90.0,
            aperture: 0.0,
            focus: None,
        }
    }

    #[test]
    fn keys_are_put_moved_removed_and_kept() {
        let mut flight = FlightPath::default();
        assert!(flight.path().is_none() && flight.next_time() == 0.0);
        for (time, x) in [(0.0, 1.0), (4.0, 3.0), (2.0, 2.0), (2.0, 9.0)] {
            flight.put(key(time, x)).unwrap();
        }
        let xs = |f: &FlightPath| f.keys().iter().map(|k| k.position.x).collect::<Vec<_>>();
        assert_eq!(xs(&flight), [1.0, 9.0, 3.0]);
        assert_eq!(flight.next_time(), 6.0);
        flight.retime(0, 5.0).unwrap();
        assert_eq!(xs(&flight), [9.0, 3.0, 1.0]);
        let before = flight.keys().to_vec();
        for wrong in [4.0, f64::NAN, 1e9] {
            assert!(flight.retime(0, wrong).is_err(), "{wrong}");
        }
        assert!(flight.put(key(f64::INFINITY, 0.0)).is_err());
        assert_eq!(flight.keys(), before, "what is wrong changes nothing");
        assert_eq!(flight.path().unwrap().at(4.5).position.y, 0.0);

        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.toml");
        flight.save(&file).unwrap();
        assert!(flight.is_saved);
        let mut other = FlightPath::default();
        other.load(&file).unwrap();
        assert_eq!(other.keys(), flight.keys());
        flight.remove(1);
        assert!(!flight.is_saved && flight.keys().len() == 2);
        flight.remove(7);
        flight.clear();
        assert!(flight.save(&file).is_err());
        std::fs::write(&file, "nonsense").unwrap();
        assert!(other.load(&file).is_err());
        assert_eq!(other.keys().len(), 3);
    }
}
