//! The plant that stands at the base, told from what is around it by a colour learned from the picture itself.
//!
//! In: a picture, a crop, and where the stem leaves the soil. Out: the plant's highest point, between samples, and its midline.
//! The one idea: what is bright and nearest to the base is plant; its colour tells the rest of the plant from pot, cloth and
//! glare; and only what hangs together with the base counts.

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::colour::{Colours, Discriminant};
use crate::vision::parts::{Belief, Parts};
use crate::vision::segment::{self, LUMA, Levels, Plane};
use crate::vision::{Sighting, VisionConfig, midline, tip};

/// Samples that may be missing between two parts of one plant, plus one: a shadow, or a saturated rim that has lost its
/// colour.
const REACH: usize = 3;

/// Background is learned from every so many samples, both ways.
const THIN: usize = 2;

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
    let step = config.step(image.width);
    let sigma = config.sigma * step as f64;
    let grey = segment::sample(image, crop, LUMA, sigma, step);
    let levels = Levels::of(&grey, config.bright_samples);
    let foot = base.map(|base| Foot::new(&grey, base));
    let anchor = foot.as_ref().map_or((0.0, 0.0), |foot| foot.place);
    let choose = |parts: &Parts| {
        if foot.is_some() {
            parts.nearest(config.bright_samples)
        } else {
            parts.largest(config.bright_samples)
        }
    };

    let strong = levels.threshold(config.threshold);
    let bright: Vec<Belief> =
        grey.values.iter().map(|&value| if value > strong { Belief::Sure } else { Belief::No }).collect();
    let seeds = Parts::of(&bright, grey.width, REACH, anchor);
    let seed = choose(&seeds)?;
    let colour =
        learn(image, &grey, levels.threshold(config.threshold / 2.0), |at| seeds.labels[at] == seed)?;
    if colour.separation < config.contrast {
        return None;
    }

    let score = segment::sample(image, crop, colour.weights.map(|weight| weight as f32), sigma, step);
    let plant = united(&score, colour.offset as f32, &grey, &levels);
    let least = (PERHAPS / colour.separation).max(config.threshold / 2.0) as f32;
    let belief: Vec<Belief> = plant
        .values
        .iter()
        .zip(&score.values)
        .map(|(&plant, &score)| match () {
            () if plant > config.threshold as f32 => Belief::Sure,
            () if score + colour.offset as f32 > least => Belief::Perhaps,
            () => Belief::No,
        })
        .collect();
    let parts = Parts::of(&belief, plant.width, REACH, anchor);
    let chosen = choose(&parts)?;
    if foot.is_some_and(|foot| parts.parts[chosen as usize - 1].distance > foot.reach) {
        return None;
    }
    let tip = tip::edge(&plant, |at| parts.labels[at] == chosen, config.threshold as f32)?;
    let stem =
        if config.stem { midline(&plant, |at| parts.labels[at] == chosen, base, anchor, tip) } else { None };
    let apex = stem.as_ref().and_then(|stem| stem.last().copied());
    Some(Sighting { tip, apex, stem, contrast: colour.separation })
}

/// The midline in the photograph, from the base up, where one is known: straight to where the crop cuts the foot off.
fn midline(
    plant: &Plane,
    is_part: impl Fn(usize) -> bool,
    base: Option<Pixel>,
    anchor: (f64, f64),
    tip: Pixel,
) -> Option<Vec<Pixel>> {
    let line = midline::trace(plant, is_part, anchor, plant.place(tip), REACH)?;
    let mut stem: Vec<Pixel> = line.into_iter().map(|(x, y)| plant.pixel(x, y)).collect();
    if let Some(base) = base.filter(|base| base.y > stem[0].y + plant.step as f64) {
        stem.insert(0, base);
    }
    Some(stem)
}

/// Where the plant should begin within the crop.
struct Foot {
    /// Column and row nearest to the base.
    place: (f64, f64),
    /// How far from there it may begin, in samples.
    reach: f64,
}

impl Foot {
    fn new(plane: &Plane, base: Pixel) -> Self {
        let (x, y) = plane.place(base);
        let place = (x.clamp(0.0, plane.width as f64 - 1.0), y.clamp(0.0, plane.height as f64 - 1.0));
        // Where the crop cuts the foot off, the stem may have leaned as far aside as it has risen.
        let cut = (x - place.0).abs().max((y - place.1).abs());
        Self { place, reach: cut + (FOOT * plane.height as f64).max(REACH as f64) }
    }
}

/// Learns the plant's colour from its `seeds` and from all that is darker than `dark`.
fn learn(image: &Image, grey: &Plane, dark: f32, seeds: impl Fn(usize) -> bool) -> Option<Discriminant> {
    let (mut plant, mut background) = (Colours::default(), Colours::default());
    for y in 0..grey.height {
        for x in 0..grey.width {
            let at = y * grey.width + x;
            let is_thin = x % THIN == 0 && y % THIN == 0;
            let colours = match () {
                () if seeds(at) => &mut plant,
                () if is_thin && grey.values[at] < dark => &mut background,
                () => continue,
            };
            colours.add(image.at(grey.origin.0 + x * grey.step, grey.origin.1 + y * grey.step));
        }
    }
    Discriminant::learn(&plant, &background)
}

/// The greater of colour's score and brightness, both 0 for background and 1 for plant: saturated tissue has lost its
/// colour, and shaded tissue its brightness.
fn united(score: &Plane, offset: f32, grey: &Plane, levels: &Levels) -> Plane {
    let range = levels.bright - levels.background;
    let values = score
        .values
        .iter()
        .zip(&grey.values)
        .map(|(&score, &grey)| (score + offset).max((grey - levels.background) / range))
        .collect();
    Plane { values, ..*score }
}
