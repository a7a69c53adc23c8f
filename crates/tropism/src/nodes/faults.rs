//! Faults of a wall: messages, restarts, sensors, lamps and whole nodes.

use serde::{Deserialize, Serialize};

use crate::check::{self, OutOfRange};

/// Faults of a wall. Which nodes are struck is drawn for each plant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default, deny_unknown_fields)]
pub struct NodeFaults {
    /// Share of messages that are lost, 0 to 1.
    pub lost: f64,
    /// By how much messages are late, in h: 0 to 100.
    pub late_h: f64,
    /// Restarts of each node a day, 0 to 288.
    pub restarts_per_day: f64,
    /// Whether a node that restarts forgets everything; otherwise it reads its own last message.
    pub forgets: bool,
    /// Number of nodes of the path whose sensor sees no echo, 0 to 8.
    pub blind: u8,
    /// Number of nodes of the path whose sensor gives no reading, 0 to 8.
    pub silent: u8,
    /// Number of nodes of the path whose lamp stays dark, 0 to 8.
    pub dead_lamps: u8,
    /// Number of nodes of the path that die for good as soon as their lamp has been lit for two hours, 0 to 8; the lamp goes
    /// dark by its own timer, and the broker informs the others.
    pub killed: u8,
}

impl NodeFaults {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`OutOfRange`] names the key.
    pub fn check(&self) -> Result<(), OutOfRange> {
        check::within("lost", self.lost, 0.0..=1.0)?;
        check::within("late_h", self.late_h, 0.0..=100.0)?;
        check::within("restarts_per_day", self.restarts_per_day, 0.0..=288.0)?;
        for (key, count) in [
            ("blind", self.blind),
            ("silent", self.silent),
            ("dead_lamps", self.dead_lamps),
            ("killed", self.killed),
        ] {
            check::within(key, count, 0..=8)?;
        }
        Ok(())
    }
}
