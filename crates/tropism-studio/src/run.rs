//! A run, live: its steps and events as they are recorded, read from the journal without disturbing it.

mod about;
mod view;
mod prediction;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use serde::Serialize;
use tropism_lab::run::speed_of;
use tropism_lab::{RunConfig, holder, status};

pub(crate) use self::about::{AboutRun, about};
pub(crate) use self::prediction::{Prediction, Predictions, prediction, reason_not_to_predict};
use self::view::{Gone, Row, RunNow, ShownEvent, event_row, row, status_of};
pub(crate) use self::view::{StemSeen, stem};
use crate::stream::{Listened, Message};
use crate::tail::Tail;
use crate::unix_of;

/// How often a run is looked at.
pub(crate) const PAUSE: Duration = Duration::from_millis(500);

/// A run that goes on is read again at least so often: what is overdue changes by itself.
const REREAD: Duration = Duration::from_secs(3);

/// What distinguishes a run from another that lies or lay in the same folder: its settings are written once.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Identity {
    written: SystemTime,
    inode: u64,
}

impl Identity {
    /// That of the run in `folder`; `None` if there is none.
    pub(crate) fn of(folder: &Path) -> Option<Self> {
        let data = folder.join("run.toml").metadata().ok()?;
        #[cfg(unix)]
        let inode = std::os::unix::fs::MetadataExt::ino(&data);
        #[cfg(not(unix))]
        let inode = 0;
        Some(Self { written: data.modified().ok()?, inode })
    }

    /// It in one word.
    fn word(self) -> String {
        format!("{:x}-{:x}", (1e6 * unix_of(self.written)) as u64, self.inode)
    }
}

/// A run at a time.
pub(crate) struct RunView {
    version: u64,
    /// One a step; the last one may still change.
    rows: Vec<Arc<Row>>,
    /// Rows that do not change any more.
    settled: usize,
    events: Vec<Arc<ShownEvent>>,
    status: RunNow,
}

/// What a page that watches a run is sent.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct RunNews<'a> {
    /// Number of the first of these rows.
    from: usize,
    rows: Vec<&'a Row>,
    /// Number of the first of these events.
    events_from: usize,
    events: Vec<&'a ShownEvent>,
    status: &'a RunNow,
    /// Seconds since 1970.
    now: f64,
}

impl Listened for RunView {
    fn since(&self, id: Option<&str>) -> Vec<Message> {
        let known: Vec<u64> =
            id.into_iter().flat_map(|id| id.split('.')).map_while(|part| part.parse().ok()).collect();
        let (mut rows, mut events) = (0, 0);
        if let [steps, seen, version] = known[..] {
            if version == self.version {
                return Vec::new();
            }
            // Of a run that is longer than this one nothing is kept: it is another run.
            if steps as usize <= self.rows.len() && seen as usize <= self.events.len() {
                (rows, events) = (steps as usize, seen as usize);
            }
        }
        let id = format!("{}.{}.{}", self.settled, self.events.len(), self.version);
        let news = RunNews {
            from: rows,
            rows: self.rows[rows..].iter().map(|row| &**row).collect(),
            events_from: events,
            events: self.events[events..].iter().map(|event| &**event).collect(),
            status: &self.status,
            now: crate::unix_s(),
        };
        vec![Message::new(id, "run", &news)]
    }
}

/// Reads a run again and again.
pub(crate) struct RunReader {
    folder: PathBuf,
    /// Those of one run do not change.
    identity: Option<Identity>,
    config: Option<RunConfig>,
    tail: Tail,
    stamp: Option<Stamp>,
    read: Instant,
    /// How long it took.
    cost: Duration,
}

#[derive(Clone, PartialEq)]
struct Stamp {
    files: [Option<(u64, SystemTime)>; 4],
    holder: Option<u32>,
    identity: Option<Identity>,
}

impl Stamp {
    fn of(folder: &Path) -> Self {
        let files = ["journal.sqlite", "journal.sqlite-wal", "track.csv", "watchdog.log"].map(|name| {
            let data = folder.join(name).metadata().ok()?;
            Some((data.len(), data.modified().ok()?))
        });
        Self { files, holder: holder(folder).unwrap_or_default(), identity: Identity::of(folder) }
    }
}

impl RunReader {
    pub(crate) fn new(folder: PathBuf) -> Self {
        let (identity, config, tail) = (Identity::of(&folder), None, Tail::default());
        Self { folder, identity, config, tail, stamp: None, read: Instant::now(), cost: Duration::ZERO }
    }

    /// The run after `before`; `None` if nothing changed, or nothing can be read just now.
    pub(crate) fn read(&mut self, before: Option<&Arc<RunView>>) -> Option<RunView> {
        let stamp = Stamp::of(&self.folder);
        let is_due = stamp.holder.is_some() && self.read.elapsed() >= REREAD;
        if self.stamp.as_ref() == Some(&stamp) && !is_due {
            return None;
        }
        let is_same_holder = self.stamp.as_ref().is_some_and(|known| known.holder == stamp.holder);
        if is_same_holder && self.read.elapsed() < crate::REST * self.cost {
            return None;
        }
        let began = Instant::now();
        let view = match stamp.identity {
            Some(identity) => {
                if self.identity != Some(identity) {
                    // Another run in the same folder.
                    (self.identity, self.config, self.tail) = (Some(identity), None, Tail::default());
                }
                self.view(before)?
            }
            None => gone(before)?,
        };
        self.stamp = Some(stamp);
        self.read = Instant::now();
        self.cost = began.elapsed();
        let is_same = before.is_some_and(|before| {
            before.status == view.status && before.rows == view.rows && before.events == view.events
        });
        (!is_same).then_some(view)
    }

