//! A short run with a kill in the middle.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use tropism::rig::OnExit;
use tropism_lab::{Journal, Row, files};
use tropism_rig::file::RigFile;

use super::{Findings, Group};
use crate::shell::{Interrupted, Shell};

/// Minutes between the steps of a rehearsal: as soon as they can.
const PERIOD_MIN: f64 = 1e-3;

/// How long a rehearsal may take for each step.
const PATIENCE: Duration = Duration::from_secs(120);

/// A child that does not outlive us.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs `steps` steps of `rig` in a scratch folder in `data`, kills the run without warning when half of them are done,
/// lets it go on, and looks whether anything was lost.
pub(super) fn hold(rig: &RigFile, data: &Path, steps: u32, findings: &mut Findings) -> Result<()> {
    let scratch = data.join(format!("tropism-rehearsal-{}", std::process::id()));
    fs::create_dir(&scratch).with_context(|| scratch.display().to_string())?;
    let held = rehearse(rig, &scratch, steps, findings);
    if let Ok(true) = held {
        fs::remove_dir_all(&scratch).with_context(|| scratch.display().to_string())?;
        return Ok(());
    }
    findings.warn(
        Group::Rehearsal,
        format!("its folder stays: {}", scratch.display()),
        "tropism status shows it; remove it when you have looked",
    );
    held.map(drop)
}

/// Whether it went well.
fn rehearse(rig: &RigFile, scratch: &Path, steps: u32, findings: &mut Findings) -> Result<bool> {
    let mut rig = rig.clone();
    // A virtual plant lives by steps of its own.
    if !rig.is_virtual() {
        rig.period_min = PERIOD_MIN;
    }
    // A rehearsal leaves nothing lit.
    rig.lamps.iter_mut().for_each(|lamps| lamps.on_exit = OnExit::Dark);
    files::write(&scratch.join("rig.toml"), toml::to_string(&rig)?.as_bytes())?;
    let mut first = start(&rig, scratch, steps, false)?;
    let patience = PATIENCE * steps;
    let began = Instant::now();
    let before = loop {
        let rows = rows(scratch);
        if rows.len() as u32 > steps / 2 {
            break rows;
        }
        if first.0.try_wait()?.is_some() || began.elapsed() > patience {
            return complain(scratch, "the run ended or hung before it was killed", findings);
        }
        if Shell::is_interrupted() {
            return Err(Interrupted("the rehearsal was given up".to_owned()).into());
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    first.0.kill()?;
    let is_killed = first.0.wait()?.code().is_none();
    drop(first);
    let mut second = start(&rig, scratch, steps, true)?;
    let resumed = Instant::now();
    let status = loop {
        if let Some(status) = second.0.try_wait()? {
            break status;
        }
        if resumed.elapsed() > patience {
            return complain(scratch, "the run hung after it was killed and went on", findings);
        }
        if Shell::is_interrupted() {
            return Err(Interrupted("the rehearsal was given up".to_owned()).into());
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    if !status.success() {
        return complain(scratch, "the run did not go on after it was killed", findings);
    }
    let after = rows(scratch);
    // The latest step was not over when it was killed: its photograph stands, its lamp is confirmed later.
    let whole = before.len() - 1;
    if after.len() as u32 != steps + 1 || after[..whole] != before[..whole] {
        return complain(
            scratch,
            "steps that were written down before the kill are not there after it",
            findings,
        );
    }
    for row in &after {
        let path = scratch.join("run/photographs").join(&row.photo);
        if files::sha256(&files::read(&path)?) != row.photo_sha256 {
            return complain(scratch, &format!("{} is not what it was", row.photo), findings);
        }
    }
    if !is_killed {
        findings.warn(
            Group::Rehearsal,
            "the run was over before it could be killed",
            "more steps: --rehearse 10",
        );
        return Ok(true);
    }
    findings.pass(
        Group::Rehearsal,
        format!(
            "killed after {} of {steps} steps and gone on: no step lost, {} photographs whole, {:.1} s a step",
            before.len(),
            after.len(),
            began.elapsed().as_secs_f64() / f64::from(steps)
        ),
    );
    Ok(true)
}

/// A line with what the run said last.
fn complain(scratch: &Path, problem: &str, findings: &mut Findings) -> Result<bool> {
    let said = fs::read_to_string(scratch.join("said.txt")).unwrap_or_default();
    let said = said.lines().rev().find(|line| line.starts_with("error: ")).unwrap_or("it said nothing");
    findings.fail(Group::Rehearsal, format!("{problem}: {said}"), "correct that, then rehearse again");
    Ok(false)
}

/// Both lamps in turn, a step each.
fn start(rig: &RigFile, scratch: &Path, steps: u32, is_resumed: bool) -> Result<Running> {
    let said = fs::File::options().create(true).append(true).open(scratch.join("said.txt"))?;
    let mut command = Command::new(std::env::current_exe().context("cannot find this program")?);
    command.arg("run").arg("--rig").arg(scratch.join("rig.toml")).arg("--out").arg(scratch.join("run"));
    command.args(["--controller", &format!("periodic:{}m", rig.period_min), "--steps", &steps.to_string()]);
    if rig.is_virtual() {
        // So slow that there is something to kill.
        command.args(["--speed", "300"]);
    }
    if is_resumed {
        command.arg("--resume");
    }
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(said).spawn();
    Ok(Running(child.context("cannot start this program again")?))
}

/// What is in the journal by now.
fn rows(scratch: &Path) -> Vec<Row> {
    let journal = Journal::open_to_read(&scratch.join("run/journal.sqlite"));
    journal.and_then(|journal| journal.rows()).unwrap_or_default()
}
