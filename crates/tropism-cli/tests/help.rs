//! Every command explains itself, with an example.

use std::process::Command;

const COMMANDS: [&str; 22] = [
    "study",
    "check",
    "run",
    "status",
    "stop",
    "safe-state",
    "export",
    "calibrate-camera",
    "track",
    "depth",
    "fit",
    "evolve",
    "baseline",
    "tune",
    "simulate",
    "score",
    "show",
    "grow",
    "transfer",
    "calibrate",
    "report",
    "timelapse",
];

fn help(words: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_tropism")).args(words).output().unwrap();
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_program_lists_its_commands() {
    insta::assert_snapshot!(help(&["--help"]));
}

#[test]
fn every_command_shows_an_example() {
    for command in COMMANDS {
        let text = help(&[command, "--help"]);
        assert!(text.contains("Example"), "{command}: {text}");
        assert!(text.contains(&format!("tropism {command}")), "{command}: {text}");
        for option in ["--json", "--quiet"] {
            assert!(text.contains(option), "{command} lacks {option}");
        }
        let has_chance =
            ["study", "run", "evolve", "baseline", "tune", "simulate", "grow", "transfer", "calibrate"]
                .contains(&command);
        assert_eq!(text.contains("--seed"), has_chance, "{command}");
        insta::assert_snapshot!(format!("help-{command}"), text);
    }
}

#[test]
fn wrong_use_is_exit_code_2() {
    for words in
        [&["no-such-command"][..], &["fit"], &["study", "--no-such-option"], &["evolve", "--runs", "x"]]
    {
        let output = Command::new(env!("CARGO_BIN_EXE_tropism")).args(words).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{words:?}");
    }
}
