"""Exclusive or by neat-python, beside `cargo run --release -p tropism-neat --example xor`: scripts/peers/xor.py [SEEDS]

    python3 -m venv /tmp/peers && /tmp/peers/bin/pip install 'neat-python==2.0.*' && /tmp/peers/bin/python scripts/peers/xor.py

A run is solved, as ours, when all four outputs of its best network are on the right side of one half; it ends after 300
generations. Settings and fitness are those of the example that neat-python's documentation begins with.
"""

import random
import statistics
import sys
import tempfile

import neat

CASES = [((0.0, 0.0), 0.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 0.0)]
MOST_GENERATIONS = 300

# The values of examples/xor/config-feedforward in neat-python's repository, without a fitness at which a run ends.
NEAT_PYTHON = {
    "NEAT": dict(fitness_criterion="max", fitness_threshold=1e9, no_fitness_termination=True, pop_size=150,
                 reset_on_extinction=False),
    "DefaultGenome": dict(
        num_inputs=2, num_hidden=0, num_outputs=1, initial_connection="full", feed_forward=True,
        compatibility_disjoint_coefficient=1.0, compatibility_excess_coefficient=1.0, compatibility_weight_coefficient=0.5,
        conn_add_prob=0.5, conn_delete_prob=0.5, node_add_prob=0.2, node_delete_prob=0.2,
        single_structural_mutation=False, structural_mutation_surer="default",
        activation_default="sigmoid", activation_options="sigmoid", activation_mutate_rate=0.0,
        aggregation_default="sum", aggregation_options="sum", aggregation_mutate_rate=0.0,
        bias_init_mean=0.0, bias_init_stdev=1.0, bias_init_type="gaussian", bias_max_value=30.0, bias_min_value=-30.0,
        bias_mutate_power=0.5, bias_mutate_rate=0.7, bias_replace_rate=0.1,
        response_init_mean=1.0, response_init_stdev=0.0, response_init_type="gaussian", response_max_value=30.0,
        response_min_value=-30.0, response_mutate_power=0.0, response_mutate_rate=0.0, response_replace_rate=0.0,
        weight_init_mean=0.0, weight_init_stdev=1.0, weight_init_type="gaussian", weight_max_value=30.0,
        weight_min_value=-30.0, weight_mutate_power=0.5, weight_mutate_rate=0.8, weight_replace_rate=0.1,
        enabled_default=True, enabled_mutate_rate=0.01, enabled_rate_to_true_add=0.0, enabled_rate_to_false_add=0.0,
        time_constant_init_mean=1.0, time_constant_init_stdev=0.0, time_constant_init_type="gaussian",
        time_constant_replace_rate=0.0, time_constant_mutate_rate=0.0, time_constant_mutate_power=0.0,
        time_constant_max_value=1.0, time_constant_min_value=1.0),
    "DefaultSpeciesSet": dict(compatibility_threshold=3.0),
    "DefaultStagnation": dict(species_fitness_func="max", max_stagnation=20, species_elitism=2),
    "DefaultReproduction": dict(elitism=2, survival_threshold=0.2, min_species_size=2),
}  # fmt: skip


def is_solved(outputs):
    return all((output > 0.5) == (target > 0.5) for output, (_, target) in zip(outputs, CASES))


class Solved(Exception):
    """Ends a run of neat-python."""


def neat_python(seed):
    """Evaluations until a run is solved, or `None`."""
    random.seed(seed)
    with tempfile.NamedTemporaryFile("w", suffix=".ini") as file:
        for section, values in NEAT_PYTHON.items():
            file.write(f"[{section}]\n" + "".join(f"{key} = {value}\n" for key, value in values.items()))
        file.flush()
        config = neat.Config(
            neat.DefaultGenome, neat.DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation, file.name
        )
    evaluations = 0

    def score(genomes, _config):
        nonlocal evaluations
        best = None
        for _, genome in genomes:
            network = neat.nn.FeedForwardNetwork.create(genome, config)
            outputs = [network.activate(inputs)[0] for inputs, _ in CASES]
            genome.fitness = 4.0 - sum((output - target) ** 2 for output, (_, target) in zip(outputs, CASES))
            evaluations += 1
            if best is None or genome.fitness > best[0]:
                best = (genome.fitness, outputs)
        if is_solved(best[1]):
            raise Solved

    try:
        neat.Population(config).run(score, MOST_GENERATIONS)
    except Solved:
        return evaluations
    except neat.CompleteExtinctionException:
        pass
    return None


def main():
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    solved = [count for count in map(neat_python, range(seeds)) if count is not None]
    spread = f"{statistics.fmean(solved):.0f} ({statistics.pstdev(solved):.0f})" if solved else "-"
    print(f"neat-python: solved {len(solved)} of {seeds}, evaluations {spread}")


main()
