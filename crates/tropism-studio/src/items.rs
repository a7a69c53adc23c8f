//! The overview: every piece of work in the folder, kept up to date while pages look at it.

mod item;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use serde::Serialize;
use tropism_lab::status::{self, StatusResults};
use tropism_lab::{RunConfig, holder};

use self::item::Item;
pub(crate) use self::item::{Sample, WorkState, is_at_work, name_of};
use crate::found::{Finder, Found, Kind, search_of};
use crate::jobs::ShownJob;
use crate::stream::{Listened, Message};
use crate::tail::{SHOWN_DIGITS, Tail};
use crate::unix_of;

/// How often the folder is looked at.
pub(crate) const PAUSE: Duration = Duration::from_millis(1000);

/// Work that goes on is read again at least so often: ages and what is overdue change by themselves.
const REREAD: Duration = Duration::from_secs(3);

/// Pieces of work that are gone and remembered, so that pages that come back learn of them.
const MOST_GONE: usize = 1000;

/// The overview at a time.
#[derive(Clone)]
pub(crate) struct Overview {
    /// Distinguishes overviews of different readers.
    epoch: u64,
    version: u64,
    items: BTreeMap<String, (u64, Arc<Item>)>,
    /// What is gone since a version.
    gone: Vec<(u64, String)>,
    /// Who has an older version gets all anew.
    gone_since: u64,
    queue: (u64, Vec<ShownJob>),
}

/// What changed in the overview.
#[derive(Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub(crate) struct ItemsNews {
    /// Whether this is all work.
    all: bool,
    items: Vec<Item>,
    /// Places of work that is gone since; none beside all work.
    gone: Vec<String>,
    /// The queue, if it changed.
    queue: Option<Vec<ShownJob>>,
    /// Seconds since 1970.
    now: f64,
}

/// Makes overviews, and reads again only what changed.
#[derive(Default)]
pub(crate) struct Reader {
    finder: Finder,
    known: BTreeMap<String, Read>,
    /// The latest one, for pages that come when nobody has looked for long.
    latest: Option<Overview>,
}

/// What was read of a piece of work, and when.
struct Read {
    stamp: Stamp,
    at: Instant,
    /// How long it took.
    cost: Duration,
    /// Of a run that goes on: what is known of it.
    followed: Option<Followed>,
}

/// A run that is read.
struct Followed {
    config: RunConfig,
    tail: Tail,
}

impl Followed {
    /// Begin of the digest of the latest photograph.
    fn photo_v(&self) -> Option<String> {
        let latest = self.tail.steps.iter().rev().find(|step| step.photo_bytes > 0)?;
        latest.photo_sha256.get(..SHOWN_DIGITS).map(str::to_owned)
    }

    fn new(folder: &Path, tail: Tail) -> Option<Self> {
        RunConfig::follow(folder).ok().map(|config| Self { config, tail })
    }

    /// Reads on; false if nothing can be read just now.
    fn read(&mut self, folder: &Path) -> bool {
        self.tail.read(folder).is_some()
    }

    /// The status of the run in `folder`, on which `process` works.
    fn status(&self, folder: &Path, process: Option<u32>) -> StatusResults {
        let Self { config, tail } = self;
        let run = status::of_run(folder, config, &tail.steps, &tail.events, process);
        StatusResults::Run(Box::new(run))
    }
}

impl Read {
    fn is_fresh(&self, kind: Kind, stamp: &Stamp) -> bool {
        // All of an evolution is in the files that the stamp is of. A search that says nothing for long has ended.
        let is_search = kind == Kind::Rule && stamp.files.len() == 1;
        let may_change = (stamp.holder.is_some() && kind != Kind::Evolution) || is_search;
        // What takes long to read is read less often, unless somebody began or ended to work on it.
        if self.at.elapsed() < crate::REST * self.cost && self.stamp.holder == stamp.holder {
            return true;
        }
        self.stamp == *stamp && (!may_change || self.at.elapsed() < REREAD)
    }
}

/// Names, sizes and times of the files of a folder, and who works in it.
#[derive(Clone, PartialEq)]
struct Stamp {
    files: Vec<(std::ffi::OsString, u64, Option<SystemTime>)>,
    holder: Option<u32>,
}

