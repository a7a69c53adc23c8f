"""The closed loop with parts of your own: photograph, tip, controller, lamps, plant.

    class Upright(Controller):
        def decide(self, seen):
            return "left" if seen.x > 0 else "right"

    track, fitness = grow(Upright(), seed=1)          # a virtual bean, without photographs
    tent = Tent(seed=1)
    track, fitness = run(tent, Upright())             # the same bean through photographs
    model = Model.of_virtual_beans()
    track, fitness = simulate(model, Upright())       # the tip-motion model

Each part may be a subclass of a class here: `PlantModel`, `Task`, `Controller`, `Camera`, `Lamps`, `Flash`, `Clock`. An
exception of a part ends the loop, puts the lamps out, and is raised. Places are (x, y) in cm.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tropism import _core, edge
from tropism._core import Genome, Noise, Observation
from tropism.edge import AnyController, AnySettings, AnyTask
from tropism.errors import PlanError, TropismError, WrongTypeError, of_call
from tropism.models import Model
from tropism.tracks import Track

__all__ = [
    "Camera",
    "Clock",
    "Controller",
    "CoreController",
    "Evolved",
    "Flash",
    "Lamps",
    "Model",
    "NetworkController",
    "Noise",
    "Observation",
    "PlantModel",
    "Rig",
    "SideCamera",
    "Task",
    "Tent",
    "evolve",
    "greenhouse_for",
    "grow",
    "run",
    "simulate",
    "species",
]

Point: TypeAlias = "tuple[float, float]"
Settings: TypeAlias = Mapping[str, Any]


class Controller:
    """Decides which lamp is lit until the next observation."""

    def decide(self, seen: Observation) -> int | str:
        """The lamp for what is seen now, by number or name. Called once a step, in order: a controller may remember."""
        raise NotImplementedError(f"{type(self).__name__} lacks decide(seen)")

    def miss(self, steps: int) -> None:
        """Tells that `steps` steps have passed at which nothing was decided."""


class Task:
    """What a plant is to do, and how well it did."""

    #: Tip of the seedling at the start of a simulated experiment, in cm.
    start: Point = (0.0, 4.0)
    #: Points to visit, from the lowest to the highest, in cm: for controllers that steer towards them.
    targets: Sequence[Point] = ()

    def is_over(self, step: int, seen: Observation) -> bool:
        """Whether an experiment is over when the plant is `seen` at `step` (from 0)."""
        raise NotImplementedError(f"{type(self).__name__} lacks is_over(step, seen)")

    def step_fitness(self, first: Observation, before: Observation, after: Observation) -> float:
        """What the step from `before` to `after` is worth; larger is better. `first` is the first observation."""
        raise NotImplementedError(f"{type(self).__name__} lacks step_fitness(first, before, after)")


class PlantModel:
    """A model of how a plant moves and grows: the model is fixed, the plant is a value of any type."""

    #: Minutes of a step.
    period_min: float = 5.0
    #: Lamps, {"name", "at": [x, y, z]} each, x to the right, y up, z towards the camera, in cm. None: the paper's two.
    lamps: Sequence[Settings] | None = None

    def seedling(self, start: Point, noise: Noise) -> Any:
        """The plant at the start of an experiment, with its tip at `start` (cm)."""
        raise NotImplementedError(f"{type(self).__name__} lacks seedling(start, noise)")

    def step(self, plant: Any, light: int, noise: Noise) -> Any:
        """The plant after one step under lamp `light`. It is a new value: `plant` itself must not change."""
        raise NotImplementedError(f"{type(self).__name__} lacks step(plant, light, noise)")

    def observe(self, plant: Any) -> Point | tuple[float, float, Sequence[Point]]:
        """What a camera would see: (x, y) of the tip, or (x, y, points of the stem from the base up), in cm."""
        raise NotImplementedError(f"{type(self).__name__} lacks observe(plant)")


class Camera:
    """Takes photographs."""

    def photograph(self) -> bytes:
        """A fresh photograph: a JPEG, PNG or TIFF file; empty bytes if there is none."""
        raise NotImplementedError(f"{type(self).__name__} lacks photograph()")

    def can_repeat(self) -> bool:
        """Whether another photograph of the same step may come out better."""
        return False


class Lamps:
    """The lamps, of which at most one is lit."""

    def light(self, light: str | None) -> None:
        """Lights the lamp of this name and darkens the others; None darkens all."""
        raise NotImplementedError(f"{type(self).__name__} lacks light(name)")


class Flash:
    """The flash that makes the plant bright in a photograph. This one is none."""

    def flash(self, is_on: bool) -> None:
        """Switches the flash."""


class Clock:
    """Time since the start of an experiment. This one sleeps."""

    def __init__(self) -> None:
        self._start: float | None = None

    def wait_until(self, since_start_s: float) -> None:
        """Returns when this time since the start has come; at once if it has passed."""
        import time

        now = time.monotonic()
        if self._start is None:
            self._start = now
        time.sleep(max(0.0, self._start + since_start_s - now))


_PAPER_LAMPS = [{"name": "left", "at": [-35.0, 30.0, -8.0]}, {"name": "right", "at": [35.0, 30.0, -8.0]}]


@dataclass
class SideCamera:
    """A second camera at the side of the plant: with it, tip and stem are known in space.

    It looks along x at the plane through the root that it faces, and `calibration` maps its photographs to that plane.
    `front_distance_cm` and `distance_cm` are the distances of the front camera and of this one from the plant; `stands` is the
    side on which it stands, as the front camera sees it.
    """

    camera: Any
    calibration: Settings
    front_distance_cm: float
    distance_cm: float
    stands: Literal["left", "right"] = "right"
    vision: Settings = field(default_factory=dict)


@dataclass
class Rig:
    """A tent: its devices, and how its photographs are read.

    `calibration` and `vision` have the keys of docs/reference/rig-file.md; `vision["crop"]` is the region of the plant, and
    `vision["obstacles"]` are things in the picture that are no plant. A task in space needs a camera at the `side`.
    """

    camera: Any
    lamps: Any
    calibration: Settings
    flash: Any = field(default_factory=Flash)
    clock: Any = field(default_factory=Clock)
    vision: Settings = field(default_factory=dict)
    layout: Sequence[Settings] = field(default_factory=lambda: _PAPER_LAMPS)
    period_min: float = 5.0
    side: SideCamera | None = None


class _SideOfTent(Camera):
    """The camera at the side of the virtual tent."""

    def __init__(self, tent: _core.Tent) -> None:
        self._tent = tent

    def photograph(self) -> bytes:
        return self._tent.side_photograph() or b""


class Tent:
    """The virtual tent with one bean: camera, lamps, flash and clock, which jumps. Results of it are virtual.

    `greenhouse` has the keys of docs/reference/virtual-plants.md: species, variation, scene and faults; `seed` selects the
    plant. The tent has what the settings of a `task` need: its obstacles, and for targets in space four lamps and a camera at
    the side.

    >>> import tropism
    >>> tent = tropism.loop.Tent(seed=1)
    >>> tent.photograph()[:2]
    b'\\xff\\xd8'
    """

    def __init__(
        self,
        seed: int = 1,
        greenhouse: AnySettings | None = None,
        period_min: float = 5.0,
        task: AnyTask | None = None,
    ) -> None:
        tent, wanted = edge.greenhouse(greenhouse), edge.task(task)
        self._tent = _core.Tent(json.dumps(tent), seed, period_min, json.dumps(wanted))
        self.period_min = period_min
        self._is_run = False

    def photograph(self) -> bytes:
        """A photograph of the present moment (JPEG); empty if the camera drops it."""
        return self._tent.photograph()

    def side_photograph(self) -> bytes | None:
        """A photograph of this step by the camera at the side (JPEG); empty if it drops it. None without this camera."""
        return self._tent.side_photograph()

    def can_repeat(self) -> bool:
        """False: faults depend on the step alone."""
        return self._tent.can_repeat()

    def light(self, light: str | int | None) -> None:
        """Lights a lamp by its name or number; None darkens all."""
        self._tent.light(light)

    def flash(self, is_on: bool) -> None:
        """Switches the flash."""
        self._tent.flash(is_on)

    def wait_until(self, since_start_s: float) -> None:
        """Lets the plant grow until a time since the start, in s."""
        self._tent.wait_until(since_start_s)

    def truth_csv(self) -> str:
        """Ground truth so far, as CSV. Never read by vision."""
        return self._tent.truth_csv()

    def _check_solids(self, task: Task | Settings | None) -> None:
        if isinstance(task, Mapping) and not self._tent.has_solids_of(json.dumps(dict(task))):
            raise PlanError("found a tent without the obstacles of the task, wanted Tent(..., task=task)")

    def rig(self, camera: Any = None, lamps: Any = None) -> Rig:
        """This tent as a rig, with a camera and lamps of your own in place of its own."""
        calibration: dict[str, Any] = json.loads(self._tent.calibration())
        vision: dict[str, Any] = json.loads(self._tent.vision())
        side = None
        if self._tent.side_photograph() is not None:
            far = self._tent.camera_distance_cm
            # Obstacles are those of the plane that the front camera faces.
            side = SideCamera(_SideOfTent(self._tent), calibration, far, far, vision={**vision, "obstacles": []})
        return Rig(
            camera=self if camera is None else camera,
            lamps=self if lamps is None else lamps,
            flash=self,
            clock=self,
            calibration=calibration,
            vision=vision,
            layout=json.loads(self._tent.layout),
            period_min=self.period_min,
            side=side,
        )


class NetworkController(Controller):
    """A genome as a controller: it sees x and y of the tip, and its one output lights the right lamp above 0.5."""

    def __init__(self, genome: Genome) -> None:
        self._network = _core.Network(genome)

    def decide(self, seen: Observation) -> int:
        return int(self._network.activate([seen.x, seen.y])[0] > 0.5)


class CoreController(Controller):
    """A controller of the core as an object: greedy, periodic, an evolved network or a tuned rule.

    `spec` is a word ("greedy", "periodic"), a file, a genome, or data, such as {"kind": "periodic", "minutes": 360}.

    >>> import tropism
    >>> tropism.loop.CoreController("greedy").decide_at(0.0, 4.0)
    1
    """

    def __init__(
        self,
        spec: AnyController,
        task: AnyTask | None = None,
        layout: Sequence[Settings] | None = None,
        period_min: float = 5.0,
    ) -> None:
        self._made_of = (edge.controller(spec), edge.task(task), edge.plain(list(layout or _PAPER_LAMPS)), period_min)
        controller, wanted, lamps, _ = map(json.dumps, self._made_of)
        self._decider = _core.Decider(controller, wanted, lamps, period_min)

    def decide(self, seen: Observation) -> int:
        """The lamp for what is seen now."""
        return self._decider.decide(seen.x, seen.y, seen.stem, seen.z)

    def decide_at(
        self,
        x: float,
        y: float,
        z: float | None = None,
        stem: Sequence[Sequence[float]] | NDArray[np.float64] | None = None,
    ) -> int:
        """The lamp for a tip at (x, y), or (x, y, z) in space, and points of the stem from the base up; in cm."""
        return self._decider.decide(float(x), float(y), stem, z)

    def __repr__(self) -> str:
        return f"CoreController({self._made_of[0]['kind']!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        # A fresh one: what a controller remembers begins with its experiment.
        return CoreController, self._made_of


def _task(value: Any) -> Any:
    """A task as JSON, one of Python as it is; None is the paper's."""
    return value if isinstance(value, Task) else json.dumps(edge.task(value))


