//! The virtual tent as a rig: seen through photographs alone, near to what is true, and the same after an interruption
//! whatever goes wrong.

#[path = "common/tent.rs"]
mod small_tent;

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Duration;

use small_tent::small_tent;
use tropism::control::{Controller, Dimming, Periodic};
use tropism::environment::run;
use tropism::evolve::Champion;
use tropism::geometry::Point;
use tropism::lamps::{Colour, Lamp, Layout, Light};
use tropism::lighting::{Allowed, Lighting};
use tropism::observation::{Observation, Quality};
use tropism::photo::Photo;
use tropism::plant::FittedModel;
use tropism::plant::PlantModel;
use tropism::plant::tip::TipModel;
use tropism::programme::{Part, Programme, TimeOfDay};
use tropism::rig::Durability;
use tropism::rig::{Clock, Lamps, Rig};
use tropism::task::Task;
use tropism::track::{Sample, Track};
use tropism::vision::VisionConfig;
use tropism::vision::tracking::clicks::Click;
use tropism_bean::fault::Faults;
use tropism_bean::scene::Scene;
use tropism_bean::tent::{Greenhouse, GroundTruth};
use tropism_lab::fit::{FitPlan, ModelKind};
use tropism_lab::{
    ControllerSpec, Recorder, RunConfig, RunFolder, RunPlan, Silent, Supervision, Workflow, files,
};
use tropism_rig::file::RigFile;

/// What is seen of a run: its track, where the top truly is at each step, and its photographs from the side.
type Recorded = (Track, Vec<Point>, BTreeMap<u64, Vec<u8>>);

/// Goes on with the run in `path` for at most `samples`.
fn record(greenhouse: &Greenhouse, path: &Path, steps: u32, samples: usize) -> Recorded {
    record_under(None, &mut periodic(), greenhouse, &[], path, steps, samples)
}

/// One lamp for 30 minutes, then the other.
fn periodic() -> Periodic {
    Periodic::new(30, &Layout::default()).starting_with(Light::RIGHT)
}

/// [`record`] under a controller and a programme, with the tip clicked in some photographs.
fn record_under(
    programme: Option<&Programme>,
    controller: &mut dyn Controller,
    greenhouse: &Greenhouse,
    clicks: &[Click],
    path: &Path,
    steps: u32,
    samples: usize,
) -> Recorded {
    let (device, tracker) = greenhouse.open(3, 5.0, &VisionConfig::default()).unwrap();
    let tracker = tracker.with_clicks(clicks).unwrap();
    let hand = || device.clone();
    let rig = Rig::new(hand(), hand(), hand(), hand(), tracker, Duration::from_secs(300));
    let folder = RunFolder::open(path, "seed = 3\n", Durability::Fast, true).unwrap();
    let mut world =
        Recorder::new(rig, folder, Supervision { programme: programme.cloned(), ..Supervision::default() })
            .unwrap();
    let mut left = samples;
    let mut side = BTreeMap::new();
    let mut watch = |_: &_| {
        side.extend(device.side_photograph());
        left -= 1;
        if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let track = run(&mut world, controller, &Task::open_loop(steps), &mut watch).unwrap();
    let truth = String::from_utf8(device.truth_csv()).unwrap();
    let top = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|number| number.parse().unwrap()).collect();
        Point::new(numbers[1], numbers[2])
    };
    (track, truth.lines().skip(1).map(top).collect(), side)
}

/// Shares the light of one lamp between both by where the tip is.
struct Sharing;

impl Controller for Sharing {
    fn decide(&mut self, seen: &Observation) -> Light {
        self.lighting(seen).brightest().unwrap_or(Light::LEFT)
    }

    fn lighting(&mut self, seen: &Observation) -> Lighting {
        let right = (128.0 - 90.0 * seen.tip.x).clamp(1.0, 254.0) as u8;
        Lighting::DARK.with(Light::LEFT, 255 - right).with(Light::RIGHT, right)
    }
}

