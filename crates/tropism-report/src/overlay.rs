//! Overlays: detections drawn over photographs, and contact sheets.

use tiny_skia::{Color, Paint, PathBuilder, Pixmap, Rect, Stroke, Transform};

use tropism::geometry::{Pixel, Region};
use tropism::lamps::Light;
use tropism::photo::Image;
use tropism::vision::Detection;

/// Marks to draw over a photograph; `None` is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OverlayMarks<'a> {
    /// Tip (a magenta cross), stem (cyan) and apex (a cyan ring).
    pub detection: Option<&'a Detection>,
    /// A tip carried forward: a grey cross.
    pub carried_forward: Option<Pixel>,
    /// The crop: a white frame.
    pub crop: Option<Region>,
    /// The root: a white ring.
    pub base: Option<Pixel>,
    /// The lit lamp: a yellow disc in the upper corner on its side.
    pub light: Option<Light>,
}

/// Draws `marks` over a picture; the lines' width grows with the picture. A picture without pixels is returned as it
/// is.
#[must_use]
pub fn draw_overlay(image: &Image, marks: &OverlayMarks<'_>) -> Image {
    let Some(mut canvas) = Canvas::over(image) else { return image.clone() };
    let white = Color::from_rgba8(255, 255, 255, 160);
    let cyan = Color::from_rgba8(0, 230, 255, 255);
    let (width, unit) = (image.width as f64, canvas.unit);
    if let Some(crop) = marks.crop {
        canvas.frame(crop, white);
    }
    if let Some(base) = marks.base {
        canvas.ring(base, 3.0 * unit, white);
    }
    if let Some(light) = marks.light {
        let x = if light == Light::LEFT { 10.0 * unit } else { width - 1.0 - 10.0 * unit };
        canvas.disc(Pixel::new(x, 10.0 * unit), 6.0 * unit, Color::from_rgba8(255, 220, 0, 255));
    }
    if let Some(held) = marks.carried_forward {
        canvas.cross(held, Color::from_rgba8(170, 170, 170, 255));
    }
    if let Some(detection) = marks.detection {
        canvas.line(detection.stem.as_deref().unwrap_or(&[]), cyan);
        if let Some(apex) = detection.apex {
            canvas.ring(apex, 2.5 * unit, cyan);
        }
        canvas.cross(detection.tip, Color::from_rgba8(255, 0, 200, 255));
    }
    canvas.image()
}

/// A sheet of pictures, `columns` in a row, each in a cell of the size of the largest. Without pictures it is empty.
#[must_use]
pub fn contact_sheet(images: &[Image], columns: usize) -> Image {
    let columns = columns.clamp(1, images.len().max(1));
    let cell_width = images.iter().map(|image| image.width).max().unwrap_or(0);
    let cell_height = images.iter().map(|image| image.height).max().unwrap_or(0);
    let (width, height) = (columns * cell_width, images.len().div_ceil(columns) * cell_height);
    let mut rgb = vec![0; 3 * width * height];
    for (i, image) in images.iter().enumerate() {
        let (left, top) = (i % columns * cell_width, i / columns * cell_height);
        for (y, row) in image.rgb.chunks_exact(3 * image.width.max(1)).enumerate() {
            rgb[3 * ((top + y) * width + left)..][..row.len()].copy_from_slice(row);
        }
    }
    Image { width, height, rgb }
}

/// A picture to draw on.
struct Canvas {
    pixmap: Pixmap,
    /// Width of a line, in pixels.
    unit: f64,
}

impl Canvas {
    fn over(image: &Image) -> Option<Self> {
        let side = |length: usize| u32::try_from(length).ok();
        let mut pixmap = Pixmap::new(side(image.width)?, side(image.height)?)?;
        for (to, from) in pixmap.data_mut().chunks_exact_mut(4).zip(image.rgb.chunks_exact(3)) {
            to[..3].copy_from_slice(from);
            to[3] = 255;
        }
        Some(Self { pixmap, unit: (image.width as f64 / 700.0).max(1.0) })
    }

    fn image(self) -> Image {
        let (width, height) = (self.pixmap.width() as usize, self.pixmap.height() as usize);
        let rgb =
            self.pixmap.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        Image { width, height, rgb }
    }

