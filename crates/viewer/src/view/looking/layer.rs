//! Layers as colours, with what these mean.

use super::color::{of_number, range_of, viridis};
use super::survey::{Met, NONE, Survey};
use crate::tonemap::{Tonemap, display_u8, srgb_encode};
use bsp::Bsp;
use egui::{Color32, ColorImage};
use scene::render::Film;

/// What is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shown {
    /// The picture itself.
    #[default]
    Picture,
    /// Share of light that is reflected.
    Albedo,
    /// Normals.
    Normal,
    /// Distances.
    Depth,
    /// What shines.
    Emission,
    /// Light that was reflected once.
    Direct,
    /// Light that was reflected more often.
    Indirect,
    /// Variance of the mean.
    Variance,
    /// Samples.
    Samples,
    /// How far things moved.
    Motion,
    /// The light of one light style.
    Style,
    /// Emitters by number.
    Emitters,
    /// Baked light.
    Lightmap,
    /// Traced against baked light.
    Difference,
    /// Faces by number.
    Faces,
    /// Entities by number.
    Entities,
    /// Leafs by number.
    Leafs,
    /// What a leaf may see.
    Pvs,
}

impl Shown {
    /// All of them, with name and what they are.
    pub const ALL: [(Self, &str, &str); 18] = [
        (Self::Picture, "picture", "all light"),
        (
            Self::Albedo,
            "albedo",
            "share of light that surfaces reflect",
        ),
        (
            Self::Normal,
            "normal",
            "x, y, z from -1 to 1 as red, green, blue",
        ),
        (Self::Depth, "depth", "distance along the view, in units"),
        (
            Self::Emission,
            "emission",
            "what shines by itself, as radiance",
        ),
        (Self::Direct, "direct", "light that was reflected once"),
        (
            Self::Indirect,
            "indirect",
            "light that was reflected more than once",
        ),
        (
            Self::Variance,
            "variance",
            "of the mean luminance, as a power of ten",
        ),
        (Self::Samples, "samples", "behind each pixel"),
        (
            Self::Motion,
            "motion",
            "pixels since the frame before, of demos",
        ),
        (
            Self::Style,
            "light style",
            "light of one style, at brightness 1",
        ),
        (
            Self::Emitters,
            "emitters",
            "what is chosen as one light has one colour",
        ),
        (
            Self::Lightmap,
            "lightmap",
            "the level's own light; 1 shows textures as stored",
        ),
        (
            Self::Difference,
            "traced and baked",
            "stops by which traced light is brighter than baked, but for the middle of the picture",
        ),
        (Self::Faces, "faces", "each face of the level in one colour"),
        (
            Self::Entities,
            "entities",
            "what belongs to one entity has one colour",
        ),
        (
            Self::Leafs,
            "leafs",
            "of the level's tree, in front of what is seen",
        ),
        (
            Self::Pvs,
            "PVS",
            "what the leaf of the inspected point may see, or of the eye where none was clicked",
        ),
    ];

    /// The name for people.
    #[must_use]
    pub fn name(self) -> &'static str {
        let of = |(shown, name, _): &(Self, &'static str, &str)| (*shown == self).then_some(*name);
        Self::ALL.iter().find_map(of).unwrap_or_default()
    }

    /// Whether rays must be sent for it.
    #[must_use]
    pub fn needs_survey(self) -> bool {
        let asked = matches!(self, Self::Faces | Self::Entities | Self::Leafs | Self::Pvs);
        asked || self == Self::Emitters || self.needs_baked()
    }

    /// Whether the level's lightmaps are wanted.
    #[must_use]
    pub fn needs_baked(self) -> bool {
        matches!(self, Self::Lightmap | Self::Difference)
    }

    /// Whether the renderer keeps it only when it is asked for layers.
    #[must_use]
    pub fn needs_layers(self) -> bool {
        let first = matches!(
            self,
            Self::Albedo | Self::Normal | Self::Depth | Self::Motion
        );
        first || matches!(self, Self::Emission | Self::Direct | Self::Indirect)
    }

