//! Materials as a person wants them: a TOML text of entries, each for the textures it names.
//!
//! ```toml
//! [[material]]
//! texture = ["metal*", "+?button"]
//! kind = "metal"
//! roughness = 0.35
//! ```
//!
//! A name matches without regard to case. `*` stands for any characters, `?` for one, `\` takes the
//! next character as it is; a `#` at the beginning stands for the `*` that names of liquids begin with,
//! as in the names of files. What later entries say wins over earlier ones, key by key.

use serde::Deserialize;

/// What an entry may say.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Entry {
    texture: OneOrMany,
    kind: Option<Kind>,
    alpha: Option<f32>,
    ior: Option<f32>,
    tint: Option<[f32; 3]>,
    absorption: Option<[f32; 3]>,
    roughness: Option<f32>,
    roughness_image: Option<String>,
    metallic: Option<f32>,
    specular: Option<f32>,
    normal_image: Option<String>,
    emission: Option<f32>,
    emission_color: Option<[f32; 3]>,
    threshold: Option<f32>,
}

#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(untagged)]
enum OneOrMany {
    One(String),
    Many(Vec<String>),
}

impl Default for OneOrMany {
    fn default() -> Self {
        Self::Many(Vec::new())
    }
}

impl OneOrMany {
    fn iter(&self) -> impl Iterator<Item = &str> {
        match self {
            Self::One(one) => std::slice::from_ref(one),
            Self::Many(many) => many,
        }
        .iter()
        .map(String::as_str)
    }
}

#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default)]
    material: Vec<toml::Spanned<Entry>>,
}

/// What a surface is made of, or drawn as.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A Lambertian reflector.
    Diffuse,
    /// Metal.
    Metal,
    /// Paint under a gloss.
    Gloss,
    /// Light passes through most of it.
    Glass,
    /// Drawn as a liquid: warped, and of one face.
    Liquid,
    /// Holes where the colour index is 255.
    Fence,
    /// Shows the sky.
    Sky,
    /// None of the last three, whatever the name says.
    Solid,
}

/// What all entries together say of one texture; `None` for what they leave open.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rule {
    /// What it is made of: of diffuse, metal, gloss and glass the last one said.
    pub made_of: Option<Kind>,
    /// What it is drawn as: of liquid, fence, sky and solid the last one said.
    pub drawn_as: Option<Kind>,
    /// Coverage, 0 to 1.
    pub alpha: Option<f32>,
    /// Index of refraction, 1 to 4.
    pub ior: Option<f32>,
    /// What passes through a surface, per channel, 0 to 1.
    pub tint: Option<[f32; 3]>,
    /// Absorption behind the front, per channel and world unit.
    pub absorption: Option<[f32; 3]>,
    /// Roughness, 0 to 1.
    pub roughness: Option<f32>,
    /// Game path of a picture whose red scales the roughness.
    pub roughness_image: Option<String>,
    /// Share of metal, 0 to 1.
    pub metallic: Option<f32>,
    /// Strength of the gloss, 0 to 1.
    pub specular: Option<f32>,
    /// Game path of a picture of normals.
    pub normal_image: Option<String>,
    /// Factor of the emission.
    pub emission: Option<f32>,
    /// Factor of the emission by channel, 0 to 1.
    pub emission_color: Option<[f32; 3]>,
    /// Relative luminance from which fullbright texels emit.
    pub threshold: Option<f32>,
    /// The entries that said so: file, line, and the name that matched.
    pub entries: Vec<String>,
}

/// The entries of one text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rules {
    /// With the file and line of each.
    entries: Vec<(String, Entry)>,
}

/// Why a text of materials can't be used: a sentence with the file, the line and the key.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RulesError(String);

