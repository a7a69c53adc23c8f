//! A stem known by its form, where its colour does not tell it from what is around it.
//!
//! In: a picture and the place where a stem leaves the soil. Out: the line through the middle of the stem, or nothing. The
//! one idea: across a stem lies a bar that differs from what is on both of its sides in the same way, be it brighter,
//! darker or of another colour; the way from the base along which such a bar goes on best is the stem.
//!
//! What lies beside a stem is the wall behind it, and stays the same along it. Where it changes for good, leaves begin:
//! that is the stem's end. Where there is no such stretch of some length, nothing is said.

use crate::geometry::{Pixel, Region};
use crate::math;
use crate::photo::Image;
use crate::vision::midline::{Place, resampled, smoothed};
use crate::vision::pixels::Pixels;
use crate::vision::segment::Levels;
use crate::vision::shape::Shape;
use crate::vision::{Sighting, VisionConfig, segment};

/// A colour: red, green and blue from 0 to 255, between pixels and on the mean.
type Colour = [f64; 3];

/// Deviation of the Gaussian filter before anything else, in pixels.
const SIGMA: f64 = 1.0;

/// The thinnest stem in pixels, the broadest as a share of the picture's shorter side, and the ratio from one width that
/// is tried to the next.
const THINNEST: f64 = 5.0;
const BROADEST: f64 = 0.08;
const RATIO: f64 = 1.15;

/// Where across a bar its inside is sampled, and where, on both sides, what lies beside it; in its widths.
const INSIDE: [f64; 5] = [-0.4, -0.2, 0.0, 0.2, 0.4];
const BESIDE: [f64; 3] = [0.6, 0.75, 0.9];

/// A stem leaves the soil at up to so many degrees from upright, and a first piece of so many half widths is looked at,
/// of which the better ones count: the foot may stand in the pot's rim.
const LEAN: i32 = 60;
const LEAN_STEP: i32 = 6;
const FIRST: usize = 9;
const BETTER: usize = 6;

/// The thinnest bar that stands out by this share of the most that any does is the stem: a broader one is a leaf above it.
const STANDS_OUT: f64 = 0.6;

/// First pieces that are less than so many times as broad as the thinnest may be the stem's, too.
const SIMILAR: f64 = 1.4;

/// Ways that are followed at a time, and half widths that any goes on for at most.
const BEAM: usize = 32;
const STEPS: usize = 400;

/// Degrees that a stem turns by in half a width, and factors that its width changes by.
const TURNS: [f64; 7] = [-15.0, -9.0, -4.0, 0.0, 4.0, 9.0, 15.0];
const TAPERS: [f64; 3] = [1.0 / 1.06, 1.0, 1.06];

/// How far a stem's width may get from its first, as a factor.
const TAPERED: (f64, f64) = (0.7, 1.35);

/// What half a width of a way must stand out by to be worth it, as a share of the first piece, and what a turn of one
/// radian, squared, and a change of width cost.
const WORTH: f64 = 0.4;
const TURN_COST: f64 = 3.0;
const TAPER_COST: f64 = 0.5;

/// What stands out by more than this many times as much as the first piece is something else: a lamp.
const GLARING: f64 = 1.25;

/// Samples along a stem's width, once its way is known.
const FINE: usize = 8;

/// Bands on each side, where what lies beside the stem is compared: from how far to how far from its middle, in widths.
const BANDS: usize = 4;
const SIDE: (f64, f64) = (0.75, 2.25);

/// A band has changed when its colour differs by more than this share of the stem's contrast, and what lies beside the
/// stem when so many of all bands have.
const CHANGED: f64 = 0.2;
const CHANGES: usize = 2;

/// Samples over which a change may last without being the end: a mark that is painted on the stem, a leaf's tip.
const PASSING: usize = 12;

/// Samples that a stretch begins with.
const WINDOW: usize = 12;

/// A stretch of the stem is at least this share of the longest; the first such is believed.
const SHARE: f64 = 0.4;

/// The stem's edge is where its colour comes within this share of the contrast of what lies beside it.
const EDGE: f64 = 0.2;

/// How deep below the base is looked for a pot, as a share of the picture's height, and the share of the way from the
/// background to the brightest that stands out there.
const BELOW: f64 = 0.06;
const STANDS_BELOW: f64 = 0.15;

