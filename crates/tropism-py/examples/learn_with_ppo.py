"""Learns to steer virtual beans by PPO (pip install torch): python learn_with_ppo.py [STEPS] [SEED]

One file, in the manner of CleanRL's ppo.py: actor and critic are networks of two layers of 64 neurons, generalized advantage
estimation, clipped surrogate objective (Schulman et al. 2017, arXiv:1707.06347; Schulman et al. 2016, arXiv:1506.02438). The agent
sees what `features` makes of the tip, and chooses a lamp for three steps (15 minutes): a bean answers too slowly for five. 64 beans
grow side by side in one vector environment. The score is that of the most probable lamp on 200 beans that it never saw.
"""

import sys
import time
from dataclasses import dataclass

import gymnasium
import numpy as np
import tropism  # noqa: F401

TARGETS = np.array([[3.0, 6.0], [-5.0, 9.0], [-1.0, 13.5]])
FEATURES = 9


@dataclass(frozen=True)
class Settings:
    """What decides the outcome. Unless it says otherwise, the values are those of CleanRL's ppo.py."""

    steps: int = 1_500_000  # decisions in all; chosen: some minutes on one core
    beans: int = 64
    rollout: int = 128  # decisions of each bean between two updates
    repeat: int = 3  # steps of the environment that a decision lasts; chosen of 3 and 4
    learning_rate: float = 1e-3  # chosen by hand
    gamma: float = 0.98  # chosen of 0.97 to 0.99
    gae_lambda: float = 0.95
    minibatches: int = 4
    epochs: int = 4
    clip: float = 0.2
    entropy: float = 0.01
    value: float = 0.5
    max_gradient: float = 0.5
    seed: int = 1