    /// Whether it is numbers in false colour.
    #[must_use]
    pub fn is_scalar(self) -> bool {
        matches!(
            self,
            Self::Depth | Self::Variance | Self::Samples | Self::Motion | Self::Difference
        )
    }
}

/// What colours mean.
#[derive(Clone, Debug, PartialEq)]
pub enum Legend {
    /// Colours that are what they are.
    Colours,
    /// The range of [`viridis`], and its unit.
    Range([f32; 2], &'static str),
    /// How many numbers there are.
    Numbers(usize),
    /// Some colours with names.
    Names(Vec<([u8; 3], &'static str)>),
    /// There is nothing to show, and why.
    Nothing(&'static str),
}

/// All that a layer is made of.
pub struct Sources<'a> {
    /// The film.
    pub film: &'a Film,
    /// What rays met.
    pub survey: Option<&'a Survey>,
    /// The level.
    pub bsp: Option<&'a Bsp>,
    /// Leaf whose PVS is shown.
    pub leaf: Option<u32>,
    /// By instance, its entity.
    pub entities: &'a [u32],
    /// Number of the light style.
    pub style: u16,
    /// Range of numbers, or to be found.
    pub range: Option<[f32; 2]>,
    /// Exposure and tone curve of light.
    pub display: (f32, Tonemap),
}

fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// A picture of a layer. What is not there is black, and the legend says why.
#[must_use]
pub fn image(shown: Shown, s: &Sources<'_>) -> (ColorImage, Legend) {
    let film = s.film;
    let size = [film.width as usize, film.height as usize];
    let nothing = |why| {
        (
            ColorImage::filled(size, Color32::BLACK),
            Legend::Nothing(why),
        )
    };
    let light = |rgb: &[[f32; 3]]| {
        if rgb.is_empty() {
            return nothing("this picture was made without it");
        }
        let code = |p: &[f32; 3]| display_u8(*p, s.display.0, s.display.1);
        (colors(size, rgb.iter().map(code)), Legend::Colours)
    };
    let plain = |rgb: &[[f32; 3]], code: &dyn Fn(f32) -> f32| {
        if rgb.is_empty() {
            return nothing("this picture was made without it");
        }
        let codes = rgb
            .iter()
            .map(|p| p.map(|c| (code(c).clamp(0.0, 1.0) * 255.0 + 0.5) as u8));
        (colors(size, codes), Legend::Colours)
    };
    match shown {
        Shown::Picture => light(&film.beauty),
        Shown::Emission => light(&film.emission),
        Shown::Direct => light(&film.direct),
        Shown::Indirect => light(&film.indirect),
        Shown::Albedo => plain(&film.albedo, &srgb_encode),
        Shown::Normal => plain(&film.normal, &|c| c * 0.5 + 0.5),
        Shown::Style => match film.styles.iter().find(|l| l.number == s.style) {
            Some(layer) => light(&layer.radiance),
            None => nothing("no light of this style was kept apart"),
        },
        Shown::Depth | Shown::Variance | Shown::Samples | Shown::Motion | Shown::Difference => {
            match scalars(shown, s) {
                Some((values, unit)) => false_colours(size, &values, unit, s.range),
                None if shown == Shown::Difference => {
                    nothing("the level's lightmaps are being looked at")
                }
                None => nothing("this picture was made without it"),
            }
        }
        Shown::Lightmap => {
            let Some(survey) = s.survey else {
                return nothing("the level's lightmaps are being looked at");
            };
            let baked = met(survey, film).map(|m| m.baked.map_or([0.0; 3], |[light, _]| light));
            let codes = baked.map(|p| display_u8(p, s.display.0, s.display.1));
            (colors(size, codes), Legend::Colours)
        }
        Shown::Pvs => {
            let (Some(survey), Some(bsp)) = (s.survey, s.bsp) else {
                return nothing("rays are being sent");
            };
            let Some(leaf) = s.leaf else {
                return nothing("the eye is outside of the level");
            };
            let pvs = bsp.pvs(leaf as usize);
            const SELF: [u8; 3] = [253, 231, 37];
            const SEEN: [u8; 3] = [33, 145, 140];
            const NOT: [u8; 3] = [68, 1, 84];
            let codes = met(survey, film).map(|m| match m.leaf {
                NONE => [0; 3],
                own if own == leaf => SELF,
                other if pvs.sees(other as usize) => SEEN,
                _ => NOT,
            });
            let names = vec![(SELF, "the leaf"), (SEEN, "may be seen"), (NOT, "hidden")];
            (colors(size, codes), Legend::Names(names))
        }
        Shown::Emitters | Shown::Faces | Shown::Entities | Shown::Leafs => {
            let Some(survey) = s.survey else {
                return nothing("rays are being sent");
            };
            let number = |m: Met| match shown {
                Shown::Emitters => m.emitter,
                Shown::Faces => m.face,
                Shown::Leafs => m.leaf,
                _ => s.entities.get(m.instance as usize).copied().unwrap_or(NONE),
            };
            let numbers: Vec<u32> = met(survey, film).map(number).collect();
            let mut different = numbers.clone();
            different.sort_unstable();
            different.dedup();
            different.retain(|&n| n != NONE);
            let codes = numbers
                .iter()
                .map(|&n| if n == NONE { [0; 3] } else { of_number(n) });
            (colors(size, codes), Legend::Numbers(different.len()))
        }
    }
}

/// The numbers of a layer with their unit.
fn scalars(shown: Shown, s: &Sources<'_>) -> Option<(Vec<f32>, &'static str)> {
    let film = s.film;
    let count = film.beauty.len();
    let (values, unit): (Vec<f32>, _) = match shown {
        Shown::Depth => (film.depth.clone(), "units"),
        Shown::Motion => {
            let length = |&[x, y]: &[f32; 2]| x.hypot(y);
            (film.motion.iter().map(length).collect(), "pixels")
        }
        Shown::Variance => {
            let power = |&v: &[f32; 3]| luminance(v).max(1e-12).log10();
            (
                film.variance.iter().map(power).collect(),
                "log10 of radiance squared",
            )
        }
        Shown::Samples if film.sample_counts.is_empty() => {
            (vec![film.samples as f32; count], "samples")
        }
        Shown::Samples => (
            film.sample_counts.iter().map(|&n| n as f32).collect(),
            "samples",
        ),
        _ => (differences(film, s.survey?), "stops"),
    };
    (values.len() == count && count > 0).then_some((values, unit))
}

/// Stops between traced and baked light, less their median: what scale the two have is up to the level.
/// Not a number where either has none.
fn differences(film: &Film, survey: &Survey) -> Vec<f32> {
    let stops: Vec<f32> = (met(survey, film).zip(&film.beauty))
        .map(|(m, beauty)| {
            let baked = m.baked.map_or(0.0, |[_, shown]| luminance(shown));
            let traced = luminance(*beauty);
            if baked > 0.0 && traced > 0.0 {
                (traced / baked).log2()
            } else {
                f32::NAN
            }
        })
        .collect();
    let mut sorted: Vec<f32> = stops.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    stops.iter().map(|v| v - median).collect()
}

/// What rays met, for each pixel of a film.
fn met<'a>(survey: &'a Survey, film: &Film) -> impl Iterator<Item = Met> + 'a {
    let size = [film.width, film.height];
    let count = film.width * film.height;
    (0..count).map(move |i| survey.at([i % size[0], i / size[0]], size))
}

fn colors(size: [usize; 2], codes: impl Iterator<Item = [u8; 3]>) -> ColorImage {
    let pixels = codes.map(|[r, g, b]| Color32::from_rgb(r, g, b)).collect();
    ColorImage::new(size, pixels)
}

fn false_colours(
    size: [usize; 2],
    values: &[f32],
    unit: &'static str,
    range: Option<[f32; 2]>,
) -> (ColorImage, Legend) {
    let found = || range_of(values.iter().copied());
    let [low, high] = range.or_else(found).unwrap_or([0.0, 1.0]);
    let span = (high - low).max(f32::MIN_POSITIVE);
    let codes = values.iter().map(|v| {
        if v.is_nan() {
            [0; 3]
        } else {
            viridis((v - low) / span)
        }
    });
    (colors(size, codes), Legend::Range([low, high], unit))
}

/// What a pixel of a film has, line by line: names and values.
#[must_use]
pub fn values_at(film: &Film, pixel: [u32; 2]) -> Vec<(&'static str, String)> {
    let i = pixel[1] as usize * film.width as usize + pixel[0] as usize;
    let mut lines = vec![("pixel", format!("{} {}", pixel[0], pixel[1]))];
    let mut rgb = |name, plane: &[[f32; 3]]| {
        if let Some([a, b, c]) = plane.get(i) {
            lines.push((name, format!("{a:.4} {b:.4} {c:.4}")));
        }
    };
    rgb("radiance", &film.beauty);
    rgb("albedo", &film.albedo);
    rgb("normal", &film.normal);
    rgb("position", &film.position);
    rgb("emission", &film.emission);
    rgb("direct", &film.direct);
    rgb("indirect", &film.indirect);
    if let Some(&variance) = film.variance.get(i) {
        lines.push(("variance", format!("{:.3e}", luminance(variance))));
    }
    if let Some(depth) = film.depth.get(i) {
        lines.push(("depth", format!("{depth:.2} units")));
    }
    if let Some([x, y]) = film.motion.get(i) {
        lines.push(("motion", format!("{x:.2} {y:.2} pixels")));
    }
    if let Some(id) = film.id.get(i).filter(|&&id| id > 0) {
        lines.push(("face", (id - 1).to_string()));
    }
    let samples = film.sample_counts.get(i).copied().unwrap_or(film.samples);
    lines.push(("samples", samples.to_string()));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film() -> Film {
        Film {
            width: 3,
            height: 1,
            samples: 5,
            beauty: vec![[0.0; 3], [1.0; 3], [4.0; 3]],
            depth: vec![10.0, 20.0, 30.0],
            ..Film::default()
        }
    }

    fn sources(film: &Film) -> Sources<'_> {
        Sources {
            film,
            survey: None,
            bsp: None,
            leaf: None,
            entities: &[],
            style: 0,
            range: None,
            display: (0.0, Tonemap::Clip),
        }
    }

