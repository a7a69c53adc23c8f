//! Figure 1: the set-up, drawn to scale.

use super::plot::{Axis, LEGEND_ROW, Path, Place, Plot, legend_rows};
use super::{Body, Figure, Plants, lamp};
use tropism::geometry::Point;
use tropism::lamps::Layout;

/// What stands around a plant. Places are in cm from the root: x to the right, y up from the soil, z towards the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct SetUp<'a> {
    /// The lamps.
    pub layout: &'a Layout,
    /// Targets of the tip; none in an open-loop experiment.
    pub targets: &'a [Point],
    /// Place of the lens; `None` if it is not known.
    pub camera: Option<[f64; 3]>,
    /// Place of the flash; `None` without one, or if it is not known.
    pub flash: Option<[f64; 3]>,
    /// Minutes from one photograph to the next.
    pub period_min: f64,
}

/// Height of the plant as it is drawn, in cm: that of the paper's last target.
const PLANT_CM: f64 = 13.5;

/// Width at the top and depth of the pot, in cm (section 2.1: the soil stands 12 cm high).
const POT_CM: [f64; 2] = [15.0, 12.0];

/// Width of the panels, in pixels, and space beside them.
const PANEL: f64 = 346.0;
const BESIDE: f64 = 66.0;

/// Figures 1a and 1b: lamps, plant, targets, camera and flash as the camera sees them, and from above.
#[must_use]
pub fn setup(setup: &SetUp<'_>, plants: Plants) -> Vec<Figure> {
    let legend = lamp::legend(setup.layout, "lamp");
    let top = 28.0 + LEGEND_ROW * (legend_rows(&legend, PANEL + BESIDE) - 1) as f64;
    let place_of = match setup.camera {
        Some(_) => "",
        None => " The place of the camera is not known.",
    };
    let (mut front, mut above) = (from_the_front(setup, top), from_above(setup, top));
    let figure = |number, title: &str, caption: String, plot: &mut Plot| {
        plot.legend(&legend);
        let body = Body::Svg(std::mem::replace(plot, Plot::bare((0.0, 0.0), 0.0, 0.0)).finish());
        Figure { number, title: title.to_owned(), caption, data: String::new(), body }
    };
    let minutes = super::plot::number(setup.period_min);
    let targets = if setup.targets.is_empty() { "" } else { " Crosses are the targets of its tip." };
    vec![
        figure(
            "1a",
            "The set-up from the front",
            format!(
                "Every {minutes} minutes the camera takes a photograph, the tip of the plant is measured in it, and a \
                 controller lights one of the lamps.{targets} {}",
                plants.sentence()
            ),
            &mut front,
        ),
        figure(
            "1b",
            "The set-up from above",
            format!("The plant in its pot, and the lamps around it.{place_of} {}", plants.sentence()),
            &mut above,
        ),
    ]
}

fn from_the_front(setup: &SetUp<'_>, top: f64) -> Plot {
    let lamps = || setup.layout.lamps().iter().map(|lamp| lamp.at);
    let others = || setup.flash.into_iter().chain(setup.camera);
    let widest = lamps().map(|at| at[0].abs()).fold(20.0, f64::max);
    let highest = lamps().chain(others()).map(|at| at[1]);
    let x = Axis::covering("x (cm)", (-20.0, 20.0), [-1.1 * widest, 1.1 * widest].into_iter());
    let heights = highest.chain(setup.targets.iter().map(|target| target.y)).map(|height| 1.05 * height);
    let y = Axis::covering("y (cm)", (-POT_CM[1] - 3.0, 20.0), heights);
    let mut plot = Plot::centimetres(x, y, PANEL, BESIDE, top);
    let [rim, depth] = [POT_CM[0] / 2.0, POT_CM[1]];
    let foot = 0.75 * rim;
    plot.line("box", [(-rim, 0.0), (-foot, -depth), (foot, -depth), (rim, 0.0), (-rim, 0.0)].into_iter());
    plot.line("axis", [(-1e3, -depth), (1e3, -depth)].map(|(x, y)| (clamped(&plot, x), y)).into_iter());
    draw_plant(&mut plot);
    for (index, target) in setup.targets.iter().enumerate() {
        let (x, y) = plot.place(target.x, target.y);
        let mut cross = Path::default();
        cross.line(&[(x - 4.0, y - 4.0), (x + 4.0, y + 4.0)]);
        cross.line(&[(x - 4.0, y + 4.0), (x + 4.0, y - 4.0)]);
        plot.path("bold target", &cross);
        plot.text("mark halo target", (x + 8.0, y + 4.0), "start", &(index + 1).to_string());
    }
    draw_lamps(&mut plot, setup.layout, |[x, y, _]| (x, y));
    if let Some([x, y, _]) = setup.flash {
        let place = plot.place(x, y);
        plot.disc("neuron", place, 6.0);
        plot.text("tick", (place.0 + 11.0, place.1 + 4.0), "start", "flash");
    }
    plot
}

