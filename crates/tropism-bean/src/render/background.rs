//! The background of a photograph, by ray casting: cloth, pot and lamps.
//!
//! It is rendered once for each state of the lights and cached, because only the plant moves. Colours and strengths are chosen
//! by hand on photographs of a real tent unless stated otherwise.

use tropism::geometry::{Pixel, Point};
use tropism::lamps::{Lamp, Layout, Light};
use tropism::math;
use tropism::math::vector::{Vec3, add, norm, normalize_or, scale, sub};
use tropism::obstacle::Solid;

use super::body::{Body, nearness};
use super::cloth::{Cloth, Texture};
use super::paint::Canvas;
use super::solids::Solids;
use super::tone::ToneCurve;
use crate::scene::{FLASH, LAMP_HEIGHT, LAMP_RADIUS, LightSources, Lit, POT_DEPTH, POT_RADIUS, Rgb, Scene};
use crate::view::{CAMERA, View, WALL, project};

/// Albedo of black cloth: two dull browns, because its dye reflects near infrared.
const CLOTH: [Rgb; 2] = [[0.068, 0.040, 0.044], [0.055, 0.047, 0.030]];

/// How much more of the diodes' narrow light the dye gives back than of a bulb's, band by band.
const DIODES_ON_CLOTH: Rgb = [0.6, 1.0, 1.4];

const LINER: Rgb = [0.062, 0.042, 0.046];
const POT: Rgb = [0.62, 0.60, 0.64];
const STRIP_GAP: Rgb = [0.10, 0.10, 0.10];
const COIL: Rgb = [0.26, 0.26, 0.26];
const DIODE: Rgb = [0.52, 0.52, 0.48];
const CABLE: Rgb = [0.035, 0.035, 0.04];

/// Share of the bounced light that gets between the folds of the cloth. Chosen by eye.
const BETWEEN: f64 = 0.27;

/// How far the pot's cloth liner hangs over its rim, in cm. Chosen by eye.
const HEM: f64 = 1.0;

/// The tent without its plant.
#[derive(Clone, Debug)]
pub(super) struct Background {
    cloth: Cloth,
    texture: Texture,
    view: View,
    lamps: Vec<Coil>,
    solids: Solids,
}

/// A lamp: an upright cylinder around which its strip of diodes is coiled.
#[derive(Clone, Copy, Debug)]
struct Coil {
    light: Light,
    /// Centre in the camera's coordinates, in cm.
    centre: Vec3,
    /// Whether it stands at the tent's back wall, as the paper's do.
    is_on_wall: bool,
}

/// Intersection of a ray with a surface: place, normal, albedo and material.
struct Hit {
    at: Vec3,
    normal: Vec3,
    colour: Rgb,
    what: Thing,
}

/// Material of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Thing {
    Wall,
    /// Cloth and cable in front of the wall.
    Matt,
    Pot,
    Coil(Light),
    Wood,
    Metal,
}

impl Coil {
    /// Whether it stands between the plant and the camera.
    fn is_before_plant(&self) -> bool {
        LAMP_RADIUS < self.centre[2] && self.centre[2] + LAMP_RADIUS < CAMERA[2]
    }

    /// Its middle in the plane of the pot's axis, and half the width and height that hold it there, in cm.
    fn extent(&self) -> (Point, f64, f64) {
        let [x, y, z] = self.centre;
        let (middle, mut near, mut shift) = (project(self.centre), nearness(self.centre).max(1.0), 0.0);
        if !self.is_on_wall {
            let front = [x, y, z + LAMP_RADIUS];
            near = nearness(front).max(1.0);
            shift = middle.distance(project(front));
        }
        (middle, LAMP_RADIUS * near + shift + 0.5, 0.5 * LAMP_HEIGHT * near + shift + 0.5)
    }
}

impl Background {
    pub(super) fn new(scene: &Scene, layout: &Layout, seed: u64, view: View) -> Self {
        let cloth = Cloth::new(scene, seed, view);
        let mut background =
            Self { cloth, texture: Texture { seed }, view, lamps: Vec::new(), solids: Solids::default() };
        background.set_lamps(layout);
        background
    }

    /// Exchanges the lamps for those of `layout`.
    pub(super) fn set_lamps(&mut self, layout: &Layout) {
        let view = self.view;
        let coil = |(light, lamp): (Light, &Lamp)| Coil {
            light,
            centre: view.to_camera(lamp.at),
            is_on_wall: (lamp.at[2] - WALL).abs() <= LAMP_RADIUS,
        };
        self.lamps = layout.lights().zip(layout.lamps()).map(coil).collect();
    }

