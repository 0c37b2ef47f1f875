//! What the window remembers from one time to the next: a TOML file in the platform's directory for
//! such.

use super::app::App;
use super::display::PACES;
use super::panels::{BUDGET_MS, PANELS};
use anyhow::{Context as _, Result};
use egui::ThemePreference;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Levels and demos that are remembered.
const RECENT: usize = 12;
/// No such file is longer.
const MAX_BYTES: u64 = 1 << 20;

/// What is remembered. Anything may be missing.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Preferences {
    /// Levels and demos, the newest first.
    pub recent: Vec<String>,
    /// Where pictures go; the current directory where it is empty.
    pub folder: PathBuf,
    /// Milliseconds of tracing in a frame.
    pub budget_ms: Option<f64>,
    /// When pictures are shown: `vsync`, `mailbox` or `immediate`.
    pub pace: Option<String>,
    /// Frames per second at most.
    pub most_fps: Option<f64>,
    /// Colours of the panels: `dark`, `light` or `system`.
    pub theme: Option<String>,
    /// Size of words, 1 is the system's.
    pub scale: Option<f32>,
    /// Panels that are open, by the words of the bar in small letters, the first opened first.
    pub panels: Option<Vec<String>>,
    /// Panels that were moved: the corner or side that they are placed by, in points.
    pub moved: BTreeMap<String, [f32; 2]>,
    /// Points across and down of the window.
    pub size: Option<[u32; 2]>,
    /// Whether it fills what the display has for windows.
    pub maximized: bool,
    /// Other keys than the usual: from an action (`save`) to a key (`F12`).
    pub keys: BTreeMap<String, String>,
    /// Places by level: x, y, z, pitch, yaw, roll.
    pub places: BTreeMap<String, Vec<[f32; 6]>>,
}

/// Colours with their names; the first is the usual one.
const THEMES: [(ThemePreference, &str); 3] = [
    (ThemePreference::System, "system"),
    (ThemePreference::Dark, "dark"),
    (ThemePreference::Light, "light"),
];

/// A string as TOML has it, which is as JSON has it.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn list<T>(items: &[T], text: impl Fn(&T) -> String) -> String {
    let items: Vec<String> = items.iter().map(text).collect();
    format!("[{}]", items.join(", "))
}

impl Preferences {
    /// The file, where the platform has a directory for it.
    #[must_use]
    pub fn path() -> Option<PathBuf> {
        let var = |name| {
            std::env::var_os(name)
                .filter(|v| !v.is_empty())
                .map(PathBuf::from)
        };
        let folder = if cfg!(windows) {
            var("APPDATA")?
        } else if cfg!(target_os = "macos") {
            var("HOME")?.join("Library/Application Support")
        } else {
            var("XDG_CONFIG_HOME").or_else(|| Some(var("HOME")?.join(".config")))?
        };
        Some(folder.join("runelight").join("window.toml"))
    }

    /// Reads the file; nothing where there is none.
    ///
    /// # Errors
    /// When it can't be read or is wrong.
    pub fn read(path: &Path) -> Result<Self> {
        let name = || path.display().to_string();
        match std::fs::metadata(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(error).with_context(name),
            Ok(meta) if meta.len() > MAX_BYTES => {
                anyhow::bail!("{}: longer than any settings are", path.display())
            }
            Ok(_) => {
                Self::parse(&std::fs::read_to_string(path).with_context(name)?).with_context(name)
            }
        }
    }

    /// Reads what a file holds.
    ///
    /// # Errors
    /// When it is wrong.
    pub fn parse(text: &str) -> Result<Self> {
        Ok(toml::from_str(text)?)
    }

    /// Writes the file, beside its place and then into it.
    ///
    /// # Errors
    /// When that can't be done.
    pub fn write(&self, path: &Path) -> Result<()> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
        let part = path.with_extension("toml.part");
        let name = || path.display().to_string();
        std::fs::write(&part, self.text()).with_context(name)?;
        std::fs::rename(&part, path).with_context(name)
    }

    /// What the file holds.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = format!("recent = {}\n", list(&self.recent, |r| quoted(r)));
        text += &format!("folder = {}\n", quoted(&self.folder.to_string_lossy()));
        if let Some(ms) = self.budget_ms {
            text += &format!("budget_ms = {ms:?}\n");
        }
        for (name, value) in [("pace", &self.pace), ("theme", &self.theme)] {
            if let Some(value) = value {
                text += &format!("{name} = {}\n", quoted(value));
            }
        }
        if let Some(fps) = self.most_fps {
            text += &format!("most_fps = {fps:?}\n");
        }
        if let Some(scale) = self.scale {
            text += &format!("scale = {scale:?}\n");
        }
        if let Some(panels) = &self.panels {
            text += &format!("panels = {}\n", list(panels, |p| quoted(p)));
        }
        if let Some(size) = &self.size {
            text += &format!("size = {}\n", list(size, u32::to_string));
        }
        if self.maximized {
            text += "maximized = true\n";
        }
        text += "\n[moved]\n";
        for (panel, at) in &self.moved {
            text += &format!("{} = {}\n", quoted(panel), list(at, |n| format!("{n:?}")));
        }
        text += "\n[keys]\n";
        for (action, key) in &self.keys {
            text += &format!("{} = {}\n", quoted(action), quoted(key));
        }
        text += "\n[places]\n";
        for (level, places) in &self.places {
            let numbers = |place: &[f32; 6]| list(place, |n| format!("{n:?}"));
            text += &format!("{} = {}\n", quoted(level), list(places, numbers));
        }
        text
    }

    /// Puts a level or demo first among the recent ones.
    pub fn visit(&mut self, name: &str) {
        self.recent.retain(|r| r != name);
        self.recent.insert(0, name.to_owned());
        self.recent.truncate(RECENT);
    }
}

