//! Figure 3: the speed of the tip over the age of the plant and the time since the lamp was switched on.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::colour::ColourMap;
use super::csv::Cell;
use super::lamp;
use super::plot::{Axis, Plot, number};
use super::{Body, Figure, Plants};
use tropism::lamps::{Layout, Light};
use tropism::track::{PAPER_PERIOD_MIN, SAME_PERIOD, Track};

/// Shifts of this many cm a step and more share the last colour (end of the colour bar of Fig. 3).
const FASTEST: f64 = 0.5;

/// Steps between the strips of two lamps, if there are more than two lamps.
const STRIP_GAP: u32 = 10;

/// Figure 3: |Δx| of every step as a colour, over the time step and the time since the lit lamp was switched on.
///
/// Two lamps extend to the left and to the right, as in the paper; more lamps have a strip each. A cell with data of several
/// tracks shows their mean. Steps next to a tip carried forward have no shift and are left out.
#[must_use]
pub fn speed(tracks: &[Track], plants: Plants) -> Figure {
    let layout = lamp::layout_of(tracks);
    let swings: Vec<Swing> = tracks.iter().flat_map(swings).collect();
    let period = Period(tracks.first().map_or(PAPER_PERIOD_MIN, |track| track.period_min));
    let longest = swings.iter().map(|swing| swing.duration).fold(period.steps(80), u32::max);
    let columns = Columns { layout: &layout, longest, period };
    let mut cells = Cells::new();
    for swing in &swings {
        let (sum, count) = cells.entry((swing.step, columns.column(swing))).or_default();
        *sum += swing.shift;
        *count += 1.0;
    }
    let (cells, joined) = joined(cells, longest);
    let y = Axis::covering(
        format!("time ({})", period.words()),
        (0.0, f64::from(period.steps(1000))),
        cells.keys().map(|&(step, _)| f64::from(step)),
    );
    let mut plot = Plot::new(columns.axis(), y, (340.0, 380.0), 74.0, 28.0);
    let width = plot.scale() * f64::from(joined.map_or(1, |(_, columns)| columns));
    // A joined cell reaches to the right of its column.
    let half = plot.scale() / 2.0;
    let mut data = "step,column,speed_cm\n".to_owned();
    for ((step, column), (sum, count)) in &cells {
        let _ = writeln!(data, "{step},{column},{}", Cell(sum / count));
    }
    let marks: Vec<_> = cells
        .into_iter()
        .map(|((step, column), (sum, count))| {
            let (x, y) = plot.place(column as f64, f64::from(step));
            (ColourMap::level(sum / count / FASTEST), (x - half, y))
        })
        .collect();
    plot.dashes(ColourMap::Sequential, (width, 9.0), marks.into_iter());
    columns.name_strips(&mut plot);
    let ticks = [(0.0, "0"), (0.5, "0.25"), (1.0, "\u{2265} 0.5")];
    plot.colour_bar(ColourMap::Sequential, "|\u{394}x| (cm)", &ticks);
    let joined = joined.map_or_else(String::new, |(steps, columns)| {
        format!(" Cells of {steps} time steps and {columns} steps since the switch are joined.")
    });
    Figure {
        number: "3",
        title: "Speed of the tip".to_owned(),
        caption: format!(
            "|\u{394}x| of a step, as a colour, over the time step (vertical) and the time since the lit lamp was switched on \
             (horizontal: {}). Mean where plants coincide.{joined}{} {}",
            columns.description(),
            period.in_hours(longest),
            plants.sentence()
        ),
        data,
        body: Body::Svg(plot.finish()),
    }
}

/// Sum and number of the shifts of each step and column.
type Cells = BTreeMap<(u32, i64), (f64, f64)>;

/// Cells of a figure, at most: those of more are joined. Chosen: some 20 bytes each, and twice those of a 1000-step experiment
/// with a swing of 20 steps a lamp, over many plants.
const MAX_CELLS: usize = 40_000;