/// What is believed: a stretch longer than so many widths, a fifth of which at most stands out on its less clear side by
/// less than this share of the contrast.
const LONG: f64 = 5.5;
const FAINT: f64 = 0.4;

/// The stem that was found.
#[derive(Clone, Debug)]
pub(super) struct Ridge {
    /// The line through its middle, from the base up, in the picture's pixels.
    pub(super) line: Vec<Place>,
    /// How broad it is about.
    pub(super) width: f64,
    /// By how many deviations of the picture's noise it differs from what lies beside it.
    pub(super) contrast: f64,
}

/// The stem that leaves the soil at `base` in this picture; `None` where none is seen clearly, or it stands out by fewer than `contrast`
/// deviations of the picture's noise.
pub(super) fn find(image: &Image, base: Place, contrast: f64) -> Option<Ridge> {
    let picture = Picture::of(image)?;
    let (line, width) = picture.follow(base)?;
    let mut strip = Strip::along(&picture, resampled(&line, width / FINE as f64), width);
    let (first, last) = strip.stretch()?;
    let long = (last - first) as f64 / FINE as f64;
    let clear = strip.contrast / noise(image).max(0.5);
    let is_stem = long > LONG && strip.least(first, last) >= FAINT * strip.contrast && clear > contrast;
    if !is_stem {
        return None;
    }
    strip.centre(&picture, first, last);
    strip.line.truncate(last + 1);
    Some(Ridge { line: strip.line, width, contrast: clear })
}

/// What is believed of a plant that was seen by its colour, or was not.
///
/// Where the crop does not "exclude the pot" (section 2.2.2) and what lies below the base stands out from the background,
/// too, colour does not tell where the stem begins and what is beside it. Then its form must, or no stem is seen.
pub(super) fn look(
    image: &impl Pixels,
    crop: Region,
    base: Pixel,
    config: &VisionConfig,
    seen: Option<Sighting>,
) -> Option<Sighting> {
    let step = config.step(image.size().0).min(crop.width).min(crop.height);
    let far = step as f64;
    let middle = (far - 1.0) / 2.0;
    let origin = Pixel::new(crop.x as f64 + middle, crop.y as f64 + middle);
    let foot = ((base.x - origin.x) / far, (base.y - origin.y) / far);
    if foot.1 + 1.0 >= (crop.height / step) as f64 {
        return seen;
    }
    let small = image.shrunk(crop, step);
    if seen.is_some() && !is_potted(&small, foot, config) {
        return seen;
    }
    let Some(ridge) = find(&small, foot, config.contrast) else {
        return seen.map(|seen| Sighting { stem: None, apex: None, ..seen });
    };
    let stem: Vec<Pixel> =
        ridge.line.iter().map(|at| Pixel::new(origin.x + far * at.0, origin.y + far * at.1)).collect();
    let top = stem.iter().copied().min_by(|one, other| one.y.total_cmp(&other.y))?;
    let apex = stem.last().copied();
    // What was seen lower than the stem is not the plant's top.
    let seen = seen.filter(|seen| seen.tip.y <= top.y + ridge.width * far).unwrap_or_else(|| {
        let shape = Shape::of(stem.iter().copied(), 2.0 * far);
        Sighting { tip: top, contrast: ridge.contrast, shape, is_veiled: true, ..Sighting::default() }
    });
    Some(Sighting { apex, stem: Some(stem), ..seen })
}

/// Whether most of what lies just below the foot stands out from the background: a pot, not dark soil.
fn is_potted(small: &Image, foot: Place, config: &VisionConfig) -> bool {
    let whole = Region { x: 0, y: 0, width: small.width, height: small.height };
    let grey = segment::sample(small, whole, segment::LUMA, config.sigma, 1);
    let level = Levels::of(&grey, config.bright_samples).threshold(STANDS_BELOW);
    let aside = BROADEST * small.width.min(small.height) as f64;
    let deep = BELOW * small.height as f64;
    let is_below = |x: usize, y: usize| {
        (x as f64 - foot.0).abs() <= aside && (2.0..deep + 3.0).contains(&(y as f64 - foot.1))
    };
    let (mut all, mut bright) = (0, 0);
    for (i, &value) in grey.values.iter().enumerate() {
        if is_below(i % grey.width, i / grey.width) {
            all += 1;
            bright += usize::from(value > level);
        }
    }
    2 * bright > all
}

