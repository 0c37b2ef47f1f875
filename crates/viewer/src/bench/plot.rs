//! The plots: error over samples and over time for every view, and the speed-ups of all views.
//!
//! Colours are those of Okabe and Ito ("Color Universal Design", 2008), which people of all
//! colour visions can tell apart; every curve has a mark of its own as well.

use super::result::{Bench, Budget, Curve, Point, Speedup, View};
use anyhow::{Result, anyhow};
use plotters::element::{Drawable, PointCollection};
use plotters::prelude::*;
use plotters_backend::{BackendCoord, DrawingErrorKind};
use std::ops::Range;

/// Width and height of a plot.
const SIZE: (u32, u32) = (960, 560);

/// Width of the curves' names, at the right of a plot.
const LEGEND: u32 = 210;

/// Orange, sky blue, bluish green, blue, vermillion, reddish purple, black, yellow.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0xe6, 0x9f, 0x00),
    RGBColor(0x56, 0xb4, 0xe9),
    RGBColor(0x00, 0x9e, 0x73),
    RGBColor(0x00, 0x72, 0xb2),
    RGBColor(0xd5, 0x5e, 0x00),
    RGBColor(0xcc, 0x79, 0xa7),
    RGBColor(0x00, 0x00, 0x00),
    RGBColor(0xf0, 0xe4, 0x42),
];

const GREY: RGBColor = RGBColor(0x70, 0x70, 0x70);

/// What a plot shows along x.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Over {
    Samples,
    Time,
}

impl Over {
    fn of(self, point: &Point) -> f64 {
        match self {
            Self::Samples => point.samples,
            Self::Time => point.seconds.value,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Time => "time",
        }
    }
}

/// All plots, each with its file name.
///
/// # Errors
/// When one cannot be drawn.
pub fn all(bench: &Bench) -> Result<Vec<(String, String)>> {
    let mut plots = Vec::new();
    for (number, view) in bench.views.iter().enumerate() {
        for over in [Over::Samples, Over::Time] {
            if let Some(svg) = error_plot(view, over, &bench.device)? {
                let name = format!("{number:02}-{}-{}.svg", plain(&view.level), over.name());
                plots.push((name, svg));
            }
        }
    }
    if let Some(svg) = speedup_plot(bench)? {
        plots.push(("speedup.svg".to_owned(), svg));
    }
    Ok(plots)
}

fn plain(text: &str) -> String {
    (text.chars())
        .map(|c| {
            if c.is_ascii_alphanumeric() || "-_".contains(c) {
                c
            } else {
                '_'
            }
        })
        .take(64)
        .collect()
}

fn title(view: &View) -> String {
    format!(
        "{}, {}, {}x{}, depth {}",
        view.level, view.camera, view.width, view.height, view.depth
    )
}

/// The points of a curve that can be drawn with logarithms, in the order of x.
fn drawn(curve: &Curve, over: Over) -> Vec<&Point> {
    let mut points: Vec<&Point> = (curve.points.iter())
        // Over samples, a budget in seconds is somewhere between the others and says nothing new.
        .filter(|p| over == Over::Time || matches!(p.budget, Budget::Samples(_)))
        .filter(|p| p.relmse().value > 0.0 && over.of(p) > 0.0)
        .collect();
    points.sort_by(|a, b| over.of(a).total_cmp(&over.of(b)));
    points
}

