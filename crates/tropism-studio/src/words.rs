//! Events and states in plain words, with what to do.

use tropism_lab::status::{RunState, RunStatus};
use tropism_rig::secret::shown;

/// What an event of `kind` means, and what a person should do; `None` where nothing is to be done.
pub(crate) fn of_event(kind: &str) -> (&'static str, Option<&'static str>) {
    match kind {
        "started" => ("The run began.", None),
        "resumed" => ("The run went on after an interruption.", None),
        "stopped" => ("The run was stopped in order.", Some("Resume it when you are ready.")),
        "paused" => ("The run waits for you.", Some("Read why, then resume it.")),
        "finished" => ("The run is over.", None),
        "late" => ("A step began late, within what is tolerated.", None),
        "missed" => {
            ("Steps passed without a decision.", Some("Look whether the computer was off or too busy."))
        }
        "camera" => (
            "The camera gave no photograph; the last detection was kept.",
            Some("If it comes again, look at its cable and network."),
        ),
        "dark" => {
            ("A photograph was dark and was taken again.", Some("If it comes again, look at the flash."))
        }
        "carried_forward" => (
            "No plant was found in a photograph; the last detection was kept.",
            Some("If it goes on, look at the photograph: is something before the tip?"),
        ),
        "lost" => (
            "The plant has not been found for long.",
            Some("Look at the plant, and at region and base in the settings of vision."),
        ),
        "lamp" => ("A lamp did not obey.", Some("Look at its plug and cable.")),
        "mismatch" => (
            "The photograph shows another lamp lit than was asked for.",
            Some("Look at the lamps: are left and right swapped?"),
        ),
        "moved" => ("The camera was moved.", Some("Put it back, or calibrate again.")),
        "recovered" => ("A fault is over.", None),
        "clock" => ("The computer’s clock was set. The steps keep their times.", None),
        "computer" => {
            ("The computer is too hot or its supply too weak.", Some("Look at its fan and its power supply."))
        }
        "disk" => ("The disk is full.", Some("Make room: the run goes on by itself.")),
        "damaged" => {
            ("A file of the run was damaged.", Some("Copy the run folder elsewhere, then look at the disk."))
        }
        "note" => ("Note", None),
        _ => ("Something happened.", None),
    }
}

/// Whether an event of `kind` asks for attention.
pub(crate) fn is_warning(kind: &str) -> bool {
    of_event(kind).1.is_some() && kind != "stopped"
}

/// How a run is, in a few words: `good`, or what to look at first.
pub(crate) fn health(status: &RunStatus) -> String {
    match status.state {
        RunState::Overdue => return "The photograph is late: look at the camera".to_owned(),
        RunState::Died if status.still_lit.is_some() => {
            return "Ended without a word; a lamp may still be lit".to_owned();
        }
        RunState::Died => return "Ended without a word; it can go on".to_owned(),
        RunState::Paused => return "Waits for you".to_owned(),
        RunState::Running | RunState::Stopped | RunState::Over => {}
    }
    if status.state == RunState::Running && status.carried_forward_now > 0 {
        let photographs = if status.carried_forward_now == 1 { "photograph" } else { "photographs" };
        return format!("No plant found in the last {} {photographs}", status.carried_forward_now);
    }
    if status.disk_lasts_days.is_some_and(|days| days < 7.0) && status.state == RunState::Running {
        return "The disk is full within a week".to_owned();
    }
    "good".to_owned()
}

/// Text from files and devices, without secrets and control characters.
pub(crate) fn clean(text: &str) -> String {
    shown(text).to_string().chars().filter(|letter| !letter.is_control()).take(600).collect()
}
