//! Small pictures that the nodes of a wall take of their surroundings, each with a flash beside its lens.
//!
//! In: the pose of a plant and how the lamps of the wall are lit. Out: a picture for each node, and its
//! [reading](tropism::nodes::green_reading). The plant is turned and moved to where the tent's camera stands in relation to it, and
//! painted as in photographs of the tent. Behind it is darkness: the flash of a node reaches some cm.

use serde::{Deserialize, Serialize};
use tropism::check::{self, OutOfRange};
use tropism::lamps::Colour;
use tropism::lighting::{FULL, Lighting};
use tropism::math::vector::{Vec3, add, cross, dot, normalize_or, scale, sub};
use tropism::math::{cos, exp, sin};
use tropism::nodes::{NodeSpec, NodeWall, STEM_RADIUS_CM, Sensors, green_excess, green_reading};
use tropism::photo::Image;

use super::body::Body;
use super::paint::Canvas;
use super::sensor::Noise;
use super::tone::ToneCurve;
use crate::pose::{Leaf, Node, Pose};
use crate::scene::{Flash, LightSources, Scene};
use crate::view::{CAMERA, Frame};

/// Reading that a stem across the picture gives at the range of the camera: the least that an
/// [`EchoDetector`](tropism::nodes::EchoDetector) takes for a plant if the picture has no noise.
const READING_AT_RANGE: f64 = 0.1;
/// Nothing is nearer to the lens, in cm. Chosen: the case of a node.
const NEAREST_CM: f64 = 0.5;
/// The flash of a node. Chosen: a diode beside the lens, exposed for what is 2 cm away.
const FLASH: Flash = Flash { at: CAMERA, power: 1.0, unit_cm: 2.0, reach_cm: 1.0, bounce: 0.0 };

/// The camera of each node of a virtual wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct NodeCamera {
    /// Columns of a picture, 8 to 640.
    pub width: u32,
    /// Rows of a picture, 8 to 640.
    pub height: u32,
    /// Width of what it sees, in degrees: 10 to 140.
    pub width_deg: f64,
    /// Distance at which an upright stem of 0.12 cm radius in the middle of a sharp picture gives a reading of 0.1, in cm: 1 to 10.
    pub range_cm: f64,
    /// Standard deviation of the noise of each colour, in grey levels of 0 to 255, 0 to 20.
    pub noise: f64,
}

impl Default for NodeCamera {
    /// Chosen by hand; docs/validation/nodes.md has what was measured with them.
    fn default() -> Self {
        Self { width: 32, height: 24, width_deg: 70.0, range_cm: 5.0, noise: 3.0 }
    }
}

impl NodeCamera {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        check::within("width", f64::from(self.width), 8.0..=640.0)?;
        check::within("height", f64::from(self.height), 8.0..=640.0)?;
        check::within("width_deg", self.width_deg, 10.0..=140.0)?;
        check::within("range_cm", self.range_cm, 1.0..=10.0)?;
        check::within("noise", self.noise, 0.0..=20.0)
    }

    /// The cameras of all nodes of `wall`; `seed` names the noise of their pictures.
    ///
    /// ```
    /// use tropism::{lighting::Lighting, nodes::{NodeWall, green_reading}};
    /// use tropism_bean::{Bean, Species, render::NodeCamera};
    /// let mut cameras = NodeCamera::default().cameras(&NodeWall::three_levels(), 1);
    /// let bean = Bean::new(Species::default().draw(1, 1.0), 1);
    /// let picture = cameras.picture(0, 0, Some((&bean.pose(), Lighting::DARK)));
    /// assert_eq!((picture.width, picture.height), (32, 24));
    /// ```
    #[must_use]
    pub fn cameras(&self, wall: &NodeWall, seed: u64) -> NodeCameras {
        let mut cameras = NodeCameras {
            frame: self.frame(SHARP),
            stands: wall.nodes.iter().map(Stand::of).collect(),
            lamps: wall.nodes.iter().map(|node| node.at).collect(),
            power: wall.power,
            tone: ToneCurve::new(),
            noise: Noise::new(seed, self.noise, 3 * self.width as usize),
            gain: 0.0,
        };
        let stem = Stand { at: [0.0; 3], axes: AXES }.view(&upright(self.range_cm));
        let lighting = LightSources::of_node(FLASH, std::iter::empty());
        let excess = green_excess(&cameras.painted(&stem, &lighting));
        cameras.gain = (exp(READING_AT_RANGE) - 1.0) / excess;
        cameras.frame = self.frame(1);
        cameras
    }

    /// How pictures with so many times more columns and rows map the plane of the pot's axis, which is as far from the camera as that
    /// of the tent.
    fn frame(&self, times: u32) -> Frame {
        let half = (0.5 * self.width_deg).to_radians();
        let width_cm = 2.0 * CAMERA[2] * sin(half) / cos(half);
        let (width, height) = (times * self.width, times * self.height);
        Frame { width, height, px_per_cm: f64::from(width) / width_cm }
    }
}

