//! Pictures of the window as files, with the command that makes them again.

use super::look::{command_line, demo_command_line, noted_command};
use crate::cli::{CameraChoice, Demo, FrameRange, Global, PictureArgs, Render};
use crate::clip::{self, Ratio};
use crate::demo;
use crate::device::Device;
use crate::level::Loaded;
use crate::output::{Note, Outputs, Screen};
use anyhow::{Context as _, Result, anyhow};
use scene::Scene;
use scene::render::{Film, Settings};
use scene::timeline::State;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::JoinHandle;

/// The note of a picture that holds [`noted_command`].
pub const COMMAND: &str = "command";

/// What a picture is of.
pub enum Shown {
    /// A level, and the options that it was made with.
    Level(Box<Render>),
    /// A moment of a demo.
    Demo(Box<Moment>),
}

/// A moment of a demo.
pub struct Moment {
    /// The options of a film that begins with it, but for the time.
    pub args: Demo,
    /// Seconds of the demo.
    pub time: f64,
    /// All that is there then.
    pub state: State,
    /// The level's files.
    pub loaded: Arc<Loaded>,
}

/// A picture that is to be written.
pub struct Picture {
    /// What it is of.
    pub shown: Shown,
    /// Where files are looked up.
    pub global: Global,
    /// What the renderer was told.
    pub settings: Settings,
    /// What was rendered.
    pub scene: Arc<Scene>,
    /// The picture.
    pub film: Film,
    /// What it was rendered on.
    pub device: Device,
    /// The folder to write to.
    pub folder: PathBuf,
}

/// A picture that was written.
#[derive(Clone, Debug)]
pub struct Saved {
    /// Where to.
    pub files: Vec<PathBuf>,
    /// The command that makes the same files.
    pub command: String,
}

/// A picture on its way to files. Dropped, it is written first: whoever closes the window wants it whole.
pub struct Writing {
    result: Receiver<Result<Saved>>,
    thread: Option<JoinHandle<()>>,
}

impl Writing {
    /// Begins to write, and asks for a frame when it is done.
    #[must_use]
    pub fn start(picture: Picture, ctx: egui::Context) -> Self {
        let (sender, result) = channel();
        let thread = std::thread::spawn(move || {
            // Nobody waits any more if the receiver is gone.
            let _ = sender.send(save(picture));
            ctx.request_repaint();
        });
        Self {
            result,
            thread: Some(thread),
        }
    }

    /// What became of it, once.
    pub fn poll(&self) -> Option<Result<Saved>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(anyhow!("writing ended without a word"))),
        }
    }
}

impl Drop for Writing {
    fn drop(&mut self) {
        if let Some(Err(_)) = self.thread.take().map(JoinHandle::join) {
            tracing::error!("a picture may not be written whole");
        }
    }
}

/// Writes EXR and PNG under the first free number.
///
/// # Errors
/// When they can't be written.
pub fn save(mut picture: Picture) -> Result<Saved> {
    let denoise = match &picture.shown {
        Shown::Level(args) => args.picture.denoise,
        Shown::Demo(moment) => moment.args.picture.denoise,
    };
    denoise.apply(&mut picture.film);
    let (film, settings) = (&picture.film, &picture.settings);
    let name = file_name(&picture.scene.name);
    let free = |n: &u32| {
        let taken = |ext| picture.folder.join(format!("{name}-{n:03}.{ext}")).exists();
        !taken("exr") && !taken("png")
    };
    let number = (1..1_000_000).find(free).unwrap_or(0);
    let output: Vec<PathBuf> = (["exr", "png"].iter())
        .map(|ext| picture.folder.join(format!("{name}-{number:03}.{ext}")))
        .collect();
    picture.global.device.clone_from(&picture.device.name);
    let (global, device) = (&picture.global, &picture.device);
    let as_made = |options: &mut PictureArgs, has_camera: bool| {
        let c = &settings.camera;
        let [x, y, z] = c.position.to_array();
        let pose = [x, y, z, c.pitch_deg, c.yaw_deg, c.roll_deg];
        options.spp = film.samples;
        options.view.size = (film.width, film.height);
        options.view.camera_path = None;
        options.view.camera = has_camera.then_some(CameraChoice::Pose(pose));
        if has_camera {
            options.view.take_lens(c);
        }
        options.adaptive = false;
        (options.time_limit, options.target_error) = (None, None);
        options.notes(&picture.scene, settings, device, film)
    };
    let (command, style) = match &mut picture.shown {
        Shown::Level(args) => {
            args.output.clone_from(&output);
            let mut notes = as_made(&mut args.picture, true);
            let made = noted_command(args, global, settings, film.samples);
            notes.push((COMMAND, Note::Text(made)));
            (command_line(args, global), args.picture.style(notes))
        }
        Shown::Demo(moment) => {
            let args = &mut moment.args;
            args.output.clone_from(&output);
            let is_free = args.picture.view.camera.is_some();
            let mut notes = as_made(&mut args.picture, is_free);
            let clip = &mut args.clip;
            // The light alone, as the window shows it.
            clip.no_tint = true;
            clip.from = Some(Ratio::of(moment.time).context("the demo is too long")?);
            clip.frames = Some(FrameRange {
                first: 0,
                end: Some(1),
            });
            let screen = if is_free {
                Screen::default()
            } else {
                clip::screen(&moment.loaded.level, &moment.state, &settings.camera)
            };
            let demo = demo::read(args.demo.as_deref(), global)?;
            let noted = clip::Noted {
                args,
                global,
                frame: 0,
                samples: film.samples,
                state: &moment.state,
                screen: &screen,
                stage: &moment.loaded.digest(),
                made: &clip::made(args, &demo)?,
            };
            notes.extend(noted.notes());
            (demo_command_line(args, global), args.picture.style(notes))
        }
    };
    let files = Outputs::open(&output)?.write(film, &style)?;
    Ok(Saved { files, command })
}

/// A level's name as a file's.
pub(super) fn file_name(level: &str) -> String {
    let stem = Path::new(level).file_stem();
    let name = stem.map_or("picture".into(), |s| s.to_string_lossy().into_owned());
    let plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    name.chars()
        .map(|c| if plain(c) { c } else { '_' })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_give_names_that_files_can_have() {
        assert_eq!(file_name("maps/e1m1.bsp"), "e1m1");
        assert_eq!(file_name("what a:level?"), "what_a_level_");
    }
}
