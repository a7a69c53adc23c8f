//! The plant that stands at the base, told from what is around it by a colour learned from the picture itself.
//!
//! In: a picture, a crop, and where the stem leaves the soil. Out: the plant's highest point, between samples, and its
//! midline. The one idea: what is bright and nearest to the base is plant; its colour tells the rest of the plant from
//! pot, cloth and glare; and only what hangs together with the base counts.

use crate::geometry::{Pixel, Region};
use crate::math;
use crate::photo::Image;
use crate::simd::{Kernel, dispatch};
use crate::vision::colour::{Colours, Discriminant};
use crate::vision::parts::{Belief, Bounds, Parts};
use crate::vision::pixels::{Pixels, aligned};
use crate::vision::segment::{self, LUMA, Levels, Plane};
use crate::vision::shape::Shape;
use crate::vision::{Edge, Sighting, VisionConfig, midline, tip};

/// Samples that may be missing between two parts of one plant, plus one: a shadow, or a saturated rim that has lost its
/// colour.
const REACH: usize = 3;

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
pub(super) fn look(
    image: &impl Pixels,
    crop: Region,
    base: Option<Pixel>,
    config: &VisionConfig,
) -> Option<Sighting> {
    // A crop without a whole square of the picture's grid is read as it is.
    let step = config.step(image.size().0);
    let (crop, step) = aligned(crop, step).map_or((crop, 1), |crop| (crop, step));
    let small = image.shrunk(crop, step);
    let whole = Region { x: 0, y: 0, width: small.width, height: small.height };
    let middle = (step - 1) as f64 / 2.0;
    let origin = (crop.x as f64 + middle, crop.y as f64 + middle);
    let plane =
        |channels| Plane { origin, step, ..segment::sample(&small, whole, channels, config.sigma, 1) };

    let grey = plane(LUMA);
    let levels = Levels::of(&grey, config.bright_samples);
    let foot = Foot::new(&grey, base);
    let found = |levels: &Levels| {
        let colour = learn(&small, &grey, levels, &foot, config)?;
        let score = plane(colour.weights.map(|weight| weight as f32));
        let (plant, belief) = judge(score, &colour, config);
        let parts = Parts::of(&belief, plant.width, REACH, foot.place);
        let chosen = foot.choose(&parts, config.bright_samples)?;
        let is_near = parts.parts[chosen as usize - 1].distance <= foot.reach;
        is_near.then_some((colour, plant, parts, chosen))
    };
    // Behind mist a lamp's light on the cloth may outshine the plant: then what is about its foot tells what is bright,
    // and in a photograph that missed its flash what is lit from aside, of which a part may be seen.
    let at_once = found(&levels);
    let is_outshone = at_once.is_none();
    let (colour, plant, parts, chosen) =
        at_once.or_else(|| found(&foot.levels(&grey, config.bright_samples)?))?;
    let part = &parts.parts[chosen as usize - 1];
    let is_part = |at: usize| parts.labels[at] == chosen;
    let tip = tip::edge(&plant, part.bounds, is_part, config.threshold as f32)?;
    let stem = if config.stem { stem(&plant, part.bounds, is_part, &foot, tip) } else { None };
    let apex = stem.as_ref().and_then(|stem| stem.last().copied());
    let Bounds { left, right, top, bottom } = part.bounds;
    let columns = |y: usize| (left..=right).map(move |x| (x, y));
    let tissue = (top..=bottom).flat_map(columns).filter(|&(x, y)| is_part(y * plant.width + x));
    let shape = Shape::of(tissue.map(|(x, y)| plant.pixel(x as f64, y as f64)), (CELL * step) as f64);
    // A foot may stand at the crop's lower edge, or be cut off by it.
    let reached = [(Edge::Top, top == 0), (Edge::Left, left == 0), (Edge::Right, right + 1 == plant.width)];
    let cut = reached.into_iter().find_map(|(edge, is_reached)| is_reached.then_some(edge));
    let is_veiled = is_outshone
        || is_lit_above(&grey, &levels, tip)
        || is_shaded(&grey, tip)
        || fades(&plant, stem.as_deref(), tip)
        || is_topped(stem.as_deref(), tip, step);
    let contrast = colour.separation;
    Some(Sighting { tip, apex, stem, contrast, shape, cut, is_veiled, ..Sighting::default() })
}

/// Samples to each side of a tip, and above it, in which there should be nothing bright, and the share of them that may
/// be.
const ABOVE: (i64, f64) = (8, 0.3);