#[test]
fn levels_are_recorded_and_go_on_after_an_interruption() {
    let greenhouse = Greenhouse { allowed: Allowed::Any { most_lit: 2, budget: 1.0 }, ..small_tent() };
    let [whole, broken] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let grow = |path, samples| record_under(None, &mut Sharing, &greenhouse, &[], path, 12, samples);
    let (track, truth, _) = grow(whole.path(), usize::MAX);
    grow(broken.path(), 7);
    let (resumed, resumed_truth, _) = grow(broken.path(), usize::MAX);
    assert_eq!((&resumed, resumed_truth), (&track, truth));
    let folder = RunFolder::open(broken.path(), "seed = 3\n", Durability::Fast, true).unwrap();
    let steps = folder.steps().unwrap();
    for (step, sample) in steps.iter().zip(&track.samples[..12]) {
        assert!(sample.levels.is_some() && sample.light.is_none());
        assert_eq!((step.decided, step.is_confirmed), (Some(sample.lighting()), true));
    }
    folder.write_track(&track).unwrap();
    let written = files::read_track(&broken.path().join("track.csv")).unwrap();
    let lightings = |track: &Track| track.samples.iter().map(|sample| sample.lighting()).collect::<Vec<_>>();
    assert_eq!(lightings(&written), lightings(&track));
    assert_eq!(written.shifts().count(), 0, "the model of the tip does not learn from them");
    let mut device = small_tent().open(3, 5.0, &VisionConfig::default()).unwrap().0;
    let error = device.shine(lightings(&track)[0]).unwrap_err().to_string();
    assert!(
        error.contains("found 2 lit lamps") && error.contains("wanted one lamp at full power"),
        "{error}"
    );
}

#[test]
fn a_network_that_dims_needs_a_rig_that_may() {
    let config = |allowed, dimming| {
        let genome = tropism_neat::random_genome(&tropism_neat::Config::multineat(), 2, 1, 1, 0);
        let champion = Champion { dimming, ..Champion::of_genome(genome) };
        let rig = RigFile::greenhouse(Greenhouse { allowed, ..small_tent() }, VisionConfig::default());
        let controller = ControllerSpec::network(champion).unwrap();
        RunConfig::new(rig, controller, Task::default(), 1)
    };
    for dimming in [Dimming::Level, Dimming::Ratio] {
        let error = config(Allowed::One, dimming).check().unwrap_err().to_string();
        assert!(error.contains("the controller dims lamps") && error.contains("`allowed`"), "{error}");
        config(Allowed::Any { most_lit: 2, budget: 1.0 }, dimming).check().unwrap();
    }
    config(Allowed::One, Dimming::Switch).check().unwrap();
}

#[test]
fn models_learn_under_a_red_base_light() {
    let mut lamps = Layout::default().lamps().to_vec();
    lamps.push(Lamp::new("top", [0.0, 80.0, 0.0]).with_colour(Colour::Red));
    let layout = Layout::new(lamps).unwrap();
    let greenhouse =
        Greenhouse { layout, allowed: Allowed::Any { most_lit: 2, budget: 2.0 }, ..small_tent() };
    let grown = |base: &str| {
        let folder = tempfile::tempdir().unwrap();
        let day = programme(&[&format!("from = '00:00'\nto = '24:00'\nbase = '{base}'")], &greenhouse);
        let steering = &mut Periodic::new(6, &greenhouse.layout);
        let (track, truth, _) =
            record_under(Some(&day), steering, &greenhouse, &[], folder.path(), 12, usize::MAX);
        let shifts = track.shifts().map(|(.., light)| light).collect::<Vec<_>>();
        (shifts, truth)
    };
    let ((lights, plant), (_, without)) = (grown("top:200"), grown("dark"));
    assert_eq!(lights, [[Light::LEFT; 6], [Light::RIGHT; 6]].concat());
    assert_eq!(plant, without, "the plant does not bend to red light");
}

fn programme(parts: &[&str], greenhouse: &Greenhouse) -> Programme {
    let parts: Vec<Part> = parts.iter().map(|part| toml::from_str(part).unwrap()).collect();
    Programme::new(&parts, &greenhouse.layout, greenhouse.allowed).unwrap()
}

