//! What several tests begin with.

use std::fs;
use std::path::Path;

/// Writes `track.csv`, of one plant that leans after a lamp, and `task.toml`, a short task.
pub(crate) fn leaning_plant(folder: &Path) {
    let rows: String = (0..120)
        .map(|step: i32| {
            let light = if step / 20 % 2 == 0 { "right" } else { "left" };
            let x = 0.2 * f64::from(20 - (step % 40 - 20).abs());
            format!("{x},{},{light}\n", 4.0 + 0.04 * f64::from(step))
        })
        .collect();
    fs::write(folder.join("track.csv"), format!("tip_x_cm,tip_y_cm,light\n{rows}")).unwrap();
    fs::write(folder.join("task.toml"), "targets = [[1.0, 5.0], [3.0, 6.0]]\nmax_steps = 100\n").unwrap();
}