/// How far apart two colours are.
fn apart(one: Colour, other: Colour) -> f64 {
    math::vector::distance(one, other)
}

/// The mean of some colours.
fn mean(colours: impl Iterator<Item = Colour>) -> Colour {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for colour in colours {
        sum.iter_mut().zip(colour).for_each(|(sum, value)| *sum += value);
        count += 1.0;
    }
    sum.map(|sum| sum / f64::max(count, 1.0))
}

/// The colour whose red, green and blue are the medians.
fn median(colours: &[Colour]) -> Colour {
    std::array::from_fn(|i| {
        math::statistics::quantile_nearest(&colours.iter().map(|colour| colour[i]).collect::<Vec<_>>(), 0.5)
    })
}

/// The deviation of a picture's noise, as a distance of colours (J. Immerkær 1996, doi:10.1006/cviu.1996.0060): what a
/// mask leaves that is blind to edges and slopes.
fn noise(image: &Image) -> f64 {
    let at = |x: usize, y: usize| f64::from(image.at(x, y)[1]);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in (1..image.height - 1).step_by(2) {
        for x in (1..image.width - 1).step_by(2) {
            let row = |y: usize| at(x - 1, y) - 2.0 * at(x, y) + at(x + 1, y);
            sum += (row(y - 1) - 2.0 * row(y) + row(y + 1)).abs();
            count += 1.0;
        }
    }
    (std::f64::consts::PI / 2.0).sqrt() / 6.0 * sum / f64::max(count, 1.0) * 3_f64.sqrt()
}

/// One place on a way along a stem.
#[derive(Clone, Copy, Debug)]
struct Step {
    at: Place,
    /// Where it goes: radians from upright to the right.
    heading: f64,
    width: f64,
    /// What the way is worth up to here.
    worth: f64,
    /// The width that the way began with.
    first: f64,
    /// The step before, but for the first.
    before: Option<usize>,
}

impl Step {
    /// Whether two ways are about to go on alike.
    fn is_like(&self, other: &Self) -> bool {
        let cell = |at: f64| (at / (0.3 * self.first)).floor();
        let turn = |heading: f64| (heading / 0.17).floor();
        cell(self.at.0) == cell(other.at.0)
            && cell(self.at.1) == cell(other.at.1)
            && turn(self.heading) == turn(other.heading)
    }
}

/// A picture, a little smoothed.
struct Picture {
    width: usize,
    height: usize,
    colours: Vec<[f32; 3]>,
}

impl Picture {
    /// `None` where the picture is too small for a stem and what lies beside it.
    fn of(image: &Image) -> Option<Self> {
        let whole = Region { x: 0, y: 0, width: image.width, height: image.height };
        if (image.width.min(image.height) as f64) < 4.0 * THINNEST {
            return None;
        }
        let channel = |i: usize| {
            let mut weights = [0.0; 3];
            weights[i] = 1.0;
            segment::sample(image, whole, weights, SIGMA, 1).values
        };
        let [red, green, blue] = [0, 1, 2].map(channel);
        let colours = red.into_iter().zip(green).zip(blue).map(|((r, g), b)| [r, g, b]).collect();
        Some(Self { width: image.width, height: image.height, colours })
    }

    /// The colour between pixels; the outermost pixels reach on for ever.
    fn at(&self, (x, y): Place) -> Colour {
        let (x, y) = (x.clamp(0.0, self.width as f64 - 1.0), y.clamp(0.0, self.height as f64 - 1.0));
        let (left, top) = (x as usize, y as usize);
        let (right, bottom) = ((left + 1).min(self.width - 1), (top + 1).min(self.height - 1));
        let (across, down) = (x - left as f64, y - top as f64);
        let at = |x: usize, y: usize| self.colours[y * self.width + x];
        let corners = [at(left, top), at(right, top), at(left, bottom), at(right, bottom)];
        std::array::from_fn(|i| {
            math::interpolate::bilinear(corners.map(|colour| f64::from(colour[i])), across, down)
        })
    }

    fn holds(&self, (x, y): Place) -> bool {
        x >= 1.0 && y >= 1.0 && x < self.width as f64 - 1.0 && y < self.height as f64 - 1.0
    }

