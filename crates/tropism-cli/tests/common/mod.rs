//! What several tests of signals need.

use std::process::Command;

/// A command that hears the signals by which a terminal ends it. What started the tests may ignore them, as `nohup` does and `&`
/// in a script, and the program would rightly do so, too. `env` of coreutils 8.31 or later gives them their defaults back.
pub(crate) fn hearing(program: &str) -> Command {
    if !cfg!(target_os = "linux") {
        return Command::new(program);
    }
    let mut command = Command::new("env");
    command.args(["--default-signal=HUP,INT,QUIT", program]);
    command
}
