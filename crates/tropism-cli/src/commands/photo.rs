//! `tropism photo`: a photograph now.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::by_hand::{PhotoPlan, PhotoResults, Seen};

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Take a photograph with the camera of a rig, and find the tip in it
///
/// The photograph is judged by itself, without those before it. A rig that a run drives is refused.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism photo rig.toml --out now.jpg\n  \
    tropism photo rig.toml --light left --out left.jpg")]
pub(crate) struct Photo {
    /// Rig file
    #[arg(value_name = "RIG.toml")]
    rig: PathBuf,

    /// What is lit meanwhile: a lamp, `flash`, or `dark` [default: flash]
    #[arg(long, value_name = "LIGHT")]
    light: Option<String>,

    /// File of the photograph
    #[arg(long, value_name = "FILE.jpg")]
    out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

impl Photo {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        Shell::end_in_order();
        let Self { rig, light, out, force } = self;
        let plan = PhotoPlan { rig, out, light, replace: force, watchdog: std::env::current_exe().ok() };
        execute_and_print(&plan, shell, text)
    }
}

fn text(PhotoResults { photograph, seen, is_virtual, .. }: &PhotoResults) -> String {
    let tip = match seen {
        None => {
            "no plant is looked for without a [calibration]; tropism calibrate-camera makes one".to_owned()
        }
        Some(Seen { tip: Some(tip), tip_px: Some(pixel), confidence, .. }) => format!(
            "tip at {:.1}, {:.1} cm, pixel {:.0}, {:.0}, confidence {confidence:.2}",
            tip.x, tip.y, pixel.x, pixel.y
        ),
        Some(Seen { status, .. }) => format!("no plant found ({status})"),
    };
    let of = if *is_virtual { ", of a virtual bean" } else { "" };
    format!("wrote {}: {tip}{of}", photograph.display())
}
