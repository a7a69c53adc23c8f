//! `tropism status`: what a run, an evolution, a study or other long work does now.

mod work;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism::rig::EventKind;
use tropism::task::TargetOutlook;
use tropism_lab::files::shell_word;
use tropism_lab::status::{LatestEvent, RunState, RunStatus, StatusPlan, StatusResults};
use tropism_lab::tags;
use tropism_lab::units::{self, plural};
use tropism_rig::clock::{SystemTimes, Time};
use tropism_rig::secret::shown;

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Report what a run, an evolution, a study or other long work does now
///
/// Of a run: its step, its last photograph, its lamp, and what went wrong. Of long work: how far each part is (the runs of an
/// evolution, the stages of a study, the settings of a sweep, the controllers of `transfer`), and the best fitness so far.
/// Nothing is disturbed.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    tropism status bean\n  \
    tropism status bean --model stem.json\n  \
    watch -n 60 tropism status bean\n  \
    tropism status evolution\n  \
    tropism status tropism-study --json")]
pub(crate) struct Status {
    /// Folder of a run or of long work, or file of a rule
    #[arg(value_name = "DIR|rule.json")]
    folder: PathBuf,

    /// Of a run: say by this model how probably the plant passes each target
    #[arg(long, value_name = "MODEL.json")]
    model: Option<PathBuf>,
}

impl Status {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let tags = tags::read(&self.folder).join(", ");
        execute_and_print(
            &StatusPlan { folder: self.folder, model: self.model },
            shell,
            |status| match &*tags {
                "" => text(status),
                tags => format!("{}\n{:<12} {tags}", text(status), "tags"),
            },
        )
    }
}

fn text(status: &StatusResults) -> String {
    match status {
        StatusResults::Run(run) => run_text(run),
        StatusResults::Work(status) => work::text(status),
    }
}

fn run_text(status: &RunStatus) -> String {
    let mut lines = vec![headline(status)];
    let mut add = |name: &str, text: String| lines.push(format!("{name:<12} {text}"));
    add("controller", status.controller.clone());
    match status.step {
        None => add("step", format!("none yet, of {} at most", status.max_steps)),
        Some(step) => add("step", format!("{step} of {} at most", status.max_steps)),
    }
    if let Some((x, y)) = status.tip_x_cm.zip(status.tip_y_cm) {
        let carried = match status.carried_forward_now {
            0 => String::new(),
            1 => ", carried forward: the latest photograph does not show it".to_owned(),
            count => format!(", carried forward: the latest {count} photographs do not show it"),
        };
        add("tip", format!("{x:.1}, {y:.1} cm{carried}"));
    }
    if status.process.is_some() {
        add("lamp", status.lamp.clone().unwrap_or_else(|| "not decided yet".to_owned()));
    }
    if let Some(programme) = &status.programme {
        add("programme", programme.to_string());
    }
    if let Some(light) = status.light.filter(|light| light.hours > 0.0) {
        add("light", format!("{light} in the latest 24 h"));
    }
    let folder = shell_word(&status.run);
    if let Some(lamp) = &status.still_lit {
        add("lamp", format!("{lamp} MAY STILL BE LIT: tropism safe-state {folder} puts it off"));
    }
    if let Some((photograph, age)) = status.photograph.as_ref().zip(status.photograph_age_s) {
        add("photograph", format!("{} ago: {}", units::time(age), photograph.display()));
    }
    match status.next_step_in_s {
        Some(left) if left >= 0.0 => add("next step", format!("in about {}", units::time(left))),
        Some(late) => add("next step", format!("about {} late", units::time(-late))),
        None => {}
    }
    for target in &status.outlook {
        add("target", outlook_text(target));
    }
    add("carried_forward", format!("{} without the plant", plural(status.carried_forward, "photograph")));
    add("unconfirmed", format!("{} whose lamp did not confirm", plural(status.unconfirmed, "decision")));
    if let Some(free) = status.disk_free_bytes {
        let lasts = match status.disk_lasts_days.filter(|_| status.process.is_some() && !status.is_virtual) {
            Some(days) if days < 1000.0 => format!(", enough for {}", units::time(86_400.0 * days)),
            _ => String::new(),
        };
        let used = units::bytes(status.photographs_bytes);
        add("disk", format!("{used} of photographs, {} left{lasts}", units::bytes(free)));
    }
    let counts: Vec<_> = status.event_counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    add("events", counts.join(", "));
    for LatestEvent { step, kind, text, unix_s } in &status.latest_events {
        let ago =
            unix_s.map(|unix_s| format!(", {} ago", units::time((SystemTimes.unix_s() - unix_s).max(0.0))));
        add("", format!("step {step}{}: {kind}: {}", ago.unwrap_or_default(), shown(text)));
    }
    match status.state {
        RunState::Stopped | RunState::Died => lines.push(format!("next: tropism run --out {folder}")),
        RunState::Paused => lines.push(format!("next: tropism run --out {folder} --resume")),
        RunState::Running | RunState::Overdue | RunState::Over => {}
    }
    lines.join("\n")
}

/// `(3, 6): passes within 1 cm with a probability of 0.85 (0.60 to 0.97), median 0.4 cm`.
pub(crate) fn outlook_text(outlook: &TargetOutlook) -> String {
    let TargetOutlook { target, passed_cm, probability, interval, expected_cm } = outlook;
    let place = format!("({}, {})", target.x, target.y);
    if let Some(passed) = passed_cm {
        return format!("{place}: passed at {passed:.1} cm");
    }
    let interval = interval.map_or_else(String::new, |[least, most]| format!(" ({least:.2} to {most:.2})"));
    let median = expected_cm.map_or_else(String::new, |median| format!(", median {median:.1} cm"));
    let reach = if outlook.is_out_of_reach() { "probably OUT OF REACH: " } else { "" };
    format!("{place}: {reach}passes within 1 cm with a probability of {probability:.2}{interval}{median}")
}

fn headline(status: &RunStatus) -> String {
    let is_state = |event: &&LatestEvent| event.kind.parse().is_ok_and(EventKind::is_state);
    let kind = if status.is_virtual { "a virtual plant" } else { "a plant" };
    let run = status.run.display();
    let process = status.process.map_or_else(String::new, |process| format!(" (process {process})"));
    match status.state {
        RunState::Running => format!("{run}: goes on{process}, {kind}"),
        RunState::Overdue => format!("{run}: OVERDUE, its program hangs or waits{process}, {kind}"),
        RunState::Stopped => format!("{run}: stopped before its end, {kind}"),
        // A lamp that does not go off at the end is an event, too.
        RunState::Died => match status.latest_events.iter().rfind(is_state) {
            Some(LatestEvent { kind: "fault", text, .. }) => {
                format!("{run}: an error ended it, {kind}: {}", shown(text))
            }
            _ => format!("{run}: its program was killed, or the computer went down; {kind}"),
        },
        RunState::Paused => format!("{run}: paused, {kind}"),
        RunState::Over => format!("{run}: over, {kind}"),
    }
}
