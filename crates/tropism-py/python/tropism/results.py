"""Results of workflows: the JSON that the command line prints with --json, with typed attributes and a table in notebooks."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar


def _wrapped(value: Any, kind: type[Results]) -> Any:
    if isinstance(value, dict):
        return kind(value)
    if isinstance(value, list):
        return [_wrapped(item, kind) for item in value]
    return value


class Results(Mapping[str, Any]):
    """What a workflow found. Keys are attributes, too: `results.mean_fitness` is `results["mean_fitness"]`.

    Those that a subclass names have a type; one that is named and not there is None.
    """

    #: The results of a workflow that are results themselves: the type of each.
    _kinds: ClassVar[Mapping[str, type[Results]]] = {}

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

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
            text = json.dumps(value)
            text = text if len(text) <= 300 else text[:300] + " …"
            rows.append(f"<tr><th style='text-align:left'>{html.escape(key)}</th><td>{html.escape(text)}</td></tr>")
        label = "<p><em>virtual plants</em></p>" if self._values.get("is_virtual") else ""
        figures = "".join(path.read_text(encoding="utf-8") for path in self.figures())
        return f"{label}<table>{''.join(rows)}</table>{figures}"


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
    held: int
    fitness: float | None
    #: File of the track.
    track: str


class TrainingResults(Results):
    """How the training of an LSTM went."""

    epochs: int
    error: float


class FitResults(Results):
    """Of `fit`."""

    #: File of the model.
    model: str
    tracks: int
    is_virtual: bool
    shifts: int
    #: Least and greatest x and y of the tips.
    x_cm: list[float]
    y_cm: list[float]
    #: Of an LSTM.
    training: TrainingResults | None
    _kinds = {"training": TrainingResults}


class ForecastError(Results):
    """The error of forecasts at one horizon."""

    mean_cm: float
    interval_cm: list[float]
    sd_cm: float
    within_90: float | None


class ModelForecasts(Results):
    """How well a model predicts."""

    name: str
    laboratories: int
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


class TuneResults(Results):
    """Of `tune`."""

    #: File of the rule.
    out: str
    is_virtual: bool
    rule: Results
    in_model: Scores
    expected: Scores | None
    #: Why nothing is expected.
    withheld: str | None
    chase: Scores
    cpu_seconds: float
    _kinds = {"in_model": Scores, "expected": Scores, "chase": Scores}


class SimulateResults(Results):
    """Of `simulate`."""

    #: File of the track of the first plant.
    track: str
    episodes: int
    mean_fitness: float
    sd_fitness: float
    best: float
    steps_without_data: float


class ControllerResults(Results):
    """A controller on the plants of a comparison."""

    name: str
    description: str
    #: On each plant.
    fitness: list[float]
    mean: float
    #: 95 % interval of the mean.
    interval: list[float]
    sd: float
    quantiles: list[float]
    under_9: float
    under_6: float
    expected: float | None
    share_of_expected: float | None
    share_of_bound: float | None
    share_of_ceiling: float | None
    median_cm: float | None
    #: Share of the plants on which the whole task was done, for tasks that can be done.
    done: Results | None
    targets: list[Results]
    missed: Results
    reached: Results


class TransferResults(Results):
    """Of `transfer`."""

    schema: str
    version: str
    is_virtual: bool
    species: str
    scale: float
    plants: int
    photographs: bool
    seed: int
    #: True where each plant has targets of its own.
    random_targets: bool | None
    best_possible: float
    controllers: list[ControllerResults]
    #: Differences of each two controllers.
    pairs: list[Results]
    bound: str | None
    mean_ceiling: float | None
    _kinds = {"controllers": ControllerResults}


class SweepRow(Results):
    """A setting of a sweep."""

    setting: str
    #: The world and the recipe, of laboratories.
    case: str | None
    seeds: int
    runs: int
    mean: float
    sd: float
    five_numbers: list[float]
    mean_in_model: float | None
    saturation_generation: float | None
    evaluations: float | None
    cpu_seconds: float | None


class UnitCost(Results):
    """What a unit of a sweep on Ray cost, and where it worked."""

    number: int
    host: str
    process: int
    wall_seconds: float
    cpu_seconds: float
    bytes: int


class SweepResults(Results):
    """Of `sweep`."""

    schema: str
    version: str
    is_virtual: bool
    seeds: list[int]
    rows: list[SweepRow]
    pairs: list[Results]
    #: With the engine ray.
    units: list[UnitCost] | None
    _kinds = {"rows": SweepRow, "units": UnitCost}