impl Stamp {
    fn of(found: &Found) -> Self {
        let folder = &found.path;
        if found.kind == Kind::Rule {
            let paths = [folder.clone(), search_of(folder)];
            let data = paths.into_iter().filter_map(|path| {
                let data = path.metadata().ok()?;
                Some((path.into_os_string(), data.len(), data.modified().ok()))
            });
            return Self { files: data.collect(), holder: None };
        }
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<_> = entries
            .filter_map(|entry| {
                let (name, data) = (entry.file_name(), entry.metadata().ok()?);
                // Who only reads a journal writes to the one, and leaves the other empty.
                let is_of_reader =
                    name == "journal.sqlite-shm" || (name == "journal.sqlite-wal" && data.len() == 0);
                (!is_of_reader).then(|| (name, data.len(), data.modified().ok()))
            })
            .collect();
        files.sort_unstable();
        Self { files, holder: holder(folder).unwrap_or_default() }
    }

    fn changed(&self) -> Option<f64> {
        self.files.iter().filter_map(|(_, _, time)| *time).max().map(unix_of)
    }
}

impl Reader {
    /// The overview of `root`; `None` if nothing changed and there was one `before`.
    pub(crate) fn read(&mut self, root: &Path, has_one: bool, queue: Vec<ShownJob>) -> Option<Overview> {
        let latest = self.latest.take();
        let fresh = self.fresh(root, latest.as_ref(), queue);
        let is_changed = fresh.is_some();
        self.latest = fresh.or(latest);
        self.latest.clone().filter(|_| is_changed || !has_one)
    }

    fn fresh(&mut self, root: &Path, before: Option<&Overview>, queue: Vec<ShownJob>) -> Option<Overview> {
        let version = before.map_or(0, |before| before.version) + 1;
        let epoch = before.map_or_else(|| crate::unix_s() as u64, |before| before.epoch);
        let (mut items, mut is_changed) = (BTreeMap::new(), before.is_none());
        let known = |at: &str| before.and_then(|before| before.items.get(at));
        let mut stale = Vec::new();
        for found in self.finder.find(root) {
            let stamp = Stamp::of(&found);
            let is_fresh = self.known.get(&found.at).is_some_and(|read| read.is_fresh(found.kind, &stamp));
            match known(&found.at) {
                Some(item) if is_fresh => drop(items.insert(found.at, item.clone())),
                _ => {
                    let followed = self.known.remove(&found.at).and_then(|read| read.followed);
                    stale.push((found, stamp, followed));
                }
            }
        }
        let read = in_parallel(stale, |(found, stamp, mut followed)| {
            let began = Instant::now();
            let item = Item::of(root, &found, &stamp, &mut followed);
            (found.at, item, Read { stamp, at: Instant::now(), cost: began.elapsed(), followed })
        });
        for (at, item, read) in read {
            self.known.insert(at.clone(), read);
            let same = known(&at).filter(|(_, known)| **known == item);
            is_changed |= same.is_none();
            items.insert(at, same.cloned().unwrap_or_else(|| (version, Arc::new(item))));
        }
        self.known.retain(|at, _| items.contains_key(at));
        let mut gone = before.map(|before| before.gone.clone()).unwrap_or_default();
        let left =
            before.into_iter().flat_map(|before| before.items.keys()).filter(|at| !items.contains_key(*at));
        let left: Vec<_> = left.map(|at| (version, at.clone())).collect();
        let queue = match before {
            Some(before) if before.queue.1 == queue => before.queue.clone(),
            _ => (version, queue),
        };
        is_changed |= !left.is_empty() || queue.0 == version;
        gone.extend(left);
        let mut gone_since = before.map_or(0, |before| before.gone_since);
        if gone.len() > MOST_GONE {
            gone_since =
                gone.drain(..gone.len() - MOST_GONE).next_back().map_or(gone_since, |(version, _)| version);
        }
        is_changed.then_some(Overview { epoch, version, items, gone, gone_since, queue })
    }
}

