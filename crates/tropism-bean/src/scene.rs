//! Scene of the virtual tent: sizes, colours, light sources, and the settings of the photographs.
//!
//! Radiance is linear: 1 is the light of the flash on the plant at a height of 20 cm. Sources add up before the tone curve of
//! the camera is applied. Surfaces are Lambertian; glossy ones add a Blinn-Phong highlight.
//!
//! # References
//! Blinn 1977, doi:10.1145/563858.563893.

use serde::{Deserialize, Serialize};
use tropism::check::{OutOfRange, within};
use tropism::lamps::{Colour, Layout, Light};
use tropism::lighting::{FULL, Lighting};
use tropism::math;
use tropism::math::vector::{Vec3, add, dot, norm, normalize_or, scale, sub};

use super::view::{CAMERA, Frame, View};

/// The flash: a warm bulb above the pot, 68 cm above the soil (section 2.1).
pub const FLASH: Vec3 = [0.0, 68.0, 0.0];

/// The tent's flash at brightness 1.
const TENT_FLASH: Flash = Flash { at: FLASH, power: 1.0, unit_cm: 48.0, reach_cm: 20.0, bounce: 0.35 };

/// Radius of the pot's mouth, in cm (section 2.1: 15 cm across).
pub const POT_RADIUS: f64 = 7.5;

/// Height of the pot below the soil's surface, in cm (section 2.1).
pub const POT_DEPTH: f64 = 12.0;

/// Radius of the cylinder around which the strip of 144 diodes of each lamp is coiled, in cm. Chosen by hand on Fig. 2.
pub const LAMP_RADIUS: f64 = 3.2;

/// Height of that cylinder, in cm. Chosen by hand on Fig. 2.
pub const LAMP_HEIGHT: f64 = 10.0;

/// Red, green and blue as linear light, 0 to 1 where nothing is clipped.
pub type Rgb = [f64; 3];

/// Colour of the flash after white balance: a bulb of 2700 K (section 2.1). Chosen by hand on photographs.
const FLASH_TINT: Rgb = [1.0, 0.89, 0.70];

/// Colour of the paper's lamps, all three diodes on (630, 530 and 475 nm), after white balance. Chosen by hand on photographs.
const BLUE_TINT: Rgb = [0.13, 0.52, 1.45];

/// Colour of a lamp of `colour` in photographs, after white balance. All but the paper's are chosen by hand: white as daylight
/// beside the flash, red as one diode in the red band, far red through what a filter against infrared lets pass.
const fn tint(colour: Colour) -> Rgb {
    match colour {
        Colour::Blue => BLUE_TINT,
        Colour::White => [0.85, 0.9, 1.1],
        Colour::Red => [1.3, 0.12, 0.03],
        Colour::FarRed => [0.15, 0.01, 0.01],
    }
}

/// The scene's settings; `Default` is the paper's tent (section 2.1) at a size at which a photograph costs little.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// Columns of the photograph, 64 to 8192.
    pub width: u32,
    /// Rows of the photograph, 48 to 8192.
    pub height: u32,
    /// JPEG quality, 1 to 100.
    pub jpeg_quality: u8,
    /// Standard deviation of the sensor's noise in grey levels of 0 to 255, 0 to 20.
    pub noise: f64,
    /// Standard deviation of the lens's blur at the plane of the pot's axis, in cm, 0 to 0.5.
    pub blur: f64,
    /// Strength of the halo around the lit lamp, 0 to 4.
    pub glow: f64,
    /// Factor on all light, 0.01 to 10.
    pub exposure: f64,
    /// Brightness of the flash, 0 to 4.
    pub flash: f64,
    /// Brightness of a lit lamp at 35 cm, as a share of the flash at the plant, 0 to 4.
    pub lamp: f64,
    /// Depth of the folds in the black cloth, 0 (taut) to 3.
    pub folds: f64,
    /// Cameras: 1, the paper's, or 2, with one that sees the plant from the right.
    pub cameras: u8,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            width: 648,
            height: 486,
            jpeg_quality: 90,
            noise: 1.6,
            blur: 0.04,
            glow: 1.0,
            exposure: 1.0,
            flash: 1.0,
            lamp: 0.22,
            folds: 1.0,
            cameras: 1,
        }
    }
}