    /// How much a bar stands out on both sides in the same way: the distance of colours, or less than 0 where its colour
    /// lies between those of its sides.
    fn bar(&self, at: Place, heading: f64, width: f64) -> f64 {
        let (sin, cos) = (math::sin(heading), math::cos(heading));
        let place = |across: f64, along: f64| {
            let (across, along) = (across * width, along * width);
            (at.0 + across * cos + along * sin, at.1 + across * sin - along * cos)
        };
        let colour = |offsets: &[f64], side: f64| {
            mean(
                offsets
                    .iter()
                    .flat_map(|&across| [-0.25, 0.25].map(|along| self.at(place(side * across, along)))),
            )
        };
        let inside = colour(&INSIDE, 1.0);
        let (left, right) = (colour(&BESIDE, -1.0), colour(&BESIDE, 1.0));
        let dot: f64 = (0..3).map(|i| (inside[i] - left[i]) * (inside[i] - right[i])).sum();
        dot.abs().sqrt().copysign(dot)
    }

    /// First steps that a stem may leave `base` with, and how much they stand out.
    fn first_steps(&self, base: Place) -> (Vec<Step>, f64) {
        let broadest = BROADEST * self.width.min(self.height) as f64;
        let widths =
            std::iter::successors(Some(THINNEST), |width| Some(width * RATIO)).take_while(|&w| w <= broadest);
        let mut found: Vec<(f64, Step)> = Vec::new();
        for width in widths {
            for degrees in (-LEAN..=LEAN).step_by(LEAN_STEP as usize) {
                let heading = f64::from(degrees).to_radians();
                let (sin, cos) = (math::sin(heading), math::cos(heading));
                for aside in [-0.5, -0.25, 0.0, 0.25, 0.5] {
                    let at = (base.0 + aside * width, base.1);
                    let mut bars: [f64; FIRST] = std::array::from_fn(|i| {
                        let far = 0.5 * i as f64 * width;
                        self.bar((at.0 + far * sin, at.1 - far * cos), heading, width)
                    });
                    bars.sort_by(f64::total_cmp);
                    let stands_out = bars[FIRST - BETTER..].iter().sum::<f64>() / BETTER as f64;
                    let step = Step { at, heading, width, worth: 0.0, first: width, before: None };
                    found.push((stands_out, step));
                }
            }
        }
        let most = found.iter().map(|one| one.0).fold(0.0, f64::max);
        let thinnest =
            found.iter().filter(|one| one.0 > STANDS_OUT * most).map(|one| one.1.width).fold(1e9, f64::min);
        found.retain(|one| (thinnest..SIMILAR * thinnest).contains(&one.1.width));
        found.sort_by(|one, other| other.0.total_cmp(&one.0));
        found.truncate(BEAM);
        let best = found.first().map_or(0.0, |one| one.0);
        let steps = found.into_iter().filter(|one| one.0 > STANDS_OUT * best).map(|one| one.1).collect();
        (steps, best)
    }

    /// The way from `base` that is worth most, and the stem's width along it.
    fn follow(&self, base: Place) -> Option<(Vec<Place>, f64)> {
        let (mut steps, clear) = self.first_steps(base);
        if clear <= 0.0 {
            return None;
        }
        let mut open: Vec<usize> = (0..steps.len()).collect();
        let mut best = 0;
        for _ in 0..STEPS {
            let mut next: Vec<Step> =
                open.iter().flat_map(|&from| self.onward(&steps, from, clear)).collect();
            next.sort_by(|one, other| other.worth.total_cmp(&one.worth));
            open.clear();
            for step in next {
                if open.len() < BEAM && !open.iter().any(|&other: &usize| steps[other].is_like(&step)) {
                    open.push(steps.len());
                    steps.push(step);
                }
            }
            let Some(&first) = open.first() else { break };
            if steps[first].worth > steps[best].worth {
                best = first;
            } else if steps[first].worth < steps[best].worth - 3.0 * steps[first].first - 8.0 {
                break;
            }
        }
        let mut way = vec![steps[best]];
        while let Some(before) = way[way.len() - 1].before {
            way.push(steps[before]);
        }
        way.reverse();
        let widths: Vec<f64> = way.iter().map(|step| step.width).collect();
        let line: Vec<Place> = way.iter().map(|step| step.at).collect();
        (line.len() > 2).then(|| (line, math::statistics::quantile_nearest(&widths, 0.5)))
    }