impl Rules {
    /// Reads entries; `name` is what messages call the text.
    ///
    /// # Errors
    /// What is no TOML, an unknown key, a value of the wrong type or out of its range.
    pub fn parse(name: &str, text: &str) -> Result<Self, RulesError> {
        let line_of = |at: usize| text.get(..at).unwrap_or(text).lines().count().max(1);
        let document: Document = toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |span| line_of(span.start + 1));
            RulesError(format!("{name}: line {line}: {}", e.message()))
        })?;
        let mut entries = Vec::with_capacity(document.material.len());
        for entry in document.material {
            let line = line_of(entry.span().start + 1);
            let entry = entry.into_inner();
            check(&entry)
                .map_err(|why| RulesError(format!("{name}: the entry at line {line}: {why}")))?;
            entries.push((format!("{name}:{line}"), entry));
        }
        Ok(Self { entries })
    }

    /// The same, with the entries of `other` after these.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.entries.extend(other.entries);
        self
    }

    /// What the entries say of a texture.
    #[must_use]
    pub fn of(&self, texture: &str) -> Rule {
        let texture = texture.to_ascii_lowercase();
        let mut rule = Rule::default();
        for (place, entry) in &self.entries {
            let Some(pattern) = entry.texture.iter().find(|p| matches(p, &texture)) else {
                continue;
            };
            rule.entries.push(format!("{place} {pattern}"));
            match entry.kind {
                Some(kind @ (Kind::Diffuse | Kind::Metal | Kind::Gloss | Kind::Glass)) => {
                    rule.made_of = Some(kind);
                }
                Some(kind) => rule.drawn_as = Some(kind),
                None => {}
            }
            let set = |to: &mut Option<f32>, from: Option<f32>| *to = from.or(*to);
            set(&mut rule.alpha, entry.alpha);
            set(&mut rule.ior, entry.ior);
            set(&mut rule.roughness, entry.roughness);
            set(&mut rule.metallic, entry.metallic);
            set(&mut rule.specular, entry.specular);
            set(&mut rule.emission, entry.emission);
            set(&mut rule.threshold, entry.threshold);
            rule.tint = entry.tint.or(rule.tint);
            rule.absorption = entry.absorption.or(rule.absorption);
            rule.emission_color = entry.emission_color.or(rule.emission_color);
            for (to, from) in [
                (&mut rule.roughness_image, &entry.roughness_image),
                (&mut rule.normal_image, &entry.normal_image),
            ] {
                if from.is_some() {
                    to.clone_from(from);
                }
            }
        }
        rule
    }
}

/// Whether every number of an entry is in its range.
fn check(entry: &Entry) -> Result<(), String> {
    if entry.texture.iter().next().is_none() {
        return Err("it names no texture; give texture = \"NAME\"".to_owned());
    }
    let share = 0.0..=1.0;
    let single = [
        ("alpha", entry.alpha, share.clone()),
        ("ior", entry.ior, 1.0..=4.0),
        ("roughness", entry.roughness, share.clone()),
        ("metallic", entry.metallic, share.clone()),
        ("specular", entry.specular, share.clone()),
        ("emission", entry.emission, 0.0..=1e6),
        ("threshold", entry.threshold, share.clone()),
    ];
    let colours = [
        ("tint", entry.tint, share.clone()),
        ("absorption", entry.absorption, 0.0..=1e3),
        ("emission_color", entry.emission_color, share),
    ];
    let numbers = (single.into_iter())
        .flat_map(|(key, value, range)| value.map(|v| (key, v, range)))
        .chain(colours.into_iter().flat_map(|(key, value, range)| {
            let channels = value.into_iter().flatten();
            channels.map(move |v| (key, v, range.clone()))
        }));
    for (key, value, range) in numbers {
        if !range.contains(&value) {
            let (least, most) = (range.start(), range.end());
            return Err(format!("{key} is {value}, allowed is {least} to {most}"));
        }
    }
    Ok(())
}

