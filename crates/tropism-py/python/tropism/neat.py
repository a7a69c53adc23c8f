"""NEAT by ask and tell, for any fitness.

    neat = Neat(inputs=2, outputs=1, seed=42, feed_forward=True)
    for _ in range(60):
        outputs = neat.networks().run(cases)          # (population, rows, outputs)
        neat.tell(4 - ((outputs[:, :, 0] - targets) ** 2).sum(axis=1))
    neat.champion.genome

`ask` returns the population as genomes, `tell` takes a score for each of them, larger is better. `Networks` evaluates a whole
population over numpy arrays, on all threads. A saved run goes on to the same bits.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tropism import _core
from tropism._core import Genome, Network, Networks
from tropism.errors import PlanError

if TYPE_CHECKING:
    import networkx
    import numpy as np
    import onnx
    from numpy.typing import NDArray

__all__ = [
    "Champion",
    "Generation",
    "Genome",
    "Neat",
    "Network",
    "Networks",
    "Novelty",
    "Species",
    "config",
    "to_networkx",
    "to_onnx",
]


@dataclass(frozen=True)
class Generation:
    """Statistics of a generation that was told its scores."""

    generation: int
    best: float
    mean: float
    median: float
    best_ever: float
    species: int
    population: int
    links_mean: float
    hidden_mean: float
    champion_links: int
    threshold: float
    evaluations: int


@dataclass(frozen=True)
class Champion:
    """The best individual of a run so far."""

    genome: Genome
    fitness: float
    generation: int


@dataclass(frozen=True)
class Species:
    """A species: `members` are places in the population, `stagnation` the generations since its best fitness."""

    id: int
    age: int
    stagnation: int
    best_fitness: float
    members: list[int]


def config(preset: str = "multineat", **changes: Any) -> dict[str, Any]:
    """The parameters of a preset (multineat, stanley2002, wahby2016, ball_keeper), with changes.

    Raises PlanError if a parameter is unknown.

    >>> import tropism
    >>> tropism.neat.config("stanley2002", population=30)["population"]
    30
    """
    values: dict[str, Any] = json.loads(_core.neat_config(preset))
    for key, value in changes.items():
        if key not in values:
            raise PlanError(f"found parameter {key!r}, wanted one of {', '.join(values)}")
        values[key] = value
    return values


class Neat:
    """A run of NEAT: `ask` for the population, score it, `tell` the scores, repeat.

    `inputs` excludes the bias, which every network has. Parameters are those of `config`: a preset, and changes by name.
    One seed gives the same bits on every machine and with any number of threads.

    >>> import numpy as np
    >>> from tropism.neat import Neat
    >>> cases, wanted = np.array([[0, 0], [0, 1], [1, 0], [1, 1]]), np.array([0, 1, 1, 0])
    >>> neat = Neat(inputs=2, outputs=1, seed=42, feed_forward=True)
    >>> for _ in range(3):
    ...     outputs = neat.networks().run(cases)
    ...     generation = neat.tell(4 - ((outputs[:, :, 0] - wanted) ** 2).sum(axis=1))
    >>> generation.generation, neat.champion.fitness > 2
    (2, True)
    """

    def __init__(self, inputs: int, outputs: int, seed: int = 1, preset: str = "multineat", **parameters: Any) -> None:
        self._neat = _core.Neat(json.dumps(config(preset, **parameters)), inputs, outputs, seed)

    def ask(self) -> list[Genome]:
        """The population to score, in order."""
        return self._neat.ask()

    def networks(self) -> Networks:
        """The networks of the population, in the order of `ask`."""
        return self._neat.networks()

    def tell(self, scores: Sequence[float] | NDArray[np.float64]) -> Generation:
        """Takes a finite score for each genome of `ask`, in order, and breeds the next generation.

        Raises PlanError, and leaves the run as it was, if their number differs or one of them is not finite.
        """
        return Generation(**json.loads(self._neat.tell(scores)))

    def evolve(
        self,
        fitness: Callable[[Genome], float],
        generations: int,
        watch: Callable[[Generation], object] | None = None,
    ) -> Champion:
        """Scores each genome by `fitness` for some generations; `watch` sees each generation. Returns the champion."""
        for _ in range(generations):
            generation = self.tell([fitness(genome) for genome in self.ask()])
            if watch is not None:
                watch(generation)
        if self.champion is None:
            raise PlanError(f"found {generations} generations, wanted at least one")
        return self.champion

    @property
    def champion(self) -> Champion | None:
        """The best individual so far; None before the first `tell`."""
        champion = self._neat.champion
        return None if champion is None else Champion(*champion)

    @property
    def config(self) -> dict[str, Any]:
        """All parameters of this run."""
        values: dict[str, Any] = json.loads(self._neat.config)
        return values

    @property
    def species(self) -> list[Species]:
        """The species of the present population."""
        return [Species(*species) for species in self._neat.species]

    @property
    def seed(self) -> int:
        """The seed of this run."""
        return self._neat.seed

    @property
    def generation(self) -> int:
        """Number of the present generation; the initial population is 0."""
        return self._neat.generation

    @property
    def evaluations(self) -> int:
        """Number of scores taken so far."""
        return self._neat.evaluations

    def to_json(self) -> str:
        """The whole run as JSON."""
        return self._neat.to_json()

    @classmethod
    def from_json(cls, text: str) -> Neat:
        """The run that `to_json` wrote. It goes on to the same bits."""
        neat = cls.__new__(cls)
        neat._neat = _core.Neat.from_json(text)
        return neat

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the whole run. A file that is there is replaced at once or not at all."""
        partial = f"{os.fspath(path)}.part"
        with open(partial, "w", encoding="utf-8") as file:
            file.write(self.to_json())
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Neat:
        """The run that `save` wrote."""
        with open(path, encoding="utf-8") as file:
            return cls.from_json(file.read())

    def __repr__(self) -> str:
        return f"Neat(generation={self.generation}, evaluations={self.evaluations}, seed={self.seed})"

    def __getstate__(self) -> str:
        return self.to_json()

    def __setstate__(self, text: str) -> None:
        self._neat = _core.Neat.from_json(text)


