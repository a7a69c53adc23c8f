//! Detection in mode `robust`: the component at the stem base, by a colour that is learned from the picture itself.
//!
//! In: a picture, a crop, and where the stem leaves the soil. Out: the plant's highest point, to a fraction of a
//! sample, its midline, and whether its tip may be occluded. The one idea: what is bright and nearest to the base is
//! plant; its colour separates the rest of the plant from pot, cloth and glare; and only the component that is
//! connected to the base counts.
//!
//! The chain: [`Levels`] and a seed component, Fisher's [`LinearDiscriminant`], double threshold and [connected
//! components](ConnectedComponents), [highest edge](tip::highest_edge), [midline], tests for occlusion.

use crate::geometry::{Pixel, Region, path};
use crate::math::vector::distance;
use crate::photo::Image;
use crate::vision::config::VisionConfig;
use crate::vision::detect::colour::{ColourStatistics, LinearDiscriminant};
use crate::vision::detect::connected_components::{BoundingBox, ConnectedComponents, REACH};
use crate::vision::detect::curve::PlanePoint;
use crate::vision::detect::detection::{Detection, Edge};
use crate::vision::detect::hysteresis::{Evidence, double_threshold};
use crate::vision::detect::occlusion::{has_glare_above, is_in_shadow};
use crate::vision::detect::occupancy::OccupancyGrid;
use crate::vision::detect::pole::{PoleMask, PoleView};
use crate::vision::detect::second_foot::has_second_foot;
use crate::vision::detect::silhouette::{is_silhouette, silhouette_midline};
use crate::vision::detect::{midline, tip};
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::{LUMA, Plane};
use crate::vision::raster::source::{PixelSource, aligned_region};

/// Stride, in columns and rows, at which background pixels are taken to learn their colour. Chosen by hand, for
/// speed.
const BACKGROUND_STRIDE: usize = 3;

/// Low threshold, in standard deviations of the background's score. Chosen by hand.
const LOW_THRESHOLD: f64 = 4.0;

/// Greatest distance from the base at which the plant may begin, as a share of the crop's height: its foot may lie in
/// the shade. Chosen by hand.
const BASE_RADIUS: f64 = 0.15;

/// Radius around the base within which the plant's colour is learned, as a share of the crop's height: the stem must
/// be there. Chosen by hand.
const LEARNING_RADIUS: f64 = 0.12;

/// Side length of a cell of the occupancy grid, in samples. Chosen by hand.
const CELL_SAMPLES: usize = 2;

