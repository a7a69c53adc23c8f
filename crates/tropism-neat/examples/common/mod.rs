//! Command line and summary of the examples.

/// Result of one run.
pub(crate) struct RunResult {
    /// Whether the run solved the task.
    pub(crate) is_solved: bool,
    /// Number of evaluations.
    pub(crate) evaluations: u64,
    /// Number of generations.
    pub(crate) generations: u32,
    /// Number of hidden neurons of the solution, or of the best network.
    pub(crate) hidden: usize,
    /// Number of links of the solution, or of the best network.
    pub(crate) links: usize,
}

/// Reads the command line: the number after `--seeds`, by default `default`, and the given ones of the allowed `flags`.
pub(crate) fn arguments(default: u64, flags: &[&str]) -> (u64, Vec<String>) {
    let mut arguments = std::env::args().skip(1);
    let (mut seeds, mut given) = (default, Vec::new());
    while let Some(argument) = arguments.next() {
        if argument == "--seeds" {
            let count = arguments.next().and_then(|count| count.parse().ok()).filter(|&count| count > 0);
            seeds = count
                .unwrap_or_else(|| exit_with("found no number of seeds, wanted --seeds N with N above 0"));
        } else if flags.contains(&argument.as_str()) {
            given.push(argument);
        } else {
            exit_with(&format!("found {argument}, wanted --seeds N {}", flags.join(" ")));
        }
    }
    (seeds, given)
}

/// Prints an error and exits with status 2.
fn exit_with(message: &str) -> ! {
    eprintln!("{message}");
    std::process::exit(2);
}

/// Prints the number of solved runs, and means and standard deviations over them.
pub(crate) fn report(results: &[RunResult]) {
    let solved: Vec<_> = results.iter().filter(|result| result.is_solved).collect();
    println!("solved       {} of {}", solved.len(), results.len());
    let line = |name: &str, value: fn(&RunResult) -> f64| {
        let count = solved.len().max(1) as f64;
        let mean = solved.iter().map(|result| value(result)).sum::<f64>() / count;
        let variance = solved.iter().map(|result| (value(result) - mean).powi(2)).sum::<f64>() / count;
        println!("{name:<12} {mean:.1} (deviation {:.1})", variance.sqrt());
    };
    line("generations", |result| f64::from(result.generations));
    line("evaluations", |result| result.evaluations as f64);
    line("hidden", |result| result.hidden as f64);
    line("links", |result| result.links as f64);
}
