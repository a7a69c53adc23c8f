//! Upright poles in a picture: a plant before a pole is separated by its colour, a plant behind one is hidden.
//!
//! In: the silhouettes of poles, and the samples of a picture. Out: the samples that may show a pole, a colour discriminant
//! against the pole, and the pieces of a plant that a pole separates. The one idea: the place of a pole is known, so its colour
//! is learned as background there.
//!
//! Constants were chosen by hand on photographs of the virtual beans 100 to 107 beside poles.

use crate::geometry::path::Place;
use crate::geometry::{Pixel, Point};
use crate::math::vector::{distance, norm};
use crate::photo::Image;
use crate::vision::camera::calibration::Calibration;
use crate::vision::camera::stereo::Strip;
use crate::vision::detect::colour::{ColourStatistics, LinearDiscriminant};
use crate::vision::detect::connected_components::{BoundingBox, ConnectedComponents, REACH};
use crate::vision::detect::curve::PlanePoint;
use crate::vision::raster::plane::Plane;

/// Poles as a camera sees them, in a picture that has shifted.
#[derive(Clone, Debug)]
pub(in crate::vision) struct PoleView {
    calibration: Calibration,
    shift: Pixel,
    strips: Vec<Strip>,
}

impl PoleView {
    /// The poles whose silhouettes are `strips` of the calibrated plane; `None` without any.
    pub(in crate::vision) fn new(calibration: Calibration, shift: Pixel, strips: &[Strip]) -> Option<Self> {
        (!strips.is_empty()).then(|| Self { calibration, shift, strips: strips.to_vec() })
    }

