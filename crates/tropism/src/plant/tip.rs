//! The tip-motion model: observed shifts in a table, one look-up a step however many data there are.
//!
//! For every node of a grid the mean of eq. (5) is computed once; a step reads the node nearest to the tip. On the nodes
//! the table is the reference [`super::window`] exactly; between them the window's centre is off by at most half a grid
//! step (0.05 cm), a tenth of its half-width.
//!
//! A shoot is kept in single precision, good to a thousandth of a millimetre over an experiment: so many plants at once
//! (`simulation::lanes`) are the same plants to the bit as one by one.

use serde::{Deserialize, Serialize};

use super::PlantModel;
use super::shifts::{self, Shift, Window};
use super::table::Table;
use crate::check::{OutOfRange, ensure};
use crate::geometry::Point;
use crate::light::Light;
use crate::observation::Observation;
use crate::track::Track;

/// Growth of the shoot in one step of five minutes, eq. (4).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Growth {
    /// Mean, in cm. Paper: 0.03.
    pub mean: f64,
    /// Standard deviation, in cm. Paper: 0.01.
    pub sd: f64,
}

impl Default for Growth {
    fn default() -> Self {
        Self { mean: 0.03, sd: 0.01 }
    }
}

impl Growth {
    /// The growth that a standard normal draw stands for, in cm.
    #[must_use]
    pub fn draw(&self, luck: f64) -> f64 {
        self.mean + self.sd * luck
    }
}

/// What the model does where its window holds no data: the white of Fig. 5, of which the paper says nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Empty {
    /// The tip is not shifted sideways; it only grows.
    #[default]
    Still,
    /// The shift of the nearest node that has data.
    Nearest,
}

/// How a model is made of tracks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TipModelConfig {
    /// Sliding window, eq. (1). Paper: 1 cm x 2 cm.
    pub window: Window,
    /// Distance between the nodes of the table, in cm.
    pub grid_cm: f64,
    /// Growth of a step, eq. (4).
    pub growth: Growth,
    /// What happens where a window is empty.
    pub empty: Empty,
}

impl Default for TipModelConfig {
    fn default() -> Self {
        Self { window: Window::default(), grid_cm: 0.1, growth: Growth::default(), empty: Empty::Still }
    }
}

/// Why there is no model.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// A setting out of its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// Tracks without a single usable step.
    #[error(
        "found no usable step in {tracks} tracks, wanted successive measured tips with a lit lamp between them"
    )]
    NoShifts {
        /// How many tracks were read.
        tracks: usize,
    },
    /// A value in the file that cannot be one.
    #[error("shift {index}: found {found}, wanted finite numbers below 1000 cm in size")]
    Shift {
        /// Position in the file, from 0.
        index: usize,
        /// What stands there.
        found: String,
    },
    /// The lists of the file differ in length.
    #[error("found {found} lists of different lengths, wanted as many x, y, dx and dy as letters in light")]
    Lengths {
        /// Their lengths.
        found: String,
    },
    /// The plants' shares do not make up the whole.
    #[error("found {found}, wanted plants to add up to the shifts")]
    Plants {
        /// The shares and the whole.
        found: String,
    },
    /// A schema that this version does not know.
    #[error("found schema {0:?}, wanted {SCHEMA:?}")]
    Schema(String),
    /// Not JSON of a model.
    #[error("found no model: {0}")]
    Json(#[from] serde_json::Error),
}

const SCHEMA: &str = "tropism.model/1";

/// Coordinates beyond this are no plant; it bounds the table's memory.
const FARTHEST_CM: f64 = 1000.0;

/// The paper's model of how a tip moves.
#[derive(Clone, Debug, PartialEq)]
pub struct TipModel {
    config: TipModelConfig,
    observed: Vec<Shift>,
    /// How many of the shifts, in their order, are of the first plant, of the second, and so on.
    plants: Vec<usize>,
    is_virtual: bool,
    table: Table,
}

