//! The model with memory as a JSON file, schema `tropism.memory-model/1`. The file holds the data; weights are computed when
//! it is read.

use serde::{Deserialize, Serialize};

use super::memory::{MemoryModel, PlantData};
use super::tip::ModelError;
use crate::geometry::Point;
use crate::lamps::Layout;

/// The schema that is written.
const SCHEMA: &str = "tropism.memory-model/1";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    layout: Layout,
    period_min: f64,
    is_virtual: bool,
    plants: Vec<FilePlant>,
}

/// One entry a step from the first observation of a plant.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FilePlant {
    /// Tip, in cm; null where it was not measured.
    x: Vec<Option<f64>>,
    y: Vec<Option<f64>>,
    /// The lamp that was lit to the next step: `l` or `r` for its side, `d` dark, `?` not known.
    light: String,
}

impl FilePlant {
    fn of(data: &PlantData) -> Self {
        let letter = |side: &Option<f64>| match side {
            None => '?',
            Some(side) if *side > 0.0 => 'r',
            Some(side) if *side < 0.0 => 'l',
            Some(_) => 'd',
        };
        Self {
            x: data.tips.iter().map(|tip| tip.map(|tip| tip.x)).collect(),
            y: data.tips.iter().map(|tip| tip.map(|tip| tip.y)).collect(),
            light: data.sides.iter().map(letter).collect(),
        }
    }

    fn data(&self, index: usize) -> Result<PlantData, ModelError> {
        let lengths = [self.x.len(), self.y.len(), self.light.len()];
        if lengths.iter().any(|&length| length != lengths[0]) {
            return Err(ModelError::Lengths { found: format!("{lengths:?}") });
        }
        let side = |letter| match letter {
            'r' => Ok(Some(1.0)),
            'l' => Ok(Some(-1.0)),
            'd' => Ok(Some(0.0)),
            '?' => Ok(None),
            _ => Err(ModelError::Shift { index, found: format!("light {letter:?}") }),
        };
        let tips = self.x.iter().zip(&self.y).map(|(x, y)| Some(Point::new((*x)?, (*y)?))).collect();
        Ok(PlantData { tips, sides: self.light.chars().map(side).collect::<Result<_, _>>()? })
    }
}

impl MemoryModel {
    /// Readable JSON with all data; see `docs/formats.md`.
    #[must_use]
    pub fn to_json(&self) -> String {
        let file = File {
            schema: SCHEMA.to_owned(),
            layout: self.layout.clone(),
            period_min: self.period_min,
            is_virtual: self.is_virtual(),
            plants: self.data.iter().map(FilePlant::of).collect(),
        };
        serde_json::to_string(&file).expect("numbers and text are JSON")
    }

    /// Whether `text` calls itself a model with memory, of any version.
    #[must_use]
    pub fn is_named_in(text: &str) -> bool {
        schema_of(text).is_ok_and(|schema| schema.starts_with("tropism.memory-model/"))
    }

    /// Reads [`Self::to_json`].
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        // The schema is read first: a file of another one should be called that, not full of unknown fields.
        let schema = schema_of(text)?;
        if schema != SCHEMA {
            return Err(ModelError::Schema { found: schema, wanted: SCHEMA });
        }
        let file: File = serde_json::from_str(text)?;
        let plants = file.plants.iter().enumerate();
        let data = plants.map(|(index, plant)| plant.data(index)).collect::<Result<_, _>>()?;
        Ok(Self::of_data(data, file.layout, file.period_min)?.of_virtual_plants(file.is_virtual))
    }
}

fn schema_of(text: &str) -> Result<String, serde_json::Error> {
    #[derive(Deserialize)]
    struct Head {
        schema: String,
    }
    serde_json::from_str(text).map(|Head { schema }| schema)
}

#[cfg(test)]
mod tests {
    use super::super::memory::tests::track;
    use super::*;
    use crate::observation::Quality;

    fn model() -> MemoryModel {
        let mut gappy = track(2, 0.08, 5.0);
        gappy.samples[50].quality = Quality::Held;
        gappy.samples.remove(90);
        gappy.samples[120].light = None;
        MemoryModel::fit(&[track(1, 0.05, 5.0), gappy]).unwrap()
    }

    #[test]
    fn json_comes_back() {
        let model = model().of_virtual_plants(true);
        assert!(MemoryModel::is_named_in(&model.to_json()));
        assert_eq!(MemoryModel::from_json(&model.to_json()).unwrap(), model);
    }

    #[test]
    fn bad_models_are_refused() {
        let text = model().to_json();
        let error = |text: &str| MemoryModel::from_json(text).unwrap_err().to_string();
        assert!(error("{").contains("no model"));
        let other = text.replace("memory-model/1", "memory-model/9");
        assert!(error(&other).contains("wanted \"tropism.memory-model/1\""));
        assert!(
            MemoryModel::is_named_in(&other) && !MemoryModel::is_named_in(r#"{"schema":"tropism.model/2"}"#)
        );
        assert!(error(&text.replacen("\"light\":\"r", "\"light\":\"x", 1)).contains("light 'x'"));
        assert!(error(&text.replacen("\"light\":\"r", "\"light\":\"rr", 1)).contains("lengths"));
        assert!(error(&text.replacen("\"x\":[0.0", "\"x\":[1e300", 1)).contains("1e300"));
        assert!(error(&text.replacen("\"period_min\":5.0", "\"period_min\":0.0", 1)).contains("period_min"));
    }
}
