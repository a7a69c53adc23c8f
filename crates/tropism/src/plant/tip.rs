//! The paper's tip-motion model, eqs. (1)-(8), with a look-up table: the cost of a step does not depend on the amount of
//! data.
//!
//! For every node of a grid the mean of eq. (5) is computed once; a step reads the node nearest to the tip. On the nodes
//! the table equals the reference [`shifts::window_mean`]; between them the window's centre is off by at most half a grid step
//! (0.05 cm), a tenth of its half-width.
//!
//! The state of a plant is kept in single precision, good to 1 µm over an experiment, so that many plants side by side
//! (`simulation::batch`) have the same bits as one by one.

use super::PlantModel;
use super::fitted::{ModelError, shared_layout_and_period};
use super::shifts::{self, Shift};
use super::table::Table;
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::observation::Observation;
use crate::random::StepNoise;
use crate::track::Track;

pub use super::config::{Empty, Growth, TipModelConfig};

/// Coordinates beyond this are no plant. Chosen: far above every plant; it bounds the table's memory.
const FARTHEST_CM: f64 = 1000.0;

/// The paper's model of how a tip moves.
#[derive(Clone, Debug, PartialEq)]
pub struct TipModel {
    pub(super) layout: Layout,
    pub(super) period_min: f64,
    config: TipModelConfig,
    observed: Vec<Shift>,
    /// How many of the shifts, in their order, are of the first plant, of the second, and so on.
    pub(super) plants: Vec<usize>,
    pub(super) is_virtual: bool,
    table: Table,
}

impl TipModel {
    /// A model of all usable steps of `tracks` and their mirror images.
    ///
    /// # Errors
    /// [`ModelError`] where no step is usable, where the tracks differ in lamps or period, or where a setting is out of range.
    pub fn fit<'t>(
        tracks: impl IntoIterator<Item = &'t Track>,
        config: TipModelConfig,
    ) -> Result<Self, ModelError> {
        let tracks: Vec<&Track> = tracks.into_iter().collect();
        let (layout, period_min) = shared_layout_and_period(&tracks)?;
        let plants: Vec<Vec<Shift>> = tracks.into_iter().map(shifts::of_track).collect();
        let counts: Vec<usize> = plants.iter().map(Vec::len).collect();
        let config = TipModelConfig { growth: config.growth.over(period_min), ..config };
        Self::of_shifts(plants.concat(), counts, layout, period_min, config)
    }

    pub(super) fn of_shifts(
        observed: Vec<Shift>,
        plants: Vec<usize>,
        layout: Layout,
        period_min: f64,
        config: TipModelConfig,
    ) -> Result<Self, ModelError> {
        if observed.is_empty() {
            return Err(ModelError::NoShifts { tracks: plants.len() });
        }
        config.check()?;
        for (index, shift) in observed.iter().enumerate() {
            let values = [shift.tip.x, shift.tip.y, shift.dx, shift.dy];
            if values.iter().any(|value| value.is_nan() || value.abs() > FARTHEST_CM) {
                return Err(ModelError::Shift { index, found: format!("{values:?}") });
            }
        }
        let table = Table::new(&shifts::with_mirrored(&observed, &layout), layout.len(), &config);
        Ok(Self { layout, period_min, config, observed, plants, is_virtual: false, table })
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
        let node = self.table.node(tip.x as f32, tip.y as f32);
        self.table.has_data(node, light).then(|| self.table.at(node, light).into())
    }
}

/// The state of one plant of the model: the system configuration (x, L) of section 2.2.3, in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipState {
    /// x of the tip, in cm.
    pub x: f32,
    /// y of the tip, in cm.
    pub y: f32,
    /// Length L from the base to the tip, in cm.
    pub length: f32,
}