    #[test]
    fn every_layer_is_a_picture_with_a_legend_or_says_what_is_missing() {
        let film = film();
        for (shown, name, _) in Shown::ALL {
            let (picture, legend) = image(shown, &sources(&film));
            assert_eq!(picture.size, [3, 1], "{name}");
            let there = matches!(shown, Shown::Picture | Shown::Depth | Shown::Samples);
            assert_eq!(
                matches!(legend, Legend::Nothing(_)),
                !there,
                "{name}: {legend:?}"
            );
            assert_eq!(shown.name(), name);
        }
    }

    #[test]
    fn numbers_take_the_whole_map_or_the_range_that_was_set() {
        let film = film();
        let (picture, legend) = image(Shown::Depth, &sources(&film));
        assert_eq!(legend, Legend::Range([10.0, 30.0], "units"));
        let code = |i: usize| {
            let [r, g, b, _] = picture.pixels[i].to_array();
            [r, g, b]
        };
        assert_eq!(
            [code(0), code(1), code(2)],
            [viridis(0.0), viridis(0.5), viridis(1.0)]
        );
        let set = Sources {
            range: Some([0.0, 10.0]),
            ..sources(&film)
        };
        let (picture, legend) = image(Shown::Depth, &set);
        assert_eq!(legend, Legend::Range([0.0, 10.0], "units"));
        assert_eq!(
            picture.pixels[0], picture.pixels[2],
            "beyond the range the end stays"
        );
    }

    #[test]
    fn the_values_of_a_pixel_are_those_of_its_layers() {
        let lines = values_at(&film(), [2, 0]);
        assert!(
            lines.contains(&("radiance", "4.0000 4.0000 4.0000".into())),
            "{lines:?}"
        );
        assert!(lines.contains(&("depth", "30.00 units".into())));
        assert!(lines.contains(&("samples", "5".into())));
        assert!(!lines.iter().any(|(name, _)| *name == "albedo"));
    }
}