impl TipModel {
    /// A model of all usable steps of `tracks` and their mirror images.
    ///
    /// # Errors
    /// [`ModelError`] where no step is usable or a setting is out of range.
    pub fn fit<'t>(
        tracks: impl IntoIterator<Item = &'t Track>,
        config: TipModelConfig,
    ) -> Result<Self, ModelError> {
        let plants: Vec<Vec<Shift>> = tracks.into_iter().map(shifts::of_track).collect();
        let counts: Vec<usize> = plants.iter().map(Vec::len).collect();
        Self::of_shifts(plants.concat(), counts, config)
    }

    fn of_shifts(
        observed: Vec<Shift>,
        plants: Vec<usize>,
        config: TipModelConfig,
    ) -> Result<Self, ModelError> {
        if observed.is_empty() {
            return Err(ModelError::NoShifts { tracks: plants.len() });
        }
        check(&config)?;
        for (index, shift) in observed.iter().enumerate() {
            let values = [shift.tip.x, shift.tip.y, shift.dx, shift.dy];
            if values.iter().any(|value| value.is_nan() || value.abs() > FARTHEST_CM) {
                return Err(ModelError::Shift { index, found: format!("{values:?}") });
            }
        }
        let table = Table::new(&shifts::with_mirrored(&observed), &config);
        Ok(Self { config, observed, plants, is_virtual: false, table })
    }

    /// The same model, known to be made of virtual plants or not: what is evolved on it says so.
    #[must_use]
    pub const fn of_virtual_plants(mut self, is_virtual: bool) -> Self {
        self.is_virtual = is_virtual;
        self
    }

    /// Whether it was made of virtual plants.
    #[must_use]
    pub const fn is_virtual(&self) -> bool {
        self.is_virtual
    }

    /// How the model was made.
    #[must_use]
    pub const fn config(&self) -> &TipModelConfig {
        &self.config
    }

    /// The observed shifts, without their mirror images.
    #[must_use]
    pub fn observed(&self) -> &[Shift] {
        &self.observed
    }

    /// A model of each plant by itself: what the plants of this model have in common is not in them, and where a plant
    /// never was, the nearest place stands in. How a controller does on them tells how it may do on a plant that nobody
    /// met.
    ///
    /// Plants without a usable step are left out.
    ///
    /// # Errors
    /// None that [`Self::fit`] would not have given for the same data.
    pub fn of_each_plant(&self) -> Result<Vec<Self>, ModelError> {
        let config = TipModelConfig { empty: Empty::Nearest, ..self.config.clone() };
        let mut rest = self.observed.as_slice();
        let mut models = Vec::new();
        for &count in &self.plants {
            let (own, others) = rest.split_at(count);
            rest = others;
            if count > 0 {
                let model = Self::of_shifts(own.to_vec(), vec![count], config.clone())?;
                models.push(model.of_virtual_plants(self.is_virtual));
            }
        }
        Ok(models)
    }

    /// The mean shift in x at the node nearest to `tip`, in cm, eq. (5); `None` where its window holds no data.
    #[must_use]
    pub fn mean_shift(&self, tip: Point, light: Light) -> Option<f64> {
        let node = self.table.node(tip.x as f32, tip.y as f32);
        self.table.has_data(node, light).then(|| self.table.at(node, light).into())
    }

    /// The share of a track's steps that begin where the model has no data: there it is its policy that is tested, not a
    /// plant.
    #[must_use]
    pub fn share_without_data(&self, track: &Track) -> f64 {
        let lit = track.samples.iter().filter_map(|sample| Some((sample.tip, sample.light?)));
        let (blind, steps) = lit.fold((0, 0), |(blind, steps), (tip, light)| {
            (blind + u32::from(self.mean_shift(tip, light).is_none()), steps + 1)
        });
        f64::from(blind) / f64::from(steps.max(1))
    }

    /// The node nearest to `tip`: where the model looks when the tip is there.
    #[must_use]
    pub fn nearest_node(&self, tip: Point) -> Point {
        let place = |value: f64| f64::from(self.table.nearest(value as f32)) * self.config.grid_cm;
        Point::new(place(tip.x), place(tip.y))
    }

    /// The same data in the model that is written straight from the equations.
    #[must_use]
    pub fn reference(&self) -> super::window::WindowModel {
        super::window::WindowModel {
            shifts: shifts::with_mirrored(&self.observed),
            window: self.config.window,
            growth: self.config.growth,
        }
    }

    /// Readable JSON with all data and settings; see `docs/formats.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let column = |value: fn(&Shift) -> f64| self.observed.iter().map(value).collect();
        let file = File {
            schema: SCHEMA.to_owned(),
            config: self.config.clone(),
            plants: self.plants.clone(),
            is_virtual: self.is_virtual,
            x: column(|shift| shift.tip.x),
            y: column(|shift| shift.tip.y),
            dx: column(|shift| shift.dx),
            dy: column(|shift| shift.dy),
            light: self
                .observed
                .iter()
                .map(|shift| if shift.light == Light::Left { 'l' } else { 'r' })
                .collect(),
        };
        serde_json::to_string(&file).expect("numbers and text are JSON")
    }

    /// Reads [`Self::to_json`].
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let file: File = serde_json::from_str(text)?;
        if file.schema != SCHEMA {
            return Err(ModelError::Schema(file.schema));
        }
        let lengths = [file.x.len(), file.y.len(), file.dx.len(), file.dy.len(), file.light.len()];
        if lengths.iter().any(|&length| length != lengths[0]) {
            return Err(ModelError::Lengths { found: format!("{lengths:?}") });
        }
        let mut observed = Vec::with_capacity(file.x.len());
        for (index, letter) in file.light.chars().enumerate() {
            let light = match letter {
                'l' => Light::Left,
                'r' => Light::Right,
                _ => return Err(ModelError::Shift { index, found: format!("light {letter:?}") }),
            };
            let tip = Point::new(file.x[index], file.y[index]);
            observed.push(Shift { tip, dx: file.dx[index], dy: file.dy[index], light });
        }
        if file.plants.iter().try_fold(0_usize, |sum, &count| sum.checked_add(count)) != Some(observed.len())
        {
            let found = format!("plants {:?} for {} shifts", file.plants, observed.len());
            return Err(ModelError::Plants { found });
        }
        Ok(Self::of_shifts(observed, file.plants, file.config)?.of_virtual_plants(file.is_virtual))
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    config: TipModelConfig,
    plants: Vec<usize>,
    is_virtual: bool,
    x: Vec<f64>,
    y: Vec<f64>,
    dx: Vec<f64>,
    dy: Vec<f64>,
    light: String,
}

