//! The tent without its plant: one ray a pixel from the camera to the cloth, the pot or a lamp.
//!
//! Drawn once for each state of the lights and kept: while a plant grows, nothing here moves.

use super::cloth::{Cloth, Texture};
use super::tone::Tone;
use crate::geometry::{Pixel, Point};
use crate::greenhouse::scene::{LAMP_HEIGHT, LAMP_RADIUS, Lighting, POT_DEPTH, POT_RADIUS, Rgb, Scene};
use crate::greenhouse::vector::{length, minus, plus, scaled, unit};
use crate::greenhouse::view::{CAMERA, LAMPS, Place, WALL, project};
use crate::light::Light;
use crate::math;

const CLOTH: Rgb = [0.036, 0.033, 0.036];
const LINER: Rgb = [0.030, 0.026, 0.026];
const POT: Rgb = [0.36, 0.35, 0.37];
const LAMP: Rgb = [0.22, 0.22, 0.22];
const COIL: Rgb = [0.42, 0.42, 0.40];

/// How far the pot's cloth liner hangs over its rim, in cm.
const HEM: f64 = 1.0;

/// What stands in the tent whether or not a plant does.
#[derive(Clone, Debug)]
pub(super) struct Tent {
    cloth: Cloth,
    texture: Texture,
}

/// Where a ray meets something: the place, the way it faces, and its colour.
struct Hit {
    at: Place,
    normal: Place,
    colour: Rgb,
    /// The lamp that was met, if one was.
    lamp: Option<Light>,
}

impl Tent {
    pub(super) fn new(scene: &Scene, seed: u64) -> Self {
        Self { cloth: Cloth::new(scene, seed), texture: Texture { seed } }
    }

    /// Red, green and blue of each pixel, sharp.
    pub(super) fn photograph(&self, scene: &Scene, lighting: &Lighting, tone: &Tone) -> Vec<u8> {
        let frame = scene.frame();
        let mut rgb = Vec::with_capacity(3 * scene.width as usize * scene.height as usize);
        for row in 0..scene.height {
            for column in 0..scene.width {
                let centre = frame.point(Pixel::new(f64::from(column), f64::from(row)));
                // Edges need more than one ray; the cloth has none.
                let rays = if is_cloth(centre) { 1 } else { 3 };
                let mut seen = [0.0; 3];
                for ray in 0..rays * rays {
                    let offset = |step: i32| (f64::from(step) + 0.5) / f64::from(rays) - 0.5;
                    let point = Point::new(
                        centre.x + offset(ray % rays) / frame.px_per_cm,
                        centre.y + offset(ray / rays) / frame.px_per_cm,
                    );
                    // Clipping each ray keeps the edge of a lamp from outshining the pixel that holds it.
                    let light = self.light(point, lighting).map(|band| band.min(1.5));
                    seen = plus(seen, scaled(light, 1.0 / f64::from(rays * rays)));
                }
                rgb.extend(seen.map(|band| tone.grey(band)));
            }
        }
        rgb
    }

    /// The light that reaches the lens through a point of the plane of the pot's axis.
    fn light(&self, point: Point, lighting: &Lighting) -> Rgb {
        let along = minus([point.x, point.y, 0.0], CAMERA);
        let hit = self.meet(along);
        let shine = if hit.lamp.is_some() && hit.lamp == lighting.lit() {
            [4.0; 3]
        } else {
            let light = lighting.at(hit.at, hit.normal, 0.0);
            core::array::from_fn(|band| light[band] * hit.colour[band])
        };
        let veil = lighting.lit().map_or([0.0; 3], |light| lighting.veil(from_coil(point, light)));
        // A wide lens darkens towards its corners.
        let slant = CAMERA[2] / length(along);
        plus(scaled(shine, slant * slant), veil)
    }

    /// The nearest thing along a ray from the camera. The things do not overlap as the camera sees them, apart from the
    /// pot's own parts, which are tried from the nearest.
    fn meet(&self, along: Place) -> Hit {
        if let Some(hit) = self.meet_pot(along) {
            return hit;
        }
        for light in Light::BOTH {
            if let Some(hit) = meet_lamp(along, light) {
                return hit;
            }
        }
        self.meet_wall(along)
    }

    fn meet_wall(&self, along: Place) -> Hit {
        let at = on_ray(along, (WALL - CAMERA[2]) / along[2]);
        let [slope_x, slope_y, brightness] = self.cloth.at(at[0], at[1]);
        let normal = unit([-slope_x, -slope_y, 1.0], [0.0, 0.0, 1.0]);
        Hit { at, normal, colour: scaled(CLOTH, brightness), lamp: None }
    }

    fn meet_pot(&self, along: Place) -> Option<Hit> {
        let hem = |at: Place| HEM + 0.25 * self.texture.noise(20, 0.9 * at[0], 0.0);
        if let Some((at, normal)) = meet_cone(along, POT_RADIUS + 0.25, 0.0)
            && (-hem(at)..=0.3 * self.texture.noise(21, 0.5 * at[0], 3.0) + 0.1).contains(&at[1])
        {
            let crumple = 0.5 * self.texture.noise(22, 1.7 * at[0], 0.8 * at[1]);
            let normal = unit(plus(normal, [crumple, 0.35 + 0.8 * crumple, 0.0]), normal);
            return Some(Hit { at, normal, colour: LINER, lamp: None });
        }
        if along[1] < 0.0 {
            let at = on_ray(along, -CAMERA[1] / along[1]);
            let far = math::hypot(at[0], at[2]);
            if far < POT_RADIUS + 0.25 {
                return Some(self.liner(at, far));
            }
        }
        // The rim stands a little proud of the wall below it.
        let (at, normal, under) = meet_cone(along, POT_RADIUS - 0.1, 0.0)
            .filter(|(at, _)| (-3.0..=0.0).contains(&at[1]))
            .map(|(at, normal)| (at, normal, hem(at)))
            .or_else(|| {
                let (at, normal) = meet_cone(along, POT_RADIUS - 0.45, 0.14)?;
                (-POT_DEPTH..=-3.0).contains(&at[1]).then_some((at, normal, 3.0))
            })?;
        // What hangs over a surface keeps the flash off it.
        let shade = ((-at[1] - under) / 0.8).clamp(0.0, 1.0);
        let ring = if (-3.35..-3.0).contains(&at[1]) { 1.25 } else { 1.0 };
        Some(Hit { at, normal, colour: scaled(POT, (0.45 + 0.55 * shade) * ring), lamp: None })
    }

