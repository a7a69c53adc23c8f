//! Virtual frames: short episodes of beans of many seeds, with one fault each.

use std::path::Path;

use rayon::prelude::*;
use tropism::lamps::Light;
use tropism::math;
use tropism::photo::{Image, Photo};
use tropism::random::{self, Purpose};
use tropism::vision::{Frame, FrameStatus, Mode, TipTracker, VisionConfig};
use tropism_bean::fault::{self, Faults};
use tropism_bean::pose::{Leaf, Pose};
use tropism_bean::render::{Renderer, Truth, truth};
use tropism_bean::scene::Scene;
use tropism_bean::tent::Greenhouse;
use tropism_bean::{Bean, Species, lamp_powers};

use crate::score::Score;

/// Frames at the start of each episode that have no faults and are not scored: the tracker begins with a clear plant.
const LEAD: usize = 6;

/// Frames of an episode.
const EPISODE: usize = 48;

/// Interval between photographs, in minutes.
const PERIOD_MIN: f64 = 5.0;

/// Number of photographs between two changes of the light.
const LIT_FOR: usize = 36;

/// A row of virtual frames.
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
    faults: Faults,
    /// Whether leaves fall through the picture.
    leaf_falls: bool,
    /// Range of the beans' ages at the start of an episode, in hours.
    age_h: [f64; 2],
}

fn small() -> Scene {
    Scene { width: 648, height: 486, ..Scene::default() }
}

fn large() -> Scene {
    Scene { width: 2592, height: 1944, ..Scene::default() }
}

/// The rows of the table. At these rates faults overlap now and then.
pub(crate) fn rows() -> Vec<Row> {
    let row = |name, scene, faults| Row { name, scene, faults, leaf_falls: false, age_h: [0.5, 60.0] };
    let none = Faults::default;
    vec![
        row("clean 2592x1944", large(), none()),
        row("clean 648x486", small(), none()),
        row("glare", small(), Faults { glare: 0.06, ..none() }),
        row("leaf over tip", small(), Faults { leaf_across: 0.1, ..none() }),
        Row { leaf_falls: true, ..row("falling leaf", small(), none()) },
        Row { age_h: [0.0, 2.0], ..row("hook", small(), none()) },
        row("dim 1/4", Scene { exposure: 0.25, ..small() }, none()),
        row("dim 1/10", Scene { exposure: 0.1, ..small() }, none()),
        row("condensation", small(), Faults { condensation: 0.05, ..none() }),
        row("nudge", small(), Faults { nudged: 0.04, ..none() }),
        row("fly", small(), Faults { fly: 0.1, ..none() }),
        row("missed flash", small(), Faults { missed_flash: 0.1, ..none() }),
        row("lamp fails", small(), Faults { lamp_fails: 0.05, ..none() }),
        row("always glare", small(), Faults { glare: 1.0, ..none() }),
        row("always leaf", small(), Faults { leaf_across: 1.0, ..none() }),
        row("always nudge", small(), Faults { nudged: 1.0, ..none() }),
        row("always fly", small(), Faults { fly: 1.0, ..none() }),
        row(
            "all at once",
            small(),
            Faults {
                lamp_fails: 0.01,
                missed_flash: 0.02,
                leaf_across: 0.02,
                nudged: 0.01,
                glare: 0.02,
                fly: 0.02,
                condensation: 0.01,
                half_written: 0.02,
                repeated: 0.02,
                dropped: 0.02,
            },
        ),
    ]
}

/// A growing bean under a light that changes sides.
struct Growing {
    bean: Bean,
    frame: u64,
}

impl Growing {
    fn new(seed: u64, [from, to]: [f64; 2]) -> Self {
        let age = from + (to - from) * random::uniform(&mut random::stream(seed, Purpose::Trial, 0));
        let mut growing = Self { bean: Bean::new(Species::default().draw(seed, 1.0), seed), frame: 0 };
        for _ in 0..(age * 60.0 / PERIOD_MIN) as usize {
            growing.step();
        }
        growing
    }

    fn light(&self) -> Light {
        if (self.frame as usize / LIT_FOR).is_multiple_of(2) { Light::LEFT } else { Light::RIGHT }
    }

