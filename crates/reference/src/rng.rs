//! Random numbers that depend on nothing but the seed, the pixel and the sample.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng as _;

/// The random numbers of one path: PCG64-MCG (O'Neill 2014) started from a hash of its place.
pub struct Rng(Pcg64Mcg);

impl Rng {
    /// The generator of sample number `sample` of pixel number `pixel`.
    #[must_use]
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let a = mix(mix(mix(seed) ^ pixel) ^ sample);
        let b = mix(a ^ 0x6a09_e667_f3bc_c908);
        Self(Pcg64Mcg::new(u128::from(a) << 64 | u128::from(b)))
    }

    /// A number in `0..1`, uniform over the multiples of 2^-53.
    #[inline]
    pub fn next(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Two numbers in `0..1`.
    #[inline]
    pub fn next2(&mut self) -> [f64; 2] {
        [self.next(), self.next()]
    }
}

/// One step of SplitMix64 (Steele, Lea, Flood 2014): a bijection of the 64-bit numbers.
fn mix(x: u64) -> u64 {
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
        let n = 100_000_u64;
        let variance = 1.0 / 12.0;
        for (pixel_step, sample_step) in [(1, 0), (0, 1), (1, 1)] {
            let covariance: f64 = (0..n)
                .map(|i| {
                    let a = Rng::new(1, i, i).next();
                    let b = Rng::new(1, i + pixel_step, i + sample_step).next();
                    (a - 0.5) * (b - 0.5)
                })
                .sum::<f64>()
                / n as f64;
            let sigma = variance / (n as f64).sqrt();
            assert!(covariance.abs() < 4.0 * sigma, "covariance {covariance}");
        }
    }

    #[test]
    fn the_seed_the_pixel_and_the_sample_all_matter() {
        let first = |s, p, i| Rng::new(s, p, i).next();
        let base = first(3, 4, 5);
        assert_eq!(base, first(3, 4, 5));
        for other in [first(4, 4, 5), first(3, 5, 5), first(3, 4, 6)] {
            assert_ne!(base, other);
        }
    }
}