    fn stroke(&mut self, path: PathBuilder, colour: Color) {
        let Some(path) = path.finish() else { return };
        let mut paint = Paint::default();
        paint.set_color(colour);
        let stroke = Stroke { width: self.unit as f32, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    fn line(&mut self, pixels: &[Pixel], colour: Color) {
        let mut path = PathBuilder::new();
        for (i, pixel) in pixels.iter().enumerate() {
            let (x, y) = canvas_point(*pixel);
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        self.stroke(path, colour);
    }

    /// Draws a cross with an open middle, which leaves the marked pixels visible.
    fn cross(&mut self, at: Pixel, colour: Color) {
        let (near, far) = (3.0 * self.unit, 8.0 * self.unit);
        for (dx, dy) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let end = |reach: f64| Pixel::new(at.x + reach * dx, at.y + reach * dy);
            self.line(&[end(near), end(far)], colour);
        }
    }

    fn ring(&mut self, at: Pixel, radius: f64, colour: Color) {
        let (x, y) = canvas_point(at);
        let mut path = PathBuilder::new();
        path.push_circle(x, y, radius as f32);
        self.stroke(path, colour);
    }

    fn disc(&mut self, at: Pixel, radius: f64, colour: Color) {
        let (x, y) = canvas_point(at);
        let Some(path) = PathBuilder::from_circle(x, y, radius as f32) else { return };
        let mut paint = Paint::default();
        paint.set_color(colour);
        self.pixmap.fill_path(&path, &paint, tiny_skia::FillRule::Winding, Transform::identity(), None);
    }

    fn frame(&mut self, region: Region, colour: Color) {
        let (x, y) = (region.x as f32, region.y as f32);
        let Some(rect) = Rect::from_xywh(x, y, region.width as f32, region.height as f32) else { return };
        let mut path = PathBuilder::new();
        path.push_rect(rect);
        self.stroke(path, colour);
    }
}

/// Canvas coordinates of a pixel: whole numbers are the centres of pixels, but the corners of the canvas's.
fn canvas_point(pixel: Pixel) -> (f32, f32) {
    (pixel.x as f32 + 0.5, pixel.y as f32 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(width: usize, height: usize) -> Image {
        Image { width, height, rgb: vec![100; 3 * width * height] }
    }

    fn changed(before: &Image, after: &Image) -> Vec<(usize, usize)> {
        let all = (0..before.height).flat_map(|y| (0..before.width).map(move |x| (x, y)));
        all.filter(|&(x, y)| before.at(x, y) != after.at(x, y)).collect()
    }

    #[test]
    fn marks_are_drawn_around_the_marked_pixels() {
        let image = grey(60, 50);
        let tip = Pixel::new(30.0, 25.0);
        let detection = Detection { tip, contrast: 9.0, ..Detection::default() };
        let drawn =
            draw_overlay(&image, &OverlayMarks { detection: Some(&detection), ..OverlayMarks::default() });
        assert_eq!(drawn.at(30, 25), [100; 3]);
        assert_eq!(drawn.at(36, 25), [255, 0, 200]);
        assert!(changed(&image, &drawn).iter().all(|&(x, y)| x.abs_diff(30) + y.abs_diff(25) <= 9));
        assert_eq!(draw_overlay(&image, &OverlayMarks::default()), image);
    }

    #[test]
    fn the_lit_lamp_is_marked_on_its_side() {
        let image = grey(60, 50);
        let with =
            |light| draw_overlay(&image, &OverlayMarks { light: Some(light), ..OverlayMarks::default() });
        assert!(changed(&image, &with(Light::LEFT)).iter().all(|&(x, _)| x < 30));
        assert!(changed(&image, &with(Light::RIGHT)).iter().all(|&(x, _)| x > 30));
        assert!(!changed(&image, &with(Light::RIGHT)).is_empty());
    }

    #[test]
    fn marks_outside_the_picture_are_clipped() {
        let crop = Region { x: 900, y: 0, width: 5, height: 5 };
        let marks = OverlayMarks {
            crop: Some(crop),
            base: Some(Pixel::new(-1e9, f64::NAN)),
            ..OverlayMarks::default()
        };
        assert_eq!(draw_overlay(&grey(3, 2), &marks).width, 3);
        assert_eq!(draw_overlay(&grey(0, 0), &marks), grey(0, 0));
    }

    #[test]
    fn a_sheet_holds_every_picture() {
        let mut one = grey(2, 3);
        one.rgb.fill(7);
        let sheet = contact_sheet(&[grey(4, 2), grey(4, 2), one], 2);
        assert_eq!((sheet.width, sheet.height), (8, 6));
        assert_eq!((sheet.at(7, 1), sheet.at(1, 5), sheet.at(2, 5)), ([100; 3], [7; 3], [0; 3]));
        assert_eq!(contact_sheet(&[], 0), grey(0, 0));
    }
}
