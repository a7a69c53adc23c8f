//! A real wall, watched: what its nodes say, and when they must all be dark.
//!
//! In: a wall with a drawn path, the broker and the name of the experiment. Out: a journal with a row for each node and step, and what
//! happened in words. Nodes steer without it.

use std::cell::{Cell, RefCell};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tropism::nodes::{NodeMessage, NodeRow};
use tropism_rig::broker::Broker;
use tropism_rig::wall_watch::{Heard, WallWatch};

use super::{JOURNAL_HEAD, WallFile, journal_row};
use crate::{Error, Monitor, Workflow, files};

/// Steps for which too many lamps may be lit, or one that is not on the path. Chosen: a hand-over is over within two, and a lost
/// message is repeated.
const PATIENCE_STEPS: u32 = 3;
/// Steps after which a node that says nothing is reported. Chosen: one message may be lost.
const SILENT_STEPS: u32 = 3;
/// How long the broker may take to answer for the first time.
const BROKER_PATIENCE: Duration = Duration::from_secs(60);

/// Watches the nodes of a wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WatchWallPlan {
    /// The wall, with a drawn path.
    pub file: WallFile,
    /// Name of the experiment.
    pub experiment: String,
    /// The broker.
    pub broker: Broker,
    /// Whether all nodes are started first: the plant is there.
    pub start: bool,
    /// Whether all nodes are switched off, and nothing is watched.
    pub dark: bool,
    /// Lamps that may be lit at once, 1 to 16; when more are for three steps, all nodes are switched off.
    pub most_lit: u8,
    /// Folder for the journal; none writes none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out: Option<PathBuf>,
}

impl Default for WatchWallPlan {
    fn default() -> Self {
        Self {
            file: WallFile::default(),
            experiment: String::new(),
            broker: Broker::new("127.0.0.1", 1883),
            start: false,
            dark: false,
            most_lit: 2,
            out: None,
        }
    }
}

/// A node as it was heard last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatchedNode {
    /// Its name.
    pub name: String,
    /// Whether it is on the path.
    pub is_on_path: bool,
    /// Messages that were heard of it.
    pub messages: u32,
    /// Its latest message.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latest: Option<NodeMessage>,
    /// Whether it is alive, as far as the broker knows.
    pub is_alive: bool,
}

/// The results of a [`WatchWallPlan`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatchWallResults {
    /// Each node, in the order of the wall.
    pub nodes: Vec<WatchedNode>,
    /// Whether all nodes of the path are done.
    pub is_done: bool,
    /// Why all nodes were asked to be dark, if they were.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dark: Option<String>,
    /// The journal, if one was written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub journal: Option<PathBuf>,
}

impl WatchWallResults {
    /// Names of the nodes of which it is not known that they are dark: they said last that they are lit, or are on the path and
    /// said nothing.
    #[must_use]
    pub fn not_dark(&self) -> Vec<&str> {
        let is_unsure = |node: &&WatchedNode| node.latest.map_or(node.is_on_path, |latest| latest.level > 0);
        self.nodes.iter().filter(is_unsure).map(|node| node.name.as_str()).collect()
    }
}

impl Workflow for WatchWallPlan {
    type Results = WatchWallResults;

    const SCHEMA: &'static str = "tropism.watch-wall/1";

    fn check(&self) -> Result<(), Error> {
        self.file.check()?;
        Error::check_range("most_lit", self.most_lit, 16)?;
        self.broker.check().map_err(Error::Plan)?;
        self.file.drawn_path()?;
        self.watch().check().map_err(Error::Plan)?;
        if self.start && self.dark {
            return Err(Error::Plan("found both `start` and `dark`, wanted one of the two".to_owned()));
        }
        Ok(())
    }

