"""Learning environments (Gymnasium 1.x): a plant is to be led from target to target by the choice of the lit lamp.

| id | plant | observation |
|---|---|---|
| tropism/TipModel-v0 | a plant of the tip-motion model, eqs. (1)-(8) | the tip, (x, y) in cm |
| tropism/Bean-v0 | a virtual bean | its true tip, or that of the paper's detector, (x, y) in cm |
| tropism/Stem-v0 | a plant of the model of the whole stem | the tip, and ten points of the stem from the base up, in cm |
| tropism/Tent-v0 | a virtual bean through photographs | the picture, (height, width, 3) |
| tropism/Obstacles-v0 | a virtual bean that obstacles hold back | tip, ten points of the stem, nearest obstacle: (27,) in cm |
| tropism/Space-v0 | a virtual bean among four lamps | the tip, (x, y, z) in cm |
| tropism/Wall-v0 | a virtual bean before nodes that steer together | seven numbers a node; of PettingZoo: `tropism.wall_v0` |

All but the last one: the action is the number of the lamp that is lit for one step of five minutes (0 left, 1 right; in space
2 front, 3 back). The reward is the fitness of the step; its sum is the fitness of the episode: eq. (9), in cm, at most 15 for the
paper's targets. An episode ends at the height of 13.8 cm (13 cm among obstacles), and is truncated after 1000 steps.
`reset(seed=s)` gives the plants of `tropism simulate --seed s` and `tropism grow --seed s`, in order: the first with the seed, then
the next one at each reset without a seed; `info` has `plant` (its number under the seed), `seed`, `step` and `fitness` (the sum of
the rewards). With `plants="transfer"` beans are those of `tropism transfer --seed s`.

Obstacles-v0: the task is that of `tasks/disc.toml`, a disc above the seedling and a target above the disc. The observation holds
the tip (2), ten points of the stem from the base up (20), the gap between the surfaces of the stem and of the nearest obstacle (1;
100 without obstacles), the point of the stem that is nearest to it (2), and the point of the obstacle that it should keep away
from (2; of a disc its centre). `env.unwrapped.task` has all obstacles. A target that the tip passes within reach is worth 2; each
contact costs 2, each step of it 0.02. A plant that leans on an obstacle is held back by it. `info` has `touches`, `gap_cm`,
`contact_steps` (observations so far at which the stem touched), `contact_points` (where the stem presses: number of the obstacle,
place in cm, force on the stem in dyn), `target_distances_cm` (distance of the tip from each target at the target's height;
infinite before), and at the end `is_done`: all targets within reach, and no contact.

Space-v0: the task is that of `tasks/space.toml`, three targets in space. The reward is the horizontal way towards the next target.
`info` has `target_distances_cm`, in space. A rendered picture shows both cameras side by side: front, and from the right.

`gymnasium.make_vec(id, num_envs=1024)` steps many plants side by side in Rust. Plant i has the seed s + i. All three modes of
`gymnasium.vector.AutoresetMode` are there (`make_vec(..., autoreset_mode=AutoresetMode.SAME_STEP)`): NEXT_STEP (the default)
begins a finished episode at the next step, whose action is ignored; SAME_STEP begins it at once, with the last observation in
`info["final_obs"]`; DISABLED leaves it to `reset(options={"reset_mask": mask})`. For Stable-Baselines3 see `tropism.sb3`.

`dtype="float32"` gives observations in single precision. An environment is copied and pickled by its seed and its actions. A step
before `reset`, or after the end of an episode, is an error.

Processes of `gymnasium.make_vec(id, vectorization_mode="async")` must be spawned, for threads do not survive a fork:
`vector_kwargs={"context": "spawn"}`.

Options: `task` (keys of a task file, or its path), `greenhouse` (keys of docs/reference/virtual-plants.md: `scale` is how much
plants vary, `bean` the species, which may be `tropism.loop.species("beans/internodal-bean.toml")`, a second plant simulator
with other equations; `faults` of the camera in Tent-v0), `period_min`, `model` (a `Model` or a model file).

Version history: all v0, the first. A change of a plant, a reward or an observation makes a new version.
"""

from __future__ import annotations

import copy
import json
import math
import operator
import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, TypeAlias, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from tropism import _core, edge
from tropism._register import MAX_STEPS, register_envs
from tropism.errors import PlanError, WrongTypeError
from tropism.models import Model

register_envs()

__all__ = [
    "BeanEnv",
    "BeanVector",
    "ObstaclesEnv",
    "ObstaclesVector",
    "SpaceEnv",
    "SpaceVector",
    "StemEnv",
    "StemVector",
    "TentEnv",
    "TentVector",
    "TipModelEnv",
    "TipModelVector",
]

#: Observations: of float64, or of float32 by option.
Floats = NDArray[Any]
Settings = Mapping[str, Any]

#: Which plants a seed stands for: those of `tropism grow`, or those of `tropism transfer`.
Series: TypeAlias = Literal["grow", "transfer"]

