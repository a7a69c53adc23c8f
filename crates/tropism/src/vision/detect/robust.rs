//! The plant that stands at the base, told from what is around it by a colour learned from the picture itself.
//!
//! In: a picture, a crop, and where the stem leaves the soil. Out: the plant's highest point, between samples, and its
//! midline. The one idea: what is bright and nearest to the base is plant; its colour tells the rest of the plant from
//! pot, cloth and glare; and only what hangs together with the base counts.

use crate::geometry::{Pixel, Region};
use crate::math;
use crate::photo::Image;
use crate::simd::dispatch;
use crate::vision::config::VisionConfig;
use crate::vision::detect::colour::{ColourStatistics, LinearDiscriminant};
use crate::vision::detect::connected_components::{BoundingBox, ConnectedComponents};
use crate::vision::detect::detection::{Detection, Edge};
use crate::vision::detect::hysteresis::{DoubleThreshold, Evidence};
use crate::vision::detect::occlusion::{fades_towards_tip, has_glare_above, is_in_shadow, stem_exceeds_tip};
use crate::vision::detect::occupancy::OccupancyGrid;
use crate::vision::detect::{midline, tip};
use crate::vision::raster::filter::sample_gaussian;
use crate::vision::raster::levels::Levels;
use crate::vision::raster::plane::{LUMA, Plane};
use crate::vision::raster::source::{PixelSource, aligned_region};

/// Samples that may be missing between two components of one plant, plus one: a shadow, or a saturated rim that has lost its
/// colour.
pub(super) const REACH: usize = 3;

/// Background is learned from every so many samples, both ways.
const THIN: usize = 3;

/// Deviations of the background's score above which a sample is plant if it hangs together with what surely is.
const PERHAPS: f64 = 4.0;

/// How far above the crop's lower edge the plant may begin, as a share of the crop's height: a shaded foot.
const FOOT: f64 = 0.15;

/// Samples across a cell of the plant's shape.
const CELL: usize = 2;

/// The plant's colour is learned within this share of the crop's height of its foot: where the stem must be.
const LEARNED: f64 = 0.12;

/// What a picture shows of the plant at `base`; without one, of the largest plant.
pub(super) fn detect(
    image: &impl PixelSource,
    crop: Region,
    base: Option<Pixel>,
    config: &VisionConfig,
) -> Option<Detection> {
    // A crop without a whole square of the picture's grid is read as it is.
    let step = config.step(image.size().0);
    let (crop, step) = aligned_region(crop, step).map_or((crop, 1), |crop| (crop, step));
    let small = image.downscale(crop, step);
    let whole = Region { x: 0, y: 0, width: small.width, height: small.height };
    let middle = (step - 1) as f64 / 2.0;
    let origin = (crop.x as f64 + middle, crop.y as f64 + middle);
    let plane =
        |channels| Plane { origin, step, ..sample_gaussian(&small, whole, channels, config.sigma, 1) };

    let grey = plane(LUMA);
    let levels = Levels::from_plane(&grey, config.bright_samples);
    let foot = Foot::new(&grey, base);
    let found = |levels: &Levels| {
        let colour = learn(&small, &grey, levels, &foot, config)?;
        let score = plane(colour.weights.map(|weight| weight as f32));
        let (plant, belief) = judge(score, &colour, config);
        let components = ConnectedComponents::label(&belief, plant.width, REACH, foot.place);
        let chosen = foot.choose(&components, config.bright_samples)?;
        let is_near = components.components[chosen as usize - 1].distance <= foot.reach;
        is_near.then_some((colour, plant, components, chosen))
    };
    // Behind mist a lamp's light on the cloth may outshine the plant: then what is about its foot tells what is bright,
    // and in a photograph that missed its flash what is lit from aside, of which a part may be seen.
    let at_once = found(&levels);
    let is_outshone = at_once.is_none();
    let (colour, plant, components, chosen) =
        at_once.or_else(|| found(&foot.levels(&grey, config.bright_samples)?))?;
    let part = &components.components[chosen as usize - 1];
    let is_part = |at: usize| components.labels[at] == chosen;
    let tip = tip::highest_edge(&plant, part.bounds, is_part, config.threshold as f32)?;
    let stem = if config.stem { stem(&plant, part.bounds, is_part, &foot, tip) } else { None };
    let apex = stem.as_ref().and_then(|stem| stem.last().copied());
    let BoundingBox { left, right, top, bottom } = part.bounds;
    let columns = |y: usize| (left..=right).map(move |x| (x, y));
    let tissue = (top..=bottom).flat_map(columns).filter(|&(x, y)| is_part(y * plant.width + x));
    let shape = OccupancyGrid::from_pixels(
        tissue.map(|(x, y)| plant.to_pixel(x as f64, y as f64)),
        (CELL * step) as f64,
    );
    // A foot may stand at the crop's lower edge, or be cut off by it.
    let reached = [(Edge::Top, top == 0), (Edge::Left, left == 0), (Edge::Right, right + 1 == plant.width)];
    let cut = reached.into_iter().find_map(|(edge, is_reached)| is_reached.then_some(edge));
    let is_occluded = is_outshone
        || has_glare_above(&grey, &levels, tip)
        || is_in_shadow(&grey, tip)
        || fades_towards_tip(&plant, stem.as_deref(), tip)
        || stem_exceeds_tip(stem.as_deref(), tip, step);
    let contrast = colour.separation;
    Some(Detection {
        tip,
        apex,
        stem,
        contrast,
        tissue: shape,
        clipped_at: cut,
        is_occluded,
        ..Detection::default()
    })
}

