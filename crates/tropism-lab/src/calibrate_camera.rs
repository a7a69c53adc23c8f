//! Camera calibration from one photograph: how many pixels make a centimetre in the plane of the stem.
//!
//! In: a photograph, and one of three measurements: marks of known length, a checkerboard in the plane of the stem, or the
//! camera's distance and angle of view. Out: a [`Calibration`] as a TOML file.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tropism::geometry::Pixel;
use tropism::math;
use tropism::photo::Image;
use tropism::vision::Calibration;
use tropism::vision::camera::checkerboard::Checkerboard;
use tropism::vision::camera::lens::Lens;

use crate::files;
use crate::{Error, Monitor, Workflow};

/// The photograph to calibrate from, and what gives its scale.
///
/// The default is the paper's camera: 74 cm in front of the plant (section 2.1), with the lens of
/// [`Frame::WIDTH_CM`](tropism_bean::view::Frame::WIDTH_CM).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CalibrateCameraPlan {
    /// Photograph of the camera at its final place.
    pub photograph: PathBuf,
    /// What gives the scale.
    pub scale: ScaleSource,
    /// Pixel where the stem leaves the soil. `None` means the middle of the picture's lower edge.
    pub base: Option<Pixel>,
    /// TOML file of the calibration.
    pub out: PathBuf,
    /// Whether to replace a file at `out`.
    pub replace: bool,
}

/// What gives the scale of a photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ScaleSource {
    /// Marks of known length.
    Marks(Vec<Mark>),
    /// A checkerboard in the plane of the stem, by its inner corners (where four squares meet). It also gives the distortion
    /// of the lens and the tilt of the camera.
    Checkerboard {
        /// Inner corners along one side, at least 3.
        columns: usize,
        /// Inner corners along the other side, at least 3.
        rows: usize,
        /// Side of a square, in cm.
        square_cm: f64,
    },
    /// Where the camera stands, and how wide it sees.
    Geometry {
        /// From the camera to the plane of the stem, in cm.
        distance_cm: f64,
        /// Horizontal angle of view, in degrees.
        view_deg: f64,
    },
}

/// A mark of known length in the plane of the stem.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mark {
    /// Both ends.
    pub ends: [Pixel; 2],
    /// The length between them, in cm.
    pub length_cm: f64,
}

/// A calibration, and how well it agrees with what it was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibrateCameraResults {
    /// The file of the calibration.
    pub out: PathBuf,
    /// The calibration.
    pub calibration: Calibration,
    /// Root mean square distance of the corners from where the lens projects them, in pixels; with a checkerboard only.
    pub residual_px: Option<f64>,
    /// Inner corners found; with a checkerboard only.
    pub corners: Option<usize>,
}

impl Default for CalibrateCameraPlan {
    fn default() -> Self {
        Self {
            photograph: PathBuf::new(),
            scale: ScaleSource::default(),
            base: None,
            out: PathBuf::from("calibration.toml"),
            replace: false,
        }
    }
}

impl Default for ScaleSource {
    fn default() -> Self {
        // As wide as it is far: twice the arc tangent of one half.
        Self::Geometry { distance_cm: 74.0, view_deg: 53.130_102_354_155_98 }
    }
}

impl Workflow for CalibrateCameraPlan {
    type Results = CalibrateCameraResults;

    const SCHEMA: &'static str = "tropism.calibrate-camera/1";

    fn check(&self) -> Result<(), Error> {
        match &self.scale {
            ScaleSource::Geometry { distance_cm, view_deg } => {
                check(*distance_cm > 0.0 && distance_cm.is_finite(), || {
                    format!("found `distance_cm` {distance_cm}, wanted more than 0 cm")
                })?;
                check(*view_deg > 0.0 && *view_deg < 180.0, || {
                    format!("found `view_deg` {view_deg}, wanted more than 0 and less than 180 degrees")
                })?;
            }
            ScaleSource::Checkerboard { columns, rows, square_cm } => {
                check(*columns.min(rows) >= 3 && *columns.max(rows) <= 100, || {
                    format!(
                        "found `checkerboard` of {columns} x {rows} inner corners, wanted 3 to 100 each way"
                    )
                })?;
                check(*square_cm > 0.0 && square_cm.is_finite(), || {
                    format!("found `square_cm` {square_cm}, wanted more than 0 cm")
                })?;
            }
            ScaleSource::Marks(marks) => {
                let is_long = |mark: &Mark| mark.length_cm > 0.0 && mark.length_cm.is_finite();
                let wanted = || "no mark has a length: give one".to_owned();
                check(!marks.is_empty() && marks.iter().all(is_long), wanted)?;
            }
        }
        files::check_free(&self.out, self.replace)?;
        files::check_outputs(std::slice::from_ref(&self.out), std::slice::from_ref(&self.photograph))
    }

    fn perform(&self, _monitor: &dyn Monitor) -> Result<CalibrateCameraResults, Error> {
        let place = self.photograph.display();
        let image = files::read_photo(&self.photograph, 0.0)?.decode().map_err(Error::at(&place))?;
        let Image { width, height, .. } = image;
        let lower_edge = Pixel::new((width as f64 - 1.0) / 2.0, height as f64 - 1.0);
        let mut calibration = Calibration::from_scale(self.base.unwrap_or(lower_edge), 1.0, width, height);
        let (mut residual_px, mut corners) = (None, None);
        match &self.scale {
            ScaleSource::Geometry { distance_cm, view_deg } => {
                let width_cm = 2.0 * distance_cm * math::tan(view_deg.to_radians() / 2.0);
                calibration.px_per_cm = width as f64 / width_cm;
            }
            &ScaleSource::Checkerboard { columns, rows, square_cm } => {
                let board = Checkerboard { columns, rows, square_cm };
                let found = board.find(&image).map_err(Error::at(&place))?;
                let fit = Lens::fit(&found, width, height).ok_or_else(|| {
                    let problem = "the checkerboard fits no lens: it must be flat";
                    Error::at(&place)(problem)
                })?;
                calibration.px_per_cm = fit.lens.px_per_cm(calibration.base, width, height);
                calibration.lens = Some(fit.lens);
                calibration.residual_mm = Some(fit.residual_mm);
                (residual_px, corners) = (Some(fit.residual_px), Some(found.len()));
            }
            ScaleSource::Marks(marks) => {
                let is_inside = |end: &Pixel| {
                    (0.0..width as f64).contains(&end.x) && (0.0..height as f64).contains(&end.y)
                };
                if let Some(Pixel { x, y }) =
                    marks.iter().flat_map(|mark| mark.ends).find(|end| !is_inside(end))
                {
                    let problem = format!("it has {width} x {height} pixels: no mark ends at {x},{y}");
                    return Err(Error::at(&place)(problem));
                }
                let marks: Vec<([Pixel; 2], f64)> =
                    marks.iter().map(|mark| (mark.ends, mark.length_cm)).collect();
                let scale = Calibration::fit_scale(&marks)
                    .ok_or_else(|| Error::Plan("no mark has a length: give one".to_owned()))?;
                (calibration.px_per_cm, calibration.residual_mm) = scale;
            }
        }
        calibration.check().map_err(Error::at(&place))?;
        let text = toml::to_string(&calibration).map_err(Error::at(self.out.display()))?;
        files::write(&self.out, text.as_bytes())?;
        Ok(CalibrateCameraResults { out: self.out.clone(), calibration, residual_px, corners })
    }
}

fn check(is_right: bool, problem: impl FnOnce() -> String) -> Result<(), Error> {
    if is_right { Ok(()) } else { Err(Error::Plan(problem())) }
}
