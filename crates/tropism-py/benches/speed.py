"""Prints how fast the package is: python speed.py [PART...]; docs/validation/python-speed.md and sweeps-on-a-cluster.md hold
what it printed.

Parts: import, calls, environments, neat, evolve (beside the command of PROGRAM), interrupt, sweep (needs Ray).
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import timeit
from functools import partial
from pathlib import Path

import numpy as np
import tropism
from tropism import neat

QUIET = {"monitor": False}


def say(what: str, value: float, unit: str) -> None:
    print(f"{what:<62} {value:>12,.2f} {unit}", flush=True)


def best(work, rounds: int = 5) -> float:
    """The least processor time of some rounds, in s: other programs only add to it."""
    times = []
    for _ in range(rounds):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times)


def model(folder: Path) -> Path:
    tropism.grow(out=folder / "beans", **QUIET)
    tropism.fit(tracks=[folder / "beans"], out=folder / "model.json", **QUIET)
    return folder / "model.json"


def imports(_: Path) -> None:
    code = "import time; t = time.perf_counter(); import tropism; print(time.perf_counter() - t)"
    times = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(7)]
    say("import tropism, median of 7", 1000 * sorted(times)[3], "ms")


def calls(_: Path) -> None:
    import gymnasium

    tropism.register_envs()
    run = neat.Neat(2, 1, seed=1)
    network = neat.Network(run.ask()[0])
    array = np.array([1.0, 0.5])
    # Half a million steps of one episode.
    endless = {"kind": "open_loop", "max_steps": 1_000_000}
    env = gymnasium.make("tropism/TipModel-v0", task=endless).unwrapped
    env.reset(seed=1)
    cases = {
        "Network.activate, list": lambda: network.activate([1.0, 0.5]),
        "Network.activate, numpy": lambda: network.activate(array),
        "a step of TipModel-v0 in the core": lambda: env._batch.step_one(1),
        "TipModel-v0 env.step": lambda: env.step(1),
    }
    for name, call in cases.items():
        say(name, 1e6 * min(timeit.repeat(call, number=50_000, repeat=5)) / 50_000, "us a call")


def environments(_: Path) -> None:
    import gymnasium

    tropism.register_envs()
    for name, count, steps in (
        ("TipModel", 1024, 1500),
        ("Stem", 256, 400),
        ("Bean", 1024, 100),
        ("Bean", 1024, 400),
        ("Obstacles", 1024, 100),
        ("Space", 1024, 100),
    ):
        env = gymnasium.make_vec(f"tropism/{name}-v0", num_envs=count)
        actions = np.random.default_rng(1).integers(0, int(env.single_action_space.n), (steps, count))

        def work(env=env, actions=actions):
            env.reset(seed=1)
            for row in actions:
                env.step(row)

        say(
            f"{name}-v0, {count} plants, {steps} steps each",
            count * steps / best(work, 3) / 1000,
            "thousand steps a second and core",
        )


def stable_baselines(_: Path) -> None:
    from tropism.sb3 import make_vec_env

    for count in (64, 256, 1024):
        plants = make_vec_env("tropism/Bean-v0", count, seed=1)
        actions = np.random.default_rng(1).integers(0, 2, (400, count))

        def work(plants=plants, actions=actions):
            plants.reset()
            for row in actions:
                plants.step(row)

        began = time.perf_counter()
        taken = 400 * count / best(work, 3) / 1000
        say(f"Bean-v0 as VecEnv, {count} plants, 400 steps each", taken, "thousand steps a second of processor time")
        say(
            "  by the clock, the mean of three",
            3 * 400 * count / (time.perf_counter() - began) / 1000,
            "thousand a second",
        )


NEAT_PYTHON = """
[NEAT]
fitness_criterion = max
fitness_threshold = 99
pop_size = 150
reset_on_extinction = False
no_fitness_termination = True
[DefaultGenome]
activation_default = sigmoid
activation_mutate_rate = 0.0
activation_options = sigmoid
aggregation_default = sum
aggregation_mutate_rate = 0.0
aggregation_options = sum
bias_init_mean = 0.0
bias_init_stdev = 1.0
bias_init_type = gaussian
bias_max_value = 30.0
bias_min_value = -30.0
bias_mutate_power = 0.5
bias_mutate_rate = 0.7
bias_replace_rate = 0.1
compatibility_disjoint_coefficient = 1.0
compatibility_weight_coefficient = 0.5
conn_add_prob = 0.5
conn_delete_prob = 0.5
enabled_default = True
enabled_mutate_rate = 0.01
enabled_rate_to_true_add = 0.0
enabled_rate_to_false_add = 0.0
feed_forward = True
initial_connection = full_direct
node_add_prob = 0.2
node_delete_prob = 0.2
num_hidden = 0
num_inputs = 2
num_outputs = 1
response_init_mean = 1.0
response_init_stdev = 0.0
response_init_type = gaussian
response_max_value = 30.0
response_min_value = -30.0
response_mutate_power = 0.0
response_mutate_rate = 0.0
response_replace_rate = 0.0
single_structural_mutation = false
structural_mutation_surer = default
weight_init_mean = 0.0
weight_init_stdev = 1.0
weight_init_type = gaussian
weight_max_value = 30.0
weight_min_value = -30.0
weight_mutate_power = 0.5
weight_mutate_rate = 0.8
weight_replace_rate = 0.1
[DefaultSpeciesSet]
compatibility_threshold = 3.0
[DefaultStagnation]
species_fitness_func = max
max_stagnation = 20
species_elitism = 2
[DefaultReproduction]
elitism = 2
survival_threshold = 0.2
min_species_size = 2
"""
CASES = [((0.0, 0.0), 0.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 0.0)]
GENERATIONS = 100


def neats(folder: Path) -> None:
    """XOR at population 150, with the fitness in Python, one network at a time."""

    def begun() -> neat.Neat:
        return neat.Neat(2, 1, seed=1, preset="stanley2002", feed_forward=True)

    def fitness(genome) -> float:
        network = neat.Network(genome)
        return 4.0 - sum((network.run(inputs)[0] - target) ** 2 for inputs, target in CASES)

    own = best(lambda: begun().evolve(fitness, GENERATIONS), 3) / GENERATIONS
    say("tropism.neat, XOR, population 150, fitness in Python", 1000 * own, "ms a generation")
    array = np.array([inputs for inputs, _ in CASES])
    targets = np.array([target for _, target in CASES])

    def vectorised() -> None:
        other = begun()
        for _ in range(GENERATIONS):
            outputs = other.networks().run(array)[:, :, 0]
            other.tell(4.0 - ((outputs - targets) ** 2).sum(axis=1))

    say("tropism.neat, the same over numpy arrays", 1000 * best(vectorised, 3) / GENERATIONS, "ms a generation")
    try:
        import random

        import neat as neat_python
    except ImportError:
        print("no neat-python (pip install neat-python): not compared")
        return
    (folder / "neat.ini").write_text(NEAT_PYTHON)
    config = neat_python.Config(
        neat_python.DefaultGenome,
        neat_python.DefaultReproduction,
        neat_python.DefaultSpeciesSet,
        neat_python.DefaultStagnation,
        str(folder / "neat.ini"),
    )

    def evaluate(genomes, config) -> None:
        for _, genome in genomes:
            network = neat_python.nn.FeedForwardNetwork.create(genome, config)
            genome.fitness = 4.0 - sum((network.activate(inputs)[0] - target) ** 2 for inputs, target in CASES)

    def their_evolution() -> None:
        random.seed(1)
        neat_python.Population(config).run(evaluate, GENERATIONS)

    theirs = best(their_evolution, 3) / GENERATIONS
    say("neat-python, the same task", 1000 * theirs, "ms a generation")
    say("neat-python's time over tropism.neat's", theirs / own, "times")


def evolve(folder: Path) -> None:
    """An evolution from Python and from the command line, in turn; the least of each, in wall and in processor time.

    On a machine that others use, too, wall times say little.
    """
    import resource

    path, evolution = model(folder), {"runs": 20, "generations": 500}
    program, rounds = os.environ.get("PROGRAM"), int(os.environ.get("ROUNDS", "5"))
    walls: dict[str, list[float]] = {"Python": [], "command": []}
    works: dict[str, list[float]] = {"Python": [], "command": []}
    (folder / "e.toml").write_text("[evolution]\nruns = 20\ngenerations = 500\n")

    def timed(name: str, who: int, work) -> None:
        before, began = resource.getrusage(who), time.perf_counter()
        work()
        after = resource.getrusage(who)
        walls[name].append(time.perf_counter() - began)
        works[name].append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)

    for number in range(rounds):
        own, theirs = folder / f"p{number}", folder / f"c{number}"
        call = partial(tropism.evolve, model=path, out=own, evolution=evolution, **QUIET)
        timed("Python", resource.RUSAGE_SELF, call)
        if program:
            files = ["--model", str(path), "--config", str(folder / "e.toml"), "--out", str(theirs)]
            words = [program, "evolve", *files, "--quiet"]
            timed(
                "command",
                resource.RUSAGE_CHILDREN,
                partial(subprocess.run, words, check=True, stdout=subprocess.DEVNULL),
            )
            champions = [(out / "champion.json").read_bytes() for out in (own, theirs)]
            assert champions[0] == champions[1], "the same seed gives the same champion"
    for name in walls:
        if walls[name]:
            say(f"evolve, 20 runs of 500 generations, from {name}", min(walls[name]), "s")
            say("  processor time", min(works[name]), "s")
    if program:
        say("Python's processor time over the command's", min(works["Python"]) / min(works["command"]), "")


def interrupt(folder: Path) -> None:
    """From SIGINT to the exception, while an evolution works."""
    code = (
        "import sys, time, tropism\n"
        "class Tell(tropism.Monitor):\n"
        "    told = False\n"
        "    def generation(self, run, statistics):\n"
        "        if not self.told: print('going', flush=True)\n"
        "        self.told = True\n"
        "try: tropism.evolve(model=sys.argv[1], out=sys.argv[2], monitor=Tell(), evolution={'generations': 1000000})\n"
        "except KeyboardInterrupt: print(time.time(), flush=True)\n"
    )
    path, times = model(folder), []
    for number in range(10):
        words = [sys.executable, "-c", code, str(path), str(folder / f"i{number}")]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        process.stdout.readline()
        time.sleep(0.3)
        began = time.time()
        process.send_signal(signal.SIGINT)
        times.append(float(process.stdout.read()) - began)
        process.wait()
    say("from Ctrl-C to Interrupted, saved: median of 10", 1000 * sorted(times)[5], "ms")
    say("from Ctrl-C to Interrupted, saved: greatest of 10", 1000 * max(times), "ms")


def sweep(folder: Path) -> None:
    """24 units on one worker and on two, with one thread each."""
    import ray

    config = {"model": str(model(folder)), "seeds": 24, "evolve": {"evolution": {"runs": 1, "generations": 1200}}}
    walls, digests = {}, {}
    for workers in (1, 2):
        ray.init(num_cpus=workers, log_to_driver=False, include_dashboard=False)
        # Workers are started, and have imported tropism, before the clock runs.
        ray.get([ray.remote(lambda: __import__("tropism")._core.__version__).remote() for _ in range(workers)])
        began, out = time.perf_counter(), folder / f"sweep-{workers}"
        results = tropism.sweep(config, out=out, engine="ray", workers=workers, monitor=False)
        walls[workers] = time.perf_counter() - began
        digests[workers] = [path.read_bytes() for path in sorted(out.glob("units/*/unit.json"))]
        say(f"sweep of 24 units on Ray, workers: {workers}", walls[workers], "s")
        say("  processor time of the units", sum(unit["cpu_seconds"] for unit in results.units), "s")
        ray.shutdown()
    files = [path.stat().st_size for path in (folder / "sweep-1" / "units").rglob("*") if path.is_file()]
    say("  files in the shared folder", sum(files) / 24 / 1024, "KiB a unit")
    say("wall time of two workers over one's", walls[2] / walls[1], "")
    print("the same bits:", digests[1] == digests[2])


PARTS = {
    "import": imports,
    "calls": calls,
    "environments": environments,
    "sb3": stable_baselines,
    "neat": neats,
    "evolve": evolve,
    "interrupt": interrupt,
    "sweep": sweep,
}


def main() -> None:
    os.environ.setdefault("RAY_AUTH_MODE", "disabled")
    print(json.dumps({"version": tropism.__version__, "python": sys.version.split()[0], "cores": os.cpu_count()}))
    for name in sys.argv[1:] or PARTS:
        with tempfile.TemporaryDirectory() as folder:
            PARTS[name](Path(folder))


if __name__ == "__main__":
    main()
