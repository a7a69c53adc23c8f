//! The queue of heavy work: one job at a time, each a process of its own.
//!
//! A job is a command of `tropism` in a process group of its own: it lives on when the page closes and when the studio
//! ends. The queue is the file `queue.json`; the studio that starts next takes over the job that goes on, by the lock of its
//! folder.

mod job;
mod process;

use std::path::{Path, PathBuf};
use std::process::Child;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tropism_lab::files;
use tropism_lab::status::{StatusPlan, StatusResults};
use tropism_lab::stop::StopPlan;
use tropism_lab::{FolderLock, LockError, Silent, Workflow, holder, lock};

use self::job::{Job, JobState, goes_on, is_made};
pub(crate) use self::job::{ShownJob, line};
pub(crate) use self::process::{ask_to_end, last_words, spawn, wait_for_end};
use crate::error::StudioError;
use crate::found::search_of;
use crate::items::is_at_work;

/// Jobs that are kept after they have ended.
const KEPT: usize = 20;

/// Jobs that wait at most.
pub(crate) const MOST_WAITING: usize = 50;

/// How long a process may take until it holds the lock of its folder.
const BEGINS: Duration = Duration::from_secs(10);

/// What is shown of the log of a job, in bytes.
const MOST_SAID: usize = 20_000;

/// The file of the queue.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    schema: String,
    next: u64,
    jobs: Vec<Job>,
}

const SCHEMA: &str = "tropism.studio-queue/1";

/// The queue of a folder.
pub(crate) struct Queue {
    root: PathBuf,
    program: PathBuf,
    inner: Mutex<Inner>,
}

struct Inner {
    saved: Saved,
    /// The process of the running job, if this studio started it.
    child: Option<Child>,
    /// When the running job was started or taken over.
    begun: Instant,
    /// The running job that was asked to end.
    cancelled: Option<u64>,
    /// Whether no further job begins.
    is_closed: bool,
    /// Held from the first job on: two studios would overwrite each other's jobs.
    lock: Option<FolderLock>,
}

impl Queue {
    /// The queue as the last studio left it.
    ///
    /// # Errors
    /// [`StudioError::File`] if its file cannot be read.
    pub(crate) fn open(root: &Path, program: &Path) -> Result<Self, StudioError> {
        let inner = Mutex::new(Inner {
            saved: Self::saved(root)?,
            child: None,
            begun: Instant::now(),
            cancelled: None,
            is_closed: false,
            lock: None,
        });
        Ok(Self { root: root.to_owned(), program: program.to_owned(), inner })
    }

    fn saved(root: &Path) -> Result<Saved, StudioError> {
        let path = Self::path(root);
        if path.exists() {
            return Ok(files::read_as(&path, |text| serde_json::from_str(text))?);
        }
        Ok(Saved { schema: SCHEMA.to_owned(), next: 1, jobs: Vec::new() })
    }