impl App {
    /// Takes what was remembered. What makes no sense is said.
    pub fn prefer(&mut self, preferences: Preferences) {
        for (action, key) in &preferences.keys {
            if let Err(why) = self.bindings.set(action, key) {
                self.notices.error(format!("settings: {why}"));
            }
        }
        if let Some(ms) = preferences.budget_ms.filter(|ms| ms.is_finite()) {
            self.panels.budget_ms = ms.clamp(2.0, 250.0);
        }
        if let Some(name) = &preferences.pace {
            match PACES.iter().find(|p| p.1 == name) {
                Some(pace) => self.display.pace = pace.0,
                None => (self.notices).error(format!("settings: {name} is no pace")),
            }
        }
        let fps = preferences.most_fps.filter(|fps| fps.is_finite());
        self.display.most_fps = fps.map(|fps| fps.clamp(1.0, 1000.0));
        if let Some(name) = &preferences.theme {
            match THEMES.iter().find(|t| t.1 == name) {
                Some(theme) => self.egui().set_theme(theme.0),
                None => (self.notices).error(format!("settings: {name} is no theme")),
            }
        }
        if let Some(scale) = preferences.scale.filter(|s| s.is_finite()) {
            self.egui().set_zoom_factor(scale.clamp(0.5, 3.0));
        }
        if let Some(open) = &preferences.panels {
            PANELS
                .iter()
                .for_each(|p| *(p.is_open)(&mut self.panels) = false);
            for name in open {
                match PANELS.iter().find(|p| p.name() == *name) {
                    Some(panel) => {
                        *(panel.is_open)(&mut self.panels) = true;
                        self.panels.opened();
                    }
                    None => (self.notices).error(format!("settings: {name} is no panel")),
                }
            }
        }
        for panel in PANELS {
            let at = preferences.moved.get(&panel.name());
            if let Some(at) = at.filter(|at| at.iter().all(|n| n.is_finite())) {
                self.panels.moved.insert(panel.word, *at);
            }
        }
        self.folder.clone_from(&preferences.folder);
        self.preferences = preferences;
    }

    /// What is to be remembered.
    #[must_use]
    pub fn preferences(&self) -> Preferences {
        let name = |word: &str| word.to_ascii_lowercase();
        let mut panels = self.panels.clone();
        Preferences {
            budget_ms: Some(self.panels.budget_ms).filter(|ms| *ms != BUDGET_MS),
            pace: (PACES.iter().skip(1).find(|p| p.0 == self.display.pace)).map(|p| p.1.to_owned()),
            most_fps: self.display.most_fps,
            theme: (THEMES.iter().skip(1))
                .find(|t| t.0 == self.egui().options(|o| o.theme_preference))
                .map(|t| t.1.to_owned()),
            scale: Some(self.egui().zoom_factor()).filter(|s| *s != 1.0),
            panels: Some(panels.opened().iter().map(|word| name(word)).collect()),
            moved: (self.panels.moved.iter())
                .map(|(word, at)| (name(word), *at))
                .collect(),
            ..self.preferences.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let mut all = Preferences {
            folder: "C:\\pictures \"new\"\n".into(),
            budget_ms: Some(30.0),
            pace: Some("immediate".into()),
            most_fps: Some(30.0),
            theme: Some("light".into()),
            scale: Some(1.5),
            panels: Some(vec!["places".into()]),
            moved: BTreeMap::from([("look".into(), [-0.5, 1e4])]),
            size: Some([1280, 720]),
            maximized: true,
            ..Preferences::default()
        };
        (0..20).for_each(|i| all.visit(&format!("level {i}.bsp")));
        all.visit("level 15.bsp");
        assert_eq!(
            (all.recent.len(), &*all.recent[0]),
            (RECENT, "level 15.bsp")
        );
        assert_eq!(
            all.recent.iter().filter(|r| *r == "level 15.bsp").count(),
            1
        );
        all.keys.insert("save".into(), "F12".into());
        let place = [1.0, -2.5, 3e-5, 0.0, 1e7, 0.1];
        all.places
            .insert("maps/a b.bsp".into(), vec![place, [0.0; 6]]);
        assert_eq!(Preferences::parse(&all.text()).unwrap(), all);
        let none = Preferences::default();
        assert_eq!(Preferences::parse(&none.text()).unwrap(), none);
        assert_eq!(Preferences::parse("").unwrap(), none);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("deep/window.toml");
        assert_eq!(Preferences::read(&path).unwrap(), none);
        all.write(&path).unwrap();
        assert_eq!(Preferences::read(&path).unwrap(), all);
    }

    #[test]
    fn what_is_wrong_is_a_sentence_that_names_it() {
        let error = |text| Preferences::parse(text).unwrap_err().to_string();
        assert!(error("colour = 3").contains("colour"));
        assert!(error("recent = 3").contains("recent"));
        assert!(error("[places]\na = [[1, 2]]").contains("a ="));
    }
}
