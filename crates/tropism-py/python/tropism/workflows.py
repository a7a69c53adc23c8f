"""Workflows: a plan goes in, results come out.

Each workflow is a function of keyword arguments, and a dataclass of the same keys: `tropism.evolve(model="model.json")` is
`tropism.execute(EvolvePlan(model="model.json"))`. What is left out is the paper's. Nested settings, such as
`evolution={"runs": 4}`, have the keys of the files that docs/reference/files.md describes; unknown keys are refused by name.

Every function takes, beside the keys of its plan, `monitor` (a `Monitor`, or False for none; by default progress is shown if
tqdm is installed) and `threads` (by default one a core). The interpreter's lock is released. Ctrl-C ends a workflow within
a tenth of a second, saves what was done, and raises `Interrupted`, a KeyboardInterrupt; `resume=True` goes on to the same
results.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Generic, Literal, ParamSpec, TypeAlias, TypeVar, cast, overload

from tropism import _core
from tropism.monitor import Monitor, Progress
from tropism.results import (
    EvolveResults,
    FitResults,
    ForecastResults,
    GrowResults,
    ReportResults,
    Results,
    RunResults,
    ScoreResults,
    ShowResults,
    SimulateResults,
    StudyResults,
    SweepResults,
    TrackResults,
    TransferResults,
    TuneResults,
)

PathLike: TypeAlias = "str | os.PathLike[str]"
Settings: TypeAlias = Mapping[str, Any]
#: A controller as data: {"kind": "greedy"}, {"kind": "periodic", "minutes": 360}, or what `controller_of` reads.
ControllerSpec: TypeAlias = Mapping[str, Any]
_P = ParamSpec("_P")
_R = TypeVar("_R", reference=Results)


def _plain(value: Any) -> Any:
    """`value` as JSON knows it."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, range):
        return list(value)
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return value.tolist()
    return value


@dataclass(frozen=True, kw_only=True)
class Plan(Generic[_R]):
    """A plan of a workflow. Keys that are None are the workflow's own defaults, which `complete` shows.

    `monitor` and `threads` change no result and are no part of the plan's JSON.
    """

    workflow: ClassVar[str] = ""
    #: The type of its results.
    results: ClassVar[type[Results]] = Results
    monitor: Monitor | Literal[False] | None = field(default=None, repr=False, compare=False)
    threads: int | None = field(default=None, repr=False, compare=False)

    def to_dict(self) -> dict[str, Any]:
        """The keys that are set, as JSON knows them."""
        names = [field.name for field in fields(self) if field.name not in ("monitor", "threads")]
        values = {name: getattr(self, name) for name in names}
        return {key: _plain(value) for key, value in values.items() if value is not None}

    def to_json(self) -> str:
        """The plan as JSON: what a page and the command line exchange."""
        return json.dumps(self.to_dict())

    def complete(self) -> dict[str, Any]:
        """All keys with their values, defaults included.

        Raises PlanError if a key is unknown or a value has the wrong type.
        """
        complete: dict[str, Any] = json.loads(_core.complete_plan(self.workflow, self.to_json()))
        return complete

    def check(self) -> None:
        """Raises PlanError, which names the key, if the plan cannot be executed."""
        _core.check_plan(self.workflow, self.to_json())


@dataclass(frozen=True, kw_only=True)
class GrowPlan(Plan[GrowResults]):
    """Grows virtual beans: tracks, or photographs with their ground truth."""

    workflow: ClassVar[str] = "grow"
    results = GrowResults
    plants: int | None = None
    controller: ControllerSpec | None = None
    task: Settings | None = None
    greenhouse: Settings | None = None
    period_min: float | None = None
    seed: int | None = None
    out: PathLike | None = None
    photographs: bool | None = None
    replace: bool | None = None
    resume: bool | None = None


@dataclass(frozen=True, kw_only=True)
class RunPlan(Plan[RunResults]):
    """An experiment in a real or virtual tent, recorded in a run folder. `config` has the keys of `run.toml`."""

    workflow: ClassVar[str] = "run"
    results = RunResults
    out: PathLike | None = None
    resume: bool | None = None
    speed: float | None = None
    config: Settings | None = None


