//! What users write by hand into TOML: tasks, tents, obstacles, cameras.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;
use tropism::geometry::{Pixel, Point};
use tropism::lamps::Layout;
use tropism::obstacle::{Bar, Obstacle, Pole, Solid};
use tropism::task::Task;
use tropism::vision::camera::calibration::Calibration;
use tropism::vision::{Mode, VisionConfig};
use tropism_bean::fault::Faults;
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;

#[track_caller]
fn error<T: DeserializeOwned + Debug>(text: &str) -> String {
    toml::from_str::<T>(text).unwrap_err().to_string()
}

#[track_caller]
fn comes_back<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) -> String {
    let text = toml::to_string(value).unwrap();
    assert_eq!(toml::from_str::<T>(&text).unwrap(), *value, "{text}");
    text
}

#[test]
fn every_kind_of_task_comes_back() {
    let endless = Task { end_height_cm: f64::INFINITY, ..Task::default() };
    let round = Task { way_points: vec![Point::new(3.0, 10.0)], ..Task::obstacles() };
    let short = Task::open_loop(7);
    let bow = Task { radius_cm: Some(7.0), ..Task::shape() };
    let drawn = Task { count: 5, highest_cm: 12.0, ..Task::random_targets() };
    let in_space = [Task::space(), Task::spiral(), bow, drawn];
    let in_plane = [Task::default(), endless, round, short];
    for spec in in_plane.into_iter().chain(in_space) {
        comes_back(&spec);
        let text = serde_json::to_string(&spec).unwrap();
        assert_eq!(serde_json::from_str::<Task>(&text).unwrap(), spec, "{text}");
        spec.check().unwrap();
    }
}

#[test]
fn keys_of_another_kind_of_task_are_refused_by_name() {
    let other = error::<Task>("kind = \"open_loop\"\ntargets = [[1, 6]]");
    assert!(other.contains("line 2") && other.contains("found targets"), "{other}");
    let reach = error::<Task>("reach_cm = 1.0");
    assert!(reach.contains("reach_cm") && reach.contains("obstacles"), "{reach}");
    let in_space = error::<Task>("targets = [[1, 6], [2, 7, 8]]");
    assert!(in_space.contains("line 1") && in_space.contains("length 3"), "{in_space}");
    let unknown = error::<Task>("goals = []");
    assert!(unknown.contains("goals") && unknown.contains("line 1"), "{unknown}");
}

#[test]
fn a_tent_names_its_lamps_unless_they_are_the_papers() {
    assert!(!toml::to_string(&Greenhouse::default()).unwrap().contains("layout"));
    comes_back(&Greenhouse { layout: Layout::four_sides(), ..Greenhouse::default() });
}

#[test]
fn a_wrong_key_of_a_scene_is_named() {
    assert!(error::<Scene>("widht = 640").contains("widht"));
}

#[test]
fn rates_that_are_no_probabilities_are_named() {
    let faults: Faults = toml::from_str("glare = 1.5").unwrap();
    assert!(faults.check().unwrap_err().to_string().contains("faults.glare = 1.5"));
    assert!(error::<Faults>("gremlin = 0.1").contains("gremlin"));
}

#[test]
fn obstacles_come_back() {
    let (a, b) = (Point::new(-2.5, 7.1), Point::new(0.3, 6.0));
    comes_back(&Obstacle::Disc { centre: a, radius_cm: 0.7 });
    comes_back(&Obstacle::Box { corners: [a, b] });
    comes_back(&Obstacle::Line { ends: [a, b] });
    let pole = Pole { at: [1.0, -2.0], radius_cm: 0.3, height_cm: f64::INFINITY };
    assert_eq!(comes_back(&Solid::Pole(pole)), "pole = [1.0, -2.0]\nradius_cm = 0.3\n");
    let bar = Bar { ends: [[2.0, 0.0, 0.0], [30.0, 28.0, 0.5]], radius_cm: 0.4 };
    let text = comes_back(&Solid::Bar(bar));
    assert_eq!(text, "bar = [[2.0, 0.0, 0.0], [30.0, 28.0, 0.5]]\nradius_cm = 0.4\n");
    let both = text + "height_cm = 3.0\n";
    assert!(toml::from_str::<Solid>(&both).unwrap_err().to_string().contains("a bar is"));
}

#[test]
fn what_is_no_obstacle_is_refused() {
    assert!(error::<Obstacle>("disc = [0, 8]").contains("radius_cm = r"));
    assert!(error::<Obstacle>("disk = [0, 8]").contains("disk"));
    assert!(error::<Obstacle>("pole = [1, 2]\nradius_cm = 0.3").contains("lies in its plane"));
    assert!(error::<Solid>("pole = [1.0, 0.0]").contains("height_cm = h"));
}

#[test]
fn cameras_and_vision_refuse_unknown_keys() {
    let text = "px_per_cm = 11.0\nwidth = 720\nheight = 480\nbase = { x = 360.0, y = 336.0 }\n";
    let calibration = Calibration::from_scale(Pixel::new(360.0, 336.0), 11.0, 720, 480);
    assert_eq!(toml::from_str::<Calibration>(text).unwrap(), calibration);
    assert!(error::<Calibration>(&format!("scale = 1\n{text}")).contains("scale"));
    let text =
        "mode = \"paper\"\ncrop = { x = 1, y = 2, width = 3, height = 4 }\n[gates]\nvalue = \"luma\"\n";
    assert_eq!(toml::from_str::<VisionConfig>(text).unwrap().mode, Mode::Paper);
    assert!(error::<VisionConfig>("mode = \"paper\"\nsigmaa = 1").contains("sigmaa"));
}
