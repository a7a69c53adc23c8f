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
from tropism import loop
from tropism.loop import CoreController, species
from tropism.tracks import Track

gymnasium = pytest.importorskip("gymnasium")
tropism.register_envs()
for name in ("SDL_VIDEODRIVER", "SDL_AUDIODRIVER"):
    os.environ.setdefault(name, "dummy")

PLACES = ["tropism/TipModel-v0", "tropism/Bean-v0", "tropism/Stem-v0"]
#: Environments whose way is told by the task, and what the core's greedy rule is told of an observation.
STEERED = ["tropism/Obstacles-v0", "tropism/Space-v0"]
ALL = [*PLACES, *STEERED, "tropism/Tent-v0"]
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


def test_importing_tropism_registers_where_gymnasium_is_loaded() -> None:
    orders = ("import gymnasium, tropism", "import tropism.envs", "import tropism, gymnasium; tropism.register_envs()")
    for order in orders:
        code = f"{order}; import gymnasium; print(sum(name.startswith('tropism/') for name in gymnasium.registry))"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout == "6\n"
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


def greedy(env: Any) -> Any:
    """The core's greedy rule for the task of an environment, as a function of its observation."""
    bare = env.unwrapped
    controller = CoreController({"kind": "greedy"}, task=bare.task, layout=bare.layout)
    is_in_space = bare.task["kind"] in ("space", "spiral")
    return lambda seen: controller.decide_at(seen[0], seen[1], seen[2] if is_in_space else None)


def steered(env: Any, seed: int | None) -> tuple[list[np.ndarray[Any, Any]], list[dict[str, Any]], float]:
    """The observations, infos and fitness of an episode under the greedy rule."""
    seen, info = env.reset(seed=seed)
    decide, rows, infos, fitness, over = greedy(env), [seen], [info], 0.0, False
    while not over:
        seen, reward, terminated, truncated, info = env.step(decide(seen))
        fitness += reward
        rows.append(seen)
        infos.append(info)
        over = terminated or truncated
    return rows, infos, fitness


def task_file(name: str) -> Path:
    return Path(__file__).resolve().parents[3] / "tasks" / name


@pytest.mark.parametrize(("name", "file"), [(STEERED[0], "disc.toml"), (STEERED[1], "space.toml")])
def test_the_default_task_is_that_of_its_file(name: str, file: str) -> None:
    tomllib = pytest.importorskip("tomllib")
    task = gymnasium.make(name).unwrapped.task
    for key, value in tomllib.loads(task_file(file).read_text()).items():
        assert task[key] == value, key


@pytest.mark.parametrize("name", STEERED)
def test_steered_beans_are_those_of_the_workflows(name: str, tmp_path: Path) -> None:
    """Grown tracks are files of five decimals; fitness of beans without photographs is the same to the bit."""
    env = gymnasium.make(name, tip="detector")
    task, rule = env.unwrapped.task, {"kind": "greedy"}
    plans = {"plants": 2, "seed": 4, "task": task, "greenhouse": loop.greenhouse_for(task), "monitor": False}
    grown = tropism.grow(controller=rule, out=tmp_path / "grown", **plans)
    for number, seed in enumerate((4, None)):
        rows, infos, fitness = steered(env, seed)
        assert grown.fitness[number] == fitness == infos[-1]["fitness"]
        np.testing.assert_allclose(Track.read(grown.tracks[number]).tips, np.array(rows)[:, :2], rtol=0, atol=5e-6)
    others = gymnasium.make(name, tip="detector", plants="transfer")
    tropism.transfer(controllers=[{"name": "greedy", "controller": rule}], out=tmp_path / "transfer", **plans)
    for number, seed in enumerate((4, None)):
        rows, *_ = steered(others, seed)
        path = tmp_path / "transfer" / "tracks" / "greedy" / f"plant-{number + 1:04}.csv"
        np.testing.assert_allclose(Track.read(path).tips, np.array(rows)[:, :2], rtol=0, atol=5e-6)