@dataclass(frozen=True, kw_only=True)
class TrackPlan(Plan[TrackResults]):
    """Tracks of photographs of plants."""

    workflow: ClassVar[str] = "track"
    results = TrackResults
    photographs: Sequence[PathLike] | None = None
    out: PathLike | None = None
    scale: Any = None
    plants: Sequence[Settings] | None = None
    light: Any = None
    time: Any = None
    period_min: float | None = None
    default_period_min: float | None = None
    vision: Settings | None = None
    find_up: bool | None = None
    each: bool | None = None
    overlay: PathLike | None = None
    sheet: PathLike | None = None
    resume: bool | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True)
class FitPlan(Plan[FitResults]):
    """A model of tracks: `kind` is tip, stem or space."""

    workflow: ClassVar[str] = "fit"
    results = FitResults
    tracks: Sequence[PathLike] | None = None
    kind: Literal["tip", "stem", "space"] | None = None
    model: Settings | None = None
    anyway: bool | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True)
class ForecastPlan(Plan[ForecastResults]):
    """Compares models by their forecasts of plants of which none was made; without `tracks`, of virtual beans."""

    workflow: ClassVar[str] = "forecast"
    results = ForecastResults
    models: Sequence[PathLike] | None = None
    tracks: Sequence[PathLike] | None = None
    plants: int | None = None
    horizons_min: Sequence[float] | None = None
    interval_min: float | None = None
    greenhouse: Settings | None = None
    seed: int | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True)
class EvolvePlan(Plan[EvolveResults]):
    """Evolves controllers on a model."""

    workflow: ClassVar[str] = "evolve"
    results = EvolveResults
    model: PathLike | None = None
    out: PathLike | None = None
    task: Settings | None = None
    evolution: Settings | None = None
    trial_plants: int | None = None
    seed: int | None = None
    resume: bool | None = None
    checkpoint_s: int | None = None


@dataclass(frozen=True, kw_only=True)
class TunePlan(Plan[TuneResults]):
    """Tunes a rule with nine parameters on a model."""

    workflow: ClassVar[str] = "tune"
    results = TuneResults
    model: PathLike | None = None
    beans: Settings | None = None
    period_min: float | None = None
    task: Settings | None = None
    search: Settings | None = None
    seed: int | None = None
    out: PathLike | None = None
    replace: bool | None = None
    resume: bool | None = None


@dataclass(frozen=True, kw_only=True)
class SimulatePlan(Plan[SimulateResults]):
    """Steers simulated plants of a model."""

    workflow: ClassVar[str] = "simulate"
    results = SimulateResults
    model: PathLike | None = None
    controller: ControllerSpec | None = None
    task: Settings | None = None
    episodes: int | None = None
    seed: int | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True)
class ScorePlan(Plan[ScoreResults]):
    """The fitness of tracks, eq. (9)."""

    workflow: ClassVar[str] = "score"
    results = ScoreResults
    tracks: Sequence[PathLike] | None = None
    task: Settings | None = None


@dataclass(frozen=True, kw_only=True)
class ShowPlan(Plan[ShowResults]):
    """A network and its decisions."""

    workflow: ClassVar[str] = "show"
    results = ShowResults
    source: PathLike | None = None
    out: PathLike | None = None
    format: str | None = None
    model: PathLike | None = None
    task: Settings | None = None


@dataclass(frozen=True, kw_only=True)
class TransferPlan(Plan[TransferResults]):
    """Compares controllers on the same unseen virtual plants."""

    workflow: ClassVar[str] = "transfer"
    results = TransferResults
    controllers: Sequence[Settings] | None = None
    plants: int | None = None
    plant_seeds: Settings | None = None
    task: Settings | None = None
    random_targets: bool | None = None
    greenhouse: Settings | None = None
    period_min: float | None = None
    photographs: bool | None = None
    model: PathLike | None = None
    optimum: bool | None = None
    reference: str | None = None
    seed: int | None = None
    resume: bool | None = None
    out: PathLike | None = None


