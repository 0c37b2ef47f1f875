//! Flights of a camera: keys in time, and smooth ways between them.
//!
//! A path is a TOML text of keys in order of time; `docs/cameras.md` describes it for people:
//!
//! ```toml
//! [[key]]
//! time = 0.0
//! position = [544.0, 288.0, 54.0]
//! angles = [10.0, 90.0, 0.0]
//!
//! [[key]]
//! time = 2.5
//! position = [544.0, 500.0, 80.0]
//! angles = [0.0, 135.0, 0.0]
//! fov = 60.0
//! ```
//!
//! Between two keys every number is a cubic polynomial of the time that has the keys' values and slopes
//! at its ends, so the flight has no kink. A slope is that of the parabola through a key and its two
//! neighbours, made so small where it must be that nothing overshoots (Fritsch and Carlson 1980): angles,
//! field of view and lens stay between those of the two keys, and a camera with the same place in two keys
//! stands still between them. Angles turn the shorter way. They are interpolated as they are and not as
//! rotations, so that the horizon of keys without roll stays level.

use crate::camera::{Camera, DEFAULT_FOV_DEG, Lens};
use glam::Vec3;
use serde::Deserialize;
use std::fmt::Write as _;
use std::ops::RangeInclusive;

/// Most keys of a path.
pub const MAX_KEYS: usize = 1 << 16;

/// Where a camera is at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct Key {
    /// Seconds.
    pub time: f64,
    /// Eye, world space.
    pub position: Vec3,
    /// Pitch, yaw and roll in degrees, as a [`Camera`]'s.
    pub angles_deg: [f32; 3],
    /// Degrees, as [`Camera::fov_deg`].
    pub fov_deg: f32,
    /// Radius of the lens in world units; 0 for a pinhole.
    pub aperture: f32,
    /// Distance of the plane of focus, world units; of a lens it must be known, here or in a key before.
    pub focus: Option<f32>,
}

/// A flight.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    keys: Vec<Key>,
    /// By key, its numbers and their slopes per second.
    nodes: Vec<[Numbers; 2]>,
}

/// Position, angles that turn the shorter way from key to key, field of view, aperture, focus.
type Numbers = [f64; 9];

const POSITION: std::ops::Range<usize> = 0..3;
const ANGLES: std::ops::Range<usize> = 3..6;

/// Why something is no camera path: a sentence with the name of the text, the key's number from 1 and its
/// line, and the field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct CameraPathError(String);

/// A key as a text has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    time: f64,
    position: [f32; 3],
    angles: [f32; 3],
    fov: Option<f32>,
    aperture: Option<f32>,
    focus: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default)]
    key: Vec<toml::Spanned<Entry>>,
}

impl Key {
    /// A camera at a time.
    #[must_use]
    pub fn new(time: f64, camera: &Camera) -> Self {
        Self {
            time,
            position: camera.position,
            angles_deg: [camera.pitch_deg, camera.yaw_deg, camera.roll_deg],
            fov_deg: camera.fov_deg,
            aperture: camera.lens.map_or(0.0, |l| l.radius),
            focus: camera.lens.map(|l| l.focus),
        }
    }

    /// Looks for what can't be, after a key at the time `after` of a path that knows a focus or not.
    fn check(&self, after: Option<f64>, has_focus: bool) -> Result<(), String> {
        fn within<T: PartialOrd + std::fmt::Display>(
            field: &str,
            value: T,
            range: RangeInclusive<T>,
        ) -> Result<(), String> {
            let (low, high) = (range.start(), range.end());
            if range.contains(&value) {
                return Ok(());
            }
            Err(format!(
                "{field}: {value} is not a number from {low} to {high}"
            ))
        }
        within("time", self.time, -1e6..=1e6)?;
        if let Some(after) = after.filter(|after| self.time <= *after) {
            let time = self.time;
            return Err(format!(
                "time: {time} is not after {after}, that of the key before"
            ));
        }
        for x in self.position.to_array() {
            within("position", x, -1e6..=1e6)?;
        }
        for x in self.angles_deg {
            within("angles", x, -1e6..=1e6)?;
        }
        within("fov", self.fov_deg, 1.0..=170.0)?;
        within("aperture", self.aperture, 0.0..=1e4)?;
        match self.focus {
            Some(focus) => within("focus", focus, 0.01..=1e6),
            None if self.aperture > 0.0 && !has_focus => {
                Err("focus: it is missing, and the aperture is not 0".into())
            }
            None => Ok(()),
        }
    }
}

