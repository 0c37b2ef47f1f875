//! Where the frames of a clip go.

use super::pattern::Pattern;
use super::ratio::Ratio;
use super::y4m;
use crate::Usage;
use crate::output::{Format, PartFile, Style, encode, screen};
use anyhow::{Context as _, Result};
use scene::render::Film;
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// All outputs of a clip.
#[derive(Debug, Default)]
pub struct Targets {
    /// A file for each frame.
    files: Vec<(Pattern, Format)>,
    /// Raw video; `-` is stdout.
    streams: Vec<PathBuf>,
}

fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

impl Targets {
    /// Reads `--output`s.
    ///
    /// # Errors
    /// On an unknown extension, a wrong place for the number, or an output given twice.
    pub fn parse(outputs: &[PathBuf]) -> Result<Self> {
        let mut targets = Self::default();
        for path in outputs {
            let usage = |why: String| Usage(format!("--output {why}"));
            if outputs.iter().filter(|p| *p == path).count() > 1 {
                return Err(usage(format!("{} is given twice", path.display())).into());
            }
            let extension = path.extension().unwrap_or_default();
            if is_stdout(path) || extension.eq_ignore_ascii_case("y4m") {
                targets.streams.push(path.clone());
                continue;
            }
            let format = Format::of(path).map_err(|_| {
                let shown = path.display();
                usage(format!(
                    "{shown}: an output ends in .exr, .png or .y4m, or is -"
                ))
            })?;
            let pattern = Pattern::parse(path).map_err(|e| usage(e.to_string()))?;
            targets.files.push((pattern, format));
        }
        Ok(targets)
    }

    /// Whether results have to go to stderr, because a stream has stdout.
    #[must_use]
    pub fn take_stdout(&self) -> bool {
        self.streams.iter().any(|p| is_stdout(p))
    }

    /// Whether there is raw video, which cannot be gone on with.
    #[must_use]
    pub fn has_streams(&self) -> bool {
        !self.streams.is_empty()
    }

    /// The files of a frame.
    pub fn files(&self, frame: u32) -> impl Iterator<Item = (PathBuf, Format)> + '_ {
        self.files.iter().map(move |(p, f)| (p.path(frame), *f))
    }

    /// The streams' names.
    #[must_use]
    pub fn streams(&self) -> &[PathBuf] {
        &self.streams
    }

    /// Makes the directories of the files, so that what cannot be written is known before the work.
    ///
    /// # Errors
    /// When several frames would be one file, or a file cannot be written.
    pub fn prepare(&self, frames: &Range<u32>) -> Result<()> {
        for (pattern, _) in &self.files {
            let path = pattern.path(frames.start);
            if frames.len() > 1 && !pattern.is_sequence() {
                let why = "there are several frames; their number goes where %05d stands";
                return Err(Usage(format!("--output {}: {why}", path.display())).into());
            }
            if let Some(dir) = path.parent().filter(|d| !d.as_os_str().is_empty()) {
                std::fs::create_dir_all(dir)
                    .with_context(|| format!("{} cannot be made", dir.display()))?;
            }
            drop(PartFile::create(&path)?);
        }
        Ok(())
    }

    /// Opens the streams.
    ///
    /// # Errors
    /// When a stream cannot be written.
    pub fn open(self, size: [u32; 2], fps: Ratio) -> Result<OpenTargets> {
        let mut streams = Vec::new();
        for path in self.streams {
            let mut stream = if is_stdout(&path) {
                Stream::Stdout
            } else {
                Stream::File(Box::new(PartFile::create(&path)?))
            };
            stream.write(|out| y4m::header(out, size, fps))?;
            streams.push(stream);
        }
        Ok(OpenTargets {
            files: self.files,
            streams,
        })
    }
}

/// A stream that is written.
#[derive(Debug)]
enum Stream {
    Stdout,
    File(Box<PartFile>),
}

impl Stream {
    fn write(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        match self {
            Self::Stdout => {
                let mut out = io::stdout().lock();
                write(&mut out)?;
                Ok(out.flush()?)
            }
            Self::File(part) => {
                let path = part.path().to_owned();
                write(part.file()).with_context(|| format!("{} cannot be written", path.display()))
            }
        }
    }
}

/// Outputs that take frames in order.
#[derive(Debug)]
pub struct OpenTargets {
    files: Vec<(Pattern, Format)>,
    streams: Vec<Stream>,
}

/// What a frame took beside the renderer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Mean and error, for what is said of it; and the filter for noise.
    pub measure: Duration,
    /// Tone mapping, encoding and compressing.
    pub compress: Duration,
    /// Until the files are safe.
    pub write: Duration,
}

impl OpenTargets {
    /// Writes a frame; its files appear complete or not at all. Returns their paths.
    ///
    /// # Errors
    /// When an output cannot be written.
    pub fn write(
        &mut self,
        frame: u32,
        film: &Film,
        style: &Style,
    ) -> Result<(Vec<PathBuf>, Cost)> {
        let (mut paths, mut cost) = (Vec::new(), Cost::default());
        for (pattern, format) in &self.files {
            let path = pattern.path(frame);
            let failed = || format!("{} cannot be written", path.display());
            let begin = Instant::now();
            let bytes = encode(*format, film, style).with_context(failed)?;
            let encoded = Instant::now();
            let mut part = PartFile::create(&path)?;
            part.file().write_all(&bytes).with_context(failed)?;
            part.commit()?;
            cost.compress += encoded - begin;
            cost.write += encoded.elapsed();
            paths.push(path);
        }
        if self.streams.is_empty() {
            return Ok((paths, cost));
        }
        let begin = Instant::now();
        let bytes = y4m::frame(&screen::codes(film, style));
        let encoded = Instant::now();
        for stream in &mut self.streams {
            stream.write(|out| out.write_all(&bytes))?;
        }
        cost.compress += encoded - begin;
        cost.write += encoded.elapsed();
        Ok((paths, cost))
    }

    /// Ends the streams; they are what they are then.
    ///
    /// # Errors
    /// When the file system refuses.
    pub fn finish(self) -> Result<()> {
        for stream in self.streams {
            if let Stream::File(part) = stream {
                part.commit()?;
            }
        }
        Ok(())
    }
}
