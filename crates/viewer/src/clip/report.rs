//! What is said of the frames of a clip, and of all of them.

use super::target::Cost;
use crate::escapes;
use anyhow::Result;
use scene::render::{Counters, Film};
use serde_json::{Value, json};
use std::io::Write as _;
use std::path::PathBuf;
use std::time::Duration;

/// A frame that was made.
#[derive(Clone, Debug, Default)]
pub struct Record {
    /// Its number.
    pub frame: u32,
    /// Seconds of the demo.
    pub time: f64,
    /// The server's clock, seconds.
    pub clock: f64,
    /// The level's file.
    pub level: String,
    /// Samples per pixel.
    pub spp: u32,
    /// Why no more.
    pub stopped: &'static str,
    /// Seed of its samples.
    pub seed: u64,
    /// Entities, lights that move and particles.
    pub counts: [usize; 3],
    /// Time for its state, and for showing that to the renderer.
    pub prepare: Duration,
    /// Time for its samples.
    pub render: Duration,
    /// Time for its files.
    pub cost: Cost,
    /// Mean over the pixels.
    pub mean_radiance: [f64; 3],
    /// Estimated relMSE, if there is one.
    pub error: Option<f64>,
    /// What its samples met.
    pub counters: Counters,
    /// Files.
    pub outputs: Vec<PathBuf>,
}

impl Record {
    /// Takes from a frame's film what is said of it. It reads every pixel's neighbours, so that it is
    /// for the writer's thread.
    pub fn measure(&mut self, film: &Film) {
        self.mean_radiance = film.mean_radiance();
        self.error = Some(film.estimated_relmse()).filter(|e| e.is_finite());
    }

    fn json(&self) -> Value {
        let [entities, lights, particles] = self.counts;
        json!({
            "frame": self.frame,
            "time": self.time,
            "clock": self.clock,
            "level": self.level,
            "resumed": false,
            "spp": self.spp,
            "stopped": self.stopped,
            "seed": self.seed,
            "entities": entities,
            "lights": lights,
            "particles": particles,
            "seconds": {
                "prepare": self.prepare.as_secs_f64(),
                "render": self.render.as_secs_f64(),
                "measure": self.cost.measure.as_secs_f64(),
                "compress": self.cost.compress.as_secs_f64(),
                "write": self.cost.write.as_secs_f64(),
            },
            "mean_radiance": self.mean_radiance,
            "estimated_relmse": self.error,
            "nonfinite": self.counters.nonfinite,
            "escaped": self.counters.escaped,
            "outputs": self.outputs,
        })
    }
}

/// Where results go.
#[derive(Clone, Copy, Debug)]
pub struct Told {
    /// As JSON, one object a line.
    pub json: bool,
    /// Stdout is taken by a stream.
    pub to_stderr: bool,
    /// Nowhere: someone watches otherwise.
    pub silent: bool,
}

impl Told {
    /// Tells of a frame that was written.
    ///
    /// # Errors
    /// When stdout is closed.
    pub fn frame(self, record: &Record) -> Result<()> {
        if self.json {
            return self.line(&record.json().to_string());
        }
        let seconds = record.render.as_secs_f64();
        let (frame, time, spp) = (record.frame, record.time, record.spp);
        tracing::info!("frame {frame} at {time:.3} s: {spp} samples in {seconds:.2} s");
        Ok(())
    }

    /// Tells of a frame that was there.
    ///
    /// # Errors
    /// When stdout is closed.
    pub fn resumed(self, frame: u32, time: f64, outputs: &[PathBuf]) -> Result<()> {
        if self.json {
            let told = json!({"frame": frame, "time": time, "resumed": true, "outputs": outputs});
            return self.line(&told.to_string());
        }
        tracing::info!("frame {frame} at {time:.3} s is there");
        Ok(())
    }

    /// Prints a line.
    ///
    /// # Errors
    /// When stdout is closed.
    pub fn line(self, text: &str) -> Result<()> {
        if self.silent {
            return Ok(());
        }
        if self.to_stderr {
            eprintln!("{text}");
            return Ok(());
        }
        let mut out = std::io::stdout().lock();
        writeln!(out, "{text}")?;
        Ok(out.flush()?)
    }
}

/// All frames together.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Frames that were asked for.
    pub asked: u32,
    /// Frames that were there.
    pub resumed: u32,
    /// Seconds of each frame that was made, from its state to its last sample.
    pub frames: Vec<f64>,
    /// Time for loading levels.
    pub load: Duration,
    /// Time for making them ready to be rendered.
    pub build: Duration,
    /// Time for states and for showing them.
    pub prepare: Duration,
    /// Time for samples.
    pub render: Duration,
    /// Time that the renderer waited for the writer.
    pub wait: Duration,
    /// What the writer did.
    pub cost: Cost,
    /// From the beginning of the first frame to the end of the last file, levels' loading aside.
    pub total: Duration,
    /// What all samples met.
    pub counters: Counters,
    /// Why there are no more frames.
    pub stopped: &'static str,
}

