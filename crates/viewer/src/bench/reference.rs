//! References with error bars: pictures that know how wrong they are.
//!
//! A reference is the mean of at least [`MIN_BATCHES`] independent batches, each rendered with a
//! seed of its own, and the variance of that mean as the batches' spread shows it. Seeds and not
//! ranges of samples of one seed: every batch starts from an empty film, so no sum grows so
//! large that a sample is lost in it, and the spread holds whatever a renderer gets wrong at
//! random. Another batch makes it better at any time, and the average is taken in `f64`.
//!
//! The file is an EXR of 32-bit floats with the layers `beauty`, `variance` and `samples`, and
//! the [`Stamp`] as attributes `runelight:NAME`.

use super::identity::{FORMAT, REFERENCE_SEED};
use crate::metrics::EPSILON;
use crate::output::{Layer, Note, Outputs, Style};
use crate::picture::{self, Picture};
use anyhow::{Context as _, Result, anyhow, bail};
use exr::meta::MetaData;
use exr::meta::attribute::AttributeValue;
use scene::render::Film;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Fewest batches of a reference: the variance of fewer is hardly known.
pub const MIN_BATCHES: u32 = 8;

/// Most batches; what a file claims beyond is not believed.
const MAX_BATCHES: u32 = 1 << 20;

/// What a reference is a reference of, and how it was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Stamp {
    /// Level's name, for people.
    pub level: String,
    /// See [`super::identity`].
    pub level_hash: String,
    /// See [`super::identity`].
    pub settings_hash: String,
    /// The device that rendered.
    pub device: String,
    /// Estimator.
    pub estimator: String,
    /// Seed of the first batch; the others follow.
    pub seed: u64,
    /// Samples per pixel of a batch.
    pub samples_per_batch: u32,
}

/// A picture and how well it is known.
#[derive(Clone, Debug)]
pub struct Reference {
    /// About it.
    pub stamp: Stamp,
    width: usize,
    height: usize,
    batches: u32,
    mean: Vec<[f64; 3]>,
    /// Sums of squared deviations of the batches from the mean (Welford 1962).
    squares: Vec<[f64; 3]>,
}

impl Reference {
    /// A reference without a batch.
    #[must_use]
    pub fn empty(stamp: Stamp, width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        Self {
            stamp,
            width: width as usize,
            height: height as usize,
            batches: 0,
            mean: vec![[0.0; 3]; pixels],
            squares: vec![[0.0; 3]; pixels],
        }
    }

    /// Seed of the next batch. The highest bit sets it apart from measured runs.
    #[must_use]
    pub fn next_seed(&self) -> u64 {
        self.stamp.seed.wrapping_add(self.batches.into()) | REFERENCE_SEED
    }

    /// Adds a batch's mean radiance, `width * height` pixels.
    ///
    /// # Errors
    /// When it has another size, or is not finite.
    pub fn add(&mut self, beauty: &[[f32; 3]]) -> Result<()> {
        if beauty.len() != self.mean.len() {
            bail!(
                "a batch has {} pixels, not {}",
                beauty.len(),
                self.mean.len()
            );
        }
        if !beauty.as_flattened().iter().all(|v| v.is_finite()) {
            bail!("a batch of the reference is not finite");
        }
        self.batches += 1;
        let n = f64::from(self.batches);
        for ((mean, squares), value) in self.mean.iter_mut().zip(&mut self.squares).zip(beauty) {
            for c in 0..3 {
                let before = f64::from(value[c]) - mean[c];
                mean[c] += before / n;
                squares[c] += before * (f64::from(value[c]) - mean[c]);
            }
        }
        Ok(())
    }

    /// Batches so far.
    #[must_use]
    pub fn batches(&self) -> u32 {
        self.batches
    }

    /// Samples per pixel so far.
    #[must_use]
    pub fn samples(&self) -> u64 {
        u64::from(self.batches) * u64::from(self.stamp.samples_per_batch)
    }

    /// Mean radiance, rows from the top.
    #[must_use]
    pub fn mean(&self) -> &[[f64; 3]] {
        &self.mean
    }

    /// Variance of a pixel's mean radiance.
    #[must_use]
    pub fn variance_of(&self, pixel: usize) -> [f64; 3] {
        let n = f64::from(self.batches);
        self.squares[pixel].map(|s| s / (n * (n - 1.0)))
    }

    /// What the reference's own error adds to an MSE measured against it, in expectation.
    #[must_use]
    pub fn mse(&self) -> f64 {
        self.per_channel(|_, variance| variance)
    }

