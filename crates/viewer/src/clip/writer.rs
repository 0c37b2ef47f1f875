//! Frames are measured, filtered, encoded and written while the next ones are rendered.

use super::report::{Record, Told};
use super::target::{Cost, OpenTargets};
use crate::denoise::Denoise;
use crate::output::Style;
use anyhow::{Result, anyhow};
use scene::render::Film;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Frames that wait for the writer; a further one keeps the renderer waiting. Few, because each is a
/// film with all its layers.
const WAITING: usize = 2;

/// A frame to write.
struct Job {
    film: Film,
    style: Style,
    record: Record,
}

enum Message {
    Frame(Box<Job>),
    /// All that is asked for came: streams are whole.
    End,
}

/// A thread that writes frames in the order they come.
pub struct Writer {
    sender: Option<SyncSender<Message>>,
    thread: JoinHandle<Result<Cost>>,
}

impl Writer {
    /// Starts it. `told` is given every frame that is written.
    #[must_use]
    pub fn start(targets: OpenTargets, denoise: Denoise, told: Told) -> Self {
        let (sender, receiver) = sync_channel(WAITING);
        Self {
            sender: Some(sender),
            thread: std::thread::spawn(move || write(targets, denoise, &told, &receiver)),
        }
    }

    /// Hands a frame over. Returns how long that had to wait; `None` once the writer has failed.
    pub fn send(&self, film: Film, style: Style, record: Record) -> Option<Duration> {
        let begin = Instant::now();
        let job = Message::Frame(Box::new(Job {
            film,
            style,
            record,
        }));
        self.sender.as_ref()?.send(job).ok()?;
        Some(begin.elapsed())
    }

    /// Waits until all frames are written, and ends streams if `whole`; else files of streams disappear.
    ///
    /// # Errors
    /// When an output could not be written.
    pub fn finish(mut self, whole: bool) -> Result<Cost> {
        if let Some(sender) = self.sender.take().filter(|_| whole) {
            // Where this fails the thread has an error to tell.
            let _ = sender.send(Message::End);
        }
        let ended = self.thread.join();
        ended.unwrap_or_else(|_| Err(anyhow!("the thread that writes frames broke down")))
    }
}

fn write(
    mut targets: OpenTargets,
    denoise: Denoise,
    told: &Told,
    jobs: &Receiver<Message>,
) -> Result<Cost> {
    let mut total = Cost::default();
    loop {
        let job = match jobs.recv() {
            Ok(Message::Frame(job)) => job,
            Ok(Message::End) => {
                targets.finish()?;
                return Ok(total);
            }
            // Streams that are not whole are dropped.
            Err(_) => return Ok(total),
        };
        let Job {
            mut film,
            style,
            mut record,
        } = *job;
        let begin = Instant::now();
        record.measure(&film);
        denoise.apply(&mut film);
        let measured = begin.elapsed();
        let (outputs, cost) = targets.write(record.frame, &film, &style)?;
        let cost = Cost {
            measure: measured,
            ..cost
        };
        total.measure += cost.measure;
        total.compress += cost.compress;
        total.write += cost.write;
        record.outputs = outputs;
        record.cost = cost;
        told.frame(&record)?;
    }
}
