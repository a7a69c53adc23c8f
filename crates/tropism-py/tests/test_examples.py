"""Parts of the example scripts, and short runs of those that learn where torch is installed."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("tropism.envs")


def example(name: str) -> ModuleType:
    path = Path(__file__).resolve().parents[1] / "examples" / name
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # dataclasses look for it
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def ppo() -> ModuleType:
    return example("learn_with_ppo.py")


def greedy(features: np.ndarray) -> np.ndarray:
    """Towards the next target: its x from the tip is the fifth feature."""
    return (features[:, 4] > 0).astype(np.int64)


def test_generalized_advantages_are_sums_of_errors_to_the_end_of_the_episode(ppo: ModuleType) -> None:
    rng = np.random.default_rng(1)
    rewards, values = rng.normal(size=(12, 3)), rng.normal(size=(12, 3))
    last, dones = rng.normal(size=3), rng.random((12, 3)) < 0.2
    gamma, gae_lambda = 0.9, 0.8
    found = ppo.advantages(rewards, values, dones, last, gamma, gae_lambda)
    following = np.vstack([values[1:], last])
    for bean in range(3):
        for start in range(12):
            total, weight = 0.0, 1.0
            for step in range(start, 12):
                ends = dones[step, bean]
                ahead = 0.0 if ends else gamma * following[step, bean]
                total += weight * (rewards[step, bean] + ahead - values[step, bean])
                if ends:
                    break
                weight *= gamma * gae_lambda
            assert found[start, bean] == pytest.approx(total, abs=1e-12)


def test_decisions_add_rewards_up_and_a_bean_that_ends_begins_anew(ppo: ModuleType) -> None:
    import gymnasium

    many, world = gymnasium.make_vec("tropism/Bean-v0", num_envs=3), ppo.Beans(3, 4)
    seen, features = many.reset(seed=5)[0], world.reset(5)
    np.testing.assert_allclose(features[:, :2] * 5, seen, rtol=1e-6)
    ends = 0
    for _ in range(250):
        lamps = greedy(features)
        features, reward, done = world.step(lamps)
        total, over = np.zeros(3), np.zeros(3, bool)
        for _ in range(4):
            before = over
            seen, own, terminated, truncated, _ = many.step(lamps)
            total += np.where(before, 0.0, own)
            over = over | terminated | truncated
        np.testing.assert_array_equal(done, over)
        np.testing.assert_array_equal(reward, total)
        np.testing.assert_allclose(features[:, :2] * 5, seen, rtol=1e-6)
        assert (features[done, 2:4] == 0).all() and (features[done, 8] == 0).all()
        ends += int(done.sum())
    assert ends >= 3


def test_the_score_of_a_policy_is_that_of_the_environment(ppo: ModuleType) -> None:
    import gymnasium

    found = ppo.score(greedy, 4, seed=9, repeat=1)
    for bean in range(4):
        env = gymnasium.make("tropism/Bean-v0")
        seen, info = env.reset(seed=9 + bean)
        over = False
        while not over:
            x = next((x for x, y in ppo.TARGETS if seen[1] < y), ppo.TARGETS[-1][0])
            seen, _, terminated, truncated, info = env.step(int(seen[0] < x))
            over = terminated or truncated
        assert found[bean] == pytest.approx(info["fitness"], abs=1e-9)


@pytest.mark.slow
def test_a_short_run_learns_and_repeats(ppo: ModuleType) -> None:
    pytest.importorskip("torch")
    settings = ppo.Settings(steps=100_000, beans=32, rollout=64)
    policy = ppo.learn(settings, lambda line: None)
    found = ppo.score(policy, 40, 1, settings.repeat)
    random = np.random.default_rng(1)
    assert found.mean() > ppo.score(lambda seen: random.integers(0, 2, len(seen)), 40, 1, settings.repeat).mean() + 4
    again = ppo.learn(settings, lambda line: None)
    np.testing.assert_array_equal(ppo.score(again, 40, 1, settings.repeat), found)


@pytest.mark.slow
def test_an_lstm_is_a_plant_model() -> None:
    pytest.importorskip("torch", reason="torch is not installed: the LSTM is not trained")
    from tropism import loop

    lstm = example("lstm_model.py")
    tracks = [
        loop.grow({"kind": "periodic", "minutes": 180}, {"kind": "open_loop", "max_steps": 200}, seed)[0]
        for seed in (1, 2)
    ]
    model = lstm.LstmModel.fit(tracks, epochs=60)
    track, fitness = loop.simulate(model, task={"max_steps": 100})
    assert len(track) == 101 and np.isfinite(track.tips).all()
    assert loop.simulate(model, task={"max_steps": 100})[1] == fitness
    # It follows the light as beans do.
    sides = [{"kind": "periodic", "minutes": 100_000, "first": lamp} for lamp in ("left", "right")]
    left, right = (loop.simulate(model, side, {"max_steps": 60})[0].tips[-1, 0] for side in sides)
    assert left < right - 1.0
    evolved = loop.evolve(model, {"max_steps": 20}, runs=1, generations=2, neat={"population": 6})
    assert len(evolved) == 1 and np.isfinite(evolved[0].fitness)


@pytest.mark.slow
def test_stable_baselines_learns_decisions_of_some_steps() -> None:
    stable_baselines3 = pytest.importorskip("stable_baselines3", reason="no Stable-Baselines3: its example is not run")
    from tropism.sb3 import make_vec_env

    learning = example("learn_with_sb3.py")
    plants = learning.Steered(make_vec_env("tropism/Bean-v0", 8, seed=1))
    model = stable_baselines3.PPO("MlpPolicy", plants, n_steps=64, batch_size=256, seed=1, device="cpu")
    model.learn(512, callback=learning.UntilSolved(10.0, 60.0))
    found = learning.score(model, 1, 4)
    assert len(found) == 4 and np.isfinite(found).all()


@pytest.mark.slow
def test_an_offline_data_set_holds_the_episodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("minari", "h5py", "jax"):
        pytest.importorskip(package, reason=f"no {package}: no data set is written")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    data = example("offline_dataset.py").record(3, "tropism/test-v0")
    assert data.total_episodes == 3 and data.total_steps > 300
