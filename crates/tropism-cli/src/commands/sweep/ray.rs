//! The units of a sweep on a Ray cluster: Python's `tropism.ray_engine` is started, and told the plan.

use std::io::{ErrorKind, Write};
use std::process::{Command, Stdio};

use anyhow::{Result, anyhow, bail};
use serde::Serialize;
use tropism_lab::Workflow;
use tropism_lab::sweep::SweepPlan;

use crate::progress::for_user;
use crate::shell::{Interrupted, Shell};

/// Python, as an activated environment has it first on the path.
const PYTHON: &str = "python3";

/// How to get what is missing.
const INSTALL: &str =
    "pip install ./crates/tropism-py \"ray[default]\", in the environment whose python3 is first on the path";

/// What Python is told.
#[derive(Serialize)]
struct Order<'a> {
    plan: &'a SweepPlan,
    address: Option<&'a str>,
    workers: Option<u32>,
}

/// Executes all units of `plan` on the cluster at `address`, or on one of this machine.
pub(super) fn execute_units(plan: &SweepPlan, address: Option<&str>, workers: Option<u32>) -> Result<()> {
    plan.check().map_err(for_user)?;
    check_python()?;
    let order = serde_json::to_vec(&Order { plan, address, workers })?;
    let mut child = Command::new(PYTHON)
        .args(["-m", "tropism.ray_engine"])
        .stdin(Stdio::piped())
        // Only the table goes to stdout.
        .stdout(Stdio::null())
        .spawn()?;
    if let Some(mut stdin) = child.stdin.take() {
        stdin.write_all(&order)?;
    }
    let status = child.wait()?;
    if Shell::is_interrupted() || status.code() == Some(130) {
        return Err(Interrupted::resumable(&plan.out));
    }
    if !status.success() {
        bail!("the engine ray ended with {status}: the line above says why");
    }
    Ok(())
}

/// Checks that there is a Python with tropism and Ray.
fn check_python() -> Result<()> {
    let found = Command::new(PYTHON).args(["-c", "import ray, tropism"]).stdin(Stdio::null()).output();
    let said = match found {
        Ok(output) if output.status.success() => return Ok(()),
        Ok(output) => String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned(),
        Err(error) if error.kind() == ErrorKind::NotFound => format!("no {PYTHON}"),
        Err(error) => error.to_string(),
    };
    Err(anyhow!("found {said:?}, wanted Python with tropism and Ray for --engine ray: {INSTALL}"))
}
