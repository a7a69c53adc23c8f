//! A model of any kind: what files hold, and the table of kinds.

use core::fmt;
use core::ops::Deref;
use std::sync::Arc;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use tropism_neat::Genome;

use super::{BatchModel, Episode};
use crate::control::{Interface, PredictiveRule};
use crate::geometry::Point;
use crate::lamps::{Layout, Light};
use crate::lighting::Lighting;
use crate::observation::Observation;
use crate::obstacle::Solid;
use crate::plant::stem::{PlaneModel, SpaceModel};
use crate::plant::tip::{TipModel, TipModelConfig};
use crate::plant::{FittedModel, ModelError, Plant, PlantModel};
use crate::random::StepNoise;
use crate::task::Task;
use crate::track::{Sample, Track};

/// The kinds of models that files, plans and options name. A new one is its type and a line here.
static KINDS: [Kind; 3] = [
    Kind { has_settings: true, ..Kind::of::<TipModel>("tip", "tropism.model/2", None) },
    Kind { knows_stem: true, ..Kind::of::<PlaneModel>("stem", "tropism.stem-model/3", Some(1)) },
    Kind {
        knows_stem: true,
        is_in_space: true,
        ..Kind::of::<SpaceModel>("space", "tropism.stem-model/3", Some(2))
    },
];

/// What is known of a kind.
#[derive(Debug)]
struct Kind {
    name: &'static str,
    schema: &'static str,
    axes: Option<usize>,
    has_settings: bool,
    knows_stem: bool,
    is_in_space: bool,
    fit: fn(ModelKind, &[&Track], &TipModelConfig, bool) -> Result<AnyModel, ModelError>,
    read: fn(ModelKind, &str) -> Result<AnyModel, ModelError>,
}

impl Kind {
    const fn of<M>(name: &'static str, schema: &'static str, axes: Option<usize>) -> Self
    where
        M: FittedModel + BatchModel<Plant: Send + Sync + 'static> + Send + 'static,
    {
        Self {
            name,
            schema,
            axes,
            has_settings: false,
            knows_stem: false,
            is_in_space: false,
            fit: |kind, tracks, config, is_virtual| {
                let model = M::of_tracks(tracks, config)?.of_virtual_plants(is_virtual);
                Ok(AnyModel { kind, model: Arc::new(model) })
            },
            read: |kind, text| Ok(AnyModel { kind, model: Arc::new(M::from_json(text)?) }),
        }
    }
}

/// A kind of model, which plans call by its name.
///
/// ```
/// use tropism::simulation::ModelKind;
/// let names: Vec<&str> = ModelKind::all().map(ModelKind::name).collect();
/// assert_eq!(names, ["tip", "stem", "space"]);
/// assert_eq!(ModelKind::default().name(), "tip");
/// assert!(ModelKind::named("nothing").is_none());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ModelKind(&'static Kind);

impl ModelKind {
    /// The paper's tip-motion model.
    pub const TIP: Self = Self(&KINDS[0]);
    /// The linear model of the stem, in the plane of the front camera.
    pub const STEM: Self = Self(&KINDS[1]);
    /// The same in space.
    pub const SPACE: Self = Self(&KINDS[2]);

    /// All kinds.
    pub fn all() -> impl Iterator<Item = Self> {
        KINDS.iter().map(Self)
    }

    /// The kind of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|kind| kind.name() == name)
    }

    /// The kind of the model that `text` calls itself, of any version.
    #[must_use]
    pub fn of_file(text: &str) -> Option<Self> {
        #[derive(Deserialize)]
        struct Header {
            schema: String,
            axes: Option<usize>,
        }
        let Header { schema, axes } = serde_json::from_str(text).ok()?;
        let family = |schema: &str| schema.split('/').next().map(str::to_owned);
        let mut of_family = Self::all().filter(|kind| family(kind.0.schema) == family(&schema));
        let first = of_family.next()?;
        Some(of_family.find(|kind| kind.0.axes == axes).unwrap_or(first))
    }

    /// Its word in plans.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// Whether it has the settings of [`TipModelConfig`].
    #[must_use]
    pub fn has_settings(self) -> bool {
        self.0.has_settings
    }

    /// Whether its plants have stems, as its tracks must.
    #[must_use]
    pub fn knows_stem(self) -> bool {
        self.0.knows_stem
    }

    /// Whether its plants are in space, as its tracks must be; else they are in the plane of the front camera.
    #[must_use]
    pub fn is_in_space(self) -> bool {
        self.0.is_in_space
    }

    /// A model of tracks. `config` is for a kind that has settings.
    ///
    /// # Errors
    /// Those of [`FittedModel::of_tracks`].
    pub fn fit(
        self,
        tracks: &[&Track],
        config: &TipModelConfig,
        is_virtual: bool,
    ) -> Result<AnyModel, ModelError> {
        (self.0.fit)(self, tracks, config, is_virtual)
    }
}