    fn step(&mut self) {
        let light = self.light();
        self.bean.advance(&lamp_powers(Some(light)), PERIOD_MIN);
        self.frame += 1;
    }
}

pub(crate) fn tracker(scene: &Scene, mode: Mode) -> TipTracker {
    let greenhouse = Greenhouse { scene: scene.clone(), ..Greenhouse::default() };
    let config = VisionConfig { mode, crop: Some(greenhouse.crop()), ..VisionConfig::default() };
    TipTracker::new(greenhouse.calibration(), config).expect("the tent's own calibration")
}

impl Row {
    /// Whether a frame is scored: each one in rows without faults, otherwise those with a fault.
    pub(crate) fn scores(&self, index: usize, happens: bool) -> bool {
        let is_clean = self.faults == Faults::default() && !self.leaf_falls;
        index >= LEAD && (happens || is_clean)
    }

    /// Scores at least `frames` frames of beans from `seed` on. Frames with the class ok and a wrong tip are written
    /// to `list`.
    pub(crate) fn score(&self, frames: usize, seed: u64, mode: Mode, list: Option<&Path>) -> Score {
        let mut score = Score::default();
        let mut first = seed;
        while score.frames() < frames {
            let several = 8.min(((frames - score.frames()) as u64).div_ceil(8)).max(1);
            let scores: Vec<Score> = (first..first + several)
                .into_par_iter()
                .map(|seed| {
                    let (mut score, mut tracker) = (Score::default(), tracker(&self.scene, mode));
                    self.photograph(seed, |photo, truth, index, happens| {
                        let name = format!("{}-{seed}-{}", self.name.replace([' ', '/'], "-"), photo.name);
                        let frame = Frame::new(photo);
                        let is_wrong =
                            score.add(&name, &tracker.observe(&frame), truth, self.scores(index, happens));
                        if let Some(list) = list.filter(|_| is_wrong) {
                            std::fs::write(list.join(name), &frame.photo().bytes)
                                .expect("a folder to list in");
                        }
                    });
                    score
                })
                .collect();
            scores.into_iter().for_each(|one| score.merge(one));
            first += several;
        }
        score
    }

    /// Calls `taken` with each photograph of one bean, its ground truth, its number and whether it has a fault.
    pub(crate) fn photograph(&self, seed: u64, mut taken: impl FnMut(Photo, &Truth, usize, bool)) {
        let mut growing = Growing::new(seed, self.age_h);
        let mut renderer = Renderer::new(&self.scene, seed);
        let mut last: Option<Vec<u8>> = None;
        for index in 0..EPISODE {
            let frame = growing.frame;
            let mut pose = growing.bean.pose();
            let mut true_now = truth(&pose, renderer.frame());
            let events = if index < LEAD { Vec::new() } else { self.faults.events_at(seed, frame) };
            let mut rng = random::stream(seed, Purpose::Events, frame);
            let falls = self.leaf_falls && index >= LEAD && random::uniform(&mut rng) < 0.3;
            if falls {
                true_now = truth(&without_leaf(&pose), renderer.frame());
                let_fall(&mut pose, [(); 3].map(|()| random::uniform(&mut rng)));
            }
            let lit = Some(growing.light());
            let bytes = fault::photograph(&mut renderer, &events, &pose, lit, frame, last.as_deref());
            let bytes = bytes.unwrap_or_default();
            let time_s = 60.0 * PERIOD_MIN * index as f64;
            last = Some(bytes.clone());
            let photo = Photo { name: format!("{index:06}.jpg"), bytes, time_s };
            taken(photo, &true_now, index, falls || !events.is_empty());
            growing.step();
        }
    }
}

fn without_leaf(pose: &Pose) -> Pose {
    let mut pose = pose.clone();
    pose.leaves[0].length = 0.05;
    pose
}

/// Tears a leaf off and places it in the air at a random position and angle.
fn let_fall(pose: &mut Pose, [x, y, turn]: [f64; 3]) {
    let turn = std::f64::consts::TAU * turn;
    let (s, c) = (math::sin(turn), math::cos(turn));
    let Leaf { length, .. } = pose.leaves[0];
    pose.leaves[0] = Leaf {
        base: [32.0 * x - 16.0, 3.0 + 24.0 * y, 2.0],
        along: [c, s, 0.0],
        across: [-s, c, 0.0],
        length: length.max(2.5),
    };
}