/// Rows and columns of joined cells: a cell is about two pixels high and wide.
const JOINED: (u32, u32) = (190, 160);

/// The cells, and the steps and columns of which each is joined, if there are more than a figure can show.
fn joined(cells: Cells, longest: u32) -> (Cells, Option<(u32, u32)>) {
    if cells.len() <= MAX_CELLS {
        return (cells, None);
    }
    let last = cells.last_key_value().map_or(0, |(&(step, _), _)| step);
    let (low, high) = cells
        .keys()
        .fold((0, 0), |(low, high): (i64, i64), &(_, column)| (low.min(column), high.max(column)));
    let columns = u32::try_from(high - low).unwrap_or(longest);
    let size = (last / JOINED.0 + 1, columns / JOINED.1 + 1);
    let mut joined = Cells::new();
    for ((step, column), (sum, count)) in cells {
        let wide = i64::from(size.1);
        let cell = joined.entry((step / size.0 * size.0, column.div_euclid(wide) * wide)).or_default();
        cell.0 += sum;
        cell.1 += count;
    }
    (joined, Some(size))
}

/// A measured shift of one step.
struct Swing {
    step: u32,
    light: Light,
    /// Steps since the lamp was switched on, from 1.
    duration: u32,
    /// |Δx|, in cm.
    shift: f64,
}

/// The measured shifts of a track.
fn swings(track: &Track) -> Vec<Swing> {
    let mut swings = Vec::new();
    let mut lit: Option<(Light, u32)> = None;
    for pair in track.samples.windows(2) {
        let (before, after) = (&pair[0], &pair[1]);
        lit = before.light.map(|light| match lit {
            Some((same, since)) if same == light => (light, since),
            _ => (light, before.step),
        });
        if let Some((light, since)) = lit.filter(|_| before.shifts_to(after)) {
            let shift = (after.tip.x - before.tip.x).abs();
            swings.push(Swing { step: before.step, light, duration: before.step - since + 1, shift });
        }
    }
    swings
}

/// The horizontal arrangement of lamps and durations.
struct Columns<'l> {
    layout: &'l Layout,
    /// The longest duration, in steps.
    longest: u32,
    period: Period,
}

/// Minutes between two steps. The paper's five are not printed.
#[derive(Clone, Copy)]
struct Period(f64);

impl Period {
    fn is_paper(self) -> bool {
        (self.0 - PAPER_PERIOD_MIN).abs() <= SAME_PERIOD * PAPER_PERIOD_MIN
    }

    /// Steps that take as long as `steps` of the paper's, at least two.
    fn steps(self, steps: u32) -> u32 {
        if self.is_paper() {
            steps
        } else {
            ((f64::from(steps) * PAPER_PERIOD_MIN / self.0).ceil() as u32).max(2)
        }
    }

    fn words(self) -> String {
        match self.0 {
            _ if self.is_paper() => "steps".to_owned(),
            60.0.. => format!("steps of {} h", number(self.0 / 60.0)),
            1.0.. => format!("steps of {} min", number(self.0)),
            minutes => format!("steps of {} s", number(60.0 * minutes)),
        }
    }

    /// A sentence that says how many hours `steps` are.
    fn in_hours(self, steps: u32) -> String {
        if self.is_paper() {
            return String::new();
        }
        format!(" {steps} {} are {:.1} hours.", self.words(), f64::from(steps) * self.0 / 60.0)
    }
}

