//! Random numbers that depend on nothing but the seed, the pixel and the sample.

use crate::sobol::Sobol;
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng as _;
use scene::render::Sampler;

/// The random numbers of one path.
pub(crate) enum Rng {
    /// PCG64-MCG (O'Neill 2014) started from a hash of the path's place.
    Independent(Pcg64Mcg),
    /// Points of scrambled sequences.
    Sobol(Sobol),
}

impl Rng {
    /// The generator of sample number `sample` of pixel number `pixel`.
    #[must_use]
    pub fn new(sampler: Sampler, seed: u64, pixel: u64, sample: u32) -> Self {
        let place = mix(mix(seed) ^ pixel);
        match sampler {
            Sampler::Independent => {
                let a = mix(place ^ u64::from(sample));
                let b = mix(a ^ 0x6a09_e667_f3bc_c908);
                Self::Independent(Pcg64Mcg::new(u128::from(a) << 64 | u128::from(b)))
            }
            Sampler::Sobol => Self::Sobol(Sobol::new(place, sample)),
        }
    }

    /// Says that the numbers for path vertex `k` begin: a vertex that used more or fewer than
    /// another path's does not shift those of the next.
    pub fn begin_vertex(&mut self, k: u32) {
        if let Self::Sobol(sobol) = self {
            sobol.begin(k);
        }
    }

    /// A number in `0..1`, uniform over the multiples of 2^-53 (2^-32 of a sequence).
    #[inline]
    pub fn next(&mut self) -> f64 {
        match self {
            Self::Independent(pcg) => (pcg.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64),
            Self::Sobol(sobol) => sobol.next(),
        }
    }

    /// Two numbers in `0..1`.
    #[inline]
    pub fn next2(&mut self) -> [f64; 2] {
        match self {
            Self::Independent(_) => [self.next(), self.next()],
            Self::Sobol(sobol) => sobol.next2(),
        }
    }
}

/// One step of SplitMix64 (Steele, Lea, Flood 2014): a bijection of the 64-bit numbers.
pub(crate) fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_pixels_and_samples_are_uncorrelated() {
        let n = 100_000_u32;
        let variance = 1.0 / 12.0;
        let independent = Sampler::Independent;
        let steps = [
            (independent, 1, 0),
            (independent, 0, 1),
            (independent, 1, 1),
        ];
        for (sampler, pixel_step, sample_step) in steps.into_iter().chain([(Sampler::Sobol, 1, 0)])
        {
            let covariance: f64 = (0..n)
                .map(|i| {
                    let pixel = u64::from(i);
                    let a = Rng::new(sampler, 1, pixel, i).next();
                    let b = Rng::new(sampler, 1, pixel + pixel_step, i + sample_step).next();
                    (a - 0.5) * (b - 0.5)
                })
                .sum::<f64>()
                / f64::from(n);
            let sigma = variance / f64::from(n).sqrt();
            assert!(covariance.abs() < 4.0 * sigma, "covariance {covariance}");
        }
    }

    #[test]
    fn the_seed_the_pixel_and_the_sample_all_matter() {
        for sampler in [Sampler::Independent, Sampler::Sobol] {
            let first = |s, p, i| Rng::new(sampler, s, p, i).next();
            let base = first(3, 4, 5);
            assert_eq!(base, first(3, 4, 5));
            for other in [first(4, 4, 5), first(3, 5, 5), first(3, 4, 6)] {
                assert_ne!(base, other);
            }
        }
    }
}
