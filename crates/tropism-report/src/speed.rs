//! Figure 3: the speed of the tip over the age of the plant and the time since the lamp was switched on.

use std::collections::BTreeMap;

use super::colour::ColourMap;
use super::plot::{Axis, Plot, number};
use super::{Body, Figure, Plants};
use tropism::lamps::Light;
use tropism::observation::Quality;
use tropism::track::Track;

/// Shifts of this many cm a step and more share the last colour (end of the colour bar of Fig. 3).
const FASTEST: f64 = 0.5;

/// Figure 3: |Δx| of every step as a colour, over the time step and the time since the lit lamp was switched on.
///
/// A cell with data of several tracks shows their mean. Steps next to a held tip have no shift and are left out.
#[must_use]
pub fn speed(tracks: &[Track], plants: Plants) -> Figure {
    let mut cells: BTreeMap<(u32, i64), (f64, f64)> = BTreeMap::new();
    for (step, duration, shift) in tracks.iter().flat_map(swings) {
        let (sum, count) = cells.entry((step, duration)).or_default();
        *sum += shift;
        *count += 1.0;
    }
    let durations = cells.keys().map(|&(_, duration)| duration as f64);
    let longest = durations.fold(80.0, |longest: f64, duration| longest.max(duration.abs()));
    let mut x = Axis::covering(
        "left light \u{2190}  light source duration (steps)  \u{2192} right light",
        (-80.0, 80.0),
        [-longest, longest].into_iter(),
    );
    x.tick = |duration| number(duration.abs());
    let y = Axis::covering("time (steps)", (0.0, 1000.0), cells.keys().map(|&(step, _)| f64::from(step)));
    let mut plot = Plot::new(x, y, (340.0, 380.0), 74.0, 28.0);
    let width = plot.scale();
    let marks: Vec<_> = cells
        .into_iter()
        .map(|((step, duration), (sum, count))| {
            let (x, y) = plot.place(duration as f64, f64::from(step));
            (ColourMap::level(sum / count / FASTEST), (x - width / 2.0, y))
        })
        .collect();
    plot.dashes(ColourMap::Sequential, (width, 9.0), marks.into_iter());
    plot.colour_bar(
        ColourMap::Sequential,
        "|\u{394}x| (cm)",
        &[(0.0, "0"), (0.5, "0.25"), (1.0, "\u{2265} 0.5")],
    );
    Figure {
        number: "3",
        title: "Speed of the tip".to_owned(),
        caption: format!(
            "|\u{394}x| of a step, as a colour, over the time step (vertical) and the time since the lit lamp was switched on \
             (horizontal: left lamp to the left, right lamp to the right). Mean where plants coincide. {}",
            plants.sentence()
        ),
        body: Body::Svg(plot.finish()),
    }
}

/// Step, steps since the lamp was switched on (from 1; negative for the left lamp) and |Δx| of each measured shift.
fn swings(track: &Track) -> Vec<(u32, i64, f64)> {
    let mut swings = Vec::new();
    let mut lit: Option<(Light, u32)> = None;
    for pair in track.samples.windows(2) {
        let (before, after) = (&pair[0], &pair[1]);
        lit = before.light.map(|light| match lit {
            Some((same, since)) if same == light => (light, since),
            _ => (light, before.step),
        });
        let is_measured = before.quality != Quality::Held && after.quality != Quality::Held;
        if let Some((light, since)) = lit.filter(|_| is_measured && after.step - before.step == 1) {
            let duration = i64::from(before.step - since) + 1;
            let signed = if light == Light::LEFT { -duration } else { duration };
            swings.push((before.step, signed, (after.tip.x - before.tip.x).abs()));
        }
    }
    swings
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
        let places: Vec<_> = swings.iter().map(|&(step, duration, _)| (step, duration)).collect();
        assert_eq!(places, [(0, -1), (1, -2), (2, 1)]);
        assert!((swings[1].2 - 0.2).abs() < 1e-12);
    }

    #[test]
    fn figure_3_is_golden() {
        testing::golden(&speed(&testing::swings(3, 60), Plants::Virtual));
    }
}
