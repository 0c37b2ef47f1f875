//! The picture on its way to files.

use super::App;
use crate::view::save::{Moment, Picture, Shown, Writing};
use anyhow::Result;
use scene::render::Renderer as _;
use std::sync::Arc;

impl App {
    /// Takes the picture as it is when its samples are whole, and writes it.
    pub fn save(&mut self) {
        self.is_saving = true;
    }

    /// Writes the picture, if that was asked for and it is at a whole sample.
    pub(super) fn write(&mut self, ctx: &egui::Context) -> Result<()> {
        let ready = self.is_still() && self.pace.is_even() && self.pace.samples() > 0;
        // Options and moment are those of this frame: a picture of one before is of others.
        let ready = ready && !self.needs_turning() && !self.is_behind;
        if !self.is_saving || !ready || self.writing.is_some() || self.loading.is_some() {
            return Ok(());
        }
        let (Some(stage), Some([_, settings])) = (&mut self.stage, &self.told) else {
            return Ok(());
        };
        self.is_saving = false;
        let (settings, film, scene) = (settings.clone(), stage.tracer.film()?, stage.scene.clone());
        let loaded = Arc::clone(&stage.loaded);
        let shown = match (&self.player, self.state_of_demo()?) {
            (Some(player), Some(state)) => Shown::Demo(Box::new(Moment {
                args: self.shown_of(player),
                time: player.time,
                state,
                loaded,
            })),
            _ => Shown::Level(Box::new(self.args.clone())),
        };
        let picture = Picture {
            shown,
            global: self.global.clone(),
            settings,
            scene,
            film,
            device: self.device.clone(),
            folder: self.folder.clone(),
        };
        self.writing = Some(Writing::start(picture, ctx.clone()));
        Ok(())
    }

    /// Says what became of the picture that was written.
    pub(super) fn receive_picture(&mut self) {
        if let Some(result) = self.writing.as_ref().and_then(Writing::poll) {
            self.writing = None;
            match result {
                Ok(saved) => {
                    self.ctx.copy_text(saved.command.clone());
                    let names: Vec<_> = saved
                        .files
                        .iter()
                        .map(|f| f.display().to_string())
                        .collect();
                    let names = names.join(" and ");
                    self.notices.say(format!(
                        "saved {names}; the clipboard has the command that makes them again:\n{}",
                        saved.command
                    ));
                    self.saved = Some(saved);
                }
                Err(error) => self
                    .notices
                    .error(format!("the picture is not saved: {error:#}")),
            }
        }
    }
}
