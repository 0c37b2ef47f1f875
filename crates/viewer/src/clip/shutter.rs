//! Motion blur: each sample sees a moment of its own within the time that the shutter is open.

use crate::job::AnyRenderer;
use anyhow::Result;
use scene::Frame;
use scene::render::Film;

/// A renderer that shows a moment for each sample.
pub struct Shutter<'a> {
    inner: &'a mut dyn AnyRenderer,
    /// What is seen at a share, 0 to 1, of the time that the shutter is open.
    moment: &'a dyn Fn(f64) -> Result<Frame>,
    offset: f64,
    taken: u32,
}

impl<'a> Shutter<'a> {
    /// A new picture by `inner` of the moments that `moment` gives for shares, 0 to 1, of the time that
    /// the shutter is open; `seed` decides which.
    #[must_use]
    pub fn new(
        inner: &'a mut dyn AnyRenderer,
        moment: &'a dyn Fn(f64) -> Result<Frame>,
        seed: u64,
    ) -> Self {
        Self {
            inner,
            moment,
            // 53 bits: an f64's.
            offset: (super::mix(seed) >> 11) as f64 / (1_u64 << 53) as f64,
            taken: 0,
        }
    }

    /// When sample `index` is taken: multiples of the golden ratio modulo 1 (Weyl), which are evenly
    /// spread however many there are, and go together with no sequence in base 2. The offset makes each
    /// of them uniform over all seeds.
    fn share(&self, index: u32) -> f64 {
        (self.offset + f64::from(index) * 0.618_033_988_749_895).fract()
    }
}

impl AnyRenderer for Shutter<'_> {
    fn accumulate(&mut self, samples: u32) -> Result<()> {
        for _ in 0..samples {
            let frame = (self.moment)(self.share(self.taken))?;
            self.inner.show(&frame)?;
            self.inner.accumulate(1)?;
            self.taken += 1;
        }
        Ok(())
    }

    fn accumulate_per_pixel(&mut self, samples: &[u32]) -> Result<()> {
        self.inner.accumulate_per_pixel(samples)
    }

    fn show(&mut self, frame: &Frame) -> Result<()> {
        self.inner.show(frame)
    }

    fn restart(&mut self, seed: u64) -> Result<()> {
        self.inner.restart(seed)
    }

    fn finish(&mut self) -> Result<()> {
        self.inner.finish()
    }

    fn film(&mut self) -> Result<Film> {
        self.inner.film()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::Camera;
    use std::cell::RefCell;

    /// Remembers the times that it is shown, once for each sample.
    #[derive(Default)]
    struct Fake {
        time: f32,
        seen: Vec<f32>,
    }

    impl AnyRenderer for Fake {
        fn accumulate(&mut self, samples: u32) -> Result<()> {
            self.seen.extend((0..samples).map(|_| self.time));
            Ok(())
        }

        fn accumulate_per_pixel(&mut self, _: &[u32]) -> Result<()> {
            unreachable!("pixels are treated alike")
        }

        fn show(&mut self, frame: &Frame) -> Result<()> {
            self.time = frame.time;
            Ok(())
        }

        fn restart(&mut self, _: u64) -> Result<()> {
            Ok(())
        }

        fn finish(&mut self) -> Result<()> {
            Ok(())
        }

        fn film(&mut self) -> Result<Film> {
            Ok(Film::default())
        }
    }

    fn seen(calls: &[u32], seed: u64) -> Vec<f32> {
        let asked = RefCell::new(0);
        let camera = Camera {
            name: String::new(),
            position: [0.0; 3].into(),
            pitch_deg: 0.0,
            yaw_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 90.0,
            lens: None,
        };
        let scene = scene::Scene::default();
        let moment = |share: f64| {
            *asked.borrow_mut() += 1;
            Ok(scene.as_frame(&camera, share as f32))
        };
        let mut fake = Fake::default();
        let mut shutter = Shutter::new(&mut fake, &moment, seed);
        calls.iter().for_each(|n| shutter.accumulate(*n).unwrap());
        assert_eq!(*asked.borrow(), calls.iter().sum::<u32>());
        fake.seen
    }

    #[test]
    fn samples_are_spread_evenly_over_the_time_that_is_open() {
        let all = seen(&[64], 1);
        // However they are split into calls.
        assert_eq!(all, seen(&[1, 3, 40, 20], 1));
        // After any number of them, no part of the time has many more than its share.
        for n in [5, 16, 64] {
            let mut sorted = all[..n].to_vec();
            sorted.sort_by(f32::total_cmp);
            for (i, share) in sorted.iter().enumerate() {
                let expected = (i as f32 + 0.5) / n as f32;
                assert!((share - expected).abs() < 1.5 / n as f32, "{n}: {sorted:?}");
            }
        }
        // Over all seeds each sample is anywhere alike.
        let mean: f32 = (0..1000).map(|seed| seen(&[1], seed)[0]).sum::<f32>() / 1000.0;
        assert!(
            (mean - 0.5).abs() < 5.0 / (12.0_f32 * 1000.0).sqrt(),
            "{mean}"
        );
    }
}
