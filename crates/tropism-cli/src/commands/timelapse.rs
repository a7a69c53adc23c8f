//! `tropism timelapse`: a run as a film and as one picture.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::timelapse::{Crop, TimelapsePlan, TimelapseResults};
use tropism_lab::units::plural;

use crate::options::parse_region;
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Make a film of a run's photographs, and all of them in one picture
///
/// The film shows the lit lamp, the targets and the path of the tip, coloured by the lamp that was lit. The picture, the
/// paper's Figure 2, has the lightest value of every pixel: a plant before dark cloth leaves a print of each of its
/// postures. It goes beside the film, as .jpg. Virtual plants are called so in both. A run that is not over, and any folder
/// of photographs, will do.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism timelapse steered --out steered.gif\n  \
    tropism timelapse bean --out bean.mp4 --width 1080 --fps 30 --every 1\n  \
    tropism timelapse my-photos --out figure-2.jpg")]
pub(crate) struct Timelapse {
    /// Run folder, or a folder of photographs
    #[arg(value_name = "RUN")]
    folder: PathBuf,

    /// Film as .gif, or as .mp4 where ffmpeg is installed; .jpg makes the composite picture alone
    #[arg(long, value_name = "FILE")]
    out: PathBuf,

    /// Width in pixels at most; no larger than the photographs, or four times the part of --crop
    #[arg(long, default_value_t = 480, value_name = "N", value_parser = clap::value_parser!(u16).range(16..=8192))]
    width: u16,

    /// Pictures a second
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=50))]
    fps: u16,

    /// Take each Nth photograph; so many that the film has at most 300 pictures by default
    #[arg(long, alias = "stride", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    every: Option<u32>,

    /// Show a part of the photographs: `plant`, where the tip went, with targets and root, or X,Y,W,H in pixels
    #[arg(long, value_name = "plant|X,Y,W,H", value_parser = parse_crop)]
    crop: Option<Crop>,

    /// Draw nothing into the photographs but that a virtual plant is virtual
    #[arg(long)]
    plain: bool,

    /// Replace an existing film and picture
    #[arg(long)]
    force: bool,
}

/// `plant`, or a region in pixels.
fn parse_crop(text: &str) -> Result<Crop, String> {
    if text == "plant" { Ok(Crop::Plant) } else { parse_region(text).map(Crop::Region) }
}

impl Timelapse {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = TimelapsePlan {
            folder: self.folder,
            out: self.out,
            width: self.width,
            fps: self.fps,
            every: self.every,
            crop: self.crop,
            plain: self.plain,
            replace: self.force,
        };
        execute_and_print(&plan, shell, |results| text(results, plan.fps))
    }
}

fn text(results: &TimelapseResults, fps: u16) -> String {
    let left_out = match results.left_out {
        0 => String::new(),
        count => format!("\nleft out, damaged or of another size: {}", plural(count, "photograph")),
    };
    let film = results.film.as_ref().map_or_else(String::new, |film| {
        let seconds = results.pictures as f64 / f64::from(fps);
        format!("\nwrote {}: {}, {seconds:.1} s", film.display(), plural(results.pictures, "picture"))
    });
    let kind = if results.is_virtual == Some(true) { " of a virtual plant" } else { "" };
    format!(
        "{}{kind}; {} x {} pixels{left_out}{film}\nwrote {}",
        plural(results.photographs, "photograph"),
        results.width,
        results.height,
        results.composite.display()
    )
}