impl CameraPath {
    /// A path through `keys`.
    ///
    /// # Errors
    /// When there is none or too many, their times do not rise, or a number is out of its range.
    pub fn new(keys: Vec<Key>) -> Result<Self, CameraPathError> {
        Self::checked(
            keys,
            |i| format!("camera path: key {}", i + 1),
            "camera path",
        )
    }

    /// Reads a path; `name` is what messages call the text. What a key leaves out is as in the key before;
    /// in the first one the field of view is 90, the aperture 0.
    ///
    /// # Errors
    /// What is no TOML, an unknown field, a value of the wrong type, and as [`CameraPath::new`].
    pub fn parse(name: &str, text: &str) -> Result<Self, CameraPathError> {
        let document: Document = toml::from_str(text).map_err(|e| {
            let start = e.span().map_or(0, |span| span.start.min(text.len()));
            let line = 1 + text.as_bytes()[..start]
                .iter()
                .filter(|b| **b == b'\n')
                .count();
            CameraPathError(format!("{name}: line {line}: {}", e.message()))
        })?;
        let mut keys: Vec<Key> = Vec::with_capacity(document.key.len());
        let mut lines = Vec::with_capacity(document.key.len());
        let (mut line, mut read) = (1, 0);
        for spanned in document.key {
            let start = spanned.span().start.clamp(read, text.len());
            line += text.as_bytes()[read..start]
                .iter()
                .filter(|b| **b == b'\n')
                .count();
            read = start;
            lines.push(line);
            let entry = spanned.into_inner();
            let before = keys.last();
            keys.push(Key {
                time: entry.time,
                position: entry.position.into(),
                angles_deg: entry.angles,
                fov_deg: (entry.fov.or(before.map(|k| k.fov_deg))).unwrap_or(DEFAULT_FOV_DEG),
                aperture: (entry.aperture.or(before.map(|k| k.aperture))).unwrap_or(0.0),
                focus: entry.focus.or(before.and_then(|k| k.focus)),
            });
        }
        let place = |i: usize| format!("{name}: key {} (line {})", i + 1, lines[i]);
        Self::checked(keys, place, name)
    }

    fn checked(
        keys: Vec<Key>,
        place: impl Fn(usize) -> String,
        name: &str,
    ) -> Result<Self, CameraPathError> {
        if keys.is_empty() {
            return Err(CameraPathError(format!(
                "{name}: a camera path has at least one [[key]]"
            )));
        }
        if keys.len() > MAX_KEYS {
            let count = keys.len();
            let most = format!("{name}: {count} keys, more than the {MAX_KEYS} that are read");
            return Err(CameraPathError(most));
        }
        let (mut after, mut has_focus) = (None, false);
        for (i, key) in keys.iter().enumerate() {
            (key.check(after, has_focus))
                .map_err(|why| CameraPathError(format!("{}: {why}", place(i))))?;
            after = Some(key.time);
            has_focus |= key.focus.is_some();
        }
        let nodes = nodes(&keys);
        Ok(Self { keys, nodes })
    }

    /// The keys, in order of time; at least one.
    #[must_use]
    pub fn keys(&self) -> &[Key] {
        &self.keys
    }

    /// Times of the first and the last key.
    #[must_use]
    pub fn times(&self) -> [f64; 2] {
        [self.keys[0].time, self.keys[self.keys.len() - 1].time]
    }

    /// The camera at a time: before the first key as there, after the last as there.
    #[must_use]
    pub fn at(&self, time: f64) -> Camera {
        let next = self.keys.partition_point(|k| k.time <= time);
        let numbers = match (next.checked_sub(1), self.nodes.get(next)) {
            (None, _) => self.nodes[0][0],
            (Some(last), None) => self.nodes[last][0],
            (Some(i), Some(to)) => between(
                &self.nodes[i],
                to,
                [self.keys[i].time, self.keys[next].time],
                time,
            ),
        };
        let [
            x,
            y,
            z,
            pitch_deg,
            yaw_deg,
            roll_deg,
            fov_deg,
            aperture,
            focus,
        ] = numbers.map(|n| n as f32);
        Camera {
            name: "camera path".to_owned(),
            position: Vec3::new(x, y, z),
            pitch_deg,
            yaw_deg,
            roll_deg,
            fov_deg,
            lens: Lens::new(aperture, focus),
        }
    }

