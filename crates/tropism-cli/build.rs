//! Finds the commit that is built, for `tropism --version`: that of the repository, or of the crate's package.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Digits of a commit that are shown: those that name one among millions.
const DIGITS: usize = 10;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = of_package().or_else(of_repository).unwrap_or_default();
    println!("cargo::rustc-env=TROPISM_COMMIT={}", commit.get(..DIGITS).unwrap_or_default());
}

/// The commit that `cargo package` writes into a package.
fn of_package() -> Option<String> {
    let about = fs::read_to_string(".cargo_vcs_info.json").ok()?;
    let (_, after) = about.split_once("\"sha1\"")?;
    after.split('"').nth(1).map(str::to_owned)
}

/// The commit that git has checked out. A new one builds the program anew.
fn of_repository() -> Option<String> {
    // A package may lie in a repository that is not its own.
    if !Path::new("../../ARCHITECTURE.md").exists() {
        return None;
    }
    let log = PathBuf::from(git(&["rev-parse", "--git-path", "logs/HEAD"])?);
    if log.exists() {
        println!("cargo::rerun-if-changed={}", log.display());
    }
    git(&["rev-parse", "HEAD"])
}

fn git(words: &[&str]) -> Option<String> {
    let output = Command::new("git").args(words).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