fn check(config: &TipModelConfig) -> Result<(), OutOfRange> {
    let TipModelConfig { window, grid_cm, growth, .. } = config;
    let positive =
        |key, found: f64, wanted, most: f64| ensure(found > 0.0 && found <= most, key, found, wanted);
    positive("window.wx", window.wx, "a half-width above 0 and at most 20 cm", 20.0)?;
    positive("window.wy", window.wy, "a half-height above 0 and at most 20 cm", 20.0)?;
    ensure((0.01..=5.0).contains(grid_cm), "grid_cm", grid_cm, "0.01 to 5 cm")?;
    positive("growth.mean", growth.mean, "growth above 0 and at most 1 cm a step", 1.0)?;
    ensure((0.0..=1.0).contains(&growth.sd), "growth.sd", growth.sd, "0 to 1 cm a step")
}

/// The state of one plant of the model: the system configuration (x, L) of section 2.2.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sprout {
    /// x of the tip, in cm.
    pub x: f32,
    /// y of the tip, in cm.
    pub y: f32,
    /// Length L from the base to the tip, in cm.
    pub length: f32,
}

impl Sprout {
    /// Eqs. (4)-(8), as [`super::Shoot::turned`].
    #[must_use]
    #[inline]
    pub fn turned(self, shift: f32, growth: f32) -> Self {
        let length = self.length + growth; // eq. (4)
        let x = self.x + shift; // eq. (5)
        let y = self.y + growth; // eq. (6)
        // eqs. (7) and (8): cos(atan2(y, x)) is x / hypot(x, y), and the sine likewise.
        let reach = (x * x + y * y).sqrt();
        let stretch = length / reach;
        if reach == 0.0 {
            Self { x: 0.0, y: length, length }
        } else {
            Self { x: x * stretch, y: y * stretch, length }
        }
    }
}

impl PlantModel for TipModel {
    type Plant = Sprout;

    fn seedling(&self, tip: Point) -> Sprout {
        Sprout { x: tip.x as f32, y: tip.y as f32, length: crate::math::hypot(tip.x, tip.y) as f32 }
    }

    fn step(&self, plant: &Sprout, light: Light, luck: f64) -> Sprout {
        plant.turned(self.table.at(self.table.node(plant.x, plant.y), light), self.growth(luck as f32))
    }

    fn observe(&self, plant: &Sprout) -> Observation {
        Observation::simulated(Point::new(plant.x.into(), plant.y.into()))
    }
}

impl TipModel {
    /// The growth that a standard normal draw stands for, in cm, eq. (4).
    #[inline]
    pub(crate) fn growth(&self, luck: f32) -> f32 {
        self.config.growth.mean as f32 + self.config.growth.sd as f32 * luck
    }

