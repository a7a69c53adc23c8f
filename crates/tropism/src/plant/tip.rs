//! The tip-motion model: observed shifts in a table, one look-up a step however many data there are.
//!
//! For every node of a grid the mean of eq. (5) is computed once; a step reads the node nearest to the tip. On the nodes
//! the table is the reference [`super::window`] exactly; between them the window's centre is off by at most half a grid
//! step (0.05 cm), a tenth of its half-width.

use serde::{Deserialize, Serialize};

use super::shifts::{self, Shift, Window};
use super::{PlantModel, Shoot};
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
    #[error("found {key} = {found}, wanted {wanted}")]
    Setting {
        /// Which.
        key: &'static str,
        /// Its value.
        found: f64,
        /// Its range.
        wanted: &'static str,
    },
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
        let mut count = 0;
        let observed: Vec<Shift> =
            tracks.into_iter().inspect(|_| count += 1).flat_map(shifts::of_track).collect();
        if observed.is_empty() {
            return Err(ModelError::NoShifts { tracks: count });
        }
        Self::of_shifts(observed, config)
    }

    fn of_shifts(observed: Vec<Shift>, config: TipModelConfig) -> Result<Self, ModelError> {
        check(&config)?;
        for (index, shift) in observed.iter().enumerate() {
            let values = [shift.tip.x, shift.tip.y, shift.dx, shift.dy];
            if values.iter().any(|value| value.is_nan() || value.abs() > FARTHEST_CM) {
                return Err(ModelError::Shift { index, found: format!("{values:?}") });
            }
        }
        let table = Table::new(&shifts::with_mirrored(&observed), &config);
        Ok(Self { config, observed, table })
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

    /// The mean shift in x at the node nearest to `tip`, in cm, eq. (5); `None` where its window holds no data.
    #[must_use]
    pub fn mean_shift(&self, tip: Point, light: Light) -> Option<f64> {
        self.table
            .node(tip)
            .and_then(|node| self.table.has_data(node, light).then(|| self.table.shift(node, light)))
    }

    /// The node nearest to `tip`: where the model looks when the tip is there.
    #[must_use]
    pub fn nearest_node(&self, tip: Point) -> Point {
        let place = |value: f64| (value / self.config.grid_cm).round() * self.config.grid_cm;
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
        if observed.is_empty() {
            return Err(ModelError::NoShifts { tracks: 0 });
        }
        Self::of_shifts(observed, file.config)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    config: TipModelConfig,
    x: Vec<f64>,
    y: Vec<f64>,
    dx: Vec<f64>,
    dy: Vec<f64>,
    light: String,
}

fn check(config: &TipModelConfig) -> Result<(), ModelError> {
    let positive = |key, found: f64, wanted, most: f64| {
        if found > 0.0 && found <= most { Ok(()) } else { Err(ModelError::Setting { key, found, wanted }) }
    };
    positive("window.wx", config.window.wx, "a half-width above 0 and at most 20 cm", 20.0)?;
    positive("window.wy", config.window.wy, "a half-height above 0 and at most 20 cm", 20.0)?;
    if !(config.grid_cm >= 0.01 && config.grid_cm <= 5.0) {
        return Err(ModelError::Setting { key: "grid_cm", found: config.grid_cm, wanted: "0.01 to 5 cm" });
    }
    positive("growth.mean", config.growth.mean, "growth above 0 and at most 1 cm a step", 1.0)?;
    if !(config.growth.sd >= 0.0 && config.growth.sd <= 1.0) {
        return Err(ModelError::Setting {
            key: "growth.sd",
            found: config.growth.sd,
            wanted: "0 to 1 cm a step",
        });
    }
    Ok(())
}

impl PlantModel for TipModel {
    type Plant = Shoot;

    fn seedling(&self, tip: Point) -> Shoot {
        Shoot::upright(tip)
    }

    fn step(&self, plant: &Shoot, light: Light, luck: f64) -> Shoot {
        let shift =
            self.table.node(plant.tip).map_or(self.table.outside, |node| self.table.shift(node, light));
        plant.turned(shift, self.config.growth.draw(luck))
    }

    fn observe(&self, plant: &Shoot) -> Observation {
        Observation::simulated(plant.tip)
    }
}

/// The means on a grid around all data. Node (column, row) stands at `(left + column, bottom + row) * grid_cm`.
#[derive(Clone, Debug, PartialEq)]
struct Table {
    grid_cm: f64,
    left: i64,
    bottom: i64,
    columns: usize,
    rows: usize,
    /// Per light, then row by row: the shift, with the policy for empty windows already in it.
    shifts: Vec<f64>,
    has_data: Vec<bool>,
    /// The shift beyond the grid.
    outside: f64,
}

impl Table {
    fn new(shifts: &[Shift], config: &TipModelConfig) -> Self {
        let Window { wx, wy } = config.window;
        let reach = |half: f64| (half / config.grid_cm).ceil() as i64 + 1;
        let node = |value: f64| (value / config.grid_cm).round() as i64;
        let span = |value: fn(&Shift) -> f64, half| {
            let nodes = shifts.iter().map(|shift| node(value(shift)));
            let (least, most) = nodes.fold((i64::MAX, i64::MIN), |(a, b), at| (a.min(at), b.max(at)));
            (least - reach(half), most + reach(half))
        };
        let (left, right) = span(|shift| shift.tip.x, wx);
        let (bottom, top) = span(|shift| shift.tip.y, wy);
        let (columns, rows) = ((right - left + 1) as usize, (top - bottom + 1) as usize);
        let mut sums = vec![0.0; 2 * columns * rows];
        let mut counts = vec![0_u32; 2 * columns * rows];
        // Each shift is added to every node whose window holds it. A node meets its shifts in the order of the data, as
        // the reference does, so the sums have the same bits.
        for shift in shifts {
            let (column, row) = (node(shift.tip.x), node(shift.tip.y));
            for y in row - reach(wy)..=row + reach(wy) {
                for x in column - reach(wx)..=column + reach(wx) {
                    let centre = Point::new(x as f64 * config.grid_cm, y as f64 * config.grid_cm);
                    if config.window.holds(centre, shift.tip) {
                        let plane = shift.light as usize * rows;
                        let at = (plane + (y - bottom) as usize) * columns + (x - left) as usize;
                        sums[at] += shift.dx;
                        counts[at] += 1;
                    }
                }
            }
        }
        let has_data: Vec<bool> = counts.iter().map(|&count| count > 0).collect();
        let means = sums
            .iter()
            .zip(&counts)
            .map(|(sum, &count)| if count > 0 { sum / f64::from(count) } else { 0.0 });
        let mut table = Self {
            grid_cm: config.grid_cm,
            left,
            bottom,
            columns,
            rows,
            shifts: means.collect(),
            has_data,
            outside: 0.0,
        };
        if config.empty == Empty::Nearest {
            table.fill_from_nearest();
        }
        table
    }

    /// Gives each empty node the shift of the nearest node of the same light that has data: rings of growing size.
    fn fill_from_nearest(&mut self) {
        let filled: Vec<f64> = (0..self.shifts.len())
            .map(|at| if self.has_data[at] { self.shifts[at] } else { self.nearest(at) })
            .collect();
        self.shifts = filled;
    }

    fn nearest(&self, at: usize) -> f64 {
        let plane = at / (self.columns * self.rows);
        let (row, column) = (at / self.columns % self.rows, at % self.columns);
        let mut best = (usize::MAX, 0.0);
        for distance in 0..self.columns.max(self.rows) {
            if distance * distance > best.0 {
                break;
            }
            let rows = row.saturating_sub(distance)..=(row + distance).min(self.rows - 1);
            for y in rows {
                let is_edge = y.abs_diff(row) == distance;
                let step = if is_edge { 1 } else { (2 * distance).max(1) };
                let first = column as i64 - distance as i64;
                for x in (first..=first + 2 * distance as i64).step_by(step) {
                    let Ok(x) = usize::try_from(x) else { continue };
                    let candidate = (plane * self.rows + y) * self.columns + x;
                    if x >= self.columns || !self.has_data[candidate] {
                        continue;
                    }
                    let squared = x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2);
                    if squared < best.0 {
                        best = (squared, self.shifts[candidate]);
                    }
                }
            }
        }
        best.1
    }

    /// The nearest node, light left; `None` beyond the grid.
    fn node(&self, tip: Point) -> Option<usize> {
        let column = (tip.x / self.grid_cm).round() as i64 - self.left;
        let row = (tip.y / self.grid_cm).round() as i64 - self.bottom;
        let is_inside = (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row);
        is_inside.then(|| row as usize * self.columns + column as usize)
    }

    fn shift(&self, node: usize, light: Light) -> f64 {
        self.shifts[light as usize * self.columns * self.rows + node]
    }

    fn has_data(&self, node: usize, light: Light) -> bool {
        self.has_data[light as usize * self.columns * self.rows + node]
    }
}

