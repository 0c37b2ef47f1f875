//! The marked part of a demo on its way to files: what `runelight demo` does, beside the frame loop.

use super::app::App;
use super::look::{demo_command_line, demo_defaults, layers};
use super::player::Player;
use super::stage::SAMPLE_DEMO;
use crate::Outcome;
use crate::cli::{CameraChoice, Demo, Global, LayerList, PictureArgs, UnseenName};
use crate::clip::{self, Audience, Ratio};
use crate::cmd::Context;
use crate::output::Layer;
use anyhow::{Result, anyhow, bail};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::Instant;

/// What is asked for, and what became of it.
pub struct Export {
    /// Where the frames go, as `--output` takes it.
    pub output: String,
    /// Pixels of a frame.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub spp: u32,
    /// Frames per second: a number or a fraction.
    pub fps: String,
    /// Share of a frame's time that the shutter is open.
    pub shutter: f64,
    /// Only frames that are missing are made.
    pub resume: bool,
    /// What the game does to the screen is left out.
    pub no_tint: bool,
    /// All layers of EXRs.
    pub all_layers: bool,
    under_way: Option<UnderWay>,
    /// How the last one ended.
    pub told: Option<Result<String, String>>,
}

impl Default for Export {
    fn default() -> Self {
        Self {
            output: "frames/%05d.png".into(),
            size: [1280, 720],
            spp: 64,
            fps: "60".into(),
            shutter: 0.0,
            resume: false,
            no_tint: false,
            all_layers: false,
            under_way: None,
            told: None,
        }
    }
}

/// A film that is being made.
struct UnderWay {
    audience: Audience,
    result: Receiver<Result<Outcome>>,
    thread: Option<JoinHandle<()>>,
    command: String,
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        // Whoever closes the window does not want half of a file.
        self.audience.end();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Export {
    /// Whether a film is being made, and how far it is.
    #[must_use]
    pub fn under_way(&self) -> Option<&Audience> {
        self.under_way.as_ref().map(|u| &u.audience)
    }

    /// Asks to end after the frames that are complete.
    pub fn cancel(&self) {
        if let Some(under_way) = &self.under_way {
            under_way.audience.end();
        }
    }

    /// Begins to make a film, unless one is being made.
    pub fn start(&mut self, demo: Demo, global: &Global) {
        if self.under_way.is_some() {
            return;
        }
        self.told = None;
        let command = demo_command_line(&demo, global);
        let audience = Audience::watching();
        let (sender, result) = channel();
        let watched = audience.clone();
        let context = Context {
            global: global.clone(),
            json: false,
            start: Instant::now(),
        };
        let thread = std::thread::spawn(move || {
            // Nobody waits any more if the receiver is gone.
            let _ = sender.send(clip::run_for(&demo, &context, &watched));
        });
        self.under_way = Some(UnderWay {
            audience,
            result,
            thread: Some(thread),
            command,
        });
    }

    /// What was told when the film ended, once.
    fn poll(&mut self) -> Option<&Result<String, String>> {
        let under_way = self.under_way.as_ref()?;
        let told = match under_way.result.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err(anyhow!("it ended without a word")),
            Ok(result) => result,
        };
        let seconds = under_way.audience.progress().1.as_secs_f64();
        let told = match told {
            Ok(_) => Ok(format!(
                "the film is made in {seconds:.1} s: {}",
                self.output
            )),
            Err(error) => Err(format!("{error:#}")),
        };
        self.under_way = None;
        Some(self.told.insert(told))
    }

    /// The command of the film that is being made.
    #[must_use]
    pub fn command(&self) -> Option<&str> {
        self.under_way.as_ref().map(|u| u.command.as_str())
    }
}

/// The same, but for what a demo has of its own: a time and a skill.
pub(super) fn of_demo(picture: &PictureArgs) -> PictureArgs {
    let usual = demo_defaults().picture.scene;
    let mut picture = picture.clone();
    let scene = &mut picture.scene;
    scene.at = usual.at;
    scene.entities.skill = usual.entities.skill;
    scene.entities.deathmatch = usual.entities.deathmatch;
    picture
}

impl App {
    /// The options of `runelight demo` for what the window shows of one: from whose eye, how it is made.
    pub(super) fn shown_of(&self, player: &Player) -> Demo {
        let mut demo = demo_defaults();
        demo.demo = (player.demo != SAMPLE_DEMO).then(|| player.demo.clone());
        demo.picture = of_demo(&self.args.picture);
        let view = &mut demo.picture.view;
        (view.camera, view.camera_path) = (None, None);
        if !player.follows {
            view.camera = Some(CameraChoice::Pose(self.eye.pose()));
            demo.clip.unseen = Some(UnseenName::All);
        }
        demo
    }

    /// The options of `runelight demo` for what is marked and set.
    ///
    /// # Errors
    /// A sentence when there is no demo, or something is set that makes no sense.
    pub fn film_options(&self) -> Result<Demo> {
        let Some(player) = &self.player else {
            bail!("there is no demo to make a film of");
        };
        let export = &self.export;
        let mut demo = self.shown_of(player);
        let output = PathBuf::from(export.output.trim());
        if output.as_os_str().is_empty() {
            bail!("there is no file named to write to");
        }
        if output.as_os_str() == "-" {
            bail!("a window has no place for raw video: name a file");
        }
        demo.output = vec![output];
        let fps = Ratio::parse(export.fps.trim()).filter(|r| *r != Ratio::ZERO);
        let Some(fps) = fps else {
            bail!("{}: a rate is a number above 0, or a fraction", export.fps);
        };
        let clip = &mut demo.clip;
        clip.fps = fps;
        if let Some([from, to]) = player.marked {
            (clip.from, clip.to) = (Ratio::of(from), Ratio::of(to));
        }
        (clip.shutter, clip.resume, clip.no_tint) = (export.shutter, export.resume, export.no_tint);
        let picture = &mut demo.picture;
        picture.spp = export.spp.max(1);
        picture.view.size = export.size.map(|n| n.max(1)).into();
        picture.layers = if export.all_layers {
            layers(true)
        } else {
            LayerList(vec![Layer::Beauty])
        };
        let flight = &self.flight_path;
        if flight.flies && !player.follows {
            if !flight.is_saved {
                bail!("the camera path is flown, and no file has it yet: save it first");
            }
            let view = &mut picture.view;
            (view.camera, view.camera_path) = (None, Some(self.path_file()));
            (view.fov, view.aperture, view.focus) = (None, None, None);
        }
        Ok(demo)
    }

    /// The frames that the film would have.
    #[must_use]
    pub fn film_frames(&self, demo: &Demo) -> u32 {
        let all = self.player.as_ref().map_or(0.0, |p| p.timeline.duration());
        let clip = &demo.clip;
        let steps = clip::Steps {
            from: clip.from.unwrap_or(Ratio::ZERO),
            fps: clip.fps,
        };
        let most = steps.before_seconds(all);
        clip.to.map_or(most, |to| steps.before(to).min(most))
    }

    /// Makes a film of what is marked, in the background.
    pub fn export_film(&mut self) {
        match self.film_options() {
            Ok(demo) => self.export.start(demo, &self.global),
            Err(error) => self.export.told = Some(Err(format!("{error:#}"))),
        }
    }

    /// Takes what became of a film.
    pub(super) fn receive_film(&mut self) {
        match self.export.poll() {
            Some(Ok(text)) => {
                let text = text.clone();
                self.notices.say(text);
            }
            Some(Err(text)) => {
                let text = format!("the film is not made: {text}");
                self.notices.error(text);
            }
            None => {}
        }
    }
}
