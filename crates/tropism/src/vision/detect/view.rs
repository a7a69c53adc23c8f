//! A picture turned so that the plant grows upwards in it, and inverted where the plant is darker than its background.
//!
//! In: a picture of a plant in any pose and tone. Out: a picture as detection expects it, and detections turned back.
//! The one idea: detection knows one pose and one tone, and pictures are turned, not detection.

use std::borrow::Cow;

use crate::geometry::{Pixel, Region};
use crate::photo::Image;
use crate::vision::config::Direction;
use crate::vision::detect::detection::{Detection, Edge};
use crate::vision::raster::source::PixelSource;

/// A picture turned and inverted.
pub(super) struct View<'a> {
    source: &'a dyn PixelSource,
    up: Direction,
    is_inverted: bool,
}

impl<'a> View<'a> {
    /// The picture with the end of `up` at the top, and its negative if `is_inverted`.
    pub(super) fn new(source: &'a dyn PixelSource, up: Direction, is_inverted: bool) -> Self {
        Self { source, up, is_inverted }
    }

    /// A pixel of the picture in the view.
    pub(super) fn to_view(&self, Pixel { x, y }: Pixel) -> Pixel {
        let (right, bottom) = self.last();
        match self.up {
            Direction::Up => Pixel::new(x, y),
            Direction::Left => Pixel::new(bottom - y, x),
            Direction::Right => Pixel::new(y, right - x),
            Direction::Down => Pixel::new(right - x, bottom - y),
        }
    }

    /// A pixel of the view in the picture.
    fn to_picture(&self, Pixel { x, y }: Pixel) -> Pixel {
        let (right, bottom) = self.last();
        match self.up {
            Direction::Up => Pixel::new(x, y),
            Direction::Left => Pixel::new(y, bottom - x),
            Direction::Right => Pixel::new(right - y, x),
            Direction::Down => Pixel::new(right - x, bottom - y),
        }
    }

    /// A region of the picture in the view.
    pub(super) fn region_to_view(&self, region: Region) -> Region {
        turned(region, |corner| self.to_view(corner))
    }

    /// A detection in the view, as one in the picture.
    pub(super) fn detection_to_picture(&self, found: Detection) -> Detection {
        let place = |pixel: Pixel| self.to_picture(pixel);
        let edge = |edge: Edge| match (self.up, edge) {
            (Direction::Up, edge) => edge,
            (Direction::Left, Edge::Top) | (Direction::Down, Edge::Right) => Edge::Left,
            (Direction::Left, Edge::Right)
            | (Direction::Right, Edge::Left)
            | (Direction::Down, Edge::Bottom) => Edge::Top,
            (Direction::Left, Edge::Left)
            | (Direction::Right, Edge::Right)
            | (Direction::Down, Edge::Top) => Edge::Bottom,
            (Direction::Right, Edge::Top)
            | (Direction::Down, Edge::Left)
            | (Direction::Left, Edge::Bottom) => Edge::Right,
            (Direction::Right, Edge::Bottom) => Edge::Left,
        };
        Detection {
            tip: place(found.tip),
            apex: found.apex.map(place),
            stem: found.stem.map(|stem| stem.into_iter().map(place).collect()),
            tissue: if self.up == Direction::Up { found.tissue } else { found.tissue.mapped(place) },
            clipped_at: found.clipped_at.map(edge),
            ..found
        }
    }

    /// The last column and the last row of the picture.
    fn last(&self) -> (f64, f64) {
        let (width, height) = self.source.size();
        (width as f64 - 1.0, height as f64 - 1.0)
    }
}

/// The region whose corners are those of another one after a turn.
fn turned(Region { x, y, width, height }: Region, turn: impl Fn(Pixel) -> Pixel) -> Region {
    let one = turn(Pixel::new(x as f64, y as f64));
    let other = turn(Pixel::new((x + width) as f64 - 1.0, (y + height) as f64 - 1.0));
    let (left, top) = (one.x.min(other.x) as usize, one.y.min(other.y) as usize);
    let length = |one: f64, other: f64| (one - other).abs() as usize + 1;
    Region { x: left, y: top, width: length(one.x, other.x), height: length(one.y, other.y) }
}

impl PixelSource for View<'_> {
    fn size(&self) -> (usize, usize) {
        let (width, height) = self.source.size();
        if matches!(self.up, Direction::Left | Direction::Right) { (height, width) } else { (width, height) }
    }

    fn crop(&self, region: Region) -> Cow<'_, Image> {
        let part = turned(region, |corner| self.to_picture(corner));
        let pixels = self.source.crop(part);
        let Region { width, height, .. } = region;
        let mut rgb = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            for x in 0..width {
                let at = self.to_picture(Pixel::new((region.x + x) as f64, (region.y + y) as f64));
                rgb.extend(pixels.at(at.x as usize - part.x, at.y as usize - part.y));
            }
        }
        if self.is_inverted {
            rgb.iter_mut().for_each(|value| *value = 255 - *value);
        }
        Cow::Owned(Image { width, height, rgb })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_turn_is_undone_and_moves_pixels_as_places() {
        let rgb: Vec<u8> = (0..5 * 3).flat_map(|at| [at, 100 + at, 200]).collect();
        let image = Image { width: 5, height: 3, rgb };
        for up in [Direction::Up, Direction::Left, Direction::Right, Direction::Down] {
            let view = View::new(&image, up, false);
            let (width, height) = view.size();
            let whole = view.crop(Region { x: 0, y: 0, width, height });
            let part = view.crop(Region { x: 1, y: 1, width: 2, height: 2 });
            for (x, y) in (0..5).flat_map(|x| (0..3).map(move |y| (x, y))) {
                let at = Pixel::new(x as f64, y as f64);
                let there = view.to_view(at);
                assert_eq!(view.to_picture(there), at);
                assert_eq!(whole.at(there.x as usize, there.y as usize), image.at(x, y), "{up:?}");
            }
            assert_eq!(part.at(0, 1), whole.at(1, 2));
            let region = Region { x: 1, y: 0, width: 4, height: 2 };
            let there = view.region_to_view(region);
            assert_eq!(turned(there, |corner| view.to_picture(corner)), region);
        }
        let negative = View::new(&image, Direction::Up, true);
        assert_eq!(negative.crop(Region { x: 0, y: 0, width: 5, height: 3 }).at(1, 0), [254, 154, 55]);
    }
}
