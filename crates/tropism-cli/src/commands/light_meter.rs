//! `tropism check --light`: what each lamp gives at the plant, by the readings of a light meter.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use serde::Serialize;
use tropism::lamps::Light;
use tropism_lab::by_hand::{MAX_LIT_S, RigByHand};
use tropism_lab::run::read_rig;
use tropism_rig::file::MOST_UMOL;

use crate::shell::{Interrupted, Shell};

/// The readings of a meter.
#[derive(Serialize)]
struct Readings {
    rig: PathBuf,
    is_virtual: bool,
    /// With all lamps dark, in µmol/m²/s.
    dark_umol: f64,
    /// Of each lamp at full power, without what was there in the dark, in µmol/m²/s.
    umol: BTreeMap<String, f64>,
}

/// Lights each lamp of the rig in the file `path` at full power, and asks for the reading of a meter that stands at the plant.
pub(super) fn measure(path: &Path, shell: &Shell) -> Result<()> {
    Shell::end_in_order();
    let file = read_rig(path)?;
    let is_virtual = file.is_virtual();
    let mut rig = RigByHand::open(file, path, std::env::current_exe().ok().as_deref())?;
    let answers = answers();
    shell.note("Put the sensor of a quantum meter where the plant stands. Readings are in µmol/m²/s.");
    rig.light(None)?;
    let dark_umol = reading("all lamps are dark", &rig, &answers, shell)?;
    let mut umol = BTreeMap::new();
    let lights: Vec<Light> = rig.layout().lights().collect();
    for light in lights {
        let name = rig.layout().name(Some(light)).to_owned();
        rig.light(Some(light))?;
        let lit = reading(&format!("{name} is lit"), &rig, &answers, shell)?;
        if lit <= dark_umol {
            bail!(
                "{name}: {lit} µmol/m²/s are no more than the {dark_umol} in the dark: does it shine on the sensor?"
            );
        }
        // A meter has four digits at most.
        umol.insert(name, (1e3 * (lit - dark_umol)).round() / 1e3);
    }
    // Here, so that a lamp that does not obey is an error.
    rig.light(None)?;
    let each: Vec<String> = umol.iter().map(|(name, umol)| format!("{name} = {umol}")).collect();
    let text = format!("[lamps]\numol = {{ {} }}", each.join(", "));
    shell.result(&text, &Readings { rig: path.to_owned(), is_virtual, dark_umol, umol })
}

/// The lines of stdin. A thread reads them: the light has to be watched meanwhile.
fn answers() -> Receiver<String> {
    let (answer, answers) = channel();
    thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(Result::ok) {
            if answer.send(line).is_err() {
                return;
            }
        }
    });
    answers
}

/// The next reading; what is none is asked for again.
fn reading(what: &str, rig: &RigByHand, answers: &Receiver<String>, shell: &Shell) -> Result<f64> {
    let asked = Instant::now();
    shell.note(&format!("{what}: reading?"));
    loop {
        rig.beat();
        if Shell::is_interrupted() {
            return Err(Interrupted("all light is off, nothing was measured".to_owned()).into());
        }
        if asked.elapsed().as_secs_f64() > MAX_LIT_S {
            bail!("{what}, and nothing was typed for {MAX_LIT_S} s: all light is off");
        }
        match answers.recv_timeout(Duration::from_millis(200)) {
            Ok(line) => match line.trim().replace(',', ".").parse::<f64>() {
                Ok(value) if (0.0..=MOST_UMOL).contains(&value) => return Ok(value),
                _ => shell
                    .note(&format!("{:?} is no reading: type a number from 0 to {MOST_UMOL}", line.trim())),
            },
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => bail!("{what}, and the input ended: all light is off"),
        }
    }
}