    /// Exchanges the solids.
    pub(super) fn set_solids(&mut self, solids: &[Solid]) {
        self.solids = Solids { solids: solids.to_vec(), view: self.view };
    }

    /// Erases the parts of a painted plant that a lamp or a solid occludes.
    pub(super) fn mask(&self, body: &Body, canvas: &mut Canvas<'_>) {
        if let Some((low, high)) = self.solids.extent() {
            let pixel_cm = 1.0 / canvas.frame.px_per_cm;
            canvas.erase(low, high, |point| self.solids.hides(body, point, pixel_cm));
        }
        for coil in self.lamps.iter().filter(|coil| coil.is_before_plant()) {
            let (centre, half_width, half_height) = coil.extent();
            let corner = |sign: f64| Point::new(centre.x + sign * half_width, centre.y + sign * half_height);
            canvas.erase(corner(-1.0), corner(1.0), |point| {
                self.meet_lamp(sub([point.x, point.y, 0.0], CAMERA), coil).is_some()
            });
        }
    }

    /// Red, green and blue of each pixel, sharp.
    pub(super) fn photograph(&self, scene: &Scene, lighting: &LightSources, tone: &ToneCurve) -> Vec<u8> {
        let frame = scene.frame();
        let lamps: Vec<_> = self.lamps.iter().map(Coil::extent).collect();
        let mut rgb = Vec::with_capacity(3 * scene.width as usize * scene.height as usize);
        for row in 0..scene.height {
            for column in 0..scene.width {
                let centre = frame.point(Pixel::new(f64::from(column), f64::from(row)));
                // Edges need more than one ray; the cloth has none, and is met before all else.
                let is_cloth = self.is_cloth(centre, &lamps);
                let rays = if is_cloth { 1 } else { 3 };
                let mut seen = [0.0; 3];
                for ray in 0..rays * rays {
                    let offset = |step: i32| (f64::from(step) + 0.5) / f64::from(rays) - 0.5;
                    let point = Point::new(
                        centre.x + offset(ray % rays) / frame.px_per_cm,
                        centre.y + offset(ray / rays) / frame.px_per_cm,
                    );
                    // Clipping each ray keeps the edge of a lamp from outshining the pixel that holds it.
                    let along = sub([point.x, point.y, 0.0], CAMERA);
                    let hit = if is_cloth { self.meet_wall(along) } else { self.meet(along) };
                    let light = self.light(point, along, &hit, lighting).map(|band| band.min(1.5));
                    seen = add(seen, scale(light, 1.0 / f64::from(rays * rays)));
                }
                rgb.extend(seen.map(|band| tone.grey(band)));
            }
        }
        rgb
    }

    /// The light that reaches the lens from `hit`, along a ray through a point of the plane of the pot's axis.
    fn light(&self, point: Point, along: Vec3, hit: &Hit, lighting: &LightSources) -> Rgb {
        let light = match hit.what {
            Thing::Coil(light) if lighting.power(light) > 0.0 => [40.0 * lighting.power(light); 3],
            Thing::Wall => self.on_wall(hit, lighting),
            Thing::Coil(_) => lighting.at(hit.at, hit.normal, 0.2),
            Thing::Matt | Thing::Pot => lighting.at(hit.at, hit.normal, 0.3),
            Thing::Wood | Thing::Metal => lighting.at(hit.at, hit.normal, 0.1),
        };
        let mut shine = core::array::from_fn(|band| light[band] * hit.colour[band]);
        if hit.what == Thing::Pot || hit.what == Thing::Metal {
            shine = add(shine, scale(lighting.gloss(hit.at, hit.normal), 0.35));
        }
        let veil = lighting.sum(|lit| lighting.veil(lit, self.off_coil(point, self.coil(lit))));
        // A wide lens darkens towards its corners.
        let slant = CAMERA[2] / norm(along);
        add(scale(shine, slant * slant), veil)
    }

