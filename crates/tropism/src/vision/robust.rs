//! The plant that stands at the base, told from what is around it by a colour learned from the picture itself.
//!
//! In: a picture, a crop, and where the stem leaves the soil. Out: the plant's highest point, between samples, and its
//! midline. The one idea: what is bright and nearest to the base is plant; its colour tells the rest of the plant from
//! pot, cloth and glare; and only what hangs together with the base counts.

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::colour::{Colours, Discriminant};
use crate::vision::parts::{Belief, Bounds, Parts};
use crate::vision::segment::{self, LUMA, Levels, Plane};
use crate::vision::{Sighting, VisionConfig, midline, tip};

/// Samples that may be missing between two parts of one plant, plus one: a shadow, or a saturated rim that has lost its
/// colour.
const REACH: usize = 3;

/// Background is learned from every so many samples, both ways.
const THIN: usize = 3;

/// Deviations of the background's score above which a sample is plant if it hangs together with what surely is.
const PERHAPS: f64 = 4.0;

/// How far above the crop's lower edge the plant may begin, as a share of the crop's height: a shaded foot.
const FOOT: f64 = 0.15;

/// What a picture shows of the plant at `base`; without one, of the largest plant.
pub(super) fn look(
    image: &Image,
    crop: Region,
    base: Option<Pixel>,
    config: &VisionConfig,
) -> Option<Sighting> {
    // A crop of fewer pixels than samples are apart is read as it is.
    let step = config.step(image.width).min(crop.width).min(crop.height);
    let small = segment::shrink(image, crop, step);
    let whole = Region { x: 0, y: 0, width: small.width, height: small.height };
    let middle = (step - 1) as f64 / 2.0;
    let origin = (crop.x as f64 + middle, crop.y as f64 + middle);
    let plane =
        |channels| Plane { origin, step, ..segment::sample(&small, whole, channels, config.sigma, 1) };

    let grey = plane(LUMA);
    let levels = Levels::of(&grey, config.bright_samples);
    let foot = Foot::new(&grey, base);
    let colour = learn(&small, &grey, &levels, &foot, config)?;
    let score = plane(colour.weights.map(|weight| weight as f32));
    let (plant, belief) = judge(score, &colour, &grey, &levels, config);
    let parts = Parts::of(&belief, plant.width, REACH, foot.place);
    let chosen = foot.choose(&parts, config.bright_samples)?;
    let part = &parts.parts[chosen as usize - 1];
    if part.distance > foot.reach {
        return None;
    }
    let is_part = |at: usize| parts.labels[at] == chosen;
    let tip = tip::edge(&plant, part.bounds, is_part, config.threshold as f32)?;
    let stem = if config.stem { stem(&plant, part.bounds, is_part, &foot, tip) } else { None };
    let apex = stem.as_ref().and_then(|stem| stem.last().copied());
    Some(Sighting { tip, apex, stem, contrast: colour.separation })
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
    let bright: Vec<Belief> =
        grey.values.iter().map(|&value| if value > strong { Belief::Sure } else { Belief::No }).collect();
    let parts = Parts::of(&bright, grey.width, REACH, foot.place);
    let seed = foot.choose(&parts, config.bright_samples)?;
    let Bounds { left, right, top, bottom } = parts.parts[seed as usize - 1].bounds;
    let mut plant = Colours::default();
    for y in top..=bottom {
        for x in (left..=right).filter(|&x| parts.labels[y * grey.width + x] == seed) {
            plant.add(small.at(x, y));
        }
    }
    let dark = levels.threshold(config.threshold / 2.0);
    let mut background = Colours::default();
    for y in (0..grey.height).step_by(THIN) {
        for x in (0..grey.width).step_by(THIN).filter(|&x| grey.row(y)[x] < dark) {
            background.add(small.at(x, y));
        }
    }
    Discriminant::learn(&plant, &background).filter(|colour| colour.separation > config.contrast)
}

/// How much each sample is plant: the greater of colour's score and brightness, both 0 for background and 1 for plant, as
/// saturated tissue has lost its colour and shaded tissue its brightness. And what is believed of it.
fn judge(
    mut score: Plane,
    colour: &Discriminant,
    grey: &Plane,
    levels: &Levels,
    config: &VisionConfig,
) -> (Plane, Vec<Belief>) {
    let (offset, range) = (colour.offset as f32, levels.bright - levels.background);
    let sure = config.threshold as f32;
    let perhaps = (PERHAPS / colour.separation).max(config.threshold / 2.0) as f32;
    let belief = score
        .values
        .iter_mut()
        .zip(&grey.values)
        .map(|(value, grey)| {
            let score = *value + offset;
            *value = score.max((grey - levels.background) / range);
            match () {
                () if *value > sure => Belief::Sure,
                () if score > perhaps => Belief::Perhaps,
                () => Belief::No,
            }
        })
        .collect();
    (score, belief)
}
