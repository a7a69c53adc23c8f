"""Learning environments (Gymnasium 1.x): a plant is to be led from target to target by the choice of the lit lamp.

| id | plant | observation |
|---|---|---|
| tropism/TipModel-v0 | a plant of the tip-motion model, eqs. (1)-(8) | the tip, (x, y) in cm |
| tropism/Bean-v0 | a virtual bean | its true tip, or that of the paper's detector, (x, y) in cm |
| tropism/Stem-v0 | a plant of the model of the whole stem | the tip, and ten points of the stem from the base up, in cm |
| tropism/Tent-v0 | a virtual bean through photographs | the picture, (height, width, 3) |
| tropism/Obstacles-v0 | a virtual bean that obstacles hold back | tip, ten points of the stem, nearest obstacle: (27,) in cm |
| tropism/Space-v0 | a virtual bean among four lamps | the tip, (x, y, z) in cm |

All: the action is the number of the lamp that is lit for one step of five minutes (0 left, 1 right; in space 2 front, 3 back). The
reward is the fitness of the step; its sum is the fitness of the episode: eq. (9), in cm, at most 15 for the paper's targets. An
episode ends at the height of 13.8 cm (13 cm among obstacles), and is truncated after 1000 steps. `reset(seed=s)` gives the plants
of `tropism simulate --seed s` and `tropism grow --seed s`, in order: the first with the seed, then the next one at each reset
without a seed. With `plants="transfer"` beans are those of `tropism transfer --seed s`.

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

`gymnasium.make_vec(id, num_envs=1024)` steps many plants side by side in Rust. An episode that is over begins anew at the next
step, whose action is ignored (AutoresetMode.NEXT_STEP). Plant i has the seed s + i.

Options: `task` (keys of a task file), `greenhouse` (keys of docs/reference/virtual-plants.md: `scale` is how much plants vary,
`bean` the species, which may be `tropism.loop.species("beans/internodal-bean.toml")`, a second plant simulator with other
equations; `faults` of the camera in Tent-v0), `period_min`, `model` (a `Model` or a model file).

Version history: all v0, the first. A change of a plant, a reward or an observation makes a new version.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Literal, TypeAlias, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from tropism import _core
from tropism._core import Model

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
    "TipModelEnv",
    "TipModelVector",
]

Floats = NDArray[np.float64]
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

_MODELS: dict[str, Model] = {}


def default_model(kind: str) -> Model:
    """The model of six virtual beans (seed 1) under periodic lamps, as in the paper's open-loop experiments."""
    if kind not in _MODELS:
        _MODELS[kind] = Model.of_virtual_beans(kind)
    return _MODELS[kind]


def _model(model: Model | str | os.PathLike[str] | None, kind: str) -> Model:
    if model is None:
        return default_model(kind)
    return model if isinstance(model, Model) else Model.read(model)


def _json(settings: Settings | None) -> str:
    return json.dumps(dict(settings or {}))


def _box(width: int) -> spaces.Space[Floats]:
    return cast("spaces.Space[Floats]", spaces.Box(-FARTHEST_CM, FARTHEST_CM, (width,), np.float64))