/// What `does` makes of all `work`, in any order, by as many threads as there are cores: the first look at a folder of
/// hundreds of runs would keep a page waiting. Threads of their own: others are busy for seconds with trials.
fn in_parallel<T: Send, U: Send>(work: Vec<T>, does: impl Fn(T) -> U + Sync) -> Vec<U> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(work.len());
    if threads < 2 {
        return work.into_iter().map(does).collect();
    }
    let rest = Mutex::new(work.into_iter());
    let next = || rest.lock().unwrap_or_else(PoisonError::into_inner).next();
    let share = || std::iter::from_fn(next).map(&does).collect::<Vec<_>>();
    std::thread::scope(|scope| {
        let shares: Vec<_> = (0..threads).map(|_| scope.spawn(share)).collect();
        let done = shares.into_iter().map(|share| share.join());
        done.flat_map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    })
}

impl Overview {
    /// The place of each run, and its numbers.
    pub(crate) fn runs(&self) -> impl Iterator<Item = (&str, Vec<Sample>)> {
        let runs = self.items.iter().filter(|(_, (_, item))| item.kind == Some(Kind::Run));
        runs.map(|(at, (_, item))| (at.as_str(), item.samples()))
    }

    /// What changed since version `from`; 0 for all.
    pub(crate) fn news(&self, from: u64) -> ItemsNews {
        let items = self.items.values().filter(|(version, _)| *version > from);
        // Who gets all work lacks nothing that is gone.
        let gone = self.gone.iter().filter(|(version, _)| from > 0 && *version > from);
        ItemsNews {
            all: from == 0,
            items: items.map(|(_, item)| Item::clone(item)).collect(),
            gone: gone.map(|(_, at)| at.clone()).collect(),
            queue: (self.queue.0 > from).then(|| self.queue.1.clone()),
            now: crate::unix_s(),
        }
    }
}

impl Listened for Overview {
    fn since(&self, id: Option<&str>) -> Vec<Message> {
        let known = id.and_then(|id| id.split_once('.'));
        let known =
            known.and_then(|(epoch, version)| Some((epoch.parse::<u64>().ok()?, version.parse().ok()?)));
        let from = match known {
            Some((epoch, version)) if epoch == self.epoch && version >= self.gone_since => version,
            _ => 0_u64,
        };
        if from >= self.version {
            return Vec::new();
        }
        vec![Message::new(format!("{}.{}", self.epoch, self.version), "items", &self.news(from))]
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use tropism_lab::{RunPlan, Silent, Workflow};

    use super::*;

    #[test]
    fn all_work_is_done_once_by_several_threads() {
        let mut done = in_parallel((0..500).collect(), |number: u32| 2 * number);
        done.sort_unstable();
        assert!(done.into_iter().eq((0..500).map(|number| 2 * number)));
    }

    #[test]
    fn a_run_that_is_over_is_read_by_its_end_and_once() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("bean");
        let mut config = RunConfig::default();
        config.task.max_steps = 15;
        RunPlan { out: folder.clone(), config, ..RunPlan::default() }.execute(&Silent).unwrap();
        let mut reader = Reader::default();
        let by_end = reader.read(root.path(), false, Vec::new()).unwrap();
        // What is read is not changed by that.
        let stamp = || Stamp::of(&Finder::default().find(root.path())[0]);
        let before = stamp();
        assert!(Tail::end_of(&folder).is_some_and(|tail| tail.steps.len() < 15 && !tail.events.is_empty()));
        assert!(stamp() == before);
        assert!(reader.read(root.path(), true, Vec::new()).is_none());
        // Without its journal all of it is read from the mirror.
        std::fs::remove_file(folder.join("journal.sqlite")).unwrap();
        let whole = Reader::default().read(root.path(), false, Vec::new()).unwrap();
        let row = |overview: &Overview| json!(*overview.items["bean"].1);
        assert_eq!(row(&by_end), row(&whole));
        assert_eq!((&row(&whole)["state"], &row(&whole)["done"]), (&json!("over"), &json!(15)));
        // Pages that know the run learn that it is gone, and others do not hear of it.
        std::fs::remove_dir_all(&folder).unwrap();
        let empty = reader.read(root.path(), true, Vec::new()).unwrap();
        assert_eq!(empty.news(by_end.version).gone, ["bean"]);
        assert!(empty.news(0).gone.is_empty() && empty.news(0).items.is_empty());
    }
}
