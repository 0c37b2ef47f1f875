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

    fn film(&mut self) -> Result<Film> {
        self.inner.film()
    }
}
