//! Plots as SVG text.
//!
//! In: numbers. Out: one `<svg>`. Colours are CSS classes, so the same text is legible on a light page, on a dark page and
//! in print. All marks of one colour share one path. Coordinates are rounded to a tenth of a pixel.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::colour::{ColourMap, LEVELS};
use super::thinning;
use tropism::geometry::Point;
use tropism::math::interpolate::lerp;

/// Space for the labels on the left of the panel, in pixels.
const MARGIN_LEFT: f64 = 50.0;
/// Space for the labels below the panel, in pixels.
const MARGIN_BOTTOM: f64 = 44.0;

/// A position in a figure, in pixels from its upper left corner.
pub(super) type Place = (f64, f64);

/// One axis: its label, its ends and the text of its ticks.
pub(super) struct Axis {
    pub(super) label: String,
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) tick: fn(f64) -> String,
}

impl Axis {
    /// An axis from `from` to `to`, extended to the next tick if a value lies outside.
    pub(super) fn covering(
        label: impl Into<String>,
        (from, to): (f64, f64),
        values: impl Iterator<Item = f64>,
    ) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((from, to), |(low, high), value| (value.min(low), value.max(high)));
        let step = nice_step(high - low);
        let from = if low < from { (low / step).floor() * step } else { from };
        let to = if high > to { (high / step).ceil() * step } else { to };
        Self { label: label.into(), from, to, tick: number }
    }

    fn span(&self) -> f64 {
        self.to - self.from
    }

    fn ticks(&self) -> impl Iterator<Item = f64> {
        let step = nice_step(self.span());
        let (first, last) = ((self.from / step - 1e-9).ceil(), (self.to / step + 1e-9).floor());
        let count = if last >= first { (last - first) as usize + 1 } else { 0 };
        (0..count.min(50)).map(move |index| (first + index as f64) * step)
    }
}

/// A number with at most two decimals, no trailing zeros, and a minus sign (U+2212).
pub(super) fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.replace('-', "\u{2212}") }
}

/// The least step of 1, 2 or 5 times a power of ten that divides `span` into at most eight parts.
pub(super) fn nice_step(span: f64) -> f64 {
    if !(span.is_finite() && span > 0.0) {
        return 1.0;
    }
    let mut power = 1.0;
    while power * 8.0 < span {
        power *= 10.0;
    }
    while power * 0.8 >= span {
        power /= 10.0;
    }
    [0.2, 0.5, 1.0].into_iter().map(|share| share * power).find(|step| step * 8.0 >= span).unwrap_or(power)
}

/// SVG path data in tenths of a pixel, with relative coordinates.
#[derive(Default)]
pub(super) struct Path {
    data: String,
    at: (i64, i64),
}

fn tenths(value: f64) -> i64 {
    (value * 10.0).round() as i64
}

impl Path {
    fn number(&mut self, tenths: i64) {
        let needs_space = tenths >= 0 && self.data.ends_with(|last: char| last.is_ascii_digit());
        let space = if needs_space { " " } else { "" };
        let sign = if tenths < 0 { "-" } else { "" };
        let (whole, tenth) = (tenths.unsigned_abs() / 10, tenths.unsigned_abs() % 10);
        let decimal = if tenth == 0 { String::new() } else { format!(".{tenth}") };
        self.data.extend([space, sign, &whole.to_string(), &decimal]);
    }

    /// Begins a subpath at `place`.
    pub(super) fn start(&mut self, place: Place) {
        self.at = (tenths(place.0), tenths(place.1));
        self.data.push('M');
        self.number(self.at.0);
        self.number(self.at.1);
    }

    /// Adds a straight line to `place`.
    pub(super) fn draw(&mut self, place: Place) {
        let to = (tenths(place.0), tenths(place.1));
        self.data.push('l');
        self.number(to.0.saturating_sub(self.at.0));
        self.number(to.1.saturating_sub(self.at.1));
        self.at = to;
    }

    /// Adds a line through `places`, simplified to within 0.2 pixels.
    pub(super) fn line(&mut self, places: &[Place]) {
        for (index, place) in simplified(places, 0.2).into_iter().enumerate() {
            if index == 0 {
                self.start(place);
            } else {
                self.draw(place);
            }
        }
    }
}

/// A line with fewer points, at most `tolerance` away from all `places` (Douglas and Peucker 1973). The time is quadratic in
/// the number of places at worst, so that longer lines are thinned before.
fn simplified(places: &[Place], tolerance: f64) -> Vec<Place> {
    if places.len() < 3 {
        return places.to_vec();
    }
    let mut is_kept = vec![false; places.len()];
    is_kept[0] = true;
    is_kept[places.len() - 1] = true;
    let mut spans = vec![(0, places.len() - 1)];
    while let Some((first, last)) = spans.pop() {
        let away = |&index: &usize| distance_to_segment(places[index], places[first], places[last]);
        let farthest = (first + 1..last).max_by(|a, b| away(a).total_cmp(&away(b)));
        if let Some(middle) = farthest.filter(|middle| away(middle) > tolerance) {
            is_kept[middle] = true;
            spans.push((first, middle));
            spans.push((middle, last));
        }
    }
    places.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept).map(|(&place, _)| place).collect()
}

