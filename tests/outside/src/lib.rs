//! A plant model, a task, sensors and a four-lamp layout of an outside crate, with public items of `tropism` only.

use tropism::prelude::*;

/// A tip in space, seen from the front: lamps to the left and right pull it sideways, lamps in front and behind slow it.
pub struct FourWay {
    layout: Layout,
}

impl Default for FourWay {
    /// Four lamps with names and places of this crate's own.
    fn default() -> Self {
        let lamps = vec![
            Lamp::new("west", [-40.0, 20.0, 0.0]),
            Lamp::new("east", [40.0, 20.0, 0.0]),
            Lamp::new("north", [0.0, 20.0, -40.0]),
            Lamp::new("south", [0.0, 20.0, 40.0]),
        ];
        Self { layout: Layout::new(lamps).expect("four lamps of different names") }
    }
}

/// State of one plant.
#[derive(Clone, Debug)]
pub struct Tip {
    x: f64,
    y: f64,
    z: f64,
    gain: f64,
}

impl PlantModel for FourWay {
    type Plant = Tip;

    fn seedling(&self, start: Point, noise: &mut StepNoise) -> Tip {
        Tip { x: start.x, y: start.y, z: 0.0, gain: 1.0 + 0.1 * noise.normal() }
    }

    fn step(&self, tip: &mut Tip, light: Light, noise: &mut StepNoise) {
        let [x, _, z] = self.layout.lamps()[light.index()].at;
        // Two noise draws a step: one for the response, one for growth.
        tip.x += 0.002 * tip.gain * (x - tip.x) + 0.01 * noise.normal();
        tip.z += 0.002 * tip.gain * (z - tip.z);
        tip.y += 0.05 + 0.005 * noise.normal();
    }

    fn observe(&self, tip: &Tip) -> Observation {
        let stem = Polyline(vec![Point::default(), Point::new(tip.x, tip.y)]);
        Observation { stem: Some(stem), ..Observation::simulated(Point::new(tip.x, tip.y)) }
    }

    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn period_min(&self) -> f64 {
        10.0
    }
}

impl BatchModel for FourWay {}

/// Lean to the right by 3 cm at 8 cm height, scored by how much closer each step comes.
#[derive(Debug)]
pub struct Lean;

impl Score for Lean {
    fn step_fitness(&self, _task: &Task, past: &Past, after: &Observation) -> f64 {
        (past.latest.tip.x - 3.0).abs() - (after.tip.x - 3.0).abs()
    }

    fn best(&self, _task: &Task, first: &Observation) -> Option<f64> {
        Some((first.tip.x - 3.0).abs())
    }
}

/// The task of this score: its target, and where it ends.
pub fn lean() -> Task {
    Task { targets: vec![Point::new(3.0, 8.0)], end_height_cm: 8.0, max_steps: 200, ..Task::new(Lean) }
}

/// What this crate's networks see: the way to the target, the last light, and three points of the stem.
pub fn sensors() -> Sensors {
    let sensors =
        vec![Sensor::ToTarget { ahead: 0 }, Sensor::LightMemory { steps: 3 }, Sensor::Stem { points: 3 }];
    Sensors::new(sensors).expect("numbers in their ranges")
}
