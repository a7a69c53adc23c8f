//! `tropism fit`: a model of tracks.

use std::path::PathBuf;

use anyhow::Result;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use tropism::plant::shifts::Window;
use tropism::plant::tip::{Empty, Growth, TipModelConfig};
use tropism_lab::files::shell_word;
use tropism_lab::fit::{FitPlan, FitResults, ModelKind};
use tropism_lab::units::plural;

use crate::options::parse_pair;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Fit a model to tracks: the tip-motion model, eqs. (1)-(3), or a linear one of the whole stem
///
/// The data of the tip-motion model are all pairs of successive measured tips with a lit lamp between them, and their mirror
/// images. The model of the stem is not the paper's: each step depends on the light of the last hour and on the last steps,
/// and each plant has a response of its own. It needs tracks with stems, such as those of `tropism track` and `tropism grow`,
/// and two lamps, one on each side. For targets in space the same model is fitted in space: it needs tracks of two cameras, and
/// takes 2 to 16 lamps. `tropism forecast` compares models on plants that were left out.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism fit tent --out model.json\n  \
    tropism fit tent/1/track.csv tent/2/track.csv --out model.json\n  \
    tropism fit grown --kind stem --out stem.json\n  \
    tropism grow --lamps 4 --cameras 2 --out around\n  \
    tropism fit around --kind space --out space.json")]
pub(crate) struct Fit {
    /// Tracks (CSV with tip_x_cm, tip_y_cm and light), and folders of runs or of tracks
    #[arg(required = true, value_name = "TRACK.csv|DIR")]
    tracks: Vec<PathBuf>,

    /// Also take tracks that `tropism track` warns of
    #[arg(long)]
    anyway: bool,

    /// File to write the model to
    #[arg(long, value_name = "model.json")]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,

    /// The paper's tip-motion model, or the linear model of the whole stem: in the plane, or in space
    #[arg(long = "kind", value_parser = model_parser(), default_value = ModelKind::default().name())]
    model: ModelKind,

    /// Half-width and half-height of the sliding window, in cm
    #[arg(long, value_name = "WX,WY", value_parser = parse_pair, allow_hyphen_values = true, default_value = "0.5,1")]
    window: Pair,

    /// Mean and standard deviation of growth in five minutes, in cm, eq. (4)
    #[arg(long, value_name = "MEAN,SD", value_parser = parse_pair, allow_hyphen_values = true, default_value = "0.03,0.01")]
    growth: Pair,

    /// Motion of the tip where a window holds no data: straight up, or as at the nearest place with data
    #[arg(long, value_enum, default_value = "still")]
    empty: EmptyName,
}

type Pair = [f64; 2];

/// The kinds of models as values of an option.
fn model_parser() -> impl TypedValueParser<Value = ModelKind> {
    PossibleValuesParser::new(ModelKind::all().map(ModelKind::name))
        .map(|name| ModelKind::named(&name).expect("one of the possible values"))
}

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
        let next = match (self.model.knows_stem(), self.model.is_in_space()) {
            (_, true) => "tune --task tasks/space.toml --out rule.json",
            (true, false) => "tune --out rule.json",
            (false, false) => "evolve --out evolution",
        };
        let plan = FitPlan {
            tracks: self.tracks,
            kind: self.model,
            model,
            anyway: self.anyway,
            out: self.out,
            replace: self.force,
        };
        execute_and_print(&plan, shell, |results| text(results, next))
    }
}

/// `next` is the command that the model is for.
fn text(results: &FitResults, next: &str) -> String {
    let FitResults { shifts, tracks, x_cm, y_cm, .. } = results;
    let mirrored = if results.is_mirrored { ", mirrored" } else { "" };
    let of_plants = if results.is_virtual { " of virtual plants" } else { "" };
    format!(
        "{} of {}{of_plants}{mirrored}; tips at x {:.1} to {:.1} cm, y {:.1} to {:.1} cm\n\
         wrote {out}\nnext: tropism {next} --model {word}",
        plural(*shifts, "shift"),
        plural(*tracks, "track"),
        x_cm[0],
        x_cm[1],
        y_cm[0],
        y_cm[1],
        out = results.model.display(),
        word = shell_word(&results.model),
    )
}
