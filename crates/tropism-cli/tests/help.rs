//! Every command explains itself, with an example.

use std::process::Command;

const COMMANDS: [&str; 34] = [
    "study",
    "check",
    "run",
    "status",
    "stop",
    "safe-state",
    "lamp",
    "photo",
    "note",
    "export",
    "make-rig",
    "calibrate-camera",
    "track",
    "depth",
    "fit",
    "measure",
    "forecast",
    "evolve",
    "sweep",
    "baseline",
    "tune",
    "simulate",
    "score",
    "show",
    "grow",
    "transfer",
    "wall",
    "node",
    "calibrate",
    "report",
    "timelapse",
    "completions",
    "man",
    "studio",
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
        assert!(text.lines().count() <= 50, "{command}: more than a screen: {text}");
        assert!(text.contains(&format!("tropism {command}")), "{command}: {text}");
        for option in ["--json", "--quiet"] {
            assert!(text.contains(option), "{command} lacks {option}");
        }
        let has_chance = [
            "study",
            "run",
            "measure",
            "forecast",
            "evolve",
            "baseline",
            "tune",
            "simulate",
            "grow",
            "transfer",
            "wall",
            "calibrate",
        ]
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

#[test]
fn the_version_names_commit_and_instruction_set() {
    let text = help(&["--version"]);
    let start = format!("tropism {} (commit ", env!("CARGO_PKG_VERSION"));
    let after = text.strip_prefix(&start).unwrap_or_else(|| panic!("{text}"));
    let (commit, vectors) = after.split_once(", ").unwrap();
    assert!(commit.len() == 10 && commit.chars().all(|digit| digit.is_ascii_hexdigit()), "{text}");
    assert!(vectors.starts_with(&format!("{} with ", std::env::consts::ARCH)), "{text}");
}

#[test]
fn shells_complete_commands_and_options() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = help(&["completions", shell]);
        for word in ["safe-state", "json-lines"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
        assert!(!script.contains("watchdog"), "{shell}");
    }
}

#[test]
fn each_command_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    help(&["man", "--out", folder.path().to_str().unwrap()]);
    let program = std::fs::read_to_string(folder.path().join("tropism.1")).unwrap();
    for command in COMMANDS {
        let page = std::fs::read_to_string(folder.path().join(format!("tropism-{command}.1"))).unwrap();
        assert!(page.contains("Example"), "{command}");
        assert!(program.contains(&command.replace('-', "\\-")), "{command}");
    }
    assert!(!folder.path().join("tropism-watchdog.1").exists());
}
