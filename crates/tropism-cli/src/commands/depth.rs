//! `tropism depth`: one track in space from the tracks of two cameras.

use std::path::PathBuf;

use anyhow::Result;
use clap::{Args, ValueEnum};
use tropism::vision::camera::stereo::Side;
use tropism_lab::depth::{DepthPlan, DepthResults};
use tropism_lab::units::plural;

use crate::options::parse_pair;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Triangulate the tracks of a front and a side camera: tip, apex and stem in space
///
/// Both tracks come from `tropism track`, of photographs taken at the same steps. Each camera is calibrated in the plane
/// through the root at a right angle to its view. Steps without a measured tip in either track are left out. z points to
/// the front camera. In space, x and y are free of the error that a single camera makes with what is nearer to it.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism depth front.csv side.csv --distance 74,74 --out space.csv\n  \
    tropism depth front.csv left.csv --side left --distance 80,65 --out space.csv")]
pub(crate) struct Depth {
    /// Track of the front camera
    #[arg(value_name = "FRONT.csv")]
    front: PathBuf,

    /// Track of the side camera
    #[arg(value_name = "SIDE.csv")]
    side: PathBuf,

    /// Distance from each camera's lens to the plane through the root, in cm, the front camera's first
    #[arg(long, value_name = "CM,CM", value_parser = parse_pair)]
    distance: Pair,

    /// Side from which the second camera sees the plant, as the first camera sees it
    #[arg(long = "side", id = "from", value_enum, default_value = "right")]
    from: SideName,

    /// File to write the track in space to
    #[arg(long, value_name = "space.csv")]
    out: PathBuf,

    /// Replace an existing track
    #[arg(long)]
    force: bool,
}

type Pair = [f64; 2];

#[derive(Clone, Copy, ValueEnum)]
enum SideName {
    Left,
    Right,
}

impl Depth {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = DepthPlan {
            front: self.front,
            side: self.side,
            distance_cm: self.distance,
            from: match self.from {
                SideName::Left => Side::Left,
                SideName::Right => Side::Right,
            },
            out: self.out,
            replace: self.force,
        };
        execute_and_print(&plan, shell, text)
    }
}

fn text(results: &DepthResults) -> String {
    format!(
        "{}{} in space, {} with the whole stem; distance between the two rays to the tip {:.2} cm (median), {:.2} cm at \
         most\nwrote {}",
        plural(results.steps, "step"),
        if results.is_virtual { " of a virtual plant" } else { "" },
        results.stems,
        results.tip_gap_cm[0],
        results.tip_gap_cm[1],
        results.track.display()
    )
}
