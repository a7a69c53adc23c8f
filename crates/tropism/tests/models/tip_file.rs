//! Files of the tip model.

use tropism::plant::tip::{Empty, TipModel, TipModelConfig};
use tropism::plant::{FittedModel, PlantModel};
use tropism::track::Track;

fn model() -> TipModel {
    let rows = (0..300).map(|step| {
        let x = f64::from(step % 40) * 0.05;
        format!("{x},{},{}\n", 4.0 + 0.03 * f64::from(step), if step % 80 < 40 { "right" } else { "left" })
    });
    let text = format!("tip_x_cm,tip_y_cm,light\n{}", rows.collect::<String>());
    let config = TipModelConfig { empty: Empty::Nearest, ..TipModelConfig::default() };
    TipModel::fit([&Track::read_csv(text.as_bytes()).unwrap()], config).unwrap()
}

#[test]
fn json_comes_back() {
    let model = model().of_virtual_plants(true);
    assert_eq!(TipModel::from_json(&model.to_json()).unwrap(), model);
}

#[test]
fn four_lamps_and_another_period_come_back() {
    let text = "step,time_s,tip_x_cm,tip_y_cm,light\n0,0,0,4,front\n1,600,0,4.1,back\n2,1200,0.1,4.2,left\n\
                3,1800,0,4.3,dark\n";
    let track = Track::read_csv(text.as_bytes()).unwrap();
    let model = TipModel::fit([&track], TipModelConfig::default()).unwrap();
    let again = TipModel::from_json(&model.to_json()).unwrap();
    assert_eq!((again.layout().len(), again.period_min()), (4, 10.0));
    assert_eq!(again, model);
}

#[test]
fn bad_models_are_refused() {
    let text = model().to_json();
    let error = |text: &str| TipModel::from_json(text).unwrap_err().to_string();
    assert!(error("{").contains("no model"));
    assert!(error(&text.replace("model/2", "model/9")).contains("wanted \"tropism.model/2\""));
    assert!(error(&text.replace("\"grid_cm\":0.1", "\"grid_cm\":0.0")).contains("grid_cm = 0"));
    assert!(error(&text.replace("\"wx\":0.5", "\"wx\":-1")).contains("window.wx"));
    assert!(error(&text.replace("\"light\":\"1", "\"light\":\"x")).contains("light 'x'"));
    assert!(error(&text.replace("\"light\":\"1", "\"light\":\"5")).contains("light '5'"));
    assert!(error(&text.replace("\"light\":\"1", "\"light\":\"11")).contains("lengths"));
    assert!(error(&text.replace("\"plants\":[299", "\"plants\":[300")).contains("add up"));
    assert!(error(&text.replace("\"x\":[0.0", "\"x\":[1e300")).contains("shift 0"));
    assert!(error(&text.replace("\"period_min\":5.0", "\"period_min\":0.0")).contains("period_min"));
}