impl Summary {
    /// A part of the whole time.
    fn share(&self, part: Duration) -> f64 {
        part.as_secs_f64() / self.total.as_secs_f64().max(1e-9)
    }

    /// The middle and the largest of the frames' seconds.
    fn middle_and_most(&self) -> Option<[f64; 2]> {
        let mut sorted = self.frames.clone();
        sorted.sort_by(f64::total_cmp);
        Some([*sorted.get(sorted.len() / 2)?, *sorted.last()?])
    }

    /// As JSON.
    #[must_use]
    pub fn json(&self) -> Value {
        let [median, longest] = self.middle_and_most().map_or([None; 2], |s| s.map(Some));
        let render = self.render.as_secs_f64().max(1e-9);
        json!({
            "frames": self.frames.len(),
            "frames_resumed": self.resumed,
            "frames_asked": self.asked,
            "stopped": self.stopped,
            "seconds": {
                "load": self.load.as_secs_f64(),
                "build": self.build.as_secs_f64(),
                "prepare": self.prepare.as_secs_f64(),
                "render": self.render.as_secs_f64(),
                "wait": self.wait.as_secs_f64(),
                "measure": self.cost.measure.as_secs_f64(),
                "compress": self.cost.compress.as_secs_f64(),
                "write": self.cost.write.as_secs_f64(),
                "frames": self.total.as_secs_f64(),
            },
            "shares": {
                "prepare": self.share(self.prepare),
                "render": self.share(self.render),
                "wait": self.share(self.wait),
                "measure": self.share(self.cost.measure),
                "compress": self.share(self.cost.compress),
                "write": self.share(self.cost.write),
            },
            "seconds_per_frame": {"median": median, "longest": longest},
            "paths": self.counters.paths,
            "rays": self.counters.rays,
            "mrays_per_s": self.counters.rays as f64 / render / 1e6,
            "nonfinite": self.counters.nonfinite,
            "escaped": self.counters.escaped,
            "escaped_per_1e9_rays": escapes::per_billion(&self.counters),
        })
    }

    /// As sentences.
    #[must_use]
    pub fn text(&self) -> String {
        let made = self.frames.len();
        let there = match self.resumed {
            0 => String::new(),
            resumed => format!(", {resumed} were there"),
        };
        let why = match self.stopped {
            "complete" => String::new(),
            stopped => format!(" of {} ({stopped})", self.asked),
        };
        let Some([median, longest]) = self.middle_and_most() else {
            return format!("{made} frames made{why}{there}");
        };
        let percent = |part| 100.0 * self.share(part);
        let seconds = self.total.as_secs_f64();
        let mrays = self.counters.rays as f64 / self.render.as_secs_f64().max(1e-9) / 1e6;
        format!(
            "{made} frames made{why}{there}: {median:.3} s each (median), {longest:.3} s at most, \
             {mrays:.2} Mrays/s\n\
             of {seconds:.2} s: rendering {:.1} %, preparing {:.1} %, waiting for files {:.1} %; \
             beside that measuring {:.1} %, compressing {:.1} %, writing {:.1} %\n\
             before: loading levels {:.2} s, building {:.2} s",
            percent(self.render),
            percent(self.prepare),
            percent(self.wait),
            percent(self.cost.measure),
            percent(self.cost.compress),
            percent(self.cost.write),
            self.load.as_secs_f64(),
            self.build.as_secs_f64(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_of_the_time_for_frames() {
        let seconds = Duration::from_secs;
        let summary = Summary {
            asked: 5,
            resumed: 1,
            frames: vec![1.0, 4.0, 2.0],
            render: seconds(6),
            prepare: seconds(1),
            wait: seconds(1),
            total: seconds(8),
            stopped: "interrupted",
            ..Summary::default()
        };
        let json = summary.json();
        assert_eq!(json["shares"]["render"], 0.75);
        assert_eq!(json["shares"]["wait"], 0.125);
        assert_eq!(json["seconds_per_frame"]["median"], 2.0);
        assert_eq!(json["seconds_per_frame"]["longest"], 4.0);
        let text = summary.text();
        assert!(
            text.starts_with("3 frames made of 5 (interrupted), 1 were there"),
            "{text}"
        );
        assert!(text.contains("waiting for files 12.5 %"), "{text}");
    }
}