class _PlantEnv(gymnasium.Env[Floats, np.int64]):
    """One plant whose places are observed."""

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 12}

    def __init__(self, batch: _core.Batch, render_mode: str | None) -> None:
        self._batch = batch
        #: The task with all its keys, as in a task file.
        self.task: dict[str, Any] = json.loads(batch.task)
        #: The lamps: name and place of each, in the order of the actions.
        self.layout: list[dict[str, Any]] = json.loads(batch.layout)
        #: The best fitness there can be; None where it is not known.
        self.best_fitness = batch.best_fitness
        self.observation_space = _box(batch.width)
        self.action_space = cast("spaces.Space[np.int64]", spaces.Discrete(len(batch.lamps)))
        self.render_mode = render_mode
        self._is_begun = False
        self._fitness = 0.0
        self._step = 0
        self._plant: dict[str, int] = {}
        self._trail: list[Sequence[float]] = []
        self._window: _Window | None = None

    def _info(self) -> dict[str, Any]:
        return {"step": self._step, **self._plant, "fitness": self._fitness, "is_virtual": True}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode: the first plant of `seed`, or the next one without a seed."""
        super().reset(seed=seed)
        if seed is None and not self._is_begun:
            seed = int(self.np_random.integers(2**32))
        seen = self._batch.reset(None if seed is None else [seed])[0]
        self._is_begun, self._fitness, self._step = True, 0.0, 0
        _, episode, seed = self._batch.state()
        self._plant = {"episode": episode, "seed": seed}
        self._trail = [self._place(seen)]
        self._show()
        return seen, self._info()

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
        return np.array(seen), reward, terminated, truncated, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """A picture of the plant, (324, 432, 3), in the mode rgb_array."""
        return self._picture() if self.render_mode == "rgb_array" else None

    def _picture(self, view: str = "front") -> NDArray[np.uint8]:
        photograph = self._batch.photograph(0, PICTURE[1], PICTURE[0], view)
        picture = np.zeros((*PICTURE, 3), np.uint8) if photograph is None else photograph
        for target in self._batch.targets:
            _dot(picture, _core.seen_from(target, view), 4, (230, 60, 60))
        for tip in self._trail[:-1]:
            _dot(picture, _core.seen_from(tip, view), 1, (90, 120, 200))
        if photograph is None:
            lit = self._batch.lit()
            for lamp, x in ((0, -35.0), (1, 35.0)):
                _dot(picture, (x, 30.0), 9, (255, 220, 120) if lit == lamp else (60, 60, 60))
            _line(picture, (-30.0, 0.0), (30.0, 0.0), (90, 70, 50))
            self._draw_plant(picture)
        return picture

    def _draw_plant(self, picture: NDArray[np.uint8]) -> None:
        _line(picture, (0.0, 0.0), self._trail[-1], (120, 190, 90))
        _dot(picture, self._trail[-1], 3, (180, 255, 140))

    def _show(self) -> None:
        if self.render_mode == "human":
            self._window = self._window or _Window()
            self._window.show(self._picture(), self.metadata["render_fps"])

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None


class TipModelEnv(_PlantEnv):
    """A plant of the tip-motion model. `model`: a `Model` or a model file; by default that of six virtual beans."""

    def __init__(
        self,
        model: Model | str | os.PathLike[str] | None = None,
        task: Settings | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(_core.Batch.of_model(_model(model, "tip"), _json(task)), render_mode)


class StemEnv(_PlantEnv):
    """A plant of the model of the whole stem: 22 numbers, the tip and ten points from the base up."""

    def __init__(
        self,
        model: Model | str | os.PathLike[str] | None = None,
        task: Settings | None = None,
        render_mode: str | None = None,
    ) -> None:
        super().__init__(_core.Batch.of_model(_model(model, "stem"), _json(task), has_stem=True), render_mode)
        self._stem: Floats = np.zeros(0)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        seen, info = super().reset(seed=seed, options=options)
        self._stem = seen
        return seen, info

    def step(self, action: np.int64 | int) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        found = super().step(action)
        self._stem = found[0]
        return found

    def _draw_plant(self, picture: NDArray[np.uint8]) -> None:
        points = self._stem[2:].reshape(-1, 2)
        for low, high in zip(points[:-1], points[1:], strict=True):
            _line(picture, (low[0], low[1]), (high[0], high[1]), (120, 190, 90))
        _dot(picture, self._trail[-1], 3, (180, 255, 140))


class BeanEnv(_PlantEnv):
    """A virtual bean without photographs. `tip`: "true", or "detector" with the grid and the noise of the paper's detector."""

    # What is observed, and the task where none is given.
    _observed: ClassVar[str] = "tip"
    _task: ClassVar[Settings | None] = None

    def __init__(
        self,
        greenhouse: Settings | None = None,
        task: Settings | None = None,
        tip: str = "true",
        period_min: float = 5.0,
        plants: Series = "grow",
        render_mode: str | None = None,
    ) -> None:
        task = self._task if task is None else task
        settings = (_json(greenhouse), _json(task), 1, period_min, tip, self._observed, plants)
        super().__init__(_core.Batch.of_beans(*settings), render_mode)


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