#: The task of tropism/Obstacles-v0: that of tasks/disc.toml.
DISC: Settings = {
    "kind": "obstacles",
    "targets": [[0.0, 13.0]],
    "obstacles": [{"disc": [0.0, 8.0], "radius_cm": 1.0}],
    "way_points": [[-3.0, 10.0]],
}
#: The task of tropism/Space-v0: that of tasks/space.toml.
SPACE: Settings = {
    "kind": "space",
    "targets": [[2.0, 6.5], [-2.0, 10.0], [1.0, 13.5]],
    "depths_cm": [1.5, 2.0, -1.5],
}

#: Bounds of places, in cm: an experiment of 1000 steps ends below 40 cm.
FARTHEST_CM = 100.0
#: Rows and columns of a rendered picture.
PICTURE = (324, 432)
#: Pixels per cm of a picture, and the row of the soil: those of a photograph of the virtual tent.
PX_PER_CM = PICTURE[1] / 74.0
SOIL_ROW = (PICTURE[0] - 1) / 2 + 20 * PX_PER_CM

#: Default models that this process has computed.
_MODELS: dict[str, Model] = {}


def default_model(kind: str) -> Model:
    """The model of six virtual beans (seed 1) under periodic lamps, as in the paper's open-loop experiments."""
    if kind not in _MODELS:
        _MODELS[kind] = Model.of_virtual_beans(kind)
    return _MODELS[kind]


def _model(model: Model | str | os.PathLike[str] | None, kind: str) -> Model:
    if model is None:
        return default_model(kind)
    return Model.of(model)


def _task(task: edge.AnyTask | None) -> str:
    return json.dumps(edge.task(task))


def _limited(task: str, max_episode_steps: int | None) -> str:
    """A task with at most so many steps: the wrapper TimeLimit, which there is for single environments alone."""
    if max_episode_steps is None:
        return task
    if max_episode_steps < 1:
        raise PlanError(f"max_episode_steps: found {max_episode_steps}, wanted 1 or more")
    settings = json.loads(task)
    return json.dumps({**settings, "max_steps": min(settings.get("max_steps", MAX_STEPS), max_episode_steps)})


def _greenhouse(greenhouse: edge.AnySettings | None) -> str:
    return json.dumps(edge.greenhouse(greenhouse))


def _dtype(dtype: Any) -> np.dtype[Any]:
    kind: np.dtype[Any] = np.dtype(dtype)
    if kind not in (np.dtype(np.float32), np.dtype(np.float64)):
        raise PlanError(f"dtype: found {dtype!r}, wanted float32 or float64")
    return kind


def _box(width: int, dtype: np.dtype[Any]) -> spaces.Space[Floats]:
    box: Any = spaces.Box(-FARTHEST_CM, FARTHEST_CM, (width,), dtype.type)
    return cast("spaces.Space[Floats]", box)


def _actions(actions: Any, count: int) -> NDArray[np.int64]:
    """Whole numbers, one a plant; nothing is rounded."""
    found = np.asarray(actions)
    if found.dtype.kind not in "iub":
        raise WrongTypeError(f"actions: found {found.dtype}, wanted whole numbers: the lamp of each plant")
    if found.shape != (count,):
        raise PlanError(f"actions: found an array of shape {found.shape}, wanted ({count},)")
    return np.ascontiguousarray(found, np.int64)


class _Remembers:
    """Keeps the arguments of the constructor, so that copies and pickles construct anew and grow the same plants again."""

    _arguments: tuple[tuple[Any, ...], dict[str, Any]]

    def __new__(cls, *arguments: Any, **named: Any) -> Any:
        new = super().__new__(cls)
        new._arguments = (arguments, named)
        return new

    def _kept(self) -> dict[str, Any]:
        """What is kept beside the arguments."""
        raise NotImplementedError

    def _take(self, kept: dict[str, Any]) -> None:
        """Takes what `_kept` gave."""
        raise NotImplementedError

    def __reduce__(self) -> tuple[Any, ...]:
        return _remade, (type(self), *self._arguments), self._kept()

    def __setstate__(self, kept: dict[str, Any]) -> None:
        self._take(kept)

    def __deepcopy__(self, memo: Any) -> Any:
        new = _remade(type(self), *self._arguments)
        new._take(copy.deepcopy(self._kept()))
        return new

    def __copy__(self) -> Any:
        return self.__deepcopy__({})


def _remade(kind: Any, arguments: tuple[Any, ...], named: dict[str, Any]) -> Any:
    return kind(*arguments, **named)


