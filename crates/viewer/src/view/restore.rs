//! A picture that was saved, dropped on the window: the same level, from the same place, made the same way.

use super::app::App;
use super::fly::Eye;
use super::look::{Noted, read_command};
use super::save::COMMAND;
use super::stage::SAMPLE_DEMO;
use crate::cli::{CameraChoice, Demo, Render};
use crate::clip;
use crate::clip::resume::notes;
use crate::output::Format;
use anyhow::{Context as _, Result};
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
        let command = notes.get(COMMAND);
        let (global, noted) =
            read_command(command.context("the picture does not say how it was made")?)?;
        let numbers = notes.get("camera").map_or("", String::as_str).split(' ');
        let numbers: Vec<f32> = numbers.filter_map(|n| n.parse().ok()).collect();
        let pose = <[f32; 6]>::try_from(numbers).ok();
        let eye = pose.and_then(Eye::from_pose);
        let eye = eye.context("the picture does not say from where it was made")?;
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
        match noted {
            Noted::Render(made) => self.restore_level(*made, eye),
            Noted::Demo(made) => self.restore_moment(*made, eye),
        }
        Ok(())
    }

    fn restore_level(&mut self, made: Render, eye: Eye) {
        let shown = self.stage.as_ref().filter(|s| s.showing.is_none());
        let is_there = shown.is_some_and(|s| s.level == made.level);
        self.args.picture = made.picture;
        self.look_from(is_there, eye);
        if !is_there {
            self.open(made.level);
        }
    }

    /// A frame of a demo: its moment, from the player's eye or the camera that it had.
    fn restore_moment(&mut self, made: Demo, eye: Eye) {
        let frame = made.clip.frames.map_or(0, |frames| frames.first);
        let time = clip::steps(&made).time(frame);
        let view = &made.picture.view;
        let follows = view.camera.is_none() && view.camera_path.is_none();
        let name = match made.demo {
            // As the search path has it, and the list of what was opened lately.
            Some(name) if !Path::new(&name).is_file() && !name.ends_with(".dem") => name + ".dem",
            Some(name) => name,
            None => SAMPLE_DEMO.into(),
        };
        let shown = self.player.as_mut().filter(|p| p.demo == name);
        let is_there = shown.is_some();
        if let Some(player) = shown {
            player.seek(time);
            player.plays = false;
            player.follows = follows;
        }
        self.flight_path.flies = false;
        self.args.picture = made.picture;
        self.look_from(is_there, eye);
        if !is_there {
            self.open_at(name, (time, follows));
        }
    }

    /// From a place of the level that is there, or of the one that is loaded next.
    fn look_from(&mut self, is_there: bool, eye: Eye) {
        let view = &mut self.args.picture.view;
        (view.camera, view.camera_path) = (None, None);
        if is_there {
            self.go_to(eye);
        } else {
            view.camera = Some(CameraChoice::Pose(eye.pose()));
        }
    }
}
