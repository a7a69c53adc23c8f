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
    let step = config.step(image.width);
    // A crop of fewer pixels than samples are apart is read as it is.
    let step = step.min(crop.width).min(crop.height);
    let small = segment::shrink(image, crop, step);
    let whole = Region { x: 0, y: 0, width: small.width, height: small.height };
    let grid = Grid { crop, step };
    let grey = segment::sample(&small, whole, LUMA, config.sigma, 1);
    let levels = Levels::of(&grey, config.bright_samples);
    if levels.contrast() <= config.contrast {
        return None;
    }
    let foot = base.map(|base| Foot::new(&grey, grid.place(base)));
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
        learn(&small, &grey, levels.threshold(config.threshold / 2.0), |at| seeds.labels[at] == seed)?;
    if colour.separation <= config.contrast {
        return None;
    }

    let score = segment::sample(&small, whole, colour.weights.map(|weight| weight as f32), config.sigma, 1);
    let (plant, belief) = judge(score, &colour, &grey, &levels, config);
    let parts = Parts::of(&belief, plant.width, REACH, anchor);
    let chosen = choose(&parts)?;
    let part = &parts.parts[chosen as usize - 1];
    if foot.is_some_and(|foot| part.distance > foot.reach) {
        return None;
    }
    let is_part = |at: usize| parts.labels[at] == chosen;
    let top = tip::edge(&plant, part.bounds, is_part, config.threshold as f32)?;
    let line = if config.stem {
        midline::trace(&plant, part.bounds, is_part, anchor, (top.x, top.y), REACH)
    } else {
        None
    };
    let stem = line.map(|line| {
        let mut stem: Vec<Pixel> = line.into_iter().map(|place| grid.pixel(place)).collect();
        // Straight down to the base where the crop cuts the foot off.
        stem.splice(0..0, base.filter(|base| base.y > stem[0].y + step as f64));
        stem
    });
    let apex = stem.as_ref().and_then(|stem| stem.last().copied());
    Some(Sighting { tip: grid.pixel((top.x, top.y)), apex, stem, contrast: colour.separation })
}

/// Where the samples of a shrunken crop lie in the photograph.
struct Grid {
    crop: Region,
    step: usize,
}

impl Grid {
    fn pixel(&self, (x, y): (f64, f64)) -> Pixel {
        let step = self.step as f64;
        let middle = (step - 1.0) / 2.0;
        Pixel::new(self.crop.x as f64 + x * step + middle, self.crop.y as f64 + y * step + middle)
    }

    fn place(&self, pixel: Pixel) -> (f64, f64) {
        let step = self.step as f64;
        let middle = (step - 1.0) / 2.0;
        ((pixel.x - self.crop.x as f64 - middle) / step, (pixel.y - self.crop.y as f64 - middle) / step)
    }
}

/// Where the plant should begin within the crop.
struct Foot {
    /// Column and row nearest to the base.
    place: (f64, f64),
    /// How far from there it may begin, in samples.
    reach: f64,
}

impl Foot {
    fn new(plane: &Plane, (x, y): (f64, f64)) -> Self {
        let place = (x.clamp(0.0, plane.width as f64 - 1.0), y.clamp(0.0, plane.height as f64 - 1.0));
        // Where the crop cuts the foot off, the stem may have leaned as far aside as it has risen.
        let cut = (x - place.0).abs().max((y - place.1).abs());
        Self { place, reach: cut + (FOOT * plane.height as f64).max(REACH as f64) }
    }
}

/// Learns the plant's colour from its `seeds` and from all that is darker than `dark`.
fn learn(small: &Image, grey: &Plane, dark: f32, seeds: impl Fn(usize) -> bool) -> Option<Discriminant> {
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
            colours.add(small.at(x, y));
        }
    }
    Discriminant::learn(&plant, &background)
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
