"""Results of workflows: the JSON that the command line prints with --json, with typed attributes and a table in notebooks."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import pandas


def _wrapped(value: Any, kind: type[Results]) -> Any:
    if isinstance(value, dict):
        return kind(value)
    if isinstance(value, list):
        return [_wrapped(item, kind) for item in value]
    return value


class Results(Mapping[str, Any]):
    """What a workflow found. Keys are attributes, too: `results.mean_fitness` is `results["mean_fitness"]`.

    Those that a subclass names have a type; one that is named and not there is None. A notebook shows them as a table, with the
    figures of a report.

    >>> import tropism
    >>> results = tropism.Results({"plants": 2, "fitness": [1.5, 2.5]})
    >>> results.plants, results["fitness"]
    (2, [1.5, 2.5])
    >>> results.to_pandas()["fitness"].tolist()
    [1.5, 2.5]
    """

    #: The results of a workflow that are results themselves: the type of each.
    _kinds: ClassVar[Mapping[str, type[Results]]] = {}

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    @classmethod
    def of_json(cls, found: Any) -> Results:
        """The results that a workflow gave as JSON."""
        return cls(found)

    def __getitem__(self, key: str) -> Any:
        return _wrapped(self._values[key], self._kinds.get(key, Results))

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __getattr__(self, name: str) -> Any:
        if name not in self.__dict__.get("_values", {}) and name in type(self).__annotations__:
            return None
        if name.startswith("_") or name not in self._values:
            keys = ", ".join(self.__dict__.get("_values", {}))
            raise AttributeError(f"found no {name!r} in these results, wanted one of {keys}")
        return self[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({json.dumps(self._values, indent=2)})"

    def to_dict(self) -> dict[str, Any]:
        """The plain data."""
        return dict(self._values)

    def to_pandas(self, key: str | None = None) -> pandas.DataFrame:
        """A list of these results as a frame: that of `key`, or of the longest list."""
        import pandas

        lists = {name: value for name, value in self._values.items() if isinstance(value, list)}
        if key is None:
            key = max(lists, key=lambda name: len(lists[name]), default=None)
        if key is None or key not in lists:
            raise KeyError(
                f"found no list {key!r} in these results, wanted one of {', '.join(lists) or 'those with lists'}"
            )
        rows = [row if isinstance(row, dict) else {key: row} for row in lists[key]]
        return pandas.DataFrame(pandas.json_normalize(rows))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._values,)

    def figures(self) -> list[Path]:
        """The figures (SVG) beside a report, in order."""
        report = self._values.get("report")
        folder = self._values.get("_figures") or (Path(report).parent / "figures" if report else None)
        return sorted(Path(folder).glob("*.svg")) if folder else []

    def _repr_html_(self) -> str:
        rows = []
        for key, value in self._values.items():
            if key.startswith("_"):
                continue
            rows.append(f"<tr><th style='text-align:left'>{html.escape(key)}</th><td>{_cell(value)}</td></tr>")
        label = "<p><em>virtual plants</em></p>" if self._values.get("is_virtual") else ""
        figures = "".join(path.read_text(encoding="utf-8") for path in self.figures())
        return f"{label}<table>{''.join(rows)}</table>{figures}"


def _cell(value: Any) -> str:
    """A value in a table of a notebook: lists of settings as a table of their plain values."""
    if isinstance(value, list) and value and all(isinstance(row, dict) for row in value):
        names = [name for name, item in value[0].items() if not isinstance(item, (dict, list))]
        head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
        rows = ["".join(f"<td>{html.escape(_short(row.get(name)))}</td>" for name in names) for row in value[:20]]
        more = f"<tr><td>… {len(value) - 20} more</td></tr>" if len(value) > 20 else ""
        return f"<table><tr>{head}</tr>{''.join(f'<tr>{row}</tr>' for row in rows)}{more}</table>"
    return html.escape(_short(value))


def _short(value: Any) -> str:
    """A value in at most 300 letters; numbers with five digits."""
    if isinstance(value, float):
        return f"{value:.5g}"
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 300 else text[:300] + " …"


class Rows(Results):
    """Results with one entry a row, also where there is only one."""

    @classmethod
    def of_json(cls, found: Any) -> Results:
        return cls({"rows": found if isinstance(found, list) else [found]})


class GrowResults(Results):
    """Of `grow`."""

    is_virtual: bool
    plants: int
    out: str
    #: Fitness of each plant; None for a task without a goal.
    fitness: list[float] | None
    mean_fitness: float | None
    mean_final_height_cm: float
    #: File of each track.
    tracks: list[str]


class RunResults(Results):
    """Of `run`."""

    #: The run folder.
    run: str
    is_virtual: bool
    #: Number of the last step.
    steps: int
    missed: int
    carried_forward: int
    fitness: float | None
    #: File of the track.
    track: str


class CameraMotion(Results):
    """Movement of the camera over a series of photographs."""

    #: Photographs whose background is shifted against the first, and the first of them.
    moved: int
    first: str | None
    #: The largest shift.
    farthest_px: float
    #: Photographs in which no shift could be measured.
    unknown: int


class CalibrationResults(Results):
    """How pixels became centimetres."""

    #: The pixel where the stem leaves the soil: `x` to the right, `y` downwards.
    base: Mapping[str, float]
    px_per_cm: float
    #: Columns and rows of the pictures.
    width: int
    height: int
    #: None where marks determine the calibration exactly.
    residual_mm: float | None
    #: Distortion and homography; None for a camera without them.
    lens: Mapping[str, Any] | None


class TrackWarning(Results):
    """What speaks against a track."""

    #: never_moves, several_plants, few_measured, root_elsewhere, tip_at_edge, plants_touch, background_lost, scale_assumed,
    #: unrelated or times.
    kind: str
    #: What was found, and what to do.
    advice: str


class PlantTrack(Results):
    """The track of one plant."""

    schema: str
    #: File of the track.
    track: str
    #: Name of the plant; None if it is the only one.
    plant: str | None
    is_virtual: bool
    #: Photographs, those with a measured tip, and those whose tip is carried forward from an earlier one.
    frames: int
    measured: int
    carried_forward: int
    #: Photographs before the first measured tip; they have no row in the track.
    before: int
    #: Photographs by what they show, by the edge of the region that the plant reaches, and by the lamp that is lit.
    classes: Mapping[str, int]
    leaves_view_at: Mapping[str, int]
    lights: Mapping[str, int]
    #: Photographs in which another plant touches it.
    touched: int
    #: The most photographs in a row without a measured tip, and the longest time between two measured ones.
    longest_gap: int
    longest_gap_min: float
    camera: CameraMotion
    #: exif, name or even.
    time_from: str
    period_min: float
    missing_steps: int
    calibration: CalibrationResults
    #: Whether the scale is that of the paper's camera, because the plan gives none.
    calibration_is_assumed: bool
    #: Whether region and root were found by the plant's motion.
    is_located: bool
    #: Clicks of the plan: tip, node, root.
    clicks: Mapping[str, Any]
    #: The photograph in which a click on the tip would help most; None if all have a tip.
    next_click: str | None
    #: Whether the photographs were taken as unrelated.
    is_each: bool
    warnings: list[TrackWarning]
    photographs_sha256: str
    #: What is wrong with which file.
    problems: Mapping[str, str]
    #: What decides the detections.
    settings: Mapping[str, Any]
    settings_sha256: str
    _kinds = {"camera": CameraMotion, "calibration": CalibrationResults, "warnings": TrackWarning}


class _TrackList(Results):
    """Results with one entry a track, also where there is only one."""

    @classmethod
    def of_json(cls, found: Any) -> Results:
        return cls({"tracks": found if isinstance(found, list) else [found]})


class TrackResults(_TrackList):
    """Of `track`."""

    #: Of each plant that was detected.
    tracks: list[PlantTrack]
    _kinds = {"tracks": PlantTrack}


class Crossing(Results):
    """Where a tip first reached the height of a target."""

    step: int
    #: From the tip to the target.
    distance_cm: float


class TrackScore(Results):
    """The fitness of a track."""

    #: File of the track.
    track: str
    task: Mapping[str, Any]
    #: Where the task is from: plan, run or paper.
    task_from: str
    #: In cm, or round a pole in turns; and the best that there can be, None where it is not known.
    fitness: float
    best: float | None
    #: To the letter of eq. (9) and by approach; None for a task with another score.
    both_readings: list[float] | None
    steps: int
    #: None for a target whose height was not reached.
    targets: list[Crossing | None]
    #: Whether the whole task was done; None for a task that has a fitness alone.
    is_done: bool | None
    _kinds = {"targets": Crossing}


class ScoreResults(_TrackList):
    """Of `score`."""

    #: In the order of the plan.
    tracks: list[TrackScore]
    _kinds = {"tracks": TrackScore}


class FitResults(Results):
    """Of `fit`."""

    #: File of the model.
    model: str
    tracks: int
    is_virtual: bool
    shifts: int
    #: Whether their mirror images are among the data, too.
    is_mirrored: bool
    #: Least and greatest x and y of the tips.
    x_cm: list[float]
    y_cm: list[float]


class ForecastError(Results):
    """The error of forecasts at one horizon."""

    mean_cm: float
    interval_cm: list[float]
    sd_cm: float
    within_90: float | None


class ModelForecasts(Results):
    """How well a model predicts."""

    name: str
    replicates: int
    tip: list[ForecastError]
    #: None for a model of the tip.
    stem: list[ForecastError] | None
    _kinds = {"tip": ForecastError, "stem": ForecastError}


class LightForecasts(Results):
    """Forecasts under one kind of light."""

    light: str
    plants: int
    starts: int
    models: list[ModelForecasts]
    _kinds = {"models": ModelForecasts}


class ForecastResults(Results):
    """Of `forecast`."""

    is_virtual: bool
    truth: str
    in_space: bool
    horizons_min: list[float]
    lights: list[LightForecasts]
    _kinds = {"lights": LightForecasts}


class Scores(Results):
    """Fitness over plants, in cm."""

    mean: float
    sd: float
    plants: int


class EvolvedRun(Results):
    """One run of an evolution, and its champion."""

    seed: int
    best_fitness: float
    generations: int
    evaluations: int
    #: On unseen plants of the model.
    trial: Scores
    #: On models of single plants: its expected fitness on an unseen plant.
    transfer: Scores
    #: Whether the champion is what evolution started from, None where it is not.
    is_start: bool | None
    links: int
    without_data: float
    #: Why `transfer` is no expectation for unseen plants; None where it is one.
    withheld: str | None
    _kinds = {"trial": Scores, "transfer": Scores}


class EvolveResults(Results):
    """Of `evolve`."""

    runs: list[EvolvedRun]
    evaluations: int
    #: Number of the run with the champion.
    champion: int
    cpu_seconds: float
    wall_seconds: float
    _kinds = {"runs": EvolvedRun}


class RuleResults(Results):
    """The numbers of a predictive rule, which docs/reference/controllers.md describes."""

    look_ahead_cm: float
    overshoot: float
    next_target: float
    offset_cm: float
    velocity_steps: float
    shift_steps: float
    light_memory_cm: float
    lean: float
    persistence_cm: float
    #: Six more, of a rule that keeps clear of obstacles.
    avoidance: Mapping[str, float] | None


class TargetOutlook(Results):
    """How likely a target is to be passed."""

    #: The target, in cm.
    target: list[float]
    #: Distance when the tip reached its height, in cm; None while it is lower.
    passed_cm: float | None
    #: Probability that the tip passes within 1 cm.
    probability: float
    #: Its 95 % interval.
    interval: list[float] | None
    #: Median distance at which simulated plants pass it, in cm.
    expected_cm: float | None


class TuneResults(Results):
    """Of `tune`."""

    #: File of the rule.
    out: str
    is_virtual: bool
    rule: RuleResults
    in_model: Scores
    expected: Scores | None
    #: Why nothing is expected.
    withheld: str | None
    greedy: Scores
    #: The outlook for each target; empty where it is not known.
    outlook: list[TargetOutlook]
    cpu_seconds: float
    _kinds = {
        "rule": RuleResults,
        "in_model": Scores,
        "expected": Scores,
        "greedy": Scores,
        "outlook": TargetOutlook,
    }


class SimulateResults(Results):
    """Of `simulate`."""

    #: File of the track of the first plant.
    track: str
    episodes: int
    mean_fitness: float
    sd_fitness: float
    #: Means to the letter of eq. (9) and by approach; None for a task with another score.
    both_readings: list[float] | None
    #: The best that there can be; None where it is not known.
    best: float | None
    steps_without_data: float


class ShowResults(Results):
    """Of `show`: the properties of a network."""

    #: File of the genome.
    genome: str
    #: Without the bias.
    inputs: int
    outputs: int
    hidden: int
    links: int
    recurrent_links: int
    #: Hidden neurons and links from which a path leads to an output.
    live_hidden: int
    live_links: int
    is_linear: bool
    has_memory: bool
    #: Factors of x, y and 1 of a linear controller: the right lamp is lit where their sum is above 0.
    boundary: list[float] | None
    #: Of the plant whose path is drawn; None without a model.
    fitness: float | None
    is_virtual: bool | None
    #: File of the drawing.
    out: str | None


class Share(Results):
    """A share of plants, 0 to 1, and its 95 % interval."""

    share: float
    interval: list[float]


class TargetResults(Results):
    """How near the tips of all plants came to a target at its height."""

    #: x and y in cm; None if each plant had a target of its own, or a form is the target.
    target: list[float] | None
    #: Median and 90 % quantile; None if no plant reached its height.
    median_cm: float | None
    far_cm: float | None
    #: Plants that missed it, and those of them that never reached its height.
    missed: int
    never: int


class PairedDifference(Results):
    """Differences of fitness on the same plants, in cm."""

    mean: float
    #: 95 % interval of the mean.
    interval: list[float]
    #: Share of the plants on which the first is better, 0 to 1.
    share_above: float


class ControllerPair(Results):
    """Two controllers on the same plants."""

    one: str
    other: str
    #: Fitness of the first minus that of the second.
    difference: PairedDifference
    _kinds = {"difference": PairedDifference}


class SeenTurns(Results):
    """Turns of stems round a pole as the photographs say."""

    #: On each plant.
    fitness: list[float]
    mean: float
    #: Share of the plants with all turns that the task wants.
    done: Share | None
    _kinds = {"done": Share}


class ControllerResults(Results):
    """A controller on the plants of a comparison."""

    name: str
    description: str
    #: Distances at the targets, shares that pass them, and the difference from the first controller; None without targets.
    arrival: Mapping[str, Any] | None
    #: On each plant.
    fitness: list[float]
    mean: float
    #: 95 % interval of the mean.
    interval: list[float]
    sd: float
    quantiles: list[float]
    under_9: float
    under_6: float
    #: Fitness to the letter of eq. (9) and by approach, each with values, mean and interval; None for tasks with another score.
    both_readings: list[Mapping[str, Any]] | None
    expected: float | None
    share_of_expected: float | None
    share_of_reference: float | None
    share_of_optimum: float | None
    median_cm: float | None
    #: Share of the plants on which the whole task was done, for tasks that can be done.
    done: Share | None
    #: On each plant.
    is_done: list[bool] | None
    #: Of winding round a pole through photographs, where the turns of the true stem are judged; else None.
    by_photographs: SeenTurns | None
    targets: list[TargetResults]
    #: Plants by what is found in the steps before a target that they missed, and before one that they reached.
    missed: Mapping[str, int]
    reached: Mapping[str, int]
    _kinds = {"done": Share, "by_photographs": SeenTurns, "targets": TargetResults}


class TransferResults(Results):
    """Of `transfer`."""

    schema: str
    version: str
    is_virtual: bool
    species: str
    variation: float
    plants: int
    photographs: bool
    seed: int
    #: True where each plant has targets of its own.
    random_targets: bool | None
    #: None where it is not known.
    best_possible: float | None
    controllers: list[ControllerResults]
    #: Differences of each two controllers.
    pairs: list[ControllerPair]
    reference: str | None
    mean_optimum: float | None
    _kinds = {"controllers": ControllerResults, "pairs": ControllerPair}


class RealityNumbers(Results):
    """The fitness of a controller on unseen virtual plants, through photographs, in cm."""

    mean: float
    #: 95 % interval of the mean.
    interval: list[float]
    sd: float
    best: float
    worst: float
    plants: int


class ManyNumbers(Results):
    """The fitness of a controller on many unseen virtual plants, without photographs, in cm."""

    mean: float
    #: 95 % interval of the mean.
    interval: list[float]
    plants: int
    #: Share of plants that pass all targets within 1 cm; None in a task without targets.
    within_1_cm: Share | None
    _kinds = {"within_1_cm": Share}


class OpenLoopNumbers(Results):
    """How the tips of the open-loop experiments moved, between measured tips, in cm."""

    #: Greatest distance of a tip from the root in x.
    farthest_x: float
    highest_y: float
    #: Greatest change in a step.
    greatest_dx: float
    greatest_dy: float
    #: Mean change of x in a step, without sign: in the first 25 hours, until hour 66.7 and later; 0 where there is no step.
    mean_dx: list[float]


class StudyResults(Results):
    """Of `study`. Fitness is in cm."""

    seed: int
    is_virtual: bool
    best_possible: float
    #: Of a single evaluation in all runs.
    best_evolved: float
    champion_mean_in_model: float
    champion_expected_in_reality: float
    #: None without generations.
    saturation_generation: int | None
    #: The median of all runs' best in the last generation.
    median_at_end: float
    #: Of a single evaluation.
    best_random: float
    median_random: float
    random_mean_in_model: float
    periodic_mean_in_model: float
    greedy_mean_in_model: float
    reality_champion: RealityNumbers
    reality_greedy: RealityNumbers
    reality_rule: RealityNumbers
    many_champion: ManyNumbers
    many_random: ManyNumbers
    many_periodic: ManyNumbers
    many_greedy: ManyNumbers
    many_rule: ManyNumbers
    many_champion_over_greedy: PairedDifference
    #: The champion's mean on unseen plants, as a share of its mean in the model, and of the best single evaluation.
    share_kept: float
    share_kept_of_best: float
    #: Mean duration of the champion's experiments.
    hours_to_end: float
    open_loop: OpenLoopNumbers
    #: File of the report.
    report: str
    _kinds = {
        "open_loop": OpenLoopNumbers,
        "reality_champion": RealityNumbers,
        "reality_greedy": RealityNumbers,
        "reality_rule": RealityNumbers,
        "many_champion": ManyNumbers,
        "many_random": ManyNumbers,
        "many_periodic": ManyNumbers,
        "many_greedy": ManyNumbers,
        "many_rule": ManyNumbers,
        "many_champion_over_greedy": PairedDifference,
    }


class SamplePair(Results):
    """Two samples compared by a Mann-Whitney U test."""

    #: Scenario and method, of replicates in a sweep.
    case: str | None
    one: str
    other: str
    #: Number of values of each.
    sizes: list[int]
    #: Median of the first minus that of the second.
    median_difference: float
    u: float
    p: float
    is_exact: bool
    #: After Holm's correction for all pairs.
    p_holm: float
    #: Vargha and Delaney's A.
    superiority: float


class SweepRow(Results):
    """A setting of a sweep."""

    setting: str
    #: The scenario and the method, of replicates.
    case: str | None
    seeds: int
    runs: int
    mean: float
    sd: float
    five_numbers: list[float]
    mean_in_model: float | None
    saturation_generation: float | None
    evaluations: float | None
    #: Mean sum of the distances at all targets in cm, and share of plants on which the whole task was done, of replicates.
    distances: float | None
    done: float | None
    cpu_seconds: float | None


class UnitCost(Results):
    """What a unit of a long work on Ray cost, and where it worked."""

    number: int
    host: str
    process: int
    wall_seconds: float
    cpu_seconds: float


class SweepResults(Results):
    """Of `sweep`."""

    schema: str
    version: str
    is_virtual: bool
    seeds: list[int]
    rows: list[SweepRow]
    #: Each two settings.
    pairs: list[SamplePair]
    #: With the engine ray.
    units: list[UnitCost] | None
    _kinds = {"rows": SweepRow, "pairs": SamplePair, "units": UnitCost}


class LeftOutFigure(Results):
    """A figure for which there are no data."""

    #: Its number.
    figure: str
    #: Why it is left out, and what it needs.
    reason: str


class ReportComparison(Results):
    """Things of one kind, compared pair by pair."""

    title: str
    #: Unit of the values: cm, turns, or both where tasks differ.
    unit: str
    pairs: list[SamplePair]
    _kinds = {"pairs": SamplePair}


class ReportResults(Results):
    """Of `report`. `figures()` are the files of its figures, `results["figures"]` their numbers."""

    #: File of the report.
    report: str
    left_out: list[LeftOutFigure]
    #: Of several sources of one kind.
    comparisons: list[ReportComparison] | None
    _kinds = {"left_out": LeftOutFigure, "comparisons": ReportComparison}