#[test]
fn a_programme_acts_in_the_tent_and_goes_on_after_an_interruption() {
    let greenhouse = Greenhouse {
        layout: Layout::four_sides(),
        allowed: Allowed::Any { most_lit: 2, budget: 1.3 },
        begins: TimeOfDay::new(21, 30),
        ..small_tent()
    };
    let day = "from = \"20:00\"\nto = \"22:00\"\nbase = \"front:60\"\nramp_min = 20";
    let night = "from = \"22:00\"\nto = \"22:30\"\nsteer = false\nbase = \"back:20\"";
    let programme = programme(&[day, night], &greenhouse);
    let whole = tempfile::tempdir().unwrap();
    let grow = |path: &Path, samples| {
        record_under(Some(&programme), &mut periodic(), &greenhouse, &[], path, 16, samples)
    };
    let (track, truth, _) = grow(whole.path(), usize::MAX);
    let steps =
        |path: &Path| RunFolder::open(path, "seed = 3\n", Durability::Fast, true).unwrap().steps().unwrap();
    let lit: Vec<String> = steps(whole.path())[..16]
        .iter()
        .map(|step| {
            assert!(step.is_confirmed);
            step.commanded().unwrap().word(&greenhouse.layout)
        })
        .collect();
    let by_day =
        ["right+front:60"; 3].into_iter().chain(["right+front:45", "right+front:30", "right+front:15"]);
    let wanted: Vec<&str> = by_day.chain(["back:20"; 6]).chain(["dark"; 4]).collect();
    assert_eq!(lit, wanted);
    for samples in [3, 7, 13] {
        let broken = tempfile::tempdir().unwrap();
        grow(broken.path(), samples);
        let (resumed, resumed_truth, _) = grow(broken.path(), usize::MAX);
        assert_eq!((&resumed, &resumed_truth), (&track, &truth), "broken off after {samples}");
        assert_eq!(steps(broken.path()), steps(whole.path()));
    }
    let folder = RunFolder::open(whole.path(), "seed = 3\n", Durability::Fast, true).unwrap();
    folder.write_track(&track).unwrap();
    let written = files::read_track(&whole.path().join("track.csv")).unwrap();
    let lightings: Vec<String> =
        written.samples[..16].iter().map(|sample| sample.lighting().word(&greenhouse.layout)).collect();
    assert_eq!(lightings, wanted, "the track has what acted");
    assert_eq!(written.numbers("part").unwrap()[..16], [[1.0; 6], [2.0; 6], [0.0; 6]].concat()[..16]);
    assert_eq!(written.numbers("steered").unwrap()[..16], [[1.0; 6], [0.0; 6], [0.0; 6]].concat()[..16]);
}

#[test]
fn the_bean_bends_to_a_base_light() {
    let greenhouse = Greenhouse { allowed: Allowed::Any { most_lit: 1, budget: 1.0 }, ..small_tent() };
    let [left, right] = ["left:100", "right:100"].map(|base| {
        let part = format!("from = \"00:00\"\nto = \"24:00\"\nsteer = false\nbase = \"{base}\"");
        let programme = programme(&[&part], &greenhouse);
        let folder = tempfile::tempdir().unwrap();
        let recorded =
            record_under(Some(&programme), &mut periodic(), &greenhouse, &[], folder.path(), 72, usize::MAX);
        recorded.1[72].x
    });
    assert!(left + 1.0 < right, "tops at {left} and {right} cm");
}

#[test]
fn tips_in_photographs_are_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let (track, truth, side) = record(&small_tent(), folder.path(), 150, usize::MAX);
    assert_eq!((track.samples.len(), truth.len(), side.len()), (151, 151, 0));
    let mut off: Vec<f64> =
        track.samples.iter().zip(&truth).map(|(sample, top)| sample.tip.distance(*top)).collect();
    off.sort_by(f64::total_cmp);
    assert!(off[75] < 0.08 && off[143] < 0.2, "median {:.3} cm, 95 % {:.3} cm", off[75], off[143]);
    assert!(track.samples.iter().all(|sample| sample.quality == Quality::Measured));
}