    /// How far inside the nearest pole's silhouette a pixel lies, in cm of the calibrated plane; below 0 outside.
    fn depth(&self, pixel: Pixel) -> f64 {
        let point = self.calibration.point(pixel - self.shift);
        self.strips.iter().map(|strip| strip.depth(point)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The pixel of the same height that lies [`WITHIN_EDGE_CM`] within the nearer edge of the nearest pole.
    fn within_edge(&self, pixel: Pixel) -> Pixel {
        let point = self.calibration.point(pixel - self.shift);
        let nearest = self.strips.iter().max_by(|a, b| a.depth(point).total_cmp(&b.depth(point)));
        let x = nearest.map_or(point.x, |strip| {
            let is_left = point.x < 0.5 * (strip.left + strip.right);
            if is_left { strip.left + WITHIN_EDGE_CM } else { strip.right - WITHIN_EDGE_CM }
        });
        self.calibration.pixel(Point::new(x, point.y)) + self.shift
    }

    /// Width of the widest pole, in cm of the calibrated plane.
    fn width(&self) -> f64 {
        self.strips.iter().map(|strip| strip.right - strip.left).fold(0.0, f64::max)
    }

    /// Whether a pole hides the tip: the stem ends at the pole's edge and leads behind it. `is_seen` says where the picture
    /// shows plant.
    pub(super) fn hides_end(
        &self,
        stem: Option<&[Pixel]>,
        tip: Pixel,
        is_seen: impl Fn(Pixel) -> bool,
    ) -> bool {
        let cm = |length: f64| length * self.calibration.px_per_cm;
        let is_near = |at: Pixel, outside: f64| (-outside..EDGE_INSIDE_CM).contains(&self.depth(at));
        let is_at_edge = |at: Pixel| is_near(at, EDGE_OUTSIDE_CM);
        let Some((&end, rest)) = stem.and_then(<[Pixel]>::split_last) else { return is_at_edge(tip) };
        // A tip far above the stem's end is a leaf's: the stem says nothing of it.
        if end.y - tip.y > cm(LEAF_ABOVE_CM) {
            return is_at_edge(tip);
        }
        let far = rest.iter().rev().find(|at| at.distance(end) >= cm(HEADING_CM)).or(rest.first());
        let Some(far) = far.filter(|far| far.distance(end) > 0.0) else { return is_at_edge(tip) };
        // A stem that is seen inside the silhouette stands before the pole.
        let last = rest.iter().filter(|at| at.distance(end) < cm(HEADING_CM));
        let (mut within, mut count) = (0, 0);
        for at in last.filter(|at| is_near(**at, EDGE_OUTSIDE_CM)) {
            count += 1;
            within += usize::from(is_seen(self.within_edge(*at)));
        }
        if self.depth(*far) > EDGE_INSIDE_CM && is_seen(*far) || within > count / 2 {
            return false;
        }
        // The axis of a stem beside the pole is at least half a stem's width from the edge; a nearer one is cut.
        if is_near(tip, CUT_OUTSIDE_CM) {
            return true;
        }
        let share = cm(AHEAD_CM) / far.distance(end);
        let ahead = far.lerp(end, 1.0 + share);
        (is_at_edge(end) || is_at_edge(tip)) && self.depth(ahead) > 0.0
    }
}

/// Distance outside and inside the silhouette of a pole, in cm, within which a stem that ends there may go on behind it.
const EDGE_OUTSIDE_CM: f64 = 0.3;
const EDGE_INSIDE_CM: f64 = 0.15;

/// Distance inside the silhouette, in cm, at which only a stem before the pole is seen.
const WITHIN_EDGE_CM: f64 = 0.07;

/// Distance of the tip outside the silhouette, in cm, within which the pole cuts it.
const CUT_OUTSIDE_CM: f64 = 0.11;

/// Height of the tip above the end of the stem from which on it is a leaf's, in cm.
const LEAF_ABOVE_CM: f64 = 0.7;

/// Length of the stem's end that gives its direction, and how far it is followed, in cm.
const HEADING_CM: f64 = 0.8;
const AHEAD_CM: f64 = 0.4;

/// Height over which a pole may hide a stem that comes out again, in cm.
const HIDDEN_RISE_CM: f64 = 8.0;

/// Least number of strong samples of a piece of plant beyond a pole.
const MIN_PIECE: usize = 6;

/// Least saturation of plant, as a share of that at its base, in the direction of its hue: lamps and their glare have less.
const MIN_SATURATION: f64 = 0.35;

/// Rounds of learning the pole's colour: each leaves out the samples that the one before called plant.
const ROUNDS: usize = 3;

/// Score from which on a sample within a pole's silhouette is plant: half of the way to the plant's mean.
const NOT_POLE: f64 = 0.5;

/// The samples of a plane that poles may cover.
pub(super) struct PoleMask<'a> {
    pub(super) view: &'a PoleView,
    width: usize,
    /// For each sample, how far inside it lies, in samples; below 0 outside.
    depth: Vec<f32>,
    samples_per_cm: f64,
}

impl<'a> PoleMask<'a> {
    pub(super) fn new(view: &'a PoleView, plane: &Plane) -> Self {
        let samples_per_cm = view.calibration.px_per_cm / plane.step as f64;
        let depth = (0..plane.values.len()).map(|at| {
            let pixel = plane.to_pixel([(at % plane.width) as f64, (at / plane.width) as f64]);
            (view.depth(pixel) * samples_per_cm) as f32
        });
        Self { view, width: plane.width, depth: depth.collect(), samples_per_cm }
    }

    /// Whether a sample may show a pole, or its blurred edge.
    pub(super) fn covers(&self, at: usize) -> bool {
        self.depth[at] > -2.0
    }

    /// Whether a pole hides what is behind a sample, so that a stem may pass there unseen.
    pub(super) fn is_hiding(&self, at: usize) -> bool {
        self.depth[at] > -1.0
    }

    /// `image` with the colour `background` where a pole may be.
    pub(super) fn without_poles(&self, image: &Image, background: [u8; 3]) -> Image {
        let mut image = image.clone();
        for at in (0..self.depth.len()).filter(|&at| self.covers(at)) {
            image.rgb[3 * at..3 * at + 3].copy_from_slice(&background);
        }
        image
    }

