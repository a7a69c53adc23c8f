//! The demonstration: a virtual bean that grows while one looks, an evolution, and one that has ended.

use std::path::Path;
use std::process::Child;
use std::sync::Arc;

use tropism_lab::stop::StopPlan;
use tropism_lab::{Silent, Workflow};
use tropism_page::{Drawing, Method};

use crate::error::StudioError;
use crate::{Studio, draw, jobs};

/// Times as fast as a real plant: a photograph every two seconds.
const SPEED: &str = "150";

/// Folder of the run.
const BEAN: &str = "bean-1";

/// A demonstration: its run and its evolutions end when it is dropped.
pub(crate) struct Demo {
    studio: Arc<Studio>,
    run: Child,
}

impl Demo {
    /// Starts a run and two evolutions in the folder of `studio`.
    pub(crate) fn start(studio: &Arc<Studio>) -> Result<Self, StudioError> {
        let root = &studio.root;
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<String>>();
        let run =
            words(&format!("run --rig greenhouse --controller greedy --out {BEAN} --seed 4 --speed {SPEED}"));
        let log = root.join(crate::OWN).join("demo.log");
        let failed = |error: std::io::Error| StudioError::System(format!("tropism run: {error}"));
        let run = jobs::spawn(&studio.program, root, &run, &log).map_err(failed)?;
        for (name, targets, runs, generations) in [
            ("three-targets", &[[3.0, 6.0], [-5.0, 9.0], [-1.0, 13.5]][..], 4, 60),
            ("one-swing", &[[-3.0, 6.0], [4.0, 10.0]], 8, 2000),
        ] {
            let request = draw::EvolveRequest {
                name: name.to_owned(),
                drawing: Drawing::of_targets(targets),
                method: Method::Evolve,
                runs,
                generations,
                seed: 1,
                model: None,
            };
            draw::evolve(studio, &request).map_err(|refusal| StudioError::System(refusal.1))?;
        }
        Ok(Self { studio: studio.clone(), run })
    }
}

impl Drop for Demo {
    fn drop(&mut self) {
        // Not by its folder alone, whose lock it may not hold yet.
        jobs::ask_to_end(&mut self.run);
        let mut evolution = self.studio.queue.close();
        evolution.iter_mut().for_each(jobs::wait_for_end);
        jobs::wait_for_end(&mut self.run);
        // Whoever looked may have stopped the run and resumed it: then another process holds its folder.
        let _ = StopPlan { folder: self.studio.root.join(BEAN), wait_min: 0.1 }.execute(&Silent);
    }
}

/// A new folder for a demonstration, in the folder of the system for such.
pub(crate) fn folder() -> Result<std::path::PathBuf, StudioError> {
    let word = crate::access::random_word()?;
    let path = std::env::temp_dir().join(format!("tropism-demo-{}", &word[..8]));
    tropism_lab::files::make_folder(&path)?;
    Ok(path)
}

/// Deletes the folder of a demonstration.
pub(crate) fn remove(path: &Path) {
    let _ = std::fs::remove_dir_all(path);
}
