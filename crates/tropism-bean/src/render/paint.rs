//! Paints the plant's body as the camera sees it, over the tent.

use tiny_skia::{
    Color, FillRule, GradientStop, LinearGradient, Paint, Path, PathBuilder, Pixmap, Point, Shader,
    SpreadMode, Stroke, Transform,
};
use tropism::geometry::{Pixel, Point as Place};
use tropism::math::vector::{Vec3, add, distance, dot, normalize_or, scale, sub};

use super::body::{Blade, Body, Oval, nearness, ribbon};
use super::tone::ToneCurve;
use crate::pose::Node;
use crate::scene::{LightSources, Rgb};
use crate::view::{CAMERA, Frame, project};

/// A stem is pale where it left the soil, green where the cotyledons were, and yellowish where it is young.
const STEM: Rgb = [0.74, 0.90, 0.19];
const STEM_NODE: Rgb = [0.62, 0.84, 0.26];
const STEM_BASE: Rgb = [0.82, 0.90, 0.52];
const BUD: Rgb = [0.74, 0.90, 0.17];
const COTYLEDON: Rgb = [0.66, 0.66, 0.15];
const WITHERED: Rgb = [0.30, 0.20, 0.07];
const LEAF: Rgb = [0.28, 0.53, 0.10];
const THROUGH_LEAF: Rgb = [0.36, 0.58, 0.06];
const RIB: Rgb = [0.56, 0.78, 0.28];

/// How much light creeps around and through stems: they are thin and full of water. Chosen by eye.
const THIN: f64 = 1.2;

/// A part of the photograph on which the plant is painted.
pub(super) struct Canvas<'a> {
    pub(super) pixmap: Pixmap,
    /// Column and row of the photograph at the canvas's corner: even ones, for colour is kept for 2 x 2 pixels.
    pub(super) corner: [i64; 2],
    pub(super) frame: Frame,
    lighting: &'a LightSources,
    tone: &'a ToneCurve,
}

impl<'a> Canvas<'a> {
    /// The plant on a canvas that just holds it and `margin` pixels around it; `None` if it is out of the picture.
    pub(super) fn paint(
        body: &Body,
        frame: Frame,
        margin: i64,
        lighting: &'a LightSources,
        tone: &'a ToneCurve,
    ) -> Option<Self> {
        let ([left, top], [right, bottom]) = bounds(body, frame)?;
        let low = |value: f64, size: u32| (value.floor() as i64 - margin).clamp(0, i64::from(size));
        let high = |value: f64, size: u32| (value.ceil() as i64 + 1 + margin).clamp(0, i64::from(size));
        let corner = [low(left, frame.width), low(top, frame.height)].map(|corner| corner & !1);
        let even = |size: i64, most: i64| ((size + 1) & !1).min(most);
        let width = even(high(right, frame.width) - corner[0], i64::from(frame.width) - corner[0]);
        let height = even(high(bottom, frame.height) - corner[1], i64::from(frame.height) - corner[1]);
        let pixmap = Pixmap::new(width as u32, height as u32)?;
        let mut canvas = Self { pixmap, corner, frame, lighting, tone };
        canvas.body(body);
        Some(canvas)
    }

    /// Erases what is hidden between the lower left corner `low` and the upper right one `high`, in cm.
    pub(super) fn erase(&mut self, low: Place, high: Place, is_hidden: impl Fn(Place) -> bool) {
        let (columns, rows) = (self.pixmap.width() as usize, self.pixmap.height() as usize);
        let ([left, top], frame) = (self.corner, self.frame);
        let (from, to) = (frame.pixel(Place::new(low.x, high.y)), frame.pixel(Place::new(high.x, low.y)));
        let span = |from: f64, to: f64, corner: i64, size: usize| {
            let within = |pixel: f64| (pixel - corner as f64).clamp(0.0, size as f64) as usize;
            within(from.floor())..within(to.ceil() + 1.0)
        };
        for row in span(from.y, to.y, top, rows) {
            for column in span(from.x, to.x, left, columns) {
                let at = 4 * (row * columns + column);
                let pixel = Pixel::new((left + column as i64) as f64, (top + row as i64) as f64);
                if self.pixmap.data()[at + 3] > 0 && is_hidden(frame.point(pixel)) {
                    self.pixmap.data_mut()[at..at + 4].fill(0);
                }
            }
        }
    }

    fn body(&mut self, body: &Body) {
        let behind = |leaf: &&Blade| leaf.centre()[2] < leaf.petiole[0].at[2];
        let stem_z = body.bud.centre[2];
        for leaf in body.leaves.iter().filter(behind) {
            self.leaf(leaf);
        }
        let between = |below: Rgb, above: Rgb| {
            move |share: f64| -> Rgb {
                core::array::from_fn(|band| below[band] + share * (above[band] - below[band]))
            }
        };
        let withered: Rgb =
            core::array::from_fn(|band| COTYLEDON[band] + body.withered * (WITHERED[band] - COTYLEDON[band]));
        for oval in body.cotyledons.iter().filter(|oval| oval.centre[2] < stem_z) {
            self.oval(oval, withered);
        }
        self.pieces(&body.stem[..=body.node], between(STEM_BASE, STEM_NODE));
        self.pieces(&body.stem[body.node..], between(STEM_NODE, STEM));
        self.ribbon(&body.hook, |_| BUD);
        self.oval(&body.bud, BUD);
        for oval in body.cotyledons.iter().filter(|oval| oval.centre[2] >= stem_z) {
            self.oval(oval, withered);
        }
        for leaf in body.leaves.iter().filter(|leaf| !behind(leaf)) {
            self.leaf(leaf);
        }
    }

