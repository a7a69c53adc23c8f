"""Stable-Baselines3: many plants side by side as its `VecEnv`.

from stable_baselines3 import PPO
from tropism.sb3 import make_vec_env

plants = make_vec_env("tropism/Bean-v0", 64, seed=1)
PPO("MlpPolicy", plants).learn(200_000)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

import tropism.envs  # noqa: F401  (registers the environments)
from tropism.errors import PlanError

try:
    from stable_baselines3.common.vec_env.base_vec_env import VecEnv
except ImportError as error:
    raise ImportError("tropism.sb3 needs Stable-Baselines3: pip install stable-baselines3") from error

__all__ = ["PlantVecEnv", "make_vec_env"]


class PlantVecEnv(VecEnv):  # type: ignore[misc,unused-ignore]
    """A vector environment of tropism as the `VecEnv` of Stable-Baselines3.

    Episodes begin anew in the step that ends them. `infos` of that step hold `terminal_observation`, `TimeLimit.truncated`, and
    `episode` (r: fitness, l: steps), as its `Monitor` gives them; `infos` of other steps are empty, unless `has_infos` asks for
    all of them, which costs a dict a plant and step.
    """

    def __init__(self, plants: VectorEnv[Any, Any, Any], has_infos: bool = False) -> None:
        if plants.metadata.get("autoreset_mode") != AutoresetMode.SAME_STEP:
            raise PlanError(
                "PlantVecEnv: wanted an environment with autoreset_mode=AutoresetMode.SAME_STEP; see make_vec_env"
            )
        self.plants = plants
        self.has_infos = has_infos
        self._actions: NDArray[np.int64] = np.zeros(plants.num_envs, np.int64)
        self._seed: int | None = None
        self.render_mode = plants.render_mode
        super().__init__(plants.num_envs, plants.single_observation_space, plants.single_action_space)

    def reset(self) -> Any:
        """Begins all episodes: plant i has the seed of `seed` + i; without one, all go on to their next plants."""
        # Options are kept by the base class; plants have none.
        seen, infos = self.plants.reset(seed=self._seed)
        self._seed = None
        self.reset_infos = self._listed(infos) if self.has_infos else [{} for _ in range(self.num_envs)]
        return seen

    def seed(self, seed: int | None = None) -> list[int | None]:
        """Sets the seed of the next `reset`."""
        self._seed = int(np.random.randint(2**31)) if seed is None else seed
        return [self._seed + place for place in range(self.num_envs)]

    def step_async(self, actions: NDArray[Any]) -> None:
        """Takes the lamps of the next step."""
        self._actions = actions

    def step_wait(self) -> tuple[Any, NDArray[Any], NDArray[Any], list[dict[str, Any]]]:
        """Makes the step."""
        seen, rewards, terminated, truncated, infos = self.plants.step(self._actions)
        over = terminated | truncated
        listed: list[dict[str, Any]] = self._listed(infos) if self.has_infos else [{} for _ in range(self.num_envs)]
        if over.any():
            final = infos["final_info"]
            for place in np.flatnonzero(over):
                own = listed[place]
                own["terminal_observation"] = infos["final_obs"][place]
                own["TimeLimit.truncated"] = bool(truncated[place])
                own["episode"] = {"r": float(final["fitness"][place]), "l": int(final["step"][place])}
        return seen, rewards.astype(np.float32), over, listed

    def _listed(self, infos: dict[str, Any]) -> list[dict[str, Any]]:
        """The infos of each plant."""
        names = [name for name in infos if not name.startswith(("_", "final_"))]
        return [{name: infos[name][place] for name in names} for place in range(self.num_envs)]

    def close(self) -> None:
        """Closes the environment."""
        self.plants.close()

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """A picture of each plant."""
        pictures: Any = self.plants.render()
        return list(pictures) if pictures is not None else [None] * self.num_envs

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of plants, such as task, layout or best_fitness."""
        return [getattr(self.plants, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refuses: the plants of a vector share their settings."""
        raise PlanError(f"set_attr: found {attr_name!r}, which all plants of the vector share: make another vector")

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """Refuses: plants side by side are no single environments."""
        raise PlanError(f"env_method: found {method_name!r}: the plants of a vector are no single environments")

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: Any = None
    ) -> list[bool]:
        """Whether a single environment has a wrapper: none has; `Monitor` counts as one, for its infos are there."""
        from stable_baselines3.common.monitor import Monitor

        return [issubclass(wrapper_class, Monitor)] * len(list(self._get_indices(indices)))


def make_vec_env(
    name: str = "tropism/Bean-v0", n_envs: int = 64, seed: int | None = None, *, has_infos: bool = False, **options: Any
) -> PlantVecEnv:
    """Many plants as a `VecEnv` of Stable-Baselines3; `options` are those of the environment.

    Observations have single precision, as its policies have.
    """
    if name.startswith("tropism/Tent"):
        settings = dict(options)
    else:
        settings = {"dtype": np.float32, **options}
    plants: Any = gymnasium.make_vec(
        name,
        num_envs=n_envs,
        vectorization_mode="vector_entry_point",
        autoreset_mode=AutoresetMode.SAME_STEP,
        **settings,
    )
    vector = PlantVecEnv(plants, has_infos)
    vector.seed(seed)
    return vector
