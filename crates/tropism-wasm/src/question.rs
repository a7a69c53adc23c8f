//! What the page may ask.

#[cfg(feature = "photographs")]
use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Value, json};
use tropism::evolve::{EvolutionConfig, Trial};
#[cfg(feature = "photographs")]
use tropism::geometry::{Pixel, Region};
#[cfg(feature = "photographs")]
use tropism::lamps::Light;
use tropism::plant::tip::TipModelConfig;
use tropism::simulation::ModelKind;
use tropism::task::Task;
#[cfg(feature = "photographs")]
use tropism_page::WallRule;
use tropism_page::{Drawing, Method, ShownGeneration};

use crate::SessionError;
use crate::beans::OpenLoop;

/// A question of the page: `{"fit": {"kind": "stem"}}`.
///
/// Its name stands before its values, so that these are read at once, by the code that reads files: names among the values would cost
/// the module a second copy of that code.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Question {
    /// The paper's settings, which all others begin at.
    Settings {},
    /// The style sheet of figures.
    Style {},
    /// How far virtual common beans get to the side.
    Reach {},
    /// The task of a drawing: as a file, as data, its best fitness, and the model that is needed.
    Task {
        /// The drawing.
        drawing: Drawing,
    },
    /// The commands that do the same in a terminal.
    Commands {
        /// Name of the task file.
        name: String,
        /// The drawing.
        drawing: Drawing,
        /// Settings of the evolution.
        evolution: Option<Box<EvolutionConfig>>,
        /// Its seed.
        #[serde(default)]
        seed: u64,
        /// How the controller is made.
        #[serde(default)]
        method: Method,
    },
    /// A virtual bean under a controller.
    Try {
        /// The drawing.
        drawing: Drawing,
        /// Who steers.
        by: By,
        /// Seed of the bean.
        seed: u64,
        /// The first step of the answer.
        #[serde(default)]
        from: usize,
    },
    /// Fits the model of six virtual beans, as `tropism grow --plants 6` and `tropism fit`.
    Fit {
        /// Which model.
        #[serde(default)]
        kind: ModelKind,
        /// Settings of a tip-motion model.
        #[serde(default)]
        model: TipModelConfig,
        /// How the beans grow.
        #[serde(default)]
        beans: OpenLoop,
    },
    /// Takes over a model that another module fitted.
    Model {
        /// The model's file.
        file: String,
    },
    /// Begins an evolution on the model that was fitted last.
    Begin {
        /// The task.
        task: Box<Task>,
        /// Its settings.
        evolution: Box<EvolutionConfig>,
        /// Its seed.
        seed: u64,
        /// The runs, from 0, that this module does; others do the rest.
        own: Vec<u32>,
    },
    /// Advances the own runs.
    Advance {
        /// Generations of each run, at most.
        generations: u32,
    },
    /// The best network of the own runs so far, as a champion.
    Best {},
    /// The champions of the own runs.
    Finish {},
    /// Which of the champions of all runs goes on.
    Choose {
        /// Their trials on models of single plants.
        trials: Vec<Trial>,
    },
    /// Curves of all runs.
    Curves {
        /// Their histories.
        runs: Vec<Vec<ShownGeneration>>,
    },
    /// A champion's network, decisions and paths on the model that was fitted last.
    Champion {
        /// The champion as a file.
        champion: String,
        /// Seed of the simulated plants.
        seed: u64,
    },
    /// Fitness of a controller, and of the greedy rule, on unseen beans.
    Unseen {
        /// The drawing.
        drawing: Drawing,
        /// Who steers.
        by: By,
        /// Seeds of the beans.
        seeds: Vec<u64>,
    },
    /// Figures 4 and 5: tracks of the six beans, and their shifts.
    Tracks {
        /// How the beans grow.
        #[serde(default)]
        beans: OpenLoop,
    },
    /// Figure 7: the tips of simulated plants that a champion steers.
    Steered {
        /// The champion as a file.
        champion: String,
        /// How eq. (9) is read, and the targets.
        task: Box<Task>,
        /// Seed of the simulated plants.
        seed: u64,
    },
    /// Places of names in their natural order.
    #[cfg(feature = "photographs")]
    Order {
        /// The names.
        names: Vec<String>,
    },
    /// Columns and rows of the photograph in the bytes.
    #[cfg(feature = "photographs")]
    Size {},
    /// Begins to track a series of photographs; the bytes are the first ones, one after the other.
    #[cfg(feature = "photographs")]
    Track {
        /// Scale in the plane of the stem; `None` is that of the paper's camera.
        px_per_cm: Option<f64>,
        /// Where the stem leaves the soil.
        base: Option<Pixel>,
        /// The plant without pot and lamps.
        region: Option<Region>,
        /// Minutes from one photograph to the next.
        period_min: f64,
        /// Bytes of each of the first photographs.
        first: Vec<usize>,
    },
    /// Tracks the plant in the photograph in the bytes.
    #[cfg(feature = "photographs")]
    Next {
        /// Its name.
        name: String,
    },
    /// The track so far; the bytes of the answer are the CSV file.
    #[cfg(feature = "photographs")]
    Csv {},
    /// The constants of the plant whose track is in the bytes, as a CSV file; without bytes, of the photographs tracked last.
    #[cfg(feature = "photographs")]
    Measure {
        /// Its name.
        name: String,
        /// Angle by which its pot was tipped at the first row, in degrees; none if it stands upright.
        tilt_deg: Option<f64>,
    },
    /// Means of the constants of several plants.
    #[cfg(feature = "photographs")]
    Means {
        /// The values of each constant.
        values: BTreeMap<String, Vec<f64>>,
    },
    /// Opens a virtual tent.
    #[cfg(feature = "photographs")]
    Tent {
        /// Seed of its plant.
        seed: u64,
        /// What is drawn.
        drawing: Drawing,
        /// Who steers; a person if nobody does.
        by: Option<By>,
    },
    /// A step of the tent; the bytes of the answer are its photograph.
    #[cfg(feature = "photographs")]
    Step {
        /// The lamp that a person lights.
        light: Option<Light>,
    },
    /// The wall as it is drawn.
    #[cfg(feature = "photographs")]
    Nodes {},
    /// A plant before the wall, to its end.
    #[cfg(feature = "photographs")]
    Wall {
        /// Names of the nodes on the path, lowest first.
        path: Vec<String>,
        /// What runs in each node.
        rule: WallRule,
        /// Seed of the plant.
        seed: u64,
    },
    /// Figure 6: best fitness over the generations.
    Fitness {
        /// The best fitness of each generation of each run, in cm.
        best: Vec<Vec<f64>>,
        /// The mean fitness, likewise.
        mean: Vec<Vec<f64>>,
    },
}