    /// What it adds to a relMSE; also its own relMSE.
    #[must_use]
    pub fn relmse(&self) -> f64 {
        self.per_channel(|mean, variance| variance / (mean * mean + EPSILON))
    }

    /// Standard error of what [`Reference::relmse`] leaves in a corrected relMSE: the squared error
    /// of a reference is not its expectation, and the variance of few batches is uncertain.
    #[must_use]
    pub fn relmse_error(&self) -> f64 {
        let df = f64::from(self.batches) - 1.0;
        let count = 3.0 * self.mean.len() as f64;
        let squares = self.per_channel(|mean, variance| {
            (variance / (mean * mean + EPSILON)).powi(2) * (2.0 + 2.0 / df)
        });
        // Channels of a pixel err together: a third of them is independent, at worst.
        (squares * 3.0 / count).sqrt()
    }

    fn per_channel(&self, f: impl Fn(f64, f64) -> f64) -> f64 {
        let mut sum = 0.0;
        for (i, mean) in self.mean.iter().enumerate() {
            let variance = self.variance_of(i);
            sum += (0..3).map(|c| f(mean[c], variance[c])).sum::<f64>();
        }
        sum / (3 * self.mean.len()).max(1) as f64
    }

    /// For `metrics::compare`.
    #[must_use]
    pub fn picture(&self) -> Picture {
        Picture {
            width: self.width,
            height: self.height,
            radiance: self.mean.iter().map(|p| p.map(|v| v as f32)).collect(),
            codes: None,
        }
    }

    /// Writes the file, complete or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        let film = Film {
            width: self.width as u32,
            height: self.height as u32,
            samples: u32::try_from(self.samples()).unwrap_or(u32::MAX),
            beauty: self.picture().radiance,
            variance: (0..self.mean.len())
                .map(|i| self.variance_of(i).map(|v| v as f32))
                .collect(),
            ..Film::default()
        };
        let text = |t: &str| Note::Text(t.to_owned());
        let s = &self.stamp;
        let style = Style {
            layers: vec![Layer::Beauty, Layer::Variance, Layer::Samples],
            notes: vec![
                ("reference", Note::Int(FORMAT.into())),
                ("version", text(env!("CARGO_PKG_VERSION"))),
                ("level", text(&s.level)),
                ("levelHash", text(&s.level_hash)),
                ("settingsHash", text(&s.settings_hash)),
                ("device", text(&s.device)),
                ("estimator", text(&s.estimator)),
                ("seed", Note::Text(s.seed.to_string())),
                ("samples", Note::Text(self.samples().to_string())),
                (
                    "samplesPerBatch",
                    Note::Text(s.samples_per_batch.to_string()),
                ),
                ("batches", Note::Text(self.batches.to_string())),
                ("relMSE", Note::Text(format!("{:e}", self.relmse()))),
            ],
            ..Style::default()
        };
        Outputs::open(&[path.to_owned()])?.write(&film, &style)?;
        Ok(())
    }

    /// Reads a file and checks that it is a reference of what `wanted` says, `width` by `height`
    /// pixels; device, estimator, seed and samples may be any.
    ///
    /// # Errors
    /// When it cannot be read, is no reference, or is [`Stale`] (see there); the sentence names
    /// the file and what is wrong.
    pub fn load(path: &Path, wanted: &Stamp, width: u32, height: u32) -> Result<Self> {
        let at = || path.display().to_string();
        let attributes = Attributes::read(path, width, height).with_context(at)?;
        let version = attributes.get("reference").with_context(at)?;
        if version != FORMAT.to_string() {
            return Err(Stale(format!("its form is version {version:?}, not {FORMAT}")).into());
        }
        let stamp = Stamp {
            level: attributes.get("level").with_context(at)?,
            level_hash: attributes.get("levelHash").with_context(at)?,
            settings_hash: attributes.get("settingsHash").with_context(at)?,
            device: attributes.get("device").with_context(at)?,
            estimator: attributes.get("estimator").with_context(at)?,
            seed: attributes.number("seed").with_context(at)?,
            samples_per_batch: attributes.number("samplesPerBatch").with_context(at)?,
        };
        let differs = |what: &str, found: &str, wanted: &str| {
            Stale(format!(
                "{what} hash is {} and {} is wanted",
                short(found),
                short(wanted)
            ))
        };
        if stamp.level_hash != wanted.level_hash {
            return Err(differs(
                "it shows another level, or the same one before it or its import changed: its level",
                &stamp.level_hash,
                &wanted.level_hash,
            )
            .into());
        }
        if stamp.settings_hash != wanted.settings_hash {
            return Err(differs(
                "it was made with other settings (size, camera, depth, time, light): its settings",
                &stamp.settings_hash,
                &wanted.settings_hash,
            )
            .into());
        }
        attributes.check_size(width, height).with_context(at)?;
        let batches: u32 = attributes.number("batches").with_context(at)?;
        if !(MIN_BATCHES..=MAX_BATCHES).contains(&batches) || stamp.samples_per_batch == 0 {
            bail!(
                "{}: {batches} batches of {} samples are no reference, {MIN_BATCHES} to \
                 {MAX_BATCHES} of at least 1 are",
                path.display(),
                stamp.samples_per_batch
            );
        }
        let mean = picture::read(path, "beauty")?;
        let variance = picture::read(path, "variance")?;
        let mut reference = Self::empty(stamp, width, height);
        reference.batches = batches;
        let n = f64::from(batches);
        let planes = mean.radiance.iter().zip(&variance.radiance).enumerate();
        for (i, (m, v)) in planes {
            if !m.iter().chain(v).all(|x| x.is_finite()) || v.iter().any(|x| *x < 0.0) {
                bail!(
                    "{}: pixel {i} has the mean {m:?} and the variance {v:?}",
                    path.display()
                );
            }
            reference.mean[i] = m.map(f64::from);
            reference.squares[i] = v.map(|v| f64::from(v) * n * (n - 1.0));
        }
        if mean.radiance.len() != reference.mean.len()
            || variance.radiance.len() != reference.mean.len()
        {
            bail!("{}: a layer has another size than the file", path.display());
        }
        Ok(reference)
    }
}

