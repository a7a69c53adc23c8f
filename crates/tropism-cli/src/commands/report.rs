//! `tropism report`: figures and tables of runs, tracks, evolutions, studies or a sweep.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use tropism_lab::report::{ReportPlan, ReportResults};

use crate::progress::execute_and_print;
use crate::shell::Shell;

/// Write a report of runs, tracks, evolutions, studies or a sweep: one HTML file
///
/// Open-loop runs give Figures 1 to 5 and 9, tracks of `tropism track` Figures 3 to 5 and 9, evolutions Figure 6,
/// steered runs Figures 1 and 8; a study gives all of them. Tracks and open-loop runs also give tip, angle, length and
/// growth rate over time. Figures without data are left out with a word why.
///
/// Several evolutions, several studies and the settings of a sweep are compared: fitness over the generations on one axis,
/// median and quartiles, and for each pair a Mann-Whitney U test, corrected after Holm, with an effect size.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  tropism report tropism-study --out report.html\n  tropism report tent/* --out report.html\n  tropism report track.csv --out report.html\n  tropism report evolution-a evolution-b --out comparison.html --figures figures\n  tropism report sweep --out comparison.html"
)]
pub(crate) struct Report {
    /// Folders of runs, evolutions, studies, transfers, replicates or a sweep, and tracks of photographs
    #[arg(required = true, value_name = "DIR|TRACK.csv")]
    sources: Vec<PathBuf>,

    /// File to write the report to
    #[arg(long, value_name = "report.html")]
    out: PathBuf,

    /// Folder to write the figures to as single files: SVG, PNG and PDF (photographs JPEG), data as CSV
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
}

impl Report {
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        let plan = ReportPlan { sources: self.sources, out: self.out, figures: self.figures };
        execute_and_print(&plan, shell, |results: &ReportResults| {
            let left_out = results.left_out.iter().fold(String::new(), |text, left_out| {
                format!("{text}no figure {}: {}\n", left_out.figure, left_out.reason)
            });
            let compared = results.comparisons.iter().fold(String::new(), |text, comparison| {
                let different = comparison.pairs.iter().filter(|pair| pair.is_different()).count();
                let pairs = comparison.pairs.len();
                format!(
                    "{text}{}: pairs that differ after Holm's correction: {different} of {pairs}\n",
                    comparison.title
                )
            });
            format!(
                "figures {}\n{left_out}{compared}wrote {}",
                results.figures.join(", "),
                results.report.display()
            )
        })
    }
}