def _controller(value: Any) -> Any:
    """A controller as JSON, one of Python as it is."""
    if isinstance(value, Controller) or (hasattr(value, "decide") and not isinstance(value, Mapping)):
        return value
    return json.dumps(edge.controller(value))


def _model(value: Any) -> Any:
    """A model of the core, or one of Python as it is."""
    if isinstance(value, PlantModel) or hasattr(value, "seedling"):
        return value
    return Model.of(value)._model


def _layout(model: Any) -> str:
    """The lamps of a model of Python; a model of the core knows its own."""
    return json.dumps(list(getattr(model, "lamps", None) or _PAPER_LAMPS)) if hasattr(model, "seedling") else "[]"


def simulate(
    model: Model | PlantModel | edge.PathLike,
    controller: Controller | AnyController = "greedy",
    task: Task | AnyTask | None = None,
    seed: int = 1,
    episode: int = 0,
) -> tuple[Track, float]:
    """Steers plant number `episode` of a model under `seed`: its track and its fitness.

    >>> import tropism
    >>> model = tropism.Model.of_virtual_beans(plants=2, steps=100)
    >>> track, fitness = tropism.loop.simulate(model, task={"max_steps": 10})
    >>> len(track)
    11
    """
    try:
        track, fitness = _core.simulate_loop(
            _model(model), _controller(controller), _task(task), _layout(model), seed, episode
        )
    except TropismError as error:
        raise of_call(error, "loop.simulate") from None
    return Track(track), fitness