    fn view(&mut self, before: Option<&Arc<RunView>>) -> Option<RunView> {
        let folder = &self.folder;
        let config = match &mut self.config {
            Some(config) => config,
            none => none.insert(RunConfig::follow(folder).ok()?),
        };
        let events_before = self.tail.events.len();
        let same = self.tail.read(folder)?;
        let Tail { steps, events } = &self.tail;
        let status = status::of_run(folder, config, steps, events, holder(folder).ok()?);
        let (layout, calibration) = (config.rig.layout().ok()?, config.calibration());
        let settled = match steps.last() {
            Some(last) if last.decided.is_none() || !last.is_confirmed => steps.len() - 1,
            _ => steps.len(),
        };
        // What is as it was is taken over.
        let mut rows = before.map(|before| known(&before.rows, same)).unwrap_or_default();
        rows.extend(steps[rows.len()..].iter().map(|step| row(step, &layout, calibration.as_ref()).into()));
        let same_events = if same > 0 { events_before } else { 0 };
        let mut shown = before.map(|before| known(&before.events, same_events)).unwrap_or_default();
        shown.extend(events[shown.len()..].iter().map(|event| event_row(event).into()));
        let identity = self.identity.map(Identity::word);
        Some(RunView {
            version: before.map_or(1, |before| before.version + 1),
            rows,
            settled,
            events: shown,
            status: RunNow::Here(Box::new(status_of(folder, config, steps, &status, identity))),
        })
    }
}

/// The first `count` of what was known before.
fn known<T>(before: &[Arc<T>], count: usize) -> Vec<Arc<T>> {
    before[..count.min(before.len())].to_vec()
}

/// A run whose folder was deleted or renamed while pages looked at it, after `before`.
fn gone(before: Option<&Arc<RunView>>) -> Option<RunView> {
    let before = before?;
    Some(RunView {
        version: before.version + 1,
        rows: before.rows.clone(),
        settled: before.settled,
        events: before.events.clone(),
        status: RunNow::Gone { state: Gone::Gone },
    })
}

/// The words that go on with the run in `folder`, which lies at `at`: a virtual plant as fast as it grew before.
pub(crate) fn resume_words(folder: &Path, at: &str) -> Vec<String> {
    let out = if at.is_empty() { "." } else { at };
    let mut words = ["run", "--out", out, "--resume"].map(str::to_owned).to_vec();
    if let Some(speed) = speed_of(folder) {
        words.extend(["--speed".to_owned(), speed.to_string()]);
    }
    words
}

/// The file name of the latest photograph of the run in `folder`, without a look into its journal.
pub(crate) fn latest_photo(folder: &Path) -> Option<String> {
    let entries = std::fs::read_dir(folder.join("photographs")).ok()?;
    let names = entries.flatten().filter_map(|entry| entry.file_name().into_string().ok());
    names.filter(|name| name.ends_with(".jpg") && !name.starts_with('.')).max()
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};
    use tropism::rig::{Event, EventKind};

    use super::*;

    fn view_of(rows: usize, settled: usize, version: u64) -> RunView {
        let event = Event { step: 0, kind: EventKind::Started, text: String::new(), at: None };
        RunView {
            version,
            rows: vec![Arc::default(); rows],
            settled,
            events: vec![Arc::new(event_row(&event))],
            status: RunNow::Gone { state: Gone::Gone },
        }
    }

    fn only(view: &RunView, id: Option<&str>) -> (String, Value) {
        let mut messages = view.since(id);
        assert_eq!(messages.len(), 1);
        let Message { id, data, .. } = messages.remove(0);
        (id, serde_json::from_str(&data).unwrap())
    }

    #[test]
    fn a_virtual_run_goes_on_as_fast_as_it_did() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(resume_words(folder.path(), "bean"), ["run", "--out", "bean", "--resume"]);
        let mut config = RunConfig::default();
        config.task.max_steps = 2;
        let (out, speed) = (folder.path().join("bean"), Some(1e6));
        let plan = tropism_lab::RunPlan { out: out.clone(), speed, config, ..Default::default() };
        tropism_lab::Workflow::execute(&plan, &tropism_lab::Silent).unwrap();
        assert_eq!(resume_words(&out, "bean"), ["run", "--out", "bean", "--resume", "--speed", "1000000"]);
    }

    #[test]
    fn a_page_that_comes_back_gets_what_it_missed() {
        let (id, all) = only(&view_of(5, 4, 7), None);
        assert_eq!((id.as_str(), all["rows"].as_array().unwrap().len()), ("4.1.7", 5));
        let later = view_of(8, 8, 9);
        let (_, missed) = only(&later, Some(&id));
        // The last step may have changed since.
        assert_eq!((&missed["from"], missed["rows"].as_array().unwrap().len()), (&json!(4), 4));
        assert!(missed["events"].as_array().unwrap().is_empty());
        assert!(later.since(Some("8.1.9")).is_empty());
        // Another run in the same folder, and nonsense.
        for id in ["900.1.3", "x", "4.1", ""] {
            assert_eq!(only(&later, Some(id)).1["from"], json!(0), "{id}");
        }
    }
}
