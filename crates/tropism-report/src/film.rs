//! Film of a run: its photographs with the lit lamp, the targets and the trajectory of the tip drawn in.

use super::Plants;
use super::lamp::{self, COLOURS};
use super::picture::{BLACK, Canvas, WHITE};
use tropism::geometry::{Pixel, Point, Region};
use tropism::lamps::{Layout, Light};
use tropism::photo::Image;
use tropism::vision::Calibration;

/// One step of a film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmStep {
    /// Seconds since the start.
    pub time_s: f64,
    /// Measured tip, in cm; `None` if it was not detected.
    pub tip: Option<Point>,
    /// The lamp that is lit from this step to the next; `None` is dark.
    pub light: Option<Light>,
}

/// What to draw into the photographs of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Film {
    /// Calibration of the photographs; without it, trajectory and targets are not drawn.
    pub calibration: Option<Calibration>,
    /// The lamps; the default is the paper's.
    pub layout: Layout,
    /// Targets, in cm.
    pub targets: Vec<Point>,
    /// The kind of plant, if it is known: every picture of a virtual plant says so.
    pub plants: Option<Plants>,
    /// The steps of the run, one a photograph; empty if only the photographs are known.
    pub steps: Vec<FilmStep>,
}

impl Film {
    /// Draws lit lamp, targets, trajectory so far and time into the photograph of step `index`.
    ///
    /// `image` is the photograph, [`scaled`](super::scaled) from `photograph_width` columns.
    #[must_use]
    pub fn frame(&self, image: &Image, photograph_width: usize, index: usize) -> Image {
        let Some(mut canvas) = Canvas::over(image) else { return image.clone() };
        let past = &self.steps[..self.steps.len().min(index + 1)];
        self.draw_path(&mut canvas, photograph_width, past);
        self.draw_targets(&mut canvas, photograph_width);
        if let Some(step) = past.last() {
            let before = past.len().checked_sub(2).and_then(|before| past[before].light);
            canvas.lamps(before, &self.layout);
            let minutes = (step.time_s / 60.0).round().max(0.0) as u64;
            canvas.caption(&format!("{} H {:02} MIN", minutes / 60, minutes % 60), false);
        }
        self.label(&mut canvas);
        canvas.image()
    }

    /// Draws the targets and the kind of plant into a composite of photographs.
    ///
    /// `composite` is [`scaled`](super::scaled) from `photograph_width` columns.
    #[must_use]
    pub fn cover(&self, composite: &Image, photograph_width: usize) -> Image {
        let Some(mut canvas) = Canvas::over(composite) else { return composite.clone() };
        self.draw_targets(&mut canvas, photograph_width);
        self.label(&mut canvas);
        canvas.image()
    }

    /// The bounding box of root, targets and trajectory in a photograph, with a margin of `margin` cm; `None` without a
    /// calibration.
    #[must_use]
    pub fn region(&self, margin: f64) -> Option<Region> {
        let calibration = self.calibration?;
        let tips = self.steps.iter().filter_map(|step| step.tip);
        let points = tips.chain(self.targets.iter().copied()).filter(|point| point.is_finite());
        let root = Point::new(0.0, 0.0);
        let (low, high) = points.fold((root, root), |(low, high), point| {
            (
                Point::new(low.x.min(point.x), low.y.min(point.y)),
                Point::new(high.x.max(point.x), high.y.max(point.y)),
            )
        });
        let upper_left = calibration.pixel(Point::new(low.x - margin, high.y + margin));
        let lower_right = calibration.pixel(Point::new(high.x + margin, low.y - margin));
        let within = |value: f64, side: usize| value.round().clamp(0.0, side as f64) as usize;
        let (left, right) =
            (within(upper_left.x, calibration.width), within(lower_right.x, calibration.width));
        let (top, bottom) =
            (within(upper_left.y, calibration.height), within(lower_right.y, calibration.height));
        let (width, height) = (right.saturating_sub(left), bottom.saturating_sub(top));
        (width > 0 && height > 0).then_some(Region { x: left, y: top, width, height })
    }