/// Detects the plant at `base`; without one, the largest plant.
pub(super) fn detect(
    image: &dyn PixelSource,
    crop: Region,
    base: Option<Pixel>,
    config: &VisionConfig,
    poles: Option<&PoleView>,
) -> Option<Detection> {
    // A crop that is smaller than a square of the picture's grid is read at full resolution.
    let step = config.step(image.size().0);
    let (crop, step) = aligned_region(crop, step).map_or((crop, 1), |crop| (crop, step));
    let small = image.downscale(crop, step);
    let whole = small.region();
    let middle = (step - 1) as f64 / 2.0;
    let origin = Pixel::new(crop.x as f64 + middle, crop.y as f64 + middle);
    let plane = |image: &Image, channels| Plane {
        origin,
        step,
        ..sample_gaussian(image, whole, channels, config.sigma, 1)
    };

    let mut luma = plane(&small, LUMA);
    let poles = poles.map(|poles| PoleMask::new(poles, &luma));
    // The plant's colour is learned where it is bright: not on a pole.
    if let Some(poles) = &poles {
        luma = plane(&poles.without_poles(&small, small.median_colour()), LUMA);
    }
    let levels = Levels::of(&luma.values, config.bright_samples);
    let base = StemBase::new(&luma, base);
    // Brightness finds a seed at the base; its colour then separates the whole plant.
    let segment = |levels: &Levels| {
        let (colour, has_hue) = learn_colour(&small, &luma, levels, &base, config, poles.as_ref())?;
        let score = plane(&small, colour.weights.map(|weight| weight as f32));
        let (mut score, mut evidence) = classify(score, &colour, config);
        let others = has_hue.iter().flatten().enumerate().filter(|(_, has_hue)| !**has_hue);
        others.for_each(|(at, _)| (score.values[at], evidence[at]) = (0.0, Evidence::None));
        let components = ConnectedComponents::label(&evidence, score.width, REACH, base.anchor);
        let label = base.choose(&components, config.bright_samples)?;
        let is_at_base = components.component(label).distance <= base.max_distance;
        is_at_base.then_some((colour, score, components, label))
    };
    // Behind mist the lit cloth may outshine the plant; then the levels are those around the base. The same happens
    // without a flash, where only the side towards the lamp may be found: the tip counts as occluded.
    let at_first = segment(&levels);
    let is_outshone = at_first.is_none();
    let (colour, score, mut components, label) =
        at_first.or_else(|| segment(&base.local_levels(&luma, config.bright_samples)?))?;
    let bounds = match &poles {
        Some(poles) => poles.join_pieces(&mut components, label),
        None => components.component(label).bounds,
    };
    let is_plant = |at: usize| components.labels[at] == label;
    let tip = tip::highest_edge(&score, bounds, is_plant, config.threshold as f32)?;
    let tissue = occupancy(&score, bounds, is_plant);
    let silhouette = base.pixel.filter(|_| config.stem && is_silhouette(&luma, &levels));
    let is_silhouette = silhouette.is_some();
    let stem = match silhouette {
        Some(base) => trace_silhouette(image, crop, base, &tissue),
        None if config.stem => {
            let bright = with_brightness(&score, &luma, &levels, bounds, is_plant);
            let planes = midline::Planes { colour: &score, bright: &bright };
            trace_stem(planes, bounds, is_plant, &base, tip, poles.as_ref())
        }
        None => None,
    };
    let may_be_occluded = || is_outshone || has_glare_above(&luma, &levels, tip) || is_in_shadow(&luma, tip);
    let is_seen = |at: Pixel| score.bilinear(score.to_sample(at)) > config.threshold;
    let is_behind_pole = poles.is_some_and(|poles| {
        let path = stem.as_ref().map(|stem| [&*stem.line, &stem.beyond].concat());
        poles.view.hides_end(path.as_deref(), tip, is_seen)
    });
    let is_occluded = !is_silhouette && may_be_occluded();
    // A silhouette is all stem and may hang, which would look like a second foot.
    let may_have_others = base.pixel.is_some() && !is_silhouette;
    let has_second_foot = may_have_others && has_second_foot(&score, bounds, is_plant, base.anchor, REACH);
    let (stem, stem_width) = stem.map(|stem| (stem.line, stem.width)).unzip();
    Some(Detection {
        tip,
        apex: stem.as_ref().and_then(|stem| stem.last().copied()),
        stem,
        stem_width,
        contrast: colour.separation,
        tissue,
        clipped_at: clipped_edge(bounds, score.width),
        is_occluded,
        is_behind_pole,
        has_second_foot,
        ..Detection::default()
    })
}

/// The score of a component, or its brightness where that is greater: what is saturated has lost its colour.
fn with_brightness(
    score: &Plane,
    luma: &Plane,
    levels: &Levels,
    bounds: BoundingBox,
    is_plant: impl Fn(usize) -> bool,
) -> Plane {
    let mut bright = score.clone();
    let range = (levels.bright - levels.background).max(1.0);
    for row in bounds.top..=bounds.bottom {
        let samples = row * score.width + bounds.left..=row * score.width + bounds.right;
        for at in samples.filter(|&at| is_plant(at)) {
            bright.values[at] = bright.values[at].max((luma.values[at] - levels.background) / range);
        }
    }
    bright
}

/// A stem in the photograph.
struct Stem {
    /// Its midline from the base up.
    line: Vec<Pixel>,
    /// Its width, in pixels.
    width: f64,
    /// The visible plant beyond the stem's end.
    beyond: Vec<Pixel>,
}

