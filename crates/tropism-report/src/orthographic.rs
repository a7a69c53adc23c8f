//! A plant in space by orthographic projection: seen from the front, from the side and from above in one drawing, and as a
//! scene that the reader of a page turns.
//!
//! In: a track whose depth is known, and what stands around the plant. Out: a [`Figure`]. The idea: without perspective one
//! scale holds for the whole picture, so that lengths in the plane of the picture can be read off. The drawing and the
//! script of the page, `orthographic.js`, project by the same law, [`View::project`].
//!
//! # References
//! Carlbom and Paciorek 1978, doi:10.1145/356744.356750 (orthographic and other planar projections).

use std::fmt::Write;

use serde::Serialize;
use tropism::geometry::Point;
use tropism::geometry::space::SpacePoint;
use tropism::lamps::{Layout, Light};
use tropism::math::vector::distance;
use tropism::math::{cos, hypot, sin};
use tropism::obstacle::{Obstacle, Pole, Solid};
use tropism::task::Task;
use tropism::text::plural;
use tropism::track::{Sample, Track};

use super::csv::Cell;
use super::plot::{Axis, LEGEND_ROW, Path, Plot, legend_rows, nice_step, number};
use super::{Body, Figure, Plants, lamp, plot};

/// The script that lets the reader of a page turn its scenes.
pub(super) const SCRIPT: &str = include_str!("orthographic.js");

/// Most samples of a path that are drawn: some 30 bytes each, and a line of the page each. Chosen by hand.
const MAX_SAMPLES: usize = 800;

/// Most stems that are drawn beside the last one; chosen by hand.
const MAX_STEMS: usize = 12;

/// Largest coordinate in cm that is drawn: no plant is as large, and larger ones come from damaged files.
const LARGEST_CM: f64 = 1e4;

/// Height in cm at which the scene of a page ends a pole that leaves the tent; chosen by hand, beyond any plant.
const HIGHEST_POLE_CM: f64 = 200.0;

/// Corners of the outline of a disc.
const CORNERS: u32 = 32;

/// What stands around a plant in space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Targets of the tip, in cm.
    pub targets: Vec<SpacePoint>,
    /// Line on which the stem is to lie, in the plane of the front camera, in cm.
    pub line: Vec<Point>,
    /// Obstacles, drawn in the plane of the front camera, and poles.
    pub solids: Vec<Solid>,
}

impl Surroundings {
    /// Those of a task. Targets of a task in the plane have no depth: they stand in the plane of the front camera.
    #[must_use]
    pub fn of(task: &Task) -> Self {
        let in_plane = || task.targets.iter().copied().map(in_plane).collect();
        Self {
            targets: task.way_in_space().unwrap_or_else(in_plane),
            line: task.line.clone(),
            solids: task.solids(),
        }
    }
}

const fn in_plane(point: Point) -> SpacePoint {
    [point.x, point.y, 0.0]
}

/// A direction from which a scene is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
struct View {
    /// Degrees by which the viewer has walked round the plant to the right: 0 is the place of the front camera.
    azimuth: f64,
    /// Degrees above the horizontal.
    elevation: f64,
}

impl View {
    const FRONT: Self = Self { azimuth: 0.0, elevation: 0.0 };
    /// From the right, as the side camera of the tent sees the plant.
    const SIDE: Self = Self { azimuth: 90.0, elevation: 0.0 };
    const ABOVE: Self = Self { azimuth: 0.0, elevation: 90.0 };

    /// Where `place` lies in the picture: to the right, up and towards the viewer, in cm from the root.
    fn project(self, [x, y, z]: SpacePoint) -> [f64; 3] {
        let (azimuth, elevation) = (self.azimuth.to_radians(), self.elevation.to_radians());
        let near = x * sin(azimuth) + z * cos(azimuth);
        [
            x * cos(azimuth) - z * sin(azimuth),
            y * cos(elevation) - near * sin(elevation),
            y * sin(elevation) + near * cos(elevation),
        ]
    }
}

/// A line in space.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Line {
    /// Class of its colour.
    class: &'static str,
    /// Width of its stroke, 1 to 3 pixels.
    width: u8,
    points: Vec<SpacePoint>,
}

