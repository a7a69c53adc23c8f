//! Single photographs of sunflower seedlings over a bright pot, whose stems were clicked by hand.

use std::path::Path;

use rayon::prelude::*;
use tropism::math::statistics::quantile_nearest;
use tropism::vision::Mode;

use super::alone;
use crate::marks::rows;
use crate::published::{self, StemErrors, WRONG};
use crate::reliability::Reliability;
use crate::share::Share;

/// Greatest error of a length, in %.
const LENGTH: f64 = 10.0;

/// Result of one seedling.
struct Scored {
    /// Hook, Closed or Open; `nan` where it is not known.
    stage: String,
    /// Errors of the stem where one is given, and its confidence.
    errors: Option<(StemErrors, f64)>,
}

pub(super) fn print(folder: &Path, suffix: &str, mode: Mode, reliability: &mut Reliability) {
    let folder = folder.join(format!("sunflower-centerlines{suffix}"));
    let marks = rows(&folder.join("centerlines.csv"));
    let score = |row: &crate::marks::Row| {
        let marked = published::marked(row);
        let answer = alone(&folder.join("images").join(row.text("file")), marked[0], mode);
        let stem = answer.measured().and_then(|seen| seen.stem.as_deref());
        let errors = stem.map(|stem| (StemErrors::between(stem, &marked), answer.confidence));
        Scored { stage: row.text("stage").to_owned(), errors }
    };
    let scored: Vec<Scored> = marks.par_iter().map(score).collect();
    let known = scored.iter().filter_map(|one| one.errors.as_ref());
    reliability.extend(known.map(|(errors, confidence)| (*confidence, errors.distance <= WRONG)));
    for (name, stages) in [
        ("Hook and Closed", &["Hook", "Closed"][..]),
        ("Open", &["Open"]),
        ("all", &["Hook", "Closed", "Open", "nan"]),
    ] {
        let of_stage = || scored.iter().filter(|one| stages.contains(&one.stage.as_str()));
        let given: Vec<&StemErrors> = of_stage().filter_map(|one| Some(&one.errors.as_ref()?.0)).collect();
        let share = |is: fn(&StemErrors) -> bool| Share::of(given.iter().map(|errors| is(errors)));
        let median = |of: fn(&StemErrors) -> f64| {
            quantile_nearest(&given.iter().map(|errors| of(errors)).collect::<Vec<_>>(), 0.5)
        };
        println!(
            "  {name:18} answered {} | of these wrong (> {WRONG} %) {}, length within {LENGTH} % {}, end within 8 px {}, \
             distance median {:.1} %, length {:.1} %",
            Share::of(of_stage().map(|one| one.errors.is_some())),
            share(|errors| errors.distance > WRONG),
            share(|errors| errors.length <= LENGTH),
            share(|errors| errors.end <= 8.0),
            median(|errors| errors.distance),
            median(|errors| errors.length)
        );
    }
}