    /// A stem in pieces over which the light of the flash changes little.
    fn pieces(&mut self, nodes: &[Node], colour: impl Fn(f64) -> Rgb) {
        let long: f64 = nodes.windows(2).map(|pair| distance(pair[0].at, pair[1].at)).sum();
        let pieces = (long / self.lighting.even_cm()).ceil().max(1.0) as usize;
        let last = nodes.len() - 1;
        for piece in 0..pieces {
            let [from, to] = [piece, piece + 1].map(|end| end * last / pieces);
            let share = |within: f64| (from as f64 + within * (to - from) as f64) / last.max(1) as f64;
            self.ribbon(&nodes[from..=to], |within| colour(share(within)));
        }
    }

    /// A stem or petiole, coloured by how far along it is, 0 to 1: lit from above and from the lamp's side.
    fn ribbon(&mut self, nodes: &[Node], colour: impl Fn(f64) -> Rgb) {
        if nodes.is_empty() {
            return;
        }
        let sideways = |node: usize, sign: f64| {
            let (from, to) = (node.saturating_sub(1), (node + 1).min(nodes.len() - 1));
            let along = normalize_or(sub(nodes[to].at, nodes[from].at), [0.0, 1.0, 0.0]);
            // To the right of the ribbon as it runs, and a little towards the camera.
            normalize_or([sign * along[1], -sign * along[0], 0.5], [0.0, 0.0, 1.0])
        };
        // The whole, then a strip along each edge, for a round stem has a side that faces the light: not on what is too
        // thin to show its sides.
        let strips = [([-1.0, 1.0], 0.0), ([-1.0, -0.3], 1.0), ([0.3, 1.0], -1.0)];
        let thin = nodes[0].radius * self.frame.px_per_cm < 0.9;
        for (part, sign) in if thin { &strips[..1] } else { &strips } {
            let (part, sign) = (*part, *sign);
            let Some(path) = self.path(&ribbon(nodes, self.frame, part)) else { continue };
            let light = |node: usize| {
                let share = node as f64 / (nodes.len() - 1).max(1) as f64;
                let normal = if sign == 0.0 { [0.0, 0.60, 0.80] } else { sideways(node, -sign) };
                let light = self.lighting.at(nodes[node].at, normal, if sign == 0.0 { THIN } else { 0.3 });
                let colour = colour(share);
                core::array::from_fn(|band| light[band] * colour[band])
            };
            let shader = self.upright(nodes, light, if sign == 0.0 { 255 } else { 150 });
            self.fill(&path, shader);
        }
    }