    /// The discriminant of `plant` against `background` and the colours of the poles in `image`, where `has_hue` says which
    /// samples have the plant's.
    pub(super) fn learn(
        &self,
        image: &Image,
        has_hue: &[bool],
        plant: &ColourStatistics,
        background: &ColourStatistics,
    ) -> Option<LinearDiscriminant> {
        // Iterative trimming: the plant before a pole must not enter the pole's colour. Where a lamp glares on a pole it has
        // not the plant's hue.
        let samples = || (0..self.depth.len()).filter(|&at| self.covers(at) && has_hue[at]);
        let colour = |at: usize| -> [u8; 3] { core::array::from_fn(|band| image.rgb[3 * at + band]) };
        let mut found: Option<LinearDiscriminant> = None;
        for _ in 0..ROUNDS {
            let mut others = *background;
            let is_pole = |rgb: [u8; 3]| found.is_none_or(|found| found.score(rgb) < NOT_POLE);
            samples().map(colour).filter(|&rgb| is_pole(rgb)).for_each(|rgb| others.add(rgb));
            found = Some(LinearDiscriminant::learn(plant, &others)?);
        }
        found
    }

    /// Which samples of `image` have the hue of `plant`; lamps and their glare have not. The hue is the projection of a
    /// colour's chroma on the plant's.
    pub(super) fn has_hue(image: &Image, plant: &ColourStatistics) -> Vec<bool> {
        let split = |rgb: [f64; 3]| {
            let grey = rgb.iter().sum::<f64>() / 3.0;
            (grey, rgb.map(|value| value - grey))
        };
        let (grey, hue) = split(plant.mean());
        let along = |chroma: [f64; 3]| chroma.iter().zip(hue).map(|(one, other)| one * other).sum::<f64>();
        let least = MIN_SATURATION * along(hue) / grey;
        let pixels = image.rgb.as_chunks::<3>().0.iter();
        pixels
            .map(|rgb| {
                let (grey, chroma) = split(rgb.map(f64::from));
                along(chroma) >= least * grey
            })
            .collect()
    }

    /// Relabels the pieces that a pole may separate from the component `label`, and returns the bounding box of all.
    ///
    /// Pieces are joined from one to the next (single linkage) where both reach a pole and are no farther apart than the
    /// pole is wide and [`HIDDEN_RISE_CM`] high.
    pub(super) fn join_pieces(&self, components: &mut ConnectedComponents, label: u32) -> BoundingBox {
        let edges = self.edges(components);
        let gap = self.samples_per_cm * norm([self.view.width(), HIDDEN_RISE_CM]);
        let mut joined = vec![label];
        let mut next = 0;
        while let Some(&piece) = joined.get(next) {
            next += 1;
            for other in 1..=components.components.len() as u32 {
                if joined.contains(&other) || components.component(other).strong < MIN_PIECE {
                    continue;
                }
                let is_near =
                    |&at: &PlanePoint| edges[other as usize].iter().any(|&edge| distance(at, edge) <= gap);
                if edges[piece as usize].iter().any(is_near) {
                    joined.push(other);
                }
            }
        }
        components.labels.iter_mut().filter(|found| joined.contains(found)).for_each(|found| *found = label);
        let boxes = joined.iter().map(|&piece| components.component(piece).bounds);
        boxes.reduce(BoundingBox::union).unwrap_or(components.component(label).bounds)
    }