/// A row of spoiled files, each of which has a class to be recognised.
pub(crate) struct FileRow {
    pub(crate) name: &'static str,
    class: FrameStatus,
    /// Makes the spoiled file.
    spoil: fn(&mut Studio) -> Vec<u8>,
}

/// What spoiled files are made from.
struct Studio {
    renderer: Renderer,
    pose: Pose,
    light: Light,
    number: u64,
    good: Vec<u8>,
    last: Vec<u8>,
    chance: f64,
}

pub(crate) fn file_rows() -> [FileRow; 4] {
    [
        FileRow {
            name: "files truncated",
            class: FrameStatus::Corrupt,
            spoil: |studio| studio.good[..(studio.chance * studio.good.len() as f64) as usize].to_vec(),
        },
        FileRow {
            name: "files dark",
            class: FrameStatus::Dark,
            spoil: |studio| {
                if studio.number.is_multiple_of(2) {
                    return studio.renderer.photograph(&studio.pose, None, false, studio.number);
                }
                let dim = Scene { exposure: 0.01, ..small() };
                Renderer::new(&dim, studio.number).photograph(&studio.pose, None, false, studio.number)
            },
        },
        FileRow { name: "files repeated", class: FrameStatus::Repeated, spoil: |studio| studio.last.clone() },
        FileRow {
            name: "files foreign",
            class: FrameStatus::Foreign,
            spoil: |studio| match studio.number % 5 {
                0 => format!("step,tip_x_cm,tip_y_cm\n{},0,4\n", studio.number).into_bytes(),
                1 => b"GIF89a\x10\x00\x10\x00".to_vec(),
                2 => b"PK\x03\x04 an archive".to_vec(),
                number => {
                    let width = 320 + 8 * number as usize + studio.number as usize;
                    Image { width, height: 240, rgb: vec![90; 720 * width] }
                        .to_jpeg(80)
                        .expect("a small picture")
                }
            },
        },
    ]
}

impl FileRow {
    /// Counts how many of `frames` spoiled files, one after every second good photograph, get their class.
    pub(crate) fn score(&self, frames: usize, seed: u64, mode: Mode) -> String {
        let scene = small();
        let counts: Vec<(usize, usize, String)> = (seed..seed + frames.div_ceil(20) as u64)
            .into_par_iter()
            .map(|seed| {
                let mut growing = Growing::new(seed, [0.5, 60.0]);
                let mut tracker = tracker(&scene, mode);
                let (mut count, mut right, mut other) = (0, 0, String::new());
                let mut rng = random::stream(seed, Purpose::Events, 1);
                let mut studio = Studio {
                    renderer: Renderer::new(&scene, seed),
                    pose: growing.bean.pose(),
                    light: Light::LEFT,
                    number: 0,
                    good: Vec::new(),
                    last: Vec::new(),
                    chance: 0.0,
                };
                for index in 0..60 {
                    (studio.pose, studio.light, studio.number) =
                        (growing.bean.pose(), growing.light(), growing.frame);
                    studio.good =
                        studio.renderer.photograph(&studio.pose, Some(studio.light), true, growing.frame);
                    studio.chance = random::uniform(&mut rng);
                    let is_spoiled = index % 3 == 2;
                    let bytes = if is_spoiled { (self.spoil)(&mut studio) } else { studio.good.clone() };
                    studio.last = bytes.clone();
                    let time_s = 60.0 * PERIOD_MIN * f64::from(index);
                    let seen = tracker.observe(&Frame::new(Photo { name: String::new(), bytes, time_s }));
                    if is_spoiled {
                        count += 1;
                        right += usize::from(seen.status == self.class);
                        if seen.status != self.class {
                            other = format!(", once {}", seen.status);
                        }
                    }
                    growing.step();
                }
                (count, right, other)
            })
            .collect();
        let (count, right) = counts.iter().fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        let other = counts.iter().find(|one| !one.2.is_empty()).map_or("", |one| &one.2);
        format!("{:20} {count:6} | called {} in {right}{other}", self.name, self.class)
    }
}
