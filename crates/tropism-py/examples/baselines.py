"""What baselines reach in the environments, in one table: python baselines.py [EPISODES]

Each controller steers the same plants, through the environment's observations alone: random lamps, the paper's periodic lamps,
the greedy rule, a network evolved on the tip-motion model, and a rule tuned on the stem model, both of six other beans. All plants
are virtual. What a search that knows the future reaches is the ceiling of docs/transfer.md.
"""

import statistics
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import gymnasium
import numpy as np
import tropism
from tropism.loop import CoreController

Policy = Callable[[np.ndarray], int]


def made(folder: Path) -> dict[str, Callable[[int], Policy]]:
    """A maker of each controller, which takes the number of the episode."""
    tropism.grow(out=folder / "beans", monitor=False)
    tropism.fit(tracks=[folder / "beans"], out=folder / "tip.json", monitor=False)
    tropism.fit(tracks=[folder / "beans"], kind="stem", out=folder / "stem.json", monitor=False)
    tropism.evolve(model=folder / "tip.json", out=folder / "evolution", monitor=False)
    tropism.tune(model=folder / "stem.json", out=folder / "rule.json", monitor=False)
    specs = {
        "periodic, every 6 h": {"kind": "periodic", "minutes": 360},
        "greedy": {"kind": "greedy"},
        "evolved (tip model)": tropism.controller_of(folder / "evolution" / "champion.json"),
        "tuned rule (stem model)": tropism.controller_of(folder / "rule.json"),
    }

    def of_spec(spec: dict) -> Callable[[int], Policy]:
        def begin(_: int) -> Policy:
            controller = CoreController(spec)
            return lambda seen: controller.decide_at(float(seen[0]), float(seen[1]))

        return begin

    def random(number: int) -> Policy:
        dice = np.random.default_rng(number)
        return lambda _: int(dice.integers(2))

    return {"random": random, **{name: of_spec(spec) for name, spec in specs.items()}}


def score(name: str, begin: Callable[[int], Policy], episodes: int) -> list[float]:
    env = gymnasium.make(name)
    found = []
    for number in range(episodes):
        seen, info = env.reset(seed=1000 if number == 0 else None)
        policy, over = begin(number), False
        while not over:
            seen, _, terminated, truncated, info = env.step(policy(seen))
            over = terminated or truncated
        found.append(info["fitness"])
    return found


def main() -> None:
    episodes = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    names = ["tropism/TipModel-v0", "tropism/Stem-v0", "tropism/Bean-v0"]
    with tempfile.TemporaryDirectory() as folder:
        makers = made(Path(folder))
    print(f"mean fitness (standard deviation) of {episodes} plants, in cm, of at most 15; virtual plants\n")
    print("| controller | " + " | ".join(names) + " |\n|---|" + "---|" * len(names))
    for title, begin in makers.items():
        scores = [score(name, begin, episodes) for name in names]
        cells = [f"{statistics.mean(own):.2f} ({statistics.stdev(own):.2f})" for own in scores]
        print(f"| {title} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