#[test]
fn what_is_true_is_told_from_both_sides() {
    let scene = Scene { cameras: 2, ..Scene::default() };
    let greenhouse = Greenhouse { scene, ..Greenhouse::default() };
    let (mut device, _) = greenhouse.open(5, 5.0, &VisionConfig::default()).unwrap();
    device.light(Some(Light::RIGHT)).unwrap();
    assert!(
        device.wait_until(Duration::from_secs(20 * 3600), &mut || ControlFlow::Continue(())).is_continue()
    );
    let (step, bytes) = device.side_photograph().unwrap();
    assert_eq!(step, 240);
    let text = String::from_utf8(device.truth_json()).unwrap();
    let truths: Vec<GroundTruth> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [first, last] = &truths[..] else { panic!("{text}") };
    assert_eq!((first.step, first.lit, last.step, last.lit), (0, None, 240, Some(Light::RIGHT)));
    let (front, side) = (&last.front, last.side.as_ref().unwrap());
    // It leans to the right, so towards the side camera, which sees it larger and no less high.
    assert!(front.apex.x > 1.0 && side.apex.x.abs() < front.apex.x, "{front:?} {side:?}");
    assert!(side.top.y != front.top.y && (side.top.y - front.top.y).abs() < 1.5, "{side:?}");
    for truth in [front, side] {
        let line = &truth.midline.0;
        assert!(line[0].distance(Point::new(0.0, 0.0)) < 1e-3);
        assert!(line.windows(2).all(|pair| pair[0].distance(pair[1]) < 0.2), "dense");
        assert!(truth.leaves.iter().all(|leaf| leaf.0.len() > 30));
    }
    // The paper's own detector finds it in the side photograph, too.
    let image = Photo { name: String::new(), bytes, time_s: 0.0 }.decode().unwrap();
    let top = greenhouse.scene.frame().pixel(side.top);
    let green = |x: usize, y: usize| i32::from(image.at(x, y)[1]);
    let row = (0..image.height).find(|&y| {
        (top.x as usize - 12..top.x as usize + 12)
            .any(|x| green(x, y) > 110 && green(x, y) > i32::from(image.at(x, y)[2]) + 40)
    });
    assert!((row.unwrap() as f64 - top.y).abs() < 3.0, "row {row:?}, true {top:?}");
    let one = Greenhouse::default().open(5, 5.0, &VisionConfig::default()).unwrap().0;
    assert!(one.side_photograph().is_none());
}

#[test]
fn a_run_in_which_everything_goes_wrong_is_resumed_to_the_same_bits() {
    let rate = 0.05;
    let faults = Faults {
        lamp_fails: rate,
        missed_flash: rate,
        leaf_across: rate,
        nudged: rate,
        glare: rate,
        fly: rate,
        condensation: rate,
        half_written: rate,
        repeated: rate,
        dropped: rate,
    };
    let scene = Scene { cameras: 2, width: 324, height: 243, ..Scene::default() };
    let greenhouse = Greenhouse { faults, scene, ..Greenhouse::default() };
    let [whole, broken] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let (track, truth, side) = record(&greenhouse, whole.path(), 60, usize::MAX);
    assert!(side.len() == 61 && side.values().any(Vec::is_empty), "a photograph from the side is dropped");
    let repeated = |step: &u64| step > &0 && side[step] == side[&(step - 1)] && !side[step].is_empty();
    assert!(side.keys().any(repeated), "a photograph from the side is repeated");
    assert!(
        track.samples.iter().any(|sample| sample.quality == Quality::CarriedForward),
        "something is not seen"
    );
    for samples in [1, 5, 18, 40] {
        record(&greenhouse, broken.path(), 60, samples);
    }
    // Photographs from the side of steps that are lived through again are drawn again, and are the same.
    assert!(record(&greenhouse, broken.path(), 60, usize::MAX) == (track, truth, side));
    for step in 0..=60 {
        // None where the camera gave no photograph.
        let name = format!("photographs/{step:06}.jpg");
        let [one, other] = [&whole, &broken].map(|folder| std::fs::read(folder.path().join(&name)).ok());
        assert!(one == other, "{name}");
    }
}

