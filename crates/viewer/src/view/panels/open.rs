//! The levels and demos of the search path.

use super::App;
use crate::level::search_path;
use crate::view::stage::SAMPLE_DEMO;
use egui::Ui;
use std::time::Duration;

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    if app.panels.browser.is_none() {
        let levels = search_path(&app.global).map(|search| {
            let files = search.list("maps/").into_iter();
            // Boxes of ammunition and health are levels too, for the engine.
            let names = files.filter_map(|f| {
                let name = f.strip_prefix("maps/")?.strip_suffix(".bsp")?.to_owned();
                (!name.starts_with("b_")).then_some(name)
            });
            let demos = search.list("").into_iter().filter(|f| f.ends_with(".dem"));
            names.chain(demos).collect::<Vec<_>>()
        });
        let levels: Vec<String> = levels.unwrap_or_else(|why| {
            app.notices.error(format!("{why:#}"));
            Vec::new()
        });
        let maps = levels.iter().filter(|n| !n.ends_with(".dem"));
        app.titles.read(&app.global, maps.cloned().collect());
        app.panels.browser = Some(levels);
    }
    let mut wanted = None;
    if ui.button("the sample level").clicked() {
        wanted = Some(None);
    }
    if ui.button("the sample demo").clicked() {
        wanted = Some(Some(SAMPLE_DEMO.to_owned()));
    }
    ui.horizontal(|ui| {
        let button = ui.add_enabled(app.dialog.is_none(), egui::Button::new("a file..."));
        if button.on_hover_text("the system's dialog").clicked() {
            app.ask_for_file();
        }
        ui.toggle_value(&mut app.panels.lists_files, "list")
            .on_hover_text("folders and files in this panel");
    });
    if app.panels.lists_files
        && let Some(path) = super::files::show(app, ui)
    {
        app.open_from_list(&path);
    }
    let recent = app.preferences.recent.clone();
    if !recent.is_empty() {
        ui.collapsing("opened lately", |ui| {
            for name in recent {
                if ui.button(&name).clicked() {
                    wanted = Some(Some(name));
                }
            }
        });
    }
    let field =
        egui::TextEdit::singleline(&mut app.panels.filter).hint_text("part of a name, or a file");
    let typed = ui.add(field.desired_width(280.0));
    if typed.lost_focus() && ui.input(|i| i.key_pressed(egui::Key::Enter)) {
        wanted = Some(Some(app.panels.filter.clone()));
    }
    if app.titles.receive() {
        ui.ctx().request_repaint_after(Duration::from_millis(200));
    }
    let part = app.panels.filter.to_lowercase();
    let levels = app.panels.browser.as_deref().unwrap_or_default();
    egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
        ui.set_width(380.0);
        if levels.is_empty() {
            ui.label("the search path has no levels: give the Quake directory with --basedir, or drop a .pak here");
        }
        let titled = levels.iter().map(|name| (name, app.titles.of(name)));
        let has = |text: &str| text.to_lowercase().contains(&part);
        for (name, title) in titled.filter(|(name, title)| has(name) || has(title)) {
            let clicked = ui.horizontal(|ui| {
                let clicked = ui.button(name).clicked();
                ui.add(egui::Label::new(egui::RichText::new(title).weak()).truncate());
                clicked
            });
            if clicked.inner {
                wanted = Some(Some(if name.ends_with(".dem") {
                    name.clone()
                } else {
                    format!("maps/{name}.bsp")
                }));
            }
        }
    });
    if let Some(level) = wanted {
        app.open(level);
        app.panels.open = false;
    }
}