impl Default for ModelKind {
    fn default() -> Self {
        Self::TIP
    }
}

impl PartialEq for ModelKind {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for ModelKind {}

impl Serialize for ModelKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for ModelKind {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "ModelKind".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "enum": Self::all().map(Self::name).collect::<Vec<_>>() })
    }
}

impl<'de> Deserialize<'de> for ModelKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let names: Vec<&str> = Self::all().map(Self::name).collect();
        let refused = || de::Error::custom(format!("found model {name:?}, wanted {}", names.join(", ")));
        Self::named(&name).ok_or_else(refused)
    }
}

/// A model of any kind. Clones share its data. What it says of its data is a [`FittedModel`].
#[derive(Clone)]
pub struct AnyModel {
    kind: ModelKind,
    model: Arc<dyn DynModel>,
}

/// The object-safe face of a model.
trait DynModel: FittedModel {
    fn seedling(self: Arc<Self>, start: Point, noise: &mut StepNoise) -> Box<dyn Plant>;
    fn resumed(self: Arc<Self>, past: &[Sample], noise: &mut StepNoise) -> Box<dyn Plant>;
    fn knows_levels(&self) -> bool;
    fn layout(&self) -> &Layout;
    fn period_min(&self) -> f64;
    fn score(
        &self,
        task: &Task,
        interface: Interface<'_>,
        episodes: &mut dyn Iterator<Item = Episode<&Genome>>,
    ) -> Vec<f64>;
    fn score_rules(
        &self,
        task: &Task,
        beyond_cost_cm: f64,
        episodes: &mut dyn Iterator<Item = Episode<PredictiveRule>>,
    ) -> Vec<f64>;
    fn of_each_plant(&self, most: usize) -> Result<Vec<Arc<dyn DynModel>>, ModelError>;
}

/// A plant with its model.
struct Grown<M: PlantModel> {
    model: Arc<M>,
    plant: M::Plant,
}

impl<M: PlantModel<Plant: Send + Sync + 'static> + Send + 'static> Plant for Grown<M> {
    fn step(&mut self, light: Light, noise: &mut StepNoise) {
        self.model.step(&mut self.plant, light, noise);
    }

    fn shine(&mut self, lighting: Lighting, noise: &mut StepNoise) {
        self.model.shine(&mut self.plant, lighting, noise);
    }

    fn observe(&self) -> Observation {
        self.model.observe(&self.plant)
    }

    fn is_beyond_data(&self) -> bool {
        self.model.is_beyond_data(&self.plant)
    }

    fn among(&mut self, solids: &[Solid]) {
        self.model.among(&mut self.plant, solids);
    }

    fn boxed_clone(&self) -> Box<dyn Plant> {
        Box::new(Self { model: self.model.clone(), plant: self.plant.clone() })
    }
}

impl<M: FittedModel + BatchModel<Plant: Send + Sync + 'static> + Send + 'static> DynModel for M {
    fn seedling(self: Arc<Self>, start: Point, noise: &mut StepNoise) -> Box<dyn Plant> {
        Box::new(Grown { plant: PlantModel::seedling(&*self, start, noise), model: self })
    }

    fn resumed(self: Arc<Self>, past: &[Sample], noise: &mut StepNoise) -> Box<dyn Plant> {
        Box::new(Grown { plant: PlantModel::resumed(&*self, past, noise), model: self })
    }

    fn knows_levels(&self) -> bool {
        PlantModel::knows_levels(self)
    }

    fn layout(&self) -> &Layout {
        PlantModel::layout(self)
    }

