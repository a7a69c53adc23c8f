"""tropism/Wall-v0: nodes on a wall lead a plant together. An environment of PettingZoo, with one agent a node.

from tropism import wall_v0

env = wall_v0.parallel_env()                # all nodes act at once; wall_v0.env() is the form whose agents act in turns (AEC)
observations, infos = env.reset(seed=1)

Where PettingZoo has a registry (1.27), `pettingzoo.make("parallel", "tropism/Wall-v0")` makes it once this module is imported.

A node is a lamp with a proximity sensor. A path along some of the nodes is drawn; only the first one of it is called at the start.
No node knows where the plant is. Names of nodes are names of agents.

| place | observation of a node |
|---|---|
| 0, 1 | strength of the echo over what the node is used to (1: the threshold of "something is near"), and its trend; -2 to 2 |
| 2 | 1 if the node is called: it is on the path, and the node before it said that it is done |
| 3 | 1 if the next node of the path said that it is done |
| 4 | 1 if a node on the same level sees something |
| 5, 6 | 1 if its own lamp is lit; 1 if it said that it is done |

The action is two choices, `MultiDiscrete([2, 2])`: whether the lamp is lit for one step of five minutes, and whether the node says
that it is done. These are the inputs and outputs of the networks that `tropism wall --evolve` evolves.

The reward is the same for all agents: 1 for each right decision of the plant, -1 for each wrong one. A decision is on which side
the true apex first reaches the height of a node of the path. So an episode is worth at most 3 on the wall of three levels. It
terminates when all decisions are taken, and is truncated after `max_steps`. Light costs nothing: `infos` have `lit_h`.

`reset(seed=s)` gives the plants of `tropism wall --seed s`, in order: the first with the seed, then the next one at each reset
without a seed. The nodes learn the empty scene within `reset`. The same seed gives the same bits. An environment is copied and
pickled by its seed and its actions. A step before `reset`, or after the end of an episode, is an error.

`infos` of each agent have `plant` (its number under the seed), `seed`, `step`, `fitness` (sum of rewards), `path` (names of its
nodes, lowest first), `decisions` (node, step, apex, is_right), `apex` (true, in cm), `lit_h` (hours of lamp light of all nodes),
`is_virtual`, and of the node itself `is_on_path` and `is_alive`. A node that dies by a fault stays an agent: it observes zeros, and
its actions are ignored.

`state()` is a global view for centralised training: the observations of all nodes one after the other, and the apex.

Version history: v0, the first. A change of a plant, a reward or an observation makes a new version.

>>> from tropism import wall_v0
>>> env = wall_v0.parallel_env()
>>> observations, infos = env.reset(seed=1)
>>> env.agents
['left1', 'right1', 'left2', 'right2', 'left3', 'right3']
>>> [agent for agent in env.agents if observations[agent][2] == 1] == infos["left1"]["path"][:1]
True
>>> dark = {agent: [0, 0] for agent in env.agents}
>>> observations, rewards, terminations, truncations, infos = env.step(dark)
>>> rewards["left1"], terminations["left1"], infos["left1"]["lit_h"]
(0.0, False, 0.0)
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from tropism import _core, edge
from tropism.errors import PlanError, WrongTypeError

try:
    import pettingzoo
    from gymnasium import spaces
    from pettingzoo import ParallelEnv
    from pettingzoo.utils import parallel_to_aec
except ImportError as error:
    raise ImportError("tropism.wall_v0 needs PettingZoo: pip install pettingzoo") from error

from tropism.envs import FARTHEST_CM, PICTURE, _dot, _Drawn, _dtype, _Remembers

__all__ = ["WallEnv", "env", "parallel_env"]

#: Id in PettingZoo's registry, which versions before 1.27 lack.
ENV_ID = "tropism/Wall-v0"

#: Observations: of float64, or of float32 by option.
Floats = NDArray[Any]
#: What `step` takes of an agent: whether the lamp is lit, and whether the node is done.
Action = Sequence[int] | NDArray[Any]


class WallEnv(_Remembers, _Drawn, ParallelEnv[str, Floats, Action]):  # type: ignore[misc,unused-ignore]
    """A virtual bean before a wall of nodes, one agent a node.

    `wall` has the keys of a wall file such as `tasks/wall.toml`, or is its path; `faults` has those of `tropism wall --faults`,
    such as `{"lost": 0.3}`; `bean` is the species, as keys or as a bean file; `variation` is how much plants vary, as a multiple
    of that of the species; `learning_h` is for how long the nodes learn the empty scene.

    >>> env = WallEnv(faults={"blind": 1, "restarts_per_day": 1}, max_steps=500)
    >>> env.action_space("left1")
    MultiDiscrete([2 2])
    >>> env.observation_space("left1").shape
    (7,)
    """

    metadata: dict[str, Any] = {
        "name": "wall_v0",
        "render_modes": ["rgb_array", "human"],
        "render_fps": 12,
        "is_parallelizable": True,
    }

    def __init__(
        self,
        wall: edge.AnySettings | None = None,
        faults: edge.Settings | None = None,
        bean: edge.AnySettings | None = None,
        variation: float = 1.0,
        period_min: float = 5.0,
        max_steps: int = 1000,
        learning_h: float = 24.0,
        render_mode: str | None = None,
        dtype: Any = np.float64,
    ) -> None:
        texts = (edge.settings(wall, "wall"), edge.settings(faults, "faults"), edge.species(bean, "bean"))
        wall_text, faults_text, bean_text = map(json.dumps, texts)
        self._wall = _core.Wall(wall_text, faults_text, bean_text, variation, period_min, max_steps, learning_h)
        self._dtype = _dtype(dtype)
        #: The wall with all its keys, as in a wall file.
        self.wall: dict[str, Any] = json.loads(self._wall.file)
        #: Names of the agents, which are those of the nodes.
        self.possible_agents: list[str] = self._wall.nodes
        #: The agents of the episode that goes on; none before `reset` and after the end.
        self.agents: list[str] = []
        least, most = np.array(self._wall.bounds, self._dtype).T
        choices = [2] * self._wall.outputs
        nodes, scalar = self.possible_agents, self._dtype.type
        self.observation_spaces = {node: spaces.Box(least, most, dtype=scalar) for node in nodes}
        self.action_spaces = {node: spaces.MultiDiscrete(choices) for node in nodes}
        far = np.full(3, FARTHEST_CM, self._dtype)
        low = np.concatenate([np.tile(least, len(nodes)), -far])
        #: The space of `state()`.
        self.state_space = spaces.Box(low, np.concatenate([np.tile(most, len(nodes)), far]), dtype=scalar)
        self.render_mode = render_mode
        self._seed: int | None = None
        self._plant = 0
        self._fitness = 0.0
        self._seen: Floats = np.zeros((len(nodes), len(least)), self._dtype)
        # The actions of the episode, from which a copy is grown again.
        self._taken: list[NDArray[np.int64]] = []

    def _kept(self) -> dict[str, Any]:
        return {"seed": self._seed, "plant": self._plant, "taken": list(self._taken)}

    def _take(self, kept: dict[str, Any]) -> None:
        if kept["seed"] is not None:
            self._begin(kept["seed"], kept["plant"])
            for decisions in kept["taken"]:
                self._advance(decisions)

    def _begin(self, seed: int, plant: int) -> None:
        self._seen = self._wall.begin(seed, plant).astype(self._dtype, copy=False)
        self._seed, self._plant, self._fitness, self._taken = seed, plant, 0.0, []
        self.agents = list(self.possible_agents)

    def _advance(self, decisions: NDArray[np.int64]) -> tuple[float, bool, bool]:
        seen, reward, terminated, truncated = self._wall.step(decisions)
        self._seen = seen.astype(self._dtype, copy=False)
        self._fitness += reward
        self._taken.append(decisions)
        if terminated or truncated:
            self.agents = []
        return reward, terminated, truncated

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Seven numbers; see the module."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Whether the lamp is lit, and whether the node is done."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Floats], dict[str, dict[str, Any]]]:
        """Begins an episode: the first plant of `seed`, or the next one without a seed."""
        if seed is not None:
            self._begin(int(seed), 0)
        elif self._seed is None:
            self._begin(int(np.random.default_rng().integers(2**32)), 0)
        else:
            self._begin(self._seed, self._plant + 1)
        self._show()
        return self._observations(), self._infos()

    def step(
        self, actions: Mapping[str, Action]
    ) -> tuple[dict[str, Floats], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Takes the action of each node, and lets the plant grow for one step."""
        if not self.agents:
            what = "no episode has begun" if self._seed is None else "the episode is over"
            raise PlanError(f"{what}: call reset before step")
        reward, terminated, truncated = self._advance(self._decisions(actions))
        self._show()
        nodes = self.possible_agents
        return (
            self._observations(),
            dict.fromkeys(nodes, reward),
            dict.fromkeys(nodes, terminated),
            dict.fromkeys(nodes, truncated),
            self._infos(),
        )

    def _decisions(self, actions: Mapping[str, Action]) -> NDArray[np.int64]:
        """The actions as rows in the order of the nodes; nothing is rounded."""
        if not isinstance(actions, Mapping):
            kind = edge.kind_of(actions)
            raise WrongTypeError(f"actions: found {kind}, wanted a dict with an action for each node")
        unlike = set(actions) ^ set(self.possible_agents)
        if unlike:
            found, wanted = ", ".join(map(str, actions)) or "none", ", ".join(self.possible_agents)
            raise PlanError(f"actions: found actions of {found}, wanted one for each of {wanted}")
        rows = np.zeros((len(actions), self._wall.outputs), np.int64)
        for row, node in zip(rows, self.possible_agents, strict=True):
            action = np.asarray(actions[node])
            if action.dtype.kind not in "iub":
                raise WrongTypeError(f"actions: {node}: found {action.dtype}, wanted whole numbers")
            if action.shape != row.shape:
                raise PlanError(f"actions: {node}: found an array of shape {action.shape}, wanted {row.shape}")
            if action.min() < 0 or action.max() > 1:
                raise PlanError(f"actions: {node}: found {action.tolist()}, wanted 0 or 1 for lamp and for done")
            row[:] = action
        return rows

    def _observations(self) -> dict[str, Floats]:
        return {node: row.copy() for node, row in zip(self.possible_agents, self._seen, strict=True)}

    def _infos(self) -> dict[str, dict[str, Any]]:
        path = self._wall.path()
        decisions = [
            {"node": node, "step": step, "apex": tuple(apex), "is_right": is_right}
            for node, step, apex, is_right in self._wall.decisions()
        ]
        shared = {
            "step": len(self._taken),
            "plant": self._plant,
            "seed": self._seed,
            "fitness": self._fitness,
            "is_virtual": True,
            "path": path,
            "decisions": decisions,
            "apex": np.array(self._wall.apex()),
            "lit_h": self._wall.lit_h(),
        }
        alive = zip(self.possible_agents, self._wall.alive(), strict=True)
        return {node: {**shared, "is_on_path": node in path, "is_alive": is_alive} for node, is_alive in alive}

    def state(self) -> Floats:
        """The observations of all nodes one after the other, and the true apex in cm."""
        apex = self._wall.apex()
        return np.concatenate([self._seen.ravel(), np.array(apex, self._dtype)])

    def _picture(self) -> NDArray[np.uint8]:
        """Plant and nodes. Lit nodes are bright; a rim marks the path."""
        picture = self._wall.photograph(PICTURE[1], PICTURE[0])
        path = self._wall.path()
        for node, place, is_lit in zip(self.possible_agents, self._wall.places, self._wall.lit(), strict=True):
            at = _core.seen_from(place)
            if node in path:
                _dot(picture, at, 7, (230, 60, 60))
            _dot(picture, at, 5, (255, 220, 120) if is_lit else (60, 60, 60))
        return picture


def parallel_env(wall: edge.AnySettings | None = None, **options: Any) -> WallEnv:
    """The environment whose agents all act at once; `options` are those of `WallEnv`.

    >>> parallel_env({"sensor": {"range_cm": 4}}).max_num_agents
    6
    """
    return WallEnv(wall, **options)


def env(wall: edge.AnySettings | None = None, **options: Any) -> Any:
    """The environment whose agents act in turns (AEC), for what cannot take the actions of all at once.

    >>> one = env()
    >>> one.reset(seed=1)
    >>> one.agent_selection
    'left1'
    """
    return parallel_to_aec(cast("Any", WallEnv(wall, **options)))


# PettingZoo has a registry since 1.27: pettingzoo.make("parallel", "tropism/Wall-v0").
if hasattr(pettingzoo, "register") and ENV_ID not in pettingzoo.parallel_registry:
    pettingzoo.register("parallel", ENV_ID, entry_point="tropism.wall_v0:parallel_env")
    pettingzoo.register("aec", ENV_ID, entry_point="tropism.wall_v0:env")