/// Whether it is bright above the tip, where nothing of the plant is: glare.
fn is_lit_above(grey: &Plane, levels: &Levels, tip: Pixel) -> bool {
    let (x, y) = grey.place(tip);
    let bright = levels.threshold(0.25);
    let (mut lit, mut all) = (0, 0);
    for row in y as i64 - ABOVE.0..y as i64 - 1 {
        for column in x as i64 - ABOVE.0..=x as i64 + ABOVE.0 {
            let is_inside =
                (0..grey.height as i64).contains(&row) && (0..grey.width as i64).contains(&column);
            if is_inside {
                all += 1;
                lit += usize::from(grey.row(row as usize)[column as usize] > bright);
            }
        }
    }
    lit as f64 > ABOVE.1 * f64::from(all)
}

/// Samples to each side of a tip in which nothing should be darker than the background is elsewhere.
const BESIDE: i64 = 8;

/// The share of the samples of a crop that are as dark as its darkest folds, and the share of their brightness below
/// which it is a shadow, and by how many grey values at least.
const SHADOW: (f64, f32, f32) = (0.05, 0.6, 4.0);

/// Whether it is darker about the tip than anywhere else in the crop: what is out of focus on the lens, a fly say, takes
/// the light of background and plant alike, and the plant seems to end where it begins.
fn is_shaded(grey: &Plane, tip: Pixel) -> bool {
    const STRIDE: usize = 4;
    let mut some: Vec<f32> = grey.values.iter().copied().step_by(STRIDE * STRIDE + 1).collect();
    let rank = (SHADOW.0 * some.len() as f64) as usize;
    let (x, y) = grey.place(tip);
    let mean = |x: i64, y: i64| {
        let column = x as usize - 1;
        let rows = y as usize - 1..=y as usize + 1;
        rows.flat_map(|row| &grey.row(row)[column..column + 3]).sum::<f32>() / 9.0
    };
    let within =
        |at: f64, most: usize| (at as i64 - BESIDE).max(1)..(at as i64 + BESIDE + 1).min(most as i64 - 1);
    let darkest = within(y, grey.height)
        .step_by(2)
        .flat_map(|y| within(x, grey.width).step_by(2).map(move |x| (x, y)))
        .map(|(x, y)| mean(x, y))
        .fold(f32::MAX, f32::min);
    let folds = *some.select_nth_unstable_by(rank, f32::total_cmp).1;
    darkest < SHADOW.1 * folds && folds - darkest > SHADOW.2
}

/// Samples by which a stem may rise above the tip.
const RISES: usize = 4;

/// Whether the stem goes on above what is taken for the tip: mist has taken the contrast of what lies between.
fn is_topped(stem: Option<&[Pixel]>, tip: Pixel, step: usize) -> bool {
    stem.is_some_and(|stem| stem.iter().any(|at| tip.y - at.y > (RISES * step) as f64))
}

/// Samples before the end of a stem that are as bright as the rest, but for the last, and the share of brightness that
/// they have at least.
const END: (usize, usize, f64) = (8, 2, 0.75);

/// Whether a stem that ends at the tip gets darker towards its end: something throws a shadow there.
fn fades(plant: &Plane, stem: Option<&[Pixel]>, tip: Pixel) -> bool {
    let Some(stem) = stem.filter(|stem| stem.len() > 2 * END.0) else { return false };
    let last = stem[stem.len() - 1];
    if last.distance(tip) > (END.0 * plant.step) as f64 {
        return false;
    }
    let median = |stem: &[Pixel]| {
        let values: Vec<f32> = stem.iter().filter_map(|&at| plant.nearest(at)).collect();
        math::statistics::upper_median(&values, f32::total_cmp)
    };
    match (median(stem), median(&stem[stem.len() - END.0..stem.len() - END.1])) {
        (Some(all), Some(end)) => f64::from(end) < END.2 * f64::from(all),
        _ => false,
    }
}

/// The midline in the photograph, and straight down to the base where the crop cuts the foot off.
fn stem(
    plant: &Plane,
    bounds: Bounds,
    is_part: impl Fn(usize) -> bool,
    foot: &Foot,
    tip: Pixel,
) -> Option<Vec<Pixel>> {
    let line = midline::trace(plant, bounds, is_part, foot.place, plant.place(tip), REACH)?;
    let mut stem: Vec<Pixel> = line.into_iter().map(|(x, y)| plant.pixel(x, y)).collect();
    stem.splice(0..0, foot.base.filter(|base| base.y > stem[0].y + plant.step as f64));
    Some(stem)
}

