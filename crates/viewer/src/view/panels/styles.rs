//! The light styles of the level: how bright each one is, by hand.

use super::App;
use crate::view::entities::styles_of;
use bsp::styles::{Blend, FIRST_SWITCHABLE};
use egui::{Grid, ScrollArea, Slider, Ui};

/// Names that the game's source has for its own styles.
const NAMES: [&str; 12] = [
    "steady",
    "flicker",
    "slow strong pulse",
    "candle",
    "fast strobe",
    "gentle pulse",
    "flicker 2",
    "candle 2",
    "candle 3",
    "slow strobe",
    "fluorescent flicker",
    "slow pulse",
];
/// Brightest of the slider: more can be typed.
const BRIGHT: f64 = 4.0;

pub(super) fn show(app: &mut App, ui: &mut Ui) {
    ui.set_width(330.0);
    let Some(loaded) = app.stage.as_ref().map(|s| s.loaded.clone()) else {
        ui.weak("no level yet");
        return;
    };
    let level = &loaded.level;
    let styles = styles_of(level);
    let set = &mut app.args.picture.scene.styles;
    let at = app.args.picture.scene.at;
    ui.weak("of lamps; what surfaces and sky give has none");
    ScrollArea::vertical().max_height(260.0).show(ui, |ui| {
        Grid::new("styles")
            .num_columns(4)
            .striped(true)
            .show(ui, |ui| {
                for (style, count) in &styles {
                    let style = *style;
                    let usual = f64::from(level.styles.brightness(style, at, Blend::Step));
                    let own = set.iter().rev().find(|(n, _)| *n == style).map(|(_, b)| *b);
                    let name = NAMES.get(usize::from(style)).copied().unwrap_or(
                        if style >= FIRST_SWITCHABLE {
                            "switched"
                        } else {
                            "of the mod"
                        },
                    );
                    ui.label(format!("{style} {name}"))
                        .on_hover_text(format!("{count} lamps"));
                    let mut value = own.unwrap_or(usual);
                    let slider =
                        Slider::new(&mut value, 0.0..=BRIGHT).clamping(egui::SliderClamping::Never);
                    let slider = ui.add(slider.max_decimals(2));
                    slider.clone().on_hover_text(
                        "brightness; 1 shows lightmaps as stored, and a steady light has 1.03",
                    );
                    let mut wanted = own;
                    if slider.changed() {
                        wanted = Some(value.clamp(0.0, crate::cli::MOST_BRIGHTNESS));
                    }
                    ui.horizontal(|ui| {
                        let mut mute = own == Some(0.0);
                        if ui
                            .toggle_value(&mut mute, "M")
                            .on_hover_text("mute it")
                            .changed()
                        {
                            wanted = mute.then_some(0.0);
                        }
                        let others = || styles.iter().map(|(n, _)| *n).filter(|n| *n != style);
                        let is_dark = |n: u16| set.iter().any(|(s, b)| *s == n && *b == 0.0);
                        let mut solo =
                            own != Some(0.0) && styles.len() > 1 && others().all(is_dark);
                        if ui
                            .toggle_value(&mut solo, "S")
                            .on_hover_text("mute all others")
                            .changed()
                        {
                            set.retain(|(n, b)| *n == style || *b != 0.0);
                            if solo {
                                wanted = wanted.filter(|b| *b != 0.0);
                                set.retain(|(n, _)| *n == style);
                                set.extend(others().map(|n| (n, 0.0)));
                            }
                        }
                    });
                    let reset =
                        ui.add_enabled(own.is_some(), egui::Button::new("\u{21ba}").small());
                    if reset.on_hover_text("as the level has it").clicked() {
                        wanted = None;
                    }
                    if wanted != own {
                        set.retain(|(n, _)| *n != style);
                        set.extend(wanted.map(|b| (style, b)));
                    }
                    ui.end_row();
                }
            });
    });
    // One order whatever the clicks were: the same settings are the same command.
    set.sort_by_key(|(n, _)| *n);
    if ui
        .add_enabled(
            !set.is_empty(),
            egui::Button::new("All as the level has them"),
        )
        .clicked()
    {
        set.clear();
    }
}
