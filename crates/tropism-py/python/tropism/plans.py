"""The plan and the function of each workflow. Written by scripts/python-workflows from the Rust sources: do not edit."""

# ruff: noqa: E501

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from tropism.edge import AnyController, AnyModel, AnyNetwork, AnySettings, AnyTask, AnyTrack, PathLike, Settings
from tropism.monitor import Monitor
from tropism.plan import Plan, execute
from tropism.results import (
    EvolveResults,
    FitResults,
    ForecastResults,
    GrowResults,
    ReportResults,
    Results,
    Rows,
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

__all__ = [
    "AcceptancePlan",
    "AcceptanceResults",
    "AcceptanceRow",
    "BaselinePlan",
    "BaselineResults",
    "CalibrateCameraPlan",
    "CalibrateCameraResults",
    "CalibratePlan",
    "CalibrateResults",
    "Calibration",
    "CheckPlan",
    "CheckResults",
    "Comparison",
    "CountedShare",
    "DepthPlan",
    "DepthResults",
    "DeviceResult",
    "Estimate",
    "EvolvePlan",
    "EvolvedRule",
    "ExportPlan",
    "ExportResults",
    "Finding",
    "FitPlan",
    "ForecastPlan",
    "FrameCounts",
    "GroupComparison",
    "GroupConstants",
    "GrowPlan",
    "GuidePlan",
    "GuideResults",
    "KinematicsPlan",
    "KinematicsResults",
    "LeftOut",
    "Lens",
    "MakeRigPlan",
    "MakeRigResults",
    "MeanAndInterval",
    "MeasurePlan",
    "MeasureResults",
    "MeasuredQuantity",
    "Measures",
    "MethodResults",
    "NodeRuleResults",
    "NodeScore",
    "NotePlan",
    "NoteResults",
    "ParameterEstimate",
    "ParameterRecovery",
    "PlantConstants",
    "PlantEstimates",
    "PlantOnWall",
    "Recovery",
    "RecoveryPlan",
    "RecoveryResults",
    "ReplicateResults",
    "ReplicatesPlan",
    "ReplicatesResults",
    "ReportPlan",
    "RunPlan",
    "SafeStatePlan",
    "SafeStateResults",
    "ScenarioResults",
    "ScorePlan",
    "Sharpening",
    "ShowPlan",
    "SimulatePlan",
    "StatusPlan",
    "StatusResults",
    "StopPlan",
    "StopResults",
    "StudyPlan",
    "SweepPlan",
    "TimelapsePlan",
    "TimelapseResults",
    "TrackPlan",
    "TransferPlan",
    "TunePlan",
    "WallPlan",
    "WallResults",
    "WallScenarioResults",
    "WallStudyPlan",
    "WallStudyResults",
    "acceptance",
    "baseline",
    "calibrate",
    "calibrate_camera",
    "check",
    "depth",
    "evolve",
    "export",
    "fit",
    "forecast",
    "grow",
    "guide",
    "kinematics",
    "make_rig",
    "measure",
    "note",
    "recovery",
    "replicates",
    "report",
    "run",
    "safe_state",
    "score",
    "show",
    "simulate",
    "status",
    "stop",
    "study",
    "timelapse",
    "track",
    "transfer",
    "tune",
    "wall",
    "wall_study",
]


class AcceptanceRow(Results):
    """A statistic with its accepted range."""

    #: Number of the statistic in `docs/validation/bean-statistics.md`; some have several rows.
    number: int
    #: What was measured, with its unit.
    statistic: str
    #: The value.
    value: float
    #: The least accepted value.
    least: float
    #: The greatest accepted value; `None` without an upper limit.
    most: float | None
    #: Whether the value lies in the range.
    holds: bool


class AcceptanceResults(Rows):
    """Of `acceptance`: a row each."""

    rows: list[AcceptanceRow]
    _kinds = {"rows": AcceptanceRow}


class BaselineResults(Results):
    """The fitness of random controllers: the content of `baseline.json`."""

    #: Number of controllers.
    count: int
    #: Best fitness, in cm.
    best: float
    #: Median fitness, in cm.
    median: float


class ParameterEstimate(Results):
    """The estimate of one parameter."""

    #: Key of the bean file.
    key: str
    #: The estimate, in the unit of `PARAMETERS`.
    value: float
    #: Lower end of the 90 % interval.
    low: float
    #: Upper end of the 90 % interval.
    high: float
    #: Share of the estimate that is the species' own and not the track's, 0 to 1.
    prior_share: float


class PlantEstimates(Results):
    """The estimates of one plant."""

    #: Its track file.
    track: str
    #: Distance of the fitted plant's tip to the track's, root mean square, in cm.
    rms_cm: float
    #: One estimate a parameter, in the order of `PARAMETERS`.
    estimates: list[ParameterEstimate]
    _kinds = {"estimates": ParameterEstimate}


class CalibrateResults(Rows):
    """Of `calibrate`: a row each."""

    rows: list[PlantEstimates]
    _kinds = {"rows": PlantEstimates}


class Lens(Results):
    """Map from a picture to the plane of the stem.

    Its origin is anywhere in the plane; `Calibration` moves it to the root.  `Calibration`:
    crate::vision::Calibration
    """

    #: Distortion k of the division model, for radii in halves of the picture's diagonal: negative for barrel
    #: distortion, 0 for none, above -1 and below 1.
    distortion: float
    #: Homography by rows: from undistorted points, in halves of the diagonal from the picture's centre with y down, to
    #: cm in the plane with y up.
    homography: list[list[float]]


class Calibration(Results):
    """Map from the pictures of one camera to the plane of the stem, in cm ("stored in cm and scaled to the
    dimensions of the experiment setup", section 2.2.2).

     It is one scale for the whole picture, or a `Lens` that was fitted to a checkerboard.  ``` use
    tropism::geometry::{Pixel, Point}; use tropism::vision::Calibration; let calibration =
    Calibration::from_scale(Pixel::new(320.0, 400.0), 10.0, 640, 480);
    assert_eq!(calibration.point(Pixel::new(340.0, 370.0)), Point::new(2.0, 3.0)); ```
    """

    #: The root: the pixel where the stem leaves the soil, which is (0, 0) cm.
    base: Any
    #: Scale in the plane of the stem, in pixels per cm; with a lens, around the root.
    px_per_cm: float
    #: Columns of the calibrated pictures.
    width: int
    #: Rows of the calibrated pictures.
    height: int
    #: Root mean square residual of the marks or corners that it was fitted to, in mm; `None` where they determine it
    #: exactly.
    residual_mm: float | None
    #: Lens distortion and perspective; a camera without either if it is left out.
    lens: Lens | None
    _kinds = {"lens": Lens}


class CalibrateCameraResults(Results):
    """A calibration, and how well it agrees with what it was made from."""

    #: The file of the calibration.
    out: str
    #: The calibration.
    calibration: Calibration
    #: Root mean square distance of the corners from where the lens projects them, in pixels; with a checkerboard only.
    residual_px: float | None
    #: Inner corners found; with a checkerboard only.
    corners: int | None
    _kinds = {"calibration": Calibration}


class Finding(Results):
    """One finding."""

    #: What it is about.
    group: Literal["settings", "system", "camera", "flash", "lamps", "plant", "broker", "alerts", "rehearsal"]
    #: How bad it is.
    verdict: Literal["pass", "warn", "fail"]
    #: What was found.
    found: str
    #: What to do about it; `None` for a pass.
    remedy: str | None


class CheckResults(Results):
    """What a check found."""

    #: Rig file.
    rig: str
    #: Whether the tent is virtual.
    is_virtual: bool
    #: Version of tropism.
    version: str
    #: Whether nothing was switched, photographed or sent.
    is_dry: bool
    #: How many warn.
    warn: int
    #: How many fail.
    fail: int
    #: All findings, in the order in which they were made.
    findings: list[Finding]
    _kinds = {"findings": Finding}


class DepthResults(Results):
    """A track in space, in numbers: the JSON file beside it."""

    #: The file of the track.
    track: str
    #: Whether the plant is virtual.
    is_virtual: bool
    #: Steps with a tip in space.
    steps: int
    #: Steps with a whole stem in space, from the base to an apex that both cameras see.
    stems: int
    #: Distance between the two rays to the tip: median and maximum, in cm.
    tip_gap_cm: list[float]


class LeftOut(Results):
    """A photograph that was left out."""

    #: Where it would be in the export.
    path: str
    #: What is wrong with it.
    problem: str


class ExportResults(Results):
    """What was exported."""

    #: Archive or folder.
    out: str
    #: Whether the plant is virtual.
    is_virtual: bool
    #: Whether the run is over.
    is_over: bool
    #: Recorded steps.
    steps: int
    #: Files of the export.
    files: int
    #: Their size.
    bytes: int
    #: Photographs that were left out.
    left_out: list[LeftOut]
    _kinds = {"left_out": LeftOut}


class MakeRigResults(Results):
    """A rig file that was written."""

    #: The rig file.
    out: str
    #: Its text.
    text: str


class FrameCounts(Results):
    """Frames of a record, and those left out by the quality gate."""

    #: Frames of the track.
    all: int
    #: Frames without a measured stem.
    without_stem: int
    #: Frames whose length jumps off the line of growth.
    length_jumps: int
    #: Frames that the fit uses, after thinning.
    used: int


class Estimate(Results):
    """A constant of a plant."""

    #: Symbol of the literature, such as `Lc`.
    symbol: str
    #: Value; also of what is not identified, where it says nothing.
    value: float
    #: 90 % interval.
    interval: list[float]
    #: What can be said of it.
    status: Any
    #: Why it is not measured; empty if it is.
    reason: str


class PlantConstants(Results):
    """The constants of one plant."""

    #: Name: the file without its extension.
    name: str
    #: Group; empty without one.
    group: str
    #: Frames, and those left out.
    frames: FrameCounts
    #: Length of the record, in h.
    duration_h: float
    #: Twice the logarithm of the ratio of likelihoods with and without a response. `None` where only angles are known.
    response: float | None
    #: Whether the record shows a response.
    responds: bool
    #: Noise of the points across the stem, in cm.
    noise_cm: float | None
    #: Root mean square distance of the stems from the rod, across: with and without the plant's own forcing, in cm.
    rms_cm: list[float] | None
    #: The constants.
    estimates: list[Estimate]
    _kinds = {"frames": FrameCounts, "estimates": Estimate}


class GroupConstants(Results):
    """The constants of a group."""

    #: Name; empty for plants without a group.
    name: str
    #: Number of plants.
    plants: int
    #: Means with t intervals over plants.
    estimates: list[Estimate]
    _kinds = {"estimates": Estimate}


class Comparison(Results):
    """Two groups compared."""

    #: Mean of the first less that of the second.
    difference: float
    #: Probability that a plant of the first group is above one of the second (a tie counts half).
    auc: float
    #: Two-sided p value by permutation of plants.
    p: float
    #: Whether all permutations were tried.
    is_exact: bool


class GroupComparison(Results):
    """A constant of two groups compared."""

    #: Symbol.
    symbol: str
    #: Names of the groups.
    groups: list[str]
    #: Numbers of plants of which it is measured.
    plants: list[int]
    #: Geometric mean of the first over that of the second; `None` where a value is not positive.
    ratio: float | None
    #: The permutation test: of the means of logarithms where there is a ratio, else of the means.
    test: Comparison
    _kinds = {"test": Comparison}


class Recovery(Results):
    """What the same experiment recovers of a constant."""

    #: Symbol.
    symbol: str
    #: Virtual plants of which it was measured.
    measured: int
    #: Virtual plants.
    plants: int
    #: Median of recovered over true values; NaN without any.
    ratio: float
    #: Half the range of the middle two thirds of recovered over true values.
    spread: float
    #: Share of the 90 % intervals that hold the true value.
    coverage: float
    #: Factor by which the intervals of logarithms must be wider to hold it in 90 %; at least 1, and 1 for fewer than
    #: ten plants.
    widening: float


class Sharpening(Results):
    """What a change of the experiment would do to the intervals of a constant."""

    #: The change.
    change: Any
    #: Symbol.
    symbol: str
    #: Median width of the interval of the logarithm, as a multiple of that of the present experiment.
    width: float


class MeasureResults(Results):
    """The constants of plants."""

    #: Whether the plants are virtual.
    is_virtual: bool
    #: The equation that the numbers are of.
    equation: str
    #: The plants, group by group.
    plants: list[PlantConstants]
    #: The groups; one without a name for plants without a group.
    groups: list[GroupConstants]
    #: Each pair of groups, each constant.
    comparisons: list[GroupComparison]
    #: What the same experiment recovers of virtual plants with these constants.
    self_check: list[Recovery]
    #: What changes of the experiment would do to the intervals, on such virtual plants.
    sharpenings: list[Sharpening]
    #: Tracks that could not be measured, and why.
    left_out: list[str]
    _kinds = {
        "plants": PlantConstants,
        "groups": GroupConstants,
        "comparisons": GroupComparison,
        "self_check": Recovery,
        "sharpenings": Sharpening,
    }


class GuideResults(Results):
    """A guide, and the photographs on it."""

    #: The file of the page.
    guide: str
    #: Names of the photographs on the page.
    shown: list[str]


class MeasuredQuantity(Results):
    """A quantity of the virtual plant beside its published value."""

    #: What was measured, with its unit.
    quantity: str
    #: The value of the virtual plant.
    value: float
    #: The published value of living plants, with its source.
    published: str


class KinematicsResults(Results):
    """The figures of a `KinematicsPlan`, and what was measured in them."""

    #: Always true.
    is_virtual: bool
    #: Measured quantities.
    measured: list[MeasuredQuantity]
    _kinds = {"measured": MeasuredQuantity}


class NoteResults(Results):
    """A note that was left."""

    #: Run folder.
    run: str
    #: Step that it stands at; `None` while the run has not written it down.
    step: int | None
    #: Number of the process of the run, which writes it down within seconds; `None` where it stands in the journal.
    process: int | None


class ParameterRecovery(Results):
    """How well one parameter is recovered, over all virtual plants."""

    #: Key of the bean file.
    key: str
    #: Mean error, as a share of the true value.
    bias: float
    #: Root mean square error, as a share of the true value.
    error: float
    #: Root mean square error of the species' typical value, as a share of the true value: the error without any track.
    error_of_typical: float
    #: Share of the 90 % intervals that contain the true value.
    coverage: float


class RecoveryResults(Rows):
    """Of `recovery`: a row each."""

    rows: list[ParameterRecovery]
    _kinds = {"rows": ParameterRecovery}


class MeanAndInterval(Results):
    """A mean with its 95 % interval, by bootstrap over replicates and plants."""

    #: Mean.
    mean: float
    #: Ends of the interval.
    interval: list[float]


class Measures(Results):
    """What controllers are compared by: means over replicates and plants, or their differences from other
    controllers, replicate by replicate and plant by plant.
    """

    #: Fitness by the task's own score.
    fitness: MeanAndInterval
    #: Fitness by eq. (9) to the letter, in cm; `None` for a task with another score.
    to_the_letter: MeanAndInterval | None
    #: Fitness by eq. (9) by approach, in cm; `None` for a task with another score.
    by_approach: MeanAndInterval | None
    #: Sum of the distances at the crossings of all targets, in cm, 10 for one whose height was never reached; `None`
    #: without targets.
    distances: MeanAndInterval | None
    #: Share of plants on which the whole task was done, where it says what that is: with the paper's targets, that the
    #: tip passes all of them within 1 cm.
    done: MeanAndInterval | None
    _kinds = {
        "fitness": MeanAndInterval,
        "to_the_letter": MeanAndInterval,
        "by_approach": MeanAndInterval,
        "distances": MeanAndInterval,
        "done": MeanAndInterval,
    }


class ReplicateResults(Results):
    """The controller of one replicate."""

    #: Fitness that the replicate predicted.
    expected: float | None


class MethodResults(Results):
    """A method in one scenario."""

    #: Its name.
    name: str
    #: Less those of the greedy controller on the same plants.
    over_greedy: Measures
    #: Less those of the reference controller on the same plants.
    over_reference: Measures | None
    #: Less those of the first method of the same replicate on the same plants; `None` for the first.
    over_first: Measures | None
    #: Median distance at the crossing of each target's height, in cm, as a mean over replicates; `None` if no plant of
    #: one reached it.
    target_medians_cm: list[float | None]
    #: Fitness minus what the replicate predicted, as a mean over replicates; `None` where none is predicted.
    over_expected: float | None
    #: The greatest error of a prediction.
    worst_prediction: float | None
    #: Processor time of a replicate after its tracks, in s, as a mean.
    cpu_seconds: float
    #: One entry a replicate.
    replicates: list[ReplicateResults]
    _kinds = {
        "over_greedy": Measures,
        "over_reference": Measures,
        "over_first": Measures,
        "replicates": ReplicateResults,
    }


class ScenarioResults(Results):
    """All controllers of one scenario."""

    #: Its name.
    name: str
    #: Species of the plants.
    species: str
    #: Individual variation of the plants as a multiple of that of the species.
    variation: float
    #: Its task in a few words.
    task: str
    #: Plants that judge the controllers.
    test_plants: int
    #: Whether the judged tip is measured in photographs.
    photographs: bool
    #: Greatest possible fitness.
    best_possible: float | None
    #: The dormant control: the left lamp stays lit.
    constant: BaselineResults
    #: The greedy rule.
    greedy: BaselineResults
    #: The rule that was tuned on virtual plants themselves.
    reference: BaselineResults | None
    #: One entry a method; none where the rules by hand alone are judged.
    methods: list[MethodResults]
    _kinds = {
        "constant": BaselineResults,
        "greedy": BaselineResults,
        "reference": BaselineResults,
        "methods": MethodResults,
    }


class ReplicatesResults(Results):
    """The comparison of methods.

    Fitness is in cm; in turns where a stem is to wind round a pole.
    """

    #: `tropism.replicates/1`.
    schema: str
    #: Version of the software.
    version: str
    #: Always true.
    is_virtual: bool
    #: Number of replicates; 0 where the study has no methods.
    replicates: int
    #: Plants that judge the controllers of a scenario which names no other number.
    test_plants: int
    #: One entry a scenario.
    scenarios: list[ScenarioResults]
    _kinds = {"scenarios": ScenarioResults}


class DeviceResult(Results):
    """What one device answered."""

    #: `flash`, `lamps`, or a lamp by its name, such as `left lamp`.
    device: str
    #: Whether it confirmed that it is off.
    is_off: bool
    #: Why it is not known to be off.
    problem: str | None


class SafeStateResults(Results):
    """What was switched off."""

    #: Rig file or run folder.
    rig: str
    #: Whether the tent is virtual: then nothing is lit.
    is_virtual: bool
    #: Whether the lamps were left as they are.
    is_kept: bool
    #: Each device that was printed.
    devices: list[DeviceResult]
    _kinds = {"devices": DeviceResult}


class StatusResults(Results):
    """What the work in a folder does now."""


class StopResults(Results):
    """What was ended."""

    #: The folder.
    folder: str
    #: Number of the process that worked in it.
    process: int | None
    #: Whether a process worked in it.
    was_running: bool
    #: Seconds until the process had ended.
    seconds: float


class TimelapseResults(Results):
    """What was made."""

    #: The film; `None` if only the composite was made.
    film: str | None
    #: The composite.
    composite: str
    #: Photographs of the run.
    photographs: int
    #: Pictures of the film.
    pictures: int
    #: Photographs that cannot be read, or are of another size than the first.
    left_out: int
    #: Width in pixels.
    width: int
    #: Height in pixels.
    height: int
    #: Whether the plant is virtual; `None` if it is not known.
    is_virtual: bool | None


class CountedShare(Results):
    """A count out of a number, with its interval."""

    #: How many.
    count: int
    #: Out of how many.
    of: int
    #: The share, 0 to 1; 0 of none.
    share: float
    #: Its 95 % interval (Wilson). Decisions of one plant depend on each other, so a share of decisions has the
    #: interval of the same share of plants: rather too wide than too narrow.
    interval: list[float]


class PlantOnWall(Results):
    """One plant before the wall."""

    #: Its seed.
    seed: int
    #: Names of the nodes on its path.
    path: list[str]
    #: Whether each decision taken was right.
    right: list[bool]
    #: Steps with the plant.
    steps: int
    #: Nodes whose lamp was dead.
    dead_lamps: list[str]


class NodeRuleResults(Results):
    """What became of the plants under one rule."""

    #: The rule.
    rule: Any
    #: Right decisions of those taken: the apex first reached the height of a node of the path on its side.
    right: CountedShare
    #: Plants that took all decisions of their path, and all rightly.
    whole: CountedShare
    #: Nodes of the path to which the apex came within 2 cm in the plane.
    near: CountedShare
    #: Right decisions of those taken above the lowest dead lamp; only with dead lamps.
    above_dead_lamp: CountedShare | None
    #: Mean hours of lamp light a plant, at level 255.
    lit_h: float
    #: Mean hours that a plant took.
    hours: float
    #: Each plant.
    plants: list[PlantOnWall]
    _kinds = {
        "right": CountedShare,
        "whole": CountedShare,
        "near": CountedShare,
        "above_dead_lamp": CountedShare,
        "plants": PlantOnWall,
    }


class WallResults(Results):
    """The results of a `WallPlan`."""

    #: Always true.
    is_virtual: bool
    #: Each rule, in the order of the plan.
    rules: list[NodeRuleResults]
    #: What may go wrong on this wall.
    warnings: list[str]
    #: Files that were written.
    files: list[str]
    _kinds = {"rules": NodeRuleResults}


class NodeScore(Results):
    """What a network did before one plant, or the mean over several."""

    #: Fitness.
    fitness: float
    #: Share of right decisions of all nodes of the path.
    right: float
    #: Share of plants that went the whole path.
    whole: float
    #: Mean light on the next node of the path less that on all others, in lamps at full power; at most 1.
    aim: float
    #: Hours of lamp light.
    lit_h: float


class EvolvedRule(Results):
    """A rule that an evolution made."""

    #: Name of the rule.
    name: str
    #: Seed of the evolution.
    seed: int
    #: What its network did on fresh plants of the model.
    test: NodeScore
    _kinds = {"test": NodeScore}


class WallScenarioResults(Results):
    """What became of the plants before one wall."""

    #: Name of the wall.
    name: str
    #: Number of its nodes.
    nodes: int
    #: Each rule.
    rules: list[NodeRuleResults]
    _kinds = {"rules": NodeRuleResults}


class WallStudyResults(Results):
    """The results of a `WallStudyPlan`."""

    #: Always true.
    is_virtual: bool
    #: Number of plants before each wall.
    plants: int
    #: The rules that evolutions made.
    evolved: list[EvolvedRule]
    #: Each wall, in the order of the study.
    walls: list[WallScenarioResults]
    _kinds = {"evolved": EvolvedRule, "walls": WallScenarioResults}


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class AcceptancePlan(Plan[AcceptanceResults]):
    """Compares virtual beans of a species with what is published on *Phaseolus vulgaris*."""

    workflow: ClassVar[str] = "acceptance"
    results = AcceptanceResults
    roles: ClassVar[Mapping[str, str]] = {"species": "species"}
    species: AnySettings | None = None
    seed: int | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class BaselinePlan(Plan[BaselineResults]):
    """Evaluates random networks, each drawn as NEAT draws its initial population, on simulated plants of a model, in
    a folder that can be resumed.
    """

    workflow: ClassVar[str] = "baseline"
    results = BaselineResults
    roles: ClassVar[Mapping[str, str]] = {"model": "model", "task": "task", "neat": "settings", "out": "path"}
    model: AnyModel | None = None
    task: AnyTask | None = None
    neat: AnySettings | None = None
    count: int | None = None
    seed: int | None = None
    resume: bool | None = None
    out: PathLike | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class CalibratePlan(Plan[CalibrateResults]):
    """Estimates the parameters of plants from their open-loop tracks."""

    workflow: ClassVar[str] = "calibrate"
    results = CalibrateResults
    roles: ClassVar[Mapping[str, str]] = {"tracks": "tracks", "species": "species", "out": "path"}
    tracks: AnyTrack | Sequence[AnyTrack] | None = None
    interval_min: float | None = None
    species: AnySettings | None = None
    resume: bool | None = None
    out: PathLike | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class CalibrateCameraPlan(Plan[CalibrateCameraResults]):
    """The photograph to calibrate from, and what gives its scale.

     The default is the paper's camera: 74 cm in front of the plant (section 2.1), with the lens of
    Frame::WIDTH_CM.
    """

    workflow: ClassVar[str] = "calibrate_camera"
    results = CalibrateCameraResults
    roles: ClassVar[Mapping[str, str]] = {"base": "settings", "photograph": "path", "out": "path"}
    photograph: PathLike | None = None
    scale: Any | None = None
    base: AnySettings | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class CheckPlan(Plan[CheckResults]):
    """The rig to check."""

    workflow: ClassVar[str] = "check"
    results = CheckResults
    roles: ClassVar[Mapping[str, str]] = {
        "rehearsal": "settings",
        "report": "settings",
        "rig": "path",
        "data": "path",
        "photographs": "path",
    }
    rig: PathLike | None = None
    dry: bool | None = None
    only: (
        Sequence[Literal["settings", "system", "camera", "flash", "lamps", "plant", "broker", "alerts", "rehearsal"]]
        | None
    ) = None
    rehearsal: AnySettings | None = None
    data: PathLike | None = None
    photographs: PathLike | None = None
    report: AnySettings | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class DepthPlan(Plan[DepthResults]):
    """Two tracks to triangulate.

    The default has both cameras at the distance of the paper's (section 2.1).
    """

    workflow: ClassVar[str] = "depth"
    results = DepthResults
    roles: ClassVar[Mapping[str, str]] = {"front": "path", "side": "path", "out": "path"}
    front: PathLike | None = None
    side: PathLike | None = None
    distance_cm: Sequence[float] | None = None
    from_: Literal["left", "right"] | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class EvolvePlan(Plan[EvolveResults]):
    """Evolves controllers with NEAT on a tip-motion model, and chooses the one to use on real plants."""

    workflow: ClassVar[str] = "evolve"
    results = EvolveResults
    roles: ClassVar[Mapping[str, str]] = {"model": "model", "task": "task", "evolution": "settings", "out": "path"}
    model: AnyModel | None = None
    out: PathLike | None = None
    task: AnyTask | None = None
    evolution: AnySettings | None = None
    trial_plants: int | None = None
    seed: int | None = None
    resume: bool | None = None
    checkpoint_s: int | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class ExportPlan(Plan[ExportResults]):
    """The run to export."""

    workflow: ClassVar[str] = "export"
    results = ExportResults
    roles: ClassVar[Mapping[str, str]] = {"folder": "path", "out": "path"}
    folder: PathLike | None = None
    out: PathLike | None = None
    keep_going: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class FitPlan(Plan[FitResults]):
    """Fits a model to tracks and writes it to a file."""

    workflow: ClassVar[str] = "fit"
    results = FitResults
    roles: ClassVar[Mapping[str, str]] = {"tracks": "tracks", "model": "settings", "out": "path"}
    tracks: AnyTrack | Sequence[AnyTrack] | None = None
    kind: Literal["tip", "stem", "space"] | None = None
    model: AnySettings | None = None
    anyway: bool | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class ForecastPlan(Plan[ForecastResults]):
    """Compares models by their forecasts of plants that were left out."""

    workflow: ClassVar[str] = "forecast"
    results = ForecastResults
    roles: ClassVar[Mapping[str, str]] = {
        "models": "models",
        "tracks": "tracks",
        "greenhouse": "greenhouse",
        "out": "path",
    }
    models: AnyModel | Sequence[AnyModel] | None = None
    tracks: AnyTrack | Sequence[AnyTrack] | None = None
    plants: int | None = None
    horizons_min: Sequence[float] | None = None
    interval_min: float | None = None
    greenhouse: AnySettings | None = None
    seed: int | None = None
    resume: bool | None = None
    out: PathLike | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class MakeRigPlan(Plan[MakeRigResults]):
    """What there is, and where to write its rig file."""

    workflow: ClassVar[str] = "make_rig"
    results = MakeRigResults
    roles: ClassVar[Mapping[str, str]] = {"out": "path"}
    camera: str | None = None
    camera_at: str | None = None
    lamps: str | None = None
    lamps_at: str | None = None
    flash: str | None = None
    flash_at: str | None = None
    broker: str | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class MeasurePlan(Plan[MeasureResults]):
    """Measures the constants of plants."""

    workflow: ClassVar[str] = "measure"
    results = MeasureResults
    roles: ClassVar[Mapping[str, str]] = {"tracks": "tracks", "light": "path", "out": "path"}
    tracks: AnyTrack | Sequence[AnyTrack] | None = None
    groups: Sequence[AnySettings] | None = None
    tilt_deg: float | None = None
    lamps: bool | None = None
    light: PathLike | None = None
    radius_cm: float | None = None
    law: Literal["ac", "ace"] | None = None
    hours: float | None = None
    check_plants: int | None = None
    demo: bool | None = None
    seed: int | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class GrowPlan(Plan[GrowResults]):
    """Grows virtual beans under a controller, and writes their tracks."""

    workflow: ClassVar[str] = "grow"
    results = GrowResults
    roles: ClassVar[Mapping[str, str]] = {
        "controller": "controller",
        "task": "task",
        "greenhouse": "greenhouse",
        "out": "path",
    }
    plants: int | None = None
    controller: AnyController | None = None
    task: AnyTask | None = None
    greenhouse: AnySettings | None = None
    period_min: float | None = None
    seed: int | None = None
    out: PathLike | None = None
    photographs: bool | None = None
    tilt_deg: float | None = None
    dark: bool | None = None
    replace: bool | None = None
    resume: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class GuidePlan(Plan[GuideResults]):
    """Photographs to make a guide of.

    Its fields mean the same as those of TrackPlan.
    """

    workflow: ClassVar[str] = "guide"
    results = GuideResults
    roles: ClassVar[Mapping[str, str]] = {"photographs": "paths", "vision": "settings", "page": "path"}
    photographs: PathLike | Sequence[PathLike] | None = None
    page: PathLike | None = None
    scale: Any | None = None
    plants: Sequence[AnySettings] | None = None
    time: Literal["auto", "exif", "name", "even"] | None = None
    period_min: float | None = None
    default_period_min: float | None = None
    vision: AnySettings | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class KinematicsPlan(Plan[KinematicsResults]):
    """NoiseStream how the typical plant of a species responds in the experiments of plant physiology."""

    workflow: ClassVar[str] = "kinematics"
    results = KinematicsResults
    roles: ClassVar[Mapping[str, str]] = {"species": "species", "out": "path"}
    species: AnySettings | None = None
    out: PathLike | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class NotePlan(Plan[NoteResults]):
    """A note about a run."""

    workflow: ClassVar[str] = "note"
    results = NoteResults
    roles: ClassVar[Mapping[str, str]] = {"run": "path"}
    run: PathLike | None = None
    text: str | None = None
    step: int | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class RecoveryPlan(Plan[RecoveryResults]):
    """Estimates the parameters of virtual plants, and compares them with the true ones."""

    workflow: ClassVar[str] = "recovery"
    results = RecoveryResults
    roles: ClassVar[Mapping[str, str]] = {"species": "species"}
    plants: int | None = None
    species: AnySettings | None = None
    seed: int | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class ReplicatesPlan(Plan[ReplicatesResults]):
    """Compares methods over replicates and scenarios, in a folder that can be resumed."""

    workflow: ClassVar[str] = "replicates"
    results = ReplicatesResults
    roles: ClassVar[Mapping[str, str]] = {"config": "settings", "out": "path"}
    config: AnySettings | None = None
    out: PathLike | None = None
    resume: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class ReportPlan(Plan[ReportResults]):
    """Writes a report of folders and tracks."""

    workflow: ClassVar[str] = "report"
    results = ReportResults
    roles: ClassVar[Mapping[str, str]] = {"sources": "paths", "out": "path", "figures": "path"}
    sources: PathLike | Sequence[PathLike] | None = None
    out: PathLike | None = None
    figures: PathLike | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class RunPlan(Plan[RunResults]):
    """A run and where it is recorded."""

    workflow: ClassVar[str] = "run"
    results = RunResults
    roles: ClassVar[Mapping[str, str]] = {"config": "run_config", "out": "path"}
    config: AnySettings | None = None
    out: PathLike | None = None
    resume: bool | None = None
    speed: float | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class SafeStatePlan(Plan[SafeStateResults]):
    """The rig to switch off."""

    workflow: ClassVar[str] = "safe_state"
    results = SafeStateResults
    roles: ClassVar[Mapping[str, str]] = {"rig": "path"}
    rig: PathLike | None = None
    dark: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class ScorePlan(Plan[ScoreResults]):
    """Computes the fitness of tracks, and the distance of the tip to each target."""

    workflow: ClassVar[str] = "score"
    results = ScoreResults
    roles: ClassVar[Mapping[str, str]] = {"tracks": "tracks", "task": "task"}
    tracks: AnyTrack | Sequence[AnyTrack] | None = None
    task: AnyTask | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class ShowPlan(Plan[ShowResults]):
    """Shows a champion."""

    workflow: ClassVar[str] = "show"
    results = ShowResults
    roles: ClassVar[Mapping[str, str]] = {"source": "network", "model": "model", "task": "task", "out": "path"}
    source: AnyNetwork | None = None
    out: PathLike | None = None
    format: Literal["text", "html", "svg", "dot"] | None = None
    model: AnyModel | None = None
    task: AnyTask | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class SimulatePlan(Plan[SimulateResults]):
    """Simulates plants that a controller steers, and writes the track of the first one."""

    workflow: ClassVar[str] = "simulate"
    results = SimulateResults
    roles: ClassVar[Mapping[str, str]] = {"model": "model", "controller": "controller", "task": "task", "out": "path"}
    model: AnyModel | None = None
    controller: AnyController | None = None
    task: AnyTask | None = None
    episodes: int | None = None
    seed: int | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class StatusPlan(Plan[StatusResults]):
    """The work to look at."""

    workflow: ClassVar[str] = "status"
    results = StatusResults
    roles: ClassVar[Mapping[str, str]] = {"model": "model", "folder": "path"}
    folder: PathLike | None = None
    model: AnyModel | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class StopPlan(Plan[StopResults]):
    """The run or evolution to end."""

    workflow: ClassVar[str] = "stop"
    results = StopResults
    roles: ClassVar[Mapping[str, str]] = {"folder": "path"}
    folder: PathLike | None = None
    wait_min: float | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class StudyPlan(Plan[StudyResults]):
    """Repeats the paper on virtual plants."""

    workflow: ClassVar[str] = "study"
    results = StudyResults
    roles: ClassVar[Mapping[str, str]] = {"config": "settings", "out": "path"}
    config: AnySettings | None = None
    out: PathLike | None = None
    resume: bool | None = None
    keep_photographs: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class SweepPlan(Plan[SweepResults]):
    """Executes all units of a sweep, and summarizes them."""

    workflow: ClassVar[str] = "sweep"
    results = SweepResults
    roles: ClassVar[Mapping[str, str]] = {"config": "settings", "out": "path", "folder": "path"}
    out: PathLike | None = None
    resume: bool | None = None
    folder: PathLike | None = None
    config: AnySettings | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class TimelapsePlan(Plan[TimelapseResults]):
    """The film to make."""

    workflow: ClassVar[str] = "timelapse"
    results = TimelapseResults
    roles: ClassVar[Mapping[str, str]] = {"folder": "path", "out": "path"}
    folder: PathLike | None = None
    out: PathLike | None = None
    width: int | None = None
    fps: int | None = None
    every: int | None = None
    crop: Any | None = None
    plain: bool | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class TrackPlan(Plan[TrackResults]):
    """Photographs to track, and how.

     The default tracks one plant in the whole picture of the paper's camera, with photographs five minutes apart
    where no times are known (section 2.2.1).
    """

    workflow: ClassVar[str] = "track"
    results = TrackResults
    roles: ClassVar[Mapping[str, str]] = {
        "photographs": "paths",
        "vision": "settings",
        "out": "path",
        "overlay": "path",
        "sheet": "path",
    }
    photographs: PathLike | Sequence[PathLike] | None = None
    out: PathLike | None = None
    scale: Any | None = None
    plants: Sequence[AnySettings] | None = None
    light: Any | None = None
    time: Literal["auto", "exif", "name", "even"] | None = None
    period_min: float | None = None
    default_period_min: float | None = None
    vision: AnySettings | None = None
    find_up: bool | None = None
    each: bool | None = None
    overlay: PathLike | None = None
    sheet: PathLike | None = None
    resume: bool | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class TransferPlan(Plan[TransferResults]):
    """Lets each of several controllers steer the same unseen virtual plants."""

    workflow: ClassVar[str] = "transfer"
    results = TransferResults
    roles: ClassVar[Mapping[str, str]] = {
        "controllers": "controllers",
        "task": "task",
        "greenhouse": "greenhouse",
        "model": "model",
        "out": "path",
    }
    controllers: Sequence[AnyController] | Mapping[str, AnyController] | None = None
    plants: int | None = None
    plant_seeds: range | Settings | None = None
    task: AnyTask | None = None
    random_targets: bool | None = None
    greenhouse: AnySettings | None = None
    period_min: float | None = None
    photographs: bool | None = None
    model: AnyModel | None = None
    optimum: bool | None = None
    reference: str | None = None
    seed: int | None = None
    resume: bool | None = None
    out: PathLike | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class TunePlan(Plan[TuneResults]):
    """Tunes the nine parameters of a rule on simulated plants of a model, and writes the rule to a file."""

    workflow: ClassVar[str] = "tune"
    results = TuneResults
    roles: ClassVar[Mapping[str, str]] = {
        "model": "model",
        "beans": "greenhouse",
        "task": "task",
        "search": "settings",
        "out": "path",
    }
    model: AnyModel | None = None
    beans: AnySettings | None = None
    period_min: float | None = None
    task: AnyTask | None = None
    search: AnySettings | None = None
    seed: int | None = None
    out: PathLike | None = None
    replace: bool | None = None
    resume: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class WallPlan(Plan[WallResults]):
    """Grows virtual plants before a wall under each rule."""

    workflow: ClassVar[str] = "wall"
    results = WallResults
    roles: ClassVar[Mapping[str, str]] = {"file": "settings", "species": "species", "faults": "settings", "out": "path"}
    file: AnySettings | None = None
    rules: Sequence[Any] | None = None
    plants: int | None = None
    species: AnySettings | None = None
    variation: float | None = None
    faults: AnySettings | None = None
    learning_h: float | None = None
    period_min: float | None = None
    max_steps: int | None = None
    seed: int | None = None
    out: PathLike | None = None
    replace: bool | None = None


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class WallStudyPlan(Plan[WallStudyResults]):
    """Tests rules of nodes on many walls, in a folder that can be resumed."""

    workflow: ClassVar[str] = "wall_study"
    results = WallStudyResults
    roles: ClassVar[Mapping[str, str]] = {"config": "settings", "out": "path"}
    config: AnySettings | None = None
    out: PathLike | None = None
    resume: bool | None = None


def acceptance(
    *,
    species: AnySettings | None = None,
    seed: int = 1,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> AcceptanceResults:
    """Compares virtual beans of a species with what is published on *Phaseolus vulgaris*.

    Parameters
    ----------
    species : AnySettings, default None: the paper's
        The species.
    seed : int, default 1
        Seed of all random numbers.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    AcceptanceResults
        What the command `tropism grow --check` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> rows = acceptance().rows
    >>> rows[0].holds in (True, False)
    True
    """
    return execute(AcceptancePlan(species=species, seed=seed, monitor=monitor, threads=threads))


def baseline(
    model: AnyModel,
    *,
    task: AnyTask | None = None,
    neat: AnySettings | None = None,
    count: int = 2000000,
    seed: int = 1,
    resume: bool = False,
    out: PathLike | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> BaselineResults:
    """Evaluates random networks, each drawn as NEAT draws its initial population, on simulated plants of a model, in
    a folder that can be resumed.

    Parameters
    ----------
    model : AnyModel
        File of the tip-motion model.
    task : AnyTask, default None: the paper's three targets
        Task of the controllers.
    neat : AnySettings, default None: the paper's
        NEAT's parameters, for the distribution of the weights.
    count : int, default 2000000
        Number of controllers, 1 to 1000000000. Paper: two million.
    seed : int, default 1
        Seed of all random numbers.
    resume : bool, default False
        Whether to continue a baseline in `out`.
    out : PathLike, default None
        Folder for the fitness of all and the genome of the best; without one nothing is kept.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    BaselineResults
        What the command `tropism baseline` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> model = tropism.Model.of_virtual_beans(plants=2, steps=60)
    >>> baseline(model, count=10, task={"max_steps": 20}).count
    10
    """
    return execute(
        BaselinePlan(
            model=model,
            task=task,
            neat=neat,
            count=count,
            seed=seed,
            resume=resume,
            out=out,
            monitor=monitor,
            threads=threads,
        )
    )


def calibrate(
    tracks: AnyTrack | Sequence[AnyTrack],
    *,
    interval_min: float | None = None,
    species: AnySettings | None = None,
    resume: bool = False,
    out: PathLike | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> CalibrateResults:
    """Estimates the parameters of plants from their open-loop tracks.

    Parameters
    ----------
    tracks : AnyTrack | Sequence[AnyTrack]
        Track files (CSV), a plant each, or folders of runs or tracks.
    interval_min : float, default None
        Minutes between the rows of the tracks, 0.1 to 120; as their times say if it is left out.
    species : AnySettings, default None: the paper's
        Species of the plants: the prior of the estimates.
    resume : bool, default False
        Whether to continue a calibration in `out`.
    out : PathLike, default None
        Folder for the estimates of each plant, and for the species with these estimates and their spread; without
        one nothing is kept.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    CalibrateResults
        What the command `tropism calibrate` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> task = {"kind": "open_loop", "max_steps": 100}
    >>> [plant] = calibrate(tropism.loop.grow("periodic", task)[0]).rows
    """
    return execute(
        CalibratePlan(
            tracks=tracks,
            interval_min=interval_min,
            species=species,
            resume=resume,
            out=out,
            monitor=monitor,
            threads=threads,
        )
    )


def calibrate_camera(
    photograph: PathLike,
    *,
    scale: Any | None = None,
    base: AnySettings | None = None,
    out: PathLike = "calibration.toml",
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> CalibrateCameraResults:
    """The photograph to calibrate from, and what gives its scale.

     The default is the paper's camera: 74 cm in front of the plant (section 2.1), with the lens of
    Frame::WIDTH_CM.

    Parameters
    ----------
    photograph : PathLike
        Photograph of the camera at its final place.
    scale : Any, default None: the paper's
        What gives the scale.
    base : AnySettings, default None
        Pixel where the stem leaves the soil. `None` means the middle of the picture's lower edge.
    out : PathLike, default "calibration.toml"
        TOML file of the calibration.
    replace : bool, default False
        Whether to replace a file at `out`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    CalibrateCameraResults
        What the command `tropism calibrate-camera` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> calibrate_camera("chart.jpg")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.MissingFileError: calibrate_camera: chart.jpg: cannot read
    """
    return execute(
        CalibrateCameraPlan(
            photograph=photograph, scale=scale, base=base, out=out, replace=replace, monitor=monitor, threads=threads
        )
    )


def check(
    rig: PathLike,
    *,
    dry: bool = False,
    only: Sequence[
        Literal["settings", "system", "camera", "flash", "lamps", "plant", "broker", "alerts", "rehearsal"]
    ] = (),
    rehearsal: AnySettings | None = None,
    data: PathLike = ".",
    photographs: PathLike | None = None,
    report: AnySettings | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> CheckResults:
    """The rig to check.

    Parameters
    ----------
    rig : PathLike
        Rig file.
    dry : bool, default False
        Whether nothing is switched, photographed or sent.
    only : Sequence[Literal["settings", "system", "camera", "flash", "lamps", "plant", "broker", "alerts", "rehearsal"]], default []
        Groups that are checked; all if empty.
    rehearsal : AnySettings, default None
        A short run with a kill.
    data : PathLike, default "."
        Folder in which runs will be kept: its disk is tried.
    photographs : PathLike, default None
        New folder in which the photographs are kept.
    report : AnySettings, default None
        A report for a maintainer.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    CheckResults
        What the command `tropism check` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> check("rig.toml").findings[0].verdict
    'fail'
    """
    return execute(
        CheckPlan(
            rig=rig,
            dry=dry,
            only=only,
            rehearsal=rehearsal,
            data=data,
            photographs=photographs,
            report=report,
            monitor=monitor,
            threads=threads,
        )
    )


def depth(
    front: PathLike,
    *,
    side: PathLike = "side.csv",
    distance_cm: Sequence[float] = (74.0, 74.0),
    from_: Literal["left", "right"] = "right",
    out: PathLike = "space.csv",
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> DepthResults:
    """Two tracks to triangulate.

    The default has both cameras at the distance of the paper's (section 2.1).

    Parameters
    ----------
    front : PathLike
        Track of the camera in front.
    side : PathLike, default "side.csv"
        Track of the camera at the side.
    distance_cm : Sequence[float], default [74.0, 74.0]
        From the lens of each camera to the plane through the root, in cm, the front camera's first.
    from_ : Literal["left", "right"], default "right"
        Where the second camera stands, as the first sees it.
    out : PathLike, default "space.csv"
        CSV file of the track in space; a JSON file of the same name is written beside it.
    replace : bool, default False
        Whether to replace a file at `out`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    DepthResults
        What the command `tropism depth` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> depth("front.csv", side="side.csv", distance_cm=[60, 60])  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.MissingFileError: depth: front.csv: cannot read
    """
    return execute(
        DepthPlan(
            front=front,
            side=side,
            distance_cm=distance_cm,
            from_=from_,
            out=out,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def evolve(
    model: AnyModel,
    *,
    out: PathLike = "evolution",
    task: AnyTask | None = None,
    evolution: AnySettings | None = None,
    trial_plants: int = 200,
    seed: int = 1,
    resume: bool = False,
    checkpoint_s: int = 60,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> EvolveResults:
    """Evolves controllers with NEAT on a tip-motion model, and chooses the one to use on real plants.

    Parameters
    ----------
    model : AnyModel
        File of the tip-motion model.
    out : PathLike, default "evolution"
        Folder for checkpoints and results.
    task : AnyTask, default None: the paper's three targets
        Task of the controllers.
    evolution : AnySettings, default None: the paper's
        Number of runs, generations and episodes, and NEAT's parameters.
    trial_plants : int, default 200
        Unseen simulated plants of each model on which champions are compared, 1 to 1000000.
    seed : int, default 1
        Seed of all random numbers.
    resume : bool, default False
        Whether to continue an evolution in `out`.
    checkpoint_s : int, default 60
        Longest time between two checkpoints of a run, in s; 0 saves each generation.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    EvolveResults
        What the command `tropism evolve` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> model = tropism.Model.of_virtual_beans(plants=2, steps=60)
    >>> small = {"runs": 1, "generations": 2, "neat": {"population": 6}}
    >>> evolve(model, task={"max_steps": 20}, evolution=small, trial_plants=2).champion
    0
    """
    return execute(
        EvolvePlan(
            model=model,
            out=out,
            task=task,
            evolution=evolution,
            trial_plants=trial_plants,
            seed=seed,
            resume=resume,
            checkpoint_s=checkpoint_s,
            monitor=monitor,
            threads=threads,
        )
    )


def export(
    folder: PathLike,
    out: PathLike,
    *,
    keep_going: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> ExportResults:
    """The run to export.

    Parameters
    ----------
    folder : PathLike
        Run folder.
    out : PathLike
        New archive, if it ends in `.tar`, or new folder. Nothing is overwritten.
    keep_going : bool, default False
        Whether photographs that are missing or damaged are left out and listed. Otherwise they are an error.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    ExportResults
        What the command `tropism export` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> _ = tropism.run({"task": {"max_steps": 2}}, out="run")
    >>> export("run", "run.tar").out
    'run.tar'
    """
    return execute(ExportPlan(folder=folder, out=out, keep_going=keep_going, monitor=monitor, threads=threads))


def fit(
    tracks: AnyTrack | Sequence[AnyTrack],
    *,
    kind: Literal["tip", "stem", "space"] = "tip",
    model: AnySettings | None = None,
    anyway: bool = False,
    out: PathLike = "model.json",
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> FitResults:
    """Fits a model to tracks and writes it to a file.

    Parameters
    ----------
    tracks : AnyTrack | Sequence[AnyTrack]
        Track files (CSV), and folders of runs or of track files.
    kind : Literal["tip", "stem", "space"], default "tip"
        Which model.
    model : AnySettings, default None: the paper's
        Window, growth and grid of a tip-motion model. The others have no such settings.
    anyway : bool, default False
        Whether to take uncertain tracks too, of which `warnings_of` lists the reasons.
    out : PathLike, default "model.json"
        File for the model.
    replace : bool, default False
        Whether a file that is there is replaced.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    FitResults
        What the command `tropism fit` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> task = {"kind": "open_loop", "max_steps": 60}
    >>> track, _ = tropism.loop.grow("periodic", task)
    >>> fit(track, out="model.json").shifts
    60
    """
    return execute(
        FitPlan(
            tracks=tracks,
            kind=kind,
            model=model,
            anyway=anyway,
            out=out,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def forecast(
    models: AnyModel | Sequence[AnyModel],
    *,
    tracks: AnyTrack | Sequence[AnyTrack] = (),
    plants: int = 12,
    horizons_min: Sequence[float] = (5.0, 60.0, 360.0),
    interval_min: float = 60.0,
    greenhouse: AnySettings | None = None,
    seed: int = 1,
    resume: bool = False,
    out: PathLike | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> ForecastResults:
    """Compares models by their forecasts of plants that were left out.

    Parameters
    ----------
    models : AnyModel | Sequence[AnyModel]
        Model files. Those of one file name are one model of several replicates.
    tracks : AnyTrack | Sequence[AnyTrack], default []
        Tracks of plants that were left out: track files (CSV), and folders of runs or of track files. Without
        any, virtual beans are grown, under two kinds of light.
    plants : int, default 12
        Number of virtual beans, 1 to 10000, the same ones under each kind of light.
    horizons_min : Sequence[float], default [5.0, 60.0, 360.0]
        Time of the forecasts, in minutes after the start; rounded to whole steps.
    interval_min : float, default 60.0
        Time from one start to the next, in minutes; rounded to whole steps.
    greenhouse : AnySettings, default None: the paper's
        Species and variation of the virtual beans, and their lamps.
    seed : int, default 1
        Seed of the virtual beans and of the forecasts.
    resume : bool, default False
        Whether to continue forecasts in `out`.
    out : PathLike, default None
        Folder for the scores of each model, `forecast.json` and the figure; without one nothing is kept.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    ForecastResults
        What the command `tropism forecast` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> model = tropism.Model.of_virtual_beans(plants=2, steps=100)
    >>> forecast(model, plants=1, horizons_min=[60]).horizons_min
    [60.0]
    """
    return execute(
        ForecastPlan(
            models=models,
            tracks=tracks,
            plants=plants,
            horizons_min=horizons_min,
            interval_min=interval_min,
            greenhouse=greenhouse,
            seed=seed,
            resume=resume,
            out=out,
            monitor=monitor,
            threads=threads,
        )
    )


def make_rig(
    *,
    camera: str = "ip",
    camera_at: str | None = None,
    lamps: str = "wled",
    lamps_at: str | None = None,
    flash: str | None = None,
    flash_at: str | None = None,
    broker: str | None = None,
    out: PathLike = "rig.toml",
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> MakeRigResults:
    """What there is, and where to write its rig file.

    Parameters
    ----------
    camera : str, default "ip"
        Kind of the camera: `ip`, `usb` or `raspberry`.
    camera_at : str, default None
        Address of the camera: the URL of a photograph (`ip`), or a device such as `/dev/video0` (`usb`).
    lamps : str, default "wled"
        Kind of the lamps: `wled`, `zigbee`, `leds-pi5` or `spi-pi4`.
    lamps_at : str, default None
        Addresses of the lamps: the URL of the controller (`wled`), or the names of the left and the right plug,
        with a comma between them (`zigbee`).
    flash : str, default None
        Kind of the flash: `tasmota`, `zigbee`, `relay-pi4` or `relay-pi5`. Without one, photographs are taken in
        the light that there is.
    flash_at : str, default None
        Name of the plug of the flash (`tasmota`, `zigbee`).
    broker : str, default None
        Host of the MQTT broker, for plugs.
    out : PathLike, default "rig.toml"
        The rig file.
    replace : bool, default False
        Whether to replace a file at `out`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    MakeRigResults
        What the command `tropism make-rig` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> tropism.make_rig(camera="raspberry", lamps="leds-pi5", flash="relay-pi5", out="rig.toml").out
    'rig.toml'
    """
    return execute(
        MakeRigPlan(
            camera=camera,
            camera_at=camera_at,
            lamps=lamps,
            lamps_at=lamps_at,
            flash=flash,
            flash_at=flash_at,
            broker=broker,
            out=out,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def measure(
    *,
    tracks: AnyTrack | Sequence[AnyTrack] = (),
    groups: Sequence[AnySettings] = (),
    tilt_deg: float | None = None,
    lamps: bool = False,
    light: PathLike | None = None,
    radius_cm: float | None = None,
    law: Literal["ac", "ace"] = "ace",
    hours: float | None = None,
    check_plants: int = 30,
    demo: bool = False,
    seed: int = 1,
    out: PathLike | None = None,
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> MeasureResults:
    """Measures the constants of plants.

    Parameters
    ----------
    tracks : AnyTrack | Sequence[AnyTrack], default []
        Track files (CSV) with stems, and folders of runs or of track files.
    groups : Sequence[AnySettings], default []
        Groups of further tracks, such as genotypes.
    tilt_deg : float, default None
        Angle by which the pots were tipped at the first frame, in degrees: 1 to 180. Without it, and without
        `lamps`, the plants stand upright.
    lamps : bool, default False
        Whether the plants respond to the lamps of their tracks.
    light : PathLike, default None
        A CSV file with the columns `time_h` and `light`, hours from the first photograph on: the plants respond
        to these lamps, and not to those of their tracks.
    radius_cm : float, default None
        Radius of the stems in the zone that bends, in cm: gives constants in growth units.
    law : Literal["ac", "ace"], default "ace"
        How elongation carries curvature.
    hours : float, default None
        Hours of each record that are measured; all by default.
    check_plants : int, default 30
        Virtual plants of the self-check, 0 to 1000; 0 leaves it out.
    demo : bool, default False
        Measures virtual beans instead of tracks: six, tipped in the dark.
    seed : int, default 1
        Seed of the virtual plants and of permutations.
    out : PathLike, default None
        Folder for the report, its tables and figures.
    replace : bool, default False
        Whether results that are there are replaced.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    MeasureResults
        What the command `tropism measure` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> try:
    ...     tropism.measure(tracks=["none.csv"])
    ... except tropism.TropismError as error:
    ...     print("none.csv" in str(error))
    True
    """
    return execute(
        MeasurePlan(
            tracks=tracks,
            groups=groups,
            tilt_deg=tilt_deg,
            lamps=lamps,
            light=light,
            radius_cm=radius_cm,
            law=law,
            hours=hours,
            check_plants=check_plants,
            demo=demo,
            seed=seed,
            out=out,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def grow(
    *,
    plants: int = 6,
    controller: AnyController = "periodic",
    task: AnyTask | None = None,
    greenhouse: AnySettings | None = None,
    period_min: float = 5.0,
    seed: int = 1,
    out: PathLike = "beans",
    photographs: bool = False,
    tilt_deg: float = 0.0,
    dark: bool = False,
    replace: bool = False,
    resume: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> GrowResults:
    """Grows virtual beans under a controller, and writes their tracks.

    Parameters
    ----------
    plants : int, default 6
        Number of plants, each an individual of the species, 1 to 1000000. Paper: 6 (section 2.2.1).
    controller : AnyController, default "periodic"
        Controller of the lamps.
    task : AnyTask, default None: no targets, 1000 steps
        Task of the controller.
    greenhouse : AnySettings, default None: the paper's
        Species, lamps and tent. Its scene and faults only change photographs.
    period_min : float, default 5.0
        Time from one step to the next, in min. Paper: 5 (section 2.1).
    seed : int, default 1
        Seed of all random numbers.
    out : PathLike, default "beans"
        Folder for the tracks, or for the run folders of the plants.
    photographs : bool, default False
        Whether to write a photograph of each step, with the ground truth.
    tilt_deg : float, default 0.0
        Angle by which the pots are tipped to the right at the first step, in degrees, -180 to 180. Not with
        `photographs`.
    dark : bool, default False
        Whether all lamps stay dark. Not with `photographs`.
    replace : bool, default False
        Whether tracks that are there are replaced. Photographs never are.
    resume : bool, default False
        Whether to continue with photographed plants in `out`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    GrowResults
        What the command `tropism grow` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> grow(plants=2, task={"kind": "open_loop", "max_steps": 20}, out="beans").plants
    2
    """
    return execute(
        GrowPlan(
            plants=plants,
            controller=controller,
            task=task,
            greenhouse=greenhouse,
            period_min=period_min,
            seed=seed,
            out=out,
            photographs=photographs,
            tilt_deg=tilt_deg,
            dark=dark,
            replace=replace,
            resume=resume,
            monitor=monitor,
            threads=threads,
        )
    )


def guide(
    photographs: PathLike | Sequence[PathLike],
    *,
    page: PathLike = "guide.html",
    scale: Any = "paper_camera",
    plants: Sequence[AnySettings] = (),
    time: Literal["auto", "exif", "name", "even"] = "auto",
    period_min: float | None = None,
    default_period_min: float = 5.0,
    vision: AnySettings | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> GuideResults:
    """Photographs to make a guide of.

    Its fields mean the same as those of TrackPlan.

    Parameters
    ----------
    photographs : PathLike | Sequence[PathLike]
        Photographs (JPEG, PNG or TIFF), films, or folders of them.
    page : PathLike, default "guide.html"
        HTML file of the page. An older guide there is replaced.
    scale : Any, default "paper_camera"
        How pixels become centimetres, as far as it is known.
    plants : Sequence[AnySettings], default []
        The plants whose place is known: they are detected, and the detections are drawn in.
    time : Literal["auto", "exif", "name", "even"], default "auto"
        What says when a photograph was taken.
    period_min : float, default None
        Minutes from one step to the next; `None` takes the median interval of the photographs.
    default_period_min : float, default 5.0
        Minutes from one step to the next where `period_min` is `None` and no times are known.
    vision : AnySettings, default None: the paper's
        How plants are detected.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    GuideResults
        What the command `tropism track --guide` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> task = {"kind": "open_loop", "max_steps": 2}
    >>> _ = tropism.grow(plants=1, task=task, out="photographed", photographs=True)
    >>> import glob
    >>> _ = guide(sorted(glob.glob("photographed/*/photographs/*.jpg")), page="guide.html")
    """
    return execute(
        GuidePlan(
            photographs=photographs,
            page=page,
            scale=scale,
            plants=plants,
            time=time,
            period_min=period_min,
            default_period_min=default_period_min,
            vision=vision,
            monitor=monitor,
            threads=threads,
        )
    )


def kinematics(
    *,
    species: AnySettings | None = None,
    out: PathLike = "figures",
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> KinematicsResults:
    """NoiseStream how the typical plant of a species responds in the experiments of plant physiology.

    Parameters
    ----------
    species : AnySettings, default None: the paper's
        The species.
    out : PathLike, default "figures"
        Folder for the figures.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    KinematicsResults
        What the command `tropism grow --kinematics` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> _ = kinematics(out="kinematics")
    """
    return execute(KinematicsPlan(species=species, out=out, monitor=monitor, threads=threads))


def note(
    run: PathLike,
    text: str,
    *,
    step: int | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> NoteResults:
    """A note about a run.

    Parameters
    ----------
    run : PathLike
        Run folder; the run may go on.
    text : str
        What happened, in one line of at most 500 letters.
    step : int, default None
        The step that it is about; the latest one if it is left out.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    NoteResults
        What the command `tropism note` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> _ = tropism.run({"task": {"max_steps": 2}}, out="run")
    >>> note("run", text="pot moved").step
    2
    """
    return execute(NotePlan(run=run, text=text, step=step, monitor=monitor, threads=threads))


def recovery(
    *,
    plants: int = 50,
    species: AnySettings | None = None,
    seed: int = 1,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> RecoveryResults:
    """Estimates the parameters of virtual plants, and compares them with the true ones.

    Parameters
    ----------
    plants : int, default 50
        Number of virtual plants, 2 to 10000.
    species : AnySettings, default None: the paper's
        Their species.
    seed : int, default 1
        Seed of all random numbers.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    RecoveryResults
        What the command `tropism calibrate --recover` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> _ = recovery(plants=2)
    """
    return execute(RecoveryPlan(plants=plants, species=species, seed=seed, monitor=monitor, threads=threads))


def replicates(
    config: AnySettings,
    *,
    out: PathLike = "replicates",
    resume: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> ReplicatesResults:
    """Compares methods over replicates and scenarios, in a folder that can be resumed.

    Parameters
    ----------
    config : AnySettings
        Everything that decides the results.
    out : PathLike, default "replicates"
        Folder for tracks, models, controllers and results.
    resume : bool, default False
        Whether to continue in `out`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    ReplicatesResults
        What the command `tropism study` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> replicates({"nonsense": 1})  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.PlanError: replicates: config.nonsense: unknown key
    """
    return execute(ReplicatesPlan(config=config, out=out, resume=resume, monitor=monitor, threads=threads))


def report(
    sources: PathLike | Sequence[PathLike],
    *,
    out: PathLike = "report.html",
    figures: PathLike | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> ReportResults:
    """Writes a report of folders and tracks.

    Parameters
    ----------
    sources : PathLike | Sequence[PathLike]
        Folders of runs, evolutions, studies, transfers and replicates and track files, or the folder of one study
        or of one sweep.
    out : PathLike, default "report.html"
        HTML file of the report.
    figures : PathLike, default None
        Folder for the figures as files: SVG, PNG, PDF or JPEG, and CSV with their data.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    ReportResults
        What the command `tropism report` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> model = tropism.Model.of_virtual_beans(plants=2, steps=60)
    >>> small = {"runs": 1, "generations": 2, "neat": {"population": 6}}
    >>> _ = tropism.evolve(model, task={"max_steps": 20}, evolution=small, trial_plants=2)
    >>> report("evolution", out="report.html", figures="figures").figures()[0].suffix
    '.svg'
    """
    return execute(ReportPlan(sources=sources, out=out, figures=figures, monitor=monitor, threads=threads))


def run(
    config: AnySettings,
    *,
    out: PathLike = "run",
    resume: bool = False,
    speed: float | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> RunResults:
    """A run and where it is recorded.

    Parameters
    ----------
    config : AnySettings
        Everything that decides the outcome.
    out : PathLike, default "run"
        Run folder. It is made, or holds a run of the same configuration that is resumed.
    resume : bool, default False
        Whether to resume a run that is paused, over, or was down for longer than its rig allows.
    speed : float, default None
        How many times as fast as a real plant a virtual one grows, 0.001 to 1e9; as fast as the machine can if it
        is left out. The results do not depend on it.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    RunResults
        What the command `tropism run` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> run({"task": {"max_steps": 2}}, out="run").steps
    2
    """
    return execute(RunPlan(config=config, out=out, resume=resume, speed=speed, monitor=monitor, threads=threads))


def safe_state(
    rig: PathLike,
    *,
    dark: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> SafeStateResults:
    """The rig to switch off.

    Parameters
    ----------
    rig : PathLike
        Rig file, or the folder of a run in the rig.
    dark : bool, default False
        Whether lamps go dark even if their rig says `on_exit = "keep"`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    SafeStateResults
        What the command `tropism safe-state` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> safe_state("rig.toml")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.MissingFileError: safe_state: rig.toml: cannot read
    """
    return execute(SafeStatePlan(rig=rig, dark=dark, monitor=monitor, threads=threads))


def score(
    tracks: AnyTrack | Sequence[AnyTrack],
    *,
    task: AnyTask | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> ScoreResults:
    """Computes the fitness of tracks, and the distance of the tip to each target.

    Parameters
    ----------
    tracks : AnyTrack | Sequence[AnyTrack]
        Track files (CSV).
    task : AnyTask, default None
        Task of the experiments; if it is left out, that of the run in whose folder a track lies, and the paper's
        three targets for a track elsewhere.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    ScoreResults
        What the command `tropism score` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> track, fitness = tropism.loop.grow("greedy", {"max_steps": 20})
    >>> score(track).tracks[0].steps
    20
    """
    return execute(ScorePlan(tracks=tracks, task=task, monitor=monitor, threads=threads))


def show(
    source: AnyNetwork,
    *,
    out: PathLike | None = None,
    format: Literal["text", "html", "svg", "dot"] | None = None,
    model: AnyModel | None = None,
    task: AnyTask | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> ShowResults:
    """Shows a champion.

    Parameters
    ----------
    source : AnyNetwork
        Genome file; or the folder of an evolution (finished or at work), a study or a run.
    out : PathLike, default None
        File for the drawing. Without one it is only in the results.
    format : Literal["text", "html", "svg", "dot"], default None
        Format of the drawing; `None`: as the extension of `out` says, or text.
    model : AnyModel, default None
        File of a tip-motion model on which the network steers a plant; `None`: the model that it evolved on, if
        it is found.
    task : AnyTask, default None
        Task of the plant; `None`: the one that the network evolved for, or the paper's.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    ShowResults
        What the command `tropism show` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> show(tropism.neat.Neat(inputs=2, outputs=1).ask()[0]).inputs
    2
    """
    return execute(
        ShowPlan(source=source, out=out, format=format, model=model, task=task, monitor=monitor, threads=threads)
    )


def simulate(
    model: AnyModel,
    *,
    controller: AnyController = "periodic",
    task: AnyTask | None = None,
    episodes: int = 1,
    seed: int = 1,
    out: PathLike = "track.csv",
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> SimulateResults:
    """Simulates plants that a controller steers, and writes the track of the first one.

    Parameters
    ----------
    model : AnyModel
        File of the tip-motion model.
    controller : AnyController, default "periodic"
        The controller.
    task : AnyTask, default None: the paper's three targets
        Its task.
    episodes : int, default 1
        Number of plants, 1 to 10000000.
    seed : int, default 1
        Seed of all random numbers.
    out : PathLike, default "track.csv"
        File for the track of the first plant.
    replace : bool, default False
        Whether a file that is there is replaced.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    SimulateResults
        What the command `tropism simulate` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> model = tropism.Model.of_virtual_beans(plants=2, steps=60)
    >>> simulate(model, task={"max_steps": 20}, episodes=2, out="simulated.csv").episodes
    2
    """
    return execute(
        SimulatePlan(
            model=model,
            controller=controller,
            task=task,
            episodes=episodes,
            seed=seed,
            out=out,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def status(
    folder: PathLike,
    *,
    model: AnyModel | None = None,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> StatusResults:
    """The work to look at.

    Parameters
    ----------
    folder : PathLike
        Folder of a run or of long work, or the file of a rule.
    model : AnyModel, default None
        Of a run: file of a model, by which it is said how probably the plant passes each target.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    StatusResults
        What the command `tropism status` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> _ = tropism.run({"task": {"max_steps": 2}}, out="run")
    >>> _ = status("run")
    """
    return execute(StatusPlan(folder=folder, model=model, monitor=monitor, threads=threads))


def stop(
    folder: PathLike,
    *,
    wait_min: float = 2.0,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> StopResults:
    """The run or evolution to end.

    Parameters
    ----------
    folder : PathLike
        Run folder, or the folder of an evolution.
    wait_min : float, default 2.0
        Minutes that it may take to end. Default: 2.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    StopResults
        What the command `tropism stop` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> stop("nothing")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.PlanError: stop: nothing: this is no run folder
    """
    return execute(StopPlan(folder=folder, wait_min=wait_min, monitor=monitor, threads=threads))


def study(
    config: AnySettings,
    *,
    out: PathLike = "tropism-study",
    resume: bool = False,
    keep_photographs: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> StudyResults:
    """Repeats the paper on virtual plants.

    Parameters
    ----------
    config : AnySettings
        Everything that decides the results.
    out : PathLike, default "tropism-study"
        Folder of the study.
    resume : bool, default False
        Whether to continue a study in `out`.
    keep_photographs : bool, default False
        Whether every photograph and the stems of the ground truth are kept: some 700 MB at the paper's size.
        Otherwise a run keeps what figures show of it.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    StudyResults
        What the command `tropism study` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> study(tropism.quick_study(), out="study").is_virtual
    True
    """
    return execute(
        StudyPlan(
            config=config, out=out, resume=resume, keep_photographs=keep_photographs, monitor=monitor, threads=threads
        )
    )


def timelapse(
    folder: PathLike,
    out: PathLike,
    *,
    width: int = 480,
    fps: int = 20,
    every: int | None = None,
    crop: Any | None = None,
    plain: bool = False,
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> TimelapseResults:
    """The film to make.

    Parameters
    ----------
    folder : PathLike
        Run folder, or a folder of photographs.
    out : PathLike
        Film, `.gif` or `.mp4`; with `.jpg` the composite alone is made.
    width : int, default 480
        Width in pixels, 16 to 8192; no larger than the photographs, or four times the part of crop.
    fps : int, default 20
        Pictures a second, 1 to 50.
    every : int, default None
        Takes each Nth photograph; if it is left out, as many as give 300 pictures at most.
    crop : Any, default None
        The part of the photographs that is shown; all of it if it is left out.
    plain : bool, default False
        Whether nothing is drawn into the photographs but the label of a virtual plant.
    replace : bool, default False
        Whether a film or a picture that is there is replaced.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    TimelapseResults
        What the command `tropism timelapse` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> _ = tropism.run({"task": {"max_steps": 3}}, out="run")
    >>> _ = timelapse("run", "film.gif", width=216)
    """
    return execute(
        TimelapsePlan(
            folder=folder,
            out=out,
            width=width,
            fps=fps,
            every=every,
            crop=crop,
            plain=plain,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def track(
    photographs: PathLike | Sequence[PathLike],
    *,
    out: PathLike = "track.csv",
    scale: Any = "paper_camera",
    plants: Sequence[AnySettings] | None = None,
    light: Any = "auto",
    time: Literal["auto", "exif", "name", "even"] = "auto",
    period_min: float | None = None,
    default_period_min: float = 5.0,
    vision: AnySettings | None = None,
    find_up: bool = False,
    each: bool = False,
    overlay: PathLike | None = None,
    sheet: PathLike | None = None,
    resume: bool = False,
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> TrackResults:
    """Photographs to track, and how.

     The default tracks one plant in the whole picture of the paper's camera, with photographs five minutes apart
    where no times are known (section 2.2.1).

    Parameters
    ----------
    photographs : PathLike | Sequence[PathLike]
        Photographs (JPEG, PNG or TIFF), films, or folders of them.
    out : PathLike, default "track.csv"
        CSV file of the track; with several plants `track.csv` becomes `track-NAME.csv`. Beside it are written the
        same name with `.json` and, one for all plants, with `.frames.jsonl`.
    scale : Any, default "paper_camera"
        How pixels become centimetres.
    plants : Sequence[AnySettings], default None: the paper's
        The plants to track.
    light : Any, default "auto"
        What says which lamp is lit.
    time : Literal["auto", "exif", "name", "even"], default "auto"
        What says when a photograph was taken.
    period_min : float, default None
        Minutes from one step to the next; `None` takes the median interval of the photographs.
    default_period_min : float, default 5.0
        Minutes from one step to the next where `period_min` is `None` and no times are known.
    vision : AnySettings, default None: the paper's
        How plants are detected. The crop of a plant is its region.
    find_up : bool, default False
        Whether the direction in which the only plant grows is found, where `vision` says up: by its motion, or by
        its stem in the first photographs if its region or its root is given.
    each : bool, default False
        Whether the photographs have nothing to do with each other, such as a folder of many plants: none is
        compared with another, and each plant that is detected is accepted. So is the only photograph of a series.
    overlay : PathLike, default None
        Folder for a copy of each photograph with the detections drawn in.
    sheet : PathLike, default None
        JPEG file for a contact sheet of up to 24 photographs with the detections drawn in.
    resume : bool, default False
        Whether to continue from the journal of the same plan, and take new photographs in.
    replace : bool, default False
        Whether to replace existing results.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    TrackResults
        What the command `tropism track` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> import glob
    >>> task = {"kind": "open_loop", "max_steps": 2}
    >>> _ = tropism.grow(plants=1, task=task, out="photographed", photographs=True)
    >>> photographs = sorted(glob.glob("photographed/*/photographs/*.jpg"))
    >>> track(photographs, out="tracks").tracks[0].frames
    3
    """
    return execute(
        TrackPlan(
            photographs=photographs,
            out=out,
            scale=scale,
            plants=plants,
            light=light,
            time=time,
            period_min=period_min,
            default_period_min=default_period_min,
            vision=vision,
            find_up=find_up,
            each=each,
            overlay=overlay,
            sheet=sheet,
            resume=resume,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def transfer(
    controllers: Sequence[AnyController] | Mapping[str, AnyController],
    *,
    plants: int = 90,
    plant_seeds: range | Settings | None = None,
    task: AnyTask | None = None,
    random_targets: bool | None = None,
    greenhouse: AnySettings | None = None,
    period_min: float = 5.0,
    photographs: bool = False,
    model: AnyModel | None = None,
    optimum: bool = False,
    reference: str | None = None,
    seed: int = 1,
    resume: bool = False,
    out: PathLike = "transfer",
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> TransferResults:
    """Lets each of several controllers steer the same unseen virtual plants.

    Parameters
    ----------
    controllers : Sequence[AnyController] | Mapping[str, AnyController]
        The controllers.
    plants : int, default 90
        Number of plants, 1 to 100000. Their seeds follow from `seed`; none is a plant of an experiment under any
        seed.
    plant_seeds : range | Settings, default None
        Seeds of the plants, from the first to the one before the last, instead of `plants`.
    task : AnyTask, default None: the paper's three targets
        Task of the controllers; it has targets.
    random_targets : bool, default None
        Whether each plant has a random sequence of targets of its own, as many as `task` has and as high at most
        (`docs/how-to/draw-a-task.md` states the rule).
    greenhouse : AnySettings, default None: the paper's
        Species, lamps and tent.
    period_min : float, default 5.0
        Time from one step to the next, in min. Paper: 5 (section 2.1).
    photographs : bool, default False
        Whether the tip is measured in photographs.
    model : AnyModel, default None
        File of the tip-motion model on which the controllers were made: misses where it has no data are then
        distinguished.
    optimum : bool, default False
        Whether to search the best schedule of lamps for each plant.
    reference : str, default None
        Name of the controller that stands for what a rule without knowledge of the future can reach.
    seed : int, default 1
        Seed of the plants and of the bootstrap.
    resume : bool, default False
        Whether to continue a comparison in `out`.
    out : PathLike, default "transfer"
        Folder for tracks and results.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    TransferResults
        What the command `tropism transfer` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> plants = {"plants": 2, "task": {"max_steps": 20}}
    >>> [row.name for row in transfer(["greedy", "periodic"], out="transfer", **plants).controllers]
    ['greedy', 'periodic']
    """
    return execute(
        TransferPlan(
            controllers=controllers,
            plants=plants,
            plant_seeds=plant_seeds,
            task=task,
            random_targets=random_targets,
            greenhouse=greenhouse,
            period_min=period_min,
            photographs=photographs,
            model=model,
            optimum=optimum,
            reference=reference,
            seed=seed,
            resume=resume,
            out=out,
            monitor=monitor,
            threads=threads,
        )
    )


def tune(
    model: AnyModel | None,
    *,
    beans: AnySettings | None = None,
    period_min: float = 5.0,
    task: AnyTask | None = None,
    search: AnySettings | None = None,
    seed: int = 1,
    out: PathLike = "rule.json",
    replace: bool = False,
    resume: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> TuneResults:
    """Tunes the nine parameters of a rule on simulated plants of a model, and writes the rule to a file.

    Parameters
    ----------
    model : AnyModel
        File of the model.
    beans : AnySettings, default None
        Virtual beans to tune on instead of a model: species, variation and lamps count. What is found is the best
        that such a rule can be expected to reach on them, which no replicate could know.
    period_min : float, default 5.0
        Time from one step of virtual beans to the next, in min. A model has its own.
    task : AnyTask, default None: the paper's three targets
        Task of the rule.
    search : AnySettings, default None: the paper's
        Generations, rules a generation, and plants a rule.
    seed : int, default 1
        Seed of all random numbers.
    out : PathLike, default "rule.json"
        File for the rule.
    replace : bool, default False
        Whether a rule that is there is replaced.
    resume : bool, default False
        Whether to continue a search for `out`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    TuneResults
        What the command `tropism tune` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> model = tropism.Model.of_virtual_beans("stem", plants=2, steps=100)
    >>> _ = tune(model, task={"max_steps": 20}, search={"generations": 1}, out="rule.json")
    """
    return execute(
        TunePlan(
            model=model,
            beans=beans,
            period_min=period_min,
            task=task,
            search=search,
            seed=seed,
            out=out,
            replace=replace,
            resume=resume,
            monitor=monitor,
            threads=threads,
        )
    )


def wall(
    *,
    file: AnySettings | None = None,
    rules: Sequence[Any] = ("machine", "dormant"),
    plants: int = 90,
    species: AnySettings | None = None,
    variation: float = 1.0,
    faults: AnySettings | None = None,
    learning_h: float = 24.0,
    period_min: float = 5.0,
    max_steps: int = 1000,
    seed: int = 1,
    out: PathLike | None = None,
    replace: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> WallResults:
    """Grows virtual plants before a wall under each rule.

    Parameters
    ----------
    file : AnySettings, default None: the paper's
        The wall.
    rules : Sequence[Any], default ['machine', 'dormant']
        Rules that run in the nodes, each with the same plants.
    plants : int, default 90
        Number of plants, 1 to 100000.
    species : AnySettings, default None: the paper's
        Species of the plants.
    variation : float, default 1.0
        Individual variation as a multiple of that of the species, 0 to 2.
    faults : AnySettings, default None: the paper's
        Faults of nodes and messages.
    learning_h : float, default 24.0
        For how long the nodes learn the empty scene, in h: 2 to 1000.
    period_min : float, default 5.0
        Time from one step to the next, in min: 0.1 to 60. Paper: 5 (section 2.1).
    max_steps : int, default 1000
        Largest number of steps with the plant, 1 to 100000.
    seed : int, default 1
        Seed of all random numbers.
    out : PathLike, default None
        Folder for figure and journals; none writes nothing.
    replace : bool, default False
        Whether files that are there are replaced.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    WallResults
        What the command `tropism wall` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> [rule] = wall(rules=["machine"], plants=2).rules
    >>> rule.whole.of
    2
    """
    return execute(
        WallPlan(
            file=file,
            rules=rules,
            plants=plants,
            species=species,
            variation=variation,
            faults=faults,
            learning_h=learning_h,
            period_min=period_min,
            max_steps=max_steps,
            seed=seed,
            out=out,
            replace=replace,
            monitor=monitor,
            threads=threads,
        )
    )


def wall_study(
    config: AnySettings,
    *,
    out: PathLike = "walls",
    resume: bool = False,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> WallStudyResults:
    """Tests rules of nodes on many walls, in a folder that can be resumed.

    Parameters
    ----------
    config : AnySettings
        Everything that decides the results.
    out : PathLike, default "walls"
        Folder for networks, figures and results.
    resume : bool, default False
        Whether to continue in `out`.
    monitor : Monitor or False, default None
        What hears of the work: None shows progress on stderr, False shows nothing.
    threads : int, default None
        Number of threads; None is one a core. Results do not depend on it.

    Returns
    -------
    WallStudyResults
        What the command `tropism study` prints with --json.

    Raises
    ------
    PlanError
        If the plan cannot be executed; the text names the key.
    TropismError
        If the work fails.

    Examples
    --------
    >>> [wall] = wall_study({"plants": 2, "walls": [{"name": "a"}]}, out="walls", monitor=False).walls
    >>> [rule] = wall.rules
    >>> rule.whole.of
    2
    """
    return execute(WallStudyPlan(config=config, out=out, resume=resume, monitor=monitor, threads=threads))