    /// The same film of photographs that are cropped to `region`.
    #[must_use]
    pub fn cropped(mut self, region: Region) -> Self {
        if let Some(calibration) = &mut self.calibration {
            calibration.base.x -= region.x as f64;
            calibration.base.y -= region.y as f64;
            (calibration.width, calibration.height) = (region.width, region.height);
        }
        self
    }

    /// The colours that are drawn into the photographs: the lamps', white and black.
    #[must_use]
    pub fn colours(&self) -> Vec<[u8; 3]> {
        COLOURS.iter().take(self.layout.len()).copied().chain([WHITE, BLACK]).collect()
    }

    fn label(&self, canvas: &mut Canvas) {
        if self.plants.is_some_and(Plants::is_virtual) {
            canvas.caption("VIRTUAL PLANT", true);
        }
    }

    /// The position of a point on a canvas whose photograph was `photograph_width` columns wide.
    fn place(&self, canvas: &Canvas, photograph_width: usize, point: Point) -> Option<Pixel> {
        let pixel = self.calibration?.pixel(point);
        let scale = canvas.width() / photograph_width as f64;
        let place = Pixel::new((pixel.x + 0.5) * scale, (pixel.y + 0.5) * scale);
        (place.x.abs() < 1e5 && place.y.abs() < 1e5).then_some(place)
    }

    fn draw_path(&self, canvas: &mut Canvas, photograph_width: usize, past: &[FilmStep]) {
        let seen: Vec<(Pixel, Option<Light>)> = past
            .iter()
            .filter_map(|step| Some((self.place(canvas, photograph_width, step.tip?)?, step.light)))
            .collect();
        let all: Vec<Pixel> = seen.iter().map(|(place, _)| *place).collect();
        canvas.line(&all, BLACK, 3.2);
        let mut start = 0;
        for run in seen.chunk_by(|a, b| a.1 == b.1) {
            // Each run ends at the first point of the next, so that the line has no gaps.
            let end = (start + run.len() + 1).min(all.len());
            canvas.line(&all[start..end], lamp::colour(run[0].1), 1.6);
            start += run.len();
        }
        if let Some(&tip) = all.last() {
            canvas.ring(tip, 4.5, WHITE);
        }
    }

