//! The state of an evolution at work in one line, for its monitor.

use std::time::{Duration, Instant};

use tropism::math::statistics::median;
use tropism_neat::Generation;

use crate::Monitor;

/// Shortest time between two status lines; chosen by hand, faster than anybody reads.
const REFRESH: Duration = Duration::from_millis(100);

/// Collects the latest generation of each run, and reports to the monitor of them.
pub(super) struct EvolutionMonitor {
    latest: Vec<Option<Generation>>,
    /// Unit of the fitness.
    unit: &'static str,
    evaluations: u64,
    started: Instant,
    reported: Option<Instant>,
}

impl EvolutionMonitor {
    /// The status of `runs` runs before their first generation, with a fitness in `unit`.
    pub(super) fn new(runs: usize, unit: &'static str) -> Self {
        Self { latest: vec![None; runs], unit, evaluations: 0, started: Instant::now(), reported: None }
    }

    /// Takes in the last generation of a resumed run: its evaluations were made before.
    pub(super) fn resume(&mut self, run: u32, generation: &Generation) {
        self.latest[run as usize] = Some(generation.clone());
    }

    /// Takes in a new generation, and reports the status unless the last report is less than [`REFRESH`] old.
    pub(super) fn update(&mut self, run: u32, generation: &Generation, monitor: &dyn Monitor) {
        self.evaluations += generation.population as u64;
        self.resume(run, generation);
        if self.reported.is_none_or(|reported| reported.elapsed() >= REFRESH) {
            self.reported = Some(Instant::now());
            let seconds = self.started.elapsed().as_secs_f64().max(1e-3);
            monitor.status(&self.line(self.evaluations as f64 / seconds));
        }
    }

    /// The best fitness so far over all runs, and means over the present populations.
    fn line(&self, evaluations_per_s: f64) -> String {
        let (latest, unit): (Vec<&Generation>, _) = (self.latest.iter().flatten().collect(), self.unit);
        let mean =
            |of: fn(&Generation) -> f64| latest.iter().map(|&run| of(run)).sum::<f64>() / latest.len() as f64;
        let mut best: Vec<f64> = latest.iter().map(|run| run.best_ever).collect();
        best.sort_by(f64::total_cmp);
        let runs = match best.len() {
            0 => return String::new(),
            1 => String::new(),
            runs => format!(" ({runs} runs: median {:.2})", median(&best)),
        };
        format!(
            "best {:.2} {unit}{runs}, population: median {:.2} {unit}, {:.0} species, {:.0} links, {} evaluations/s",
            best[best.len() - 1],
            mean(|run| run.median),
            mean(|run| run.species as f64),
            mean(|run| run.links_mean),
            evaluations_per_s.round()
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
    fn the_line_covers_the_runs_that_have_begun() {
        let mut status = EvolutionMonitor::new(4, "cm");
        assert_eq!(status.line(0.0), "");
        status.resume(2, &generation(9.5, 1.0, 4));
        assert_eq!(
            status.line(1234.4),
            "best 9.50 cm, population: median 1.00 cm, 4 species, 8 links, 1234 evaluations/s"
        );
        status.resume(0, &generation(11.0, 3.0, 8));
        assert!(status.line(0.0).contains("(2 runs: median 10.25)"));
        status.resume(3, &generation(7.0, 2.0, 6));
        assert_eq!(
            status.line(9e4),
            "best 11.00 cm (3 runs: median 9.50), population: median 2.00 cm, 6 species, 8 links, 90000 evaluations/s"
        );
    }
}