class TentEnv(gymnasium.Env[NDArray[np.uint8], np.int64]):
    """A virtual bean through photographs with flash; the reward is of the tip that the tracker finds in them.

    `width` and `height` are those of the photographs; `vision` has the keys of docs/reference/rig-file.md. The environment
    works on the thread on which it was made.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 12}

    def __init__(
        self,
        greenhouse: Settings | None = None,
        task: Settings | None = None,
        vision: Settings | None = None,
        width: int = 432,
        height: int = 324,
        period_min: float = 5.0,
        render_mode: str | None = None,
    ) -> None:
        settings = dict(greenhouse or {})
        settings["scene"] = {"width": width, "height": height, **settings.get("scene", {})}
        self._tent = _core.TentEpisodes(_json(settings), _json(task), _json(vision), period_min)
        columns, rows = self._tent.size
        box = spaces.Box(0, 255, (rows, columns, 3), np.uint8)
        self.observation_space = cast("spaces.Space[NDArray[np.uint8]]", box)
        self.action_space = cast("spaces.Space[np.int64]", spaces.Discrete(len(self._tent.lamps)))
        self.render_mode = render_mode
        self._seed: int | None = None
        self._fitness = 0.0
        self._step = 0
        self._window: _Window | None = None

    def _seen(self) -> NDArray[np.uint8]:
        picture = self._tent.pixels()
        if self.render_mode == "human":
            self._window = self._window or _Window()
            self._window.show(picture, self.metadata["render_fps"])
        return picture

    def _info(self, tip: tuple[float, float], quality: str) -> dict[str, Any]:
        info = {"step": self._step, "seed": self._seed, "fitness": self._fitness, "is_virtual": True}
        return {**info, "tip": tip, "quality": quality}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.uint8], dict[str, Any]]:
        """Begins an episode: the plant of `seed`, as `tropism run --seed` has it; without a seed, a new one."""
        super().reset(seed=seed)
        self._seed = int(self.np_random.integers(2**32)) if seed is None else seed
        x, y, quality = self._tent.reset(self._seed)
        self._fitness, self._step = 0.0, 0
        return self._seen(), self._info((x, y), quality)

    def step(self, action: np.int64 | int) -> tuple[NDArray[np.uint8], float, bool, bool, dict[str, Any]]:
        """Lights a lamp for one step, and takes a photograph."""
        x, y, quality, reward, terminated, truncated = self._tent.step(int(action))
        self._fitness += reward
        self._step += 1
        return self._seen(), reward, terminated, truncated, self._info((x, y), quality)

    def render(self) -> NDArray[np.uint8] | None:
        """The last photograph, in the mode rgb_array."""
        return self._tent.pixels() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Closes the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None


class _PlantVector(VectorEnv[Floats, NDArray[np.int64], NDArray[Any]]):
    """Many plants side by side."""

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}

    def __init__(self, batch: _core.Batch) -> None:
        self._batch = batch
        self.num_envs = len(batch)
        self.single_observation_space = _box(batch.width)
        self.single_action_space = cast("spaces.Space[Any]", spaces.Discrete(len(batch.lamps)))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._is_begun = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begins all episodes. Plant i has the seed `seed` + i, or its own of a list."""
        super().reset(seed=seed if isinstance(seed, int) else None)
        if seed is None:
            first = None if self._is_begun else int(self.np_random.integers(2**32))
            seeds = None if first is None else [first + place for place in range(self.num_envs)]
        elif isinstance(seed, (int, np.integer)):
            seeds = [int(seed) + place for place in range(self.num_envs)]
        else:
            drawn = self.np_random.integers(2**32, size=len(seed))
            seeds = [int(new if own is None else own) for own, new in zip(seed, drawn, strict=True)]
        self._is_begun = True
        return self._batch.reset(seeds), self._infos()

    def _infos(self) -> dict[str, Any]:
        return {}

    def step(
        self, actions: NDArray[np.int64]
    ) -> tuple[Floats, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Lights a lamp for each plant, for one step. Plants whose episode was over begin anew: their reward is 0."""
        seen, rewards, terminated, truncated = self._batch.step(np.ascontiguousarray(actions, np.int64))
        return seen, rewards, terminated, truncated, self._infos()


class TipModelVector(_PlantVector):
    """Many plants of the tip-motion model."""

    def __init__(
        self,
        num_envs: int = 1,
        model: Model | str | os.PathLike[str] | None = None,
        task: Settings | None = None,
    ) -> None:
        super().__init__(_core.Batch.of_model(_model(model, "tip"), _json(task), num_envs))


class StemVector(_PlantVector):
    """Many plants of the model of the whole stem."""

    def __init__(
        self,
        num_envs: int = 1,
        model: Model | str | os.PathLike[str] | None = None,
        task: Settings | None = None,
    ) -> None:
        super().__init__(_core.Batch.of_model(_model(model, "stem"), _json(task), num_envs, has_stem=True))


class BeanVector(_PlantVector):
    """Many virtual beans without photographs."""

    # What is observed, and the task where none is given.
    _observed: ClassVar[str] = "tip"
    _task: ClassVar[Settings | None] = None

    def __init__(
        self,
        num_envs: int = 1,
        greenhouse: Settings | None = None,
        task: Settings | None = None,
        tip: str = "true",
        period_min: float = 5.0,
        plants: Series = "grow",
    ) -> None:
        task = self._task if task is None else task
        settings = (_json(greenhouse), _json(task), num_envs, period_min, tip, self._observed, plants)
        super().__init__(_core.Batch.of_beans(*settings))


def _masked(infos: dict[str, NDArray[Any]]) -> dict[str, Any]:
    """Infos as Gymnasium's vector environments have them: with a mask of the plants that have each."""
    masks = {f"_{key}": np.ones(len(values), bool) for key, values in infos.items()}
    return {**infos, **masks}


class ObstaclesVector(BeanVector):
    """Many virtual beans, each among the same obstacles. Infos are arrays over the plants."""

    _observed = "obstacles"
    _task = DISC

    def _infos(self) -> dict[str, Any]:
        return _masked(_progress(self._batch))


class SpaceVector(BeanVector):
    """Many virtual beans, each among four lamps. Infos are arrays over the plants."""

    _observed = "space"
    _task = SPACE

    def _infos(self) -> dict[str, Any]:
        return _masked({"target_distances_cm": self._batch.progress()[3]})


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
            text = 'found no pygame, wanted it for render_mode "human": pip install pygame'
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
