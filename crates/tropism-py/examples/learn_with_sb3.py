"""Learns Bean-v0 by PPO of Stable-Baselines3 (pip install stable-baselines3): python learn_with_sb3.py [MINUTES] [SEED]

64 beans grow side by side in one `VecEnv`. A wrapper shows the agent what a tip alone does not: how it moved, where the next two
targets are, and the light of the last hours; a decision lasts three steps (15 minutes), for a bean answers slowly. It stops when
the mean of the last 200 episodes reaches the reward threshold of the environment. The score is that of the most probable lamp on
200 beans that it never saw.
"""

import sys
import time

import gymnasium
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper
from tropism.sb3 import make_vec_env

REPEAT = 3


class Steered(VecEnvWrapper):
    """Features of the tip, and decisions of some steps."""

    def __init__(self, plants):
        super().__init__(plants, gymnasium.spaces.Box(-np.inf, np.inf, (9,), np.float32))
        self.targets = np.array(plants.get_attr("task")[0]["targets"], np.float32)

    def reset(self):
        self.seen = self.venv.reset()
        self.before, self.memory = self.seen, np.zeros(self.num_envs, np.float32)
        return self.features(self.seen)

    def features(self, seen):
        below = seen[:, None, 1] < self.targets[None, :, 1]
        number = np.where(below.any(axis=1), below.argmax(axis=1), len(self.targets) - 1)
        beyond = self.targets[np.minimum(number + 1, len(self.targets) - 1)]
        parts = [seen / 5, (seen - self.before) * 5, (self.targets[number] - seen) / 5, (beyond - seen) / 5]
        return np.column_stack([*parts, self.memory]).astype(np.float32)

    def step_async(self, actions):
        self.actions = actions

    def step_wait(self):
        total, over, infos = np.zeros(self.num_envs, np.float32), np.zeros(self.num_envs, bool), [{}] * self.num_envs
        self.before = self.seen
        for _ in range(REPEAT):
            # A bean that began anew within the decision goes on: what it earns then belongs to no decision.
            seen, rewards, dones, new = self.venv.step(self.actions)
            total += rewards * ~over
            infos = [first if ended else info for first, info, ended in zip(infos, new, over, strict=True)]
            for place in np.flatnonzero(dones & ~over):
                final = seen.copy()
                final[place] = infos[place]["terminal_observation"]
                infos[place]["terminal_observation"] = self.features(final)[place]
            over, self.seen = over | dones, seen
        self.memory = np.where(over, 0, 0.9 * self.memory + 0.1 * (2 * self.actions - 1)).astype(np.float32)
        self.before = np.where(over[:, None], self.seen, self.before)
        return self.features(self.seen), total, over, infos


class UntilSolved(BaseCallback):
    """Stops at the threshold, or when the time is over."""

    def __init__(self, threshold, seconds):
        super().__init__()
        self.threshold, self.seconds, self.began = threshold, seconds, time.perf_counter()
        self.mean = float("-inf")

    def _on_rollout_end(self):
        returns = [episode["r"] for episode in self.model.ep_info_buffer]
        if len(returns) == self.model.ep_info_buffer.maxlen:
            self.mean = float(np.mean(returns))
        took = time.perf_counter() - self.began
        print(f"{took:5.0f} s {self.num_timesteps:>8} decisions: {np.mean(returns or [0]):6.2f} cm", flush=True)

    def _on_step(self):
        return self.mean < self.threshold and time.perf_counter() - self.began < self.seconds


def score(model, seed, count=200):
    """The fitness of the first episode of some beans, in cm."""
    plants = Steered(make_vec_env("tropism/Bean-v0", count, seed=seed))
    seen, found = plants.reset(), np.full(count, np.nan)
    while np.isnan(found).any():
        seen, _, dones, infos = plants.step(model.predict(seen, deterministic=True)[0])
        for place in np.flatnonzero(dones & np.isnan(found)):
            found[place] = infos[place]["episode"]["r"]
    return found


def main():
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 5.0
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    plants = Steered(make_vec_env("tropism/Bean-v0", 64, seed=100_000 * seed))
    settings = {
        "n_steps": 128,
        "batch_size": 2048,
        "n_epochs": 4,
        "learning_rate": 1e-3,
        "gamma": 0.98,
        "ent_coef": 0.01,
    }
    model = PPO("MlpPolicy", plants, seed=seed, device="cpu", stats_window_size=200, **settings)
    stop = UntilSolved(gymnasium.spec("tropism/Bean-v0").reward_threshold, 60 * minutes)
    model.learn(100_000_000, callback=stop)
    found = score(model, 1)
    print(f"mean of 200 episodes while learning: {stop.mean:.2f} cm; 200 other beans (virtual): {found.mean():.2f} cm")


if __name__ == "__main__":
    main()