/// Why a file that is a reference is not the one wanted.
#[derive(Debug)]
pub struct Stale(pub String);

impl std::fmt::Display for Stale {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Stale {}

/// The first digits of a hash; the rest does not help people.
fn short(hash: &str) -> String {
    hash.chars().take(12).collect()
}

/// The attributes of an EXR, without its pixels.
struct Attributes {
    values: BTreeMap<String, String>,
    size: (usize, usize),
}

impl Attributes {
    fn read(path: &Path, width: u32, height: u32) -> Result<Self> {
        let file = std::fs::File::open(path).context("cannot be read")?;
        // Seven channels of four bytes, with room for a header and for what does not compress.
        let most = u64::from(width) * u64::from(height) * 7 * 4 * 2 + (1 << 20);
        let length = file.metadata().context("cannot be read")?.len();
        let meta = MetaData::read_from_buffered(std::io::BufReader::new(file), false)
            .map_err(|e| anyhow!("it is no EXR that can be read: {e}"))?;
        let [header] = meta.headers.as_slice() else {
            bail!("it has {} parts, a reference has 1", meta.headers.len());
        };
        let mut values = BTreeMap::new();
        for (name, value) in &header.own_attributes.other {
            let value = match value {
                AttributeValue::Text(text) => text.to_string(),
                AttributeValue::I32(number) => number.to_string(),
                _ => continue,
            };
            if let Some(name) = name.to_string().strip_prefix("runelight:") {
                values.insert(name.to_owned(), value);
            }
        }
        let size = (header.layer_size.width(), header.layer_size.height());
        if size == (width as usize, height as usize) && length > most {
            bail!("it has {length} bytes, a reference of its size has at most {most}");
        }
        Ok(Self { values, size })
    }

    fn check_size(&self, width: u32, height: u32) -> Result<()> {
        if self.size != (width as usize, height as usize) {
            bail!(
                "it has {}x{} pixels and says it was made for {width}x{height}",
                self.size.0,
                self.size.1
            );
        }
        Ok(())
    }

    fn get(&self, name: &str) -> Result<String> {
        (self.values.get(name).cloned())
            .ok_or_else(|| anyhow!("it is no reference: it has no attribute runelight:{name}"))
    }

    fn number<T: std::str::FromStr>(&self, name: &str) -> Result<T> {
        let text = self.get(name)?;
        (text.parse()).map_err(|_| anyhow!("runelight:{name} is {text:?}, not a number in range"))
    }
}

/// Where references are kept: `$XDG_CACHE_HOME/runelight/references`, else
/// `~/.cache/runelight/references` (XDG Base Directory Specification 0.8).
///
/// # Errors
/// When neither variable leads anywhere.
pub fn cache_dir() -> Result<PathBuf> {
    // The specification: a relative path is invalid and is ignored.
    let absolute = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|p| p.is_absolute())
    };
    let base = absolute("XDG_CACHE_HOME")
        .or_else(|| Some(absolute("HOME")?.join(".cache")))
        .ok_or_else(|| anyhow!("references have no place: set XDG_CACHE_HOME or HOME"))?;
    Ok(base.join("runelight").join("references"))
}

