//! The tip-motion model as a JSON file.
//!
//! Schema `tropism.model/2` names the lamps and the period. Schema `tropism.model/1` knew the paper's two lamps and five
//! minutes only, and is read as such.

use serde::{Deserialize, Serialize};

use super::shifts::Shift;
use super::tip::{ModelError, SCHEMA, TipModel, TipModelConfig};
use crate::check::ensure;
use crate::file::schema_of;
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::track::PAPER_PERIOD_MIN;

/// The schema before lamps and period were data.
const SCHEMA_1: &str = "tropism.model/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    config: TipModelConfig,
    #[serde(default)]
    layout: Layout,
    #[serde(default = "paper_period")]
    period_min: f64,
    plants: Vec<usize>,
    is_virtual: bool,
    x: Vec<f64>,
    y: Vec<f64>,
    dx: Vec<f64>,
    dy: Vec<f64>,
    /// One character a shift: the lamp's number in the layout. In schema 1: `l` or `r`.
    light: String,
}

const fn paper_period() -> f64 {
    PAPER_PERIOD_MIN
}

impl TipModel {
    /// Whether `text` calls itself a tip-motion model, of any version.
    #[must_use]
    pub fn is_named_in(text: &str) -> bool {
        schema_of(text).is_ok_and(|schema| schema.starts_with("tropism.model/"))
    }

    /// Readable JSON with all data and settings; see `docs/formats.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let column = |value: fn(&Shift) -> f64| self.observed().iter().map(value).collect();
        let number = |shift: &Shift| char::from(b'0' + shift.light.index() as u8);
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
            light: self.observed().iter().map(number).collect(),
        };
        serde_json::to_string(&file).expect("numbers and text are JSON")
    }

    /// Reads [`Self::to_json`].
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let schema = schema_of(text)?;
        if schema != SCHEMA && schema != SCHEMA_1 {
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
            let light = match (letter, letter.to_digit(10)) {
                ('l', _) if schema == SCHEMA_1 => Some(Light::LEFT),
                ('r', _) if schema == SCHEMA_1 => Some(Light::RIGHT),
                (_, Some(number)) if schema == SCHEMA => Light::new(number as usize),
                _ => None,
            };
            let Some(light) = light.filter(|&light| file.layout.contains(light)) else {
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