impl TipState {
    /// Eqs. (4)-(8): the plant grows by `growth` cm, its tip is shifted sideways by `shift` cm, and the shift becomes a
    /// rotation about the base.
    ///
    /// A tip that the temporary position puts on the base itself points up.
    #[must_use]
    #[inline]
    pub fn stepped(self, shift: f32, growth: f32) -> Self {
        let length = self.length + growth; // eq. (4)
        let x = self.x + shift; // eq. (5)
        let y = self.y + growth; // eq. (6)
        // eqs. (7) and (8): with alpha = atan2(y, x), cos(alpha) is x / hypot(x, y), and the sine likewise.
        let radius = (x * x + y * y).sqrt();
        let scale = length / radius;
        if radius == 0.0 {
            Self { x: 0.0, y: length, length }
        } else {
            Self { x: x * scale, y: y * scale, length }
        }
    }
}

impl PlantModel for TipModel {
    type Plant = TipState;

    fn seedling(&self, start: Point, _noise: &mut StepNoise) -> TipState {
        self.seedling_at(start)
    }

    fn step(&self, plant: &mut TipState, light: Light, noise: &mut StepNoise) {
        let shift = self.table.at(self.table.node(plant.x, plant.y), light);
        *plant = plant.stepped(shift, self.growth(noise.normal() as f32));
    }

    fn observe(&self, plant: &TipState) -> Observation {
        Observation::simulated(Point::new(plant.x.into(), plant.y.into()))
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn period_min(&self) -> f64 {
        self.period_min
    }
}

impl TipModel {
    /// The plant whose straight line from the base ends at `start`, in cm.
    pub(crate) fn seedling_at(&self, start: Point) -> TipState {
        TipState { x: start.x as f32, y: start.y as f32, length: crate::math::hypot(start.x, start.y) as f32 }
    }

    /// The growth that a standard normal draw stands for, in cm, eq. (4).
    #[inline]
    pub(crate) fn growth(&self, noise: f32) -> f32 {
        self.config.growth.mean as f32 + self.config.growth.sd as f32 * noise
    }

