//! Fog that the server asks for. It fades in from the level's own, which a timeline does not know: all
//! is kept as a share of that and what comes in addition.

/// Density, red, green and blue of a fog, as far as they depend on the level's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AskedFog {
    /// Share of the level's own in each.
    of_level: [f32; 4],
    /// What comes in addition.
    own: [f32; 4],
}

impl AskedFog {
    /// The level's own fog.
    pub(super) const LEVEL: Self = Self {
        of_level: [1.0; 4],
        own: [0.0; 4],
    };

    /// A fog of this density and colour.
    pub(super) fn of(fog: [f32; 4]) -> Self {
        Self {
            of_level: [0.0; 4],
            own: fog,
        }
    }

    /// The same with other values where there are some.
    pub(super) fn with(mut self, values: [Option<f32>; 4]) -> Self {
        for (i, value) in values.into_iter().enumerate() {
            if let Some(value) = value {
                (self.of_level[i], self.own[i]) = (0.0, value);
            }
        }
        self
    }

    /// Between this one and another, of which there is `share`.
    pub(super) fn fading(self, to: Self, share: f32) -> Self {
        let blend = |a: [f32; 4], b: [f32; 4]| -> [f32; 4] {
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * share)
        };
        Self {
            of_level: blend(self.of_level, to.of_level),
            own: blend(self.own, to.own),
        }
    }

    /// Density, red, green and blue in a level that has this fog of its own.
    #[must_use]
    pub fn in_level(&self, level: [f32; 4]) -> [f32; 4] {
        std::array::from_fn(|i| self.own[i] + self.of_level[i] * level[i])
    }

    /// Its numbers.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f32> + use<> {
        self.of_level.into_iter().chain(self.own)
    }
}

/// A change of the fog.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FogChange {
    pub moment: u32,
    pub begin: f64,
    /// At the beginning, and after `seconds`.
    pub from: AskedFog,
    pub to: AskedFog,
    pub seconds: f64,
}

impl FogChange {
    /// The fog at `t`.
    pub fn at(&self, t: f64) -> AskedFog {
        if self.seconds <= 0.0 || t >= self.begin + self.seconds {
            return self.to;
        }
        let share = ((t - self.begin) / self.seconds).max(0.0) as f32;
        self.from.fading(self.to, share)
    }
}
