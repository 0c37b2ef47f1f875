//! Chance without state: every random number of a timeline is a function of what it is for, so that
//! a moment looks the same however it is reached.

/// A source of random numbers for one thing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seed(pub u64);

/// SplitMix64's finisher (Steele, Lea, Flood 2014).
fn mix(value: u64) -> u64 {
    let z = (value ^ value >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

impl Seed {
    /// The source for part `index` of this thing.
    pub fn of(self, index: u64) -> Self {
        let step = 0x9e37_79b9_7f4a_7c15_u64;
        Self(mix(self
            .0
            .wrapping_add(step.wrapping_mul(index.wrapping_add(1)))))
    }

    /// A whole number from 0 to `n - 1`, the same for every call with `lane`.
    pub fn below(self, lane: u64, n: u32) -> u32 {
        // The high half times n: even, without a division.
        ((self.of(lane).0 >> 32).wrapping_mul(u64::from(n)) >> 32) as u32
    }

    /// The same as a number.
    pub fn int(self, lane: u64, n: u32) -> f32 {
        self.below(lane, n) as f32
    }

    /// A number from 0 to 1.
    pub fn unit(self, lane: u64) -> f32 {
        // 24 bits: all of them fit.
        (self.of(lane).0 >> 40) as f32 / (1u32 << 24) as f32
    }
}

/// Gathers values into one number.
#[derive(Clone, Copy, Debug)]
pub struct Digest(u64);

impl Digest {
    pub fn new() -> Self {
        Self(0)
    }

    pub fn add(&mut self, value: u64) {
        self.0 = mix(self.0.rotate_left(5) ^ value).wrapping_add(0x9e37_79b9_7f4a_7c15);
    }

    pub fn add_f32(&mut self, value: f32) {
        self.add(u64::from(value.to_bits()));
    }

    pub fn add_f64(&mut self, value: f64) {
        self.add(value.to_bits());
    }

    pub fn add_vec(&mut self, value: glam::Vec3) {
        for x in value.to_array() {
            self.add_f32(x);
        }
    }

    pub fn finish(self) -> u64 {
        mix(self.0)
    }
}
