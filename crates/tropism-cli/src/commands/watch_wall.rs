//! `tropism watch-wall`: the nodes of a real wall, watched.

use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::Args;
use tropism_lab::wall::{WallFile, WatchWallPlan, WatchWallResults};

use super::node::parse_broker;
use crate::progress::{ProgressMonitor, execute_with};
use crate::shell::Shell;

/// Watch the nodes of a real wall: journal, warnings, and all lamps dark when they must be
///
/// Reports what changes: which node is lit, sees the plant, is done, ends or is not heard. When more lamps are lit than may be
/// for three steps, or one that is not on the path, all nodes are switched off. It ends when the plant has passed all nodes of
/// the path, or with Ctrl-C. The nodes do not need it. Tried against mosquitto, not on hardware.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism watch-wall wall.toml --broker raspberrypi.local --experiment june --start --out june\n  \
                  tropism watch-wall wall.toml --broker raspberrypi.local --experiment june --dark\n\n\
                  The folder gets nodes.csv, a row for each node and step."
)]
pub(crate) struct WatchWall {
    /// Wall file with a drawn path, the one that the nodes have
    #[arg(value_name = "WALL.toml")]
    wall: PathBuf,

    /// Host of the MQTT broker, or HOST:PORT
    #[arg(long, default_value = "127.0.0.1", value_name = "HOST")]
    broker: String,

    /// Name of the experiment
    #[arg(long, value_name = "ID")]
    experiment: String,

    /// Start all nodes first: the plant is there
    #[arg(long, conflicts_with = "dark")]
    start: bool,

    /// Switch all nodes off, and end; an experiment that is over needs a new name
    #[arg(long)]
    dark: bool,

    /// Lamps that may be lit at once, 1 to 16
    #[arg(long, default_value_t = 2, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=16))]
    most_lit: u8,

    /// Folder for the journal; one that is there goes on
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl WatchWall {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        Shell::end_in_order();
        let plan = WatchWallPlan {
            file: WallFile::read(&self.wall)?,
            experiment: self.experiment,
            broker: parse_broker(&self.broker)?,
            start: self.start,
            dark: self.dark,
            most_lit: self.most_lit,
            out: self.out,
        };
        let results = execute_with(&plan, &ProgressMonitor::new(shell))?;
        shell.result(&text(&results), &results)?;
        let unsure = results.not_dark();
        ensure!(!plan.dark || unsure.is_empty(), "not known to be dark: {}", unsure.join(", "));
        Ok(())
    }
}

fn text(results: &WatchWallResults) -> String {
    let mut text = format!("{:<10} {:>8} {:>6} {:>7}  {}\n", "node", "messages", "lit h", "level", "");
    for node in &results.nodes {
        let latest = node.latest.unwrap_or_default();
        let words = [
            (node.is_on_path, "on the path"),
            (latest.sees, "sees the plant"),
            (latest.done, "done"),
            (latest.lamp_is_dead, "its lamp does not light up"),
            (node.latest.is_none(), "not heard"),
            (node.latest.is_some() && !node.is_alive, "has ended"),
        ];
        let words: Vec<&str> = words.into_iter().filter(|(is, _)| *is).map(|(_, word)| word).collect();
        text += &format!(
            "{:<10} {:>8} {:>6.1} {:>7}  {}\n",
            node.name,
            node.messages,
            latest.lit_h,
            latest.level,
            words.join(", ")
        );
    }
    if results.is_done {
        text += "all nodes of the path are done\n";
    }
    if let Some(why) = &results.dark {
        let unsure = results.not_dark();
        text += &match unsure.as_slice() {
            [] => format!("all nodes are dark: {why}\n"),
            _ => format!("all nodes were asked to be dark: {why}; not confirmed by {}\n", unsure.join(", ")),
        };
    }
    if let Some(journal) = &results.journal {
        text += &format!("wrote {}\n", journal.display());
    }
    text.trim_end().to_owned()
}
