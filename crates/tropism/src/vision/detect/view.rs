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
use crate::vision::raster::turn::Turn;

/// A picture turned and inverted.
pub(super) struct View<'a> {
    source: &'a dyn PixelSource,
    /// How the picture is turned.
    pub(super) turn: Turn,
    is_inverted: bool,
}

impl<'a> View<'a> {
    /// The picture with the end of `up` at the top, and its negative if `is_inverted`.
    pub(super) fn new(source: &'a dyn PixelSource, up: Direction, is_inverted: bool) -> Self {
        Self { source, turn: Turn::new(up, source.size()), is_inverted }
    }

    /// A detection in the view, as one in the picture.
    pub(super) fn detection_to_picture(&self, found: Detection) -> Detection {
        let back = self.turn.back();
        let place = |pixel: Pixel| back.pixel(pixel);
        let edge = |edge: Edge| {
            let at = Edge::ALL.iter().position(|one| *one == edge).unwrap_or(0);
            Edge::ALL[(at + self.turn.quarters()) % 4]
        };
        Detection {
            tip: place(found.tip),
            apex: found.apex.map(place),
            stem: found.stem.map(|stem| stem.into_iter().map(place).collect()),
            tissue: if self.turn.up == Direction::Up { found.tissue } else { found.tissue.mapped(place) },
            clipped_at: found.clipped_at.map(edge),
            ..found
        }
    }
}

impl PixelSource for View<'_> {
    fn size(&self) -> (usize, usize) {
        self.turn.size()
    }

    fn crop(&self, region: Region) -> Cow<'_, Image> {
        let pixels = self.source.crop(self.turn.back().region(region)).into_owned();
        let mut pixels = self.turn.orientation().upright(pixels);
        if self.is_inverted {
            pixels.rgb.iter_mut().for_each(|value| *value = 255 - *value);
        }
        Cow::Owned(pixels)
    }
}
