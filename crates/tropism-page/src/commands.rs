//! The commands that do in a terminal what a page does, and the files that they need.

use serde::Deserialize;

use crate::Drawing;

/// Folder of tracks of virtual beans that are grown where there is no model.
pub const TRACKS: &str = "virtual-bean";

/// The model of them that is made then; and the model of their whole stems, for rules and tasks with obstacles.
pub const MODELS: [&str; 2] = ["virtual-bean.json", "virtual-stem.json"];

/// What a controller is made by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Networks evolve.
    #[default]
    Evolve,
    /// The numbers of a rule are tuned.
    Tune,
}

/// The file of the rule that is tuned for the drawing `name`.
#[must_use]
pub fn rule_file(name: &str) -> String {
    format!("{name}-rule.json")
}

/// The model of virtual beans that is needed, and the words after `tropism` that make it. One without the stem touches nothing,
/// and says too little of how late beans answer for a rule.
#[must_use]
pub fn model_of(drawing: &Drawing, method: Method) -> (&'static str, [String; 2]) {
    let [tip, stem] = MODELS;
    let grow = format!("grow --plants 6 --out {TRACKS}");
    if drawing.has_stem() || method == Method::Tune {
        (stem, [grow, format!("fit {TRACKS} --kind stem --out {stem}")])
    } else {
        (tip, [grow, format!("fit {TRACKS} --out {tip}")])
    }
}

/// The commands that make controllers for the task file of the drawing `name`, and that let them steer a virtual bean.
#[must_use]
pub fn commands(name: &str, drawing: &Drawing) -> Vec<String> {
    let [evolve, tune] = [Method::Evolve, Method::Tune].map(|method| model_of(drawing, method).0);
    let rule = rule_file(name);
    vec![
        format!("tropism evolve --model {evolve} --task {name}.toml --out {name}"),
        format!("tropism run --rig greenhouse --controller {name}/champion.json --out {name}-bean"),
        format!("tropism tune --model {tune} --task {name}.toml --out {rule}"),
        format!("tropism run --rig greenhouse --controller {rule} --out {name}-bean"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_and_obstacles_need_the_model_of_the_stem() {
        let drawing = Drawing::of_targets(&[[0.0, 6.0]]);
        assert_eq!(model_of(&drawing, Method::Evolve).0, MODELS[0]);
        assert_eq!(model_of(&drawing, Method::Tune).0, MODELS[1]);
        let behind = Drawing { way_points: vec![[1.0, 5.0]], ..drawing };
        assert_eq!(model_of(&behind, Method::Evolve).0, MODELS[1]);
    }
}
