//! What an evolution at work says of itself.

use std::time::{Duration, Instant};

use tropism::math::statistics;
use tropism_neat::Generation;

use crate::shell::Progress;

/// How often the progress line is written anew.
const REFRESH: Duration = Duration::from_millis(100);

/// What is known of a running evolution, for its progress line.
pub(super) struct Live {
    latest: Vec<Option<Generation>>,
    evaluations: u64,
    started: Instant,
    said: Option<Instant>,
}

impl Live {
    /// Of so many runs, none of which has begun.
    pub(super) fn new(runs: usize) -> Self {
        Self { latest: vec![None; runs], evaluations: 0, started: Instant::now(), said: None }
    }

    /// Takes in the generation at which a run goes on.
    pub(super) fn know(&mut self, run: u32, generation: &Generation) {
        self.latest[run as usize] = Some(generation.clone());
    }

    /// Takes in a generation, and says on the progress line what is known now.
    pub(super) fn see(&mut self, run: u32, generation: &Generation, progress: &Progress) {
        self.evaluations += generation.population as u64;
        self.know(run, generation);
        if self.said.is_none_or(|said| said.elapsed() >= REFRESH) {
            self.said = Some(Instant::now());
            let rate = self.evaluations as f64 / self.started.elapsed().as_secs_f64().max(1e-3);
            progress.say(format!("\n  {}", self.message(rate)));
        }
    }

    /// The best so far of all runs that have begun, and what their populations are like now.
    fn message(&self, evaluations_a_second: f64) -> String {
        let now: Vec<&Generation> = self.latest.iter().flatten().collect();
        let mean = |of: fn(&Generation) -> f64| statistics::mean(now.iter().map(|&run| of(run)));
        let mut best: Vec<f64> = now.iter().map(|run| run.best_ever).collect();
        best.sort_by(f64::total_cmp);
        let runs = match best.len() {
            0 => return String::new(),
            1 => String::new(),
            runs => format!(" ({runs} runs: median {:.2})", statistics::median(&best)),
        };
        format!(
            "best {:.2} cm{runs}, population: median {:.2} cm, {:.0} species, {:.0} links, {} evaluations/s",
            best[best.len() - 1],
            mean(|run| run.median),
            mean(|run| run.species as f64),
            mean(|run| run.links_mean),
            evaluations_a_second.round()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn generation(best_ever: f64, median: f64, species: usize) -> Generation {
        Generation {
            generation: 3,
            best: best_ever,
            mean: 0.0,
            median,
            best_ever,
            species,
            population: 50,
            links_mean: 8.4,
            hidden_mean: 1.0,
            champion_links: 9,
            threshold: 5.0,
            evaluations: 200,
        }
    }

    #[test]
    fn the_message_tells_of_the_runs_that_have_begun() {
        let mut live = Live::new(4);
        assert_eq!(live.message(0.0), "");
        live.know(2, &generation(9.5, 1.0, 4));
        assert_eq!(
            live.message(1234.4),
            "best 9.50 cm, population: median 1.00 cm, 4 species, 8 links, 1234 evaluations/s"
        );
        live.know(0, &generation(11.0, 3.0, 8));
        assert!(live.message(0.0).contains("(2 runs: median 10.25)"));
        live.know(3, &generation(7.0, 2.0, 6));
        assert_eq!(
            live.message(9e4),
            "best 11.00 cm (3 runs: median 9.50), population: median 2.00 cm, 6 species, 8 links, 90000 evaluations/s"
        );
    }
}