@pytest.mark.parametrize("name", STEERED)
def test_many_steered_plants_are_as_one_by_one(name: str) -> None:
    one, many = gymnasium.make(name), gymnasium.make_vec(name, num_envs=5)
    seen, infos = many.reset(seed=7)
    assert many.observation_space.contains(seen)
    rules = [greedy(one) for _ in range(5)]
    rows, all_infos, ended = [seen], [infos], np.zeros(5, bool)
    while not ended.all():
        seen, _, terminated, truncated, infos = many.step(np.array([rules[n](seen[n]) for n in range(5)]))
        assert many.observation_space.contains(seen)
        assert all(infos[f"_{key}"].all() for key in infos if not key.startswith("_"))
        rows.append(seen)
        all_infos.append(infos)
        ended |= terminated | truncated
    for place in range(5):
        wanted, own_infos, _ = steered(one, 7 + place)
        np.testing.assert_array_equal(np.array([row[place] for row in rows[: len(wanted)]]), np.array(wanted))
        for infos, own in zip(all_infos, own_infos, strict=False):
            for key in infos:
                if not key.startswith("_"):
                    np.testing.assert_array_equal(infos[key][place], own[key], err_msg=key)


def test_a_bean_that_leans_on_an_obstacle_is_told_of_it() -> None:
    env = gymnasium.make("tropism/Obstacles-v0", task={"kind": "obstacles", "max_steps": 600})
    seen, info = env.reset(seed=3)
    # A disc of 1 cm, 8 cm above the root: the gap is seen from the tip of a seedling of 4 cm.
    assert seen.shape == (27,) and 2.0 < info["gap_cm"] < 3.5 and not info["touches"]
    rewards, touched, over = [], [], False
    while not over:
        # Steered to and fro below the disc: a bean grows into it.
        seen, reward, terminated, truncated, info = env.step(int(seen[0] < 0))
        assert seen[22] == info["gap_cm"]
        on_stem, on_obstacle = seen[23:25], seen[25:27]
        np.testing.assert_allclose(on_obstacle, [0.0, 8.0])
        assert np.hypot(*(on_stem - on_obstacle)) - 1.0 - 0.15 == pytest.approx(info["gap_cm"], abs=1e-9)
        rewards.append(reward)
        touched.append(bool(info["touches"]))
        over = terminated or truncated
    onset = touched.index(True)
    assert rewards[onset] == pytest.approx(-2.02, abs=0.5) and rewards[onset] <= -2.02 and max(rewards[:onset]) == 0.0
    assert info["contact_steps"] == sum(touched) > 5 and not info["is_done"]
    # The disc holds the bean: no deeper than half the stem.
    assert seen[22] > -0.15
    env.reset(seed=3)
    pressed = []
    for _ in range(len(touched)):
        seen, _, over, _, info = env.step(int(seen[0] < 0))
        pressed += info["contact_points"]
        if over:
            break
    number, place, force = max(pressed, key=lambda point: np.linalg.norm(point[2]))
    assert number == 0 and np.linalg.norm(force) > 0 and 6.5 < place[1] < 9.5


def test_what_avoids_the_obstacle_and_reaches_the_target_is_done() -> None:
    env = gymnasium.make("tropism/Obstacles-v0", task={**gymnasium.make(STEERED[0]).unwrapped.task, "obstacles": []})
    rows, infos, fitness = steered(env, 1)
    assert rows[0][22] == 100.0 and infos[0]["contact_points"] == []
    assert np.isinf(infos[0]["target_distances_cm"]).all() and np.isfinite(infos[-1]["target_distances_cm"]).all()
    assert infos[-1]["is_done"] == (infos[-1]["target_distances_cm"] <= 1.5).all()
    assert infos[-1]["contact_steps"] == 0 and fitness > -10


def test_each_of_four_lamps_pulls_the_tip_to_its_side() -> None:
    env = gymnasium.make("tropism/Space-v0")
    assert env.action_space.n == 4
    ends = []
    for lamp in range(4):
        env.reset(seed=2)
        for _ in range(60):
            seen, *_ = env.step(lamp)
        ends.append(seen)
    left, right, front, back = ends
    assert left[0] < -1 < 1 < right[0] and back[2] < -1 < 1 < front[2]


