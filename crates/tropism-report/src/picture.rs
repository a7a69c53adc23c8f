//! Cropping, scaling and drawing on pictures.

use tiny_skia::{
    Color, FillRule, FilterQuality, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapPaint, Stroke,
    Transform,
};

use super::font::Font;
use super::lamp;
use tropism::geometry::{Pixel, Region};
use tropism::lamps::{Layout, Light};
use tropism::math::interpolate::lerp;
use tropism::photo::Image;

/// Ink of targets, circles and text on photographs.
pub(super) const WHITE: [u8; 3] = [255, 255, 255];

/// Outlines on photographs.
pub(super) const BLACK: [u8; 3] = [0, 0, 0];

/// The part of a picture in `region`; `None` if the region is not inside the picture.
#[must_use]
pub fn cropped(image: &Image, region: Region) -> Option<Image> {
    if !region.fits(image.width, image.height) {
        return None;
    }
    let Region { x, y, width, height } = region;
    let row = |row: usize| &image.rgb[3 * (row * image.width + x)..][..3 * width];
    Some(Image { width, height, rgb: (y..y + height).flat_map(row).copied().collect() })
}

/// Scales a picture to `width` columns: down by means of the pixels that fall together, up by bicubic interpolation.
///
/// Width and height of the result are even, as video codecs require, unless there is a single column or row.
#[must_use]
pub fn scaled(image: &Image, width: usize) -> Image {
    if image.rgb.is_empty() {
        return image.clone();
    }
    let even = |side: usize| if side > 1 { side & !1 } else { side };
    let columns = even(width.max(1));
    let rows = even(((columns * image.height + image.width / 2) / image.width).max(1));
    if columns > image.width || rows > image.height {
        return enlarged(image, columns, rows).unwrap_or_else(|| image.clone());
    }
    // The ranges of pixels of the original that become one pixel.
    let ranges = |count: usize, of: usize| {
        (0..count).map(move |i| i * of / count..((i + 1) * of / count).max(i * of / count + 1))
    };
    let across: Vec<_> = ranges(columns, image.width).collect();
    let mut rgb = Vec::with_capacity(3 * columns * rows);
    for down in ranges(rows, image.height) {
        for range in &across {
            let mut sums = [0_u32; 3];
            for y in down.clone() {
                let row = &image.rgb[3 * (y * image.width + range.start)..3 * (y * image.width + range.end)];
                for pixel in row.chunks_exact(3) {
                    for (sum, &value) in sums.iter_mut().zip(pixel) {
                        *sum += u32::from(value);
                    }
                }
            }
            let count = (down.len() * range.len()) as u32;
            rgb.extend(sums.map(|sum| ((sum + count / 2) / count) as u8));
        }
    }
    Image { width: columns, height: rows, rgb }
}

fn enlarged(image: &Image, columns: usize, rows: usize) -> Option<Image> {
    let from = Canvas::over(image)?.pixmap;
    let side = |length: usize| u32::try_from(length).ok();
    let mut pixmap = Pixmap::new(side(columns)?, side(rows)?)?;
    let scale = |to: usize, from: usize| to as f32 / from as f32;
    let transform = Transform::from_scale(scale(columns, image.width), scale(rows, image.height));
    let paint = PixmapPaint { quality: FilterQuality::Bicubic, ..PixmapPaint::default() };
    pixmap.draw_pixmap(0, 0, from.as_ref(), &paint, transform, None);
    Some(Canvas { pixmap, unit: 1.0 }.image())
}

fn ink([red, green, blue]: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(Color::from_rgba8(red, green, blue, 255));
    paint
}

/// A picture to draw on.
pub(super) struct Canvas {
    pixmap: Pixmap,
    /// Unit of line widths and sizes, in pixels: 1 in a picture 480 pixels wide, at least 0.5.
    pub(super) unit: f64,
}

impl Canvas {
    /// A copy of `image` to draw on; `None` if it has no pixels.
    pub(super) fn over(image: &Image) -> Option<Self> {
        let side = |length: usize| u32::try_from(length).ok();
        let mut pixmap = Pixmap::new(side(image.width)?, side(image.height)?)?;
        for (to, from) in pixmap.data_mut().chunks_exact_mut(4).zip(image.rgb.chunks_exact(3)) {
            to[..3].copy_from_slice(from);
            to[3] = 255;
        }
        Some(Self { pixmap, unit: (image.width as f64 / 480.0).max(0.5) })
    }

    /// Width in pixels.
    pub(super) fn width(&self) -> f64 {
        self.pixmap.width().into()
    }

    /// Ends the drawing and returns the picture.
    pub(super) fn image(self) -> Image {
        let (width, height) = (self.pixmap.width() as usize, self.pixmap.height() as usize);
        let rgb =
            self.pixmap.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        Image { width, height, rgb }
    }