/// Whether `name`, in lower case, is what `pattern` describes.
fn matches(pattern: &str, name: &str) -> bool {
    #[derive(Clone, Copy, PartialEq)]
    enum Part {
        Any,
        One,
        Is(char),
    }
    let mut parts = Vec::new();
    let mut chars = pattern.chars().flat_map(char::to_lowercase).enumerate();
    while let Some((at, c)) = chars.next() {
        parts.push(match c {
            '*' => Part::Any,
            '?' => Part::One,
            '\\' => Part::Is(chars.next().map_or('\\', |(_, c)| c)),
            '#' if at == 0 => Part::Is('*'),
            c => Part::Is(c),
        });
    }
    let name: Vec<char> = name.chars().collect();
    // The last `*`, and how much of the name it has taken: one is enough to go back to.
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        match parts.get(p) {
            Some(Part::Any) => {
                star = Some((p, n));
                p += 1;
            }
            Some(&part) if part == Part::One || part == Part::Is(name[n]) => {
                (p, n) = (p + 1, n + 1);
            }
            _ => match star {
                Some((at, taken)) => {
                    star = Some((at, taken + 1));
                    (p, n) = (at + 1, taken + 1);
                }
                None => return false,
            },
        }
    }
    parts[p..].iter().all(|part| *part == Part::Any)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_match_without_case_and_stars_can_be_meant() {
        for (pattern, name, expected) in [
            ("metal*", "metal5_2", true),
            ("METAL*", "metal5_2", true),
            ("metal*", "xmetal", false),
            ("*metal*", "rusty_metal_3", true),
            ("m?tal", "metal", true),
            ("m?tal", "mtal", false),
            (r"\*water*", "*water1", true),
            (r"\*water*", "water1", false),
            ("#water*", "*water1", true),
            ("#water*", "#water1", false),
            ("*", "", true),
            ("", "a", false),
            ("a*b*c", "a_b_b_c", true),
            ("a*b*c", "a_c_b", false),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
        // Many stars do not take long.
        assert!(!matches(&"*a".repeat(40), &"a".repeat(39)));
    }

    #[test]
    fn later_entries_win_key_by_key() {
        let text = r##"
            [[material]]
            texture = "m*"
            kind = "metal"
            roughness = 0.5
            [[material]]
            texture = ["x", "metal?"]
            roughness = 0.2
            alpha = 0.25
            [[material]]
            texture = "{*"
            kind = "fence"
        "##;
        let rules = Rules::parse("a.toml", text).expect("rules");
        let rule = rules.of("METAL1");
        assert_eq!((rule.made_of, rule.drawn_as), (Some(Kind::Metal), None));
        assert_eq!((rule.roughness, rule.alpha), (Some(0.2), Some(0.25)));
        assert_eq!(rule.entries, ["a.toml:2 m*", "a.toml:6 metal?"]);
        assert_eq!(rules.of("{grate").drawn_as, Some(Kind::Fence));
        assert_eq!(rules.of("wood"), Rule::default());
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, expected) in [
            (
                "[[material]]\ntexture = \"a\"\nrougness = 1",
                "a.toml: line 3: unknown field `rougness`",
            ),
            (
                "[[material]]\ntexture = \"a\"\nkind = \"stone\"",
                "a.toml: line 3: unknown variant `stone`",
            ),
            (
                "[[material]]\ntexture = \"a\"\nalpha = \"x\"",
                "a.toml: line 3: invalid type",
            ),
            ("[[material]", "a.toml: line 1: "),
            (
                "\n[[material]]\ntexture = \"a\"\ntint = [0, 2, 0]",
                "a.toml: the entry at line 2: tint is 2, allowed is 0 to 1",
            ),
            (
                "[[material]]\nalpha = 1",
                "a.toml: line 1: missing field `texture`",
            ),
            (
                "[[material]]\ntexture = []",
                "a.toml: the entry at line 1: it names no texture",
            ),
        ] {
            let error = Rules::parse("a.toml", text).expect_err(text).to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
}