fn from_above(setup: &SetUp<'_>, top: f64) -> Plot {
    let places = || setup.layout.lamps().iter().map(|lamp| lamp.at).chain(setup.camera);
    let widest = places().map(|at| at[0].abs()).fold(20.0, f64::max);
    let x = Axis::covering("x (cm)", (-20.0, 20.0), [-1.1 * widest, 1.1 * widest].into_iter());
    // Towards the camera is down, as in the paper's photographs of the tent.
    let depths = places().map(|at| -1.15 * at[2]);
    let mut z =
        Axis::covering("towards the camera (cm)", (-20.0, 12.0), depths.chain([-POT_CM[0], POT_CM[0]]));
    z.tick = |depth| super::plot::number(-depth);
    let mut plot = Plot::centimetres(x, z, PANEL, BESIDE, top);
    let rim = POT_CM[0] / 2.0 * plot.scale();
    let root = plot.place(0.0, 0.0);
    plot.disc("neuron", root, rim);
    plot.disc("fill best", root, 4.0);
    plot.text("tick halo", (root.0, root.1 + 20.0), "middle", "plant");
    draw_lamps(&mut plot, setup.layout, |[x, _, z]| (x, -z));
    if let Some([x, _, z]) = setup.camera {
        draw_camera(&mut plot, x, -z);
    }
    plot
}

/// The camera, with two lines to the edges of what it sees at the plant.
fn draw_camera(plot: &mut Plot, x: f64, depth: f64) {
    let wide = tropism_bean::view::Frame::WIDTH_CM / 2.0;
    for side in [-wide, wide] {
        plot.line("grid dotted", [(x, depth), (x + side, 0.0)].into_iter());
    }
    let (left, upper) = plot.place(x, depth);
    let mut body = Path::default();
    body.line(&[(left - 9.0, upper + 4.0), (left + 9.0, upper + 4.0), (left + 9.0, upper + 16.0)]);
    body.draw((left - 9.0, upper + 16.0));
    body.draw((left - 9.0, upper + 4.0));
    body.line(&[
        (left - 4.0, upper + 4.0),
        (left - 4.0, upper),
        (left + 4.0, upper),
        (left + 4.0, upper + 4.0),
    ]);
    plot.path("axis", &body);
    plot.text("tick", (left + 14.0, upper + 14.0), "start", "camera");
}

/// A stem with leaves, as tall as [`PLANT_CM`].
fn draw_plant(plot: &mut Plot) {
    const POINTS: i32 = 16;
    let lean = |share: f64| 1.6 * share * share - 0.9 * share;
    let stem = (0..=POINTS).map(|index| {
        let share = f64::from(index) / f64::from(POINTS);
        (lean(share), PLANT_CM * share)
    });
    plot.line("bold best", stem);
    for (share, length) in [(0.55, 2.6), (0.55, -2.6), (0.85, 1.6), (0.85, -1.6)] {
        let (x, y) = (lean(share), PLANT_CM * share);
        let leaf =
            [(x, y), (x + 0.6 * length, y + 1.1), (x + length, y + 0.4), (x + 0.6 * length, y - 0.3), (x, y)];
        let mut path = Path::default();
        path.line(&leaf.map(|(x, y)| plot.place(x, y)));
        plot.fill("best", &path);
    }
}

fn draw_lamps(plot: &mut Plot, layout: &Layout, seen: impl Fn([f64; 3]) -> (f64, f64)) {
    for (light, at) in layout.lights().zip(layout.lamps().iter().map(|lamp| lamp.at)) {
        let (x, y) = seen(at);
        let place: Place = plot.place(x, y);
        plot.disc(&format!("fill {}", lamp::class(Some(light))), place, 7.0);
        plot.text("tick halo", (place.0, place.1 + 21.0), "middle", layout.name(Some(light)));
    }
}

/// The x of a place inside the panel.
fn clamped(plot: &Plot, x: f64) -> f64 {
    let (low, high) = plot.ends();
    x.clamp(low.x, high.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn figure_1_is_golden() {
        let layout = Layout::wahby2016();
        let targets = [Point::new(3.0, 6.0), Point::new(-5.0, 9.0), Point::new(-1.0, 13.5)];
        let (camera, flash) = (Some([0.0, 20.0, 74.0]), Some([0.0, 68.0, 0.0]));
        let of_paper = SetUp { layout: &layout, targets: &targets, camera, flash, period_min: 5.0 };
        for figure in setup(&of_paper, Plants::Virtual) {
            testing::golden(&figure);
        }
    }

    #[test]
    fn any_lamps_are_drawn() {
        let layout = Layout::four_sides();
        let any = SetUp { layout: &layout, targets: &[], camera: None, flash: None, period_min: 0.5 };
        let figures = setup(&any, Plants::Real);
        for figure in &figures {
            let Body::Svg(svg) = &figure.body else { panic!() };
            testing::assert_well_formed(svg);
            assert!(svg.contains(">front</text>") && svg.contains("fill lamp4"));
        }
        assert!(figures[0].caption.starts_with("Every 0.5 minutes"));
        assert!(figures[1].caption.contains("The place of the camera is not known."));
    }
}
