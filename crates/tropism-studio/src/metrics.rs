//! Numbers of all runs for Prometheus, in its text format 0.0.4.

use std::fmt::Write;

use crate::items::Overview;

/// Media type of the text format.
pub(crate) const KIND: &str = "text/plain; version=0.0.4; charset=utf-8";

/// What each number is, in the order in which they are printed.
const HELP: &[(&str, &str)] = &[
    ("up", "Whether a process works on the run."),
    ("healthy", "Whether all checks of the run pass."),
    ("step", "Last step."),
    ("tip_x_cm", "Tip to the right of the root, in cm."),
    ("tip_height_cm", "Height of the tip above the soil, in cm."),
    ("lamp_lit", "Whether the lamp is lit."),
    ("photograph_timestamp_seconds", "When the last photograph was taken, in seconds since 1970."),
    ("next_photograph_timestamp_seconds", "When the next photograph is due, in seconds since 1970."),
];

/// A value of a label, as the format wants it.
fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

/// The numbers of all runs of `overview`.
pub(crate) fn text(overview: &Overview) -> String {
    let runs: Vec<_> = overview.runs().collect();
    let mut text = String::new();
    for (name, help) in HELP {
        let mut lines = String::new();
        for (run, samples) in &runs {
            for sample in samples.iter().filter(|sample| sample.name == *name) {
                let more = sample.label.as_ref().map(|(key, value)| format!(",{key}=\"{}\"", escaped(value)));
                let more = more.unwrap_or_default();
                // A string takes every text.
                let _ =
                    writeln!(lines, "tropism_run_{name}{{run=\"{}\"{more}}} {}", escaped(run), sample.value);
            }
        }
        if !lines.is_empty() {
            let _ =
                write!(text, "# HELP tropism_run_{name} {help}\n# TYPE tropism_run_{name} gauge\n{lines}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_escaped() {
        assert_eq!(escaped("a\"b\\c\nd"), "a\\\"b\\\\c\\nd");
    }
}
