//! A camera of one's own: implement [`Camera`], put it into a [`Rig`] with lamps, flash and clock, and close the loop.
//!
//! `cargo run --release -p tropism --example own_camera`
//!
//! The camera here draws a stem that leans towards the lit lamp; a real one would return the bytes of its JPEG. For a
//! camera in a rig file, add a driver to the crate `tropism-rig`.

use std::cell::RefCell;
use std::error::Error;
use std::rc::Rc;
use std::time::Duration;

use tropism::photo::Image;
use tropism::prelude::*;
use tropism::rig::{Camera, InstantClock, Lamps, NoFlash, Rig, RigError};
use tropism::vision::{Calibration, TipTracker, VisionConfig};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
const PX_PER_CM: f64 = 12.0;
/// Where the stem leaves the soil, in pixels.
const BASE: Pixel = Pixel { x: 160.0, y: 230.0 };

/// The plant before the camera: shared by camera and lamps, as a real plant is.
#[derive(Default)]
struct Plant {
    lean_cm: f64,
    length_cm: f64,
    lit: Option<Light>,
}

struct DrawingCamera(Rc<RefCell<Plant>>);

impl Camera for DrawingCamera {
    fn photograph(&mut self) -> Result<Photo, RigError> {
        let plant = &mut *self.0.borrow_mut();
        plant.length_cm += 0.05;
        plant.lean_cm += plant.lit.map_or(0.0, |light| 0.06 * Layout::default().side(light));
        let mut image = Image { width: WIDTH, height: HEIGHT, rgb: vec![12; 3 * WIDTH * HEIGHT] };
        let steps = 400;
        for step in 0..=steps {
            let share = f64::from(step) / f64::from(steps);
            let x = BASE.x + PX_PER_CM * plant.lean_cm * share * share;
            let y = BASE.y - PX_PER_CM * plant.length_cm * share;
            for column in x as usize - 2..=x as usize + 2 {
                let at = 3 * (y as usize * WIDTH + column);
                image.rgb[at..at + 3].copy_from_slice(&[150, 230, 110]);
            }
        }
        let failed = |error: tropism::photo::PhotoError| RigError::Device {
            device: "drawing camera".to_owned(),
            problem: error.to_string(),
        };
        Ok(Photo { name: String::new(), bytes: image.to_jpeg(90).map_err(failed)?, time_s: 0.0 })
    }
}

struct DrawnLamps(Rc<RefCell<Plant>>);

impl Lamps for DrawnLamps {
    fn light(&mut self, light: Option<Light>) -> Result<(), RigError> {
        self.0.borrow_mut().lit = light;
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let plant = Rc::new(RefCell::new(Plant { length_cm: 5.0, ..Plant::default() }));
    let calibration = Calibration::from_scale(BASE, PX_PER_CM, WIDTH, HEIGHT);
    let tracker = TipTracker::new(calibration, VisionConfig::default())?;
    let (camera, lamps) = (DrawingCamera(Rc::clone(&plant)), DrawnLamps(Rc::clone(&plant)));
    let mut rig = Rig::new(camera, lamps, NoFlash, InstantClock, tracker, Duration::from_secs(300));

    let task =
        Task { targets: vec![Point::new(2.0, 8.0)], end_height_cm: 8.5, max_steps: 60, ..Task::default() };
    let mut controller = Greedy::new(&task, rig.layout());
    let track = run(&mut rig, &mut controller, &task, &mut unwatched)?;
    println!("{} photographs, fitness {:.2} cm", track.samples.len(), task.fitness(&track));
    let last = track.samples.last().expect("at least one photograph");
    println!(
        "tip at {:.2}, {:.2} cm; drawn at {:.2} cm to the right",
        last.tip.x,
        last.tip.y,
        plant.borrow().lean_cm
    );
    Ok(())
}
