//! Tracks for the tests of this crate, and the comparison with golden files.

use super::Figure;
use tropism::geometry::{Point, Polyline};
use tropism::lamps::{Layout, Light};
use tropism::math;
use tropism::observation::{Depth, Quality};
use tropism::track::{Sample, Track};

/// A track from rows of x, y and light: `l` for left, `r` for right, any other letter for dark.
pub(super) fn track(rows: &[(f64, f64, char)]) -> Track {
    let sample = |(step, &(x, y, light)): (usize, &(f64, f64, char))| Sample {
        step: step as u32,
        time_s: step as f64 * 300.0,
        tip: Point::new(x, y),
        stem: None,
        depth: None,
        light: match light {
            'l' => Some(Light::LEFT),
            'r' => Some(Light::RIGHT),
            _ => None,
        },
        levels: None,
        quality: Quality::Measured,
    };
    Track::of(rows.iter().enumerate().map(sample).collect())
}

/// Tips that swing towards a lamp that changes every 20 steps.
pub(super) fn swings(count: usize, steps: usize) -> Vec<Track> {
    let one = |plant: usize| {
        let mut x = 0.0;
        let rows: Vec<(f64, f64, char)> = (0..=steps)
            .map(|step| {
                let is_left = (step / 20 + plant).is_multiple_of(2);
                let row =
                    (x, 4.0 + (0.08 + 0.02 * plant as f64) * step as f64, if is_left { 'l' } else { 'r' });
                let goal = if is_left { -6.0 } else { 5.0 };
                x += (goal - x) * 0.06;
                row
            })
            .collect();
        let mut track = track(&rows);
        track.samples[steps].light = None;
        track
    };
    (0..count).map(one).collect()
}

/// A plant that winds up round the pole of a spiral, with a stem every fourth step.
pub(super) fn winding(steps: u32) -> Track {
    let place = |share: f64| {
        let angle = std::f64::consts::PI * (1.0 + 3.0 * share);
        [1.3 + 1.4 * math::cos(angle), 18.0 * share, -1.4 * math::sin(angle)]
    };
    let sample = |step: u32| {
        let grown = 0.2 + 0.8 * f64::from(step) / f64::from(steps);
        let stem: Vec<[f64; 3]> = (0..10).map(|i| place(grown * f64::from(i) / 9.0)).collect();
        let [x, y, z] = place(grown);
        let is_seen = step.is_multiple_of(4);
        let stem_cm = stem.iter().map(|place| place[2]).filter(|_| is_seen).collect();
        Sample {
            step,
            time_s: 300.0 * f64::from(step),
            tip: Point::new(x, y),
            stem: is_seen.then(|| Polyline(stem.iter().map(|[x, y, _]| Point::new(*x, *y)).collect())),
            depth: Some(Depth { tip_cm: z, stem_cm }),
            light: Light::new((step as usize / 20) % 4),
            levels: None,
            quality: Quality::Simulated,
        }
    };
    Track { layout: Layout::four_sides(), ..Track::of((0..=steps).map(sample).collect()) }
}

/// Compares a figure's file with the one under `tests/golden`; with `TROPISM_BLESS` set, writes it instead.
pub(super) fn golden(figure: &Figure) {
    let (name, bytes) = figure.files().remove(0);
    let text = String::from_utf8(bytes).unwrap();
    assert_well_formed(&text);
    // Golden files leave out the style sheet, which is the same in all figures.
    let (head, rest) = text.split_once("<style>").unwrap();
    let (_, rest) = rest.split_once("</style>").unwrap();
    let text = format!("{head}{rest}").replace("><", ">\n<");
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name);
    if std::env::var_os("TROPISM_BLESS").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let golden = std::fs::read_to_string(&path).unwrap();
    for (line, (found, wanted)) in text.lines().zip(golden.lines()).enumerate() {
        assert_eq!(found, wanted, "{} line {}; bless with TROPISM_BLESS=1", path.display(), line + 1);
    }
    assert_eq!(text.lines().count(), golden.lines().count());
}

/// Asserts that every tag is closed in order, except elements that HTML leaves open.
pub(super) fn assert_well_formed(markup: &str) {
    let mut open: Vec<&str> = Vec::new();
    for piece in markup.split('<').skip(1) {
        let (tag, _) = piece.split_once('>').unwrap_or_else(|| panic!("unclosed tag <{piece}"));
        assert_eq!(tag.matches('"').count() % 2, 0, "odd quotes in <{tag}>");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap_or_default();
        if tag.starts_with('!') || tag.ends_with('/') || matches!(name, "meta" | "img" | "br" | "link") {
            continue;
        }
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "closed out of order");
        } else {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
}