#[test]
fn a_clicked_tip_is_followed_and_resumed_to_the_same_bits() {
    let faults =
        Faults { missed_flash: 0.05, fly: 0.05, half_written: 0.05, dropped: 0.05, ..Faults::default() };
    let greenhouse = Greenhouse { faults, ..small_tent() };
    let [first, whole, broken] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let (_, truth, _) = record(&small_tent(), first.path(), 60, 1);
    let clicks = [Click { frame: 0, at: greenhouse.scene.frame().pixel(truth[0]) }];
    let (track, truth, _) =
        record_under(None, &mut periodic(), &greenhouse, &clicks, whole.path(), 60, usize::MAX);
    let is_measured = |sample: &&(&Sample, &Point)| sample.0.quality == Quality::Measured;
    let pairs: Vec<_> = track.samples.iter().zip(&truth).collect();
    let off = pairs.iter().filter(is_measured).map(|(sample, top)| sample.tip.distance(**top));
    // What flies past the tip takes the flow along for a photograph.
    let (measured, right) = (off.clone().count(), off.filter(|off| *off < 0.3).count());
    assert!((40..60).contains(&measured) && 10 * right >= 9 * measured, "{right} of {measured} are right");
    for samples in [1, 18, 40, usize::MAX] {
        let resumed = record_under(None, &mut periodic(), &greenhouse, &clicks, broken.path(), 60, samples);
        assert!(samples < 60 || (resumed.0, resumed.1) == (track.clone(), truth.clone()));
    }
}

#[test]
fn a_run_at_any_interval_is_one_from_photographs_to_model() {
    for period_min in [2.0, 10.0, 30.0] {
        let folder = tempfile::tempdir().unwrap();
        let rig = RigFile { period_min, ..RigFile::greenhouse(small_tent(), VisionConfig::default()) };
        let task = Task::open_loop((240.0 / period_min) as u32);
        let config = RunConfig::new(rig, ControllerSpec::periodic(60.0), task, 3);
        let out = folder.path().join("run");
        let run = RunPlan { out: out.clone(), config, ..RunPlan::default() };
        run.execute(&Silent).unwrap();
        let track = files::read_track(&out.join("track.csv")).unwrap();
        assert_eq!(track.period_min, period_min);
        let class = track.columns.iter().find(|column| column.name == "class").unwrap();
        let classes: Vec<String> = (0..track.samples.len()).map(|row| class.values.text(row)).collect();
        assert!(classes.iter().all(|class| class == "ok"), "{period_min} min: {classes:?}");
        for sample in track.samples.iter().filter(|sample| sample.light.is_some()) {
            let wanted = [Light::LEFT, Light::RIGHT][(sample.time_s / 3600.0) as usize % 2];
            assert_eq!(sample.light, Some(wanted), "{} min", sample.time_s / 60.0);
        }
        let fit = FitPlan {
            tracks: vec![out.join("track.csv")],
            out: folder.path().join("model.json"),
            replace: true,
            ..FitPlan::default()
        };
        fit.execute(&Silent).unwrap();
        let model = TipModel::from_json(&files::read_text(&fit.out).unwrap()).unwrap();
        assert_eq!(model.period_min(), period_min);
        let hourly = model.config().growth.mean * 60.0 / period_min;
        assert!((hourly - 0.36).abs() < 1e-9, "{hourly} cm an hour at {period_min} min");
        // A model of steps that are too long for its windows is refused, as are tracks of different intervals.
        let stem = FitPlan { kind: ModelKind::STEM, ..fit.clone() };
        if period_min > 10.0 {
            let error = stem.execute(&Silent).unwrap_err().to_string();
            assert!(error.contains("found 30 minutes between steps, wanted at most 10"), "{error}");
        }
        let mut other = track.clone();
        other.samples.iter_mut().for_each(|sample| sample.time_s *= 2.0);
        files::write_track(&folder.path().join("other.csv"), &other).unwrap();
        let mixed = FitPlan { tracks: vec![fit.tracks[0].clone(), folder.path().join("other.csv")], ..fit };
        let error = mixed.execute(&Silent).unwrap_err().to_string();
        assert!(error.contains("track 2: found") && error.contains("minutes between steps"), "{error}");
    }
}