    /// The cloth that covers the soil, in folds that run to the stem, and dips within the rim.
    fn liner(&self, at: Place, far: f64) -> Hit {
        let turn = math::atan2(at[2], at[0]);
        let (around, inward) = (2.2 * turn, 0.5 * far);
        let fold = |a: f64, b: f64| {
            self.texture.noise(23, around + a, inward + b)
                + 0.5 * self.texture.noise(24, 2.3 * (around + a), 1.7 * (inward + b))
        };
        let (slope_around, slope_inward) = (fold(0.1, 0.0) - fold(0.0, 0.0), fold(0.0, 0.1) - fold(0.0, 0.0));
        let tangent = [-math::sin(turn), 0.0, math::cos(turn)];
        let radial = [math::cos(turn), 0.0, math::sin(turn)];
        let dip = if far > 5.2 { -0.5 } else { 0.0 };
        let lean = plus(scaled(tangent, 2.6 * slope_around), scaled(radial, 2.6 * slope_inward + dip));
        let deep = ((far - 6.9) / 0.5).clamp(0.0, 1.0);
        let shade = if far < 5.2 { 0.75 } else { 0.55 + 0.45 * deep };
        Hit {
            at,
            normal: unit(plus(lean, [0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]),
            colour: scaled(LINER, shade),
            lamp: None,
        }
    }
}

/// A place on the ray from the camera along `along`.
fn on_ray(along: Place, far: f64) -> Place {
    plus(CAMERA, scaled(along, far))
}

/// The front of an upright cone around the pot's axis: radius at y = 0, and what it narrows by per cm downwards.
fn meet_cone(along: Place, radius: f64, narrowing: f64) -> Option<(Place, Place)> {
    let [ox, oy, oz] = CAMERA;
    let [dx, dy, dz] = along;
    let wide = radius + narrowing * oy;
    let a = dx * dx + dz * dz - narrowing * narrowing * dy * dy;
    let b = ox * dx + oz * dz - narrowing * wide * dy;
    let c = ox * ox + oz * oz - wide * wide;
    let at = on_ray(along, first_root(a, b, c)?);
    let normal = unit([at[0], -narrowing * (radius + narrowing * at[1]), at[2]], [0.0, 0.0, 1.0]);
    Some((at, normal))
}

fn meet_lamp(along: Place, light: Light) -> Option<Hit> {
    let centre = lamp(light);
    let [ox, _, oz] = minus(CAMERA, centre);
    let [dx, _, dz] = along;
    let far =
        first_root(dx * dx + dz * dz, ox * dx + oz * dz, ox * ox + oz * oz - LAMP_RADIUS * LAMP_RADIUS)?;
    let at = on_ray(along, far);
    let up = at[1] - centre[1];
    if up.abs() > LAMP_HEIGHT / 2.0 {
        return None;
    }
    let normal = unit([at[0] - centre[0], 0.0, at[2] - centre[2]], [0.0, 0.0, 1.0]);
    // The strip is coiled in turns of 1.2 cm; a collar closes the cylinder below.
    let turn = math::atan2(normal[0], normal[2]) / core::f64::consts::TAU;
    let phase = up / 1.2 + turn;
    let wound = phase - phase.floor() < 0.75;
    let collar = up < -LAMP_HEIGHT / 2.0 + 1.4;
    let colour = if collar || wound { COIL } else { LAMP };
    Some(Hit { at, normal, colour, lamp: (!collar).then_some(light) })
}

/// The smaller root of `a t² + 2 b t + c = 0`.
fn first_root(a: f64, b: f64, c: f64) -> Option<f64> {
    let under = b * b - a * c;
    (under >= 0.0).then(|| (-b - under.sqrt()) / a)
}

fn lamp(light: Light) -> Place {
    LAMPS[if light == Light::Left { 0 } else { 1 }]
}

/// Distance in the picture from the upright line of a lamp's coil, in cm of the plane of the pot's axis.
fn from_coil(point: Point, light: Light) -> f64 {
    let centre = project(lamp(light));
    let above = (point.y - centre.y).abs() - 0.42 * LAMP_HEIGHT;
    math::hypot(point.x - centre.x, above.max(0.0))
}

/// Whether nothing but cloth can be seen near a point.
fn is_cloth(point: Point) -> bool {
    let pot = point.y < 2.5 && point.x.abs() < POT_RADIUS + 2.0;
    let lamps = Light::BOTH.into_iter().any(|light| {
        let centre = project(lamp(light));
        (point.x - centre.x).abs() < LAMP_RADIUS + 0.5 && (point.y - centre.y).abs() < 0.5 * LAMP_HEIGHT + 0.5
    });
    !pot && !lamps
}
