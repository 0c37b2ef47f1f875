//! The layers of a film by name, and how they are called in a file.

use scene::render::{Film, StyleLayer};

/// A layer of the film that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// Radiance.
    Beauty,
    /// Radiance without its noise ([`crate::denoise`]). Nobody asks for it by name: it is there where a filter is.
    Denoised,
    /// Albedo at the first hit.
    Albedo,
    /// World-space normal at the first hit, towards the camera.
    Normal,
    /// Distance along the view direction, world units.
    Depth,
    /// First hit, world space.
    Position,
    /// Radiance emitted by what the camera sees.
    Emission,
    /// Light that was reflected once.
    Direct,
    /// Light that was reflected more than once.
    Indirect,
    /// Pixels to where the first hit was in the picture before.
    Motion,
    /// Variance of the mean radiance.
    Variance,
    /// Samples behind the pixel.
    Samples,
    /// 1 + number of the face hit by the pixel's first sample.
    Id,
    /// Light by light style.
    Style,
}

/// The samples of a layer.
#[derive(Debug)]
pub enum Plane<'a> {
    /// Three floats a pixel.
    Rgb(&'a [[f32; 3]]),
    /// Two floats a pixel.
    Xy(&'a [[f32; 2]]),
    /// One float a pixel.
    Float(&'a [f32]),
    /// One whole number a pixel.
    Uint(&'a [u32]),
    /// The same whole number everywhere.
    Constant(u32),
    /// Three floats a pixel for each light style.
    Styles(&'a [StyleLayer]),
}

impl Layer {
    /// All layers that are asked for by name, in the order of the help text.
    pub const ALL: [Self; 13] = [
        Self::Beauty,
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Position,
        Self::Emission,
        Self::Direct,
        Self::Indirect,
        Self::Motion,
        Self::Variance,
        Self::Samples,
        Self::Id,
        Self::Style,
    ];

    /// The name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Beauty => "beauty",
            Self::Denoised => "denoised",
            Self::Albedo => "albedo",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Emission => "emission",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Motion => "motion",
            Self::Variance => "variance",
            Self::Samples => "samples",
            Self::Id => "id",
            Self::Style => "style",
        }
    }

    /// Channel names in an EXR. Beauty has the plain names every reader looks for; other layers
    /// carry theirs as a prefix, which viewers and compositors show as groups. [`Layer::Style`] stands
    /// for as many layers as a film has styles, and has none here.
    #[must_use]
    pub fn channels(self) -> Vec<String> {
        let short: &[&str] = match self {
            Self::Beauty => return ["R", "G", "B"].map(str::to_owned).to_vec(),
            Self::Denoised
            | Self::Albedo
            | Self::Emission
            | Self::Direct
            | Self::Indirect
            | Self::Variance => &["R", "G", "B"],
            Self::Normal | Self::Position => &["X", "Y", "Z"],
            Self::Motion => &["X", "Y"],
            Self::Depth => &["Z"],
            Self::Samples | Self::Id => &["V"],
            Self::Style => &[],
        };
        short
            .iter()
            .map(|c| format!("{}.{c}", self.name()))
            .collect()
    }

    /// Whether half precision is enough for this layer when colours are asked for in half.
    /// Positions, depths, motions and numbers stay 32 bits wide, and so does the variance, whose values
    /// are often below the smallest half.
    #[must_use]
    pub fn may_be_half(self) -> bool {
        !matches!(
            self,
            Self::Depth | Self::Position | Self::Motion | Self::Variance | Self::Samples | Self::Id
        )
    }

    /// Whether renderers collect this layer only when asked (`Settings::aovs`).
    #[must_use]
    pub fn is_aov(self) -> bool {
        !matches!(
            self,
            Self::Beauty | Self::Denoised | Self::Variance | Self::Samples | Self::Style
        )
    }

    /// The layer's samples in `film`.
    #[must_use]
    pub fn plane(self, film: &Film) -> Plane<'_> {
        match self {
            Self::Beauty => Plane::Rgb(&film.beauty),
            Self::Denoised => Plane::Rgb(&film.denoised),
            Self::Albedo => Plane::Rgb(&film.albedo),
            Self::Normal => Plane::Rgb(&film.normal),
            Self::Depth => Plane::Float(&film.depth),
            Self::Position => Plane::Rgb(&film.position),
            Self::Emission => Plane::Rgb(&film.emission),
            Self::Direct => Plane::Rgb(&film.direct),
            Self::Indirect => Plane::Rgb(&film.indirect),
            Self::Motion => Plane::Xy(&film.motion),
            Self::Variance => Plane::Rgb(&film.variance),
            Self::Samples => Plane::Constant(film.samples),
            Self::Id => Plane::Uint(&film.id),
            Self::Style => Plane::Styles(&film.styles),
        }
    }

    /// Parses a comma-separated list, or `all`, which is all but [`Layer::Style`]: that changes which
    /// lights are sampled. Beauty is always part of the result; the order is
    /// that of [`Layer::ALL`].
    ///
    /// # Errors
    /// On an unknown name; the sentence lists the names that exist.
    pub fn parse_list(list: &str) -> Result<Vec<Self>, String> {
        let mut chosen = vec![Self::Beauty];
        for name in list.split(',').map(str::trim).filter(|n| !n.is_empty()) {
            match Self::ALL.into_iter().find(|l| l.name() == name) {
                _ if name == "all" => {
                    chosen.extend(Self::ALL.into_iter().filter(|&l| l != Self::Style));
                }
                Some(layer) => chosen.push(layer),
                None => {
                    let names: Vec<&str> = Self::ALL.iter().map(|l| l.name()).collect();
                    return Err(format!(
                        "there is no layer {name:?}; there are {} and all",
                        names.join(", ")
                    ));
                }
            }
        }
        chosen.sort_unstable();
        chosen.dedup();
        Ok(chosen)
    }
}
