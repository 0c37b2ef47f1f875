//! A picture that was saved, dropped on the window: the same level, from the same place, made the same way.

use super::app::App;
use super::fly::Eye;
use super::look::read_command;
use super::save::COMMAND;
use crate::cli::CameraChoice;
use crate::clip::resume::notes;
use crate::output::Format;
use anyhow::{Context as _, Result, anyhow, bail};
use std::path::Path;

impl App {
    /// Takes level, camera and settings from what a picture notes of itself.
    pub fn restore(&mut self, path: &Path) {
        match self.try_restore(path) {
            Ok(()) => (self.notices).say(format!("as {} was made", path.display())),
            Err(error) => (self.notices).error(format!("{}: {error:#}", path.display())),
        }
    }

    fn try_restore(&mut self, path: &Path) -> Result<()> {
        let notes = notes(path, Format::of(path)?)?;
        if let (Some(demo), Some(time)) = (notes.get("demo"), notes.get("demoTime")) {
            let camera = notes.get("camera").map(String::as_str).unwrap_or_default();
            return self.restore_moment(demo, time, camera);
        }
        let command = notes.get(COMMAND);
        let (global, made) =
            read_command(command.context("the picture does not say how it was made")?)?;
        let Some(CameraChoice::Pose(pose)) = made.picture.view.camera else {
            bail!("the picture does not say from where it was made");
        };
        let eye = Eye::from_pose(pose).context("its camera is nowhere")?;
        // Files are looked for where they were, too; what is found here comes first.
        if self.global.basedir.is_none() {
            self.global.basedir = global.basedir;
            self.global.game = global.game;
        }
        for pak in global.pak.into_iter().rev() {
            if !self.global.pak.contains(&pak) && pak.exists() {
                self.global.pak.insert(0, pak);
            }
        }
        let shown = self.stage.as_ref().filter(|s| s.showing.is_none());
        let is_there = shown.is_some_and(|s| s.level == made.level);
        self.args.picture = made.picture;
        let view = &mut self.args.picture.view;
        if is_there {
            (view.camera, view.camera_path) = (None, None);
            self.go_to(eye);
        } else {
            // The level is loaded to be seen from there.
            self.open(made.level);
        }
        Ok(())
    }

    /// A frame of a demo: its moment in that demo, if it is the one that is shown.
    fn restore_moment(&mut self, demo: &str, time: &str, camera: &str) -> Result<()> {
        let seconds: f64 = time.parse().map_err(|_| anyhow!("{time} is no time"))?;
        let name = |demo: &str| {
            let file = Path::new(demo).file_stem().unwrap_or_default();
            file.to_string_lossy().into_owned()
        };
        match &mut self.player {
            Some(player) if name(&player.demo) == name(demo) => player.seek(seconds),
            _ => bail!("it is a frame of {demo} at {seconds:.3} s; open that first"),
        }
        let numbers: Vec<f32> = camera.split(' ').filter_map(|n| n.parse().ok()).collect();
        let pose = <[f32; 6]>::try_from(numbers).ok().and_then(Eye::from_pose);
        if let (Some(eye), Some(player)) = (pose, &mut self.player) {
            player.follows = false;
            self.go_to(eye);
        }
        Ok(())
    }
}