def grow(
    controller: Controller | AnyController = "greedy",
    task: Task | AnyTask | None = None,
    seed: int = 1,
    greenhouse: AnySettings | None = None,
    period_min: float = 5.0,
) -> tuple[Track, float]:
    """Steers the virtual bean of `seed` without photographs: its track and its fitness.

    >>> import tropism
    >>> track, fitness = tropism.loop.grow("greedy", {"max_steps": 10})
    >>> len(track)
    11
    """
    tent = json.dumps(edge.greenhouse(greenhouse))
    try:
        track, fitness = _core.grow_loop(tent, _controller(controller), _task(task), seed, period_min)
    except TropismError as error:
        raise of_call(error, "loop.grow") from None
    return Track(track), fitness


def run(
    rig: Rig | Tent, controller: Controller | AnyController = "greedy", task: Task | AnyTask | None = None
) -> tuple[Track, float]:
    """Closes the loop over a rig until the task is over, and puts the lamps out: the track and the fitness.

    Nothing is recorded on the disk: `tropism.run` makes run folders, which survive a power cut.

    >>> import tropism
    >>> track, fitness = tropism.loop.run(tropism.loop.Tent(seed=1), "greedy", {"max_steps": 2})
    >>> len(track)
    3
    """
    wanted = task if isinstance(task, Task) else edge.task(task)
    if isinstance(rig, Tent):
        rig._check_solids(wanted)
        if rig._is_run:
            # Its clock stands at the end of that run: the steps of another would all be due at once.
            raise PlanError("found a tent in which a run was made, wanted a new one: Tent(...)")
        rig._is_run = True
        rig = rig.rig()
    if not isinstance(rig, Rig):
        raise WrongTypeError(f"loop.run: found {edge.kind_of(rig)}, wanted a Rig or a Tent")
    side = rig.side and {
        "camera": rig.side.camera,
        "calibration": json.dumps(dict(rig.side.calibration)),
        "vision": json.dumps(dict(rig.side.vision)),
        "distances_cm": (rig.side.front_distance_cm, rig.side.distance_cm),
        "stands": rig.side.stands,
    }
    track, fitness = _core.rig_loop(
        rig.camera,
        rig.lamps,
        rig.flash,
        rig.clock,
        json.dumps(dict(rig.calibration)),
        json.dumps(dict(rig.vision)),
        json.dumps(list(rig.layout)),
        rig.period_min,
        _controller(controller),
        _task(task),
        side,
    )
    return Track(track), fitness


