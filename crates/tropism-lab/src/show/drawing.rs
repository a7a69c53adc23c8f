//! Drawings of a champion: its network, and the map of its decisions.

use tropism::task::Task;
use tropism_report::{self as report, Figure, Page, Plants, SteeredTrack};

use super::source::ShownChampion;
use super::{ShowFormat, ShowResults};

impl ShownChampion {
    /// The champion in `format`, beside its properties.
    pub(super) fn draw(&self, format: ShowFormat, properties: &ShowResults) -> String {
        match format {
            ShowFormat::Dot => report::network_dot(&self.champion.genome),
            ShowFormat::Svg => report::in_one_svg(&self.figures()),
            ShowFormat::Html => self.page(properties).html(),
            ShowFormat::Text => self.text(properties),
        }
    }

    fn text(&self, properties: &ShowResults) -> String {
        let plant = self.steered.as_ref().map_or_else(String::new, |(track, plants)| {
            let fitness = self.task.fitness(track);
            format!("a plant that it steered: fitness {fitness:.2} cm. {}\n", plants.sentence())
        });
        let map = report::decision_text(&self.champion.genome, self.task.targets()).unwrap_or_default();
        let key = if map.is_empty() {
            ""
        } else {
            "\nlamp at each place of the tip: < left, > right, ~ depends on the past; digits: targets\n"
        };
        format!("{}\n{plant}{key}{map}", properties.summary())
    }

    /// The network, and the map if it is a controller.
    fn figures(&self) -> Vec<Figure> {
        let steered = self.steered.as_ref().map(|(track, plants)| SteeredTrack { track, plants: *plants });
        let map = report::decision(&self.champion.genome, self.task.targets(), steered).ok();
        [Some(report::network(&self.champion.genome)), map].into_iter().flatten().collect()
    }

    fn page(&self, properties: &ShowResults) -> Page {
        Page {
            title: format!("The network of {}", self.file.display()),
            intro: properties.summary().replace('\n', "; ") + ".",
            plants: self.steered.as_ref().map_or(Plants::Real, |(_, plants)| *plants),
            numbers: Vec::new(),
            tables: Vec::new(),
            figures: self.figures(),
            command: format!("tropism show {}", self.file.display()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: Vec::new(),
            stages: Vec::new(),
            config: String::new(),
        }
    }
}