    /// The table of mean shifts.
    pub(crate) const fn table(&self) -> &Table {
        &self.table
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::math;
    use crate::plant::FittedModel;
    use crate::plant::shifts::Window;
    use crate::random::{self, NoiseStream, Purpose};

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
        let observed = shifts::with_mirrored(model.observed(), model.layout());
        let mut with_data = 0;
        for row in 0..180 {
            for column in -60..60 {
                let node = Point::new(f64::from(column) * 0.1, f64::from(row) * 0.1);
                for light in Light::BOTH {
                    let exact = shifts::window_mean(&observed, Window::default(), node, light);
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
        let observed = shifts::with_mirrored(model.observed(), model.layout());
        let (start, nearest) = (Point::new(0.53, 6.17), Point::new(5.0 * 0.1, 62.0 * 0.1));
        let noise = NoiseStream::new(1, Purpose::Trial, [0; 3]);
        let mut stepped = model.seedling_at(start);
        model.step(&mut stepped, Light::RIGHT, &mut noise.at(7));
        let after = |centre| {
            let shift = shifts::window_mean(&observed, Window::default(), centre, Light::RIGHT).unwrap();
            let growth = model.config().growth.with_noise(noise.normal(7));
            model.observe(&model.seedling_at(start).stepped(shift as f32, growth as f32)).tip
        };
        let tip = model.observe(&stepped).tip;
        assert!(tip.distance(after(nearest)) < 1e-6, "{tip:?}");
        // With a window that is centred on the tip itself it is nearly the same.
        assert!(tip.distance(after(start)) < 0.02, "{tip:?}");
    }

    proptest! {
        #[test]
        fn a_step_is_the_cosine_and_sine_of_eqs_7_and_8(
            x in -20.0..20.0_f32, y in 0.5..25.0_f32, shift in -2.0..2.0_f32, growth in -0.01..0.08_f32,
        ) {
            let plant = TipState { x, y, length: x.hypot(y) };
            let stepped = plant.stepped(shift, growth);
            let alpha = math::atan2(f64::from(y + growth), f64::from(x + shift));
            let length = f64::from(stepped.length);
            prop_assert!((f64::from(stepped.x) - length * math::cos(alpha)).abs() < 1e-5);
            prop_assert!((f64::from(stepped.y) - length * math::sin(alpha)).abs() < 1e-5);
            prop_assert!((stepped.length - plant.length - growth).abs() < 1e-5);
        }
    }

    #[test]
    fn a_mirrored_plant_moves_in_a_mirror() {
        let model = model(TipModelConfig::default());
        let noise = NoiseStream::new(1, Purpose::Trial, [0; 3]);
        let mut plant = model.seedling_at(Point::new(0.2, 4.0));
        let mut image = model.seedling_at(Point::new(-0.2, 4.0));
        for step in 0..200_u32 {
            let light = if step % 7 < 3 { Light::LEFT } else { Light::RIGHT };
            model.step(&mut plant, light, &mut noise.at(step));
            model.step(&mut image, model.layout().mirrored(light).unwrap(), &mut noise.at(step));
            assert_eq!((plant.x, plant.y), (-image.x, image.y), "step {step}");
        }
    }

    #[test]
    fn an_empty_window_follows_the_policy() {
        let far = Point::new(30.0, 40.0);
        let still = model(TipModelConfig::default());
        assert_eq!(still.mean_shift(far, Light::LEFT), None);
        let plant = still.seedling_at(far);
        let (mut stepped, noise) = (plant, NoiseStream::new(1, Purpose::Trial, [0; 3]));
        still.step(&mut stepped, Light::LEFT, &mut noise.at(0));
        assert_eq!(stepped, plant.stepped(0.0, still.growth(noise.normal(0) as f32)));

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
            assert_eq!(table.at(table.node(beyond, 5.0), Light::RIGHT), 0.0);
        }
    }

    #[test]
    fn steps_without_data_are_counted() {
        let model = model(TipModelConfig::default());
        let text = "tip_x_cm,tip_y_cm,light\n0,4,right\n30,40,right\n30,40,left\n0,4,left\n0,4,dark\n";
        let track = Track::read_csv(text.as_bytes()).unwrap();
        assert!(model.share_without_data(&track.samples) >= 0.5);
        let still = Track::read_csv("tip_x_cm,tip_y_cm,light\n0,4,right\n0,4,dark\n".as_bytes()).unwrap();
        assert_eq!(model.share_without_data(&still.samples), 0.0);
    }

    #[test]
    fn each_plant_has_a_model_of_its_own() {
        let both = model(TipModelConfig::default());
        let each = both.of_each_plant(usize::MAX).unwrap();
        assert_eq!(each.len(), 2);
        let alone = TipModel::fit(
            [&track(2, 300)],
            TipModelConfig { empty: Empty::Nearest, ..TipModelConfig::default() },
        );
        assert_eq!(each[1], alone.unwrap());
        assert_eq!(both.of_each_plant(1).unwrap(), each[..1]);
    }

    #[test]
    fn tracks_without_a_usable_step_are_refused() {
        let dark = Track::read_csv("tip_x_cm,tip_y_cm,light\n0,4,dark\n0,4,dark\n".as_bytes()).unwrap();
        let nothing = TipModel::fit([&dark], TipModelConfig::default()).unwrap_err().to_string();
        assert!(nothing.contains("no step of 1 tracks can be used"), "{nothing}");
    }

    #[test]
    fn tracks_of_different_intervals_are_refused() {
        let (five, mut ten) = (track(1, 50), track(2, 50));
        ten.period_min = 10.0;
        let error = TipModel::fit([&five, &ten], TipModelConfig::default()).unwrap_err().to_string();
        assert!(error.contains("track 2: found 10 minutes between steps, wanted 5"), "{error}");
    }
}