def test_winding_round_a_pole_is_a_task_in_space(tmp_path: Path) -> None:
    env = gymnasium.make("tropism/Space-v0", task={"kind": "spiral", "end_height_cm": 12.0}, tip="detector")
    rows, infos, fitness = steered(env, 2)
    assert rows[-1][1] >= 12.0 and infos[-1]["target_distances_cm"].shape == (0,)
    task = env.unwrapped.task
    plan = {"plants": 1, "seed": 2, "task": task, "greenhouse": loop.greenhouse_for(task), "out": tmp_path / "grown"}
    assert tropism.grow(controller={"kind": "greedy"}, monitor=False, **plan).fitness == [fitness] != [0.0]


def test_tasks_go_to_the_environment_that_knows_them() -> None:
    with pytest.raises(tropism.PlanError, match="tropism/Space-v0 is for tasks in space"):
        gymnasium.make("tropism/Bean-v0", task={"kind": "space"})
    with pytest.raises(tropism.PlanError, match="found a task in the plane"):
        gymnasium.make("tropism/Space-v0", task={})
    with pytest.raises(tropism.PlanError, match="a task in space needs a second camera"):
        gymnasium.make("tropism/Tent-v0", task={"kind": "space"})
    with pytest.raises(tropism.PlanError, match=r"plants: found \"horses\", wanted one of grow, transfer"):
        gymnasium.make("tropism/Bean-v0", plants="horses")
    covered = {"kind": "obstacles", "targets": [[0, 13]], "obstacles": [{"disc": [0, 0], "radius_cm": 1}]}
    with pytest.raises(tropism.PlanError, match="wanted more than the radius of the stem"):
        gymnasium.make("tropism/Obstacles-v0", task=covered)


def test_a_picture_shows_obstacles_and_both_cameras() -> None:
    task = gymnasium.make(STEERED[0]).unwrapped.task
    pictures = []
    for own in (task, {**task, "obstacles": []}):
        env = gymnasium.make(STEERED[0], task=own, render_mode="rgb_array")
        env.reset(seed=1)
        pictures.append(env.render().astype(int))
    # The disc spans 12 pixels about (0, 8) cm.
    row, column = round(323 / 2 + (20 - 8) * 432 / 74), round(431 / 2)
    differs = (np.abs(pictures[0] - pictures[1]).sum(axis=2) > 20)[row - 4 : row + 5, column - 4 : column + 5]
    assert differs.mean() > 0.9
    env = gymnasium.make(STEERED[1], render_mode="rgb_array")
    env.reset(seed=1)
    picture = env.render()
    assert picture.shape == (324, 864, 3)
    for half in (picture[:, :432], picture[:, 432:]):
        assert (half == (230, 60, 60)).all(axis=2).sum() > 50


def test_threads_change_no_bit() -> None:
    code = (
        "import gymnasium, tropism, numpy as np, hashlib\n"
        "digest = hashlib.sha256()\n"
        "for name in ('TipModel', 'Bean', 'Obstacles', 'Space'):\n"
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
            end(greenhouse={"variation": 0.0}),
            end(greenhouse={"bean": species(root / "beans" / "internodal-bean.toml")}),
            end(tip="detector"),
            end(period_min=10.0),
        ],
    )
    assert all((other != plain).any() for other in others)
    dropped = gymnasium.make("tropism/Tent-v0", greenhouse={"faults": {"dropped": 1.0}})
    pixels, info = dropped.reset(seed=1)
    assert pixels.max() == 0 and info["quality"] == "carried_forward"


def test_what_is_wrong_is_named() -> None:
    with pytest.raises(tropism.PlanError, match="greenhouse: bena: unknown key"):
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


def test_vectors_are_as_long_as_single_environments_and_take_whole_seeds() -> None:
    many = gymnasium.make_vec("tropism/TipModel-v0", num_envs=2, max_episode_steps=3000)
    assert many.unwrapped.task["max_steps"] == 1000
    with pytest.raises(tropism.errors.WrongTypeError, match="wanted whole numbers"):
        many.reset(seed=[1.5, 2.5])
    with pytest.raises(tropism.PlanError, match="wanted 1 to 1000000"):
        gymnasium.make_vec("tropism/Bean-v0", num_envs=10**12)
    with pytest.raises(tropism.PlanError, match="max_episode_steps: found -1"):
        gymnasium.make_vec("tropism/Bean-v0", num_envs=2, max_episode_steps=-1)