    /// The steps that may follow one.
    fn onward(&self, steps: &[Step], from: usize, clear: f64) -> Vec<Step> {
        let step = steps[from];
        let far = 0.5 * step.first;
        let mut next = Vec::new();
        for turn in TURNS.map(f64::to_radians) {
            let (heading, middle) = (step.heading + turn, step.heading + turn / 2.0);
            let at = (step.at.0 + far * math::sin(middle), step.at.1 - far * math::cos(middle));
            if !self.holds(at) || heading.abs() > std::f64::consts::PI {
                continue;
            }
            for taper in TAPERS {
                let width = step.width * taper;
                if width < TAPERED.0 * step.first || width > TAPERED.1 * step.first {
                    continue;
                }
                let clearness = self.bar(at, heading, width) / clear;
                let clearness =
                    if clearness > GLARING { GLARING / clearness } else { clearness.clamp(-0.5, 1.0) };
                let cost = WORTH + TURN_COST * turn * turn + TAPER_COST * math::ln(taper).abs();
                let worth = step.worth + far * (clearness - cost);
                next.push(Step { at, heading, width, worth, before: Some(from), ..step });
            }
        }
        next
    }
}

/// What lies along a line: the stem's colour and what is beside it.
struct Strip {
    /// Points, a stem's width by [`FINE`] apart.
    line: Vec<Place>,
    width: f64,
    /// The stem's colour at each point.
    stem: Vec<Colour>,
    /// The colours of the bands beside it, those on the left first.
    bands: Vec<[Colour; 2 * BANDS]>,
    /// How far the stem's colour is from that of the bands, on the lower half.
    contrast: f64,
}

impl Strip {
    fn along(picture: &Picture, line: Vec<Place>, width: f64) -> Self {
        let normals: Vec<Place> = (0..line.len()).map(|i| normal(&line, i)).collect();
        let colour = |i: usize, across: f64| {
            picture.at((line[i].0 + across * width * normals[i].0, line[i].1 + across * width * normals[i].1))
        };
        let breadth = (SIDE.1 - SIDE.0) / BANDS as f64;
        let band = |i: usize, band: usize| {
            let (side, band) = if band < BANDS { (-1.0, band) } else { (1.0, band - BANDS) };
            let from = SIDE.0 + breadth * band as f64;
            mean([0.17, 0.5, 0.83].into_iter().map(|share| colour(i, side * (from + share * breadth))))
        };
        let stem: Vec<Colour> = (0..line.len())
            .map(|i| mean([-0.3, -0.15, 0.0, 0.15, 0.3].into_iter().map(|across| colour(i, across))))
            .collect();
        let bands: Vec<[Colour; 2 * BANDS]> =
            (0..line.len()).map(|i| std::array::from_fn(|j| band(i, j))).collect();
        // Half a width along the line, on the mean.
        let near = |i: usize| i.saturating_sub(FINE / 4)..(i + FINE / 4 + 1).min(line.len());
        let stem: Vec<Colour> = (0..line.len()).map(|i| mean(stem[near(i)].iter().copied())).collect();
        let bands: Vec<[Colour; 2 * BANDS]> = (0..line.len())
            .map(|i| std::array::from_fn(|j| mean(bands[near(i)].iter().map(|bands| bands[j]))))
            .collect();
        let clear =
            |i: usize| bands[i].iter().map(|&band| apart(stem[i], band)).sum::<f64>() / (2 * BANDS) as f64;
        let contrast = math::statistics::quantile_nearest(
            &(0..line.len().div_ceil(2)).map(clear).collect::<Vec<_>>(),
            0.5,
        )
        .max(1e-6);
        Self { line, width, stem, bands, contrast }
    }

    /// What lies beside the points that `is_in`, on the median.
    fn beside(&self, from: usize, to: usize, is_in: impl Fn(usize) -> bool) -> [Colour; 2 * BANDS] {
        let points: Vec<usize> = (from..=to).filter(|&i| is_in(i)).collect();
        std::array::from_fn(|j| median(&points.iter().map(|&i| self.bands[i][j]).collect::<Vec<_>>()))
    }

