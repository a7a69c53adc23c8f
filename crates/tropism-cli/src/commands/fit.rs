//! `tropism fit`: tracks into the tip-motion model.

use std::path::{Path, PathBuf};

use anyhow::Result;
use clap::{Args, ValueEnum};
use serde::Serialize;
use tropism::observation::Quality;
use tropism::plant::shifts::Window;
use tropism::plant::tip::{Empty, Growth, TipModel, TipModelConfig};
use tropism::track::Track;
use tropism_lab::{RunConfig, files};

use crate::options::parse_pair;
use crate::shell::Shell;

/// Make the tip-motion model of tracks, eqs. (1)-(3)
///
/// Every pair of successive, measured tips with a lit lamp between them is a datum, and so is its mirror image.
#[derive(Args)]
#[command(after_help = "Example:\n  tropism fit tent/*/track.csv --out model.json")]
pub(crate) struct Fit {
    /// Tracks (CSV with tip_x_cm, tip_y_cm and light)
    #[arg(required = true, value_name = "TRACK.csv")]
    tracks: Vec<PathBuf>,

    /// Where the model goes
    #[arg(long, value_name = "model.json")]
    out: PathBuf,

    /// Half-width and half-height of the sliding window, in cm
    #[arg(long, value_name = "WX,WY", value_parser = parse_pair, allow_hyphen_values = true, default_value = "0.5,1")]
    window: Pair,

    /// Mean and standard deviation of growth, in cm a step, eq. (4)
    #[arg(long, value_name = "MEAN,SD", value_parser = parse_pair, allow_hyphen_values = true, default_value = "0.03,0.01")]
    growth: Pair,

    /// What the tip does where a window holds no data: stand still sideways, or as at the nearest place with data
    #[arg(long, value_enum, default_value = "still")]
    empty: EmptyName,
}

type Pair = [f64; 2];

#[derive(Clone, Copy, ValueEnum)]
enum EmptyName {
    Still,
    Nearest,
}

#[derive(Serialize)]
struct Outcome {
    model: PathBuf,
    tracks: usize,
    is_virtual: bool,
    shifts: usize,
    x_cm: [f64; 2],
    y_cm: [f64; 2],
}

/// Whether a track is of a virtual plant: it was simulated, or its run folder or the file beside it says so.
pub(crate) fn is_of_virtual_plant(path: &Path, track: &Track) -> bool {
    let is_simulated = track.samples.iter().any(|sample| sample.quality == Quality::Simulated);
    is_simulated
        || tropism_lab::track::is_virtual(path)
        || path.parent().is_some_and(|folder| RunConfig::read(folder).is_ok_and(|run| run.is_virtual()))
}

impl Fit {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let tracks = self.tracks.iter().map(|path| files::read_track(path)).collect::<Result<Vec<_>, _>>()?;
        let config = TipModelConfig {
            window: Window { wx: self.window[0], wy: self.window[1] },
            growth: Growth { mean: self.growth[0], sd: self.growth[1] },
            empty: match self.empty {
                EmptyName::Still => Empty::Still,
                EmptyName::Nearest => Empty::Nearest,
            },
            ..TipModelConfig::default()
        };
        let is_virtual =
            self.tracks.iter().zip(&tracks).any(|(path, track)| is_of_virtual_plant(path, track));
        let model = TipModel::fit(&tracks, config)?.of_virtual_plants(is_virtual);
        files::write(&self.out, model.to_json().as_bytes())?;
        let span = |value: fn(&tropism::plant::shifts::Shift) -> f64| {
            let values = model.observed().iter().map(value);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        };
        let outcome = Outcome {
            model: self.out.clone(),
            tracks: tracks.len(),
            is_virtual,
            shifts: model.observed().len(),
            x_cm: span(|shift| shift.tip.x),
            y_cm: span(|shift| shift.tip.y),
        };
        let text = format!(
            "{} shifts of {} tracks{}, mirrored; tips at x {:.1} to {:.1} cm, y {:.1} to {:.1} cm\n\
             wrote {}\nnext: tropism evolve --model {} --out evolution",
            outcome.shifts,
            outcome.tracks,
            if is_virtual { " of virtual plants" } else { "" },
            outcome.x_cm[0],
            outcome.x_cm[1],
            outcome.y_cm[0],
            outcome.y_cm[1],
            self.out.display(),
            self.out.display(),
        );
        shell.result(&text, &outcome)
    }
}
