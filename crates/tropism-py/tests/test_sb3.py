"""Stable-Baselines3 and other readers of environments: modes of autoreset, copies, processes, and the VecEnv."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
import tropism

gymnasium = pytest.importorskip("gymnasium")
tropism.register_envs()
from gymnasium.vector import AutoresetMode  # noqa: E402

SHORT: dict[str, Any] = {"max_steps": 12}
NAMES = ["tropism/TipModel-v0", "tropism/Bean-v0", "tropism/Stem-v0", "tropism/Obstacles-v0", "tropism/Space-v0"]


def lamps(count: int, step: int) -> np.ndarray[Any, Any]:
    """Some lamps, others at each step and place."""
    return (np.arange(count) + step // 3) % 2


def test_reserved_keys_are_free() -> None:
    env = gymnasium.make("tropism/Bean-v0", task=SHORT)
    _, info = env.reset(seed=1)
    assert "episode" not in info and info["plant"] == 0 and info["seed"] == 1
    wrapped = gymnasium.wrappers.RecordEpisodeStatistics(env)
    wrapped.reset(seed=1)
    over = False
    while not over:
        _, _, terminated, truncated, info = wrapped.step(0)
        over = terminated or truncated
    assert info["episode"]["l"] == 12 and info["episode"]["r"] == pytest.approx(info["fitness"])


def test_specs_have_thresholds_and_limits() -> None:
    spec = gymnasium.spec("tropism/Bean-v0")
    assert spec.reward_threshold == 10.0 and spec.max_episode_steps == 1000


@pytest.mark.parametrize("name", NAMES)
def test_modes_of_autoreset_grow_the_same_plants(name: str) -> None:
    task = {**gymnasium.make(name).unwrapped.task, **SHORT}
    found: dict[Any, Any] = {}
    for mode in AutoresetMode:
        many = gymnasium.make_vec(name, num_envs=3, task=task, autoreset_mode=mode)
        assert many.metadata["autoreset_mode"] == mode
        seen, info = many.reset(seed=5)
        rows, finals = [seen], []
        for step in range(12):
            seen, _, terminated, truncated, info = many.step(lamps(3, step))
        assert (terminated | truncated).all()
        if mode == AutoresetMode.SAME_STEP:
            finals = list(info["final_obs"])
            assert info["final_info"]["step"].tolist() == [12, 12, 12] and info["step"].tolist() == [0, 0, 0]
        else:
            finals = list(seen)
            if mode == AutoresetMode.NEXT_STEP:
                seen, rewards, _, _, info = many.step(lamps(3, 12))
                assert (rewards == 0).all()
            else:
                with pytest.raises(tropism.PlanError, match="plant 0: the episode is over: call reset"):
                    many.step(lamps(3, 12))
                seen, info = many.reset(options={"reset_mask": np.array([True, True, True])})
        assert info["plant"].tolist() == [1, 1, 1] and info["seed"].tolist() == [5, 6, 7]
        found[mode] = (np.array(rows), np.array(finals), np.array(seen))
    first = found[AutoresetMode.NEXT_STEP]
    for other in (AutoresetMode.SAME_STEP, AutoresetMode.DISABLED):
        for one, two in zip(first, found[other], strict=True):
            np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("name", NAMES)
def test_copies_and_pickles_go_on_to_the_same_bits(name: str) -> None:
    options = {"tip": "detector"} if name == "tropism/Bean-v0" else {}
    one, many = gymnasium.make(name, **options).unwrapped, gymnasium.make_vec(name, num_envs=3, **options)
    one.reset(seed=3)
    many.reset(seed=3)
    for step in range(9):
        one.step(step % 2)
        many.step(lamps(3, step))
    for again in (copy.deepcopy(one), copy.copy(one), pickle.loads(pickle.dumps(one))):
        np.testing.assert_array_equal(again.render() or 0, one.render() or 0)
        expected = copy.deepcopy(one)
        for step in range(5):
            new, old = again.step(step % 2), expected.step(step % 2)
            np.testing.assert_array_equal(new[0], old[0])
            assert new[1] == old[1] and new[4]["fitness"] == old[4]["fitness"] and new[4]["step"] == 10 + step
        np.testing.assert_array_equal(again.reset()[0], expected.reset()[0])
    again = pickle.loads(pickle.dumps(many))
    for step in range(5):
        np.testing.assert_array_equal(again.step(lamps(3, step))[0], many.step(lamps(3, step))[0])


def test_the_tent_is_vectorised_with_the_same_photographs() -> None:
    task = {"max_steps": 3}
    size = {"width": 216, "height": 162, "task": task}
    one, many = gymnasium.make("tropism/Tent-v0", **size), gymnasium.make_vec("tropism/Tent-v0", num_envs=2, **size)
    pictures, info = many.reset(seed=7)
    assert many.observation_space.contains(pictures) and info["quality"][0] == "measured"
    rows = [pictures]
    for step in range(5):
        pictures, rewards, _, truncated, info = many.step(lamps(2, step))
        rows.append(pictures)
        assert truncated.tolist() == [step == 2] * 2
    for place in range(2):
        seen, _ = one.reset(seed=7 + place)
        np.testing.assert_array_equal(seen, rows[0][place])
        for step in range(3):
            seen, reward, _, _, info = one.step(lamps(2, step)[place])
            np.testing.assert_array_equal(seen, rows[step + 1][place])
        np.testing.assert_array_equal(one.reset()[0], rows[4][place])
    again = copy.deepcopy(many)
    np.testing.assert_array_equal(again.step(lamps(2, 9))[0], many.step(lamps(2, 9))[0])


@pytest.mark.parametrize("name", ["tropism/Bean-v0", "tropism/Tent-v0"])
def test_steps_without_an_episode_are_errors(name: str) -> None:
    env = gymnasium.make(name, task={"max_steps": 1}, disable_env_checker=True).unwrapped
    with pytest.raises(ValueError, match="call reset before step"):
        env.step(0)
    env.reset(seed=1)
    env.step(0)
    with pytest.raises(ValueError, match="the episode is over"):
        env.step(0)
    env.reset(seed=1)
    with pytest.raises(TypeError):
        env.step(0.5)
    many = gymnasium.make_vec(name, num_envs=2)
    with pytest.raises(ValueError, match="call reset before step"):
        many.step([0, 1])
    many.reset(seed=1)
    with pytest.raises(TypeError, match="found float64, wanted whole numbers"):
        many.step(np.array([0.7, 1.2]))
    with pytest.raises(ValueError, match=r"shape \(3,\), wanted \(2,\)"):
        many.step([0, 1, 1])


def test_single_precision_pictures_and_attributes() -> None:
    one = gymnasium.make("tropism/Stem-v0", dtype="float32", task=SHORT)
    many = gymnasium.make_vec("tropism/Stem-v0", num_envs=2, dtype="float32", task=SHORT, render_mode="rgb_array")
    for env in (one, many):
        seen, _ = env.reset(seed=1)
        assert seen.dtype == np.float32 and env.observation_space.contains(seen)
    pictures = many.render()
    assert len(pictures) == 2 and pictures[0].shape == (324, 432, 3) and pictures[0].any()
    assert many.unwrapped.get_attr("task") == (many.unwrapped.task,) * 2
    assert many.unwrapped.get_attr("observation_space")[0] == one.observation_space
    with pytest.raises(ValueError, match="float32 or float64"):
        gymnasium.make("tropism/Bean-v0", dtype="float16")


@pytest.mark.slow
def test_processes_are_spawned() -> None:
    many = gymnasium.make_vec(
        "tropism/Bean-v0", num_envs=2, vectorization_mode="async", vector_kwargs={"context": "spawn"}, task=SHORT
    )
    side_by_side = gymnasium.make_vec("tropism/Bean-v0", num_envs=2, task=SHORT)
    np.testing.assert_array_equal(many.reset(seed=4)[0], side_by_side.reset(seed=4)[0])
    np.testing.assert_array_equal(many.step([0, 1])[0], side_by_side.step([0, 1])[0])
    many.close()


def test_the_vec_env_of_stable_baselines() -> None:
    pytest.importorskip("stable_baselines3", reason="no Stable-Baselines3: its VecEnv is not tested")
    from stable_baselines3.common.vec_env import VecMonitor
    from tropism.sb3 import make_vec_env

    plants = make_vec_env("tropism/Bean-v0", 3, seed=5, task=SHORT)
    seen = plants.reset()
    assert seen.dtype == np.float32 and plants.get_attr("best_fitness") == [plants.plants.best_fitness] * 3
    for step in range(12):
        seen, rewards, dones, infos = plants.step(lamps(3, step))
    assert dones.all() and rewards.dtype == np.float32
    single = gymnasium.make("tropism/Bean-v0", task=SHORT)
    single.reset(seed=6)
    for step in range(12):
        last, _, _, _, info = single.step(lamps(3, step)[1])
    np.testing.assert_array_equal(infos[1]["terminal_observation"], last.astype(np.float32))
    assert infos[1]["episode"] == {"r": info["fitness"], "l": 12} and infos[1]["TimeLimit.truncated"]
    np.testing.assert_array_equal(seen[1], single.reset()[0].astype(np.float32))
    monitored = VecMonitor(make_vec_env("tropism/TipModel-v0", 2, seed=1, task=SHORT))
    monitored.reset()
    for step in range(12):
        *_, infos = monitored.step(lamps(2, step))
    assert infos[0]["episode"]["l"] == 12


@pytest.mark.slow
def test_ppo_of_stable_baselines_learns_on_the_batch() -> None:
    """The script of sixty lines that a user of Stable-Baselines3 would write: it crashed on the reserved key."""
    sb3 = pytest.importorskip("stable_baselines3", reason="no Stable-Baselines3: PPO is not run")
    from tropism.sb3 import make_vec_env

    plants = make_vec_env("tropism/TipModel-v0", 64, seed=1)
    model = sb3.PPO("MlpPolicy", plants, n_steps=64, batch_size=1024, seed=1, device="cpu")
    model.learn(100_000)
    returns = [episode["r"] for episode in model.ep_info_buffer]
    assert np.mean(returns) > 3.0
    single = sb3.PPO("MlpPolicy", gymnasium.make("tropism/Bean-v0"), n_steps=64, device="cpu")
    single.learn(128)