fn error_plot(view: &View, over: Over, device: &str) -> Result<Option<String>> {
    let mut xs = Vec::new();
    let mut ys = vec![];
    for point in view.curves.iter().flat_map(|c| drawn(c, over)) {
        xs.push(over.of(point));
        let e = point.relmse();
        ys.extend(
            [e.value, e.low, e.high]
                .into_iter()
                .filter(|v| *v > e.value / 10.0),
        );
    }
    if xs.is_empty() {
        return Ok(None);
    }
    // The reference's own error belongs into the picture where it is not far below it.
    let own = view.reference.relmse;
    let lowest = ys.iter().copied().fold(f64::INFINITY, f64::min);
    if own > lowest / 100.0 {
        ys.push(own);
    }
    let (x_range, y_range) = (around(&xs), around(&ys));
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE).map_err(drawing)?;
        let (area, beside) = area.split_horizontally(SIZE.0 - LEGEND);
        let mut names = Vec::new();
        let mut chart = ChartBuilder::on(&area)
            .caption(title(view), ("sans-serif", 22))
            .margin(14)
            .x_label_area_size(48)
            .y_label_area_size(78)
            .build_cartesian_2d(x_range.clone().log_scale(), y_range.clone().log_scale())
            .map_err(drawing)?;
        let x_name = match over {
            Over::Samples => "samples per pixel".to_owned(),
            Over::Time => format!("seconds of rendering ({device})"),
        };
        chart
            .configure_mesh()
            .x_desc(x_name)
            .y_desc("relMSE, 95 % intervals")
            .x_label_formatter(&|v| number(*v))
            .y_label_formatter(&|v| number(*v))
            .label_style(("sans-serif", 15))
            .axis_desc_style(("sans-serif", 17))
            .light_line_style(RGBColor(0xf2, 0xf2, 0xf2))
            .bold_line_style(RGBColor(0xdd, 0xdd, 0xdd))
            .draw()
            .map_err(drawing)?;
        for (number, curve) in view.curves.iter().enumerate() {
            let colour = COLOURS[number % COLOURS.len()];
            let points = drawn(curve, over);
            let place = |p: &&Point| (over.of(p), p.relmse().value);
            chart
                .draw_series(LineSeries::new(
                    points.iter().map(place),
                    colour.stroke_width(2),
                ))
                .map_err(drawing)?;
            chart
                .draw_series(points.iter().filter_map(|p| {
                    let e = p.relmse();
                    let (low, high) = (e.low.max(y_range.start), e.high.min(y_range.end));
                    (low < high).then(|| {
                        let ends = vec![(over.of(p), low), (over.of(p), high)];
                        PathElement::new(ends, colour.stroke_width(1))
                    })
                }))
                .map_err(drawing)?;
            let marks = points.iter().map(|p| mark(number, place(p), colour));
            chart.draw_series(marks).map_err(drawing)?;
            names.push((curve.name(), Sign::Curve(number)));
        }
        if own >= y_range.start && own <= y_range.end {
            let dashes = DashedLineSeries::new(
                [(x_range.start, own), (x_range.end, own)],
                8,
                6,
                GREY.stroke_width(1),
            );
            chart.draw_series(dashes).map_err(drawing)?;
            names.push(("reference (subtracted)".to_owned(), Sign::Dashes));
        }
        if over == Over::Samples {
            // A line that falls as 1/N, for the eye.
            let top = ys.iter().copied().fold(0.0, f64::max);
            let (a, b) = (
                x_range.start,
                x_range.end.min(x_range.start * top / y_range.start),
            );
            let line = [(a, top), (b, top * a / b)];
            chart
                .draw_series(LineSeries::new(line, GREY.mix(0.5)))
                .map_err(drawing)?;
            names.push(("1/N".to_owned(), Sign::Line(0.5)));
        }
        legend(&beside, &names)?;
        area.present().map_err(drawing)?;
    }
    Ok(Some(svg))
}

/// What stands before a name.
#[derive(Clone, Copy)]
enum Sign {
    /// The mark of a curve.
    Curve(usize),
    /// A line of this strength.
    Line(f64),
    /// A dashed line.
    Dashes,
}