class _Drawn:
    """An environment that draws itself: as an array on demand, or in a window at each step."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 12}
    render_mode: str | None
    _window: _Window | None = None

    def _picture(self) -> NDArray[np.uint8]:
        """What there is to see now."""
        raise NotImplementedError

    def _show(self) -> None:
        if self.render_mode == "human":
            self._window = self._window or _Window()
            self._window.show(self._picture(), self.metadata["render_fps"])

    def render(self) -> NDArray[np.uint8] | None:
        """A picture of the plant, rows x columns x 3, in the mode rgb_array."""
        return self._picture() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None


class _PlantEnv(_Remembers, _Drawn, gymnasium.Env[Floats, np.int64]):
    """One plant whose places are observed."""

    def __init__(self, batch: _core.Batch, render_mode: str | None, dtype: Any = np.float64) -> None:
        self._batch = batch
        self._dtype = _dtype(dtype)
        #: The task with all its keys, as in a task file.
        self.task: dict[str, Any] = json.loads(batch.task)
        #: The lamps: name and place of each, in the order of the actions.
        self.layout: list[dict[str, Any]] = json.loads(batch.layout)
        #: The best fitness there can be; None where it is not known.
        self.best_fitness = batch.best_fitness
        self.observation_space = _box(batch.width, self._dtype)
        self.action_space = cast("spaces.Space[np.int64]", spaces.Discrete(len(batch.lamps)))
        self.render_mode = render_mode
        self._is_begun = False
        self._fitness = 0.0
        self._step = 0
        self._plant: dict[str, int] = {}
        self._trail: list[Sequence[float]] = []

    def _kept(self) -> dict[str, Any]:
        # The random state only where something was drawn: the property makes one.
        random = self.__dict__.get("_np_random")
        names = ("_is_begun", "_fitness", "_step", "_plant", "_trail")
        return {
            "plants": self._batch.saved(),
            "random": random,
            "random_seed": self.__dict__.get("_np_random_seed"),
            **{name: getattr(self, name) for name in names},
        }

    def _take(self, kept: dict[str, Any]) -> None:
        kept = dict(kept)
        self._batch.restore(kept.pop("plants"))
        random, seed = kept.pop("random"), kept.pop("random_seed")
        if random is not None:
            self._np_random, self._np_random_seed = random, seed
        self.__dict__.update(kept)

    def _info(self) -> dict[str, Any]:
        return {"step": self._step, **self._plant, "fitness": self._fitness, "is_virtual": True}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode: the first plant of `seed`, or the next one without a seed."""
        super().reset(seed=seed)
        if seed is None and not self._is_begun:
            seed = int(self.np_random.integers(2**32))
        seen = self._batch.reset(None if seed is None else [seed])[0]
        self._is_begun, self._fitness, self._step = True, 0.0, 0
        _, plant, seed = self._batch.state()
        self._plant = {"plant": plant, "seed": seed}
        self._trail = [self._place(seen)]
        self._show()
        return seen.astype(self._dtype, copy=False), self._info()

    def _place(self, seen: Sequence[float] | Floats) -> Sequence[float]:
        """The tip of an observation: x, y, z in cm."""
        return (float(seen[0]), float(seen[1]), 0.0)

    def step(self, action: np.int64 | int) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Lights a lamp for one step."""
        seen, reward, terminated, truncated = self._batch.step_one(action)
        self._fitness += reward
        self._step += 1
        if self.render_mode is not None:
            self._trail.append(self._place(seen))
            self._show()
        return np.array(seen, self._dtype), reward, terminated, truncated, self._info()

    def _picture(self, view: str = "front") -> NDArray[np.uint8]:
        return _drawn(self._batch, 0, self._batch.seen()[0], self._trail[:-1], view)


class TipModelEnv(_PlantEnv):
    """A plant of the tip-motion model. `model`: a `Model` or a model file; by default that of six virtual beans."""

    def __init__(
        self,
        model: Model | str | os.PathLike[str] | None = None,
        task: edge.AnyTask | None = None,
        render_mode: str | None = None,
        dtype: Any = np.float64,
    ) -> None:
        super().__init__(_core.Batch.of_model(_model(model, "tip")._model, _task(task)), render_mode, dtype)


class StemEnv(_PlantEnv):
    """A plant of the model of the whole stem: 22 numbers, the tip and ten points from the base up."""

    def __init__(
        self,
        model: Model | str | os.PathLike[str] | None = None,
        task: edge.AnyTask | None = None,
        render_mode: str | None = None,
        dtype: Any = np.float64,
    ) -> None:
        super().__init__(
            _core.Batch.of_model(_model(model, "stem")._model, _task(task), has_stem=True), render_mode, dtype
        )


class BeanEnv(_PlantEnv):
    """A virtual bean without photographs. `tip`: "true", or "detector" with the grid and the noise of the paper's detector."""

    # What is observed, and the task where none is given.
    _observed: ClassVar[str] = "tip"
    _task: ClassVar[Settings | None] = None

    def __init__(
        self,
        greenhouse: edge.AnySettings | None = None,
        task: edge.AnyTask | None = None,
        tip: Literal["true", "detector"] = "true",
        period_min: float = 5.0,
        plants: Series = "grow",
        render_mode: str | None = None,
        dtype: Any = np.float64,
    ) -> None:
        task = self._task if task is None else task
        settings = (_greenhouse(greenhouse), _task(task), 1, period_min, tip, self._observed, plants)
        super().__init__(_core.Batch.of_beans(*settings), render_mode, dtype)


