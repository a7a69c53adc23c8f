"""What baselines reach in the environments, in two tables: python baselines.py [EPISODES] [paper] [beyond]

Each controller steers the same plants, through the environment's observations alone: random lamps, one lamp that stays lit, the
paper's periodic lamps, the greedy rule, a network evolved on the tip-motion model, and a rule tuned on the stem model, both of six
other beans. Its models know the plane of the front camera alone: the rule for targets in space is tuned for them without their
depth. All plants are virtual. What a search that knows the future reaches is the clairvoyant optimum of
docs/explanation/transfer.md.
"""

import statistics
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import tropism
from tropism.loop import CoreController

Policy = Callable[[np.ndarray], int]


def of_spec(spec: dict, env) -> Callable[[int], Policy]:
    """A controller of the core for the task of an environment."""
    bare = env.unwrapped
    kind = bare.task.get("kind", "targets")

    def begin(_: int) -> Policy:
        controller = CoreController(spec, task=bare.task, layout=bare.layout)
        if kind == "space":
            return lambda seen: controller.decide_at(*seen)
        if kind == "obstacles":
            return lambda seen: controller.decide_at(seen[0], seen[1], stem=seen[2:22].reshape(-1, 2))
        return lambda seen: controller.decide_at(float(seen[0]), float(seen[1]))

    return begin


def random_lamps(env) -> Callable[[int], Policy]:
    count = int(env.action_space.n)

    def begin(number: int) -> Policy:
        dice = np.random.default_rng(number)
        return lambda _: int(dice.integers(count))

    return begin


def score(env, begin: Callable[[int], Policy], episodes: int) -> list[dict]:
    """The last info of each episode."""
    found = []
    for number in range(episodes):
        seen, info = env.reset(seed=1000 if number == 0 else None)
        policy, over = begin(number), False
        while not over:
            seen, _, terminated, truncated, info = env.step(policy(seen))
            over = terminated or truncated
        found.append(info)
    return found


def fitness(infos: list[dict]) -> str:
    values = [info["fitness"] for info in infos]
    return f"{statistics.mean(values):.2f} ({statistics.stdev(values):.2f})"


def table(rows: dict[str, dict[str, Callable]], envs: dict, episodes: int, cell: Callable[[list[dict]], str]) -> None:
    """A row for each controller, a column for each environment. A row has a maker of controllers for each environment it knows."""
    print("| controller | " + " | ".join(envs) + " |\n|---|" + "---|" * len(envs))
    for title, makers in rows.items():
        cells = [cell(score(env, makers[name](env), episodes)) if name in makers else "" for name, env in envs.items()]
        print(f"| {title} | " + " | ".join(cells) + " |", flush=True)
    print()


def with_models(folder: Path) -> None:
    """Models of six beans under periodic lamps."""
    tropism.grow(out=folder / "beans", monitor=False)
    tropism.fit(tracks=[folder / "beans"], out=folder / "tip.json", monitor=False)
    tropism.fit(tracks=[folder / "beans"], kind="stem", out=folder / "stem.json", monitor=False)


def tuned(folder: Path, name: str, task: dict | None) -> dict:
    path = folder / f"{name}.json"
    tropism.tune(model=folder / "stem.json", task=task, out=path, monitor=False)
    return tropism.controller_of(path)


def paper(folder: Path, episodes: int) -> None:
    """The paper's task."""
    tropism.evolve(model=folder / "tip.json", out=folder / "evolution", monitor=False)
    specs = {
        "periodic, every 6 h": {"kind": "periodic", "minutes": 360},
        "greedy": {"kind": "greedy"},
        "evolved (tip model)": tropism.controller_of(folder / "evolution" / "champion.json"),
        "tuned rule (stem model)": tuned(folder, "rule", None),
    }
    names = ["tropism/TipModel-v0", "tropism/Stem-v0", "tropism/Bean-v0"]
    envs = {name: gymnasium.make(name) for name in names}
    rows = {"random": dict.fromkeys(names, random_lamps)}
    rows |= {title: dict.fromkeys(names, partial(of_spec, spec)) for title, spec in specs.items()}
    print(f"mean fitness (standard deviation) of {episodes} plants, in cm, of at most 15; virtual plants\n")
    table(rows, envs, episodes, fitness)


def beyond(folder: Path, episodes: int) -> None:
    """Obstacles, and targets in space."""
    obstacles, space = "tropism/Obstacles-v0", "tropism/Space-v0"
    envs = {name: gymnasium.make(name) for name in (obstacles, space)}
    in_plane = {"targets": [target[:2] for target in envs[space].unwrapped.task["targets"]]}
    both = {"greedy": {"kind": "greedy"}, "periodic, every 6 h": {"kind": "periodic", "minutes": 360}}
    rows = {"random": dict.fromkeys(envs, random_lamps)}
    rows["the right lamp stays lit"] = dict.fromkeys(envs, lambda env: lambda number: lambda seen: 1)
    rows |= {title: dict.fromkeys(envs, partial(of_spec, spec)) for title, spec in both.items()}
    rows["tuned rule (stem model)"] = {
        obstacles: partial(of_spec, tuned(folder, "obstacles", envs[obstacles].unwrapped.task)),
        space: partial(of_spec, tuned(folder, "space", in_plane)),
    }

    def cell(infos: list[dict]) -> str:
        text = fitness(infos)
        if "is_done" in infos[0]:
            contacts = statistics.mean(float(info["contact_steps"] > 0) for info in infos)
            done = statistics.mean(float(info["is_done"]) for info in infos)
            return f"{text}; touched {contacts:.0%}, done {done:.0%}"
        missed = statistics.median(float(distance) for info in infos for distance in info["target_distances_cm"])
        return f"{text}; {missed:.2f} cm from a target"

    best = ", ".join(f"{name}: at most {env.unwrapped.best_fitness:.2f}" for name, env in envs.items())
    print(f"mean fitness (standard deviation) of {episodes} plants; {best}; virtual plants")
    print(
        "touched: share of plants whose stem touched; done: reached without touching; median distance from the targets\n"
    )
    table(rows, envs, episodes, cell)


def main() -> None:
    words = sys.argv[1:]
    episodes = int(words.pop(0)) if words and words[0].isdigit() else 200
    with tempfile.TemporaryDirectory() as folder:
        with_models(Path(folder))
        for name, part in {"paper": paper, "beyond": beyond}.items():
            if not words or name in words:
                part(Path(folder), episodes)


if __name__ == "__main__":
    main()
