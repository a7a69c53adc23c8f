//! How well vision sees a plant among obstacles, and whether a task's contacts are those of the plant: the figures of
//! `docs/validation/vision-obstacles.md`, with `--full`, and fewer plants without. With a folder it writes a photograph of each
//! scene, from the front and from the side.
//!
//! `cargo run --release --manifest-path benches/Cargo.toml --bin obstacles -- [--full] [FOLDER]`

use std::path::Path;

use rayon::prelude::*;
use tropism::control::{Controller, Greedy};
use tropism::environment::Environment;
use tropism::geometry::{Point, Polyline};
use tropism::lamps::Light;
use tropism::obstacle::{Obstacle, Pole, Solid};
use tropism::photo::Photo;
use tropism::task::Task;
use tropism::vision::{Frame, TipTracker, VisionConfig};
use tropism_bean::render::Renderer;
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;
use tropism_bean::view::View;
use tropism_bean::{Bean, Species, Trial, lamp_powers};
use tropism_benches::tasks;

/// Steps between two photographs.
const EVERY: u64 = 2;

/// How much is measured.
struct Size {
    /// Plants that are photographed in each scene.
    photographed: u64,
    /// Steps for which they grow.
    steps: u64,
    /// Plants that steer for each task.
    steered: u64,
}

const SMALL: Size = Size { photographed: 1, steps: 40, steered: 4 };
const FULL: Size = Size { photographed: 16, steps: 300, steered: 90 };

fn scenes() -> Vec<(&'static str, Vec<Solid>)> {
    let of_tasks = tasks().map(|(name, task)| (name, task.solids()));
    let pole = |x, z| Pole { at: [x, z], radius_cm: 0.4, height_cm: 30.0 }.into();
    let others = [
        ("box", vec![Obstacle::Box { corners: [Point::new(2.0, 7.0), Point::new(6.0, 9.0)] }.into()]),
        ("pole behind the plant", vec![pole(1.5, -2.0)]),
        ("pole before the plant", vec![pole(1.5, 1.0)]),
    ];
    of_tasks.into_iter().chain(others).collect()
}

/// Distance from a point to a line of points.
fn off(line: &Polyline, point: Point) -> f64 {
    let nearest = |pair: &[Point]| {
        (0..=20)
            .map(|step| pair[0].lerp(pair[1], f64::from(step) / 20.0).distance(point))
            .fold(f64::INFINITY, f64::min)
    };
    line.0.windows(2).map(nearest).fold(f64::INFINITY, f64::min)
}

/// Errors of the tip and of the stem, and frames without a measurement.
#[derive(Default)]
struct Errors {
    tips: Vec<f64>,
    stems: Vec<f64>,
    held: usize,
}

impl Errors {
    fn add(&mut self, mut other: Self) {
        self.tips.append(&mut other.tips);
        self.stems.append(&mut other.stems);
        self.held += other.held;
    }

    fn print(&mut self, scene: &str, how: &str) {
        let summary = |errors: &mut Vec<f64>| {
            errors.sort_by(f64::total_cmp);
            let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
            (mean, errors.get(errors.len() * 95 / 100).copied().unwrap_or(f64::NAN))
        };
        let (tip, stem) = (summary(&mut self.tips), summary(&mut self.stems));
        println!(
            "| {scene} | {how} | {} | {} | {:.3}, {:.3} | {:.3}, {:.3} |",
            self.tips.len(),
            self.held,
            tip.0,
            tip.1,
            stem.0,
            stem.1
        );
    }
}

/// Photographs of one plant among `solids`: seen with obstacles printed, not printed, and without solids in the picture.
fn see(seed: u64, steps: u64, solids: &[Solid]) -> [Errors; 3] {
    let scene = Scene::default();
    let tent = Greenhouse { solids: solids.to_vec(), ..Greenhouse::default() };
    let printed = tent.vision(&VisionConfig::default());
    let untold = VisionConfig { obstacles: Vec::new(), poles: Vec::new(), ..printed.clone() };
    let tracker =
        |config: &VisionConfig| TipTracker::new(tent.calibration(), config.clone()).expect("a calibration");
    let mut trackers = [tracker(&printed), tracker(&untold), tracker(&untold)];
    let mut renderers = [Renderer::new(&scene, seed).among(solids), Renderer::new(&scene, seed)];
    let mut bean = Bean::new(Species::default().draw(seed, 1.0), seed).among(solids);
    let mut errors: [Errors; 3] = Default::default();
    for step in 0..steps {
        let light =
            if (step / (30 + 5 * (seed % 10))).is_multiple_of(2) { Light::RIGHT } else { Light::LEFT };
        if step % EVERY == 0 {
            let pose = bean.pose();
            let truth = renderers[0].truth(&pose);
            let [among, alone] =
                [0, 1].map(|which| renderers[which].photograph(&pose, Some(light), true, step));
            for (number, bytes) in [among.clone(), among, alone].into_iter().enumerate() {
                let photo = Photo { name: String::new(), bytes, time_s: 300.0 * step as f64 };
                let seen = trackers[number].observe(&Frame::new(photo));
                let errors = &mut errors[number];
                let Some(observation) = seen.observation.as_ref().filter(|_| seen.is_measured()) else {
                    errors.held += 1;
                    continue;
                };
                errors.tips.push(observation.tip.distance(truth.top));
                if let Some(stem) = &observation.stem {
                    let offs = stem.0.iter().map(|point| off(&truth.midline, *point));
                    errors.stems.push(offs.sum::<f64>() / stem.0.len() as f64);
                }
            }
        }
        bean.advance(&lamp_powers(Some(light)), 5.0);
    }
    errors
}