    /// For each point whether what lies beside it differs from `reference`.
    fn changes(&self, reference: &[Colour; 2 * BANDS]) -> Vec<bool> {
        let is_changed =
            |(band, wanted): &(&Colour, &Colour)| apart(**band, **wanted) > CHANGED * self.contrast;
        self.bands
            .iter()
            .map(|bands| bands.iter().zip(reference).filter(is_changed).count() >= CHANGES)
            .collect()
    }

    /// The first and the last point of the stretch along which what lies beside the stem stays the same; `None` without.
    fn stretch(&self) -> Option<(usize, usize)> {
        let mut stretches: Vec<(usize, usize)> = Vec::new();
        let mut start = 0;
        while start + WINDOW <= self.line.len() {
            let mut changes = self.changes(&self.beside(start, start + WINDOW - 1, |_| true));
            if changes[start..start + WINDOW].iter().filter(|&&is_changed| is_changed).count() > WINDOW / 5 {
                start += FINE / 4;
                continue;
            }
            let mut last = reach(start..self.line.len(), &changes);
            // What lies beside all of it tells better than what lies beside its beginning.
            for _ in 0..6 {
                let again = self.changes(&self.beside(start, last, |i| !changes[i]));
                if again == changes {
                    break;
                }
                changes = again;
                last = reach(start..self.line.len(), &changes);
            }
            let first = reach((0..=start).rev(), &changes);
            stretches.push((first, last));
            start = last.max(start + FINE / 4);
        }
        let long = |&(first, last): &(usize, usize)| last - first;
        let longest = stretches.iter().map(long).max()?;
        stretches.into_iter().find(|stretch| long(stretch) as f64 >= SHARE * longest as f64)
    }

    /// How much the stem stands out on its less clear side, where it does least: at a fifth of the points from `first` to
    /// `last` by less.
    fn least(&self, first: usize, last: usize) -> f64 {
        let clear = |i: usize| {
            self.bands[i].iter().map(|&band| apart(self.stem[i], band)).fold(f64::INFINITY, f64::min)
        };
        math::statistics::quantile_nearest(&(first..=last).map(clear).collect::<Vec<_>>(), 0.2)
    }

    /// Moves the line to the middle between the stem's edges, where half of a stem may lie in its own shadow.
    fn centre(&mut self, picture: &Picture, first: usize, last: usize) {
        let normals: Vec<Place> = (0..self.line.len()).map(|i| normal(&self.line, i)).collect();
        let colour = |i: usize, across: f64| {
            let near = i.saturating_sub(FINE / 4)..(i + FINE / 4 + 1).min(self.line.len());
            mean(near.map(|i| {
                picture.at((self.line[i].0 + across * normals[i].0, self.line[i].1 + across * normals[i].1))
            }))
        };
        // The edge of each side at each point, as far as it is seen.
        let edges = |side: usize| -> Option<Vec<f64>> {
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let far = |i: usize| mean(self.bands[i][side * BANDS + 1..(side + 1) * BANDS].iter().copied());
            let seen: Vec<Option<f64>> = (first..=last)
                .map(|i| {
                    let around = i.saturating_sub(3 * FINE).max(first)..=(i + 3 * FINE).min(last);
                    let wall = median(&around.map(far).collect::<Vec<_>>());
                    let mut is_inside = false;
                    (0..(2.5 * self.width) as u32).map(|half| 0.5 * f64::from(half)).find(|&across| {
                        let is_wall = apart(colour(i, sign * across), wall) < EDGE * self.contrast;
                        is_inside |= !is_wall;
                        is_inside && is_wall && across > 0.2 * self.width
                    })
                })
                .collect();
            let middle = |i: usize, reach: usize| i.saturating_sub(reach)..(i + reach + 1).min(seen.len());
            let medians: Vec<Option<f64>> = (0..seen.len())
                .map(|i| {
                    let near: Vec<f64> = seen[middle(i, 5 * FINE / 4)].iter().copied().flatten().collect();
                    (!near.is_empty()).then(|| math::statistics::quantile_nearest(&near, 0.5))
                })
                .collect();
            let all: Vec<f64> = seen.iter().copied().flatten().collect();
            let usual = math::statistics::quantile_nearest(&all, 0.5);
            (all.len() > 2).then(|| medians.into_iter().map(|edge| edge.unwrap_or(usual)).collect())
        };
        let (Some(left), Some(right)) = (edges(0), edges(1)) else { return };
        let shifts: Vec<f64> = left.iter().zip(&right).map(|(left, right)| (right - left) / 2.0).collect();
        let shift = |i: usize| {
            let i = i.clamp(first, last) - first;
            let near = &shifts[i.saturating_sub(3 * FINE / 4)..(i + 3 * FINE / 4 + 1).min(shifts.len())];
            near.iter().sum::<f64>() / near.len() as f64
        };
        let moved: Vec<Place> = (0..self.line.len())
            .map(|i| {
                let by = shift(i);
                (self.line[i].0 + by * normals[i].0, self.line[i].1 + by * normals[i].1)
            })
            .collect();
        self.line = smoothed(&moved, FINE / 4);
    }
}