    fn draw_targets(&self, canvas: &mut Canvas, photograph_width: usize) {
        for (number, &target) in (1..).zip(&self.targets) {
            let Some(at) = self.place(canvas, photograph_width, target) else { continue };
            let arm = 4.0 * canvas.unit;
            let corner = |dx: f64, dy: f64| Pixel::new(at.x + dx * arm, at.y + dy * arm);
            for (colour, width) in [(BLACK, 3.2), (WHITE, 1.6)] {
                canvas.line(&[corner(-1.0, -1.0), corner(1.0, 1.0)], colour, width);
                canvas.line(&[corner(-1.0, 1.0), corner(1.0, -1.0)], colour, width);
            }
            canvas.text(&number.to_string(), (at.x + 2.0 * arm, at.y - arm), 8.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{cropped, scaled};

    const LEFT: [u8; 3] = COLOURS[0];
    const RIGHT: [u8; 3] = COLOURS[1];

    fn grey(width: usize, height: usize) -> Image {
        Image { width, height, rgb: vec![90; 3 * width * height] }
    }

    fn film() -> Film {
        let step = |index: u32| FilmStep {
            time_s: f64::from(index) * 300.0,
            tip: Some(Point::new(0.1 * f64::from(index), 4.0)),
            light: Some(if index < 10 { Light::LEFT } else { Light::RIGHT }),
        };
        Film {
            calibration: Some(Calibration::from_scale(Pixel::new(240.0, 400.0), 50.0, 480, 480)),
            layout: Layout::default(),
            targets: vec![Point::new(2.0, 6.0)],
            plants: None,
            steps: (0..20).map(step).collect(),
        }
    }

    fn has(image: &Image, colour: [u8; 3], x: std::ops::Range<usize>, y: std::ops::Range<usize>) -> bool {
        y.flat_map(|y| x.clone().map(move |x| (x, y))).any(|(x, y)| image.at(x, y) == colour)
    }

    #[test]
    fn the_trajectory_grows_and_has_the_colour_of_the_lamp() {
        let film = film();
        let early = film.frame(&grey(480, 480), 480, 5);
        let late = film.frame(&grey(480, 480), 480, 19);
        // Steps 2 and 15 lie 10 and 75 pixels to the right of the base, 200 above it.
        assert!(has(&early, LEFT, 248..252, 198..203) && has(&late, LEFT, 248..252, 198..203));
        assert!(!has(&early, RIGHT, 300..330, 198..203) && has(&late, RIGHT, 300..330, 198..203));
    }

    #[test]
    fn the_lit_lamp_is_filled() {
        let film = film();
        for (index, light, other) in [(5, LEFT, RIGHT), (19, RIGHT, LEFT)] {
            let frame = film.frame(&grey(480, 480), 480, index);
            let corner = |x| has(&frame, light, x, 10..22) && !has(&frame, other, 0..480, 10..22);
            assert!(if index == 5 { corner(10..22) } else { corner(458..470) }, "{index}");
        }
    }

    #[test]
    fn four_lamps_are_drawn_in_the_order_of_their_places() {
        let mut film = Film { layout: Layout::four_sides(), ..film() };
        film.steps[3].light = Some(Light::BACK);
        let frame = film.frame(&grey(480, 480), 480, 4);
        // left, front, back, right: the third of four circles is at two thirds of the way from 16 to 464.
        assert!(has(&frame, COLOURS[3], 308..322, 10..22) && !has(&frame, LEFT, 0..480, 10..22));
        assert_eq!((film.colours().len(), Film::default().colours().len()), (6, 4));
    }

    #[test]
    fn a_scaled_picture_has_its_marks_at_the_same_places() {
        let film = film();
        let frame = film.frame(&scaled(&grey(480, 480), 240), 480, 0);
        assert_eq!((frame.width, frame.height), (240, 240));
        // The target at (2, 6) cm is at (340, 100) of the photograph: at half of that here.
        let drawn = |x: usize, y: usize| frame.at(x, y) != [90; 3];
        assert!(drawn(170, 50) && !drawn(170, 150), "the target");
    }

    #[test]
    fn only_pictures_of_virtual_plants_say_so() {
        let virtual_film =
            Film { plants: Some(Plants::Virtual), steps: Vec::new(), targets: Vec::new(), ..film() };
        let real = Film { plants: Some(Plants::Real), ..virtual_film.clone() };
        let photograph = grey(200, 100);
        assert_eq!(real.cover(&photograph, 200), photograph);
        assert_ne!(virtual_film.cover(&photograph, 200), photograph);
        assert_ne!(virtual_film.frame(&photograph, 200, 0), photograph);
    }

    #[test]
    fn a_cropped_film_shows_the_same_places() {
        let film = Film { plants: Some(Plants::Real), ..film() };
        let region = film.region(1.0).unwrap();
        // From the root at (240, 400) up to the target at (340, 100), 50 pixels around.
        assert_eq!(region, Region { x: 190, y: 50, width: 200, height: 400 });
        let photograph = film.frame(&grey(480, 480), 480, 0);
        let part = film.clone().cropped(region).frame(&cropped(&grey(480, 480), region).unwrap(), 200, 0);
        assert_eq!((part.width, part.height), (200, 400));
        let drawn = |image: &Image, x: usize, y: usize| image.at(x, y) != [90; 3];
        assert!(drawn(&photograph, 340, 100) && drawn(&part, 150, 50), "the target");
        assert!((145..150).any(|y| drawn(&part, 50, y)), "the ring around the tip");
        assert_eq!(Film { calibration: None, ..film }.region(1.0), None);
    }

    #[test]
    fn points_outside_the_picture_are_not_drawn() {
        let mut film = film();
        film.targets = vec![Point::new(1e12, -1e12), Point::new(f64::NAN, 0.0)];
        film.steps[3].tip = Some(Point::new(f64::INFINITY, 0.0));
        assert_eq!(film.frame(&grey(3, 2), 3, 19).width, 3);
        assert_eq!(film.frame(&grey(0, 0), 3, 99), grey(0, 0));
    }
}
