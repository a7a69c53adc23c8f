"""Learns a linear controller on virtual beans by CMA-ES (pip install cma): python learn_with_cma.py [GENERATIONS]

Eight numbers weigh the tip, the way to the next target, the last shift and the last lamp. Each candidate steers 32 beans, all
candidates side by side in one vector environment. The score is that of the best mean on 200 other beans.
"""

import sys

import cma
import gymnasium
import numpy as np
import tropism  # noqa: F401

BEANS = 32
TARGETS = np.array([[3.0, 6.0], [-5.0, 9.0], [-1.0, 13.5]])


def features(seen: np.ndarray, before: np.ndarray, light: np.ndarray) -> np.ndarray:
    """(plants, 8): what a controller sees of each plant."""
    below = seen[:, None, 1] < TARGETS[None, :, 1]
    following = np.where(below.any(axis=1), below.argmax(axis=1), 2)
    after = np.minimum(following + 1, 2)
    to, shift = TARGETS[following] - seen, seen - before
    next_x = TARGETS[after][:, 0] - seen[:, 0]
    return np.column_stack([np.ones(len(seen)), seen[:, 0], to, next_x, 10 * shift, light])


def fitness(weights: np.ndarray, seed: int, beans: int) -> np.ndarray:
    """The mean fitness of each row of weights on the same beans, in cm."""
    count = len(weights)
    env = gymnasium.make_vec("tropism/Bean-v0", num_envs=count * beans)
    seen, _ = env.reset(seed=[seed + bean for _ in range(count) for bean in range(beans)])
    own = np.repeat(weights, beans, axis=0)
    total, running = np.zeros(count * beans), np.ones(count * beans, bool)
    before, light = seen, np.zeros(count * beans)
    while running.any():
        action = (features(seen, before, light) * own).sum(axis=1) > 0
        before, light = seen, np.where(action, 1.0, -1.0)
        seen, reward, terminated, truncated, _ = env.step(action.astype(np.int64))
        total += reward * running
        running &= ~(terminated | truncated)
    return total.reshape(count, beans).mean(axis=1)


def main() -> None:
    generations = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    search = cma.CMAEvolutionStrategy([0, 0, 1, 0, 0, 0, 0, 0], 0.5, {"seed": 1, "verbose": -9, "popsize": 16})
    best, best_mean = np.array(search.x0), -np.inf
    for generation in range(generations):
        candidates = np.array(search.ask())
        found = fitness(candidates, 10_000 + BEANS * generation, BEANS)
        search.tell(list(candidates), list(-found))
        mean = fitness(np.array([search.mean]), 5_000, BEANS)[0]
        if mean > best_mean:
            best, best_mean = np.array(search.mean), mean
        print(f"generation {generation}: best {found.max():.2f}, mean of the search {mean:.2f} cm", flush=True)
    start = fitness(np.array([search.x0]), 1, 200)[0]
    print(f"200 other beans (virtual): {fitness(np.array([best]), 1, 200)[0]:.2f} cm; where it began: {start:.2f} cm")


if __name__ == "__main__":
    main()