/// Traces the midline, extended straight down to the base where the crop clips the stem's foot.
fn trace_stem(
    planes: midline::Planes<'_>,
    bounds: BoundingBox,
    is_plant: impl Fn(usize) -> bool,
    base: &StemBase,
    tip: Pixel,
    poles: Option<&PoleMask<'_>>,
) -> Option<Stem> {
    let may_hide = |at: usize| poles.is_some_and(|poles| poles.is_hiding(at));
    let plane = planes.colour;
    let top = plane.to_sample(tip);
    let midline::TracedStem { line, width, beyond } =
        midline::trace_stem(planes, bounds, is_plant, may_hide, base.anchor, top, REACH)?;
    let pixels =
        |line: Vec<PlanePoint>| line.into_iter().map(|at| plane.to_pixel(at)).collect::<Vec<Pixel>>();
    let mut line = pixels(line);
    line.splice(0..0, base.pixel.filter(|base| base.y > line[0].y + plane.step as f64));
    Some(Stem { line, width: width * plane.step as f64, beyond: pixels(beyond) })
}

/// Traces the midline of a silhouette; its width is the mean.
fn trace_silhouette(
    image: &dyn PixelSource,
    crop: Region,
    base: Pixel,
    tissue: &OccupancyGrid,
) -> Option<Stem> {
    let corner = Pixel::new(crop.x as f64, crop.y as f64);
    let mut line = silhouette_midline(&image.crop(crop), base - corner)?;
    line.iter_mut().for_each(|at| *at = *at + corner);
    let width = tissue.area() / path::length(&line).max(1.0);
    Some(Stem { line, width, beyond: Vec::new() })
}

/// The cells that a component occupies.
fn occupancy(plane: &Plane, bounds: BoundingBox, is_plant: impl Fn(usize) -> bool) -> OccupancyGrid {
    let BoundingBox { left, right, top, bottom } = bounds;
    let columns = |y: usize| (left..=right).map(move |x| (x, y));
    let samples = (top..=bottom).flat_map(columns).filter(|&(x, y)| is_plant(y * plane.width + x));
    let pixels = samples.map(|(x, y)| plane.to_pixel([x as f64, y as f64]));
    OccupancyGrid::from_pixels(pixels, (CELL_SAMPLES * plane.step) as f64)
}

/// The edge of the plane that a component touches. The lower edge does not count: a foot may stand on it.
fn clipped_edge(bounds: BoundingBox, width: usize) -> Option<Edge> {
    let touched = [
        (Edge::Top, bounds.top == 0),
        (Edge::Left, bounds.left == 0),
        (Edge::Right, bounds.right + 1 == width),
    ];
    touched.into_iter().find_map(|(edge, is_touched)| is_touched.then_some(edge))
}

/// Where the plant begins within the crop.
struct StemBase {
    /// Where the stem leaves the soil, if known.
    pixel: Option<Pixel>,
    /// The sample nearest to there; the middle of the lower edge where it is not known.
    anchor: PlanePoint,
    /// Greatest distance of the plant from the anchor, in samples.
    max_distance: f64,
}

impl StemBase {
    fn new(plane: &Plane, base: Option<Pixel>) -> Self {
        let (right, bottom) = (plane.width as f64 - 1.0, plane.height as f64 - 1.0);
        let Some(base) = base else {
            return Self { pixel: None, anchor: [right / 2.0, bottom], max_distance: f64::INFINITY };
        };
        let [x, y] = plane.to_sample(base);
        let anchor = [x.clamp(0.0, right), y.clamp(0.0, bottom)];
        // Above a base outside the crop the stem may lean by as much as it has risen.
        let clipped = (x - anchor[0]).abs().max((y - anchor[1]).abs());
        let max_distance = clipped + (BASE_RADIUS * plane.height as f64).max(REACH as f64);
        Self { pixel: Some(base), anchor, max_distance }
    }