/// The cached file of a view: by level name and settings, so that a level that changed meets its
/// old reference and can say so.
#[must_use]
pub fn cache_name(stamp: &Stamp) -> String {
    let level: String = (stamp.level.chars())
        .map(|c| {
            if c.is_ascii_alphanumeric() || "-_".contains(c) {
                c
            } else {
                '_'
            }
        })
        .take(64)
        .collect();
    let settings: String = stamp.settings_hash.chars().take(16).collect();
    format!("{level}-{settings}.exr")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp() -> Stamp {
        Stamp {
            level: "a/../b".into(),
            level_hash: "1".repeat(64),
            settings_hash: "2".repeat(64),
            device: "cpu".into(),
            estimator: "mis".into(),
            seed: REFERENCE_SEED,
            samples_per_batch: 4,
        }
    }

    /// Batches around 1 with a spread that is known.
    fn made() -> Reference {
        let mut reference = Reference::empty(stamp(), 3, 2);
        for batch in 0..8 {
            let value = 1.0 + if batch % 2 == 0 { 0.1 } else { -0.1 };
            reference.add(&[[value, value, 0.0]; 6]).unwrap();
        }
        reference
    }

    #[test]
    fn the_variance_is_that_of_the_mean_of_the_batches() {
        let reference = made();
        let variance = 0.01 * 8.0 / 7.0 / 8.0;
        let found = reference.variance_of(0);
        assert!((found[0] - variance).abs() < 1e-8, "{found:?}");
        assert!((reference.mse() - variance * 2.0 / 3.0).abs() < 1e-8);
        let relmse = variance / 1.01 * 2.0 / 3.0;
        assert!((reference.relmse() - relmse).abs() < 1e-8);
        assert_eq!(
            (reference.samples(), reference.next_seed()),
            (32, REFERENCE_SEED + 8)
        );
        let mut reference = reference;
        assert!(reference.add(&[[f32::NAN; 3]; 6]).is_err());
        assert!(reference.add(&[[0.0; 3]; 5]).is_err());
    }

    #[test]
    fn a_file_comes_back_and_goes_on() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.exr");
        let reference = made();
        reference.save(&path).unwrap();
        let mut back = Reference::load(&path, &stamp(), 3, 2).unwrap();
        assert_eq!((back.batches(), &back.stamp), (8, &reference.stamp));
        assert!((back.relmse() / reference.relmse() - 1.0).abs() < 1e-5);
        let mut on = reference;
        for r in [&mut on, &mut back] {
            r.add(&[[1.2, 1.0, 0.0]; 6]).unwrap();
        }
        assert!((back.relmse() / on.relmse() - 1.0).abs() < 1e-4);
    }

    #[test]
    fn stale_and_broken_files_say_what_is_wrong() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.exr");
        made().save(&path).unwrap();
        let error = |wanted: &Stamp, size: (u32, u32)| {
            let error = Reference::load(&path, wanted, size.0, size.1).unwrap_err();
            (error.is::<Stale>(), format!("{error:#}"))
        };
        let mut other = stamp();
        other.level_hash = "3".repeat(64);
        let (stale, text) = error(&other, (3, 2));
        assert!(
            stale && text.contains("level hash is 111111111111 and 3333"),
            "{text}"
        );
        let mut other = stamp();
        other.settings_hash = "4".repeat(64);
        let (stale, text) = error(&other, (3, 2));
        assert!(stale && text.contains("other settings"), "{text}");
        let (stale, text) = error(&stamp(), (4, 2));
        assert!(!stale && text.contains("3x2"), "{text}");

        let whole = std::fs::read(&path).unwrap();
        for length in [0, 3, 100, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..length]).unwrap();
            let (_, text) = error(&stamp(), (3, 2));
            assert!(text.contains("r.exr"), "{text}");
        }
        // Every byte of the head disturbed once: an error or a reference, never a panic.
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x41;
            std::fs::write(&path, bytes).unwrap();
            let _ = Reference::load(&path, &stamp(), 3, 2);
        }
    }

    #[test]
    fn names_in_the_cache_are_plain() {
        assert_eq!(cache_name(&stamp()), "a____b-2222222222222222.exr");
    }
}
