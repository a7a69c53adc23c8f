"""What a generation costs neat-python beside its evaluations: CPU milliseconds, and species at the end. Scores have no meaning."""

import sys
import tempfile
import time

import neat

CONFIG = """
[NEAT]
fitness_criterion = max
fitness_threshold = 1e9
no_fitness_termination = True
pop_size = {population}
reset_on_extinction = True

[DefaultGenome]
num_inputs = 2
num_hidden = 0
num_outputs = 1
initial_connection = full
feed_forward = False
compatibility_disjoint_coefficient = 1.0
compatibility_excess_coefficient = 1.0
compatibility_weight_coefficient = 0.5
conn_add_prob = 0.03
conn_delete_prob = 0.0
node_add_prob = 0.04
node_delete_prob = 0.0
single_structural_mutation = True
structural_mutation_surer = False
activation_default = sigmoid
activation_options = sigmoid
activation_mutate_rate = 0.0
aggregation_default = sum
aggregation_options = sum
aggregation_mutate_rate = 0.0
bias_init_mean = 0.0
bias_init_stdev = 1.0
bias_init_type = gaussian
bias_replace_rate = 0.05
bias_mutate_rate = 0.75
bias_mutate_power = 0.4
bias_max_value = 8.0
bias_min_value = -8.0
response_init_mean = 1.0
response_init_stdev = 0.0
response_init_type = gaussian
response_replace_rate = 0.0
response_mutate_rate = 0.0
response_mutate_power = 0.0
response_max_value = 8.0
response_min_value = -8.0
weight_init_mean = 0.0
weight_init_stdev = 1.0
weight_init_type = gaussian
weight_max_value = 8
weight_min_value = -8
weight_mutate_power = 0.4
weight_mutate_rate = 0.75
weight_replace_rate = 0.05
enabled_default = True
enabled_mutate_rate = 0.0
enabled_rate_to_true_add = 0.0
enabled_rate_to_false_add = 0.0
time_constant_init_mean = 1.0
time_constant_init_stdev = 0.0
time_constant_init_type = gaussian
time_constant_replace_rate = 0.0
time_constant_mutate_rate = 0.0
time_constant_mutate_power = 0.0
time_constant_max_value = 1.0
time_constant_min_value = 1.0

[DefaultSpeciesSet]
compatibility_threshold = {threshold}

[DefaultStagnation]
species_fitness_func = max
max_stagnation = 50
species_elitism = 2

[DefaultReproduction]
elitism = 1
survival_threshold = 0.6
min_species_size = 1
"""


def main():
    population, generations, threshold = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    with tempfile.NamedTemporaryFile("w", suffix=".ini") as file:
        file.write(CONFIG.format(population=population, threshold=threshold))
        file.flush()
        config = neat.Config(
            neat.DefaultGenome, neat.DefaultReproduction, neat.DefaultSpeciesSet, neat.DefaultStagnation, file.name
        )
    run = neat.Population(config)
    count = 0

    def score(genomes, _config):
        nonlocal count
        for _key, genome in genomes:
            count += 1
            genome.fitness = (count * 0x9E3779B97F4A7C15 % 2**64 >> 40) / 1e7

    run.run(score, 10)
    start = time.process_time()
    run.run(score, generations)
    print(f"{1000 * (time.process_time() - start) / generations:.3f} {len(run.species.species)}")


main()