/// How one plant fared.
struct Fate {
    /// Whether a contact ever bore a force.
    has_pressed: bool,
    /// The smallest gap that the task saw, in cm.
    gap: f64,
    /// Whether the tip passed every target within reach.
    has_arrived: bool,
}

/// Grows the plant of `seed` under greedy, or in the dark.
fn fate(task: &Task, seed: u64, is_dark: bool) -> Fate {
    let species = Species::default();
    let trial = Trial { solids: task.solids(), ..Trial::new(&species) };
    let (mut plant, mut greedy) = (trial.specimen(seed), Greedy::new(task, &trial.layout));
    let mut fate = Fate { has_pressed: false, gap: f64::INFINITY, has_arrived: false };
    let (mut left, mut last) = (task.targets.clone(), f64::NEG_INFINITY);
    for step in 0.. {
        let Ok(seen) = plant.observe();
        fate.gap = fate.gap.min(task.gap_cm(&seen));
        left.retain(|target| {
            let passes = last < target.y && seen.tip.y >= target.y;
            !(passes && seen.tip.distance(*target) <= task.reach_cm)
        });
        last = last.max(seen.tip.y);
        if task.is_over(step, &seen) {
            break;
        }
        // A lamp that the tent does not have: all stay dark.
        let light = if is_dark { Light::BACK } else { greedy.decide(&seen) };
        let Ok(()) = plant.step(light);
        fate.has_pressed |= !plant.bean().contacts().is_empty();
    }
    fate.has_arrived = left.is_empty();
    fate
}

/// Whether contacts by the task are those of the plant, and how plants in the dark fare.
fn contacts(task: &Task, plants: u64) {
    let fates = |is_dark| -> Vec<Fate> {
        (0..plants).into_par_iter().map(|seed| fate(task, seed, is_dark)).collect()
    };
    let (steered, dark) = (fates(false), fates(true));
    let count = |fates: &[Fate], is: &dyn Fn(&Fate) -> bool| fates.iter().filter(|fate| is(fate)).count();
    for tolerance in [0.0, 0.05, 0.1] {
        println!(
            "  gap below {tolerance} cm: {} of {} plants with a force counted, {} of {} others",
            count(&steered, &|fate| fate.has_pressed && fate.gap < tolerance),
            count(&steered, &|fate| fate.has_pressed),
            count(&steered, &|fate| !fate.has_pressed && fate.gap < tolerance),
            count(&steered, &|fate| !fate.has_pressed),
        );
    }
    for (name, fates) in [("greedy", &steered), ("in the dark", &dark)] {
        let done = count(fates, &|fate| fate.has_arrived && fate.gap >= 0.05);
        let arrived = count(fates, &|fate| fate.has_arrived);
        println!("  {name}: {arrived} of {plants} within reach, {done} of them without contact");
    }
}

fn main() {
    let (flags, folders): (Vec<String>, Vec<String>) =
        std::env::args().skip(1).partition(|argument| argument == "--full");
    let size = if flags.is_empty() { SMALL } else { FULL };
    for (name, solids) in scenes() {
        if let Some(folder) = folders.first() {
            write_pictures(Path::new(folder), name, &solids);
        }
        let mut errors: [Errors; 3] = Default::default();
        let all: Vec<[Errors; 3]> =
            (0..size.photographed).into_par_iter().map(|seed| see(500 + seed, size.steps, &solids)).collect();
        for one in all {
            errors.iter_mut().zip(one).for_each(|(sum, one)| sum.add(one));
        }
        for (errors, how) in errors.iter_mut().zip(["told", "not told", "not in the picture"]) {
            errors.print(name, how);
        }
    }
    for (name, task) in tasks() {
        println!("{name}, greedy by way points, {} plants", size.steered);
        contacts(&task, size.steered);
    }
}

/// A photograph from each camera of a plant of 30 hours.
fn write_pictures(folder: &Path, name: &str, solids: &[Solid]) {
    std::fs::create_dir_all(folder).expect("a folder");
    let mut bean = Bean::new(Species::default().draw(3, 1.0), 3).among(solids);
    (0..360).for_each(|_| bean.advance(&lamp_powers(Some(Light::RIGHT)), 5.0));
    for view in View::BOTH {
        let mut renderer = Renderer::at(view, &Scene::default(), 3).among(solids);
        let image = renderer.draw(&bean.pose(), Some(Light::RIGHT), true, 0);
        let file = folder.join(format!("{}-{view:?}.png", name.replace(' ', "-")));
        let mut encoder = png::Encoder::new(
            std::fs::File::create(file).expect("a file"),
            image.width as u32,
            image.height as u32,
        );
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().and_then(|mut writer| writer.write_image_data(&image.rgb)).expect("a picture");
    }
}
