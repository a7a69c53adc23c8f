use super::*;

/// A queue whose program prints its words.
fn queue(root: &Path, program: &str) -> Queue {
    Queue::open(root, Path::new(program)).unwrap()
}

fn wait_for(queue: &Queue, number: u64, state: JobState) -> Job {
    for _ in 0..500 {
        queue.advance();
        let job = queue.job(number).unwrap();
        if job.state == state {
            return job;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    panic!("{:?}", queue.job(number));
}

#[cfg(unix)]
#[test]
fn jobs_wait_for_each_other_and_survive_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let words = |text: &str| vec![vec![text.to_owned()]];
    let first = queue(folder.path(), "sleep");
    let long = first.add("long", words("0.3")).unwrap();
    let short = first.add("short", words("0")).unwrap();
    let taken_out = first.add("none", words("9")).unwrap();
    assert!(first.remove(taken_out).unwrap() && !first.remove(taken_out).unwrap());
    first.advance();
    assert_eq!(
        [long, short].map(|job| first.job(job).unwrap().state),
        [JobState::Running, JobState::Waiting]
    );
    // Another studio shows them, and adds none.
    let second = queue(folder.path(), "sleep");
    second.advance();
    assert!(second.add("other", words("0")).unwrap_err().to_string().contains("another studio"));
    assert_eq!(second.job(long).unwrap().state, JobState::Running);
    drop(first);
    second.advance();
    assert_eq!(second.job(short).unwrap().state, JobState::Waiting);
    assert!(second.has("short") && !second.has("none"));
}

#[cfg(unix)]
#[test]
fn a_closed_queue_ends_its_job_and_begins_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let queue = queue(folder.path(), "sh");
    let words = || vec![["-c", "exec sleep 600"].map(str::to_owned).to_vec()];
    let [runs, waits] = ["runs", "waits"].map(|at| queue.add(at, words()).unwrap());
    queue.advance();
    assert_eq!(queue.job(runs).unwrap().state, JobState::Running);
    let mut child = queue.close().unwrap();
    wait_for_end(&mut child);
    // Of SIGTERM, not of SIGKILL after its time.
    let signal = std::os::unix::process::ExitStatusExt::signal(&child.wait().unwrap());
    assert_eq!(signal, Some(rustix::process::Signal::TERM.as_raw()));
    queue.advance();
    assert_eq!(queue.job(waits).unwrap().state, JobState::Waiting);
}

#[cfg(unix)]
#[test]
fn a_job_that_fails_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let queue = queue(folder.path(), "ls");
    let number = queue.add("x", vec![vec!["no-such-file".to_owned()]]).unwrap();
    let job = wait_for(&queue, number, JobState::Failed);
    assert!(!job.problem.is_empty());
    assert_eq!(job.lines(), ["tropism no-such-file"]);
}