/// Writes the names of what is drawn, one below the other.
fn legend<DB: DrawingBackend>(
    area: &DrawingArea<DB, plotters::coord::Shift>,
    names: &[(String, Sign)],
) -> Result<()> {
    for (row, (name, sign)) in names.iter().enumerate() {
        let y = 60 + 26 * row as i32;
        let line = |a: i32, b: i32, strength: f64| {
            PathElement::new(vec![(a, y), (b, y)], GREY.mix(strength))
        };
        match *sign {
            Sign::Curve(number) => {
                let colour = COLOURS[number % COLOURS.len()];
                area.draw(&PathElement::new(
                    vec![(4, y), (28, y)],
                    colour.stroke_width(2),
                ))
                .map_err(drawing)?;
                area.draw(&mark(number, (16, y), colour)).map_err(drawing)?;
            }
            Sign::Line(strength) => area.draw(&line(4, 28, strength)).map_err(drawing)?,
            Sign::Dashes => {
                for x in [4, 18] {
                    area.draw(&line(x, x + 9, 1.0)).map_err(drawing)?;
                }
            }
        }
        let font = ("sans-serif", 16).into_font();
        area.draw(&Text::new(name.clone(), (36, y - 8), font))
            .map_err(drawing)?;
    }
    Ok(())
}

/// A curve's mark at a place: circle, square, triangle, cross by the curve's number.
struct Mark<C> {
    at: C,
    number: usize,
    colour: RGBColor,
}

fn mark<C>(number: usize, at: C, colour: RGBColor) -> Mark<C> {
    Mark { at, number, colour }
}

impl<'a, C> PointCollection<'a, C> for &'a Mark<C> {
    type Point = &'a C;
    type IntoIter = std::iter::Once<&'a C>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.at)
    }
}

impl<C, DB: DrawingBackend> Drawable<DB> for Mark<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut places: I,
        backend: &mut DB,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<DB::ErrorType>> {
        const HALF: i32 = 5;
        let Some((x, y)) = places.next() else {
            return Ok(());
        };
        let filled = self.colour.filled();
        let line = self.colour.stroke_width(3);
        match self.number % 4 {
            0 => backend.draw_circle((x, y), HALF as u32, &filled, true),
            1 => backend.draw_rect((x - HALF, y - HALF), (x + HALF, y + HALF), &filled, true),
            2 => {
                let corners = [(x - 6, y + HALF), (x + 6, y + HALF), (x, y - 6)];
                backend.fill_polygon(corners, &filled)
            }
            _ => {
                let (a, b) = (x - HALF, x + HALF);
                backend.draw_path([(a, y - HALF), (b, y + HALF)], &line)?;
                backend.draw_path([(a, y + HALF), (b, y - HALF)], &line)
            }
        }
    }
}

/// The speed-up that stands for a curve in the summary: at its smallest error that naive reached,
/// else at its largest budget.
#[must_use]
pub fn summary(curve: &Curve) -> Option<Speedup> {
    let of = |wanted: fn(&Speedup) -> bool| {
        (curve.points.iter().rev())
            .filter_map(|p| p.speedup)
            .find(|s| wanted(s) && s.factor.value.is_finite())
    };
    of(|s| !s.beyond_curve).or_else(|| of(|_| true))
}

