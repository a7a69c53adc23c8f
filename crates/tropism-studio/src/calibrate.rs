//! A camera that is calibrated by clicks: both ends of something of known length, and the place where the stem leaves the soil.

use std::path::Path;

use serde::{Deserialize, Serialize};
use tropism::geometry::Pixel;
use tropism::vision::Calibration;
use tropism_lab::calibrate_camera::{CalibrateCameraPlan, Mark, ScaleSource};
use tropism_lab::files::shell_word;
use tropism_lab::run::read_rig;
use tropism_lab::{Silent, Workflow, files};
use tropism_rig::file::RigFile;

use crate::Studio;
use crate::error::Refusal;
use crate::found::resolve;

/// What was clicked in a photograph that was taken by hand.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Clicked {
    /// The rig whose camera took it.
    rig: String,
    /// Number of the photograph.
    number: u64,
    /// Both ends of something in the plane of the stem, in pixels.
    ends: [[f64; 2]; 2],
    /// The length between them, in cm.
    length_cm: f64,
    /// Where the stem leaves the soil, in pixels.
    base: [f64; 2],
    /// Whether the rig file takes it.
    #[serde(default)]
    write: bool,
}

/// A calibration by clicks.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct Calibrated {
    /// `[calibration]` of a rig file.
    table: String,
    px_per_cm: f64,
    /// Whether the rig file has it now.
    is_written: bool,
    /// The commands that do the same.
    commands: [String; 2],
}

/// The calibration as a table of a rig file, by the workflow of `tropism calibrate-camera`; into the rig file if that is asked.
pub(crate) fn calibrate(studio: &Studio, clicked: &Clicked) -> Result<Calibrated, Refusal> {
    let Clicked { rig, number, ends, length_cm, base, write } = clicked;
    let photograph = studio.scratch.join("calibration.jpg");
    files::write(&photograph, &studio.devices.photograph(*number)?)?;
    let [one, other] = ends;
    let pixel = |[x, y]: [f64; 2]| Pixel::new(x, y);
    let plan = CalibrateCameraPlan {
        photograph,
        scale: ScaleSource::Marks(vec![Mark { ends: ends.map(pixel), length_cm: *length_cm }]),
        base: Some(pixel(*base)),
        out: studio.scratch.join("calibration.toml"),
        replace: true,
    };
    let calibration = plan.execute(&Silent)?.calibration;
    let table = table(&calibration)?;
    let command = format!(
        "tropism calibrate-camera photo.jpg --mark {},{},{},{}={length_cm} --base {},{} --out calibration.toml",
        one[0], one[1], other[0], other[1], base[0], base[1],
    );
    if *write {
        put_into(&resolve(&studio.root, rig)?, &table, &calibration)?;
    }
    Ok(Calibrated {
        table,
        px_per_cm: calibration.px_per_cm,
        is_written: *write,
        commands: [format!("tropism photo {} --out photo.jpg", shell_word(Path::new(rig))), command],
    })
}

/// `[calibration]` of a rig file.
fn table(calibration: &Calibration) -> Result<String, Refusal> {
    #[derive(Serialize)]
    struct Rig<'a> {
        calibration: &'a Calibration,
    }
    toml::to_string(&Rig { calibration }).map_err(|error| Refusal::bad(error.to_string()))
}

/// Puts a calibration into the rig file at `path`, in place of its own; all else stays as it is, to the letter.
fn put_into(path: &Path, table: &str, calibration: &Calibration) -> Result<(), Refusal> {
    let text = files::read_text(path)?;
    let wanted = RigFile { calibration: Some(*calibration), ..read_rig(path)? };
    let text = with_table(&text, table);
    if toml::from_str::<RigFile>(&text).ok() != Some(wanted) {
        return Err(Refusal::bad(
            "The calibration of this rig file is no table of its own. Nothing was written: copy the text into it.",
        ));
    }
    let about = path.metadata().ok();
    // A rig file may hold passwords: it is as private as it was, at every moment.
    files::write_private(path, text.as_bytes(), true)?;
    if let Some(about) = about {
        let _ = std::fs::set_permissions(path, about.permissions());
    }
    Ok(())
}

/// The text of a rig file with `table` where its own `[calibration]` stands, or at the end.
fn with_table(rig: &str, table: &str) -> String {
    let (mut before, mut after) = (String::new(), String::new());
    let (mut is_own, mut is_past) = (false, false);
    for line in rig.split_inclusive('\n') {
        if let Some(name) = line.trim_start().strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            is_own = name.0.trim() == "calibration" || name.0.trim().starts_with("calibration.");
            is_past |= is_own;
        }
        match (is_own, is_past) {
            (true, _) => {}
            (false, false) => before += line,
            (false, true) => after += line,
        }
    }
    let gap = if is_past || before.ends_with("\n\n") || before.is_empty() { "" } else { "\n" };
    let end = if after.is_empty() { "" } else { "\n" };
    format!("{before}{gap}{table}{end}{after}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: &str =
        "# our tent\nperiod_min = 5\n\n[camera]\ndriver = \"command\"\ncommand = [\n  \"cat\",\n]\n\n";

    #[test]
    fn a_calibration_takes_the_place_of_the_old_one_and_nothing_else_changes() {
        let new = "[calibration]\npx_per_cm = 9.5\n";
        let old = "[calibration] # by hand\npx_per_cm = 10\n\n[calibration.base]\nx = 1\n\n";
        let rest = "[vision.crop]\nx = 8\n";
        assert_eq!(with_table(&format!("{RIG}{old}{rest}"), new), format!("{RIG}{new}\n{rest}"));
        assert_eq!(with_table(&format!("{RIG}{rest}"), new), format!("{RIG}{rest}\n{new}"));
        assert_eq!(with_table(&format!("{RIG}{old}"), new), format!("{RIG}{new}"));
    }

    #[test]
    fn a_rig_file_whose_calibration_is_written_otherwise_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rig.toml");
        let calibration = Calibration::from_scale(Pixel::new(364.5, 336.0), 11.0, 648, 486);
        let lamps = "[lamps]\nleft = [\"true\"]\nright = [\"true\"]\ndark = [\"true\"]\n";
        let inline =
            "calibration = { px_per_cm = 10.0, width = 648, height = 486, base = { x = 1.0, y = 2.0 } }\n";
        std::fs::write(&path, format!("{inline}{RIG}{lamps}")).unwrap();
        let table = table(&calibration).unwrap();
        let refused = put_into(&path, &table, &calibration).unwrap_err();
        assert!(refused.1.contains("Nothing was written"), "{}", refused.1);
        assert!(std::fs::read_to_string(&path).unwrap().starts_with(inline));

        std::fs::write(&path, format!("{RIG}{lamps}[calibration]\npx_per_cm = 10.0\nwidth = 648\nheight = 486\n[calibration.base]\nx = 1.0\ny = 2.0\n")).unwrap();
        put_into(&path, &table, &calibration).unwrap();
        assert_eq!(read_rig(&path).unwrap().calibration, Some(calibration));
        assert!(std::fs::read_to_string(&path).unwrap().starts_with("# our tent"));
    }
}
