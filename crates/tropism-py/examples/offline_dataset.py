"""Writes an offline data set of Bean-v0 (pip install "minari[all]"): python offline_dataset.py [EPISODES] [NAME]

A third of the episodes is steered by the greedy rule, a third by lamps that change every six hours, a third by random lamps that
stay lit for an hour. Plants are virtual. `minari.load_dataset(name)` reads it; it lies where Minari keeps its data sets, in
`MINARI_DATASETS_PATH` or `~/.minari`.
"""

import sys

import gymnasium
import minari
import numpy as np
import tropism


def policies(env, rng):
    """The policies by name: functions of an observation and a step."""
    greedy = tropism.loop.CoreController("greedy", task=env.unwrapped.task, layout=env.unwrapped.layout)
    lamps = rng.integers(0, 2, 100)
    return {
        "greedy": lambda seen, step: greedy.decide_at(*seen),
        "periodic": lambda seen, step: step // 72 % 2,
        "random": lambda seen, step: int(lamps[step // 12 % 100]),
    }


def record(episodes, name):
    """Plays the episodes and writes the data set."""
    env = minari.DataCollector(gymnasium.make("tropism/Bean-v0"))
    for episode in range(episodes):
        rng = np.random.default_rng(episode)
        decide = list(policies(env, rng).values())[episode % 3]
        seen, _ = env.reset(seed=episode)
        step, over = 0, False
        while not over:
            seen, _, terminated, truncated, _ = env.step(decide(seen, step))
            step, over = step + 1, terminated or truncated
    return env.create_dataset(
        dataset_id=name,
        algorithm_name="greedy, periodic and random lamps in turn",
        author="the tropism developers",
        description="Virtual beans that are led from target to target by the choice of the lit lamp; the reward is in cm.",
        code_permalink="https://github.com/OWNER/tropism",
    )


def main():
    episodes = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    name = sys.argv[2] if len(sys.argv) > 2 else "tropism/bean-mixed-v0"
    data = record(episodes, name)
    returns = [float(episode.rewards.sum()) for episode in data.iterate_episodes()]
    means = ", ".join(
        f"{kind} {np.mean(returns[place::3]):.2f}" for place, kind in enumerate(("greedy", "periodic", "random"))
    )
    print(
        f"{name}: {data.total_episodes} episodes, {data.total_steps} steps (virtual beans); mean return in cm: {means}"
    )


if __name__ == "__main__":
    main()
