//! Work whose units are executed by a Ray cluster, or whose files lie at an fsspec address: Python's `tropism.work_command` is
//! started, and given the plan.

use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result, anyhow, bail};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tropism_lab::Work;

use crate::progress::for_user;
use crate::shell::{Interrupted, Shell};

/// Python, as an activated environment has it first on the path.
const PYTHON: &str = "python3";

/// What is sent to Python.
#[derive(Serialize)]
pub(crate) struct Order<'a, W> {
    /// Name of the workflow.
    pub(crate) workflow: &'static str,
    /// `None` goes on with the work at the address `out`.
    pub(crate) plan: Option<&'a W>,
    pub(crate) out: &'a Path,
    /// `local` or `ray`.
    pub(crate) engine: &'static str,
    /// Of the cluster.
    pub(crate) address: Option<&'a str>,
    /// Of all units together on this machine.
    pub(crate) threads: usize,
}

/// Whether `out` is an fsspec address, such as `s3://bucket/sweep`, and no folder.
pub(crate) fn is_address(out: &Path) -> bool {
    out.to_str().is_some_and(|text| text.contains("://"))
}

impl<W: Work> Order<'_, W> {
    /// Executes the units in a folder that the cluster shares.
    pub(crate) fn execute_units(&self) -> Result<()> {
        self.execute().map(drop)
    }

    /// Executes the work at an address.
    pub(crate) fn execute_all(&self) -> Result<W::Results>
    where
        W::Results: DeserializeOwned,
    {
        let output = self.execute()?;
        serde_json::from_slice(&output.stdout)
            .with_context(|| format!("the results of {PYTHON} -m tropism.work_command"))
    }

    fn execute(&self) -> Result<Output> {
        if let Some(plan) = self.plan {
            plan.check().map_err(for_user)?;
        }
        self.check_python()?;
        let order = serde_json::to_vec(self)?;
        let mut child = Command::new(PYTHON)
            .args(["-m", "tropism.work_command"])
            .stdin(Stdio::piped())
            // Only the table goes to the command's own stdout.
            .stdout(Stdio::piped())
            .spawn()?;
        if let Some(mut stdin) = child.stdin.take() {
            stdin.write_all(&order)?;
        }
        let output = child.wait_with_output()?;
        if Shell::is_interrupted() || output.status.code() == Some(130) {
            return Err(Interrupted::resumable(self.out));
        }
        if !output.status.success() {
            bail!("the work in Python ended with {}: the line above says why", output.status);
        }
        Ok(output)
    }

    /// Checks that there is a Python with tropism and what else is needed.
    fn check_python(&self) -> Result<()> {
        let wanted = match (self.engine, is_address(self.out)) {
            ("local", _) => "fsspec",
            (_, false) => "ray",
            (_, true) => "ray, fsspec",
        };
        let import = format!("import tropism, {wanted}");
        let said = match Command::new(PYTHON).args(["-c", &import]).stdin(Stdio::null()).output() {
            Ok(output) if output.status.success() => return Ok(()),
            Ok(output) => {
                String::from_utf8_lossy(&output.stderr).lines().last().unwrap_or_default().to_owned()
            }
            Err(error) if error.kind() == ErrorKind::NotFound => format!("no {PYTHON}"),
            Err(error) => error.to_string(),
        };
        Err(anyhow!(
            "found {said:?}, wanted Python with tropism, {wanted}: pip install './crates/tropism-py[ray,fsspec]', in the \
             environment whose python3 is first on the path"
        ))
    }
}
