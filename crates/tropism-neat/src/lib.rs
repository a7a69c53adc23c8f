//! NEAT.
