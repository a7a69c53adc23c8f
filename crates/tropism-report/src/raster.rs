//! Figures as PNG pictures.

use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Stroke, StrokeDash, Transform,
};

use super::drawing::{Colour, Drawing, FONT_SIZE, Item, Shape, Text};

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
    let transform = Transform::from_scale(scale, scale);
    for item in &drawing.items {
        match item {
            Item::Shape(shape) => draw(&mut pixmap, shape, transform),
            Item::Text(text) => write(&mut pixmap, text, transform),
        }
    }
    pixmap.encode_png().ok()
}

fn paint([red, green, blue]: Colour, opacity: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color(Color::from_rgba8(red, green, blue, (opacity * 255.0).round() as u8));
    paint
}

fn draw(pixmap: &mut Pixmap, shape: &Shape, transform: Transform) {
    let mut path = PathBuilder::new();
    for line in &shape.lines {
        for (index, &(x, y)) in line.iter().enumerate() {
            let (x, y) = (x as f32, y as f32);
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
    }
    let Some(path) = path.finish() else { return };
    let paint = |colour| Paint { anti_alias: !shape.is_crisp, ..paint(colour, shape.opacity) };
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

fn write(pixmap: &mut Pixmap, text: &Text, transform: Transform) {
    let Some(letters) = text.font().outlines(&text.letters, (0.0, 0.0), FONT_SIZE as f32) else { return };
    let turn = if text.is_turned { -90.0 } else { 0.0 };
    let transform = transform.pre_translate(text.start.0 as f32, text.start.1 as f32).pre_rotate(turn);
    if let Some((colour, width)) = text.outline {
        let stroke = Stroke { width: width as f32, line_join: LineJoin::Round, ..Stroke::default() };
        pixmap.stroke_path(&letters, &paint(colour, text.opacity), &stroke, transform, None);
    }
    pixmap.fill_path(&letters, &paint(text.ink, text.opacity), FillRule::Winding, transform, None);
}