    /// Until all nodes of the path are done and dark, or until `monitor` asks for an end: that is no failure.
    fn perform(&self, monitor: &dyn Monitor) -> Result<WatchWallResults, Error> {
        let mut wall = Watched::new(self)?;
        let journal = self.out.as_deref().map(|out| self.journal(out)).transpose()?;
        let failure: RefCell<Option<Error>> = RefCell::new(None);
        let is_over = Cell::new(false);
        let order = if self.dark { Some(false) } else { self.start.then_some(true) };
        if self.dark {
            wall.dark = Some("you asked for it".to_owned());
        }
        let mut hear = |heard: Heard| {
            if let (Heard::Said(node, message), Some((path, file))) = (heard, &journal) {
                let row = NodeRow { step: message.step, node, message };
                let written = writeln!(&*file, "{}", journal_row(&self.file.wall, &row));
                if let Err(error) = written {
                    *failure.borrow_mut() = Some(Error::at(path.display())(error));
                }
            }
            let order = wall.hear(heard, &mut |text| monitor.note(&text));
            is_over.set(if self.dark { wall.is_dark() } else { wall.is_done() && wall.is_dark() });
            order
        };
        let ends = || is_over.get() || failure.borrow().is_some() || !monitor.may_go_on();
        self.watch()
            .run(&self.broker, order, BROKER_PATIENCE, &ends, &mut hear)
            .map_err(|error| Error::Failed(error.to_string()))?;
        if let Some(error) = failure.into_inner() {
            return Err(error);
        }
        let is_done = wall.is_done();
        let journal = journal.map(|(path, _)| path);
        Ok(WatchWallResults { nodes: wall.nodes, is_done, dark: wall.dark, journal })
    }
}

impl WatchWallPlan {
    fn watch(&self) -> WallWatch {
        let names = self.file.wall.nodes.iter().map(|node| node.name.clone()).collect();
        WallWatch { experiment: self.experiment.clone(), names }
    }

    /// The journal in a folder, which goes on if it is there; and the wall beside it.
    fn journal(&self, out: &Path) -> Result<(PathBuf, std::fs::File), Error> {
        files::make_folder(out)?;
        let wall = out.join("wall.toml");
        if !wall.exists() {
            files::write(&wall, files::toml_of(&wall, &self.file)?.as_bytes())?;
        } else if WallFile::read(&wall)? != self.file {
            return Err(Error::Plan(format!(
                "{}: found another wall, wanted that of this journal, or a new folder",
                wall.display()
            )));
        }
        let path = out.join("nodes.csv");
        let is_new = !path.exists();
        let open = || std::fs::File::options().append(true).create(true).open(&path);
        let mut file = open().map_err(Error::at(path.display()))?;
        if is_new {
            file.write_all(JOURNAL_HEAD.as_bytes()).map_err(Error::at(path.display()))?;
        }
        Ok((path, file))
    }
}

/// A wall as it was heard so far.
struct Watched {
    path: Vec<usize>,
    most_lit: usize,
    nodes: Vec<WatchedNode>,
    /// Whether each node was reported as silent.
    silent: Vec<bool>,
    /// Steps since the watch began. One passes each time that a node speaks of a new step for the second time in it: clocks of
    /// nodes may differ, and one that is ahead must not make the others look silent.
    step: u32,
    /// Whether each node has spoken in this step.
    has_spoken: Vec<bool>,
    /// The step in which each node was heard last.
    heard: Vec<u32>,
    /// Since which step the lamps are not as they may be, and how.
    wrong: Option<(u32, String)>,
    dark: Option<String>,
}

impl Watched {
    fn new(plan: &WatchWallPlan) -> Result<Self, Error> {
        let path = plan.file.drawn_path()?;
        let node = |(number, node): (usize, &tropism::nodes::NodeSpec)| WatchedNode {
            name: node.name.clone(),
            is_on_path: path.contains(&number),
            messages: 0,
            latest: None,
            is_alive: true,
        };
        let nodes: Vec<WatchedNode> = plan.file.wall.nodes.iter().enumerate().map(node).collect();
        let (silent, has_spoken, heard) =
            (vec![false; nodes.len()], vec![false; nodes.len()], vec![0; nodes.len()]);
        let most_lit = plan.most_lit.into();
        Ok(Self { path, most_lit, nodes, silent, step: 0, has_spoken, heard, wrong: None, dark: None })
    }

