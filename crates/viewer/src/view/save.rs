//! Pictures of the window as files, with the command that makes them again.

use super::look::{command_line, noted_command};
use crate::cli::{CameraChoice, Global, Render};
use crate::device::Device;
use crate::output::{Note, Outputs};
use anyhow::{Result, anyhow};
use scene::Scene;
use scene::render::{Film, Settings};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::JoinHandle;

/// The note of a picture that holds [`noted_command`].
pub const COMMAND: &str = "command";

/// A picture that is to be written.
pub struct Picture {
    /// The options it was made with, and where files are looked up.
    pub args: Render,
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
    /// Whether it is a moment of a demo, which `render` knows nothing of.
    pub is_demo: bool,
    /// The folder to write to.
    pub folder: PathBuf,
}

/// A picture that was written.
#[derive(Clone, Debug)]
pub struct Saved {
    /// Where to.
    pub files: Vec<PathBuf>,
    /// The command that makes the same files; empty for a moment of a demo.
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
    let (film, settings) = (&picture.film, &picture.settings);
    let name = file_name(&picture.scene.name);
    let free = |n: &u32| {
        let taken = |ext| picture.folder.join(format!("{name}-{n:03}.{ext}")).exists();
        !taken("exr") && !taken("png")
    };
    let number = (1..1_000_000).find(free).unwrap_or(0);
    let args = &mut picture.args;
    args.output = (["exr", "png"].iter())
        .map(|ext| picture.folder.join(format!("{name}-{number:03}.{ext}")))
        .collect();
    picture.global.device.clone_from(&picture.device.name);
    let options = &mut args.picture;
    options.spp = film.samples;
    options.view.size = (film.width, film.height);
    let c = &settings.camera;
    let [x, y, z] = c.position.to_array();
    let pose = [x, y, z, c.pitch_deg, c.yaw_deg, c.roll_deg];
    options.view.camera_path = None;
    options.view.camera = Some(CameraChoice::Pose(pose));
    options.adaptive = false;
    (options.time_limit, options.target_error) = (None, None);
    let command = if picture.is_demo {
        String::new()
    } else {
        command_line(args, &picture.global)
    };
    let (args, device) = (&picture.args, &picture.device);
    let options = &args.picture;
    let mut notes = options.notes(&picture.scene, settings, device, film);
    if !picture.is_demo {
        let made = noted_command(args, &picture.global, settings, film.samples);
        notes.push((COMMAND, Note::Text(made)));
    }
    let style = options.style(notes);
    let files = Outputs::open(&args.output)?.write(film, &style)?;
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