fn speedup_plot(bench: &Bench) -> Result<Option<String>> {
    let mut names: Vec<String> = Vec::new();
    let mut rows: Vec<(String, Vec<(usize, Speedup)>)> = Vec::new();
    for (v, view) in bench.views.iter().enumerate() {
        let mut found = Vec::new();
        for curve in view.curves.iter().filter(|c| c.estimator != "naive") {
            let Some(speedup) = summary(curve) else {
                continue;
            };
            let name = curve.name();
            let number = names.iter().position(|n| *n == name).unwrap_or_else(|| {
                names.push(name);
                names.len() - 1
            });
            found.push((number, speedup));
        }
        if !found.is_empty() {
            rows.push((format!("{v:02} {} {}", view.level, view.camera), found));
        }
    }
    if rows.is_empty() {
        return Ok(None);
    }
    let mut xs = vec![1.0];
    for (_, speedup) in rows.iter().flat_map(|r| &r.1) {
        let f = speedup.factor;
        xs.extend(
            [f.value, f.low, f.high]
                .into_iter()
                .filter(|v| v.is_finite() && *v > f.value / 10.0 && *v < f.value * 10.0),
        );
    }
    let x_range = around(&xs);
    let count = rows.len();
    let height = (150 + 56 * count as u32).max(240);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (SIZE.0, height)).into_drawing_area();
        area.fill(&WHITE).map_err(drawing)?;
        let (area, beside) = area.split_horizontally(SIZE.0 - LEGEND);
        let caption = format!("Speed-up over naive at equal error ({})", bench.device);
        let mut chart = ChartBuilder::on(&area)
            .caption(caption, ("sans-serif", 22))
            .margin(14)
            .x_label_area_size(48)
            .y_label_area_size(250)
            .build_cartesian_2d(x_range.clone().log_scale(), -0.5..count as f64 - 0.5)
            .map_err(drawing)?;
        let place = |row: usize| (count - 1 - row) as f64;
        let label = |y: &f64| {
            let near = (y - y.round()).abs() < 1e-6;
            let row = count as i64 - 1 - y.round() as i64;
            (usize::try_from(row).ok())
                .and_then(|row| rows.get(row))
                .filter(|_| near)
                .map_or(String::new(), |r| r.0.clone())
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .x_desc("times faster; hollow ring: naive's curve continued as 1/N")
            .x_label_formatter(&|v| number(*v))
            .y_labels(2 * count + 1)
            .y_label_formatter(&label)
            .label_style(("sans-serif", 15))
            .axis_desc_style(("sans-serif", 17))
            .light_line_style(RGBColor(0xf2, 0xf2, 0xf2))
            .bold_line_style(RGBColor(0xdd, 0xdd, 0xdd))
            .draw()
            .map_err(drawing)?;
        let line = [(1.0, -0.5), (1.0, count as f64 - 0.5)];
        chart
            .draw_series(LineSeries::new(line, GREY))
            .map_err(drawing)?;
        for number in 0..names.len() {
            // Colours as in the plots of a view, where naive has the first.
            let colour = COLOURS[(number + 1) % COLOURS.len()];
            // Marks of one view stand above each other.
            let shift = 0.3 - 0.6 * number as f64 / (names.len().max(2) - 1) as f64;
            let mine: Vec<(f64, Speedup)> = (rows.iter().enumerate())
                .flat_map(|(row, r)| {
                    (r.1.iter().filter(|(n, _)| *n == number)).map(move |(_, s)| (row, *s))
                })
                .map(|(row, s)| (place(row) + shift, s))
                .collect();
            chart
                .draw_series(mine.iter().filter_map(|(y, s)| {
                    let low = s.factor.low.max(x_range.start);
                    let high = s.factor.high.min(x_range.end);
                    (low < high).then(|| {
                        PathElement::new(vec![(low, *y), (high, *y)], colour.stroke_width(2))
                    })
                }))
                .map_err(drawing)?;
            chart
                .draw_series(
                    (mine.iter().filter(|(_, s)| s.beyond_curve))
                        .map(|(y, s)| Circle::new((s.factor.value, *y), 9, GREY.stroke_width(1))),
                )
                .map_err(drawing)?;
            chart
                .draw_series(
                    (mine.iter()).map(|(y, s)| mark(number + 1, (s.factor.value, *y), colour)),
                )
                .map_err(drawing)?;
        }
        let names: Vec<(String, Sign)> = (names.into_iter().enumerate())
            .map(|(number, name)| (name, Sign::Curve(number + 1)))
            .collect();
        legend(&beside, &names)?;
        area.present().map_err(drawing)?;
    }
    Ok(Some(svg))
}

/// A range that holds all of `values` (positive) with some room around it in logarithms.
fn around(values: &[f64]) -> Range<f64> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(0.0, f64::max);
    low / 1.5..high * 1.5
}

/// A label of a logarithmic axis; only 1, 2 and 5 of a decade have one, the others would run into
/// each other.
fn number(value: f64) -> String {
    let decade = 10f64.powf((value.log10() + 1e-9).floor());
    let digit = value / decade;
    if ![1.0, 2.0, 5.0].iter().any(|d| (digit - d).abs() < 1e-6) {
        String::new()
    } else if (1e-3..1e6).contains(&value) {
        // Powers of ten come as 0.30000000000000004.
        let text = format!("{value:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.0e}")
    }
}

fn drawing(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("a plot cannot be drawn: {error}")
}