/// A lamp by its direction from the root, seen from above.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Lamp {
    class: &'static str,
    name: String,
    /// x and z of a vector of length 1.
    towards: [f64; 2],
}

/// What a page needs to draw a scene from any direction. Lengths are in cm, rounded to a tenth of a millimetre.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Scene {
    /// The form that the stem is to have, stems, and the path of the tip; what comes later is more important.
    lines: Vec<Line>,
    targets: Vec<SpacePoint>,
    /// Outlines of obstacles.
    outlines: Vec<Vec<SpacePoint>>,
    poles: Vec<Pole>,
    lamps: Vec<Lamp>,
    /// First and last tip.
    ends: [SpacePoint; 2],
    /// The point about which the scene turns, and the radius of a ball that holds it.
    centre: SpacePoint,
    radius: f64,
    /// Half the side of the square of soil that is drawn, and the distance of its lines.
    soil: [f64; 2],
}

fn is_drawn(place: &SpacePoint) -> bool {
    place.iter().all(|value| value.abs() <= LARGEST_CM)
}

fn rounded(place: SpacePoint) -> SpacePoint {
    place.map(|value| (value * 100.0).round() / 100.0)
}

impl Scene {
    /// `None` for a track without a path in space.
    fn of(track: &Track, around: &Surroundings) -> Option<Self> {
        let path = path(track);
        let (first, last) = (path.first()?.points.first()?, path.last()?.points.last()?);
        let ends = [*first, *last];
        let form = around.line.iter().copied().map(in_plane).filter(is_drawn).map(rounded).collect();
        let mut lines = vec![Line { class: "target dashed", width: 2, points: form }];
        lines.extend(stems(track));
        lines.extend(path);
        lines.retain(|line| line.points.len() > 1);
        let poles: Vec<Pole> = around.solids.iter().filter_map(pole).collect();
        let mut scene = Self {
            lines,
            targets: around.targets.iter().copied().filter(is_drawn).map(rounded).collect(),
            outlines: around.solids.iter().filter_map(outline).collect(),
            poles,
            lamps: lamps(&track.layout),
            ends,
            centre: [0.0; 3],
            radius: 0.0,
            soil: [0.0; 2],
        };
        scene.measure();
        Some(scene)
    }

    /// Points that a picture must show. Poles are higher than plants, so their tops may lie outside.
    fn points(&self) -> impl Iterator<Item = SpacePoint> {
        let lines = self.lines.iter().flat_map(|line| &line.points);
        let feet = self.poles.iter().flat_map(|Pole { at: [x, z], radius_cm, .. }| {
            [[x - radius_cm, 0.0, z - radius_cm], [x + radius_cm, 0.0, z + radius_cm]]
        });
        lines.chain(&self.targets).chain(self.outlines.iter().flatten()).copied().chain(feet)
    }

    /// Sets centre, radius and soil.
    fn measure(&mut self) {
        let aside = self.points().map(|[x, _, z]| x.abs().max(z.abs())).fold(3.0, f64::max);
        let step = nice_step(2.0 * aside).max(1.0);
        let half = (aside / step).ceil() * step;
        let top = self.points().map(|place| place[1]).fold(4.0, f64::max);
        self.soil = [half, step];
        self.centre = rounded([0.0, top / 2.0, 0.0]);
        let corner = [half, 0.0, half];
        let far = |place| distance(place, self.centre);
        let radius = self.points().map(far).fold(far(corner), f64::max);
        self.radius = rounded([radius, 0.0, 0.0])[0];
    }

    /// The range of a coordinate of the picture from `view`, at least `least`, up to the next tick.
    fn range(&self, view: View, coordinate: usize, least: (f64, f64)) -> (f64, f64) {
        let values = self.points().map(|place| view.project(place)[coordinate]);
        let axis = Axis::covering("", least, values);
        (axis.from, axis.to)
    }
}

