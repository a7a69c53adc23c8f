//! Command line and summary of the examples.

use tropism_neat::Config;

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

/// The command line of an example.
pub(crate) struct Arguments {
    /// Number of runs: after `--seeds`.
    pub(crate) seeds: u64,
    /// The preset after `--preset`, by default Stanley and Miikkulainen's.
    pub(crate) config: Config,
    /// Those of the allowed flags that were given.
    pub(crate) flags: Vec<String>,
}

/// Reads the command line; without `--seeds` there are `default` runs.
pub(crate) fn arguments(default: u64, flags: &[&str]) -> Arguments {
    let mut words = std::env::args().skip(1);
    let mut found = Arguments { seeds: default, config: Config::stanley2002(), flags: Vec::new() };
    while let Some(word) = words.next() {
        if word == "--seeds" {
            let count = words.next().and_then(|count| count.parse().ok()).filter(|&count| count > 0);
            found.seeds = count.unwrap_or_else(|| exit_with("--seeds needs a number above 0"));
        } else if word == "--preset" {
            found.config = match words.next().as_deref() {
                Some("stanley2002") => Config::stanley2002(),
                Some("multineat") => Config::multineat(),
                Some("wahby2016") => Config::wahby2016(),
                Some("ball_keeper") => Config::ball_keeper(),
                _ => exit_with("--preset needs stanley2002, multineat, wahby2016 or ball_keeper"),
            };
        } else if flags.contains(&word.as_str()) {
            found.flags.push(word);
        } else {
            exit_with(&format!("unknown argument {word}: use --seeds N, --preset NAME {}", flags.join(" ")));
        }
    }
    found
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