class ObstaclesEnv(BeanEnv):
    """A virtual bean among obstacles. With `tip="detector"` tip and stem have the noise of the paper's detector."""

    _observed = "obstacles"
    _task = DISC

    def _info(self) -> dict[str, Any]:
        info = _progress(self._batch)
        own = {key: value[0] for key, value in info.items()}
        return {**super()._info(), **own, "contact_points": self._batch.contact_points()}


class SpaceEnv(BeanEnv):
    """A virtual bean among four lamps, seen by two cameras. With `tip="detector"` the tip is triangulated from two detectors'."""

    _observed = "space"
    _task = SPACE

    def _info(self) -> dict[str, Any]:
        distances = self._batch.progress()[3][0]
        return {**super()._info(), "target_distances_cm": distances}

    def _place(self, seen: Sequence[float] | Floats) -> Sequence[float]:
        return (float(seen[0]), float(seen[1]), float(seen[2]))

    def _picture(self, view: str = "both") -> NDArray[np.uint8]:
        both = [super(SpaceEnv, self)._picture(view) for view in ("front", "side")]
        return np.concatenate(both, axis=1)


def _progress(batch: _core.Batch) -> dict[str, NDArray[Any]]:
    """Contacts and distances of each plant among obstacles."""
    touches, gap_cm, contact_steps, distances = batch.progress()
    reach = math.inf if batch.reach_cm is None else batch.reach_cm
    return {
        "touches": touches,
        "gap_cm": gap_cm,
        "contact_steps": contact_steps,
        "target_distances_cm": distances,
        "is_done": (contact_steps == 0) & (distances <= reach).all(axis=1),
    }


def _tents(
    greenhouse: edge.AnySettings | None,
    task: edge.AnyTask | None,
    vision: edge.AnySettings | None,
    size: tuple[int, int],
    period_min: float,
    count: int,
) -> _core.TentBatch:
    settings = edge.greenhouse(greenhouse)
    settings["scene"] = {"width": size[0], "height": size[1], **settings.get("scene", {})}
    vision_text = json.dumps(edge.settings(vision, "vision"))
    return _core.TentBatch(json.dumps(settings), _task(task), vision_text, period_min, count)


class TentEnv(_Remembers, _Drawn, gymnasium.Env[NDArray[np.uint8], np.int64]):
    """A virtual bean through photographs with flash; the reward is of the tip that the tracker finds in them.

    `width` and `height` are those of the photographs; `vision` has the keys of docs/reference/rig-file.md.
    """

    def __init__(
        self,
        greenhouse: edge.AnySettings | None = None,
        task: edge.AnyTask | None = None,
        vision: edge.AnySettings | None = None,
        width: int = 432,
        height: int = 324,
        period_min: float = 5.0,
        render_mode: str | None = None,
    ) -> None:
        self._tent = _tents(greenhouse, task, vision, (width, height), period_min, 1)
        #: The task with all its keys, as in a task file.
        self.task: dict[str, Any] = json.loads(self._tent.task)
        #: The lamps: name and place of each, in the order of the actions.
        self.layout: list[dict[str, Any]] = json.loads(self._tent.layout)
        #: The best fitness there can be; None where it is not known.
        self.best_fitness = self._tent.best_fitness
        columns, rows = self._tent.size
        box = spaces.Box(0, 255, (rows, columns, 3), np.uint8)
        self.observation_space = cast("spaces.Space[NDArray[np.uint8]]", box)
        self.action_space = cast("spaces.Space[np.int64]", spaces.Discrete(len(self._tent.lamps)))
        self.render_mode = render_mode
        self._seed: int | None = None
        self._fitness = 0.0
        self._lit: list[int] = []
        self._is_over = True
        self._photograph: NDArray[np.uint8] = np.zeros((rows, columns, 3), np.uint8)

    def _kept(self) -> dict[str, Any]:
        random = self.__dict__.get("_np_random")
        seed = self.__dict__.get("_np_random_seed")
        return {"seed": self._seed, "lit": list(self._lit), "random": random, "random_seed": seed}

    def _take(self, kept: dict[str, Any]) -> None:
        if kept["seed"] is not None:
            self._begin(kept["seed"])
            for lamp in kept["lit"]:
                self._advance(lamp)
        if kept["random"] is not None:
            self._np_random, self._np_random_seed = kept["random"], kept["random_seed"]

    def _begin(self, seed: int) -> dict[str, Any]:
        pictures, tips, [quality], *_ = self._tent.begin([0], [seed])
        self._seed, self._fitness, self._lit, self._is_over = seed, 0.0, [], False
        return self._seen(pictures, tips, quality)

    def _advance(self, action: int) -> tuple[float, bool, bool, dict[str, Any]]:
        pictures, tips, [quality], [reward], [terminated], [truncated] = self._tent.step([0], [action])
        self._fitness += float(reward)
        self._lit.append(action)
        self._is_over = bool(terminated or truncated)
        return float(reward), bool(terminated), bool(truncated), self._seen(pictures, tips, quality)

    def _seen(self, pictures: NDArray[np.uint8], tips: Floats, quality: str) -> dict[str, Any]:
        self._photograph = pictures[0]
        info = {"step": len(self._lit), "seed": self._seed, "fitness": self._fitness, "is_virtual": True}
        return {**info, "tip": (float(tips[0, 0]), float(tips[0, 1])), "quality": quality}

    def _picture(self) -> NDArray[np.uint8]:
        return self._photograph

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.uint8], dict[str, Any]]:
        """Begins an episode: the plant of `seed`, as `tropism run --seed` has it; without a seed, a new one."""
        super().reset(seed=seed)
        info = self._begin(int(self.np_random.integers(2**32)) if seed is None else seed)
        self._show()
        return self._photograph, info

    def step(self, action: np.int64 | int) -> tuple[NDArray[np.uint8], float, bool, bool, dict[str, Any]]:
        """Lights a lamp for one step, and takes a photograph."""
        if self._is_over:
            raise PlanError("the episode is over, or none has begun: call reset before step")
        reward, terminated, truncated, info = self._advance(int(_actions([action], 1)[0]))
        self._show()
        return self._photograph, reward, terminated, truncated, info