    /// The text of the path: read again, it is the same.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = "# A camera path of Runelight.\n".to_owned();
        for key in &self.keys {
            let Key {
                time,
                position,
                angles_deg,
                fov_deg,
                aperture,
                focus,
            } = key;
            let position = position.to_array();
            // Writing to a string does not fail.
            let _ = write!(
                text,
                "\n[[key]]\ntime = {time:?}\nposition = {position:?}\nangles = {angles_deg:?}\n\
                 fov = {fov_deg:?}\naperture = {aperture:?}\n"
            );
            if let Some(focus) = focus {
                let _ = writeln!(text, "focus = {focus:?}");
            }
        }
        text
    }
}

/// The numbers of keys, and their slopes.
fn nodes(keys: &[Key]) -> Vec<[Numbers; 2]> {
    // A focus that no key has said so far is the first that one says; of pinholes it does not matter.
    let mut focus = keys.iter().find_map(|k| k.focus).unwrap_or(1.0);
    let mut values: Vec<Numbers> = Vec::with_capacity(keys.len());
    for key in keys {
        focus = key.focus.unwrap_or(focus);
        let [x, y, z] = key.position.to_array();
        let [pitch, yaw, roll] = key.angles_deg;
        let mut row = [x, y, z, pitch, yaw, roll, key.fov_deg, key.aperture, focus].map(f64::from);
        if let Some(before) = values.last() {
            for i in ANGLES {
                row[i] = before[i] + (row[i] - before[i] + 180.0).rem_euclid(360.0) - 180.0;
            }
        }
        values.push(row);
    }
    let spans: Vec<f64> = keys.windows(2).map(|k| k[1].time - k[0].time).collect();
    let rises: Vec<Numbers> = (values.windows(2).zip(&spans))
        .map(|(v, span)| std::array::from_fn(|i| (v[1][i] - v[0][i]) / span))
        .collect();
    let mut slopes = vec![Numbers::default(); keys.len()];
    for i in 1..keys.len().saturating_sub(1) {
        let (h, d) = ([spans[i - 1], spans[i]], [&rises[i - 1], &rises[i]]);
        slopes[i] = slope(h, d);
    }
    // At the ends the flight is not bent.
    if let (Some(first), Some(last)) = (rises.first(), rises.last()) {
        let (n, one) = (keys.len(), rises.len() == 1);
        let end = |rise: &Numbers, inner: &Numbers| {
            std::array::from_fn(|i| {
                if one {
                    rise[i]
                } else {
                    1.5 * rise[i] - 0.5 * inner[i]
                }
            })
        };
        let ends = [end(first, &slopes[1]), end(last, &slopes[n - 2])];
        [slopes[0], slopes[n - 1]] = ends;
    }
    values
        .into_iter()
        .zip(slopes)
        .map(|(v, s)| [v, s])
        .collect()
}

/// The slopes at a key between spans of `h` seconds with the mean slopes `d`.
fn slope(h: [f64; 2], d: [&Numbers; 2]) -> Numbers {
    let mut slope: Numbers =
        std::array::from_fn(|i| (h[1] * d[0][i] + h[0] * d[1][i]) / (h[0] + h[1]));
    // The position in whatever direction it goes, the other numbers one by one.
    let length = |v: &Numbers| v[POSITION].iter().map(|x| x * x).sum::<f64>().sqrt();
    let (own, most) = (length(&slope), 3.0 * length(d[0]).min(length(d[1])));
    if own > most {
        slope[POSITION].iter_mut().for_each(|x| *x *= most / own);
    }
    for i in POSITION.end..slope.len() {
        let most = 3.0 * d[0][i].abs().min(d[1][i].abs());
        slope[i] = if d[0][i] * d[1][i] <= 0.0 {
            0.0
        } else {
            slope[i].clamp(-most, most)
        };
    }
    slope
}

/// The numbers at a time between those of two keys.
fn between(a: &[Numbers; 2], b: &[Numbers; 2], [from, to]: [f64; 2], time: f64) -> Numbers {
    let h = to - from;
    let u = ((time - from) / h).clamp(0.0, 1.0);
    let (u2, u3) = (u * u, u * u * u);
    std::array::from_fn(|i| {
        let ends = [a[0][i], b[0][i]];
        // In this form two equal ends without slopes stand still exactly.
        let value = ends[0]
            + (ends[1] - ends[0]) * (3.0 * u2 - 2.0 * u3)
            + h * (a[1][i] * (u3 - 2.0 * u2 + u) + b[1][i] * (u3 - u2));
        // But for rounding, all except positions lie between the keys'.
        let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
        if POSITION.contains(&i) {
            value
        } else {
            value.clamp(low, high)
        }
    })
}

#[cfg(test)]
#[path = "camera_path_tests.rs"]
mod tests;