    /// The light on the cloth. Half of a lamp's coil faces the cloth from close by, so that it gets more of the lamp than
    /// its distance from the lamp's middle suggests: around the lamp the cloth is brighter than the sensor can show.
    fn on_wall(&self, hit: &Hit, lighting: &LightSources) -> Rgb {
        let shade = |lamp: Vec3| self.solids.share_of_light(hit.at, lamp);
        let flash = scale(lighting.by_flash(hit.at, hit.normal, 0.0), 1.35 * shade(FLASH));
        let lamps = lighting.sum(|lit| {
            let flood = self.flood(hit.at, self.coil(lit));
            let lamp = scale(lighting.by_lamp(lit, hit.at, hit.normal, 0.1), shade(lit.bulb));
            core::array::from_fn(|band| lamp[band] * flood * DIODES_ON_CLOTH[band])
        });
        add(add(scale(lighting.bounced(), BETWEEN), flash), lamps)
    }

    /// How much more light a place of the cloth gets from a lamp than from a small one in the lamp's middle.
    fn flood(&self, at: Vec3, coil: &Coil) -> f64 {
        if !coil.is_on_wall {
            return 1.0;
        }
        let from_lamp = sub(at, coil.centre);
        let near = 9.0 / norm(from_lamp).max(4.0);
        2.3 * (1.0 + 2.5 * near * near * near * near) * self.beam(from_lamp, coil.light)
    }

    /// Relative emission of a lamp along the cloth: its collar shades the cloth below it, and an uneven coil emits broad rays.
    fn beam(&self, [x, y, z]: Vec3, light: Light) -> f64 {
        // The cloth behind the lamps runs along the side camera's view.
        let turn = math::atan2(if self.view == View::Front { x } else { z }, -y);
        let below = ((0.55 - turn.abs()) / 0.25).clamp(0.0, 1.0);
        let layer = 30 + light.index() as u64;
        let rays = 0.26 * self.texture.noise(layer, 1.6 * turn, 0.0)
            + 0.16 * self.texture.noise(layer, 5.0 * turn, 7.0);
        (1.0 + rays) * (1.0 - 0.7 * below * below * (3.0 - 2.0 * below))
    }

    /// The nearest intersection along a ray from the camera.
    fn meet(&self, along: Vec3) -> Hit {
        let lamps = self.lamps.iter().filter_map(|coil| self.meet_lamp(along, coil));
        let solid = self.solids.meet(along, self.texture).map(|hit| Hit {
            at: hit.at,
            normal: hit.normal,
            colour: hit.colour,
            what: if hit.is_glossy { Thing::Metal } else { Thing::Wood },
        });
        let things = self.meet_pot(along).into_iter().chain(lamps).chain(solid);
        things.max_by(|a, b| a.at[2].total_cmp(&b.at[2])).unwrap_or_else(|| self.meet_wall(along))
    }

    fn meet_wall(&self, along: Vec3) -> Hit {
        let far = (self.view.wall() - CAMERA[2]) / along[2];
        if self.view == View::Side {
            // The tent's back wall runs along the view, to the right of the plant.
            let beside = -WALL / along[0];
            if (0.0..far).contains(&beside) {
                return self.back_wall(on_ray(along, beside));
            }
        }
        let at = on_ray(along, far);
        if self.view == View::Front
            && let Some(across) = self.lamps.iter().find_map(|coil| on_cable(at, coil))
        {
            let normal = [across, 0.0, (1.0 - across * across).sqrt()];
            return Hit { at, normal, colour: CABLE, what: Thing::Matt };
        }
        let [slope_x, slope_y, brightness] = self.cloth.at(at[0], at[1]);
        let normal = normalize_or([-slope_x, -slope_y, 1.0], [0.0, 0.0, 1.0]);
        Hit { at, normal, colour: self.cloth_colour(at[0], at[1], brightness), what: Thing::Wall }
    }

    /// The cloth's colour at a place of a wall.
    fn cloth_colour(&self, x: f64, y: f64, brightness: f64) -> Rgb {
        let other = (0.5 + 0.8 * self.texture.noise(26, 0.045 * x, 0.03 * y)).clamp(0.0, 1.0);
        let weave = 1.0 + 0.07 * self.texture.noise(27, 6.0 * x, 4.0 * y);
        add(scale(CLOTH[0], (1.0 - other) * brightness * weave), scale(CLOTH[1], other * brightness * weave))
    }

    /// The tent's back wall as the side camera sees it.
    fn back_wall(&self, at: Vec3) -> Hit {
        let [slope_x, slope_y, brightness] = self.cloth.at(at[2], at[1]);
        let normal = normalize_or([-1.0, -slope_y, -slope_x], [-1.0, 0.0, 0.0]);
        Hit { at, normal, colour: self.cloth_colour(at[2], at[1], brightness), what: Thing::Wall }
    }