class Novelty:
    """Novelty search: behaviour descriptors become scores, for tasks with a deceptive objective.

    >>> from tropism.neat import Novelty
    >>> Novelty().scores([[0, 0], [0, 1], [5, 5]]).shape
    (3,)
    """

    def __init__(self, **settings: Any) -> None:
        self._novelty = _core.Novelty(json.dumps(settings))

    def scores(self, behaviours: Any) -> NDArray[np.float64]:
        """The novelty of each behaviour, a row each: (individuals, numbers) in, (individuals,) out. The archive grows."""
        return self._novelty.scores(behaviours)


def to_networkx(genome: Genome) -> networkx.DiGraph[int]:
    """The genome as a directed graph: neurons by id with kind, depth and activation, links with weight and innovation.

    >>> import tropism
    >>> genome = tropism.neat.Neat(inputs=2, outputs=1).ask()[0]
    >>> tropism.neat.to_networkx(genome).number_of_nodes() == len(genome.neurons)
    True
    """
    import networkx

    graph: networkx.DiGraph[int] = networkx.DiGraph()
    for number, kind, depth, activation, a, b in genome.neurons:
        graph.add_node(number, kind=kind, depth=depth, activation=activation, a=a, b=b)
    for innovation, start, end, weight in genome.links:
        graph.add_edge(start, end, weight=weight, innovation=innovation)
    return graph


def to_onnx(genome: Genome) -> onnx.ModelProto:
    """The network of a genome as an ONNX model in double precision.

    A feed-forward network has the input `inputs` (rows, inputs) and the output `outputs` (rows, outputs). Any other network has
    the input `state` and the output `next_state` (rows, neurons), too: the model is one synchronous step, which begins
    with a state of zeros.

    >>> import tropism
    >>> genome = tropism.neat.Neat(inputs=2, outputs=1, feed_forward=True).ask()[0]
    >>> [output.name for output in tropism.neat.to_onnx(genome).graph.output]
    ['outputs']
    """
    from tropism.onnx_export import exported

    return exported(genome)
