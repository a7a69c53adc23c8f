//! One file a command.

mod baseline;
mod calibrate;
mod calibrate_camera;
mod light_meter;
mod check;
mod completions;
mod depth;
mod evolve;
mod export;
mod fit;
mod forecast;
mod grow;
mod lamp;
mod make_rig;
mod man;
mod measure;
mod node;
mod note;
mod photo;
mod report;
mod run;
mod safe_state;
mod score;
mod show;
mod simulate;
mod status;
mod stop;
#[cfg(feature = "studio")]
mod studio;
mod wall;
mod study;
mod sweep;
mod timelapse;
mod track;
mod transfer;
mod tune;
mod watch_wall;
mod watchdog;

use anyhow::Result;
use clap::Subcommand;

use crate::shell::Shell;

/// What to do.
#[derive(Subcommand)]
pub(crate) enum Command {
    Study(study::Study),
    Check(check::Check),
    Run(run::Run),
    Status(status::Status),
    #[cfg(feature = "studio")]
    Studio(studio::Studio),
    Stop(stop::Stop),
    SafeState(safe_state::SafeState),
    Lamp(lamp::Lamp),
    Photo(photo::Photo),
    Note(note::Note),
    #[command(hide = true)]
    Watchdog(watchdog::Watchdog),
    Export(export::Export),
    MakeRig(make_rig::MakeRig),
    CalibrateCamera(calibrate_camera::CalibrateCamera),
    Track(track::Track),
    Depth(depth::Depth),
    Fit(fit::Fit),
    Measure(measure::Measure),
    Forecast(forecast::Forecast),
    Evolve(evolve::Evolve),
    Sweep(sweep::Sweep),
    Baseline(baseline::Baseline),
    Tune(tune::Tune),
    Simulate(simulate::Simulate),
    Score(score::Score),
    Show(show::Show),
    Grow(grow::Grow),
    Transfer(transfer::Transfer),
    Wall(wall::Wall),
    Node(node::Node),
    WatchWall(watch_wall::WatchWall),
    Calibrate(calibrate::Calibrate),
    Report(report::Report),
    Timelapse(timelapse::Timelapse),
    Completions(completions::Completions),
    Man(man::Man),
}

impl Command {
    /// Whether it switches nothing and has nothing to go on with: it reads, reckons and writes whole files.
    pub(crate) const fn is_in_one_piece(&self) -> bool {
        matches!(
            self,
            Self::Status(_)
                | Self::MakeRig(_)
                | Self::CalibrateCamera(_)
                | Self::Depth(_)
                | Self::Measure(_)
                | Self::Forecast(_)
                | Self::Score(_)
                | Self::Show(_)
                | Self::Report(_)
                | Self::Completions(_)
                | Self::Man(_)
        )
    }

    /// Does it.
    pub(crate) fn execute(self, shell: &Shell) -> Result<()> {
        match self {
            Self::Study(study) => study.execute(shell),
            Self::Check(check) => check.execute(shell),
            Self::Run(run) => run.execute(shell),
            Self::Status(status) => status.execute(shell),
            #[cfg(feature = "studio")]
            Self::Studio(studio) => studio.execute(shell),
            Self::Stop(stop) => stop.execute(shell),
            Self::SafeState(safe_state) => safe_state.execute(shell),
            Self::Lamp(lamp) => lamp.execute(shell),
            Self::Photo(photo) => photo.execute(shell),
            Self::Note(note) => note.execute(shell),
            Self::Watchdog(watchdog) => watchdog.execute(),
            Self::Export(export) => export.execute(shell),
            Self::MakeRig(make_rig) => make_rig.execute(shell),
            Self::CalibrateCamera(calibrate) => calibrate.execute(shell),
            Self::Track(track) => track.execute(shell),
            Self::Depth(depth) => depth.execute(shell),
            Self::Fit(fit) => fit.execute(shell),
            Self::Measure(measure) => measure.execute(shell),
            Self::Forecast(forecast) => forecast.execute(shell),
            Self::Evolve(evolve) => evolve.execute(shell),
            Self::Sweep(sweep) => sweep.execute(shell),
            Self::Baseline(baseline) => baseline.execute(shell),
            Self::Tune(tune) => tune.execute(shell),
            Self::Simulate(simulate) => simulate.execute(shell),
            Self::Score(score) => score.execute(shell),
            Self::Show(show) => show.execute(shell),
            Self::Grow(grow) => grow.execute(shell),
            Self::Transfer(transfer) => transfer.execute(shell),
            Self::Wall(wall) => wall.execute(shell),
            Self::WatchWall(watch) => watch.execute(shell),
            Self::Node(node) => node.execute(shell),
            Self::Calibrate(calibrate) => calibrate.execute(shell),
            Self::Report(report) => report.execute(shell),
            Self::Timelapse(timelapse) => timelapse.execute(shell),
            Self::Completions(completions) => completions.execute(shell),
            Self::Man(man) => man.execute(shell),
        }
    }
}
