//! Plans of a calibration.

use super::comes_back_from_json;
use tropism::geometry::Pixel;
use tropism::math;
use tropism_lab::Workflow;
use tropism_lab::calibrate_camera::{CalibrateCameraPlan, Mark, ScaleSource};

#[test]
fn the_default_is_the_camera_of_the_paper() {
    let ScaleSource::Geometry { distance_cm, view_deg } = ScaleSource::default() else { panic!() };
    let width_cm = 2.0 * distance_cm * math::tan(view_deg.to_radians() / 2.0);
    assert!((width_cm - 74.0).abs() < 1e-9, "{width_cm}");
}

#[test]
fn a_plan_goes_through_json() {
    let ends = [Pixel::new(1.0, 2.0), Pixel::new(3.0, 4.0)];
    let plan = CalibrateCameraPlan {
        scale: ScaleSource::Marks(vec![Mark { ends, length_cm: 5.0 }]),
        ..CalibrateCameraPlan::default()
    };
    comes_back_from_json(&plan);
}

#[test]
fn impossible_plans_are_refused_by_key() {
    let refused = |scale: ScaleSource| {
        CalibrateCameraPlan { scale, ..CalibrateCameraPlan::default() }.check().unwrap_err().to_string()
    };
    let geometry = |distance_cm, view_deg| refused(ScaleSource::Geometry { distance_cm, view_deg });
    assert!(geometry(0.0, 50.0).contains("`distance_cm` 0, wanted more than 0"));
    assert!(geometry(74.0, 180.0).contains("`view_deg` 180, wanted more than 0 and less than 180"));
    let board = ScaleSource::Checkerboard { columns: 2, rows: 6, square_cm: 1.0 };
    assert!(refused(board).contains("2 x 6 inner corners, wanted 3 to 100"));
    assert!(refused(ScaleSource::Marks(Vec::new())).contains("no mark has a length"));
}
