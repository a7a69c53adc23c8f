"""NEAT by ask and tell: evaluation over arrays, files, graphs and ONNX."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import tropism
from tropism import neat

CASES = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])
TARGETS = np.array([0.0, 1.0, 1.0, 0.0])


def xor(run: neat.Neat) -> neat.Generation:
    outputs = run.networks().run(CASES)[:, :, 0]
    return run.tell(4 - ((outputs - TARGETS) ** 2).sum(axis=1))


def grown(**parameters: object) -> neat.Neat:
    """A run whose genomes have grown under random scores."""
    run = neat.Neat(2, 2, seed=3, mutate_add_neuron_prob=0.3, mutate_add_link_prob=0.5, **parameters)  # type: ignore[arg-type]
    scores = np.random.default_rng(1)
    for _ in range(25):
        run.tell(scores.random(len(run.ask())))
    return run


def test_xor_is_solved() -> None:
    run = neat.Neat(2, 1, seed=42, preset="stanley2002", feed_forward=True)
    last = [xor(run) for _ in range(60)][-1]
    assert last.generation == 59 and run.generation == 60
    assert run.champion is not None and run.champion.fitness > 3.0
    assert sum(len(species.members) for species in run.species) == len(run.ask())


def test_a_fitness_in_python_sees_genomes() -> None:
    run = neat.Neat(2, 1, seed=1, population=10)
    seen: list[int] = []
    champion = run.evolve(lambda genome: -len(genome.links), 3, watch=lambda found: seen.append(found.generation))
    assert seen == [0, 1, 2]
    assert champion.fitness == -len(champion.genome.links)


@pytest.mark.parametrize("feed_forward", [True, False])
def test_many_networks_give_what_one_gives(feed_forward: bool) -> None:
    run = grown(feed_forward=feed_forward)
    inputs = np.random.default_rng(2).normal(size=(40, 2))
    outputs = run.networks().run(inputs)
    own = run.networks().run(np.broadcast_to(inputs, (len(run.ask()), 40, 2)))
    assert outputs.shape == (len(run.ask()), 40, 2)
    np.testing.assert_array_equal(outputs, own)
    for genome, found in zip(run.ask(), outputs, strict=True):
        network = neat.Network(genome)
        np.testing.assert_array_equal(found, [network.run(row) for row in inputs])


def test_steps_of_many_networks_keep_their_state() -> None:
    run = grown(recurrent_prob=0.5)
    genomes = run.ask()
    many, one = neat.Networks(genomes), [neat.Network(genome) for genome in genomes]
    for step in range(6):
        inputs = np.full((len(genomes), 2), 0.1 * step)
        if step == 4:
            mask = np.arange(len(genomes)) % 2 == 0
            many.flush(mask)
            for network, chosen in zip(one, mask, strict=True):
                if chosen:
                    network.flush()
        found = many.activate(inputs)
        np.testing.assert_array_equal(found, [network.activate([0.1 * step] * 2) for network in one])


def test_a_saved_run_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    run = neat.Neat(2, 1, seed=5)
    for _ in range(5):
        xor(run)
    run.save(tmp_path / "run.json")
    again = neat.Neat.load(tmp_path / "run.json")
    copy = pickle.loads(pickle.dumps(run))
    for _ in range(5):
        assert xor(run) == xor(again) == xor(copy)
    assert [genome.to_json() for genome in run.ask()] == [genome.to_json() for genome in again.ask()]


def test_scores_that_cannot_be_are_refused() -> None:
    run = neat.Neat(2, 1, population=10)
    with pytest.raises(tropism.PlanError, match="found 3"):
        run.tell([1.0, 2.0, 3.0])
    with pytest.raises(tropism.PlanError, match="NaN"):
        run.tell([float("nan")] * 10)
    with pytest.raises(tropism.PlanError, match="populaton"):
        neat.Neat(2, 1, populaton=10)
    with pytest.raises(tropism.PlanError, match=r"shape \(4, 3\)"):
        run.networks().run(np.zeros((4, 3)))
    with pytest.raises(tropism.PlanError, match="found 3 inputs, wanted 2"):
        neat.Network(run.ask()[0]).run([1.0, 2.0, 3.0])
    assert run.generation == 0


def test_a_genome_is_a_graph() -> None:
    pytest.importorskip("networkx")
    genome = grown().ask()[0]
    graph = neat.to_networkx(genome)
    assert graph.number_of_nodes() == len(genome.neurons)
    assert sorted(data["weight"] for *_, data in graph.edges(data=True)) == sorted(link[3] for link in genome.links)
    assert neat.Genome.from_json(genome.to_json()) == genome


ACTIVATIONS = [
    "unsigned_step", "signed_step", "unsigned_sigmoid", "signed_sigmoid", "tanh", "unsigned_gauss", "signed_gauss", "abs",
    "sine", "linear", "relu", "softplus",
]  # fmt: skip


@pytest.mark.parametrize("activation", ACTIVATIONS)
@pytest.mark.parametrize("feed_forward", [True, False])
def test_onnx_computes_the_same(activation: str, feed_forward: bool) -> None:
    pytest.importorskip("onnx")
    onnxruntime = pytest.importorskip("onnxruntime")
    run = grown(
        feed_forward=feed_forward,
        recurrent_prob=0.0 if feed_forward else 0.6,
        hidden_activation=activation,
        output_activation=activation,
        population=30,
    )
    inputs = np.random.default_rng(4).normal(size=(50, 2))
    genome = max(
        (genome for genome in run.ask() if genome.is_feed_forward == feed_forward), key=lambda genome: len(genome.links)
    )
    session = onnxruntime.InferenceSession(neat.to_onnx(genome).SerializeToString())
    network = neat.Network(genome)
    wanted = np.array([network.run(row) for row in inputs])
    if feed_forward:
        (found,) = session.run(["outputs"], {"inputs": inputs})
    else:
        state, rows = np.zeros((1, len(genome.neurons))), []
        for row in inputs:
            outputs, state = session.run(["outputs", "next_state"], {"inputs": row[None], "state": state})
            rows.append(outputs[0])
        found = np.array(rows)
    if activation.endswith("step"):
        np.testing.assert_array_equal(found, wanted)
    else:
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6)


def test_novelty_scores_behaviours() -> None:
    scores = neat.Novelty().scores(np.array([[0.0, 0.0], [0.1, 0.0], [5.0, 5.0]]))
    assert scores.shape == (3,) and scores[2] == scores.max()