    /// The levels around a known base.
    fn local_levels(&self, plane: &Plane, count: usize) -> Option<Levels> {
        self.pixel?;
        let radius = self.max_distance + LEARNING_RADIUS * plane.height as f64;
        let window =
            |at: f64, size: usize| (at - radius).max(0.0) as usize..((at + radius) as usize + 1).min(size);
        let (columns, rows) = (window(self.anchor[0], plane.width), window(self.anchor[1], plane.height));
        let values: Vec<f32> = rows.flat_map(|y| &plane.row(y)[columns.clone()]).copied().collect();
        Some(Levels::of(&values, count))
    }

    /// The label of the plant: the nearest component, or the largest where the base is not known.
    fn choose(&self, components: &ConnectedComponents, min_strong: usize) -> Option<u32> {
        if self.pixel.is_some() { components.nearest(min_strong) } else { components.largest(min_strong) }
    }
}

/// Learns the discriminant of the bright component at the base and of all dark samples; `None` where the contrast of
/// either is too low.
fn learn_colour(
    small: &Image,
    luma: &Plane,
    levels: &Levels,
    base: &StemBase,
    config: &VisionConfig,
    poles: Option<&PoleMask<'_>>,
) -> Option<(LinearDiscriminant, Option<Vec<bool>>)> {
    if levels.contrast() <= config.contrast {
        return None;
    }
    let threshold = levels.threshold(config.threshold);
    let bright = double_threshold(&luma.values, threshold, threshold);
    let components = ConnectedComponents::label(&bright, luma.width, REACH, base.anchor);
    let seed = base.choose(&components, config.bright_samples)?;
    let BoundingBox { left, right, top, bottom } = components.component(seed).bounds;
    let within = |radius: f64| {
        let mut plant = ColourStatistics::default();
        for y in top..=bottom {
            for x in (left..=right).filter(|&x| components.labels[y * luma.width + x] == seed) {
                if distance([x as f64, y as f64], base.anchor) <= radius {
                    plant.add(small.at(x, y));
                }
            }
        }
        plant
    };
    let mut plant = within(components.component(seed).distance + LEARNING_RADIUS * luma.height as f64);
    if plant.count() < config.bright_samples {
        plant = within(f64::INFINITY);
    }
    let dark = levels.threshold(config.threshold / 2.0);
    let mut background = ColourStatistics::default();
    for y in (0..luma.height).step_by(BACKGROUND_STRIDE) {
        let pixels = small.rgb[3 * y * small.width..].as_chunks::<3>().0.iter().step_by(BACKGROUND_STRIDE);
        let values = luma.row(y).iter().enumerate().step_by(BACKGROUND_STRIDE);
        let is_pole = |x: usize| poles.is_some_and(|poles| poles.covers(y * luma.width + x));
        for (&pixel, _) in pixels.zip(values).filter(|&(_, (x, &value))| value < dark && !is_pole(x)) {
            background.add(pixel);
        }
    }
    let has_hue = poles.map(|_| PoleMask::has_hue(small, &plant));
    let colour = match poles.zip(has_hue.as_deref()) {
        Some((poles, has_hue)) => poles.learn(small, has_hue, &plant, &background),
        None => LinearDiscriminant::learn(&plant, &background),
    };
    let colour = colour.filter(|colour| colour.separation > config.contrast)?;
    Some((colour, has_hue))
}

/// Adds the discriminant's offset, so that the score is 0 on background and 1 on plant, and classifies it by two
/// thresholds.
///
/// Brightness alone does not count here: what is bright and of another colour is a lamp, its glare, or the pot.
fn classify(mut score: Plane, colour: &LinearDiscriminant, config: &VisionConfig) -> (Plane, Vec<Evidence>) {
    let offset = colour.offset as f32;
    let high = config.threshold as f32;
    let low = (LOW_THRESHOLD / colour.separation).max(config.threshold / 2.0) as f32;
    score.values.iter_mut().for_each(|value| *value += offset);
    let evidence = double_threshold(&score.values, low, high);
    (score, evidence)
}