@dataclass(frozen=True, kw_only=True)
class StudyPlan(Plan[StudyResults]):
    """The whole paper on virtual beans. `config` has the keys of `studies/paper.toml`; `quick_study` is a small one."""

    workflow: ClassVar[str] = "study"
    results = StudyResults
    out: PathLike | None = None
    resume: bool | None = None
    keep_photographs: bool | None = None
    config: Settings | None = None


@dataclass(frozen=True, kw_only=True)
class SweepPlan(Plan[SweepResults]):
    """Seeds times settings of evolutions or of studies of replicates. `config` has the keys of `studies/sweep.toml`."""

    workflow: ClassVar[str] = "sweep"
    results = SweepResults
    out: PathLike | None = None
    resume: bool | None = None
    folder: PathLike | None = None
    config: Settings | None = None


@dataclass(frozen=True, kw_only=True)
class ReportPlan(Plan[ReportResults]):
    """A page of figures, and with `figures` each as a file."""

    workflow: ClassVar[str] = "report"
    results = ReportResults
    sources: Sequence[PathLike] | None = None
    out: PathLike | None = None
    figures: PathLike | None = None


#: The plan of each workflow.
PLANS: dict[str, type[Plan[Any]]] = {plan.workflow: plan for plan in Plan.__subclasses__()}


def execute(plan: Plan[_R]) -> _R:
    """Executes a plan.

    Raises PlanError if the plan cannot be executed, TropismError if it fails, Paused if a run needs its user, and Interrupted
    after Ctrl-C.
    """
    monitor = plan.monitor
    progress = Progress() if monitor is None else None
    listener = progress if progress is not None else monitor or None
    try:
        text = _core.execute_workflow(plan.workflow, plan.to_json(), listener, plan.threads)
    finally:
        if progress is not None:
            progress.close()
    results = plan.results.of_json(json.loads(text))
    if isinstance(plan, ReportPlan) and plan.figures is not None:
        results = plan.results({**results.to_dict(), "_figures": os.fspath(plan.figures)})
    return cast(_R, results)


def _function(plan: Callable[_P, Plan[_R]]) -> Callable[_P, _R]:
    """The function of a workflow: it takes the keys of the plan."""

    def call(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        return execute(plan(*args, **kwargs))

    call.__name__ = call.__qualname__ = cast(type[Plan[_R]], plan).workflow
    call.__doc__ = plan.__doc__
    call.__wrapped__ = plan  # type: ignore[attr-defined]
    return call


grow = _function(GrowPlan)
run = _function(RunPlan)
track = _function(TrackPlan)
fit = _function(FitPlan)
forecast = _function(ForecastPlan)
evolve = _function(EvolvePlan)
tune = _function(TunePlan)
simulate = _function(SimulatePlan)
score = _function(ScorePlan)
show = _function(ShowPlan)
transfer = _function(TransferPlan)
study = _function(StudyPlan)
report = _function(ReportPlan)


@overload
def resume(
    folder: PathLike,
    workflow: Literal["run"],
    *,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> RunResults: ...


@overload
def resume(
    folder: PathLike,
    workflow: Literal["study"],
    *,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> StudyResults: ...


@overload
def resume(
    folder: PathLike,
    workflow: Literal["sweep"],
    *,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> SweepResults: ...


def resume(
    folder: PathLike,
    workflow: Literal["run", "study", "sweep"],
    *,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> Results:
    """Goes on with the run, study or sweep in `folder`, from this folder alone."""
    plan: Plan[Any] = PLANS[workflow](**json.loads(_core.plan_of_folder(workflow, folder)))
    results: Results = execute(replace(plan, monitor=monitor, threads=threads))
    return results


def quick_study() -> dict[str, Any]:
    """The settings of a study of about a minute: `tropism.study(config=tropism.quick_study())`."""
    config: dict[str, Any] = json.loads(_core.quick_study())
    return config


def controller_of(path: PathLike) -> dict[str, Any]:
    """The controller in a champion or rule file, as data for the `controller` of a plan."""
    spec: dict[str, Any] = json.loads(_core.read_controller(path))
    return spec
