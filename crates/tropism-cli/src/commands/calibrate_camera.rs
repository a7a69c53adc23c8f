//! `tropism calibrate-camera`: the calibration of a camera from one photograph.

use std::path::PathBuf;

use anyhow::Result;
use clap::{ArgGroup, Args};
use tropism::geometry::Pixel;
use tropism_lab::calibrate_camera::{CalibrateCameraPlan, CalibrateCameraResults, Mark, ScaleSource};
use tropism_lab::files::shell_word;

use crate::options::{parse_board, parse_mark, parse_pair};
use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Calibrate a camera from one photograph: how many pixels make a cm
///
/// Takes marks of known length (a ruler, the pot's rim; several marks also give the error), the camera's distance and
/// angle of view, or a checkerboard held upright in the plane of the stem. Only the checkerboard corrects the distortion of
/// the lens and the tilt of the camera. All lengths hold in the plane of the stem only.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism calibrate-camera photo.jpg --mark 280,400,445,400=15 --base 364,336 --out calibration.toml\n  \
    tropism calibrate-camera board.jpg --checkerboard 9x6@1.5 --base 1296,1700 --out calibration.toml\n  \
    tropism calibrate-camera photo.jpg --distance 74 --view 53.5 --base 1296,1700 --out calibration.toml")]
#[command(group = ArgGroup::new("way").required(true).args(["mark", "checkerboard", "distance"]))]
pub(crate) struct CalibrateCamera {
    /// Photograph of the camera at its final place
    #[arg(value_name = "PHOTO")]
    photograph: PathBuf,

    /// Two pixels and the cm between them; may be given several times
    #[arg(long, value_name = "X,Y,X,Y=CM", value_parser = parse_mark, conflicts_with_all = ["checkerboard", "distance"])]
    mark: Vec<Mark>,

    /// Inner corners each way (where four squares meet) and the side of a square in cm: 10 x 7 squares of 1.5 cm are
    /// 9x6@1.5
    #[arg(long, value_name = "COLUMNSxROWS@CM", value_parser = parse_board, conflicts_with = "distance")]
    checkerboard: Option<ScaleSource>,

    /// Distance from the camera to the plane of the stem, in cm
    #[arg(long, value_name = "CM", requires = "view")]
    distance: Option<f64>,

    /// Horizontal angle of view of the camera, in degrees
    #[arg(long, value_name = "DEGREES", requires = "distance")]
    view: Option<f64>,

    /// Pixel where the stem leaves the soil; the middle of the lower edge by default
    #[arg(long, value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    base: Option<Pair>,

    /// File to write the calibration to
    #[arg(long, value_name = "calibration.toml")]
    out: PathBuf,

    /// Replace an existing calibration
    #[arg(long)]
    force: bool,
}

type Pair = [f64; 2];

impl CalibrateCamera {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let scale = match (self.checkerboard, self.distance, self.view) {
            (Some(checkerboard), ..) => checkerboard,
            (None, Some(distance_cm), Some(view_deg)) => ScaleSource::Geometry { distance_cm, view_deg },
            _ => ScaleSource::Marks(self.mark),
        };
        let plan = CalibrateCameraPlan {
            photograph: self.photograph,
            scale,
            base: self.base.map(|[x, y]| Pixel::new(x, y)),
            out: self.out,
            replace: self.force,
        };
        execute_and_print(&plan, shell, |results| text(&plan, results))
    }
}

fn text(plan: &CalibrateCameraPlan, results: &CalibrateCameraResults) -> String {
    let calibration = &results.calibration;
    format!(
        "{}{:.2} pixels a cm at the root, {:.1}, {:.1}\nwrote {out}\nnext: tropism track PHOTOS --calibration {word} \
         --roi X,Y,W,H --out track.csv",
        agreement(plan, results),
        calibration.px_per_cm,
        calibration.base.x,
        calibration.base.y,
        out = results.out.display(),
        word = shell_word(&results.out),
    )
}

/// A line on how well the calibration agrees with what it was made from; empty if nothing shows it.
fn agreement(plan: &CalibrateCameraPlan, results: &CalibrateCameraResults) -> String {
    let calibration = &results.calibration;
    match &plan.scale {
        ScaleSource::Geometry { .. } => String::new(),
        ScaleSource::Checkerboard { .. } => format!(
            "{} corners, {:.2} px ({:.3} mm) off on average; lens distortion {:+.3}; beyond the board it is \
             extrapolated\n",
            results.corners.unwrap_or_default(),
            results.residual_px.unwrap_or_default(),
            calibration.residual_mm.unwrap_or_default(),
            calibration.lens.map_or(0.0, |lens| lens.distortion)
        ),
        ScaleSource::Marks(marks) => match calibration.residual_mm {
            Some(residual) => format!("{} marks, {residual:.2} mm off on average\n", marks.len()),
            None => {
                let longest = marks.iter().map(|mark| mark.length_cm).fold(0.0, f64::max);
                let percent = 100.0 / (longest * calibration.px_per_cm);
                format!("one mark: a click that is one pixel off changes all lengths by {percent:.1} %\n")
            }
        },
    }
}
