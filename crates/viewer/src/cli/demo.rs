//! `runelight demo`.

use super::PictureArgs;
use super::shared::number;
use crate::clip::Ratio;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

const DEMO_EXAMPLES: &str = "\
Examples:
  runelight demo -o frames/%05d.png --size 640x360 --fps 24
      the bundled demo as film
  runelight demo demo1 --basedir ~/quake
      what the first demo of a Quake installation holds
  runelight demo demo1 --basedir ~/quake -o frames/%05d.exr --from 12 --to 20 --shutter 0.5
      eight seconds of it as film, with the motion blur of a shutter open half the time
  runelight demo demo1 --basedir ~/quake -o frames/%05d.exr --from 12 --to 20 --shutter 0.5 --resume
      the frames that are missing, after a crash or Ctrl-C
  runelight demo my.dem --frames 90..91 -o test.png --spp 16
      frame 90 alone, to look at
  runelight demo my.dem -o my.y4m --fps 30 --size 1920x1080
      raw video, which is large; into an encoder without a file between:
  runelight demo my.dem -o - --fps 30 | ffmpeg -i - -c:v libx264 -crf 16 my.mp4
  ffmpeg -framerate 60 -i frames/%05d.png -c:v libx264 -crf 16 -pix_fmt yuv420p film.mp4
      a sequence of PNGs as a film

Ctrl-C ends with the frames that are complete; the second one gives up.";

/// `runelight demo`
#[derive(Debug, Args)]
#[command(after_help = DEMO_EXAMPLES)]
pub struct Demo {
    /// A .dem file, or a name such as demo1 to look up; without one, the bundled demo
    pub demo: Option<String>,
    /// Files to write: a sequence of .exr (scene-linear, all layers) or .png (tone-mapped, 8 bit)
    /// with %05d where the frame's number goes; or raw video as .y4m, or - for that on stdout.
    /// Repeatable. Without it the demo is listed: protocol, levels, duration, messages, entities
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<PathBuf>,
    /// Which frames.
    #[command(flatten)]
    pub clip: ClipArgs,
    /// Each frame.
    #[command(flatten)]
    pub picture: PictureArgs,
}

impl Demo {
    /// The demo's name, that of the bundled one without a name.
    #[must_use]
    pub fn name(&self) -> &str {
        self.demo.as_deref().unwrap_or(crate::bundled::NAME)
    }
}

/// Which frames of a demo, and what they show of it.
#[derive(Clone, Debug, Args)]
pub struct ClipArgs {
    /// Frames per second: a number, or a fraction such as 30000/1001
    #[arg(long, value_name = "N", default_value = "60", help_heading = "Time")]
    #[arg(value_parser = parse_fps)]
    pub fps: Ratio,
    /// The time of frame 0, seconds of the demo; frame n is n / fps later [default: 0]
    #[arg(long, value_name = "T", help_heading = "Time", value_parser = parse_seconds)]
    pub from: Option<Ratio>,
    /// The frames before this time, seconds of the demo [default: its end]
    #[arg(long, value_name = "T", help_heading = "Time", value_parser = parse_seconds)]
    #[arg(conflicts_with = "frames")]
    pub to: Option<Ratio>,
    /// Frames by number, the second one not among them: 100..200, ..200, 100.., or one alone: 100.
    /// Each is the same whichever others are made
    #[arg(long, value_name = "A..B", help_heading = "Time", value_parser = parse_frames)]
    pub frames: Option<FrameRange>,
    /// Share of the time from frame to frame that the shutter is open, from the frame's time on: what
    /// moves is blurred. 0.5 is a film camera's 180 degrees
    #[arg(
        long,
        value_name = "FRACTION",
        default_value_t = 0.0,
        help_heading = "Time"
    )]
    #[arg(value_parser = number(0.0, 1.0))]
    pub shutter: f64,
    /// Make only the frames that are missing. Files there that were made with other settings, of
    /// another demo or level are refused
    #[arg(long, help_heading = "Output")]
    pub resume: bool,
    /// What the server did not send, because the player could not see it [default: all with --camera
    /// and --camera-path, else hidden]
    #[arg(long, value_name = "WHAT", help_heading = "Entities")]
    pub unseen: Option<UnseenName>,
    /// Leave out what the game does to the whole screen: colours for damage, items and liquids, and
    /// the wobble under water. EXRs never have them
    #[arg(long, help_heading = "Output")]
    pub no_tint: bool,
}

/// `--unseen`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum UnseenName {
    /// Is not there, as in the engine
    Hidden,
    /// Doors, lifts and the like stay where they were last
    Brushes,
    /// All stays where it was last, but for what flies
    All,
}

impl From<UnseenName> for scene::timeline::Unseen {
    fn from(name: UnseenName) -> Self {
        match name {
            UnseenName::Hidden => Self::Hidden,
            UnseenName::Brushes => Self::Brushes,
            UnseenName::All => Self::All,
        }
    }
}

/// `--frames`
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    /// The first.
    pub first: u32,
    /// The first one after it; `None` up to the demo's end.
    pub end: Option<u32>,
}

fn parse_frames(text: &str) -> Result<FrameRange, String> {
    /// No clip is longer.
    const MOST: u32 = 100_000_000;
    let wrong = || format!("frames are A..B, with A below B, or one number; {MOST} at most");
    let number = |text: &str, missing| match text {
        "" => missing,
        text => {
            (text.parse().ok()).filter(|n| text.bytes().all(|b| b.is_ascii_digit()) && *n <= MOST)
        }
    };
    let (first, end) = match text.split_once("..") {
        None => {
            let only = number(text, None).ok_or_else(wrong)?;
            (only, Some(only + 1))
        }
        Some((first, "")) => (number(first, None).ok_or_else(wrong)?, None),
        Some((first, end)) => {
            let first = number(first, Some(0)).ok_or_else(wrong)?;
            (first, Some(number(end, None).ok_or_else(wrong)?))
        }
    };
    if end.is_some_and(|end| end <= first) {
        return Err(wrong());
    }
    Ok(FrameRange { first, end })
}

fn parse_fps(text: &str) -> Result<Ratio, String> {
    (Ratio::parse(text).filter(|r| *r != Ratio::ZERO)).ok_or_else(|| {
        "a rate is a number above 0 with six decimals at most, or a fraction of whole numbers up to a \
         million"
            .to_owned()
    })
}

fn parse_seconds(text: &str) -> Result<Ratio, String> {
    Ratio::parse(text)
        .ok_or_else(|| "a time is a number of seconds with six decimals at most".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_range_or_one() {
        let range = |first, end| Ok(FrameRange { first, end });
        assert_eq!(parse_frames("3..7"), range(3, Some(7)));
        assert_eq!(parse_frames("..7"), range(0, Some(7)));
        assert_eq!(parse_frames("3.."), range(3, None));
        assert_eq!(parse_frames("3"), range(3, Some(4)));
        for wrong in [
            "",
            "..",
            "7..3",
            "3..3",
            "-1",
            "+1",
            "a..b",
            "1..2..3",
            "100000001",
        ] {
            assert!(parse_frames(wrong).is_err(), "{wrong}");
        }
    }
}
