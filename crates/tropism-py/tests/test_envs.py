"""Gymnasium environments: what Gymnasium checks, and the same bits as the workflows."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tropism
from tropism.loop import species
from tropism.tracks import Track

gymnasium = pytest.importorskip("gymnasium")
for name in ("SDL_VIDEODRIVER", "SDL_AUDIODRIVER"):
    os.environ.setdefault(name, "dummy")

PLACES = ["tropism/TipModel-v0", "tropism/Bean-v0", "tropism/Stem-v0"]
ALL = [*PLACES, "tropism/Tent-v0"]
SHORT: dict[str, Any] = {"max_steps": 40}


def rule(seen: np.ndarray[Any, Any]) -> int:
    """The greedy rule on the paper's targets."""
    for x, y in ((3, 6), (-5, 9), (-1, 13.5)):
        if seen[1] < y:
            return int(seen[0] < x)
    return int(seen[0] < -1)


def episode(env: Any, seed: int | None) -> tuple[np.ndarray[Any, Any], float]:
    seen, _ = env.reset(seed=seed)
    tips, fitness, over = [seen[:2]], 0.0, False
    while not over:
        seen, reward, terminated, truncated, info = env.step(rule(seen))
        fitness += reward
        tips.append(seen[:2])
        over = terminated or truncated
    assert info["fitness"] == fitness and info["is_virtual"]
    return np.array(tips), fitness


@pytest.mark.parametrize("name", ALL)
def test_gymnasium_finds_nothing_to_warn_of(name: str) -> None:
    from gymnasium.utils.env_checker import check_env

    skip = not has_pygame()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", module=r"pygame|pkg_resources")
        warnings.filterwarnings("ignore", message=".*pkg_resources.*|.*avx2.*")
        environment = gymnasium.make(name, render_mode="rgb_array")
        check_env(environment.unwrapped, skip_render_check=skip)
        environment.close()


def has_pygame() -> bool:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import pygame  # noqa: F401
    except ImportError:
        return False
    return True


def test_importing_tropism_registers_before_and_after_gymnasium() -> None:
    for order in ("import tropism, gymnasium", "import gymnasium, tropism", "import tropism; import gymnasium as g"):
        code = f"{order}; import gymnasium; print(sum(name.startswith('tropism/') for name in gymnasium.registry))"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout == "4\n"
    light = "import tropism, sys; print([name for name in ('numpy', 'gymnasium') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", light], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


@pytest.mark.parametrize("name", PLACES)
def test_many_plants_are_as_one_by_one(name: str) -> None:
    one = gymnasium.make(name, task=SHORT)
    many = gymnasium.make_vec(name, num_envs=5, task=SHORT)
    assert many.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    seen, _ = many.reset(seed=7)
    assert many.observation_space.contains(seen)
    tips, rewards, ends = [seen], [], []
    for _ in range(90):
        actions = np.array([rule(row) for row in seen])
        seen, reward, terminated, truncated, _ = many.step(actions)
        assert many.observation_space.contains(seen)
        tips.append(seen)
        rewards.append(reward)
        ends.append(terminated | truncated)
    for place in range(5):
        seeds, row = [7 + place, None], 0
        for seed in seeds:
            wanted, fitness = episode(one, seed)
            steps = len(wanted) - 1
            found = np.array([tip[place][:2] for tip in tips[row : row + steps + 1]])
            np.testing.assert_array_equal(found, wanted)
            assert sum(reward[place] for reward in rewards[row : row + steps]) == pytest.approx(fitness, abs=1e-9)
            assert ends[row + steps - 1][place] and rewards[row + steps][place] == 0.0
            row += steps + 1


def test_threads_change_no_bit() -> None:
    code = (
        "import gymnasium, tropism, numpy as np, hashlib\n"
        "digest = hashlib.sha256()\n"
        "for name in ('TipModel', 'Bean'):\n"
        "    many = gymnasium.make_vec(f'tropism/{name}-v0', num_envs=300)\n"
        "    digest.update(many.reset(seed=1)[0].tobytes())\n"
        "    for step in range(30):\n"
        "        digest.update(many.step(np.arange(300) // 7 % 2)[0].tobytes())\n"
        "print(digest.hexdigest())\n"
    )
    said = set()
    for threads in ("1", "2"):
        environment = {**os.environ, "RAYON_NUM_THREADS": threads}
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
        said.add(done.stdout)
    assert len(said) == 1