    /// The coil of a lit lamp.
    fn coil(&self, lit: Lit) -> &Coil {
        &self.lamps[lit.light.index()]
    }

    fn meet_pot(&self, along: Vec3) -> Option<Hit> {
        let hem = |at: Vec3| HEM + 0.25 * self.texture.noise(20, 0.9 * at[0], 0.0);
        let lip = |at: Vec3| 0.25 + 0.2 * self.texture.noise(21, 0.5 * at[0], 0.3 * at[2]);
        let cone = |radius, narrowing, side| meet_cone(along, radius, narrowing, side);
        let crumpled = |(at, normal): (Vec3, Vec3)| {
            let crumple = self.texture.noise(22, 1.3 * at[0], 0.8 * at[1] + at[2]);
            Hit {
                at,
                normal: normalize_or(add(normal, [crumple, 0.5, 0.0]), normal),
                colour: LINER,
                what: Thing::Matt,
            }
        };
        if let Some(hem) =
            cone(POT_RADIUS + 0.25, 0.0, -1.0).filter(|(at, _)| (-hem(*at)..=lip(*at)).contains(&at[1]))
        {
            return Some(crumpled(hem));
        }
        if along[1] < 0.0 {
            let at = on_ray(along, -CAMERA[1] / along[1]);
            let far = math::hypot(at[0], at[2]);
            if far < POT_RADIUS + 0.25 {
                return Some(self.liner(at, far));
            }
        }
        if let Some((at, normal)) =
            cone(POT_RADIUS + 0.25, 0.0, 1.0).filter(|(at, _)| (0.0..=lip(*at)).contains(&at[1]))
        {
            return Some(crumpled((at, scale(normal, -1.0))));
        }
        // The rim stands a little proud of the wall below it.
        let (at, normal, under) = cone(POT_RADIUS - 0.1, 0.0, -1.0)
            .filter(|(at, _)| (-3.0..=0.0).contains(&at[1]))
            .map(|(at, normal)| (at, normal, hem(at)))
            .or_else(|| {
                let (at, normal) = cone(POT_RADIUS - 0.45, 0.14, -1.0)?;
                (-POT_DEPTH..=-3.0).contains(&at[1]).then_some((at, normal, 3.0))
            })?;
        // What hangs over a surface keeps the flash off it.
        let shade = ((-at[1] - under) / 0.8).clamp(0.0, 1.0);
        Some(Hit { at, normal, colour: scale(POT, 0.45 + 0.55 * shade), what: Thing::Pot })
    }

    /// The cloth that covers the soil, in folds that run to the stem, and rises to the rim.
    fn liner(&self, at: Vec3, far: f64) -> Hit {
        let turn = math::atan2(at[2], at[0]);
        let height = |turn: f64, far: f64| {
            let (x, z) = (far * math::cos(turn), far * math::sin(turn));
            // Folds run outwards from the stem, broader where they are farther out.
            let swirl = turn + 0.5 * self.texture.noise(25, 0.3 * x, 0.3 * z);
            let ray = |layer: u64, count: f64| {
                self.texture.noise(layer, count * math::cos(swirl), count * math::sin(swirl) + 0.12 * far)
            };
            far / POT_RADIUS * (0.75 * ray(23, 2.2) + 0.40 * ray(24, 4.5))
        };
        let step = 0.05;
        let here = height(turn, far);
        let around = (height(turn + step / far.max(0.5), far) - here) / step;
        let outward = (height(turn, far + step) - here) / step;
        let tangent = [-math::sin(turn), 0.0, math::cos(turn)];
        let radial = [math::cos(turn), 0.0, math::sin(turn)];
        let rising = ((far - 5.5) / 2.0).clamp(0.0, 1.0);
        let slope = add(scale(tangent, -around), scale(radial, -outward - 0.6 * rising));
        // Hollows are darker than ridges.
        let colour = scale(LINER, (0.70 + 1.1 * here).clamp(0.15, 1.4));
        Hit {
            at,
            normal: normalize_or(add(slope, [0.0, 1.0, 0.0]), [0.0, 1.0, 0.0]),
            colour,
            what: Thing::Matt,
        }
    }

