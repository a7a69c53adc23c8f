//! What the examples share: their one argument, and a table of how their runs went.

/// How a run ended.
pub(crate) struct Outcome {
    /// Whether it met the goal.
    pub(crate) solved: bool,
    /// Evaluations until then.
    pub(crate) evaluations: u64,
    /// Generations until then.
    pub(crate) generations: u32,
    /// Hidden neurons of its champion.
    pub(crate) hidden: usize,
    /// Links of its champion.
    pub(crate) links: usize,
}

/// The number after `--seeds`, or else `default`; whatever else is on the command line must be among `flags`.
pub(crate) fn arguments(default: u64, flags: &[&str]) -> (u64, Vec<String>) {
    let mut arguments = std::env::args().skip(1);
    let (mut seeds, mut given) = (default, Vec::new());
    while let Some(argument) = arguments.next() {
        if argument == "--seeds" {
            let count = arguments.next().and_then(|count| count.parse().ok()).filter(|&count| count > 0);
            seeds = count.unwrap_or_else(|| wrong("--seeds wants a whole number above 0"));
        } else if flags.contains(&argument.as_str()) {
            given.push(argument);
        } else {
            wrong(&format!("unknown argument {argument}: wanted --seeds N {}", flags.join(" ")));
        }
    }
    (seeds, given)
}

fn wrong(message: &str) -> ! {
    eprintln!("{message}");
    std::process::exit(2);
}

/// Prints success rate, and means and deviations over the solved runs.
pub(crate) fn report(outcomes: &[Outcome]) {
    let solved: Vec<_> = outcomes.iter().filter(|outcome| outcome.solved).collect();
    println!("solved       {} of {}", solved.len(), outcomes.len());
    let line = |name: &str, value: fn(&Outcome) -> f64| {
        let count = solved.len().max(1) as f64;
        let mean = solved.iter().map(|outcome| value(outcome)).sum::<f64>() / count;
        let variance = solved.iter().map(|outcome| (value(outcome) - mean).powi(2)).sum::<f64>() / count;
        println!("{name:<12} {mean:.1} (deviation {:.1})", variance.sqrt());
    };
    line("generations", |outcome| f64::from(outcome.generations));
    line("evaluations", |outcome| outcome.evaluations as f64);
    line("hidden", |outcome| outcome.hidden as f64);
    line("links", |outcome| outcome.links as f64);
}
