//! The picture on its way to files.

use super::App;
use crate::view::save::{Picture, Writing};
use anyhow::Result;
use scene::render::Renderer as _;

impl App {
    /// Takes the picture as it is when its samples are whole, and writes it.
    pub fn save(&mut self) {
        self.is_saving = true;
    }

    /// Writes the picture, if that was asked for and it is at a whole sample.
    pub(super) fn write(&mut self, ctx: &egui::Context) -> Result<()> {
        let ready = self.is_still() && self.pace.is_even() && self.pace.samples() > 0;
        let ready = ready && !self.needs_turning();
        if !self.is_saving || !ready || self.writing.is_some() || self.loading.is_some() {
            return Ok(());
        }
        let (Some(stage), Some([_, settings])) = (&mut self.stage, &self.told) else {
            return Ok(());
        };
        self.is_saving = false;
        let picture = Picture {
            args: self.args.clone(),
            global: self.global.clone(),
            settings: settings.clone(),
            scene: stage.scene.clone(),
            film: stage.tracer.film()?,
            device: self.device.clone(),
            folder: self.folder.clone(),
            is_demo: stage.showing.is_some(),
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
                    if !saved.command.is_empty() {
                        self.ctx.copy_text(saved.command.clone());
                    }
                    let names: Vec<_> = saved
                        .files
                        .iter()
                        .map(|f| f.display().to_string())
                        .collect();
                    let names = names.join(" and ");
                    self.notices.say(if saved.command.is_empty() {
                        format!("saved {names}")
                    } else {
                        format!(
                            "saved {names}; the clipboard has the command that makes them again:\n{}",
                            saved.command
                        )
                    });
                    self.saved = Some(saved);
                }
                Err(error) => self
                    .notices
                    .error(format!("the picture is not saved: {error:#}")),
            }
        }
    }
}
