//! Folders and the files in them that can be opened.

use super::App;
use egui::{ScrollArea, Ui};
use std::path::{Path, PathBuf};

/// What can be opened.
pub const KINDS: [&str; 5] = ["bsp", "dem", "pak", "exr", "png"];
/// More of a folder are not listed.
const MOST: usize = 5000;

/// A folder as it was when it was listed.
#[derive(Clone, Debug, Default)]
pub struct Folder {
    path: PathBuf,
    folders: Vec<String>,
    files: Vec<String>,
}

impl Folder {
    /// Lists a folder: the folders in it, and the files that can be opened, each in order.
    ///
    /// # Errors
    /// When it can't be read.
    pub fn list(path: &Path) -> std::io::Result<Self> {
        let (mut folders, mut files) = (Vec::new(), Vec::new());
        for entry in std::fs::read_dir(path)?.take(MOST).flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            // Links count as what they lead to.
            let is_folder = entry.path().is_dir();
            if is_folder && !name.starts_with('.') {
                folders.push(name);
            } else if !is_folder && can_open(&name) {
                files.push(name);
            }
        }
        folders.sort_by_key(|n| n.to_lowercase());
        files.sort_by_key(|n| n.to_lowercase());
        Ok(Self {
            path: path.to_owned(),
            folders,
            files,
        })
    }
}

fn can_open(name: &str) -> bool {
    let ends = Path::new(name).extension().unwrap_or_default();
    KINDS.iter().any(|kind| ends.eq_ignore_ascii_case(kind))
}

/// Shows the folder; the file that was chosen.
pub(super) fn show(app: &mut App, ui: &mut Ui) -> Option<PathBuf> {
    let mut goes = None;
    let mut chosen = None;
    if app.panels.folder.is_none() {
        let first = app.global.basedir.clone();
        goes = first.or_else(|| std::env::current_dir().ok());
    }
    if let Some(folder) = &app.panels.folder {
        ui.horizontal(|ui| {
            let up = folder.path.parent();
            let button = ui.add_enabled(up.is_some(), egui::Button::new("up"));
            if button.on_hover_text("the folder around this one").clicked() {
                goes = up.map(Path::to_owned);
            }
            if ui.button("again").on_hover_text("lists it anew").clicked() {
                goes = Some(folder.path.clone());
            }
            let text = folder.path.display().to_string();
            ui.add(egui::Label::new(text).truncate());
        });
        ScrollArea::vertical()
            .id_salt("files")
            .max_height(200.0)
            .show(ui, |ui| {
                ui.set_min_width(280.0);
                for name in &folder.folders {
                    if ui.button(format!("{name}/")).clicked() {
                        goes = Some(folder.path.join(name));
                    }
                }
                for name in &folder.files {
                    if ui.button(name).clicked() {
                        chosen = Some(folder.path.join(name));
                    }
                }
                if folder.files.is_empty() {
                    ui.weak("nothing here that can be opened");
                }
            });
    }
    if let Some(path) = goes {
        match Folder::list(&path) {
            Ok(folder) => app.panels.folder = Some(folder),
            Err(error) => {
                (app.notices).error(format!("{}: {error}", path.display()));
                // What was listed stays; without anything there is nothing to look for again.
                app.panels.folder.get_or_insert_default();
            }
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_lists_what_can_be_opened() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["b.BSP", "a.dem", "c.txt", "none"] {
            std::fs::write(dir.path().join(name), "").unwrap();
        }
        for name in ["maps", ".hidden", "Demos"] {
            std::fs::create_dir(dir.path().join(name)).unwrap();
        }
        let folder = Folder::list(dir.path()).unwrap();
        assert_eq!(folder.files, ["a.dem", "b.BSP"]);
        assert_eq!(folder.folders, ["Demos", "maps"]);
        assert!(Folder::list(&dir.path().join("missing")).is_err());
    }
}