class Beans:
    """Beans side by side: features, and decisions that last some steps. A bean that is done begins anew as another one."""

    def __init__(self, count: int, repeat: int) -> None:
        self.env = gymnasium.make_vec("tropism/Bean-v0", num_envs=count)
        self.repeat = repeat

    def reset(self, seed: int) -> np.ndarray:
        seen, _ = self.env.reset(seed=seed)
        self.seen, self.before = seen, seen
        self.memory = np.zeros(len(seen))
        return self.features()

    def features(self) -> np.ndarray:
        """(beans, 9): where the tip is and how it moved, where the next two targets are, and the light of the last hours."""
        below = self.seen[:, None, 1] < TARGETS[None, :, 1]
        following = np.where(below.any(axis=1), below.argmax(axis=1), len(TARGETS) - 1)
        after = np.minimum(following + 1, len(TARGETS) - 1)
        here, shift = self.seen / 5, (self.seen - self.before) * 5
        to, beyond = (TARGETS[following] - self.seen) / 5, (TARGETS[after] - self.seen) / 5
        return np.column_stack([here, shift, to, beyond, self.memory]).astype(np.float32)

    def step(self, lamps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Lights a lamp for each bean, for one decision: features, the sum of the rewards, and which episodes ended."""
        total, done = np.zeros(len(lamps)), np.zeros(len(lamps), bool)
        self.before = self.seen
        for _ in range(self.repeat):
            # At the step after the last one the environment begins an episode, with a reward of 0.
            anew = done
            self.seen, reward, terminated, truncated, _ = self.env.step(lamps)
            total += reward * ~anew
            done = done | terminated | truncated
        # A bean that ended is observed again from where the new one begins.
        self.before = np.where(done[:, None], self.seen, self.before)
        self.memory = np.where(done, 0.0, 0.9 * self.memory + 0.1 * np.where(lamps == 1, 1.0, -1.0))
        return self.features(), total, done


def advantages(
    rewards: np.ndarray, values: np.ndarray, dones: np.ndarray, last_value: np.ndarray, gamma: float, gae_lambda: float
) -> np.ndarray:
    """Generalized advantage estimates, (rollout, beans). `dones[t]`: the episode ended with the decision t."""
    found, ahead = np.zeros_like(rewards), np.zeros_like(last_value)
    following = last_value
    for step in reversed(range(len(rewards))):
        goes_on = 1.0 - dones[step]
        delta = rewards[step] + gamma * following * goes_on - values[step]
        ahead = delta + gamma * gae_lambda * goes_on * ahead
        found[step], following = ahead, values[step]
    return found


def score(policy, beans: int, seed: int, repeat: int) -> np.ndarray:
    """The fitness of the first episode of each of some beans, in cm. `policy` takes features and gives lamps."""
    world = Beans(beans, repeat)
    features = world.reset(seed)
    total, running = np.zeros(beans), np.ones(beans, bool)
    while running.any():
        features, reward, done = world.step(policy(features))
        total += reward * running
        running &= ~done
    return total


def learn(settings: Settings, report=print):
    """The policy: a function of features that gives the most probable lamps."""
    import torch
    from torch import nn
    from torch.distributions import Categorical

    torch.manual_seed(settings.seed)
    torch.set_num_threads(1)
    dice = np.random.default_rng(settings.seed)

    def layer(inputs: int, outputs: int, gain: float) -> nn.Linear:
        linear = nn.Linear(inputs, outputs)
        nn.init.orthogonal_(linear.weight, gain)
        nn.init.zeros_(linear.bias)
        return linear

    def network(outputs: int, gain: float) -> nn.Sequential:
        root = 2**0.5
        return nn.Sequential(
            layer(FEATURES, 64, root), nn.Tanh(), layer(64, 64, root), nn.Tanh(), layer(64, outputs, gain)
        )

    actor, critic = network(2, 0.01), network(1, 1.0)
    weights = [*actor.parameters(), *critic.parameters()]
    optimizer = torch.optim.Adam(weights, lr=settings.learning_rate, eps=1e-5)
    world = Beans(settings.beans, settings.repeat)
    # The seeds of the score are below: these beans are others.
    features = world.reset(100_000 * settings.seed)
    updates = settings.steps // (settings.beans * settings.rollout)
    size = settings.beans * settings.rollout
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = settings.learning_rate * (1 - update / updates)
        seen, lamps, chances, values, rewards, dones = [], [], [], [], [], []
        with torch.no_grad():
            for _ in range(settings.rollout):
                inputs = torch.from_numpy(features)
                chosen = Categorical(logits=actor(inputs))
                lamp = chosen.sample()
                seen.append(features)
                lamps.append(lamp.numpy())
                chances.append(chosen.log_prob(lamp).numpy())
                values.append(critic(inputs)[:, 0].numpy())
                features, reward, done = world.step(lamp.numpy())
                rewards.append(reward)
                dones.append(done)
            last = critic(torch.from_numpy(features))[:, 0].numpy()
        worth = np.array(values, np.float64)
        gains = advantages(np.array(rewards), worth, np.array(dones), last, settings.gamma, settings.gae_lambda)
        flat = [np.concatenate(part) for part in (seen, lamps, chances)]
        inputs, taken, before = (torch.from_numpy(part) for part in flat)
        advantage = torch.from_numpy(gains.reshape(size).astype(np.float32))
        returns = torch.from_numpy((gains + worth).reshape(size).astype(np.float32))
        for _ in range(settings.epochs):
            for part in np.array_split(dice.permutation(size), settings.minibatches):
                chosen = Categorical(logits=actor(inputs[part]))
                ratio = (chosen.log_prob(taken[part]) - before[part]).exp()
                own = advantage[part]
                own = (own - own.mean()) / (own.std() + 1e-8)
                surrogate = torch.min(own * ratio, own * ratio.clamp(1 - settings.clip, 1 + settings.clip)).mean()
                error = 0.5 * (critic(inputs[part])[:, 0] - returns[part]).pow(2).mean()
                loss = settings.value * error - surrogate - settings.entropy * chosen.entropy().mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(weights, settings.max_gradient)
                optimizer.step()
        if (update + 1) % 10 == 0 or update + 1 == updates:
            ended = np.array(dones).sum()
            each = np.array(rewards).sum() / max(ended, 1)
            report(f"{(update + 1) * size:>8} decisions: {each:6.2f} cm a bean, {ended} beans ended in this rollout")

    def policy(features: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return actor(torch.from_numpy(features)).argmax(dim=1).numpy()

    return policy


def main() -> None:
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else Settings.steps
    settings = Settings(steps=steps, seed=int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    began = time.perf_counter()
    policy = learn(settings, lambda line: print(line, flush=True))
    took = time.perf_counter() - began
    found = score(policy, 200, 1, settings.repeat)
    print(
        f"200 other beans (virtual): {found.mean():.2f} cm (standard deviation {found.std(ddof=1):.2f}); {took:.0f} s"
    )


if __name__ == "__main__":
    main()