def test_tip_model_is_that_of_simulate(model: Path, tmp_path: Path) -> None:
    env = gymnasium.make("tropism/TipModel-v0", model=model)
    found, fitness = episode(env, 5)
    results = tropism.simulate(
        model=model, controller={"kind": "greedy"}, seed=5, episodes=2, out=tmp_path / "t.csv", monitor=False
    )
    np.testing.assert_allclose(Track.read(results.track).tips, found, rtol=0, atol=5e-6)  # files have five decimals
    _, second = episode(env, None)
    assert (fitness + second) / 2 == pytest.approx(results.mean_fitness, abs=1e-9)


def test_beans_are_those_of_grow(tmp_path: Path) -> None:
    env = gymnasium.make("tropism/Bean-v0", tip="detector", task={"max_steps": 60})
    results = tropism.grow(
        plants=2, seed=4, controller={"kind": "greedy"}, task={"max_steps": 60}, out=tmp_path / "b", monitor=False
    )
    for number, seed in enumerate((4, None)):
        found, fitness = episode(env, seed)
        np.testing.assert_allclose(Track.read(results.tracks[number]).tips, found, rtol=0, atol=5e-6)
        assert results.fitness[number] == pytest.approx(fitness, abs=1e-9)


def test_photographs_are_those_of_run(tmp_path: Path) -> None:
    config = tropism.PLANS["run"]().complete()["config"]
    config.update(seed=3, controller={"kind": "greedy"}, task={"max_steps": 12})
    config["rig"]["greenhouse"]["scene"].update(width=432, height=324)
    tropism.run(out=tmp_path / "run", config=config, monitor=False)
    env = gymnasium.make("tropism/Tent-v0", task={"max_steps": 12})
    pixels, info = env.reset(seed=3)
    truncated = False
    for photograph in tropism.Run(tmp_path / "run"):
        np.testing.assert_array_equal(photograph.pixels(), pixels)
        assert photograph.tip == pytest.approx(info["tip"], abs=5e-6)
        assert photograph.quality == info["quality"]
        if photograph.light is None:
            break
        assert photograph.light == ("left", "right")[rule(np.array(info["tip"]))]
        pixels, _, _, truncated, info = env.step(rule(np.array(info["tip"])))
    assert truncated and info["step"] == 12


def test_options_reach_the_plants() -> None:
    def end(**options: Any) -> np.ndarray[Any, Any]:
        tips, _ = episode(gymnasium.make("tropism/Bean-v0", task={"max_steps": 100}, **options), 2)
        last: np.ndarray[Any, Any] = tips[-1]
        return last

    root = Path(__file__).resolve().parents[3]
    plain, others = (
        end(),
        [
            end(greenhouse={"scale": 0.0}),
            end(greenhouse={"bean": species(root / "beans" / "internodal-bean.toml")}),
            end(tip="detector"),
            end(period_min=10.0),
        ],
    )
    assert all((other != plain).any() for other in others)
    dropped = gymnasium.make("tropism/Tent-v0", greenhouse={"faults": {"dropped": 1.0}})
    pixels, info = dropped.reset(seed=1)
    assert pixels.max() == 0 and info["quality"] == "held"


def test_what_is_wrong_is_named() -> None:
    with pytest.raises(tropism.PlanError, match="greenhouse: bena: unknown field"):
        gymnasium.make("tropism/Bean-v0", greenhouse={"bena": 1})
    with pytest.raises(tropism.PlanError, match="found a model of the tip"):
        gymnasium.make("tropism/Stem-v0", model=tropism.loop.Model.of_virtual_beans("tip", plants=1, steps=50))
    many = gymnasium.make_vec("tropism/TipModel-v0", num_envs=3)
    many.reset(seed=1)
    with pytest.raises(tropism.PlanError, match="found action 2, wanted 0 to 1"):
        many.step(np.array([0, 1, 2]))


def test_a_picture_shows_the_plant_and_its_targets() -> None:
    for name in PLACES:
        env = gymnasium.make(name, render_mode="rgb_array")
        env.reset(seed=1)
        for _ in range(20):
            env.step(1)
        picture = env.render()
        assert picture.shape == (324, 432, 3) and picture.dtype == np.uint8
        assert (picture == (230, 60, 60)).all(axis=2).sum() > 50