/// The path of the tip, one line for each time under one light; where the depth is not known, the path has a gap.
fn path(track: &Track) -> Vec<Line> {
    let stride = track.samples.len().div_ceil(MAX_SAMPLES).max(1);
    let last = track.samples.len().saturating_sub(1);
    let is_kept = |index: usize| index.is_multiple_of(stride) || index == last;
    let mut lines: Vec<Line> = Vec::new();
    let mut light_before: Option<Option<Light>> = None;
    for (_, sample) in track.samples.iter().enumerate().filter(|(index, _)| is_kept(*index)) {
        let Some(tip) = sample.observation().tip_in_space().filter(is_drawn).map(rounded) else {
            light_before = None;
            continue;
        };
        let line = lines.last_mut().filter(|_| light_before.is_some());
        if let Some(line) = line {
            line.points.push(tip);
        }
        if light_before != Some(sample.light) {
            lines.push(Line { class: lamp::class(sample.light), width: 2, points: vec![tip] });
        }
        light_before = Some(sample.light);
    }
    lines.retain(|line| line.points.len() > 1);
    lines
}

/// Stems at equal distances over the track, and the last one.
fn stems(track: &Track) -> Vec<Line> {
    let known =
        |sample: &Sample| sample.observation().stem_in_space().filter(|stem| stem.iter().all(is_drawn));
    let has_stem = |sample: &&Sample| {
        let (stem, depth) = (sample.stem.as_ref(), sample.depth.as_ref());
        stem.zip(depth).is_some_and(|(stem, depth)| stem.0.len() == depth.stem_cm.len())
    };
    let samples: Vec<&Sample> = track.samples.iter().filter(has_stem).collect();
    let line = |stem: Vec<SpacePoint>, width: u8| {
        let points = stem.into_iter().map(rounded).collect();
        Line { class: "best", width, points }
    };
    let Some((last, earlier)) = samples.split_last() else { return Vec::new() };
    let stride = samples.len().div_ceil(MAX_STEMS).max(1);
    let earlier = earlier.iter().step_by(stride).filter_map(|sample| Some(line(known(sample)?, 1)));
    earlier.chain(known(last).map(|stem| line(stem, 3))).collect()
}

const fn pole(solid: &Solid) -> Option<Pole> {
    match solid {
        Solid::Pole(pole) => {
            let height_cm = pole.height_cm.min(HIGHEST_POLE_CM);
            Some(Pole { height_cm, ..*pole })
        }
        Solid::Plane(_) | Solid::Bar(_) => None,
    }
}

/// The outline of an obstacle in its plane, or the axis of a bar.
fn outline(solid: &Solid) -> Option<Vec<SpacePoint>> {
    let outline: Vec<SpacePoint> = match solid {
        Solid::Plane(obstacle) => corners(obstacle).into_iter().map(in_plane).map(rounded).collect(),
        Solid::Bar(bar) => bar.ends.map(rounded).to_vec(),
        Solid::Pole(_) => return None,
    };
    outline.iter().all(is_drawn).then_some(outline)
}

/// The outline of an obstacle.
fn corners(obstacle: &Obstacle) -> Vec<Point> {
    match *obstacle {
        Obstacle::Disc { centre, radius_cm } => {
            let corner = |index| {
                let turn = f64::from(index) / f64::from(CORNERS) * core::f64::consts::TAU;
                Point::new(centre.x + radius_cm * cos(turn), centre.y + radius_cm * sin(turn))
            };
            (0..=CORNERS).map(corner).collect()
        }
        Obstacle::Box { corners: [one, other] } => {
            let corners =
                [(one.x, one.y), (other.x, one.y), (other.x, other.y), (one.x, other.y), (one.x, one.y)];
            corners.map(|(x, y)| Point::new(x, y)).to_vec()
        }
        Obstacle::Line { ends } => ends.to_vec(),
    }
}

/// The lamps that have a direction: one right above the plant has none.
fn lamps(layout: &Layout) -> Vec<Lamp> {
    let lamp = |light: Light| {
        let [x, _, z] = layout.lamps().get(light.index())?.at;
        let far = hypot(x, z);
        let [x, _, z] = rounded([x / far, 0.0, z / far]);
        let name = layout.name(Some(light)).to_owned();
        (far > 0.0).then_some(Lamp { class: lamp::class(Some(light)), name, towards: [x, z] })
    };
    layout.lights().filter_map(lamp).collect()
}