    /// The table of mean shifts.
    pub(crate) const fn table(&self) -> &Table {
        &self.table
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shoot;
    use super::*;
    use crate::random::{self, Purpose};

    fn track(seed: u64, steps: u32) -> Track {
        let mut rng = random::stream(seed, Purpose::Growth, 0);
        let mut text = "tip_x_cm,tip_y_cm,light\n".to_owned();
        let (mut x, mut y) = (0.0, 4.0);
        for step in 0..steps {
            let right = step / 40 % 2 == 0;
            text += &format!("{x:.4},{y:.4},{}\n", if right { "right" } else { "left" });
            x += if right { 0.05 } else { -0.05 } + 0.05 * random::normal(&mut rng);
            y += 0.03 + 0.05 * random::normal(&mut rng);
        }
        Track::read_csv(text.as_bytes()).unwrap()
    }

    fn model(config: TipModelConfig) -> TipModel {
        TipModel::fit([&track(1, 300), &track(2, 300)], config).unwrap()
    }

    #[test]
    fn the_table_is_the_reference_on_every_node() {
        let model = model(TipModelConfig::default());
        let reference = model.reference();
        let mut with_data = 0;
        for row in 0..180 {
            for column in -60..60 {
                let node = Point::new(f64::from(column) * 0.1, f64::from(row) * 0.1);
                for light in Light::BOTH {
                    let exact = shifts::window_mean(&reference.shifts, reference.window, node, light);
                    let single = exact.map(|mean| f64::from(mean as f32));
                    assert_eq!(model.mean_shift(node, light), single, "{node:?} {light}");
                    with_data += usize::from(exact.is_some());
                }
            }
        }
        assert!(with_data > 1000, "{with_data}");
    }

    #[test]
    fn a_step_looks_up_the_nearest_node() {
        let model = model(TipModelConfig::default());
        let reference = model.reference();
        let start = Point::new(0.53, 6.17);
        let stepped = model.step(&model.seedling(start), Light::Right, 0.3);
        let node = model.nearest_node(start);
        let shift = shifts::window_mean(&reference.shifts, reference.window, node, Light::Right);
        let tip = model.observe(&stepped).tip;
        let same = Shoot::upright(start).turned(shift.unwrap(), model.config().growth.draw(0.3)).tip;
        assert!(tip.distance(same) < 1e-6, "{tip:?} {same:?}");
        // Between nodes the reference, whose window is centred on the tip itself, says nearly the same.
        let exact = reference.step(&reference.seedling(start), Light::Right, 0.3);
        assert!(tip.distance(exact.tip) < 0.02, "{tip:?} {exact:?}");
    }

    #[test]
    fn a_mirrored_plant_moves_in_a_mirror() {
        let model = model(TipModelConfig::default());
        let mut plant = model.seedling(Point::new(0.2, 4.0));
        let mut image = model.seedling(Point::new(-0.2, 4.0));
        for step in 0..200_u32 {
            let light = if step % 7 < 3 { Light::Left } else { Light::Right };
            let luck = f64::from(step % 5) - 2.0;
            plant = model.step(&plant, light, luck);
            image = model.step(&image, light.mirrored(), luck);
            assert_eq!((plant.x, plant.y), (-image.x, image.y), "step {step}");
        }
    }

    #[test]
    fn an_empty_window_follows_the_policy() {
        let far = Point::new(30.0, 40.0);
        let still = model(TipModelConfig::default());
        assert_eq!(still.mean_shift(far, Light::Left), None);
        let plant = still.seedling(far);
        assert_eq!(still.step(&plant, Light::Left, 0.0), plant.turned(0.0, 0.03));

        let nearest = model(TipModelConfig { empty: Empty::Nearest, ..TipModelConfig::default() });
        let table = &nearest.table;
        let (columns, nodes) = (table.columns as usize, (table.columns * table.rows) as usize);
        let is_on_margin = |at: usize| {
            let (row, column) = (at % nodes / columns, at % columns);
            [row, table.rows as usize - 1 - row, column, columns - 1 - column].contains(&0)
        };
        let mut filled = 0;
        for at in (0..2 * nodes).step_by(37).filter(|&at| !table.has_data[at]) {
            if is_on_margin(at) {
                assert_eq!(table.shifts[at], 0.0, "beyond the grid");
                continue;
            }
            let distance = |other: usize| {
                (at / columns).abs_diff(other / columns).pow(2)
                    + (at % columns).abs_diff(other % columns).pow(2)
            };
            let with_data =
                || (0..2 * nodes).filter(|&other| other / nodes == at / nodes && table.has_data[other]);
            let least = with_data().map(distance).min().unwrap();
            let is_taken = with_data().any(|other| {
                distance(other) == least && table.shifts[other].to_bits() == table.shifts[at].to_bits()
            });
            assert!(is_taken, "place {at}");
            filled += 1;
        }
        assert!(filled > 100, "{filled}");
    }

    #[test]
    fn the_nearest_node_is_the_rounded_coordinate() {
        let table = model(TipModelConfig::default()).table;
        for step in -40_000..40_000 {
            let coordinate = step as f32 * 0.000_83;
            let rounded = (coordinate * table.nodes_per_cm).round_ties_even() as i32;
            assert_eq!(table.nearest(coordinate), rounded);
            let (column, row) = (table.place(coordinate, 9.0, 0), table.place(0.0, coordinate, 0));
            let (first, middle) = (table.place(-1e9, 9.0, 0), table.place(0.0, -1e9, 0));
            let (most_right, highest) = (table.columns - 1, table.rows - 1);
            assert_eq!((column - first) as i32, (rounded - table.left).clamp(0, most_right));
            let rows_up = (row - middle) as i32 / table.columns;
            assert_eq!(rows_up, (rounded - table.bottom).clamp(0, highest));
        }
        for beyond in [f32::NAN, f32::INFINITY, -1e30] {
            let column = table.node(beyond, 5.0) as i32 % table.columns;
            assert!([0, table.columns - 1].contains(&column), "{beyond}");
            assert_eq!(table.at(table.node(beyond, 5.0), Light::Right), 0.0);
        }
    }

    #[test]
    fn steps_without_data_are_counted() {
        let model = model(TipModelConfig::default());
        let text = "tip_x_cm,tip_y_cm,light\n0,4,right\n30,40,right\n30,40,left\n0,4,left\n0,4,dark\n";
        let track = Track::read_csv(text.as_bytes()).unwrap();
        assert!(model.share_without_data(&track) >= 0.5);
        let still = Track::read_csv("tip_x_cm,tip_y_cm,light\n0,4,right\n0,4,dark\n".as_bytes()).unwrap();
        assert_eq!(model.share_without_data(&still), 0.0);
    }

    #[test]
    fn each_plant_has_a_model_of_its_own() {
        let both = model(TipModelConfig::default());
        let each = both.of_each_plant().unwrap();
        assert_eq!(each.len(), 2);
        let alone = TipModel::fit(
            [&track(2, 300)],
            TipModelConfig { empty: Empty::Nearest, ..TipModelConfig::default() },
        );
        assert_eq!(each[1], alone.unwrap());
    }

    #[test]
    fn json_comes_back() {
        let model = model(TipModelConfig { empty: Empty::Nearest, ..TipModelConfig::default() });
        let model = model.of_virtual_plants(true);
        assert_eq!(TipModel::from_json(&model.to_json()).unwrap(), model);
    }

    #[test]
    fn bad_models_are_refused() {
        let text = model(TipModelConfig::default()).to_json();
        let error = |text: &str| TipModel::from_json(text).unwrap_err().to_string();
        assert!(error("{").contains("no model"));
        assert!(error(&text.replace("model/1", "model/9")).contains("wanted \"tropism.model/1\""));
        assert!(error(&text.replace("\"grid_cm\":0.1", "\"grid_cm\":0.0")).contains("grid_cm = 0"));
        assert!(error(&text.replace("\"wx\":0.5", "\"wx\":-1")).contains("window.wx"));
        assert!(error(&text.replace("\"light\":\"r", "\"light\":\"x")).contains("light 'x'"));
        assert!(error(&text.replace("\"light\":\"r", "\"light\":\"rr")).contains("lengths"));
        assert!(error(&text.replace("\"plants\":[299,", "\"plants\":[300,")).contains("add up"));
        assert!(error(&text.replace("\"x\":[0.0", "\"x\":[1e300")).contains("shift 0"));
        let dark = Track::read_csv("tip_x_cm,tip_y_cm,light\n0,4,dark\n0,4,dark\n".as_bytes()).unwrap();
        let nothing = TipModel::fit([&dark], TipModelConfig::default()).unwrap_err().to_string();
        assert!(nothing.contains("no usable step in 1 tracks"), "{nothing}");
    }
}