/// Who steers a bean.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum By {
    /// The greedy rule.
    Greedy,
    /// A person, by letters `l` and `r`, one a step so far.
    Lights(String),
    /// A champion or a tuned rule, as a file.
    File(String),
}

/// JSON with bytes after it.
#[derive(Debug, Default)]
pub struct Answer {
    /// The JSON.
    pub json: Value,
    /// Bytes, such as pixels.
    pub bytes: Vec<u8>,
}

impl From<Value> for Answer {
    fn from(json: Value) -> Self {
        Self { json, bytes: Vec::new() }
    }
}

impl Answer {
    /// The length of the JSON in 32 bits, the JSON, the bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let text = self.json.to_string();
        let length = (text.len() as u32).to_le_bytes();
        [&length[..], text.as_bytes(), &self.bytes].concat()
    }
}

impl From<Result<Answer, SessionError>> for Answer {
    fn from(result: Result<Answer, SessionError>) -> Self {
        result.unwrap_or_else(|error| json!({ "error": error.to_string() }).into())
    }
}

impl Question {
    /// Splits what was written into the question and the bytes after it.
    ///
    /// # Errors
    /// [`SessionError::Question`] if it is none.
    pub fn split(written: &[u8]) -> Result<(Self, &[u8]), SessionError> {
        let short = || SessionError::Refused("there is no question".to_owned());
        let (length, rest) = written.split_first_chunk::<4>().ok_or_else(short)?;
        let (text, bytes) = rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(short)?;
        // As files are: text, not bytes.
        let text = str::from_utf8(text).map_err(|error| SessionError::Refused(error.to_string()))?;
        Ok((serde_json::from_str(text)?, bytes))
    }
}