/// Figure 8 of a run in space, and the same of any track whose depth is known: the path of the tip and the stem from the front,
/// from the side and from above.
///
/// `None` for a track without two tips in space.
#[must_use]
pub fn in_space(
    number: &'static str,
    title: &str,
    track: &Track,
    around: &Surroundings,
    plants: Plants,
) -> Option<Figure> {
    let scene = Scene::of(track, around)?;
    let data = serde_json::to_string(&scene).ok()?;
    Some(Figure {
        number,
        title: title.to_owned(),
        caption: format!(
            "The path of the tip over {}, from the circle, coloured by the lamp that was lit, without perspective. The \
             side is the right one, where the second camera stands; z points to the front camera.{}{}{} {}",
            plural(track.samples.len().saturating_sub(1), "step"),
            if scene.lines.iter().any(|line| line.width == 3) {
                " Green: the stem, the last one thick."
            } else {
                ""
            },
            if around.targets.is_empty() { "" } else { " Crosses are the targets in their order." },
            if around.solids.is_empty() { "" } else { " Grey: what stands beside the plant." },
            plants.sentence()
        ),
        data: csv_of(track),
        body: Body::Space { svg: still(&scene, &track.layout), scene: data },
    })
}

/// The tips in space as CSV, a row a sample; z is empty where it is not known.
fn csv_of(track: &Track) -> String {
    let mut text = "step,time_h,tip_x_cm,tip_y_cm,tip_z_cm,light\n".to_owned();
    for Sample { step, time_s, tip, depth, light, .. } in &track.samples {
        let (hours, light) = (Cell(time_s / 3600.0), track.layout.name(*light));
        let z = Cell(depth.as_ref().map_or(f64::NAN, |depth| depth.tip_cm));
        let _ = writeln!(text, "{step},{hours},{},{},{z},{light}", Cell(tip.x), Cell(tip.y));
    }
    text
}

/// Largest width and height of a panel, and space beside and above it, in pixels; chosen by hand.
const PANEL: f64 = 236.0;
const HIGHEST: f64 = 400.0;
const BESIDE: f64 = 18.0;
const ABOVE: f64 = 46.0;

/// Least range of x and z in cm. Chosen: its ticks are 2 cm apart, so that those of a plant 30 cm high do not overlap.
const ASIDE_CM: (f64, f64) = (-5.0, 5.0);

/// The scene from the front, from the side and from above, in one scale.
fn still(scene: &Scene, layout: &Layout) -> String {
    let x = scene.range(View::FRONT, 0, ASIDE_CM);
    let y = scene.range(View::FRONT, 1, (0.0, 8.0));
    let z = scene.range(View::SIDE, 0, ASIDE_CM);
    let span = |(from, to): (f64, f64)| to - from;
    let scale = (PANEL / span(x).max(span(z))).min(HIGHEST / span(y));
    let legend = lamp::legend(layout, "light");
    let top = ABOVE + LEGEND_ROW * (legend_rows(&legend, PANEL + BESIDE) - 1) as f64;
    let axis = |label: &str, (from, to): (f64, f64), tick| Axis { label: label.to_owned(), from, to, tick };
    // In the picture z points to the left or down.
    let against: fn(f64) -> String = |value| number(-value);
    let panels = [
        ("from the front", View::FRONT, axis("x (cm)", x, number), axis("y (cm)", y, number)),
        ("from the side", View::SIDE, axis("z (cm)", z, against), axis("y (cm)", y, number)),
        ("from above", View::ABOVE, axis("x (cm)", x, number), axis("z (cm)", z, against)),
    ];
    let (mut left, mut height, mut svg) = (0.0, 0.0_f64, String::new());
    for (name, view, across, up) in panels {
        let size = (scale * (across.to - across.from), scale * (up.to - up.from));
        // A narrow panel has as much space as a wide one, so that the page does not draw its letters larger.
        let mut plot = Plot::new(across, up, size, PANEL - size.0 + BESIDE, top);
        draw(&mut plot, scene, view);
        let (edge, _) = plot.place(plot.ends().0.x, 0.0);
        plot.text("label", (edge, 14.0), "start", name);
        if view == View::FRONT {
            plot.legend(&legend);
        }
        let panel = plot.finish();
        let (wide, high) = plot::size(&panel);
        let frame = format!("<svg x=\"{left:.1}\" y=\"0\" width=\"{wide:.1}\" height=\"{high:.1}\"");
        svg += &panel.replacen("<svg", &frame, 1);
        left += wide;
        height = height.max(high);
    }
    format!("<svg class=\"figure\" viewBox=\"0 0 {left:.1} {height:.1}\">{svg}</svg>")
}