    fn period_min(&self) -> f64 {
        PlantModel::period_min(self)
    }

    fn score(
        &self,
        task: &Task,
        interface: Interface<'_>,
        episodes: &mut dyn Iterator<Item = Episode<&Genome>>,
    ) -> Vec<f64> {
        BatchModel::score(self, task, interface, episodes)
    }

    fn score_rules(
        &self,
        task: &Task,
        beyond_cost_cm: f64,
        episodes: &mut dyn Iterator<Item = Episode<PredictiveRule>>,
    ) -> Vec<f64> {
        BatchModel::score_rules(self, task, beyond_cost_cm, episodes)
    }

    fn of_each_plant(&self, most: usize) -> Result<Vec<Arc<dyn DynModel>>, ModelError> {
        let models = FittedModel::of_each_plant(self, most)?.into_iter();
        Ok(models.map(|model| Arc::new(model) as Arc<dyn DynModel>).collect())
    }
}

impl AnyModel {
    /// Reads a model file of any kind, distinguished by the schema.
    ///
    /// # Errors
    /// [`ModelError`] says what was found instead.
    pub fn from_json(text: &str) -> Result<Self, ModelError> {
        let kind = ModelKind::of_file(text).unwrap_or_default();
        (kind.0.read)(kind, text)
    }

    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> ModelKind {
        self.kind
    }

    /// [`FittedModel::of_each_plant`].
    ///
    /// # Errors
    /// None that a fit would not have given for the same data.
    pub fn of_each_plant(&self, most: usize) -> Result<Vec<Self>, ModelError> {
        let models = DynModel::of_each_plant(&*self.model, most)?.into_iter();
        Ok(models.map(|model| Self { kind: self.kind, model }).collect())
    }
}

impl fmt::Debug for AnyModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("AnyModel").field(&self.kind.name()).finish_non_exhaustive()
    }
}

/// Models of the same file are the same.
impl PartialEq for AnyModel {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.model, &other.model) || self.to_json() == other.to_json()
    }
}

/// As the text of its file.
impl Serialize for AnyModel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.to_json())
    }
}

impl<'de> Deserialize<'de> for AnyModel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::from_json(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

impl Deref for AnyModel {
    type Target = dyn FittedModel;

    fn deref(&self) -> &Self::Target {
        &*self.model
    }
}

impl PlantModel for AnyModel {
    type Plant = Box<dyn Plant>;

    fn seedling(&self, start: Point, noise: &mut StepNoise) -> Box<dyn Plant> {
        self.model.clone().seedling(start, noise)
    }

    fn resumed(&self, past: &[Sample], noise: &mut StepNoise) -> Box<dyn Plant> {
        self.model.clone().resumed(past, noise)
    }

    fn among(&self, plant: &mut Box<dyn Plant>, solids: &[Solid]) {
        plant.among(solids);
    }

    fn step(&self, plant: &mut Box<dyn Plant>, light: Light, noise: &mut StepNoise) {
        plant.step(light, noise);
    }

    fn shine(&self, plant: &mut Box<dyn Plant>, lighting: Lighting, noise: &mut StepNoise) {
        plant.shine(lighting, noise);
    }

    fn observe(&self, plant: &Box<dyn Plant>) -> Observation {
        plant.observe()
    }

    fn is_beyond_data(&self, plant: &Box<dyn Plant>) -> bool {
        plant.is_beyond_data()
    }

    fn knows_levels(&self) -> bool {
        self.model.knows_levels()
    }

    fn layout(&self) -> &Layout {
        self.model.layout()
    }

    fn period_min(&self) -> f64 {
        self.model.period_min()
    }
}

impl BatchModel for AnyModel {
    fn score<'g>(
        &self,
        task: &Task,
        interface: Interface<'_>,
        mut episodes: impl Iterator<Item = Episode<&'g Genome>>,
    ) -> Vec<f64> {
        self.model.score(task, interface, &mut episodes)
    }

    fn score_rules(
        &self,
        task: &Task,
        beyond_cost_cm: f64,
        mut episodes: impl Iterator<Item = Episode<PredictiveRule>>,
    ) -> Vec<f64> {
        self.model.score_rules(task, beyond_cost_cm, &mut episodes)
    }
}
