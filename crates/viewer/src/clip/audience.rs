//! Who watches a clip being made, when that is not a terminal.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How far something is: so many of so many samples.
#[derive(Debug, Default)]
pub struct Reached {
    done: AtomicU64,
    all: AtomicU64,
}

impl Reached {
    /// Takes note.
    pub(crate) fn tell(&self, done: u64, all: u64) {
        self.done.store(done, Ordering::Relaxed);
        self.all.store(all, Ordering::Relaxed);
    }

    /// The share that is done, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        let [done, all] = [&self.done, &self.all].map(|n| n.load(Ordering::Relaxed));
        (done as f64 / all.max(1) as f64).min(1.0)
    }
}

/// Someone who sees how far a clip is, and can end it. By default nobody.
#[derive(Clone, Debug, Default)]
pub struct Audience(Option<Arc<Seat>>);

#[derive(Debug)]
struct Seat {
    reached: Arc<Reached>,
    ends: AtomicBool,
    begun: Instant,
}

impl Audience {
    /// Somebody.
    #[must_use]
    pub fn watching() -> Self {
        Self(Some(Arc::new(Seat {
            reached: Arc::default(),
            ends: AtomicBool::new(false),
            begun: Instant::now(),
        })))
    }

    /// Whether there is somebody.
    #[must_use]
    pub fn watches(&self) -> bool {
        self.0.is_some()
    }

    /// Asks to end after the frames that are complete.
    pub fn end(&self) {
        if let Some(seat) = &self.0 {
            seat.ends.store(true, Ordering::Relaxed);
        }
    }

    /// Whether that was asked.
    #[must_use]
    pub fn asks_to_end(&self) -> bool {
        (self.0.as_ref()).is_some_and(|seat| seat.ends.load(Ordering::Relaxed))
    }

    pub(crate) fn reached(&self) -> Option<Arc<Reached>> {
        self.0.as_ref().map(|seat| Arc::clone(&seat.reached))
    }

    /// The share that is done, the time it took, and the time that is left once that can be said.
    #[must_use]
    pub fn progress(&self) -> (f64, Duration, Option<Duration>) {
        let Some(seat) = &self.0 else {
            return (0.0, Duration::ZERO, None);
        };
        let (share, taken) = (seat.reached.share(), seat.begun.elapsed());
        (share, taken, left(share, taken))
    }
}

/// The time that is left when a share took so long.
fn left(share: f64, taken: Duration) -> Option<Duration> {
    let seconds = taken.as_secs_f64() * (1.0 - share) / share;
    Duration::try_from_secs_f64(seconds).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_known_once_something_is_done() {
        let ten = Duration::from_secs(10);
        assert_eq!(left(0.0, ten), None);
        assert_eq!(left(0.25, ten), Some(Duration::from_secs(30)));
        assert_eq!(left(1.0, ten), Some(Duration::ZERO));
        let audience = Audience::watching();
        assert!(!audience.asks_to_end() && audience.progress().2.is_none());
        audience.reached().unwrap().tell(1, 4);
        audience.clone().end();
        assert!(audience.asks_to_end());
        assert_eq!(audience.progress().0, 0.25);
        let nobody = Audience::default();
        nobody.end();
        assert!(!nobody.asks_to_end() && !nobody.watches());
    }
}