impl Scene {
    /// Checks that every setting lies in its range.
    ///
    /// # Errors
    /// [`OutOfRange`] names the first that does not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let ranges = [
            ("width", f64::from(self.width), 64.0, 8192.0),
            ("height", f64::from(self.height), 48.0, 8192.0),
            ("jpeg_quality", f64::from(self.jpeg_quality), 1.0, 100.0),
            ("noise", self.noise, 0.0, 20.0),
            ("blur", self.blur, 0.0, 0.5),
            ("glow", self.glow, 0.0, 4.0),
            ("exposure", self.exposure, 0.01, 10.0),
            ("flash", self.flash, 0.0, 4.0),
            ("lamp", self.lamp, 0.0, 4.0),
            ("folds", self.folds, 0.0, 3.0),
            ("cameras", f64::from(self.cameras), 1.0, 2.0),
        ];
        ranges.into_iter().try_for_each(|(key, value, low, high)| {
            within(key, value, low..=high).map_err(|error| error.in_table("scene"))
        })
    }

    /// How this scene's photographs map the plane of the pot's axis to pixels.
    #[must_use]
    pub fn frame(&self) -> Frame {
        Frame::new(self.width, self.height)
    }
}

/// Light sources that are on, in the coordinates of a camera.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LightSources {
    flash: Flash,
    lamp: f64,
    glow: f64,
    lit: Vec<Lit>,
}

/// A flash in the coordinates of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Flash {
    /// Its place, in cm.
    pub(super) at: Vec3,
    /// Its brightness.
    pub(super) power: f64,
    /// Distance at which its irradiance is 1 at brightness 1, in cm.
    pub(super) unit_cm: f64,
    /// Its radius with its shade, in cm: it softens the inverse-square law nearby. The tent's is chosen by hand on photographs.
    pub(super) reach_cm: f64,
    /// Ambient share: light after many reflections. The tent's is chosen by hand on photographs.
    pub(super) bounce: f64,
}

/// A lit lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lit {
    pub(super) light: Light,
    /// Where its light comes from, in the camera's coordinates, in cm.
    pub(super) bulb: Vec3,
    /// Its power, above 0 and at most 1.
    pub(super) power: f64,
    /// Its colour at full power.
    tint: Rgb,
}

impl LightSources {
    /// Lamps that `layout` does not have are dark.
    pub(super) fn new(scene: &Scene, layout: &Layout, lighting: Lighting, flash: bool, view: View) -> Self {
        let lit = |(light, level): (Light, u8)| {
            let lamp = layout.lamps().get(light.index())?;
            let (bulb, power) = (view.to_camera(bulb(lamp.at)), f64::from(level) / f64::from(FULL));
            Some(Lit { light, bulb, power, tint: tint(lamp.colour) })
        };
        Self {
            flash: Flash { power: if flash { scene.flash * scene.exposure } else { 0.0 }, ..TENT_FLASH },
            lamp: scene.lamp * scene.exposure,
            glow: scene.glow,
            lit: lighting.lit().filter_map(lit).collect(),
        }
    }

    /// The flash of a camera beside its lens, and lamps that shine from `bulbs`: the brightness of each at 35 cm, and its colour.
    pub(super) fn of_node(flash: Flash, bulbs: impl Iterator<Item = (Light, Vec3, f64, Colour)>) -> Self {
        let lit = |(light, bulb, power, colour)| Lit { light, bulb, power, tint: tint(colour) };
        Self { flash, lamp: 1.0, glow: 0.0, lit: bulbs.map(lit).collect() }
    }

    /// Irradiance of a surface at `place` with unit `normal`. `wrap` is 0 for a Lambertian surface and larger for translucent
    /// ones (wrapped diffuse lighting).
    pub(super) fn at(&self, place: Vec3, normal: Vec3, wrap: f64) -> Rgb {
        let lamps = self.sum(|lit| self.by_lamp(lit, place, normal, wrap));
        let direct = add(self.by_flash(place, normal, wrap), lamps);
        add(self.bounced(), direct)
    }

    /// Length over which the light of the flash is painted as a gradient, in cm: the tent's is even over the whole plant.
    pub(super) fn even_cm(&self) -> f64 {
        if self.flash.unit_cm < TENT_FLASH.unit_cm { 0.5 * self.flash.unit_cm } else { f64::INFINITY }
    }

    /// Ambient light of the flash.
    pub(super) fn bounced(&self) -> Rgb {
        scale(FLASH_TINT, self.flash.power * self.flash.bounce)
    }

    /// Direct irradiance from the flash.
    pub(super) fn by_flash(&self, place: Vec3, normal: Vec3, wrap: f64) -> Rgb {
        let Flash { at, power, unit_cm, reach_cm, bounce } = self.flash;
        let to_flash = sub(at, place);
        let far = norm(to_flash);
        let spread = reach_cm * reach_cm;
        let direct =
            (unit_cm * unit_cm + spread) / (far * far + spread) * lambert(dot(to_flash, normal) / far, wrap);
        scale(FLASH_TINT, power * (1.0 - bounce) * direct)
    }

    /// The sum of what `shine` says of each lit lamp.
    pub(super) fn sum(&self, shine: impl Fn(Lit) -> Rgb) -> Rgb {
        self.lit.iter().fold([0.0; 3], |sum, &lit| add(sum, shine(lit)))
    }