    /// Takes what was heard, and reports what is new in words. Returns the order to be dark when it must be given.
    fn hear(&mut self, heard: Heard, report: &mut dyn FnMut(String)) -> Option<bool> {
        match heard {
            Heard::Started(is_started) => {
                report(if is_started { "the nodes steer" } else { "the nodes are switched off" }.to_owned());
                None
            }
            Heard::Alive(number, is_alive) => {
                let node = &mut self.nodes[number];
                if node.is_alive != is_alive {
                    report(format!(
                        "{}: {}",
                        node.name,
                        if is_alive { "alive again" } else { "warning: it has ended" }
                    ));
                }
                node.is_alive = is_alive;
                None
            }
            Heard::Said(number, message) => {
                let node = &mut self.nodes[number];
                let before = node.latest.replace(message);
                node.messages += 1;
                if before.is_none_or(|before| before.step != message.step) {
                    if self.has_spoken[number] {
                        self.step += 1;
                        self.has_spoken.fill(false);
                    }
                    self.has_spoken[number] = true;
                }
                self.heard[number] = self.step;
                let before = before.unwrap_or_default();
                let changes = [
                    (before.sees, message.sees, "sees the plant"),
                    (before.done, message.done, "done"),
                    (before.level > 0, message.level > 0, "lit"),
                    (before.lamp_is_dead, message.lamp_is_dead, "warning: its lamp does not light up"),
                ];
                for (_, _, text) in changes.into_iter().filter(|(was, is, _)| is & !was) {
                    report(format!("{}: {text}", node.name));
                }
                self.report_silent(report);
                self.judge()
            }
        }
    }

    /// Reports once each node that says nothing any more.
    fn report_silent(&mut self, report: &mut dyn FnMut(String)) {
        for ((node, heard), was_silent) in self.nodes.iter().zip(&self.heard).zip(&mut self.silent) {
            let is_silent = node.messages > 0 && self.step - heard > SILENT_STEPS;
            if is_silent && !*was_silent {
                report(format!("{}: warning: not heard for {SILENT_STEPS} steps", node.name));
            }
            *was_silent = is_silent;
        }
    }

    /// Numbers of the nodes that said lately that they are lit.
    fn lit(&self) -> impl Iterator<Item = usize> {
        let is_lit = |number: &usize| {
            let is_lit = self.nodes[*number].latest.is_some_and(|latest| latest.level > 0);
            is_lit && self.step - self.heard[*number] <= SILENT_STEPS
        };
        (0..self.nodes.len()).filter(is_lit)
    }

    /// Whether the lamps are as they may be; the order to be dark if they have not been for some steps.
    fn judge(&mut self) -> Option<bool> {
        let lit: Vec<usize> = self.lit().collect();
        let off_path = lit.iter().find(|number| !self.path.contains(number));
        let problem = match off_path {
            Some(&number) => format!("{} is lit and not on the path", self.nodes[number].name),
            None if lit.len() > self.most_lit => {
                format!("{} lamps are lit, of which {} may be", lit.len(), self.most_lit)
            }
            None => {
                self.wrong = None;
                return None;
            }
        };
        let (since, _) = self.wrong.get_or_insert((self.step, problem.clone()));
        if self.dark.is_some() || self.step - *since < PATIENCE_STEPS {
            return None;
        }
        self.dark = Some(problem);
        Some(false)
    }

    fn is_dark(&self) -> bool {
        self.lit().next().is_none()
    }

    /// Whether all nodes of the path are done.
    fn is_done(&self) -> bool {
        let is_done = |&number: &usize| self.nodes[number].latest.is_some_and(|latest| latest.done);
        self.path.iter().all(is_done)
    }
}

#[cfg(test)]
mod tests {
    use tropism::nodes::WallPath;

    use super::*;

    fn plan() -> WatchWallPlan {
        let mut plan = WatchWallPlan { experiment: "june".to_owned(), ..WatchWallPlan::default() };
        plan.file.wall.path = WallPath::Drawn(["left1", "right2", "left3"].map(str::to_owned).to_vec());
        plan
    }

    fn said(number: usize, step: u32, level: u8, done: bool) -> Heard {
        Heard::Said(number, NodeMessage { step, level, done, ..NodeMessage::default() })
    }