    /// Shades a ribbon from the light at its lowest place to that at its highest.
    fn upright(&self, nodes: &[Node], light: impl Fn(usize) -> Rgb, alpha: u8) -> Shader<'static> {
        let y = |node: usize| project(nodes[node].at).y;
        let (mut lowest, mut highest) = (0, 0);
        for node in 0..nodes.len() {
            lowest = if y(node) < y(lowest) { node } else { lowest };
            highest = if y(node) > y(highest) { node } else { highest };
        }
        let end = |node: usize| (self.place(project(nodes[node].at)), self.colour(light(node), alpha));
        let ((from, below), (to, above)) = (end(lowest), end(highest));
        blend([from, [from[0], to[1]]], [below, above])
    }

    fn oval(&mut self, oval: &Oval, colour: Rgb) {
        let outline: Vec<[f64; 2]> = oval.outline(24).into_iter().map(|point| self.pixel(point)).collect();
        let Some(path) = self.path(&outline) else { return };
        let lit = |normal: Vec3| {
            let light = self.lighting.at(oval.centre, normal, 0.8);
            self.colour(core::array::from_fn(|band| light[band] * colour[band]), 255)
        };
        let bounds = path.bounds();
        let ends = [bounds.top(), bounds.bottom()].map(|y| [0.0, f64::from(y)]);
        self.fill(&path, blend(ends, [lit([0.0, 0.8, 0.6]), lit([0.0, -0.6, 0.8])]));
    }

    fn leaf(&mut self, leaf: &Blade) {
        self.ribbon(&leaf.petiole, |_| STEM);
        for (half, normal) in leaf.halves.iter().zip(leaf.normals) {
            let outline: Vec<[f64; 2]> = half.iter().map(|&place| self.pixel(project(place))).collect();
            let Some(path) = self.path(&outline) else { continue };
            let shader = self.blade_shader(leaf, normal);
            self.fill(&path, shader);
        }
        self.veins(leaf);
    }

    fn blade_light(&self, at: Vec3, normal: Vec3, colour: Rgb, through: Rgb) -> Rgb {
        let above = dot(sub(CAMERA, at), normal) > 0.0;
        let light = self.lighting.at(at, normal, 0.25);
        let shade = if above { colour } else { through };
        core::array::from_fn(|band| light[band] * shade[band])
    }

    fn blade_shader(&self, leaf: &Blade, normal: Vec3) -> Shader<'static> {
        let ahead = sub(leaf.midrib[1], leaf.midrib[0]);
        let end = |place: Vec3, bend: f64| {
            // A blade bends down towards its end.
            let bent = normalize_or(add(normal, scale(ahead, bend)), normal);
            self.colour(self.blade_light(place, bent, LEAF, THROUGH_LEAF), 255)
        };
        let colours = [end(leaf.midrib[0], -0.04), end(leaf.midrib[1], 0.08)];
        blend(leaf.midrib.map(|place| self.place(project(place))), colours)
    }

    /// The midrib and four pairs of veins that run forward from it.
    fn veins(&mut self, leaf: &Blade) {
        let [from, to] = leaf.midrib;
        let along = |share: f64| add(from, scale(sub(to, from), share));
        let light = self.blade_light(leaf.centre(), normalize_or(leaf.normals[0], [0.0, 1.0, 0.0]), RIB, RIB);
        let wide = 0.05 * nearness(leaf.centre()) * self.frame.px_per_cm;
        let midrib = [self.pixel(project(from)), self.pixel(project(to))];
        self.line(&midrib, wide, self.colour(light, 230));
        for half in &leaf.halves {
            for vein in 0..4 {
                let start = along([0.02, 0.16, 0.36, 0.58][vein]);
                let reach = half[half.len() * [5, 9, 12, 15][vein] / 21];
                let end = add(start, scale(sub(reach, start), 0.92));
                let vein = [self.pixel(project(start)), self.pixel(project(end))];
                self.line(&vein, 0.5 * wide, self.colour(light, 110));
            }
        }
    }

    fn line(&mut self, places: &[[f64; 2]; 2], wide: f64, colour: Color) {
        let mut builder = PathBuilder::new();
        let [from, to] = places.map(|[x, y]| self.onto([x, y]));
        builder.move_to(from[0] as f32, from[1] as f32);
        builder.line_to(to[0] as f32, to[1] as f32);
        let Some(path) = builder.finish() else { return };
        let paint = Paint { shader: Shader::SolidColor(colour), anti_alias: true, ..Paint::default() };
        let stroke = Stroke { width: wide as f32, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    }

    fn fill(&mut self, path: &Path, shader: Shader<'_>) {
        let paint = Paint { shader, anti_alias: true, ..Paint::default() };
        self.pixmap.fill_path(path, &paint, FillRule::Winding, Transform::identity(), None);
    }

    fn path(&self, outline: &[[f64; 2]]) -> Option<Path> {
        let mut builder = PathBuilder::new();
        for (index, &pixel) in outline.iter().enumerate() {
            let [x, y] = self.onto(pixel).map(|value| value as f32);
            if index == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
        }
        builder.close();
        builder.finish()
    }

    fn colour(&self, light: Rgb, alpha: u8) -> Color {
        let [red, green, blue] = self.tone.rgb(light);
        Color::from_rgba8(red, green, blue, alpha)
    }

    fn pixel(&self, point: Place) -> [f64; 2] {
        let pixel = self.frame.pixel(point);
        [pixel.x, pixel.y]
    }

    /// A place in the photograph on the canvas, where pixels' centres lie at halves.
    fn onto(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [x - self.corner[0] as f64 + 0.5, y - self.corner[1] as f64 + 0.5]
    }

    fn place(&self, point: Place) -> [f64; 2] {
        self.onto(self.pixel(point))
    }
}

/// A gradient between two colours at two places of the canvas; two, for more would cost more than the rest of the plant.
fn blend(ends: [[f64; 2]; 2], colours: [Color; 2]) -> Shader<'static> {
    let [start, end] = ends.map(|[x, y]| Point::from_xy(x as f32, y as f32));
    let stops = vec![GradientStop::new(0.0, colours[0]), GradientStop::new(1.0, colours[1])];
    LinearGradient::new(start, end, stops, SpreadMode::Pad, Transform::identity())
        .unwrap_or(Shader::SolidColor(colours[1]))
}

/// The rectangle of the photograph, in pixels, that holds the plant; `None` if they do not meet.
fn bounds(body: &Body, frame: Frame) -> Option<([f64; 2], [f64; 2])> {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for (point, radius) in body.discs(24) {
        let pixel = frame.pixel(point);
        for (axis, value) in [pixel.x, pixel.y].into_iter().enumerate() {
            low[axis] = low[axis].min(value - radius * frame.px_per_cm);
            high[axis] = high[axis].max(value + radius * frame.px_per_cm);
        }
    }
    let meet = low[0] < f64::from(frame.width)
        && low[1] < f64::from(frame.height)
        && high[0] > 0.0
        && high[1] > 0.0
        && low.iter().chain(&high).all(|value| value.is_finite());
    meet.then_some((low, high))
}
