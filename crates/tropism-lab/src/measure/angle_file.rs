//! Files of angles: plants of which no stems are known.

use std::path::Path;

use tropism::measure::AngleRecord;

use crate::Error;
use crate::files::{self, FileError};

/// Columns: the first two are required. The last three are read from the first row.
const COLUMNS: [&str; 6] =
    ["time_h", "tip_angle_deg", "base_angle_deg", "growth_cm_h", "radius_cm", "zone_cm"];
/// Least number of rows.
const MIN_ROWS: usize = 8;

/// The angles in a file; `None` if it has not their columns.
pub(super) fn read(path: &Path) -> Result<Option<AngleRecord>, Error> {
    let text = files::read_text(path)?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
    let place = COLUMNS.map(|name| header.iter().position(|column| *column == name));
    let [Some(_), Some(_), ..] = place else { return Ok(None) };
    let mut rows: Vec<[Option<f64>; 6]> = Vec::new();
    for (number, line) in (2..).zip(lines).filter(|(_, line)| !line.trim().is_empty()) {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let mut row = [None; 6];
        for (at, value) in row.iter_mut().enumerate() {
            let Some(cell) = place[at].and_then(|place| cells.get(place)).filter(|cell| !cell.is_empty())
            else {
                continue;
            };
            let parsed = cell.parse().ok().filter(|value: &f64| value.is_finite());
            *value = Some(parsed.ok_or_else(|| {
                FileError::content(
                    path,
                    format!("line {number}: found {} {cell:?}, wanted a number", COLUMNS[at]),
                )
            })?);
        }
        let is_later = rows.last().is_none_or(|last| row[0] > last[0]);
        if !is_later {
            return Err(FileError::content(
                path,
                format!("line {number}: time_h must be later than in the row before"),
            )
            .into());
        }
        rows.push(row);
    }
    // A reading without an angle is a gap.
    let has_base = rows.iter().any(|row| row[2].is_some());
    let constant = |at: usize| rows.first().and_then(|row| row[at]);
    let constants = [3, 4, 5].map(constant);
    rows.retain(|row| row[0].is_some() && row[1].is_some() && (row[2].is_some() || !has_base));
    if rows.len() < MIN_ROWS {
        let problem = format!("found {} rows with time and angles, wanted at least {MIN_ROWS}", rows.len());
        return Err(FileError::content(path, problem).into());
    }
    let column = |at: usize| rows.iter().filter_map(|row| row[at]).collect::<Vec<f64>>();
    let radians = |at: usize| column(at).into_iter().map(f64::to_radians).collect();
    let [growth_cm_h, radius_cm, zone_cm] = constants;
    let start = rows[0][0].unwrap_or(0.0);
    let times_h = column(0).into_iter().map(|time| time - start).collect();
    Ok(Some(AngleRecord { times_h, tip: radians(1), base: radians(2), growth_cm_h, radius_cm, zone_cm }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_angles_is_read_and_a_bad_cell_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let rows: String = (0..9).map(|k| format!("{},{},\n", 1.0 + 0.1 * f64::from(k), 10 * k)).collect();
        std::fs::write(&path, format!("time_h,tip_angle_deg,growth_cm_h\n{rows}")).unwrap();
        let record = read(&path).unwrap().unwrap();
        assert!(
            (record.times_h[8] - 0.8).abs() < 1e-9 && (record.tip[8] - 80_f64.to_radians()).abs() < 1e-12
        );
        assert!(record.base.is_empty() && record.growth_cm_h.is_none());
        std::fs::write(&path, "time_h,tip_angle_deg\n0,1\n1,x\n").unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains("line 3: found tip_angle_deg \"x\""), "{error}");
        std::fs::write(&path, "tip_x_cm,tip_y_cm\n").unwrap();
        assert_eq!(read(&path).unwrap(), None);
    }
}
