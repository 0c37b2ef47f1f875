//! What is looked at: layers, rays, splits.

use super::App;
use crate::view::entities;
use crate::view::fly::Eye;
use crate::view::inspect::{Inspection, Report};
use crate::view::looking::survey::{Key, SceneId, Subject};
use crate::view::looking::{Around, Shown};
use anyhow::Result;
use scene::render::Renderer as _;
use std::sync::Arc;

impl App {
    /// Whether something is looked at besides the picture.
    fn is_looking(&self) -> bool {
        let looking = &self.looking;
        let panel = self.panels.looking && !self.panels.hidden;
        panel || looking.shown != Shown::Picture || looking.kept.is_some()
    }

    /// Keeps the picture as it is, to compare with what comes.
    ///
    /// # Errors
    /// When the device fails.
    pub fn keep(&mut self, name: String) -> Result<()> {
        let has_film = self.is_still() && self.pace.samples() > 0;
        if let (true, Some(stage), Some([_, full])) = (has_film, &mut self.stage, &self.told) {
            let film = stage.tracer.film()?;
            (self.looking).take_film(film, full, self.pace.progress(full.height));
            self.looking.keep(name);
        }
        Ok(())
    }

    /// What rays can be sent at: the scene, the camera and the moment of the picture.
    pub(super) fn subject(&self) -> Option<Subject> {
        let (Some(stage), Some([_, full])) = (&self.stage, &self.told) else {
            return None;
        };
        Some(Subject {
            scene: Arc::clone(&stage.scene),
            loaded: Arc::clone(&stage.loaded),
            options: stage.options.clone(),
            frame: self.frame.clone(),
            camera: full.camera.clone(),
            time: full.time,
            size: [full.width, full.height],
        })
    }

    /// Brings layers up to date with the picture, when it rests.
    pub(super) fn look(&mut self, seconds: f32) -> Result<()> {
        if let Err(why) = self.looking.receive() {
            self.notices.error(why);
        }
        if !self.is_looking() || !self.is_still() || self.pace.samples() == 0 {
            return Ok(());
        }
        let is_done = self.is_done();
        let (Some(stage), Some([_, full])) = (&mut self.stage, &self.told) else {
            return Ok(());
        };
        let progress = self.pace.progress(full.height);
        if self.looking.wants_film(full, progress, seconds, is_done) {
            let film = stage.tracer.film()?;
            self.looking.take_film(film, full, progress);
        }
        if self.looking.shown.needs_survey()
            && let Some(subject) = self.subject()
        {
            let key = Key {
                scene: SceneId::of(&subject.scene),
                camera: subject.camera.clone(),
                time: subject.time,
                size: subject.size,
                baked: self.looking.shown.needs_baked(),
            };
            self.looking.ask(|| subject, key, &self.probes);
        }
        let Some(stage) = &self.stage else {
            return Ok(());
        };
        let instances = (self.frame.as_ref()).map_or(&stage.scene.instances, |f| &f.instances);
        let level = &stage.loaded.level;
        let entities = if self.looking.shown == Shown::Entities {
            entities::of_instances(instances, &stage.scene.meshes, level)
        } else {
            Vec::new()
        };
        let clicked = self.inspected.as_ref().and_then(|report| report.leaf);
        let eyes = self.looking.survey().and_then(|s| s.leaf);
        let around = Around {
            bsp: Some(&level.bsp),
            leaf: clicked.or(eyes),
            entities: &entities,
            display: (self.args.picture.exposure as f32, self.args.picture.tonemap),
        };
        self.looking.paint(&self.ctx, &around);
        Ok(())
    }
}

impl App {
    /// Whether rays are under way to a pixel that was clicked.
    #[must_use]
    pub fn is_inspecting(&self) -> bool {
        self.inspection.is_some()
    }

    /// Asks what a point of the window shows, in shares of the picture from the left and from the top.
    pub fn inspect(&mut self, at: [f64; 2]) {
        if let Some(subject) = self.subject() {
            self.focuses = false;
            self.inspection = Some(Inspection::start(subject, at, &self.probes));
        }
    }

    /// Makes sharp what a point of the window shows, in shares of the picture from the left and from the top.
    pub fn focus_on(&mut self, at: [f64; 2]) {
        self.inspect(at);
        self.focuses = self.is_inspecting();
    }

    /// Takes what was found at a pixel.
    pub(super) fn receive_inspection(&mut self) {
        let Some(answer) = self.inspection.as_ref().and_then(Inspection::poll) else {
            return;
        };
        self.inspection = None;
        let focuses = std::mem::take(&mut self.focuses);
        match answer {
            Ok(report) if focuses => match report {
                Some(Report { seen, camera, .. }) => {
                    let [forward, ..] = Eye::of(&camera).axes();
                    let to = seen.position - camera.position.as_dvec3();
                    let focus = to.dot(forward.as_dvec3()).max(1.0);
                    self.args.picture.view.focus = Some((10.0 * focus).round() / 10.0);
                }
                None => (self.notices).error("there is nothing to focus on".into()),
            },
            Ok(report) => {
                let names = ["inspected texture", "inspected emission"];
                let pictures = report
                    .as_ref()
                    .map(|r| r.pictures.clone())
                    .unwrap_or_default();
                let load = |(picture, name): (Option<egui::ColorImage>, &str)| {
                    let options = egui::TextureOptions::NEAREST;
                    picture.map(|p| self.ctx.load_texture(name, p, options))
                };
                let [base, glow] = pictures;
                self.inspected_pictures = [load((base, names[0])), load((glow, names[1]))];
                self.inspected = report;
            }
            Err(why) => self.notices.error(why),
        }
    }

    /// Flies to where an entity can be seen.
    pub fn go_to_entity(&mut self, number: usize) {
        let Some(stage) = &self.stage else { return };
        let level = &stage.loaded.level;
        let place = (level.entities.get(number)).and_then(|e| entities::place_of(e, &level.bsp));
        if let Some(place) = place {
            let eye = entities::eye_on(place, &level.bsp);
            if let Some(player) = &mut self.player {
                player.follows = false;
            }
            self.flight_path.flies = false;
            self.fly_to(eye);
        }
    }
}