fn distance_to_segment(place: Place, from: Place, to: Place) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let square = dx * dx + dy * dy;
    let along = ((place.0 - from.0) * dx + (place.1 - from.1) * dy) / square;
    let along = if square > 0.0 { along.clamp(0.0, 1.0) } else { 0.0 };
    let (x, y) = (from.0 + along * dx - place.0, from.1 + along * dy - place.1);
    (x * x + y * y).sqrt()
}

/// A panel to draw on, with or without axes.
pub(super) struct Plot {
    svg: String,
    x: Axis,
    y: Axis,
    width: f64,
    height: f64,
    right: f64,
    top: f64,
}

impl Plot {
    /// An empty panel of `width` x `height` pixels, with `right` pixels beside it and `top` above it.
    pub(super) fn new(x: Axis, y: Axis, (width, height): (f64, f64), right: f64, top: f64) -> Self {
        let mut plot = Self { svg: String::new(), x, y, width, height, right, top };
        plot.axes();
        plot
    }

    /// A panel of `width` x `height` pixels without axes: units are pixels, y up.
    pub(super) fn bare((width, height): (f64, f64), right: f64, top: f64) -> Self {
        let axis = |to| Axis { label: String::new(), from: 0.0, to, tick: number };
        Self { svg: String::new(), x: axis(width), y: axis(height), width, height, right, top }
    }

    /// A panel with the same scale for both axes, unless its height would leave 0.4 to 1.8 times its width.
    pub(super) fn centimetres(x: Axis, y: Axis, width: f64, right: f64, top: f64) -> Self {
        let height = (width / x.span() * y.span()).clamp(0.4 * width, 1.8 * width);
        Self::new(x, y, (width, height), right, top)
    }

    /// The position of a point, given in units of the axes.
    pub(super) fn place(&self, x: f64, y: f64) -> Place {
        (
            MARGIN_LEFT + (x - self.x.from) / self.x.span() * self.width,
            self.top + (self.y.to - y) / self.y.span() * self.height,
        )
    }

    /// The lower left and the upper right corner, in units of the axes.
    pub(super) fn ends(&self) -> (Point, Point) {
        (Point::new(self.x.from, self.y.from), Point::new(self.x.to, self.y.to))
    }

    /// Width and height of the panel, in pixels.
    pub(super) const fn size(&self) -> (f64, f64) {
        (self.width, self.height)
    }

    /// Pixels a unit of x.
    pub(super) fn scale(&self) -> f64 {
        self.width / self.x.span()
    }

    /// Right edge of the panel, in pixels.
    pub(super) const fn right_edge(&self) -> f64 {
        MARGIN_LEFT + self.width
    }

    /// Upper edge of the panel, in pixels.
    pub(super) const fn top_edge(&self) -> f64 {
        self.top
    }

    /// Lower edge of the panel, in pixels.
    pub(super) const fn bottom_edge(&self) -> f64 {
        self.top + self.height
    }

    fn axes(&mut self) {
        let (right, bottom) = (self.right_edge(), self.bottom_edge());
        let mut grid = Path::default();
        let x_ticks: Vec<f64> = self.x.ticks().collect();
        let y_ticks: Vec<f64> = self.y.ticks().collect();
        for &tick in &x_ticks {
            let (at, _) = self.place(tick, 0.0);
            grid.line(&[(at, self.top), (at, bottom)]);
            self.text("tick", (at, bottom + 16.0), "middle", &(self.x.tick)(tick));
        }
        for &tick in &y_ticks {
            let (_, at) = self.place(0.0, tick);
            grid.line(&[(MARGIN_LEFT, at), (right, at)]);
            self.text("tick", (MARGIN_LEFT - 7.0, at + 4.0), "end", &(self.y.tick)(tick));
        }
        self.path("grid", &grid);
        let mut axes = Path::default();
        axes.line(&[(MARGIN_LEFT, self.top), (MARGIN_LEFT, bottom), (right, bottom)]);
        self.path("axis", &axes);
        let (middle, height) = (MARGIN_LEFT + self.width / 2.0, self.top + self.height / 2.0);
        let label = self.x.label.clone();
        self.text("label", (middle, bottom + 37.0), "middle", &label);
        let label = &self.y.label;
        let _ = write!(
            self.svg,
            r#"<text class="label" text-anchor="middle" transform="translate(13 {}) rotate(-90)">{label}</text>"#,
            rounded(height)
        );
    }

