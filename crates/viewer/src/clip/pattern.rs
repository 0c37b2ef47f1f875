//! File names of a sequence.

use anyhow::{Result, bail};
use std::path::{Path, PathBuf};

/// A path with a place for the frame's number, as C's `printf` and ffmpeg write it: `frames/%05d.exr`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    before: String,
    /// Least number of digits and what follows; `None` where a number has no place.
    number: Option<(usize, String)>,
}

impl Pattern {
    /// Reads a path; `%%` stands for a percent sign.
    ///
    /// # Errors
    /// When it has something else than one `%d` or `%0Nd`, or is no text.
    pub fn parse(path: &Path) -> Result<Self> {
        let shown = path.display();
        let Some(text) = path.to_str() else {
            bail!("{shown}: the name of a sequence is not UTF-8")
        };
        let (mut parts, mut digits) = (vec![String::new()], None);
        let mut rest = text;
        while let Some((plain, after)) = rest.split_once('%') {
            let last = parts.len() - 1;
            parts[last] += plain;
            if let Some(after) = after.strip_prefix('%') {
                parts[last].push('%');
                rest = after;
                continue;
            }
            let end = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(0);
            let width = match &after[..end] {
                "" => Some(1),
                width => width.strip_prefix('0').and_then(|w| w.parse().ok()),
            };
            let width = width.filter(|w| (1..=9).contains(w));
            let (Some(width), Some(after), None) = (width, after[end..].strip_prefix('d'), digits)
            else {
                bail!("{shown}: the place of the frame's number is one %d, or %05d for five digits")
            };
            digits = Some(width);
            parts.push(String::new());
            rest = after;
        }
        let last = parts.len() - 1;
        parts[last] += rest;
        let mut parts = parts.into_iter();
        Ok(Self {
            before: parts.next().unwrap_or_default(),
            number: digits.zip(parts.next()),
        })
    }

    /// Whether there is a place for a number.
    #[must_use]
    pub fn is_sequence(&self) -> bool {
        self.number.is_some()
    }

    /// The path of a frame.
    #[must_use]
    pub fn path(&self, frame: u32) -> PathBuf {
        match &self.number {
            None => self.before.clone(),
            Some((width, after)) => format!("{}{frame:0width$}{after}", self.before),
        }
        .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(pattern: &str, frame: u32) -> String {
        let pattern = Pattern::parse(Path::new(pattern)).unwrap();
        pattern.path(frame).display().to_string()
    }

    #[test]
    fn numbers_stand_where_printf_has_them() {
        assert_eq!(path("a/%05d.exr", 12), "a/00012.exr");
        assert_eq!(path("%d.png", 12), "12.png");
        assert_eq!(path("100%%/%03d.x", 12_345), "100%/12345.x");
        assert_eq!(path("plain.exr", 7), "plain.exr");
        assert!(!Pattern::parse(Path::new("50%%.exr")).unwrap().is_sequence());
        for wrong in [
            "%s.exr", "%5d.exr", "%00d.exr", "%", "%d%d", "%05", "a%010d",
        ] {
            let error = Pattern::parse(Path::new(wrong)).unwrap_err().to_string();
            assert!(error.contains("one %d"), "{error}");
        }
    }
}
