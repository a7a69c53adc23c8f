//! The page of one run, as a process beside it.

use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::Context;

/// Where pages are served if nothing else is said.
pub(crate) const LISTEN: &str = "127.0.0.1:8217";

/// Address and port on which a page is served.
pub(crate) fn parse_address(text: &str) -> Result<SocketAddr, String> {
    let wanted = "wanted an address in numbers and a port, such as 127.0.0.1:8217, or 0.0.0.0:8217 for the whole network";
    text.parse().map_err(|_| wanted.to_owned())
}

/// The page of one run, beside it: a process of its own, so that nothing of it can slow or end the run. It ends with the run,
/// but not when the run dies, so that the page can say so.
pub(crate) struct Beside(Child);

impl Beside {
    /// Starts the page of the run in `folder` on `address`.
    pub(crate) fn start(folder: &Path, address: SocketAddr) -> anyhow::Result<Self> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("studio").arg(folder).arg("--listen").arg(address.to_string());
        // What it says is no result of the run.
        command.stdin(Stdio::null()).stdout(std::io::stderr());
        // Ctrl-C ends the run, which then ends the page.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        Ok(Self(command.spawn().context("the page cannot be started")?))
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        // It holds nothing that would be lost.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
