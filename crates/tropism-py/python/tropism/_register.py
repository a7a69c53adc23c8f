"""Registers the environments with Gymnasium where it is loaded when `tropism` is imported, and when `tropism.envs` is."""

from __future__ import annotations

import sys

#: Most steps of an episode, as in the paper's task.
MAX_STEPS = 1000

#: Id of each environment: the class, and the mean reward at which it counts as solved: above the greedy rule, and reached by
#: what is evolved, tuned or learnt (docs/validation/environments.md). None where nothing was measured that reaches the goal.
ENVIRONMENTS: dict[str, tuple[str, float | None]] = {
    "tropism/TipModel-v0": ("TipModel", 13.0),
    "tropism/Bean-v0": ("Bean", 10.0),
    "tropism/Tent-v0": ("Tent", None),
    "tropism/Stem-v0": ("Stem", 9.0),
    "tropism/Obstacles-v0": ("Obstacles", None),
    "tropism/Space-v0": ("Space", 9.0),
}


def register_envs() -> None:
    """Registers all environments with Gymnasium. A second call does nothing.

    `import tropism` calls it where Gymnasium is loaded already, so `import gymnasium` stands first; afterwards
    `gymnasium.make("tropism/Bean-v0")` knows them.

    >>> import gymnasium, tropism
    >>> tropism.register_envs()
    >>> gymnasium.spec("tropism/Bean-v0").reward_threshold
    10.0
    """
    import gymnasium

    for name, (entry, threshold) in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point=f"tropism.envs:{entry}Env",
                vector_entry_point=f"tropism.envs:{entry}Vector",
                reward_threshold=threshold,
                max_episode_steps=MAX_STEPS,
            )


def _is_loaded() -> bool:
    """Whether Gymnasium is loaded to its end."""
    return hasattr(sys.modules.get("gymnasium"), "register")


def where_gymnasium_is() -> None:
    """Registers now if Gymnasium is loaded.

    >>> where_gymnasium_is()
    """
    if _is_loaded():
        register_envs()
