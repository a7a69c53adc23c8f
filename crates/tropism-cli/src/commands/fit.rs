//! `tropism fit`: the tip-motion model of tracks.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use tropism::plant::shifts::Window;
use tropism::plant::tip::{Empty, Growth, TipModelConfig};
use tropism_lab::fit::{FitPlan, FitResults};

use crate::options::parse_pair;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Fit the tip-motion model to tracks, eqs. (1)-(3)
///
/// The data are all pairs of successive measured tips with a lit lamp between them, and their mirror images.
#[derive(Args)]
#[command(after_help = "Example:\n  tropism fit tent/*/track.csv --out model.json")]
pub(crate) struct Fit {
    /// Tracks (CSV with tip_x_cm, tip_y_cm and light)
    #[arg(required = true, value_name = "TRACK.csv")]
    tracks: Vec<PathBuf>,

    /// File to write the model to
    #[arg(long, value_name = "model.json")]
    out: PathBuf,

    /// Half-width and half-height of the sliding window, in cm
    #[arg(long, value_name = "WX,WY", value_parser = parse_pair, allow_hyphen_values = true, default_value = "0.5,1")]
    window: Pair,

    /// Mean and standard deviation of growth, in cm a step, eq. (4)
    #[arg(long, value_name = "MEAN,SD", value_parser = parse_pair, allow_hyphen_values = true, default_value = "0.03,0.01")]
    growth: Pair,

    /// Motion of the tip where a window holds no data: straight up, or as at the nearest place with data
    #[arg(long, value_enum, default_value = "still")]
    empty: EmptyName,
}

type Pair = [f64; 2];

#[derive(Clone, Copy, ValueEnum)]
enum EmptyName {
    Still,
    Nearest,
}

impl Fit {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let model = TipModelConfig {
            window: Window { wx: self.window[0], wy: self.window[1] },
            growth: Growth { mean: self.growth[0], sd: self.growth[1] },
            empty: match self.empty {
                EmptyName::Still => Empty::Still,
                EmptyName::Nearest => Empty::Nearest,
            },
            ..TipModelConfig::default()
        };
        execute_and_print(&FitPlan { tracks: self.tracks, model, out: self.out }, shell, text)
    }
}

fn text(results: &FitResults) -> String {
    let FitResults { shifts, tracks, x_cm, y_cm, .. } = results;
    let of_plants = if results.is_virtual { " of virtual plants" } else { "" };
    format!(
        "{shifts} shifts of {tracks} tracks{of_plants}, mirrored; tips at x {:.1} to {:.1} cm, y {:.1} to {:.1} cm\n\
         wrote {out}\nnext: tropism evolve --model {out} --out evolution",
        x_cm[0],
        x_cm[1],
        y_cm[0],
        y_cm[1],
        out = results.model.display(),
    )
}
