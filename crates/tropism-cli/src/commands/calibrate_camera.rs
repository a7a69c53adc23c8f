//! `tropism calibrate-camera`: how a camera's pixels are centimetres, kept in a file.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::{ArgGroup, Args};
use serde::Serialize;
use tropism::geometry::Pixel;
use tropism::math;
use tropism::photo::Image;
use tropism::vision::Calibration;
use tropism::vision::camera::checkerboard::Checkerboard;
use tropism::vision::camera::lens::Lens;
use tropism_lab::files;

use crate::options::{Mark, parse_mark, parse_pair};
use crate::shell::Shell;

/// Tell how a camera's pixels are centimetres, from one photograph
///
/// By marks of known length that were clicked (a ruler, the pot's rim; several tell how well they agree), by the
/// camera's distance and angle of view, or by a checkerboard held upright in the plane of the stem, which shows the
/// distortion of the lens and the tilt of the camera, too. All lengths hold in that plane alone.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism calibrate-camera photo.jpg --mark 280,400,445,400=15 --base 364,336 --out calibration.toml\n  \
    tropism calibrate-camera board.jpg --checkerboard 9x6@1.5 --base 1296,1700 --out calibration.toml\n  \
    tropism calibrate-camera photo.jpg --distance 74 --view 53.5 --base 1296,1700 --out calibration.toml")]
#[command(group = ArgGroup::new("way").required(true).args(["mark", "checkerboard", "distance"]))]
pub(crate) struct CalibrateCamera {
    /// Photograph by the camera that stays where it is
    #[arg(value_name = "PHOTO")]
    photograph: PathBuf,

    /// Two pixels and the cm between them; may be given several times
    #[arg(long, value_name = "X,Y,X,Y=CM", value_parser = parse_mark, conflicts_with_all = ["checkerboard", "distance"])]
    mark: Vec<Mark>,

    /// Inner corners each way (where four squares meet) and the side of a square in cm: 10 x 7 squares of 1.5 cm are
    /// 9x6@1.5
    #[arg(long, value_name = "COLUMNSxROWS@CM", value_parser = parse_board, conflicts_with = "distance")]
    checkerboard: Option<Checkerboard>,

    /// From the camera to the plane of the stem, in cm
    #[arg(long, value_name = "CM", requires = "view")]
    distance: Option<f64>,

    /// The camera's angle of view from the left to the right edge of the picture, in degrees
    #[arg(long, value_name = "DEGREES", requires = "distance")]
    view: Option<f64>,

    /// Pixel where the stem leaves the soil; the middle of the lower edge by default
    #[arg(long, value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    base: Option<Pair>,

    /// Where the calibration goes
    #[arg(long, value_name = "calibration.toml")]
    out: PathBuf,

    /// Replace a calibration that is there already
    #[arg(long)]
    force: bool,
}

type Pair = [f64; 2];

/// `9x6@1.5`.
fn parse_board(text: &str) -> Result<Checkerboard, String> {
    let wanted = || {
        "wanted inner corners each way, 3 to 100, and the side of a square in cm, such as 9x6@1.5".to_owned()
    };
    let (corners, side) = text.split_once('@').ok_or_else(wanted)?;
    let (columns, rows) = corners.split_once('x').ok_or_else(wanted)?;
    let count =
        |part: &str| part.trim().parse().ok().filter(|count| (3..=100).contains(count)).ok_or_else(wanted);
    let side = side.trim().trim_end_matches("cm").parse().ok();
    let square_cm = side.filter(|side: &f64| side.is_finite() && *side > 0.0).ok_or_else(wanted)?;
    Ok(Checkerboard { columns: count(columns)?, rows: count(rows)?, square_cm })
}

#[derive(Serialize)]
struct Outcome {
    out: PathBuf,
    calibration: Calibration,
    residual_px: Option<f64>,
    corners: Option<usize>,
}

impl CalibrateCamera {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let name = self.photograph.display().to_string();
        ensure!(
            self.force || !self.out.exists(),
            "{}: found a file here already, wanted a new name, or --force to replace it",
            self.out.display()
        );
        let image = files::read_photo(&self.photograph, 0.0)?.decode().with_context(|| name.clone())?;
        let Image { width, height, .. } = image;
        let base = self.base.map_or_else(
            || Pixel::new((width as f64 - 1.0) / 2.0, height as f64 - 1.0),
            |[x, y]| Pixel::new(x, y),
        );
        let mut outcome = Outcome {
            out: self.out.clone(),
            calibration: Calibration::from_scale(base, 1.0, width, height),
            residual_px: None,
            corners: None,
        };
        let calibration = &mut outcome.calibration;
        let mut words = String::new();
        if let Some(board) = &self.checkerboard {
            let corners = board.find(&image).with_context(|| name.clone())?;
            let fit = Lens::fit(&corners, width, height).with_context(|| {
                format!("{name}: found a checkerboard that fits no lens, wanted a flat one")
            })?;
            calibration.px_per_cm = fit.lens.px_per_cm(base, width, height);
            (calibration.lens, calibration.residual_mm) = (Some(fit.lens), Some(fit.residual_mm));
            (outcome.residual_px, outcome.corners) = (Some(fit.residual_px), Some(corners.len()));
            words = format!(
                "{} corners, {:.2} px ({:.3} mm) off on average; distortion of the lens {:+.3}; beyond the board it is a \
                 guess\n",
                corners.len(),
                fit.residual_px,
                fit.residual_mm,
                fit.lens.distortion
            );
        } else if let (Some(distance), Some(view)) = (self.distance, self.view) {
            ensure!(
                distance > 0.0 && distance.is_finite(),
                "found --distance {distance}, wanted more than 0 cm"
            );
            ensure!(
                view > 0.0 && view < 180.0,
                "found --view {view}, wanted more than 0 and less than 180 degrees"
            );
            calibration.px_per_cm = width as f64 / (2.0 * distance * math::tan(view.to_radians() / 2.0));
        } else {
            let scale =
                Calibration::fit_scale(&self.mark).context("found no mark with a length, wanted one")?;
            (calibration.px_per_cm, calibration.residual_mm) = scale;
            let longest = self.mark.iter().map(|mark| mark.1).fold(0.0, f64::max);
            words = match scale.1 {
                Some(residual) => format!("{} marks, {residual:.2} mm off on average\n", self.mark.len()),
                None => format!(
                    "one mark: a click that is a pixel off is {:.1} % of all lengths\n",
                    100.0 / (longest * scale.0)
                ),
            };
        }
        calibration.check()?;
        files::write(&self.out, toml::to_string(calibration)?.as_bytes())?;
        let text = format!(
            "{words}{:.2} pixels a cm at the root, {:.1}, {:.1}\nwrote {out}\nnext: tropism track PHOTOS --calibration {out} \
             --roi X,Y,W,H --out track.csv",
            calibration.px_per_cm,
            base.x,
            base.y,
            out = self.out.display(),
        );
        shell.result(&text, &outcome)
    }
}