@dataclass(frozen=True)
class Evolved:
    """The best genome of a run of evolution, its fitness, and statistics of each generation.

    >>> import tropism
    >>> model = tropism.Model.of_virtual_beans(plants=1, steps=60)
    >>> [best] = tropism.loop.evolve(model, {"max_steps": 5}, runs=1, generations=2, neat={"population": 6})
    >>> best.genome.inputs
    2
    """

    genome: Genome
    fitness: float
    history: list[dict[str, float]]


def evolve(
    model: Model | PlantModel | edge.PathLike, task: Task | AnyTask | None = None, seed: int = 1, **evolution: Any
) -> list[Evolved]:
    """Evolves networks for a task on a model, either of which may be your own: one result a run.

    `evolution` has the keys of studies/evolution.toml: runs, generations, episodes, neat, sensors, start, method.

    >>> import tropism
    >>> model = tropism.Model.of_virtual_beans(plants=1, steps=60)
    >>> len(tropism.loop.evolve(model, {"max_steps": 5}, runs=2, generations=2, neat={"population": 6}))
    2
    """
    settings = json.dumps(edge.settings(evolution, "evolution"))
    try:
        runs = _core.evolve_loop(_model(model), _task(task), settings, _layout(model), seed)
    except TropismError as error:
        raise of_call(error, "loop.evolve") from None
    return [Evolved(genome, fitness, json.loads(history)) for genome, fitness, history in runs]


def greenhouse_for(task: AnyTask, greenhouse: AnySettings | None = None) -> dict[str, Any]:
    """The `greenhouse` of `tropism.grow` and others with what a task needs: obstacles; in space, four lamps and two cameras.

    >>> import tropism
    >>> len(tropism.loop.greenhouse_for({"kind": "space", "targets": [[2, 6]], "depths_cm": [1]})["layout"])
    4
    """
    text = _core.greenhouse_for(json.dumps(edge.task(task)), json.dumps(edge.greenhouse(greenhouse)))
    values: dict[str, Any] = json.loads(text)
    return values


def species(path: edge.PathLike) -> dict[str, Any]:
    """The plants of a bean file, for the key `bean` of a greenhouse: `beans/internodal-bean.toml` bends by other equations.

    >>> import tropism
    >>> tropism.loop.species("nothing.toml")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.MissingFileError: nothing.toml: cannot read
    """
    return edge.species(path)