/// How many times more columns the picture of the calibration has. Chosen: a stem is some pixels wide.
const SHARP: u32 = 8;

/// Axes of the tent's camera: to the right, up, and backwards.
const AXES: [Vec3; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A stem that stands upright at `far` cm before a camera at the origin, longer than any picture is high.
fn upright(far: f64) -> Pose {
    let end = [0.0, 4.0 * far, -far];
    let node = |share: f64| Node { at: [0.0, share * end[1], -far], radius: STEM_RADIUS_CM };
    let leaf = Leaf { base: end, along: AXES[1], across: AXES[0], length: 0.0 };
    Pose {
        age_h: f64::INFINITY,
        stem: [-1.0, 0.0, 1.0].map(node).to_vec(),
        heading: AXES[1],
        leaves: [leaf; 2],
        spread: 1.0,
        withered: 1.0,
    }
}

/// Where a camera stands and how it is turned.
#[derive(Clone, Copy, Debug)]
struct Stand {
    at: Vec3,
    /// To its right, up, and backwards, of length 1.
    axes: [Vec3; 3],
}

impl Stand {
    /// A node's camera is level unless it looks straight up or down.
    fn of(node: &NodeSpec) -> Self {
        let back = scale(normalize_or(node.facing, AXES[2]), -1.0);
        let right = normalize_or(cross(AXES[1], back), AXES[0]);
        Self { at: node.at, axes: [right, cross(back, right), back] }
    }

    /// A direction in the coordinates of the camera.
    fn turned(&self, direction: Vec3) -> Vec3 {
        self.axes.map(|axis| dot(axis, direction))
    }

    /// A place in the coordinates of the camera, which stands where that of the tent does.
    fn placed(&self, place: Vec3) -> Vec3 {
        add(CAMERA, self.turned(sub(place, self.at)))
    }

    /// The visible plant in the coordinates of the camera.
    fn view(&self, pose: &Pose) -> Body {
        let mut body = Body::new(&pose.moved(|place| self.placed(place), |direction| self.turned(direction)));
        body.keep_off(NEAREST_CM);
        body
    }
}

/// The cameras of all nodes of a wall.
#[derive(Clone, Debug)]
pub struct NodeCameras {
    frame: Frame,
    stands: Vec<Stand>,
    /// Places of the lamps, in cm.
    lamps: Vec<Vec3>,
    /// Irradiance of a lamp at level 255 over that of the paper's lamp.
    power: f64,
    tone: ToneCurve,
    noise: Noise,
    /// Factor of the excess of green in a reading.
    gain: f64,
}

impl NodeCameras {
    /// The factor of the excess of green in a [reading](green_reading).
    #[must_use]
    pub const fn gain(&self) -> f64 {
        self.gain
    }

    /// The picture that `node` takes at `step` of a plant under its lamps, or of nothing.
    #[must_use]
    pub fn picture(&self, node: usize, step: u32, scene: Option<(&Pose, Lighting)>) -> Image {
        let stand = &self.stands[node];
        let mut picture = match scene {
            Some((pose, lighting)) => self.painted(&stand.view(pose), &self.sources(stand, lighting)),
            None => self.dark(),
        };
        // Each node has noise of its own.
        let frame = u64::from(step) * self.stands.len() as u64 + node as u64;
        self.noise.add(&mut picture.rgb, 3 * picture.width, frame);
        picture
    }

    fn sources(&self, stand: &Stand, lighting: Lighting) -> LightSources {
        let brightness = Scene::default().lamp * self.power;
        let bulb = |(light, level): (tropism::lamps::Light, u8)| {
            let at = stand.placed(*self.lamps.get(light.index())?);
            Some((light, at, brightness * f64::from(level) / f64::from(FULL), Colour::Blue))
        };
        LightSources::of_node(FLASH, lighting.lit().filter_map(bulb))
    }

    fn dark(&self) -> Image {
        let (width, height) = (self.frame.width as usize, self.frame.height as usize);
        Image { width, height, rgb: self.tone.rgb([0.0; 3]).repeat(width * height) }
    }

    /// The picture of a body before darkness, without noise.
    fn painted(&self, body: &Body, lighting: &LightSources) -> Image {
        let mut picture = self.dark();
        let Some(canvas) = Canvas::paint(body, self.frame, 1, lighting, &self.tone) else { return picture };
        let [left, top] = canvas.corner.map(|corner| corner as usize);
        let columns = canvas.pixmap.width() as usize;
        for (number, pixel) in canvas.pixmap.pixels().iter().enumerate() {
            let (x, y) = (left + number % columns, top + number / columns);
            let at = 3 * (y * picture.width + x);
            let through = u16::from(u8::MAX - pixel.alpha());
            for (byte, painted) in
                picture.rgb[at..at + 3].iter_mut().zip([pixel.red(), pixel.green(), pixel.blue()])
            {
                *byte = painted.saturating_add((u16::from(*byte) * through / 255) as u8);
            }
        }
        picture
    }
}

impl Sensors<(&Pose, Lighting)> for NodeCameras {
    fn read(&mut self, node: usize, step: u32, scene: Option<&(&Pose, Lighting)>) -> f64 {
        green_reading(&self.picture(node, step, scene.copied()), self.gain)
    }
}

#[cfg(test)]
mod tests {
    use tropism::random::{Purpose, derive};

    use super::*;
    use crate::{Bean, Species};

    /// A wall of one node at the origin that looks along z.
    fn wall() -> NodeWall {
        let mut wall = NodeWall::levels(&[8.0]);
        wall.nodes[0].at = [0.0; 3];
        wall
    }

    /// An upright stem at a place before the node.
    fn stem(x: f64, far: f64) -> Pose {
        upright(far).moved(|[_, y, z]| [x, y, -z], |direction| direction)
    }

    #[test]
    fn a_stem_reads_more_the_nearer_it_is_and_nothing_beside_or_behind() {
        let mut cameras = NodeCamera { noise: 0.0, ..NodeCamera::default() }.cameras(&wall(), 1);
        let mut read = |x: f64, far: f64| cameras.read(0, 0, Some(&(&stem(x, far), Lighting::DARK)));
        let readings: Vec<f64> = [8.0, 5.0, 4.0, 3.0, 2.0, 1.0].iter().map(|&far| read(0.0, far)).collect();
        assert!(readings.windows(2).all(|pair| pair[1] > pair[0]), "{readings:?}");
        assert!((readings[1] - READING_AT_RANGE).abs() < 0.05, "{readings:?}");
        // The picture is 70 degrees wide: it ends 0.7 cm aside for each cm of distance.
        assert!(read(2.0, 4.0) > 0.0 && read(4.0, 4.0) == 0.0);
        assert!(read(3.0, -4.0) == 0.0);
        assert_eq!(cameras.read(0, 0, None), 0.0);
    }

    #[test]
    fn cameras_are_turned_with_their_nodes() {
        let seen = |facing: Vec3, place: Vec3| {
            let mut wall = wall();
            wall.nodes[0].facing = facing;
            let mut cameras = NodeCamera { noise: 0.0, ..NodeCamera::default() }.cameras(&wall, 1);
            let pose =
                upright(0.0).moved(|[_, y, _]| [place[0], place[1] + 0.1 * y, place[2]], |along| along);
            cameras.read(0, 0, Some(&(&pose, Lighting::DARK))) > 0.0
        };
        let places = [[3.0, 0.0, 0.0], [0.0, 0.0, 3.0], [-3.0, 0.0, 0.0], [0.0, 0.0, -3.0]];
        for (number, facing) in places.into_iter().enumerate() {
            let found: Vec<bool> = places.iter().map(|&place| seen(facing, place)).collect();
            let wanted: Vec<bool> = (0..4).map(|place| place == number).collect();
            assert_eq!(found, wanted, "{facing:?}");
        }
        assert!(seen([0.0, -1.0, 0.0], [0.0, -3.0, 0.0]) && !seen([0.0, 1.0, 0.0], [0.0, -3.0, 0.0]));
    }

    #[test]
    fn plants_anywhere_around_a_camera_are_drawn() {
        let mut wall = NodeWall::three_levels();
        for number in 0..40 {
            let mut bean = Bean::new(Species::default().draw(number, 2.0), number);
            bean.advance(&[], 2880.0);
            let pose = bean.pose();
            let draw = |axis: u64| 1e-9 * (derive(number, Purpose::Trial, axis) % 1_000_000_000) as f64 - 0.5;
            for node in &mut wall.nodes {
                let apex = pose.apex();
                node.at = core::array::from_fn(|axis| apex[axis] + 6.0 * draw(axis as u64));
                node.facing = [draw(3), draw(4), draw(5)];
            }
            let mut cameras = NodeCamera::default().cameras(&wall, number);
            let reading = cameras.read(0, 0, Some(&(&pose, Lighting::DARK)));
            assert!(reading.is_finite() && reading >= 0.0);
        }
    }
}
