//! What a texture's name says about its surface.

/// Kinds of surfaces that a name can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum NameKind {
    /// A tool's: never drawn.
    Tool,
    /// Shows the sky.
    Sky,
    /// Glows brightly.
    Lava,
    /// Glows.
    Teleporter,
    /// Glows weakly.
    Slime,
    /// Water, and every other liquid.
    Water,
    /// Has holes where the colour index is 255.
    Fence,
    /// Any other.
    Plain,
}

/// Names of tool textures. The whole name counts: a fence may well be called `{trigger`.
const TOOLS: [&str; 15] = [
    "clip",
    "skip",
    "*waterskip",
    "*slimeskip",
    "*lavaskip",
    "hint",
    "hintskip",
    "nodraw",
    "caulk",
    "null",
    "bevel",
    "origin",
    "trigger",
    "aaatrigger",
    "areaportal",
];

impl NameKind {
    /// The kind of the texture called `name`, without regard to case.
    pub fn of(name: &str) -> Self {
        let name = name.to_ascii_lowercase();
        let starts = |prefix| name.starts_with(prefix);
        if TOOLS.contains(&name.as_str()) {
            Self::Tool
        } else if starts("sky") {
            Self::Sky
        } else if starts("*lava") {
            Self::Lava
        } else if starts("*tele") {
            Self::Teleporter
        } else if starts("*slime") {
            Self::Slime
        } else if starts("*") {
            Self::Water
        } else if starts("{") {
            Self::Fence
        } else {
            Self::Plain
        }
    }

    /// Whether the surface is a liquid's.
    pub fn is_liquid(self) -> bool {
        matches!(
            self,
            Self::Lava | Self::Teleporter | Self::Slime | Self::Water
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tool_names_count_whole_and_prefixes_without_case() {
        assert_eq!(NameKind::of("TRIGGER"), NameKind::Tool);
        assert_eq!(NameKind::of("{trigger"), NameKind::Fence);
        assert_eq!(NameKind::of("*WaterSkip"), NameKind::Tool);
        assert_eq!(NameKind::of("*waterskip2"), NameKind::Water);
        assert_eq!(NameKind::of("clip2"), NameKind::Plain);
        assert_eq!(NameKind::of("SKY4"), NameKind::Sky);
        assert_eq!(NameKind::of("*LAVA1"), NameKind::Lava);
    }
}