/// The last of `points` before a change that is no passing one; the first one if there is none.
fn reach(points: impl Iterator<Item = usize>, changes: &[bool]) -> usize {
    let mut last = None;
    for i in points {
        let since = last.map_or(0, |last: usize| last.abs_diff(i));
        if !changes[i] || last.is_none() {
            last = Some(i);
        } else if since > PASSING {
            break;
        }
    }
    last.unwrap_or(0)
}

/// The unit vector across a line at one of its points, to the right of where it goes.
fn normal(line: &[Place], i: usize) -> Place {
    let (from, to) = (line[i.saturating_sub(FINE / 2)], line[(i + FINE / 2).min(line.len() - 1)]);
    let length = math::hypot(to.0 - from.0, to.1 - from.1).max(1e-9);
    ((from.1 - to.1) / length, (to.0 - from.0) / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (160, 200);

    /// The middle of a drawn stem, so far above the base.
    fn middle(rise: f64) -> Place {
        (70.0 + 0.002 * rise * rise, 170.0 - rise)
    }

    /// A stem nine pixels wide that leans over before a wall that brightens to the right, with a mark painted on it, out of
    /// a pot that is as bright, under a leaf of its own colour that begins where it has risen by 100 pixels.
    fn picture(stem: [f64; 3]) -> Image {
        let mut rgb = Vec::new();
        for i in 0..SIZE.0 * SIZE.1 {
            let (x, y) = ((i % SIZE.0) as f64, (i / SIZE.0) as f64);
            let rise = 170.0 - y;
            let half = if rise > 100.0 { 14.0 } else { 4.5 };
            let is_plant = (0.0..150.0).contains(&rise) && (x - middle(rise).0).abs() < half;
            let is_pot = y > 170.0 && (20.0..140.0).contains(&x);
            let wall = 40.0 + 0.2 * x;
            rgb.extend(match () {
                () if is_plant && (60.0..66.0).contains(&rise) => [150, 20, 20],
                () if is_plant || is_pot => stem.map(|level| level as u8),
                () => [wall as u8 / 4, wall as u8 / 4, wall as u8],
            });
        }
        Image { width: SIZE.0, height: SIZE.1, rgb }
    }

    #[test]
    fn a_stem_is_followed_from_a_bright_pot_to_where_its_leaf_begins() {
        for colour in [[40.0, 60.0, 240.0], [160.0, 170.0, 90.0], [0.0, 0.0, 5.0]] {
            let found = find(&picture(colour), (70.0, 170.0), 6.0).unwrap();
            for &(x, y) in &found.line[FINE..found.line.len() - FINE] {
                assert!((x - middle(170.0 - y).0).abs() < 1.5, "{colour:?}: {x}, {y}");
            }
            let last = found.line[found.line.len() - 1];
            assert!((last.1 - 70.0).abs() < 12.0, "{colour:?}: {last:?}");
            assert!((5.0..13.0).contains(&found.width), "{}", found.width);
        }
    }

    #[test]
    fn nothing_is_said_where_no_stem_stands_out() {
        let stem = picture([40.0, 60.0, 240.0]);
        assert!(find(&stem, (20.0, 80.0), 6.0).is_none(), "the wall");
        let short =
            Image { rgb: stem.rgb[3 * SIZE.0 * 60..3 * SIZE.0 * 100].to_vec(), height: 40, ..stem.clone() };
        assert!(find(&short, (80.0, 39.0), 6.0).is_none(), "too short to tell");
        assert!(find(&Image { width: 8, height: 8, rgb: vec![9; 192] }, (4.0, 7.0), 6.0).is_none());
    }
}