#[cfg(test)]
mod tests {
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
                    assert_eq!(model.mean_shift(node, light), exact, "{node:?} {light}");
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
        let plant = model.seedling(Point::new(0.53, 6.17));
        let stepped = model.step(&plant, Light::Right, 0.3);
        let shift = shifts::window_mean(
            &reference.shifts,
            reference.window,
            model.nearest_node(plant.tip),
            Light::Right,
        );
        assert_eq!(stepped, plant.turned(shift.unwrap(), 0.033));
        // Between nodes the reference, whose window is centred on the tip itself, says nearly the same.
        let exact = reference.step(&plant, Light::Right, 0.3);
        assert!(stepped.tip.distance(exact.tip) < 0.02, "{stepped:?} {exact:?}");
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
            assert!(plant.tip.distance(image.tip.mirrored()) < 1e-9, "step {step}: {plant:?} {image:?}");
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
        let edge = Point::new(-2.5, 4.0);
        assert_eq!(nearest.mean_shift(edge, Light::Left), None);
        let table = &nearest.table;
        let node = table.node(edge).unwrap();
        let brute = (0..table.columns * table.rows)
            .filter(|&other| table.has_data(other, Light::Left))
            .min_by_key(|&other| {
                let (row, column) = (other / table.columns, other % table.columns);
                row.abs_diff(node / table.columns).pow(2) + column.abs_diff(node % table.columns).pow(2)
            })
            .map(|other| {
                let (row, column) = (other / table.columns, other % table.columns);
                row.abs_diff(node / table.columns).pow(2) + column.abs_diff(node % table.columns).pow(2)
            });
        let taken = (0..table.columns * table.rows).any(|other| {
            let (row, column) = (other / table.columns, other % table.columns);
            let squared =
                row.abs_diff(node / table.columns).pow(2) + column.abs_diff(node % table.columns).pow(2);
            Some(squared) == brute
                && table.has_data(other, Light::Left)
                && table.shift(other, Light::Left) == table.shift(node, Light::Left)
        });
        assert!(taken);
    }

    #[test]
    fn json_comes_back() {
        let model = model(TipModelConfig { empty: Empty::Nearest, ..TipModelConfig::default() });
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
        assert!(error(&text.replace("\"x\":[0.0", "\"x\":[1e300")).contains("shift 0"));
        let dark = Track::read_csv("tip_x_cm,tip_y_cm,light\n0,4,dark\n0,4,dark\n".as_bytes()).unwrap();
        let nothing = TipModel::fit([&dark], TipModelConfig::default()).unwrap_err().to_string();
        assert!(nothing.contains("no usable step in 1 tracks"), "{nothing}");
    }
}
