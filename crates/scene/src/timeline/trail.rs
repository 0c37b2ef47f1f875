//! Trails follow the ways that entities make, a particle every few units, whatever the frame rate.

use super::level::{Level, TrailPoint, TrailRun};
use super::particle::{LONGEST_TRAIL, Particle, Trail};
use super::seed::Seed;
use super::track::Track;
use super::view::Moment;
use glam::Vec3;

/// Most particles of one trail at a moment.
const MOST: u64 = 4096;

/// All trails of a level. `moments` are those of the level.
pub(super) fn runs(level: &Level, moments: &[Moment], number: u64) -> Vec<TrailRun> {
    let mut runs = Vec::new();
    for track in &level.tracks {
        of_track(level, track, moments, Seed(number), &mut runs);
    }
    runs
}

fn of_track(
    level: &Level,
    track: &Track,
    moments: &[Moment],
    seed: Seed,
    runs: &mut Vec<TrailRun>,
) {
    let mut run: Option<TrailRun> = None;
    for (i, key) in track.keys.iter().enumerate() {
        let model = key
            .state
            .as_ref()
            .and_then(|s| level.models.get(usize::from(s.model)));
        let trail = model.and_then(|m| Trail::of_flags(m.flags));
        let (Some(trail), Some(state)) = (trail, key.state.as_ref()) else {
            runs.extend(run.take().and_then(finished));
            continue;
        };
        let index = (key.moment as usize).checked_sub(level.moments.start);
        let Some(window) = index.and_then(|i| moments.get(i)).map(|m| &m.window) else {
            continue;
        };
        let goes_on = key.moves && run.as_ref().is_some_and(|r| r.trail == trail);
        if !goes_on {
            runs.extend(run.take().and_then(finished));
        }
        let run = run.get_or_insert_with(|| TrailRun {
            trail,
            seed: seed.of(u64::from(key.moment)).of(u64::from(track.number)),
            points: vec![TrailPoint {
                time: window.start,
                at: state.origin.into(),
                way: 0.0,
            }],
        });
        let before = i.checked_sub(1).and_then(|i| track.keys.get(i));
        if let Some((from, begin, end)) = key.way(before, window) {
            // A step may be cut short by the next one.
            let next = track.keys.get(i + 1).map(|k| k.moment as usize);
            let next = next.and_then(|n| moments.get(n.checked_sub(level.moments.start)?));
            let cut = next.map_or(end, |m| end.min(m.window.start.max(begin)));
            let share = ((cut - begin) / (end - begin)) as f32;
            let to = from.origin + (Vec3::from(state.origin) - from.origin) * share;
            add(run, begin, from.origin);
            add(run, cut, to);
        }
    }
    runs.extend(run.and_then(finished));
}

fn add(run: &mut TrailRun, time: f64, at: Vec3) {
    let last = run.points.last();
    let way = last.map_or(0.0, |p| p.way + f64::from((at - p.at).length()));
    run.points.push(TrailPoint { time, at, way });
}

/// A trail that has a length.
fn finished(run: TrailRun) -> Option<TrailRun> {
    run.points
        .last()
        .is_some_and(|p| p.way > 0.0)
        .then_some(run)
}

impl TrailRun {
    /// The particles that there are at `t`, the newest first; no more than `room`.
    pub fn particles(&self, t: f64, room: usize, out: &mut Vec<Particle>) {
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else {
            return;
        };
        let oldest = t - LONGEST_TRAIL;
        if first.time > t || last.time < oldest {
            return;
        }
        let spacing = self.trail.spacing();
        let newest = (self.way_at(t) / spacing).floor() as u64;
        let least = (self.way_at(oldest) / spacing).floor() as u64;
        let least = least.max(newest.saturating_sub(MOST));
        let numbers = (least..=newest).rev().take(room);
        out.extend(numbers.filter_map(|n| {
            let (born, at, along) = self.place(n as f64 * spacing)?;
            if born > t {
                return None;
            }
            let particle = self.trail.born(n, at, along, self.seed);
            particle.at_age((t - born) as f32)
        }));
    }

    /// The way made until `t`.
    fn way_at(&self, t: f64) -> f64 {
        let next = self.points.partition_point(|p| p.time <= t);
        let Some(a) = next.checked_sub(1).and_then(|i| self.points.get(i)) else {
            return 0.0;
        };
        let Some(b) = self.points.get(next) else {
            return a.way;
        };
        a.way + (b.way - a.way) * ((t - a.time) / (b.time - a.time))
    }

    /// When and where the trail has come `way` units, and its direction there.
    fn place(&self, way: f64) -> Option<(f64, Vec3, Vec3)> {
        let next = self.points.partition_point(|p| p.way <= way);
        let b = self.points.get(next)?;
        let a = self.points.get(next.checked_sub(1)?)?;
        let share = (way - a.way) / (b.way - a.way);
        let along = (b.at - a.at).normalize_or_zero();
        let at = a.at + (b.at - a.at) * share as f32;
        Some((a.time + (b.time - a.time) * share, at, along))
    }
}
