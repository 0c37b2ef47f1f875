//! Sobol' points in two dimensions, scrambled and shuffled as Owen does, padded to any dimension.
//!
//! Every pair of numbers that a path asks for comes from a sequence of its own: the first two
//! dimensions of Sobol', the order of its points shuffled and its digits scrambled by what the pixel
//! and the pair hash to (Burley, "Practical Hash-based Owen Scrambling", JCGT 9(4), 2020). So the
//! samples of a pixel fill each pair's square evenly, and pixels and pairs know nothing of each other.

use crate::rng::mix;

/// Pairs that a path vertex may use.
const PAIRS_PER_VERTEX: u32 = 1 << 12;

/// The points of one path.
pub(crate) struct Sobol {
    /// Hash of seed and pixel.
    place: u64,
    sample: u32,
    pair: u32,
}

impl Sobol {
    pub fn new(place: u64, sample: u32) -> Self {
        Self {
            place,
            sample,
            pair: 0,
        }
    }

    /// Begins the numbers for path vertex `k`.
    pub fn begin(&mut self, k: u32) {
        self.pair = k.wrapping_mul(PAIRS_PER_VERTEX);
    }

    pub fn next(&mut self) -> f64 {
        self.next2()[0]
    }

    pub fn next2(&mut self) -> [f64; 2] {
        let a = mix(self.place ^ u64::from(self.pair).wrapping_mul(0xd6e8_feb8_6659_fd93));
        let b = mix(a);
        self.pair = self.pair.wrapping_add(1);
        let index = scramble(self.sample, a as u32);
        let point = sobol(index);
        let scrambled = [
            scramble(point[0], (a >> 32) as u32),
            scramble(point[1], b as u32),
        ];
        scrambled.map(|x| f64::from(x) * (1.0 / 4_294_967_296.0))
    }
}

/// Point number `index` of the first two dimensions of Sobol's sequence, as fractions of 2^32: the
/// bits reversed, and the same after Pascal's triangle modulo 2.
fn sobol(index: u32) -> [u32; 2] {
    let mut second = 0;
    // Direction numbers of x + 1: each is the one before, exclusive-or itself halved.
    let (mut direction, mut rest) = (1_u32 << 31, index);
    while rest != 0 {
        if rest & 1 == 1 {
            second ^= direction;
        }
        direction ^= direction >> 1;
        rest >>= 1;
    }
    [index.reverse_bits(), second]
}

/// Scrambles the digits of a number so that what happens to a digit depends on those before it alone
/// (Owen 1995), by a hash that carries only upwards, on the bits reversed (Laine and Karras 2011,
/// with Vegdahl's constants of 2021).
fn scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_box_holds_one_point() {
        for (pixel, pair) in [(0, 0), (5, 1), (77, 4096)] {
            let point = |sample: u32| {
                let mut s = Sobol::new(mix(pixel), sample);
                s.pair = pair;
                s.next2()
            };
            // Any aligned 2^m points are a (0, m, 2)-net.
            for (first, m) in [(0_u32, 4_u32), (16, 4), (256, 8), (0, 10)] {
                for columns in 0..=m {
                    let (nx, ny) = (1_u32 << columns, 1_u32 << (m - columns));
                    let mut boxes = vec![0; 1 << m];
                    for i in first..first + (1 << m) {
                        let [x, y] = point(i);
                        let (x, y) = ((x * f64::from(nx)) as u32, (y * f64::from(ny)) as u32);
                        boxes[(y * nx + x) as usize] += 1;
                    }
                    assert!(boxes.iter().all(|&n| n == 1), "{first} {m} {columns}");
                }
            }
        }
    }

    #[test]
    fn the_same_sample_is_uniform_over_pixels() {
        // Of 65,536 pixels, in 64 boxes of 1,024 expected each.
        let mut boxes = [0_i32; 64];
        for pixel in 0..65_536_u64 {
            let [x, y] = Sobol::new(mix(pixel), 3).next2();
            boxes[(y * 8.0) as usize * 8 + (x * 8.0) as usize] += 1;
        }
        let chi2: f64 = boxes
            .iter()
            .map(|n| f64::from(n - 1024).powi(2) / 1024.0)
            .sum();
        // 63 degrees of freedom: 4 standard deviations are 45.
        assert!(chi2 < 63.0 + 45.0, "{chi2}");
    }
}