    /// Strokes `path`, unless it is empty.
    pub(super) fn path(&mut self, class: &str, path: &Path) {
        if !path.data.is_empty() {
            let _ = write!(self.svg, r#"<path class="stroke {class}" d="{}"/>"#, path.data);
        }
    }

    /// Strokes `path` `width` pixels wide, with a tooltip.
    pub(super) fn path_with_tooltip(&mut self, class: &str, width: f64, path: &Path, tooltip: &str) {
        let (width, data) = (rounded(width), &path.data);
        let _ = write!(
            self.svg,
            r#"<g class="given" stroke-width="{width}"><path class="stroke {class}" d="{data}"><title>{tooltip}</title></path></g>"#
        );
    }

    /// Fills `path`, unless it is empty.
    pub(super) fn fill(&mut self, class: &str, path: &Path) {
        if !path.data.is_empty() {
            let _ = write!(self.svg, r#"<path class="fill {class}" d="{}"/>"#, path.data);
        }
    }

    /// Strokes a line through points given in units of the axes. A long one is thinned.
    pub(super) fn line(&mut self, class: &str, points: impl Iterator<Item = (f64, f64)>) {
        let mut places: Vec<Place> = points.map(|(x, y)| self.place(x, y)).collect();
        if places.len() > thinning::MAX_POINTS {
            places = thinning::drawn(&places).into_iter().map(|index| places[index]).collect();
        }
        let mut path = Path::default();
        path.line(&places);
        self.path(class, &path);
    }

    /// Strokes a horizontal line across the panel at `y`.
    pub(super) fn horizontal_line(&mut self, class: &str, y: f64) {
        let (from, to) = (self.x.from, self.x.to);
        self.line(class, [(from, y), (to, y)].into_iter());
    }

    /// Draws a disc of `radius` pixels.
    pub(super) fn disc(&mut self, class: &str, place: Place, radius: f64) {
        let (x, y, radius) = (rounded(place.0), rounded(place.1), rounded(radius));
        let _ = write!(self.svg, r#"<circle class="{class}" cx="{x}" cy="{y}" r="{radius}"/>"#);
    }

    /// Draws a disc of `radius` pixels with a mark in it and a tooltip.
    pub(super) fn disc_with_tooltip(
        &mut self,
        class: &str,
        place: Place,
        radius: f64,
        mark: &str,
        tooltip: &str,
    ) {
        let _ = write!(self.svg, "<g><title>{tooltip}</title>");
        self.disc(class, place, radius);
        self.text("mark", (place.0, place.1 + 4.0), "middle", mark);
        self.svg.push_str("</g>");
    }

    /// Writes a text at `place`; `anchor` is `start`, `middle` or `end`.
    pub(super) fn text(&mut self, class: &str, place: Place, anchor: &str, text: &str) {
        let (x, y) = (rounded(place.0), rounded(place.1));
        let _ =
            write!(self.svg, r#"<text class="{class}" x="{x}" y="{y}" text-anchor="{anchor}">{text}</text>"#);
    }

    /// Draws the legend above the panel, in [`legend_rows`]: pairs of a class and its name.
    pub(super) fn legend<N: AsRef<str>>(&mut self, entries: &[(&str, N)]) {
        let places = legend_places(entries, self.width + self.right);
        let rows = places.last().map_or(1, |(row, _)| row + 1);
        for ((class, name), (row, x)) in entries.iter().zip(places) {
            let (x, y) = (MARGIN_LEFT + x, self.top - 13.0 - LEGEND_ROW * (rows - 1 - row) as f64);
            let mut dash = Path::default();
            dash.line(&[(x, y), (x + 16.0, y)]);
            self.path(&format!("key {class}"), &dash);
            self.text("tick", (x + 21.0, y + 4.0), "start", name.as_ref());
        }
    }

    /// Draws horizontal dashes of `size` (width, height) in pixels, each given by its level and the middle of its left side.
    pub(super) fn dashes(
        &mut self,
        map: ColourMap,
        size: (f64, f64),
        marks: impl Iterator<Item = (usize, Place)>,
    ) {
        let mut levels: BTreeMap<usize, Path> = BTreeMap::new();
        for (level, (x, y)) in marks {
            let path = levels.entry(level).or_default();
            // A dash that begins where the last one ended extends it.
            if path.at != (tenths(x), tenths(y)) {
                path.start((x, y));
            }
            path.draw((x + size.0, y));
        }
        let _ = write!(self.svg, r#"<g class="dashes" stroke-width="{}">"#, rounded(size.1));
        for (level, path) in levels {
            self.path(&map.class(level), &path);
        }
        self.svg.push_str("</g>");
    }

    /// Draws a colour map beside the panel, with ticks at shares of its height.
    pub(super) fn colour_bar(&mut self, map: ColourMap, title: &str, ticks: &[(f64, &str)]) {
        let (x, height) = (self.right_edge() + 14.0, self.height / LEVELS as f64);
        let bottom = self.bottom_edge();
        let middle = |level: usize| bottom - (level as f64 + 0.5) * height;
        // A little higher than a level, so that no gap shows between two.
        self.dashes(map, (12.0, height + 0.4), (0..LEVELS).map(|level| (level, (x, middle(level)))));
        for (share, text) in ticks {
            let y = lerp(middle(0), middle(LEVELS - 1), *share) + 4.0;
            self.text("tick", (x + 17.0, y), "start", text);
        }
        self.text("label", (x - 2.0, self.top - 9.0), "start", title);
    }

    /// Ends the figure and returns its SVG.
    pub(super) fn finish(self) -> String {
        let (width, height) = (self.right_edge() + self.right, self.bottom_edge() + MARGIN_BOTTOM);
        format!(
            r#"<svg class="figure" viewBox="0 0 {} {}">{}</svg>"#,
            rounded(width),
            rounded(height),
            self.svg
        )
    }
}

/// Height of a row of a legend, in pixels.
pub(super) const LEGEND_ROW: f64 = 16.0;

/// Rows of a legend above a panel with `width` pixels up to the edge of the figure.
pub(super) fn legend_rows<N: AsRef<str>>(entries: &[(&str, N)], width: f64) -> usize {
    legend_places(entries, width).last().map_or(1, |(row, _)| row + 1)
}

/// Row and left end in pixels of each entry of a legend.
fn legend_places<N: AsRef<str>>(entries: &[(&str, N)], width: f64) -> Vec<(usize, f64)> {
    let (mut row, mut x) = (0, 0.0);
    let place = |(_, name): &(&str, N)| {
        // The dash and its distance to the name; letters are 6.4 pixels wide on average.
        let entry = 21.0 + 6.4 * name.as_ref().chars().count() as f64;
        if x > 0.0 && x + entry > width {
            (row, x) = (row + 1, 0.0);
        }
        let at = x;
        x += entry + 14.0;
        (row, at)
    };
    entries.iter().map(place).collect()
}

/// Width and height of a finished figure, in pixels.
pub(super) fn size(svg: &str) -> (f64, f64) {
    let viewed =
        svg.split("viewBox=\"0 0 ").nth(1).and_then(|rest| rest.split('"').next()).unwrap_or_default();
    let number = |text: Option<&str>| text.and_then(|text| text.parse().ok()).unwrap_or_default();
    let mut parts = viewed.split(' ');
    (number(parts.next()), number(parts.next()))
}

fn rounded(value: f64) -> f64 {
    tenths(value) as f64 / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_simplified_line_stays_close(values in prop::collection::vec((0.0..400.0, 0.0..400.0), 0..60)) {
            let line = simplified(&values, 5.0);
            prop_assert_eq!(line.first(), values.first());
            prop_assert_eq!(line.last(), values.last());
            for &place in &values {
                let nearest = line.windows(2).map(|pair| distance_to_segment(place, pair[0], pair[1]));
                prop_assert!(values.len() < 2 || nearest.fold(f64::MAX, f64::min) <= 5.0 + 1e-9);
            }
        }

        #[test]
        fn an_axis_holds_every_value_and_has_few_ticks(
            ends in (-50.0..0.0, 1.0..50.0), values in prop::collection::vec(-1e6..1e6, 0..8)
        ) {
            let axis = Axis::covering("", ends, values.iter().copied());
            for value in values {
                prop_assert!(axis.from <= value && value <= axis.to);
            }
            let ticks: Vec<f64> = axis.ticks().collect();
            prop_assert!((3..=10).contains(&ticks.len()), "{ticks:?}");
        }
    }

    #[test]
    fn steps_are_round() {
        assert_eq!(nice_step(30.0), 5.0);
        assert_eq!(nice_step(1000.0), 200.0);
        assert_eq!(nice_step(16.0), 2.0);
        assert!((nice_step(0.5) - 0.1).abs() < 1e-15);
        assert_eq!(nice_step(0.0), 1.0);
        assert_eq!(nice_step(f64::INFINITY), 1.0);
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [-2.2, -0.0, 15.0, 0.25, 1e-9].map(number),
            ["\u{2212}2.2", "0", "15", "0.25", "0"].map(str::to_owned)
        );
    }

    #[test]
    fn paths_are_relative_and_dense() {
        let mut path = Path::default();
        path.line(&[(1.0, 2.04), (3.5, 1.0), (0.0, 0.0)]);
        assert_eq!(path.data, "M1 2l2.5-1l-3.5-1");
    }
}