    fn meet_lamp(&self, along: Vec3, coil: &Coil) -> Option<Hit> {
        let centre = coil.centre;
        let [ox, _, oz] = sub(CAMERA, centre);
        let [dx, _, dz] = along;
        let far =
            root(dx * dx + dz * dz, ox * dx + oz * dz, ox * ox + oz * oz - LAMP_RADIUS * LAMP_RADIUS, -1.0)
                .filter(|far| *far > 0.0)?;
        let at = on_ray(along, far);
        let up = at[1] - centre[1];
        // What of it lies within the cloth of the wall is not seen.
        if up.abs() > LAMP_HEIGHT / 2.0 || (self.view == View::Side && at[0] > -WALL) {
            return None;
        }
        let normal = normalize_or([at[0] - centre[0], 0.0, at[2] - centre[2]], [0.0, 0.0, 1.0]);
        // The strip of 144 diodes a metre is coiled in turns of 1.2 cm; a collar closes the cylinder below.
        let turn = math::atan2(normal[0], normal[2]) / core::f64::consts::TAU;
        let part = |value: f64| value - value.floor();
        let phase = part(up / 1.2 + turn);
        let diode = part(turn * core::f64::consts::TAU * LAMP_RADIUS * 1.44);
        let colour = if up < 1.2 - LAMP_HEIGHT / 2.0 {
            COIL
        } else if phase > 0.8 {
            STRIP_GAP
        } else if (0.2..0.6).contains(&phase) && diode < 0.6 {
            DIODE
        } else {
            COIL
        };
        Some(Hit { at, normal, colour, what: Thing::Coil(coil.light) })
    }

    /// Distance in the picture from the upright line of a lamp's coil, in cm of the plane of the pot's axis.
    fn off_coil(&self, point: Point, coil: &Coil) -> f64 {
        let centre = project(coil.centre);
        // Lamps at other distances than the front camera's wall look larger or smaller, and their glow with them.
        let near = if self.view == View::Front && coil.is_on_wall { 1.0 } else { nearness(coil.centre) };
        let above = (point.y - centre.y).abs() / near - 0.42 * LAMP_HEIGHT;
        math::hypot((point.x - centre.x) / near, above.max(0.0))
    }

    /// Whether nothing but cloth can be seen near a point. `lamps` are their [extents](Coil::extent).
    fn is_cloth(&self, point: Point, lamps: &[(Point, f64, f64)]) -> bool {
        let pot = point.y < 2.5 && point.x.abs() < POT_RADIUS + 2.0;
        let lamps = lamps.iter().any(|(centre, half_width, half_height)| {
            (point.x - centre.x).abs() < *half_width && (point.y - centre.y).abs() < *half_height
        });
        !pot && !lamps && !self.solids.is_near(point)
    }
}

/// A place on the ray from the camera along `along`.
fn on_ray(along: Vec3, far: f64) -> Vec3 {
    add(CAMERA, scale(along, far))
}

/// An upright cone around the pot's axis, met from the front (`side` -1) or from within at the back (1): its radius at
/// y = 0, and what it narrows by per cm downwards. The normal points outwards.
fn meet_cone(along: Vec3, radius: f64, narrowing: f64, side: f64) -> Option<(Vec3, Vec3)> {
    let [ox, oy, oz] = CAMERA;
    let [dx, dy, dz] = along;
    let wide = radius + narrowing * oy;
    let a = dx * dx + dz * dz - narrowing * narrowing * dy * dy;
    let b = ox * dx + oz * dz - narrowing * wide * dy;
    let c = ox * ox + oz * oz - wide * wide;
    let at = on_ray(along, root(a, b, c, side)?);
    let normal = normalize_or([at[0], -narrowing * (radius + narrowing * at[1]), at[2]], [0.0, 0.0, 1.0]);
    Some((at, normal))
}

/// How far across a lamp's cable a place of the wall lies, from -1 to 1, if it lies on it: up from the lamp, in a bow.
fn on_cable(at: Vec3, coil: &Coil) -> Option<f64> {
    if !coil.is_on_wall {
        return None;
    }
    let [x, y, _] = coil.centre;
    let above = at[1] - y - 0.4 * LAMP_HEIGHT;
    let bow = x - x.signum() * (0.10 * above + 0.018 * above * above);
    let across = (at[0] - bow) / 0.35;
    (above > 0.0 && across.abs() < 1.0).then_some(across)
}

/// The smaller (`side` -1) or greater (1) root of `a t² + 2 b t + c = 0` with a positive `a`.
fn root(a: f64, b: f64, c: f64, side: f64) -> Option<f64> {
    let under = b * b - a * c;
    (under >= 0.0).then(|| (-b + side * under.sqrt()) / a)
}