/// The midline in the photograph, and straight down to the base where the crop cuts the foot off.
fn stem(
    plant: &Plane,
    bounds: BoundingBox,
    is_part: impl Fn(usize) -> bool,
    foot: &Foot,
    tip: Pixel,
) -> Option<Vec<Pixel>> {
    let line = midline::trace_stem(plant, bounds, is_part, foot.place, plant.to_sample(tip), REACH)?;
    let mut stem: Vec<Pixel> = line.into_iter().map(|(x, y)| plant.to_pixel(x, y)).collect();
    stem.splice(0..0, foot.base.filter(|base| base.y > stem[0].y + plant.step as f64));
    Some(stem)
}

/// Where the plant should begin within the crop.
struct Foot {
    /// Where the stem leaves the soil, if that is known.
    base: Option<Pixel>,
    /// Column and row of the plane nearest to there; the middle of its lower edge where it is not known.
    place: (f64, f64),
    /// How far from there the plant may begin, in samples.
    reach: f64,
}

impl Foot {
    fn new(plane: &Plane, base: Option<Pixel>) -> Self {
        let (right, bottom) = (plane.width as f64 - 1.0, plane.height as f64 - 1.0);
        let Some(base) = base else {
            return Self { base, place: (right / 2.0, bottom), reach: f64::INFINITY };
        };
        let (x, y) = plane.to_sample(base);
        let place = (x.clamp(0.0, right), y.clamp(0.0, bottom));
        // Where the crop cuts the foot off, the stem may have leaned as far aside as it has risen.
        let cut = (x - place.0).abs().max((y - place.1).abs());
        Self { base: Some(base), place, reach: cut + (FOOT * plane.height as f64).max(REACH as f64) }
    }

    /// The levels where the plant begins, if that is known.
    fn levels(&self, plane: &Plane, count: usize) -> Option<Levels> {
        self.base?;
        let reach = self.reach + LEARNED * plane.height as f64;
        let within =
            |at: f64, most: usize| (at - reach).max(0.0) as usize..((at + reach) as usize + 1).min(most);
        let (columns, rows) = (within(self.place.0, plane.width), within(self.place.1, plane.height));
        let (width, height) = (columns.len(), rows.len());
        let values = rows.flat_map(|y| &plane.row(y)[columns.clone()]).copied().collect();
        Some(Levels::from_plane(&Plane { width, height, values, ..*plane }, count))
    }

    /// The number of the part that is the plant: the nearest, or the largest where the base is not known.
    fn choose(&self, components: &ConnectedComponents, sure: usize) -> Option<u32> {
        if self.base.is_some() { components.nearest(sure) } else { components.largest(sure) }
    }
}

/// Learns the plant's colour from what is bright at its foot and from all that is dark; `None` where nothing stands out.
fn learn(
    small: &Image,
    grey: &Plane,
    levels: &Levels,
    foot: &Foot,
    config: &VisionConfig,
) -> Option<LinearDiscriminant> {
    if levels.contrast() <= config.contrast {
        return None;
    }
    let strong = levels.threshold(config.threshold);
    let bright = dispatch(DoubleThreshold { values: &grey.values, low: strong, high: strong });
    let components = ConnectedComponents::label(&bright, grey.width, REACH, foot.place);
    let seed = foot.choose(&components, config.bright_samples)?;
    let BoundingBox { left, right, top, bottom } = components.components[seed as usize - 1].bounds;
    let learned = |most: f64| {
        let (mut plant, mut count) = (ColourStatistics::default(), 0);
        for y in top..=bottom {
            for x in (left..=right).filter(|&x| components.labels[y * grey.width + x] == seed) {
                if math::hypot(x as f64 - foot.place.0, y as f64 - foot.place.1) <= most {
                    plant.add(small.at(x, y));
                    count += 1;
                }
            }
        }
        (plant, count)
    };
    let (mut plant, count) =
        learned(components.components[seed as usize - 1].distance + LEARNED * grey.height as f64);
    if count < config.bright_samples {
        plant = learned(f64::INFINITY).0;
    }
    let dark = levels.threshold(config.threshold / 2.0);
    let mut background = ColourStatistics::default();
    for y in (0..grey.height).step_by(THIN) {
        let pixels = small.rgb[3 * y * small.width..].as_chunks::<3>().0.iter().step_by(THIN);
        for (&pixel, _) in pixels.zip(grey.row(y).iter().step_by(THIN)).filter(|&(_, &level)| level < dark) {
            background.add(pixel);
        }
    }
    LinearDiscriminant::learn(&plant, &background).filter(|colour| colour.separation > config.contrast)
}

/// How much each sample is plant by its colour, 0 for background and 1 for plant, and what is believed of it.
///
/// Brightness alone says nothing here: what is bright and of another colour is a lamp, its glare, or the pot.
fn judge(mut score: Plane, colour: &LinearDiscriminant, config: &VisionConfig) -> (Plane, Vec<Evidence>) {
    let offset = colour.offset as f32;
    let sure = config.threshold as f32;
    let perhaps = (PERHAPS / colour.separation).max(config.threshold / 2.0) as f32;
    score.values.iter_mut().for_each(|value| *value += offset);
    let belief = dispatch(DoubleThreshold { values: &score.values, low: perhaps, high: sure });
    (score, belief)
}
