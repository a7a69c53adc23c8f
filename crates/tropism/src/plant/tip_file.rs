//! The tip-motion model as a model of measured plants, and its JSON file.

use serde::{Deserialize, Serialize};

use super::config::Empty;
use super::evenly;
use super::fitted::{FittedModel, ModelError};
use super::shifts::Shift;
use super::tip::{TipModel, TipModelConfig};
use crate::check::ensure;
use crate::file::schema_of;
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::track::{Sample, Track};

/// The schema of the file.
const SCHEMA: &str = "tropism.model/2";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    config: TipModelConfig,
    layout: Layout,
    period_min: f64,
    plants: Vec<usize>,
    is_virtual: bool,
    x: Vec<f64>,
    y: Vec<f64>,
    dx: Vec<f64>,
    dy: Vec<f64>,
    /// One digit a shift: the lamp's number in the layout.
    light: String,
}

impl FittedModel for TipModel {
    fn of_tracks(tracks: &[&Track], config: &TipModelConfig) -> Result<Self, ModelError> {
        Self::fit(tracks.iter().copied(), config.clone())
    }

    fn of_virtual_plants(mut self, is_virtual: bool) -> Self {
        self.is_virtual = is_virtual;
        self
    }

    fn is_virtual(&self) -> bool {
        self.is_virtual
    }

    /// Where a plant has no data, the nearest node with data is used.
    fn of_each_plant(&self, most: usize) -> Result<Vec<Self>, ModelError> {
        let config = TipModelConfig { empty: Empty::Nearest, ..self.config().clone() };
        let mut rest = self.observed();
        let own = self.plants.iter().map(|&count| rest.split_off(..count).expect("a part of all"));
        let usable: Vec<&[Shift]> = own.filter(|own| !own.is_empty()).collect();
        let model = |own: &[Shift]| {
            let (layout, config) = (self.layout.clone(), config.clone());
            let model = Self::of_shifts(own.to_vec(), vec![own.len()], layout, self.period_min, config)?;
            Ok(model.of_virtual_plants(self.is_virtual))
        };
        evenly(&usable, most).map(model).collect()
    }

    fn steps(&self) -> usize {
        self.observed().len()
    }

    fn tips(&self) -> Vec<Point> {
        self.observed().iter().map(|shift| shift.tip).collect()
    }

    /// Whether there is a lamp under which the window around `place` holds data.
    fn has_data(&self, place: Point) -> bool {
        self.layout.lights().any(|light| self.mean_shift(place, light).is_some())
    }

    fn without_data(&self) -> &'static str {
        "simulated plants grow straight over this gap"
    }

    /// There the model follows [`Empty`].
    fn share_without_data(&self, samples: &[Sample]) -> f64 {
        let lit = samples.iter().filter_map(|sample| Some((sample.tip, sample.light?)));
        let (without, steps) = lit.fold((0, 0), |(without, steps), (tip, light)| {
            (without + u32::from(self.mean_shift(tip, light).is_none()), steps + 1)
        });
        f64::from(without) / f64::from(steps.max(1))
    }

    fn to_json(&self) -> String {
        let column = |value: fn(&Shift) -> f64| self.observed().iter().map(value).collect();
        let file = File {
            schema: SCHEMA.to_owned(),
            config: self.config().clone(),
            layout: self.layout.clone(),
            period_min: self.period_min,
            plants: self.plants.clone(),
            is_virtual: self.is_virtual(),
            x: column(|shift| shift.tip.x),
            y: column(|shift| shift.tip.y),
            dx: column(|shift| shift.dx),
            dy: column(|shift| shift.dy),
            light: self.observed().iter().map(|shift| shift.light.letter()).collect(),
        };
        serde_json::to_string(&file).expect("numbers and text are JSON")
    }

    fn from_json(text: &str) -> Result<Self, ModelError> {
        let schema = schema_of(text)?;
        if schema != SCHEMA {
            return Err(ModelError::Schema { found: schema, wanted: SCHEMA });
        }
        let file: File = serde_json::from_str(text)?;
        let lengths = [file.x.len(), file.y.len(), file.dx.len(), file.dy.len(), file.light.len()];
        if lengths.iter().any(|&length| length != lengths[0]) {
            return Err(ModelError::Lengths { found: format!("{lengths:?}") });
        }
        let is_period = file.period_min > 0.0 && file.period_min.is_finite();
        ensure(is_period, "period_min", file.period_min, "minutes above 0")?;
        let mut observed = Vec::with_capacity(file.x.len());
        for (index, letter) in file.light.chars().enumerate() {
            let Some(light) = Light::of_letter(letter).filter(|&light| file.layout.contains(light)) else {
                return Err(ModelError::Shift { index, found: format!("light {letter:?}") });
            };
            let tip = Point::new(file.x[index], file.y[index]);
            observed.push(Shift { tip, dx: file.dx[index], dy: file.dy[index], light });
        }
        if file.plants.iter().try_fold(0_usize, |sum, &count| sum.checked_add(count)) != Some(observed.len())
        {
            let found = format!("plants {:?} for {} shifts", file.plants, observed.len());
            return Err(ModelError::Plants { found });
        }
        let model = Self::of_shifts(observed, file.plants, file.layout, file.period_min, file.config)?;
        Ok(model.of_virtual_plants(file.is_virtual))
    }
}