def _masked(infos: dict[str, Any], mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
    """Infos as Gymnasium's vector environments have them: with a mask of the plants that have each."""
    masks = {f"_{key}": np.ones(len(values), bool) if mask is None else mask for key, values in infos.items()}
    return {**infos, **masks}


class _SideBySide(_Remembers, VectorEnv[Any, NDArray[np.int64], NDArray[Any]]):
    """What all vectors share: modes of autoreset, seeds, and the attributes of the single environments."""

    metadata: dict[str, Any] = {
        "autoreset_mode": AutoresetMode.NEXT_STEP,
        "render_modes": ["rgb_array"],
        "render_fps": 12,
    }

    num_envs: int
    #: The task with all its keys, as in a task file.
    task: dict[str, Any]
    #: The lamps: name and place of each, in the order of the actions.
    layout: list[dict[str, Any]]
    #: The best fitness there can be; None where it is not known.
    best_fitness: float | None

    def _open(
        self, count: int, single: spaces.Space[Any], lamps: int, mode: AutoresetMode | str, render_mode: str | None
    ) -> None:
        self.num_envs = count
        self.single_observation_space = single
        self.single_action_space = cast("spaces.Space[Any]", spaces.Discrete(lamps))
        self.observation_space = batch_space(single, count)
        self.action_space = batch_space(self.single_action_space, count)
        self.autoreset_mode = AutoresetMode(mode)
        self.metadata = {**type(self).metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = render_mode
        self._is_begun = False
        self._over = np.zeros(count, bool)

    def _seeds(self, seed: int | Sequence[int | None] | None) -> list[int] | None:
        """A seed a plant; None goes on with those that there are."""
        if seed is None:
            if self._is_begun:
                return None
            first = int(self.np_random.integers(2**32))
            return [first + place for place in range(self.num_envs)]
        if isinstance(seed, (int, np.integer)):
            return [int(seed) + place for place in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise PlanError(f"seed: found {len(seed)} seeds, wanted one, or {self.num_envs}")
        drawn = self.np_random.integers(2**32, size=len(seed))
        try:
            return [int(new) if own is None else operator.index(own) for own, new in zip(seed, drawn, strict=True)]
        except TypeError as error:
            raise WrongTypeError(f"seed: found {seed!r}, wanted whole numbers") from error

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_] | None:
        """The plants that `reset` is to begin, of `options["reset_mask"]`."""
        mask = (options or {}).get("reset_mask")
        if mask is None:
            return None
        found = np.asarray(mask)
        if found.dtype != np.bool_ or found.shape != (self.num_envs,):
            raise PlanError(
                f"reset_mask: found {found.dtype} of shape {found.shape}, wanted bool of ({self.num_envs},)"
            )
        return found

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of each single environment, such as task, layout, best_fitness or render_mode."""
        value = getattr(self, f"single_{name}" if name in ("observation_space", "action_space") else name)
        return (value,) * self.num_envs

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """An attribute of each single environment, or what its method `render` returns."""
        if name == "render":
            return tuple(self.render() or ())
        return self.get_attr(name)

    def set_attr(self, name: str, values: Any) -> None:
        """Refuses: the plants of a vector share their settings. Make another vector."""
        raise PlanError(f"set_attr: found {name!r}, which all plants of the vector share: make another vector")


class _PlantVector(_SideBySide):
    """Many plants side by side."""

    def __init__(
        self,
        batch: _core.Batch,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        dtype: Any = np.float64,
    ) -> None:
        self._batch = batch
        self._dtype = _dtype(dtype)
        self.task = json.loads(batch.task)
        self.layout = json.loads(batch.layout)
        self.best_fitness = batch.best_fitness
        self._open(len(batch), _box(batch.width, self._dtype), len(batch.lamps), autoreset_mode, render_mode)

    def _kept(self) -> dict[str, Any]:
        return {
            "plants": self._batch.saved(),
            "random": self.__dict__.get("_np_random"),
            "random_seed": self.__dict__.get("_np_random_seed"),
            "is_begun": self._is_begun,
        }

    def _take(self, kept: dict[str, Any]) -> None:
        self._batch.restore(kept["plants"])
        if kept["random"] is not None:
            self._np_random, self._np_random_seed = kept["random"], kept["random_seed"]
        self._is_begun = kept["is_begun"]

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begins all episodes, or those of `options["reset_mask"]`. Plant i has the seed `seed` + i, or its own of a list."""
        super().reset(seed=seed if isinstance(seed, int) else None)
        mask = self._mask(options)
        seeds = self._seeds(seed)
        seen = self._batch.reset(seeds) if mask is None or not self._is_begun else self._batch.begin(mask, seeds)
        self._is_begun = True
        return seen.astype(self._dtype, copy=False), self._infos()

    def _infos(self) -> dict[str, Any]:
        """The info of the single environment, as arrays over the plants."""
        steps, plants, seeds, fitness = self._batch.states()
        ones = np.ones(self.num_envs, bool)
        return _masked({"step": steps, "plant": plants, "seed": seeds, "fitness": fitness, "is_virtual": ones})

    def step(self, actions: Any) -> tuple[Floats, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Lights a lamp for each plant, for one step.

        In the mode NEXT_STEP plants whose episode was over begin anew: their action is ignored and their reward is 0.
        """
        mode = self.autoreset_mode
        lamps = _actions(actions, self.num_envs)
        seen, rewards, terminated, truncated = self._batch.step(lamps, mode == AutoresetMode.NEXT_STEP)
        if mode == AutoresetMode.SAME_STEP and (over := terminated | truncated).any():
            final = {key: value for key, value in self._infos().items() if not key.startswith("_")}
            last = np.empty(self.num_envs, object)
            for place in np.flatnonzero(over):
                last[place] = seen[place].astype(self._dtype)
            seen = self._batch.begin(over)
            infos = {**self._infos(), "final_obs": last, "_final_obs": over}
            infos["final_info"], infos["_final_info"] = _masked(final, over), over
            return seen.astype(self._dtype, copy=False), rewards, terminated, truncated, infos
        return seen.astype(self._dtype, copy=False), rewards, terminated, truncated, self._infos()

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """A picture of each plant of a bean, (324, 432, 3), in the mode rgb_array; None in others."""
        if self.render_mode != "rgb_array":
            return None
        return tuple(self._one(place) for place in range(self.num_envs))

    def _one(self, place: int) -> NDArray[np.uint8]:
        """The picture of a plant, with the targets."""
        seen = self._batch.seen()[place]
        return _drawn(self._batch, place, seen, [], "front")


class TentVector(_SideBySide):
    """Many virtual beans through photographs: (plants, height, width, 3). Each core photographs and tracks some of them."""

    def __init__(
        self,
        num_envs: int = 1,
        greenhouse: edge.AnySettings | None = None,
        task: edge.AnyTask | None = None,
        vision: edge.AnySettings | None = None,
        width: int = 432,
        height: int = 324,
        period_min: float = 5.0,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
    ) -> None:
        limited = json.loads(_limited(_task(task), max_episode_steps))
        self._tents = _tents(greenhouse, limited, vision, (width, height), period_min, num_envs)
        self.task = json.loads(self._tents.task)
        self.layout = json.loads(self._tents.layout)
        self.best_fitness = self._tents.best_fitness
        columns, rows = self._tents.size
        box = spaces.Box(0, 255, (rows, columns, 3), np.uint8)
        self._open(num_envs, cast("spaces.Space[Any]", box), len(self._tents.lamps), autoreset_mode, render_mode)
        # A generator a plant, from which its next seeds are drawn as the single environment draws them.
        self._generators: list[Any] = []
        self._seed = np.zeros(num_envs, np.uint64)
        self._lit: list[list[int]] = [[] for _ in range(num_envs)]
        self._fitness = np.zeros(num_envs)
        self._tips = np.zeros((num_envs, 2))
        self._quality = np.full(num_envs, "simulated", object)
        self._pictures = np.zeros((num_envs, rows, columns, 3), np.uint8)

    def _kept(self) -> dict[str, Any]:
        names = ("_is_begun", "_over", "_generators")
        kept = {name: copy.deepcopy(getattr(self, name)) for name in names}
        return {**kept, "seed": self._seed.copy(), "lit": copy.deepcopy(self._lit)}

    def _take(self, kept: dict[str, Any]) -> None:
        if kept["_is_begun"]:
            self._begin(list(range(self.num_envs)), [int(seed) for seed in kept["seed"]])
            for step in range(max(len(lit) for lit in kept["lit"])):
                places = [place for place, lit in enumerate(kept["lit"]) if len(lit) > step]
                self._advance(places, [kept["lit"][place][step] for place in places])
        self.__dict__.update({name: kept[name] for name in ("_is_begun", "_over", "_generators")})

    def _begin(self, places: list[int], seeds: list[int]) -> None:
        if places:
            found = self._tents.begin(places, seeds)
            self._take_seen(places, found)
            for place, seed in zip(places, seeds, strict=True):
                self._seed[place], self._fitness[place], self._lit[place] = seed, 0.0, []

    def _advance(self, places: list[int], actions: list[int]) -> tuple[Any, Any, Any]:
        found = self._tents.step(places, actions)
        self._take_seen(places, found)
        self._fitness[places] += found[3]
        for place, action in zip(places, actions, strict=True):
            self._lit[place].append(action)
        return found[3], found[4], found[5]

    def _take_seen(self, places: list[int], found: Any) -> None:
        self._pictures[places], self._tips[places] = found[0], found[1]
        self._quality[places] = found[2]

    def _next(self, places: list[int]) -> None:
        self._begin(places, [int(self._generators[place].integers(2**32)) for place in places])

    def _infos(self) -> dict[str, Any]:
        steps = np.array([len(lit) for lit in self._lit])
        tips = np.empty(self.num_envs, object)
        for place, (x, y) in enumerate(self._tips):
            tips[place] = (float(x), float(y))
        ones = np.ones(self.num_envs, bool)
        infos = {"step": steps, "seed": self._seed.copy(), "fitness": self._fitness.copy(), "is_virtual": ones}
        return _masked({**infos, "tip": tips, "quality": self._quality.copy()})

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.uint8], dict[str, Any]]:
        """Begins all episodes, or those of `options["reset_mask"]`. Plant i has the seed `seed` + i, or its own of a list."""
        super().reset(seed=seed if isinstance(seed, int) else None)
        mask = self._mask(options)
        places = list(range(self.num_envs)) if mask is None or not self._is_begun else np.flatnonzero(mask).tolist()
        seeds = self._seeds(seed)
        if seeds is None:
            self._next(places)
        else:
            generators = [seeding.np_random(own)[0] for own in seeds]
            self._generators = self._generators or generators
            for place in places:
                self._generators[place] = generators[place]
            self._begin(places, [seeds[place] for place in places])
        self._is_begun = True
        self._over[places] = False
        return self._pictures.copy(), self._infos()

    def step(self, actions: Any) -> tuple[NDArray[np.uint8], NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Lights a lamp for each plant, for one step, and takes a photograph of each."""
        lamps = _actions(actions, self.num_envs)
        if not self._is_begun or (self.autoreset_mode == AutoresetMode.DISABLED and self._over.any()):
            raise PlanError("an episode is over, or none has begun: call reset before step")
        rewards, terminated, truncated = (np.zeros(self.num_envs, kind) for kind in (np.float64, bool, bool))
        ended = np.flatnonzero(self._over).tolist()
        places = np.flatnonzero(~self._over).tolist()
        self._next(ended)
        if places:
            found = self._advance(places, lamps[places].tolist())
            rewards[places], terminated[places], truncated[places] = found
        self._over = terminated | truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._over.any():
            over = self._over
            final = {key: value for key, value in self._infos().items() if not key.startswith("_")}
            last = np.empty(self.num_envs, object)
            for place in np.flatnonzero(over):
                last[place] = self._pictures[place].copy()
            self._next(np.flatnonzero(over).tolist())
            self._over = np.zeros(self.num_envs, bool)
            infos = {**self._infos(), "final_obs": last, "_final_obs": over}
            infos["final_info"], infos["_final_info"] = _masked(final, over), over
            return self._pictures.copy(), rewards, terminated, truncated, infos
        return self._pictures.copy(), rewards, terminated, truncated, self._infos()

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """The last photographs, in the mode rgb_array."""
        return tuple(self._pictures.copy()) if self.render_mode == "rgb_array" else None


class TipModelVector(_PlantVector):
    """Many plants of the tip-motion model."""

    def __init__(
        self,
        num_envs: int = 1,
        model: Model | str | os.PathLike[str] | None = None,
        task: edge.AnyTask | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        dtype: Any = np.float64,
        max_episode_steps: int | None = None,
    ) -> None:
        batch = _core.Batch.of_model(_model(model, "tip")._model, _limited(_task(task), max_episode_steps), num_envs)
        super().__init__(batch, autoreset_mode, render_mode, dtype)


class StemVector(_PlantVector):
    """Many plants of the model of the whole stem."""

    def __init__(
        self,
        num_envs: int = 1,
        model: Model | str | os.PathLike[str] | None = None,
        task: edge.AnyTask | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        dtype: Any = np.float64,
        max_episode_steps: int | None = None,
    ) -> None:
        text = _limited(_task(task), max_episode_steps)
        batch = _core.Batch.of_model(_model(model, "stem")._model, text, num_envs, has_stem=True)
        super().__init__(batch, autoreset_mode, render_mode, dtype)


class BeanVector(_PlantVector):
    """Many virtual beans without photographs."""

    # What is observed, and the task where none is given.
    _observed: ClassVar[str] = "tip"
    _default_task: ClassVar[Settings | None] = None

    def __init__(
        self,
        num_envs: int = 1,
        greenhouse: edge.AnySettings | None = None,
        task: edge.AnyTask | None = None,
        tip: Literal["true", "detector"] = "true",
        period_min: float = 5.0,
        plants: Series = "grow",
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        dtype: Any = np.float64,
        max_episode_steps: int | None = None,
    ) -> None:
        wanted = _limited(_task(self._default_task if task is None else task), max_episode_steps)
        settings = (_greenhouse(greenhouse), wanted, num_envs, period_min, tip, self._observed, plants)
        super().__init__(_core.Batch.of_beans(*settings), autoreset_mode, render_mode, dtype)


class ObstaclesVector(BeanVector):
    """Many virtual beans, each among the same obstacles. Infos are arrays over the plants."""

    _observed = "obstacles"
    _default_task = DISC

    def _infos(self) -> dict[str, Any]:
        return {**super()._infos(), **_masked(_progress(self._batch))}


class SpaceVector(BeanVector):
    """Many virtual beans, each among four lamps. Infos are arrays over the plants."""

    _observed = "space"
    _default_task = SPACE

    def _infos(self) -> dict[str, Any]:
        return {**super()._infos(), **_masked({"target_distances_cm": self._batch.progress()[3]})}


def _drawn(
    batch: _core.Batch, place: int, seen: Floats, trail: Sequence[Sequence[float]], view: str
) -> NDArray[np.uint8]:
    """A plant with its targets and the places where its tip was: a photograph of a bean, a drawing of a plant of a model."""
    photograph = batch.photograph(place, PICTURE[1], PICTURE[0], view)
    picture = np.zeros((*PICTURE, 3), np.uint8) if photograph is None else photograph
    for target in batch.targets:
        _dot(picture, _core.seen_from(target, view), 4, (230, 60, 60))
    for tip in trail:
        _dot(picture, _core.seen_from(tip, view), 1, (90, 120, 200))
    if photograph is None:
        lit = batch.lit(place)
        for lamp, x in ((0, -35.0), (1, 35.0)):
            _dot(picture, (x, 30.0), 9, (255, 220, 120) if lit == lamp else (60, 60, 60))
        _line(picture, (-30.0, 0.0), (30.0, 0.0), (90, 70, 50))
        # The stem where it is observed, else a line to the tip.
        points = seen[2:].reshape(-1, 2) if len(seen) > 2 else np.array([[0.0, 0.0], seen[:2]])
        for low, high in zip(points[:-1], points[1:], strict=True):
            _line(picture, (low[0], low[1]), (high[0], high[1]), (120, 190, 90))
        _dot(picture, (seen[0], seen[1]), 3, (180, 255, 140))
    return picture


def _pixel(place: Sequence[float]) -> tuple[int, int]:
    """Row and column of a place in cm."""
    return round(SOIL_ROW - place[1] * PX_PER_CM), round((PICTURE[1] - 1) / 2 + place[0] * PX_PER_CM)


def _dot(picture: NDArray[np.uint8], place: Sequence[float], radius: int, colour: tuple[int, int, int]) -> None:
    row, column = _pixel(place)
    rows, columns = np.ogrid[: picture.shape[0], : picture.shape[1]]
    picture[(rows - row) ** 2 + (columns - column) ** 2 <= radius * radius] = colour


def _line(
    picture: NDArray[np.uint8], start: Sequence[float], end: Sequence[float], colour: tuple[int, int, int]
) -> None:
    (row, column), (last_row, last_column) = _pixel(start), _pixel(end)
    count = max(abs(last_row - row), abs(last_column - column), 1) + 1
    rows = np.linspace(row, last_row, count).round().astype(int)
    columns = np.linspace(column, last_column, count).round().astype(int)
    for aside in (0, 1):
        inside = (rows >= 0) & (rows < picture.shape[0]) & (columns + aside >= 0) & (columns + aside < picture.shape[1])
        picture[rows[inside], columns[inside] + aside] = colour


class _Window:
    """A window that shows pictures, by pygame."""

    def __init__(self) -> None:
        try:
            import pygame
        except ImportError as error:
            text = 'pygame is needed for render_mode "human": pip install pygame'
            raise gymnasium.error.DependencyNotInstalled(text) from error
        self._pygame: Any = pygame
        pygame.init()
        self._screen: Any = None
        self._clock = pygame.time.Clock()

    def show(self, picture: NDArray[np.uint8], fps: int) -> None:
        if self._screen is None:
            # As wide as the first picture, which for photographs may be large.
            share = min(1.0, 1296 / picture.shape[1])
            size = (round(picture.shape[1] * share), round(picture.shape[0] * share))
            self._screen = self._pygame.display.set_mode(size)
        surface = self._pygame.surfarray.make_surface(picture.swapaxes(0, 1))
        self._screen.blit(self._pygame.transform.scale(surface, self._screen.get_size()), (0, 0))
        self._pygame.event.pump()
        self._pygame.display.flip()
        self._clock.tick(fps)

    def close(self) -> None:
        self._pygame.quit()
