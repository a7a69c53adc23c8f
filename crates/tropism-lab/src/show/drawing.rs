//! Drawings of a champion: its network, and the map of its decisions.

use tropism_report::{self as report, Figure, Page, Plants, SteeredTrack};

use super::source::ShownChampion;
use super::{ShowFormat, ShowResults};
use crate::Error;

impl ShownChampion {
    /// The champion in `format`, beside its properties.
    ///
    /// # Errors
    /// [`Error::Plan`] if the network is too large for a picture. Text and graphs have no bound.
    pub(super) fn draw(&self, format: ShowFormat, properties: &ShowResults) -> Result<String, Error> {
        let too_large = report::too_large_to_draw(&self.champion.genome);
        match (format, too_large) {
            (ShowFormat::Dot, _) => Ok(report::network_dot(&self.champion.genome)),
            (ShowFormat::Text, too_large) => Ok(self.text(properties, too_large)),
            (ShowFormat::Svg, None) => Ok(report::in_one_svg(&self.figures())),
            (ShowFormat::Html, None) => Ok(self.page(properties).html()),
            (ShowFormat::Svg | ShowFormat::Html, Some(sentence)) => {
                Err(Error::Plan(format!("{}: {sentence}; its graph can be had as .dot", self.file.display())))
            }
        }
    }

    /// The properties and the map, or why there is none.
    fn text(&self, properties: &ShowResults, too_large: Option<String>) -> String {
        let plant = self.steered.as_ref().map_or_else(String::new, |(track, plants)| {
            let fitness = self.task.fitness_in_words(self.task.fitness(track));
            format!("a plant that it steered: fitness {fitness}. {}\n", plants.sentence())
        });
        if let Some(sentence) = too_large {
            return format!("{}\n{plant}{sentence}\n", properties.summary());
        }
        let map = report::decision_text(&self.champion.genome, &self.task.targets).unwrap_or_default();
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
        let map = report::decision(&self.champion.genome, &self.task.targets, steered).ok();
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
            left_out: Vec::new(),
            command: format!("tropism show {}", self.file.display()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seeds: Vec::new(),
            stages: Vec::new(),
            config: String::new(),
        }
    }
}