    fn path(root: &Path) -> PathBuf {
        root.join(crate::OWN).join("queue.json")
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the queue for this studio, as the studio before left it.
    ///
    /// # Errors
    /// [`StudioError`] if another studio has it.
    fn own(&self, inner: &mut Inner) -> Result<(), StudioError> {
        if inner.lock.is_some() {
            return Ok(());
        }
        let folder = self.root.join(crate::OWN);
        files::make_folder(&folder)?;
        inner.lock = match lock(&folder) {
            Ok(lock) => Some(lock),
            Err(LockError::InUse { process, .. }) => {
                let process = process.map_or_else(String::new, |process| format!(" (process {process})"));
                return Err(StudioError::System(format!(
                    "another studio{process} looks after the jobs of this folder: begin it there, or end that studio"
                )));
            }
            Err(error) => return Err(StudioError::System(error.to_string())),
        };
        inner.saved = Self::saved(&self.root)?;
        Ok(())
    }

    fn save(&self, saved: &Saved) -> Result<(), StudioError> {
        files::make_folder(&self.root.join(crate::OWN))?;
        let text =
            serde_json::to_string_pretty(saved).map_err(|error| StudioError::System(error.to_string()))?;
        Ok(files::write(&Self::path(&self.root), text.as_bytes())?)
    }

    /// Adds a job: its number.
    ///
    /// # Errors
    /// [`StudioError`] if the queue is full or cannot be saved.
    pub(crate) fn add(&self, at: &str, commands: Vec<Vec<String>>) -> Result<u64, StudioError> {
        let mut inner = self.inner();
        self.own(&mut inner)?;
        if inner.saved.jobs.iter().filter(|job| job.is_open()).count() >= MOST_WAITING {
            return Err(StudioError::System(format!(
                "{MOST_WAITING} jobs wait in the queue: wait for one, or cancel one"
            )));
        }
        let number = inner.saved.next;
        inner.saved.next += 1;
        let job = Job {
            number,
            at: at.to_owned(),
            commands,
            now: 0,
            state: JobState::Waiting,
            problem: String::new(),
        };
        inner.saved.jobs.push(job);
        let mut surplus = inner.saved.jobs.iter().filter(|job| !job.is_open()).count().saturating_sub(KEPT);
        inner.saved.jobs.retain(|job| {
            let is_left_out = surplus > 0 && !job.is_open();
            surplus -= usize::from(is_left_out);
            !is_left_out
        });
        self.save(&inner.saved)?;
        Ok(number)
    }

    /// Takes a waiting job out of the queue; whether there was one.
    ///
    /// # Errors
    /// [`StudioError`] if the queue cannot be saved.
    pub(crate) fn remove(&self, number: u64) -> Result<bool, StudioError> {
        let mut inner = self.inner();
        self.own(&mut inner)?;
        let before = inner.saved.jobs.len();
        inner.saved.jobs.retain(|job| job.number != number || job.state != JobState::Waiting);
        let is_removed = inner.saved.jobs.len() < before;
        self.save(&inner.saved)?;
        Ok(is_removed)
    }

    /// Asks the running job `number` to end in order; whether it ran.
    ///
    /// # Errors
    /// [`tropism_lab::Error`] if its process cannot be reached.
    pub(crate) fn cancel(&self, number: u64) -> Result<bool, tropism_lab::Error> {
        let mut inner = self.inner();
        let job = inner.saved.jobs.iter().find(|job| job.number == number && job.state == JobState::Running);
        let Some(at) = job.map(|job| job.at.clone()) else { return Ok(false) };
        inner.cancelled = Some(number);
        if let Some(child) = &mut inner.child {
            ask_to_end(child);
            return Ok(true);
        }
        drop(inner);
        // Of a studio before this one: the lock of its folder names the process.
        StopPlan { folder: self.root.join(at), wait_min: 0.1 }.execute(&Silent)?;
        Ok(true)
    }

    /// The last part of what a job has said, at most [`MOST_SAID`] bytes.
    pub(crate) fn said(&self, number: u64) -> Option<String> {
        let is_known = self.inner().saved.jobs.iter().any(|job| job.number == number);
        let bytes = is_known.then(|| files::read(&self.log(number)).unwrap_or_default())?;
        let last = bytes.len().saturating_sub(MOST_SAID);
        let lines =
            String::from_utf8_lossy(&bytes[last..]).lines().map(crate::words::clean).collect::<Vec<_>>();
        Some(lines.join("\n"))
    }

    #[cfg(test)]
    fn job(&self, number: u64) -> Option<Job> {
        self.inner().saved.jobs.iter().find(|job| job.number == number).cloned()
    }

    /// Whether a job for the folder `at` waits or runs.
    pub(crate) fn has(&self, at: &str) -> bool {
        self.inner().saved.jobs.iter().any(|job| job.at == at && job.is_open())
    }

    /// The queue for pages.
    pub(crate) fn shown(&self) -> Vec<ShownJob> {
        self.inner().saved.jobs.iter().map(ShownJob::from).collect()
    }

    /// Looks after the running job, and begins the next one. To be called often.
    pub(crate) fn advance(&self) {
        let mut inner = self.inner();
        if inner.is_closed {
            return;
        }
        if inner.lock.is_none() {
            // What another studio does is shown as it saves it.
            inner.saved = Self::saved(&self.root).unwrap_or_default();
            if !inner.saved.jobs.iter().any(Job::is_open) || self.own(&mut inner).is_err() {
                return;
            }
        }
        let Some(index) = inner.saved.jobs.iter().position(|job| job.state == JobState::Running) else {
            let waiting = inner.saved.jobs.iter().position(|job| job.state == JobState::Waiting);
            if let Some(index) = waiting {
                self.start(&mut inner, index);
            }
            return;
        };
        let ended = match &mut inner.child {
            Some(child) => match child.try_wait() {
                Ok(None) => return,
                Ok(Some(status)) => Some(status.code()),
                Err(_) => Some(None),
            },
            None => None,
        };
        let job = inner.saved.jobs[index].clone();
        match ended {
            Some(Some(0)) if job.now + 1 < job.commands.len() => {
                inner.saved.jobs[index].now += 1;
                self.start(&mut inner, index);
            }
            Some(Some(0)) => self.end(&mut inner, index, JobState::Done, String::new()),
            Some(Some(130)) => self.end(&mut inner, index, JobState::Stopped, String::new()),
            Some(_) if inner.cancelled == Some(job.number) => {
                self.end(&mut inner, index, JobState::Stopped, String::new());
            }
            Some(_) => {
                let problem = last_words(&self.log(job.number));
                self.end(&mut inner, index, JobState::Failed, problem);
            }
            // Of a studio that has ended: its folder shows it.
            None if holder(&self.root.join(&job.at)).is_ok_and(|process| process.is_some()) => {}
            None if self.is_searched(&job.at) => {}
            None if inner.begun.elapsed() < BEGINS => {}
            None if self.is_done(&job.at) => {
                self.end(&mut inner, index, JobState::Done, String::new());
            }
            None if inner.cancelled == Some(job.number) => {
                self.end(&mut inner, index, JobState::Stopped, String::new());
            }
            None if !goes_on(&job) => {
                let problem =
                    "the studio ended meanwhile, and its end is not known; look at what it has written";
                self.end(&mut inner, index, JobState::Stopped, problem.to_owned());
            }
            // The computer went down, or the process was killed: it goes on.
            None => {
                let job = &mut inner.saved.jobs[index];
                let path = self.root.join(&job.at);
                let has_begun = ["evolution.toml", "study.toml", "sweep.toml"]
                    .iter()
                    .any(|name| path.join(name).exists())
                    || search_of(&path).is_file();
                let words = &mut job.commands[job.now];
                let resume = "--resume".to_owned();
                if has_begun && !words.contains(&resume) {
                    words.push(resume);
                }
                self.start(&mut inner, index);
            }
        }
    }

    /// Begins no further job, and asks the running one to end: its process.
    pub(crate) fn close(&self) -> Option<Child> {
        let mut inner = self.inner();
        inner.is_closed = true;
        let mut child = inner.child.take()?;
        ask_to_end(&mut child);
        Some(child)
    }

    /// Whether the folder or the rule that a job makes is whole.
    fn is_done(&self, at: &str) -> bool {
        let path = self.root.join(at);
        path.join("summary.json").exists() || (path.is_file() && !search_of(&path).exists())
    }

    /// Whether somebody searches for the rule that a job makes.
    fn is_searched(&self, at: &str) -> bool {
        let status = (StatusPlan { folder: self.root.join(at), model: None }).execute(&Silent);
        matches!(status, Ok(StatusResults::Work(search)) if search.work == "tune" && is_at_work(&search))
    }

    fn start(&self, inner: &mut Inner, index: usize) {
        let job = &mut inner.saved.jobs[index];
        // Another job has made it meanwhile.
        while job.now + 1 < job.commands.len() && is_made(&self.root, &job.commands[job.now]) {
            job.now += 1;
        }
        let words = &job.commands[job.now];
        match spawn(&self.program, &self.root, words, &self.log(job.number)) {
            Ok(child) => {
                job.state = JobState::Running;
                inner.child = Some(child);
                inner.begun = Instant::now();
            }
            Err(error) => {
                job.state = JobState::Failed;
                job.problem = error.to_string();
            }
        }
        // What cannot be saved now is saved with the next change.
        let _ = self.save(&inner.saved);
    }

    fn end(&self, inner: &mut Inner, index: usize, state: JobState, problem: String) {
        let job = &mut inner.saved.jobs[index];
        (job.state, job.problem) = (state, problem);
        inner.child = None;
        let _ = self.save(&inner.saved);
    }

    fn log(&self, number: u64) -> PathBuf {
        self.root.join(crate::OWN).join(format!("job-{number}.log"))
    }
}

#[cfg(test)]
mod tests;
