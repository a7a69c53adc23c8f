//! Figures as PNG pictures.

use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Stroke, StrokeDash, Transform,
};

use super::drawing::{Colour, Drawing, Shape};

/// Pixels of the picture a pixel of the figure: 300 a inch where the figure is as wide as in print.
const SCALE: f32 = 3.0;

/// Largest side of a picture, in pixels: a larger figure has a smaller scale. Chosen: some 100 MB while it is drawn.
const MOST: f32 = 6000.0;

/// The drawing as a PNG file on white ground; `None` without an area.
pub(super) fn png(drawing: &Drawing) -> Option<Vec<u8>> {
    let (width, height) = (drawing.size.0 as f32, drawing.size.1 as f32);
    let scale = SCALE.min(MOST / width.max(height));
    let mut pixmap = Pixmap::new((width * scale).ceil() as u32, (height * scale).ceil() as u32)?;
    pixmap.fill(Color::WHITE);
    for shape in &drawing.shapes {
        draw(&mut pixmap, shape, scale);
    }
    pixmap.encode_png().ok()
}

fn draw(pixmap: &mut Pixmap, shape: &Shape, scale: f32) {
    let mut path = PathBuilder::new();
    for line in &shape.lines {
        for (index, &(x, y)) in line.iter().enumerate() {
            let (x, y) = (x as f32, y as f32);
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
    }
    let Some(path) = path.finish() else { return };
    let transform = Transform::from_scale(scale, scale);
    let paint = |[red, green, blue]: Colour| {
        let alpha = (shape.opacity * 255.0).round() as u8;
        let mut paint = Paint { anti_alias: !shape.is_crisp, ..Paint::default() };
        paint.set_color(Color::from_rgba8(red, green, blue, alpha));
        paint
    };
    if let Some(colour) = shape.fill {
        pixmap.fill_path(&path, &paint(colour), FillRule::Winding, transform, None);
    }
    if let Some((colour, width)) = shape.stroke {
        let dash =
            shape.dash.and_then(|lengths| StrokeDash::new(lengths.map(|length| length as f32).to_vec(), 0.0));
        let stroke = Stroke {
            width: width as f32,
            line_cap: LineCap::Butt,
            line_join: LineJoin::Round,
            dash,
            ..Stroke::default()
        };
        pixmap.stroke_path(&path, &paint(colour), &stroke, transform, None);
    }
}