    /// Direct irradiance from a lit lamp.
    pub(super) fn by_lamp(&self, lit: Lit, place: Vec3, normal: Vec3, wrap: f64) -> Rgb {
        let to_lamp = sub(lit.bulb, place);
        let far = norm(to_lamp).max(LAMP_RADIUS);
        let direct = (35.0 / far) * (35.0 / far) * lambert(dot(to_lamp, normal) / far, wrap);
        scale(lit.tint, self.lamp * lit.power * direct)
    }

    /// Blinn-Phong highlights of the lights on a glossy surface at `place`.
    pub(super) fn gloss(&self, place: Vec3, normal: Vec3) -> Rgb {
        let to_camera = normalize_or(sub(CAMERA, place), normal);
        let spot = |light: Vec3| {
            let half = normalize_or(add(normalize_or(sub(light, place), normal), to_camera), normal);
            math::pow(dot(half, normal).max(0.0), 30.0)
        };
        let flash = scale(FLASH_TINT, self.flash.power * spot(self.flash.at));
        let lamp = |lit: Lit| scale(lit.tint, 2.0 * self.lamp * lit.power * spot(lit.bulb));
        add(flash, self.sum(lamp))
    }

    /// Veiling glare of a lit lamp at `far` cm from its coil in the plane of the pot's axis: a steep core and a faint wide
    /// skirt. Amplitudes and widths chosen by hand on photographs.
    pub(super) fn veil(&self, lit: Lit, far: f64) -> Rgb {
        let falloff = 6.0 * math::exp(-far / 0.9) + 0.10 * math::exp(-far / 4.5);
        scale(lit.tint, self.lamp * lit.power * self.glow / 0.20 * falloff)
    }

    /// The power of a lamp, 0 if it is dark.
    pub(super) fn power(&self, light: Light) -> f64 {
        self.lit.iter().find(|lit| lit.light == light).map_or(0.0, |lit| lit.power)
    }
}

/// Wrapped Lambert's cosine law.
fn lambert(cosine: f64, wrap: f64) -> f64 {
    ((cosine + wrap) / (1.0 + wrap)).max(0.0)
}

/// The place from which a lamp at `centre` shines: the side of its coil that faces the plant along z.
fn bulb([x, y, z]: Vec3) -> Vec3 {
    let towards_plant = if z == 0.0 { 0.0 } else { -z.signum() };
    [x, y, z + LAMP_RADIUS * towards_plant]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_tent_passes_and_bad_settings_are_named() {
        Scene::default().check().unwrap();
        for (scene, named) in [
            (Scene { blur: f64::NAN, ..Scene::default() }, "scene.blur = NaN"),
            (Scene { width: 7, ..Scene::default() }, "scene.width = 7, wanted 64 to 8192"),
            (Scene { noise: -1.0, ..Scene::default() }, "scene.noise = -1"),
        ] {
            let error = scene.check().unwrap_err().to_string();
            assert!(error.contains(named), "{error}");
        }
    }

    #[test]
    fn light_falls_off_and_adds_up() {
        let scene = Scene::default();
        let light = |lit: Option<Light>, flash, place, normal| {
            let sources = LightSources::new(&scene, &Layout::wahby2016(), lit.into(), flash, View::Front);
            sources.at(place, normal, 0.0)
        };
        let [low, high] = [2.0, 25.0].map(|y| light(None, true, [0.0, y, 0.0], [0.0, 1.0, 0.0]));
        assert!(high[1] > 1.4 * low[1], "{high:?} {low:?}");
        let right = |lit, flash| light(lit, flash, [3.0, 15.0, 0.0], [1.0, 0.0, 0.0]);
        let lamp = right(Some(Light::RIGHT), false);
        let (flash, both) = (right(None, true), right(Some(Light::RIGHT), true));
        for band in 0..3 {
            assert!((lamp[band] + flash[band] - both[band]).abs() < 1e-12);
        }
        assert!(lamp[2] > lamp[0]);
        let at = |lighting| {
            let sources = LightSources::new(&scene, &Layout::wahby2016(), lighting, false, View::Front);
            sources.at([3.0, 15.0, 0.0], [0.0, 1.0, 0.0], 0.0)
        };
        let [left, half] = [Lighting::only(Light::LEFT), Lighting::DARK.with(Light::RIGHT, 51)].map(at);
        let together = at(Lighting::only(Light::LEFT).with(Light::RIGHT, 51));
        assert!((left[2] + half[2] - together[2]).abs() < 1e-12);
        assert!((at(Lighting::only(Light::RIGHT))[2] - 5.0 * half[2]).abs() < 1e-12);
    }
}