    fn stroke(&mut self, path: &Path, colour: [u8; 3], width: f64) {
        let stroke = Stroke {
            width: (width * self.unit) as f32,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        self.pixmap.stroke_path(path, &ink(colour), &stroke, Transform::identity(), None);
    }

    fn fill(&mut self, path: &Path, colour: [u8; 3]) {
        self.pixmap.fill_path(path, &ink(colour), FillRule::Winding, Transform::identity(), None);
    }

    /// Strokes a line through `places`, `width` units wide.
    pub(super) fn line(&mut self, places: &[Pixel], colour: [u8; 3], width: f64) {
        let mut path = PathBuilder::new();
        for (index, place) in places.iter().enumerate() {
            let (x, y) = (place.x as f32, place.y as f32);
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        if let Some(path) = path.finish() {
            self.stroke(&path, colour, width);
        }
    }

    /// Strokes a circle of `radius` units.
    pub(super) fn ring(&mut self, at: Pixel, radius: f64, colour: [u8; 3]) {
        if let Some(circle) = PathBuilder::from_circle(at.x as f32, at.y as f32, (radius * self.unit) as f32)
        {
            self.stroke(&circle, colour, 1.4);
        }
    }

    /// Draws a circle for each lamp along the upper edge, in the order of their x, filled where the lamp is lit.
    pub(super) fn lamps(&mut self, lit: Option<Light>, layout: &Layout) {
        let (inset, radius) = (16.0 * self.unit, 7.0);
        let mut lights: Vec<Light> = layout.lights().collect();
        lights.sort_by(|a, b| {
            let x = |light: &Light| layout.lamps()[light.index()].at[0];
            x(a).total_cmp(&x(b))
        });
        for (index, &light) in lights.iter().enumerate() {
            let share = index as f64 / (lights.len() - 1) as f64;
            let at = Pixel::new(lerp(inset, self.width() - inset, share), inset);
            if lit == Some(light) {
                let radius = (radius * self.unit) as f32;
                if let Some(disc) = PathBuilder::from_circle(at.x as f32, at.y as f32, radius) {
                    self.fill(&disc, lamp::colour(lit));
                }
            }
            self.ring(at, radius, WHITE);
        }
    }

    /// Writes a text on the lower edge, at its left or its right end.
    pub(super) fn caption(&mut self, text: &str, is_right: bool) {
        let (height, inset) = (9.0, 10.0 * self.unit);
        let font = Font::weighing(false);
        let width = f64::from(font.width(text) / font.capitals()) * height * self.unit;
        let x = if is_right { self.width() - inset - width } else { inset };
        let y = f64::from(self.pixmap.height()) - inset - height * self.unit;
        self.text(text, (x, y), height);
    }

    /// Writes a text with its upper left corner at `(x, y)`, in letters `height` units high.
    pub(super) fn text(&mut self, text: &str, (x, y): (f64, f64), height: f64) {
        let font = Font::weighing(false);
        let height = (height * self.unit) as f32;
        let size = height / font.capitals();
        if let Some(letters) = font.outlines(text, (x as f32, y as f32 + height), size) {
            self.stroke(&letters, BLACK, 2.2);
            self.fill(&letters, WHITE);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: usize, height: usize) -> Image {
        Image { width, height, rgb: vec![90; 3 * width * height] }
    }

    #[test]
    fn a_region_inside_the_picture_is_cropped() {
        let image = Image { width: 3, height: 2, rgb: (0..18).collect() };
        let cut = |x, y, width, height| cropped(&image, Region { x, y, width, height });
        assert_eq!(cut(1, 1, 2, 1).unwrap(), Image { width: 2, height: 1, rgb: (12..18).collect() });
        assert_eq!(cut(0, 0, 3, 2), Some(image.clone()));
        assert_eq!((cut(1, 0, 3, 1), cut(0, 0, 0, 1), cut(usize::MAX, 0, 2, 1)), (None, None, None));
    }

    #[test]
    fn scaling_keeps_means_and_sides_even() {
        let image = Image { width: 4, height: 2, rgb: (0..24).collect() };
        let small = scaled(&image, 2);
        assert_eq!((small.width, small.height), (2, 1));
        assert_eq!(small.at(0, 0), [8, 9, 10], "mean of 0, 3, 12 and 15 is 7.5");
        assert_eq!(scaled(&image, 4), image);
        assert_eq!(scaled(&grey(1, 1), 1), grey(1, 1));
        assert_eq!(scaled(&grey(10, 5), 41), grey(40, 20));
        assert_eq!(scaled(&grey(0, 0), 7), grey(0, 0));
        let odd = scaled(&grey(101, 67), 51);
        assert_eq!((odd.width, odd.height), (50, 32));
    }
}