impl Columns<'_> {
    const fn has_two_sides(&self) -> bool {
        self.layout.len() == 2
    }

    /// Left end of the strip of a lamp.
    fn strip(&self, light: Light) -> i64 {
        light.index() as i64 * i64::from(self.longest + STRIP_GAP)
    }

    fn column(&self, swing: &Swing) -> i64 {
        let duration = i64::from(swing.duration);
        match (self.has_two_sides(), swing.light.index()) {
            (true, 0) => -duration,
            (true, _) => duration,
            (false, _) => self.strip(swing.light) + duration,
        }
    }

    fn axis(&self) -> Axis {
        if !self.has_two_sides() {
            let to = f64::from(self.longest + STRIP_GAP) * self.layout.len() as f64;
            let label = format!("light source duration, {} {} a lamp", self.longest, self.period.words());
            return Axis { label, from: 0.0, to, tick: |_| String::new() };
        }
        let [left, right] = [Light::LEFT, Light::RIGHT].map(|light| self.layout.name(Some(light)));
        let label = format!(
            "{left} light \u{2190}  light source duration ({})  \u{2192} {right} light",
            self.period.words()
        );
        let longest = f64::from(self.longest);
        let usual = f64::from(self.period.steps(80));
        let mut axis = Axis::covering(label, (-usual, usual), [-longest, longest].into_iter());
        axis.tick = |duration| number(duration.abs());
        axis
    }

    /// Writes the name of each lamp below its strip.
    fn name_strips(&self, plot: &mut Plot) {
        if self.has_two_sides() {
            return;
        }
        for light in self.layout.lights() {
            let middle = self.strip(light) as f64 + 0.5 * f64::from(self.longest);
            let place = (plot.place(middle, 0.0).0, plot.bottom_edge() + 16.0);
            let class = format!("mark {}", lamp::class(Some(light)));
            plot.text(&class, place, "middle", self.layout.name(Some(light)));
        }
    }

    fn description(&self) -> String {
        if !self.has_two_sides() {
            return format!("a strip of {} steps a lamp", self.longest);
        }
        let [left, right] = [Light::LEFT, Light::RIGHT].map(|light| self.layout.name(Some(light)));
        format!("{left} lamp to the left, {right} lamp to the right")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn durations_count_from_the_switch() {
        let track = testing::track(&[
            (0.0, 4.0, 'l'),
            (-0.1, 4.0, 'l'),
            (-0.3, 4.0, 'r'),
            (0.0, 4.1, '-'),
            (0.0, 4.1, 'r'),
        ]);
        let swings = swings(&track);
        let layout = Layout::default();
        let columns = Columns { layout: &layout, longest: 80, period: Period(5.0) };
        let places: Vec<_> = swings.iter().map(|swing| (swing.step, columns.column(swing))).collect();
        assert_eq!(places, [(0, -1), (1, -2), (2, 1)]);
        assert!((swings[1].shift - 0.2).abs() < 1e-12);
    }

    #[test]
    fn figure_3_is_golden() {
        testing::golden(&speed(&testing::swings(3, 60), Plants::Virtual));
    }

    #[test]
    fn another_interval_is_told_with_its_hours() {
        let mut tracks = testing::swings(3, 60);
        tracks.iter_mut().for_each(|track| track.period_min = 30.0);
        let figure = speed(&tracks, Plants::Real);
        assert!(figure.caption.contains("steps of 30 min are "), "{}", figure.caption);
        let Body::Svg(svg) = figure.body else { panic!() };
        assert!(svg.contains("time (steps of 30 min)"));
    }

    #[test]
    fn more_lamps_have_a_strip_each() {
        let mut track = testing::track(&[(0.0, 4.0, 'l'), (-0.1, 4.0, 'r'), (-0.3, 4.0, '-')]);
        track.layout = Layout::four_sides();
        track.samples[1].light = Some(Light::BACK);
        let columns = Columns { layout: &track.layout, longest: 80, period: Period(5.0) };
        let places: Vec<_> = swings(&track).iter().map(|swing| columns.column(swing)).collect();
        assert_eq!(places, [1, 271]);
        let Body::Svg(svg) = speed(std::slice::from_ref(&track), Plants::Real).body else { panic!() };
        testing::assert_well_formed(&svg);
        assert!(svg.contains(">front</text>") && svg.contains("mark lamp4"));
    }
}