/// The midline of a silhouette, light before dark, from where it stands at `base` to the end that is farthest from there
/// along it; `None` where there is nothing light.
///
/// For shoots that were cut out of their photographs. No leaves are expected on them: what the farthest end belongs to is
/// the stem.
#[must_use]
pub fn silhouette(image: &Image, base: Pixel) -> Option<Vec<Pixel>> {
    let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
    let step = (image.width.min(image.height) / SILHOUETTE).max(1);
    if !whole.fits(image.width, image.height) {
        return None;
    }
    let mut plane = segment::sample(image, whole, LUMA, 0.5 * step as f64, step);
    let brightest = plane.values.iter().copied().fold(0.0, f32::max).max(1.0);
    plane.values.iter_mut().for_each(|value| *value /= brightest);
    let light = |&value: &f32| if value > 0.5 { Belief::Sure } else { Belief::No };
    let belief: Vec<Belief> = plane.values.iter().map(light).collect();
    let parts = Parts::of(&belief, plane.width, REACH, plane.place(base));
    let chosen = parts.largest(1)?;
    let bounds = parts.parts[chosen as usize - 1].bounds;
    let line = midline::longest(&plane, bounds, |at| parts.labels[at] == chosen, plane.place(base), REACH)?;
    Some(line.into_iter().map(|(x, y)| plane.pixel(x, y)).collect())
}

/// Samples along the shorter side of a silhouette, at least.
const SILHOUETTE: usize = 600;

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
        let (x, y) = plane.place(base);
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
        Some(Levels::of(&Plane { width, height, values, ..*plane }, count))
    }

    /// The number of the part that is the plant: the nearest, or the largest where the base is not known.
    fn choose(&self, parts: &Parts, sure: usize) -> Option<u32> {
        if self.base.is_some() { parts.nearest(sure) } else { parts.largest(sure) }
    }
}

/// Learns the plant's colour from what is bright at its foot and from all that is dark; `None` where nothing stands out.
fn learn(
    small: &Image,
    grey: &Plane,
    levels: &Levels,
    foot: &Foot,
    config: &VisionConfig,
) -> Option<Discriminant> {
    if levels.contrast() <= config.contrast {
        return None;
    }
    let strong = levels.threshold(config.threshold);
    let bright = dispatch(Believing { values: &grey.values, perhaps: strong, sure: strong });
    let parts = Parts::of(&bright, grey.width, REACH, foot.place);
    let seed = foot.choose(&parts, config.bright_samples)?;
    let Bounds { left, right, top, bottom } = parts.parts[seed as usize - 1].bounds;
    let learned = |most: f64| {
        let (mut plant, mut count) = (Colours::default(), 0);
        for y in top..=bottom {
            for x in (left..=right).filter(|&x| parts.labels[y * grey.width + x] == seed) {
                if math::hypot(x as f64 - foot.place.0, y as f64 - foot.place.1) <= most {
                    plant.add(small.at(x, y));
                    count += 1;
                }
            }
        }
        (plant, count)
    };
    let (mut plant, count) = learned(parts.parts[seed as usize - 1].distance + LEARNED * grey.height as f64);
    if count < config.bright_samples {
        plant = learned(f64::INFINITY).0;
    }
    let dark = levels.threshold(config.threshold / 2.0);
    let mut background = Colours::default();
    for y in (0..grey.height).step_by(THIN) {
        let pixels = small.rgb[3 * y * small.width..].as_chunks::<3>().0.iter().step_by(THIN);
        for (&pixel, _) in pixels.zip(grey.row(y).iter().step_by(THIN)).filter(|&(_, &level)| level < dark) {
            background.add(pixel);
        }
    }
    Discriminant::learn(&plant, &background).filter(|colour| colour.separation > config.contrast)
}

/// How much each sample is plant by its colour, 0 for background and 1 for plant, and what is believed of it.
///
/// Brightness alone says nothing here: what is bright and of another colour is a lamp, its glare, or the pot.
fn judge(mut score: Plane, colour: &Discriminant, config: &VisionConfig) -> (Plane, Vec<Belief>) {
    let offset = colour.offset as f32;
    let sure = config.threshold as f32;
    let perhaps = (PERHAPS / colour.separation).max(config.threshold / 2.0) as f32;
    score.values.iter_mut().for_each(|value| *value += offset);
    let belief = dispatch(Believing { values: &score.values, perhaps, sure });
    (score, belief)
}

/// What is believed of each sample, by what its value must exceed.
struct Believing<'a> {
    values: &'a [f32],
    perhaps: f32,
    sure: f32,
}

impl Kernel for Believing<'_> {
    type Result = Vec<Belief>;

    #[inline(always)]
    fn run(self) -> Vec<Belief> {
        let Self { values, perhaps, sure } = self;
        let mut belief = vec![Belief::No; values.len()];
        for (belief, &value) in belief.iter_mut().zip(values) {
            let perhaps = if value > perhaps { Belief::Perhaps } else { Belief::No };
            *belief = if value > sure { Belief::Sure } else { perhaps };
        }
        belief
    }
}