/// Draws the scene from `view`.
fn draw(plot: &mut Plot, scene: &Scene, view: View) {
    let is_level = view.elevation == 0.0;
    let seen = |place: SpacePoint| {
        let [right, up, _] = view.project(place);
        (right, up)
    };
    if is_level {
        plot.horizontal_line("axis", 0.0);
    }
    for Pole { at: [x, z], radius_cm, height_cm } in &scene.poles {
        let (across, up) = seen([*x, 0.0, *z]);
        if is_level {
            let top = height_cm.min(plot.ends().1.y);
            let corners = [(-radius_cm, 0.0), (*radius_cm, 0.0), (*radius_cm, top), (-radius_cm, top)];
            fill(plot, corners.map(|(aside, height)| (across + aside, height)));
        } else {
            plot.disc("fill dark faint", plot.place(across, up), radius_cm * plot.scale());
        }
    }
    for outline in &scene.outlines {
        fill(plot, outline.iter().map(|place| seen(*place)));
        plot.line("thin dark", outline.iter().map(|place| seen(*place)));
    }
    for Line { class, width, points } in &scene.lines {
        let width = ["thin", "bold", "key"][usize::from(*width).clamp(1, 3) - 1];
        plot.line(&format!("{width} {class}"), points.iter().map(|place| seen(*place)));
    }
    let (x, y) = seen(scene.ends[0]);
    plot.disc("start", plot.place(x, y), 3.5);
    for (index, target) in (1..).zip(&scene.targets) {
        let (right, up) = seen(*target);
        let (x, y) = plot.place(right, up);
        let mut cross = Path::default();
        cross.line(&[(x - 5.0, y - 5.0), (x + 5.0, y + 5.0)]);
        cross.line(&[(x - 5.0, y + 5.0), (x + 5.0, y - 5.0)]);
        plot.path("bold target", &cross);
        plot.text("mark halo target", (x, y - 10.0), "middle", &format!("{index}"));
    }
}

