//! Tuning a rule: it ends when it is asked to, and leaves nothing half-done.

use tropism::control::Periodic;
use tropism::environment::unwatched;
use tropism::evolve::RuleSearch;
use tropism::greenhouse::bean::{Species, Trial};
use tropism::lamps::Layout;
use tropism::task::OpenLoop;
use tropism_lab::fit::{FitPlan, ModelKind};
use tropism_lab::tune::TunePlan;
use tropism_lab::{Error, Monitor, Silent, Workflow, files};

/// Asks for an end as soon as anything is asked.
struct Impatient;

impl Monitor for Impatient {
    fn may_go_on(&self) -> bool {
        false
    }
}

#[test]
fn an_interrupted_search_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (track, model, out) = ("track.csv", "memory.json", "rule.json");
    let [track, model, out] = [track, model, out].map(|name| folder.path().join(name));
    let species = Species::default();
    let task = OpenLoop { steps: 300, ..OpenLoop::default() };
    let mut periodic = Periodic::new(72, &Layout::default());
    let grown = Trial::new(&species).grow(5_000_000, &mut periodic, &task, &mut unwatched);
    files::write_track(&track, &grown).unwrap();
    let fit =
        FitPlan { tracks: vec![track], kind: ModelKind::Memory, out: model.clone(), ..FitPlan::default() };
    let fitted = fit.execute(&Silent).unwrap();
    assert_eq!((fitted.shifts, fitted.is_virtual), (300, true));
    let search = RuleSearch { generations: 2, population: 4, episodes: 2 };
    let plan = TunePlan { model, out: out.clone(), search, ..TunePlan::default() };
    match plan.execute(&Impatient) {
        Err(Error::Cancelled(left)) => assert_eq!(left, "nothing was written"),
        other => panic!("{other:?}"),
    }
    assert!(!out.exists());
    let tuned = plan.execute(&Silent).unwrap();
    assert!(out.exists() && tuned.is_virtual);
}