    #[test]
    fn a_hand_over_is_told_and_nothing_is_put_dark() {
        let mut wall = Watched::new(&plan()).unwrap();
        let mut reported = Vec::new();
        let path = wall.path.clone();
        let mut hear = |wall: &mut Watched, heard| wall.hear(heard, &mut |text| reported.push(text));
        hear(&mut wall, Heard::Alive(0, true));
        hear(&mut wall, Heard::Alive(0, false));
        for (place, &number) in path.iter().enumerate() {
            for step in 0..5 {
                let step = 5 * place as u32 + step + 1;
                assert_eq!(hear(&mut wall, said(number, step, 255, false)), None);
                if place > 0 {
                    // The one before is still lit for a step.
                    let level = if step % 5 == 1 { 255 } else { 0 };
                    assert_eq!(hear(&mut wall, said(path[place - 1], step, level, true)), None);
                }
            }
        }
        assert!(!wall.is_done() && !wall.is_dark());
        hear(&mut wall, said(path[2], 16, 0, true));
        assert!(wall.is_done() && wall.is_dark() && wall.dark.is_none());
        let wanted = ["left1: warning: it has ended", "left1: lit", "right2: lit", "left1: done"];
        assert_eq!(reported[..4], wanted, "{reported:?}");
    }

    #[test]
    fn lamps_that_must_not_be_lit_put_all_dark_after_some_steps() {
        // One that is not on the path; and more than may be lit.
        for numbers in [vec![1], vec![0, 3, 4]] {
            let mut wall = Watched::new(&plan()).unwrap();
            let mut orders = Vec::new();
            for step in 1..8 {
                for &number in &numbers {
                    let order = wall.hear(said(number, step, 255, false), &mut |_| {});
                    orders.extend(order.map(|order| (step, order)));
                }
            }
            assert_eq!(orders, [(1 + PATIENCE_STEPS, false)], "once");
            assert!(wall.dark.is_some());
        }
    }

    #[test]
    fn a_node_whose_clock_is_ahead_hides_no_lamp() {
        let mut wall = Watched::new(&plan()).unwrap();
        let mut reported = Vec::new();
        let mut orders = Vec::new();
        for step in 1..8 {
            // The second is not on the path.
            for heard in [said(4, step + 100_000, 0, false), said(1, step, 255, false)] {
                let order = wall.hear(heard, &mut |text| reported.push(text));
                orders.extend(order.map(|order| (step, order)));
            }
        }
        assert_eq!(orders, [(1 + PATIENCE_STEPS, false)]);
        assert!(reported.iter().all(|text| !text.contains("not heard")), "{reported:?}");
    }

    #[test]
    fn a_node_that_is_not_heard_is_told_once_and_does_not_count_as_lit() {
        let mut wall = Watched::new(&plan()).unwrap();
        let mut reported = Vec::new();
        wall.hear(said(0, 1, 255, false), &mut |_| {});
        for step in 2..9 {
            wall.hear(said(3, step, 0, false), &mut |text| reported.push(text));
        }
        assert_eq!(reported, ["left1: warning: not heard for 3 steps"]);
        assert!(wall.is_dark());
    }

    #[test]
    fn the_journal_of_another_wall_is_not_gone_on_with() {
        let folder = tempfile::tempdir().unwrap();
        let (path, _) = plan().journal(folder.path()).unwrap();
        let wall = folder.path().join("wall.toml");
        let written = [std::fs::read(&path).unwrap(), std::fs::read(&wall).unwrap()];
        plan().journal(folder.path()).unwrap();
        let mut other = plan();
        other.file.wall.nodes[0].at[0] -= 1.0;
        let error = other.journal(folder.path()).unwrap_err().to_string();
        assert!(error.contains("wall.toml: found another wall"), "{error}");
        assert_eq!(
            [std::fs::read(&path).unwrap(), std::fs::read(&wall).unwrap()],
            written,
            "nothing is lost"
        );
    }

    #[test]
    fn a_random_path_and_a_name_that_cannot_stand_in_a_topic_are_refused() {
        let refused = |plan: &WatchWallPlan| plan.check().unwrap_err().to_string();
        assert!(
            refused(&WatchWallPlan { experiment: "june".to_owned(), ..WatchWallPlan::default() })
                .contains("random")
        );
        assert!(refused(&WatchWallPlan { experiment: "a/b".to_owned(), ..plan() }).contains("found name"));
        assert!(refused(&WatchWallPlan { start: true, dark: true, ..plan() }).contains("start"));
    }
}