    /// Of each label, the samples at the edge of a pole or within it.
    fn edges(&self, components: &ConnectedComponents) -> Vec<Vec<PlanePoint>> {
        let mut edges = vec![Vec::new(); components.components.len() + 1];
        for (at, &label) in components.labels.iter().enumerate() {
            if label != 0 && f64::from(self.depth[at]) > -(REACH as f64) {
                edges[label as usize].push([(at % self.width) as f64, (at / self.width) as f64]);
            }
        }
        edges
    }
}

impl Strip {
    /// How far inside a point lies, in cm; below 0 outside.
    fn depth(&self, point: Point) -> f64 {
        (point.x - self.left).min(self.right - point.x).min(self.top - point.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vision::detect::hysteresis::Evidence;
    use crate::vision::detect::testing::plane;

    /// A pole from x = 2 to 3 cm, 30 cm high, at 10 pixels a cm; the stem base is at (100, 400).
    fn view() -> PoleView {
        let calibration = Calibration::from_scale(Pixel::new(100.0, 400.0), 10.0, 200, 440);
        let strip = Strip { left: 2.0, right: 3.0, top: 30.0 };
        PoleView::new(calibration, Pixel::default(), &[strip]).unwrap()
    }

    /// Pixels a millimetre apart along a line of points in cm.
    fn stem(points: &[(f64, f64)]) -> Vec<Pixel> {
        let pixel = |(x, y): (f64, f64)| Pixel::new(100.0 + 10.0 * x, 400.0 - 10.0 * y);
        let between = |pair: &[(f64, f64)]| {
            let ((x, y), (to_x, to_y)) = (pair[0], pair[1]);
            let steps = (10.0 * crate::math::hypot(to_x - x, to_y - y)).ceil() as usize;
            (0..steps)
                .map(move |step| step as f64 / steps as f64)
                .map(move |share| (x + share * (to_x - x), y + share * (to_y - y)))
                .map(pixel)
                .collect::<Vec<_>>()
        };
        points.windows(2).flat_map(between).collect()
    }

    #[test]
    fn a_stem_that_leads_behind_a_pole_hides_its_tip() {
        let hides = |points: &[(f64, f64)], is_before: bool| {
            let stem = stem(points);
            let is_seen = |at: Pixel| {
                let is_stem = stem.iter().any(|on| on.distance(at) <= 1.7);
                is_stem && (is_before || view().depth(at) < 0.0)
            };
            view().hides_end(Some(&stem), stem[stem.len() - 1], is_seen)
        };
        assert!(hides(&[(0.0, 0.0), (1.95, 4.0)], false), "it ends at the edge and heads inside");
        assert!(!hides(&[(0.0, 0.0), (1.4, 4.0)], false), "it has not come there yet");
        assert!(!hides(&[(0.0, 0.0), (2.5, 4.0)], true), "it is seen before the pole");
        assert!(!hides(&[(0.0, 0.0), (3.15, 6.0)], true), "it was seen before the pole up to its edge");
        assert!(!hides(&[(0.0, 0.0), (1.75, 4.0), (1.75, 8.0)], false), "it stands beside the pole");
        assert!(hides(&[(0.0, 0.0), (1.75, 4.0), (1.92, 8.0)], false), "the pole's edge cuts it");
        assert!(!hides(&[(0.0, 0.0), (1.75, 4.0), (1.95, 8.0)], true), "it lies before the edge");
        assert!(view().hides_end(None, Pixel::new(119.0, 350.0), |_| true), "nothing is known of its stem");
    }

    #[test]
    fn pieces_on_both_sides_of_a_pole_are_one_plant() {
        let plane = plane(200, vec![0.0; 200 * 440]);
        let view = view();
        let mask = PoleMask::new(&view, &plane);
        assert!(
            mask.covers(300 * 200 + 125) && !mask.covers(300 * 200 + 115) && !mask.covers(50 * 200 + 125)
        );
        let mut evidence = vec![Evidence::None; 200 * 440];
        let mut draw = |columns: core::ops::Range<usize>, row: usize| {
            (row..row + 4).for_each(|row| evidence[200 * row..][columns.clone()].fill(Evidence::Strong));
        };
        // The foot up to the left edge, what comes out at the right, what is far from the pole, and what is far above.
        draw(100..119, 380);
        draw(132..150, 350);
        draw(170..180, 350);
        draw(132..150, 150);
        let mut components = ConnectedComponents::label(&evidence, 200, REACH, [100.0, 400.0]);
        let foot = components.nearest(1).unwrap();
        let bounds = mask.join_pieces(&mut components, foot);
        assert_eq!(bounds, BoundingBox { left: 100, right: 149, top: 350, bottom: 383 });
        let label = |x: usize, y: usize| components.labels[200 * y + x];
        assert_eq!((label(140, 351), label(110, 381)), (foot, foot));
        assert!(label(175, 351) != foot && label(140, 151) != foot);
    }

    #[test]
    fn what_has_no_hue_of_the_plant_is_not_it() {
        let image = Image {
            width: 5,
            height: 1,
            rgb: [[190, 195, 90], [90, 95, 45], [255; 3], [120, 190, 250], [110, 83, 55]].concat(),
        };
        let mut plant = ColourStatistics::default();
        plant.add([190, 200, 85]);
        // A pole has it, and is recognised by the discriminant.
        assert_eq!(PoleMask::has_hue(&image, &plant), [true, true, false, false, true]);
    }
}