/// Fills an area whose corners are in units of the axes.
fn fill(plot: &mut Plot, corners: impl IntoIterator<Item = (f64, f64)>) {
    let mut path = Path::default();
    let places: Vec<_> = corners.into_iter().map(|(x, y)| plot.place(x, y)).collect();
    path.line(&places);
    plot.fill("dark faint", &path);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{self, winding};
    use proptest::prelude::*;
    use tropism::task::Task;

    fn scene_of(figure: &Figure) -> serde_json::Value {
        let Body::Space { scene, .. } = &figure.body else { panic!() };
        serde_json::from_str(scene).unwrap()
    }

    fn drawn(track: &Track, around: &Surroundings) -> Figure {
        in_space("8", "A plant round a pole", track, around, Plants::Virtual).unwrap()
    }

    #[test]
    fn figure_8_in_space_is_golden() {
        let mut figure = drawn(&winding(80), &Surroundings::of(&Task::spiral()));
        figure.number = "8-in-space";
        testing::golden(&figure);
    }

    proptest! {
        #[test]
        fn turns_by_right_angles_are_the_views_along_the_axes(x in -9.0..9.0, y in 0.0..30.0, z in -9.0..9.0) {
            let is_near = |one: [f64; 3], other: [f64; 3]| distance(one, other) < 1e-12;
            prop_assert_eq!(View::FRONT.project([x, y, z]), [x, y, z]);
            let side = tropism_bean::view::View::Side.to_camera([x, y, z]);
            prop_assert!(is_near(View::SIDE.project([x, y, z]), side));
            prop_assert!(is_near(View::ABOVE.project([x, y, z]), [x, -z, y]));
        }

        #[test]
        fn turning_keeps_lengths(azimuth in -360.0..360.0, elevation in 0.0..90.0, place in [-9.0..9.0, 0.0..30.0, -9.0..9.0]) {
            let seen = View { azimuth, elevation }.project(place);
            prop_assert!((distance(seen, [0.0; 3]) - distance(place, [0.0; 3])).abs() < 1e-9);
        }
    }

    #[test]
    fn a_scene_has_each_stem_that_is_drawn() {
        let track = winding(40);
        let scene = scene_of(&drawn(&track, &Surroundings::of(&Task::spiral())));
        let stems: Vec<_> =
            scene["lines"].as_array().unwrap().iter().filter(|line| line["class"] == "best").collect();
        // Eleven samples have a stem; the last one is thick.
        assert_eq!(stems.len(), 11);
        for (index, stem) in stems.iter().enumerate() {
            let sample = &track.samples[4 * index];
            let top = rounded(*sample.observation().stem_in_space().unwrap().last().unwrap());
            assert_eq!(stem["points"][9], serde_json::json!(top));
            assert_eq!(stem["width"], if index == 10 { 3 } else { 1 });
        }
        assert_eq!(scene["poles"][0]["radius_cm"], 1.0);
        assert_eq!(scene["lamps"][3]["towards"], serde_json::json!([0.0, -1.0]));
    }

    #[test]
    fn everything_lies_in_the_ball_of_the_scene() {
        let around = Surroundings::of(&Task::space());
        let scene = Scene::of(&winding(60), &around).unwrap();
        assert_eq!(scene.targets, Task::space().way_in_space().unwrap());
        assert!(scene.points().all(|place| distance(place, scene.centre) <= scene.radius + 0.01));
    }

    #[test]
    fn tasks_in_the_plane_are_drawn_in_the_plane() {
        let task = Task {
            obstacles: vec![
                Obstacle::Disc { centre: Point::new(0.0, 8.0), radius_cm: 1.0 },
                Obstacle::Box { corners: [Point::new(2.0, 2.0), Point::new(4.0, 5.0)] },
                Obstacle::Line { ends: [Point::new(-6.0, 6.0), Point::new(-2.0, 6.0)] },
            ],
            ..Task::obstacles()
        };
        let figure = drawn(&winding(60), &Surroundings::of(&task));
        let scene = scene_of(&figure);
        assert_eq!(scene["outlines"].as_array().unwrap().len(), 3);
        assert_eq!(scene["outlines"][1].as_array().unwrap().len(), 5);
        assert!(scene["targets"].as_array().unwrap().iter().all(|target| target[2] == 0.0));
        assert!(figure.caption.contains("Crosses") && figure.caption.contains("Grey"));
    }

    #[test]
    fn a_path_has_gaps_where_its_depth_is_not_known() {
        let mut track = winding(40);
        track.samples.iter_mut().for_each(|sample| sample.light = None);
        for sample in &mut track.samples[10..12] {
            sample.depth = None;
        }
        let lines = path(&track);
        assert_eq!(lines.iter().map(|line| line.points.len()).collect::<Vec<_>>(), [10, 29]);
        let csv = csv_of(&track);
        assert!(csv.lines().nth(11).unwrap().contains(",,dark"), "{csv}");
    }

    #[test]
    fn long_tracks_and_many_lights_make_a_small_scene() {
        let mut track = winding(20_000);
        track.samples.iter_mut().for_each(|sample| sample.light = Light::new(sample.step as usize % 4));
        let Body::Space { svg, scene } = drawn(&track, &Surroundings::default()).body else { panic!() };
        assert!(scene.len() < 100_000 && svg.len() < 200_000, "{} {}", scene.len(), svg.len());
        testing::assert_well_formed(&svg);
    }

    #[test]
    fn tracks_without_a_path_in_space_have_no_such_figure() {
        let around = Surroundings::of(&Task::spiral());
        let mut huge = winding(8);
        huge.samples.iter_mut().for_each(|sample| sample.tip.x = 1e300);
        for track in [Track::default(), testing::swings(1, 20).remove(0), winding(4), huge] {
            let short = Track { samples: track.samples.into_iter().take(1).collect(), ..track };
            assert_eq!(in_space("8", "", &short, &around, Plants::Real), None);
        }
        let plane = testing::swings(1, 20).remove(0);
        assert_eq!(in_space("8", "", &plane, &around, Plants::Real), None);
    }
}
