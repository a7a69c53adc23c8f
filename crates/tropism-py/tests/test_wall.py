"""The wall of nodes: what PettingZoo checks, the plants of the workflow, copies, and errors."""

from __future__ import annotations

import copy
import doctest
import pickle
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tropism
from tropism import neat

pettingzoo = pytest.importorskip("pettingzoo")
from tropism import wall_v0  # noqa: E402

#: A wall of two levels.
LOW: dict[str, Any] = {
    "wall": {
        "power": 0.05,
        "links": [["a", "c"], ["a", "d"], ["b", "c"], ["b", "d"]],
        "node": [
            {"name": name, "at": [x, y, -5]} for name, x, y in (("a", -6, 6), ("b", 6, 6), ("c", -6, 8), ("d", 6, 8))
        ],
    }
}
#: Few steps, and just the time in which nodes learn what is empty.
SHORT: dict[str, Any] = {"max_steps": 25, "learning_h": 4.0}


def hand_over(seen: np.ndarray[Any, Any]) -> list[int]:
    """The rule of the state machine in short: lit while it is called and not done; done when it or the next one sees."""
    strength, _, called, next_done, _, _, done = seen
    is_done = done or (called and (strength >= 1 or next_done))
    return [int(called and not is_done), int(is_done)]


def rollout(env: Any, seed: int | None, policy: Any = hand_over) -> tuple[dict[str, Any], float]:
    """The last info of an episode, and the sum of its rewards."""
    seen, infos = env.reset(seed=seed)
    fitness = 0.0
    while env.agents:
        actions = {agent: policy(seen[agent]) for agent in env.agents}
        seen, rewards, terminated, truncated, infos = env.step(actions)
        assert len(set(rewards.values())) == len(set(terminated.values())) == len(set(truncated.values())) == 1
        assert all(env.observation_space(agent).contains(seen[agent]) for agent in env.possible_agents)
        fitness += rewards[env.possible_agents[0]]
    [info, *_] = infos.values()
    assert info["fitness"] == fitness and info["is_virtual"]
    return info, fitness


def test_pettingzoo_finds_nothing_to_warn_of() -> None:
    from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(wall_v0.parallel_env(**SHORT), num_cycles=60)
        parallel_api_test(wall_v0.parallel_env(LOW, **{**SHORT, "dtype": "float32"}), num_cycles=60)
        parallel_seed_test(lambda: wall_v0.parallel_env(**SHORT))
        seed_test(lambda: wall_v0.env(**SHORT), num_cycles=10)
        # Advice that is not taken: two choices are no Box and no Discrete, and agents have the names of their nodes.
        warnings.filterwarnings(
            "ignore", message="Action space for each agent probably|We recommend agents to be named"
        )
        api_test(wall_v0.env(**SHORT), num_cycles=60)


def test_the_registry_of_pettingzoo_knows_it() -> None:
    if not hasattr(pettingzoo, "make"):
        pytest.skip("a PettingZoo without a registry")
    assert isinstance(pettingzoo.make("parallel", "tropism/Wall-v0", max_steps=3), wall_v0.WallEnv)
    assert pettingzoo.make("aec", "tropism/Wall-v0").metadata["name"] == "wall_v0"


def test_without_pettingzoo_the_error_says_what_to_install() -> None:
    code = "import sys; sys.modules['pettingzoo'] = None; import tropism; tropism.wall_v0"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "ImportError: tropism.wall_v0 needs PettingZoo: pip install pettingzoo" in done.stderr


def test_the_examples_run() -> None:
    assert doctest.testmod(wall_v0, optionflags=doctest.ELLIPSIS).failed == 0


def test_nodes_that_hand_the_light_over_lead_the_plant_and_dark_ones_do_not() -> None:
    env = wall_v0.parallel_env()
    steered, dark = [], []
    for seed in range(4):
        info, fitness = rollout(env, seed)
        assert fitness == sum(1 if one["is_right"] else -1 for one in info["decisions"])
        assert [one["node"] for one in info["decisions"]] == info["path"]
        assert info["apex"][1] >= 18 and info["lit_h"] > 5
        steered.append(fitness)
    for seed in range(2):
        info, fitness = rollout(env, seed, lambda _: [0, 0])
        assert info["lit_h"] == 0.0
        dark.append(fitness)
    assert np.mean(steered) >= 2.5, steered
    assert set(steered + dark) <= {-3.0, -1.0, 1.0, 3.0}


def test_it_ends_with_the_last_decision_or_after_its_steps() -> None:
    env = wall_v0.parallel_env(LOW, max_steps=400, learning_h=2.0)
    env.reset(seed=3)
    ended = {}
    while env.agents:
        *_, terminated, truncated, infos = env.step(dict.fromkeys(env.agents, [0, 0]))
        ended = {**terminated}
    assert all(ended.values()) and not any(truncated.values()) and len(infos["a"]["decisions"]) == 2
    env = wall_v0.parallel_env(LOW, max_steps=7, learning_h=2.0)
    env.reset(seed=3)
    steps = 0
    while env.agents:
        *_, terminated, truncated, infos = env.step(dict.fromkeys(env.agents, [1, 0]))
        steps += 1
    assert steps == 7 and all(truncated.values()) and not any(terminated.values())
    # Four lamps for seven steps of five minutes.
    assert infos["a"]["lit_h"] == pytest.approx(4 * 7 / 12)


def test_a_seed_gives_the_same_bits_and_a_reset_without_one_the_next_plant() -> None:
    def observed(env: Any, seed: int | None) -> tuple[bytes, int, int]:
        env.reset(seed=seed)
        for step in range(20):
            actions = {agent: [(step + number) % 2, 0] for number, agent in enumerate(env.agents)}
            env.step(actions)
        [info, *_] = env._infos().values()
        return env.state().tobytes(), info["seed"], info["plant"]

    one, other = (wall_v0.parallel_env(LOW, **SHORT) for _ in range(2))
    first, second = observed(one, 7), observed(one, None)
    assert first[1:] == (7, 0) and second[1:] == (7, 1) and first[0] != second[0]
    assert observed(other, 7) == first and observed(other, None) == second
    assert observed(other, 8) != first
    fresh = wall_v0.parallel_env(LOW, **SHORT)
    assert observed(fresh, None)[1] != observed(wall_v0.parallel_env(LOW, **SHORT), None)[1]


def test_copies_and_pickles_go_on_with_the_same_bits() -> None:
    env = wall_v0.parallel_env(LOW, faults={"lost": 0.3, "restarts_per_day": 20}, **SHORT)
    assert pickle.loads(pickle.dumps(env)).agents == []
    env.reset(seed=2)
    env.reset()
    for step in range(10):
        env.step({agent: [step % 2, int(step > 5)] for agent in env.agents})
    others = [copy.deepcopy(env), copy.copy(env), pickle.loads(pickle.dumps(env))]
    for _ in range(5):
        actions = {agent: [1, 0] for agent in env.agents}
        wanted = env.step(actions)
        for other in others:
            found = other.step(actions)
            for agent in env.agents:
                np.testing.assert_array_equal(found[0][agent], wanted[0][agent])
            assert found[1:4] == wanted[1:4]
            np.testing.assert_array_equal(other.state(), env.state())
            assert other._infos()["a"]["plant"] == 1


def test_networks_of_neat_decide_for_nodes() -> None:
    run = neat.Neat(inputs=7, outputs=2, seed=3)
    genome = run.ask()[0]
    env = wall_v0.parallel_env(LOW, max_steps=100, learning_h=2.0)

    def once() -> tuple[float, float]:
        networks = {agent: neat.Network(genome) for agent in env.possible_agents}
        seen, infos = env.reset(seed=1)
        while env.agents:
            outputs = {agent: networks[agent].run(seen[agent]) for agent in env.agents}
            seen, _, _, _, infos = env.step(
                {agent: [int(value >= 0.5) for value in outputs[agent]] for agent in outputs}
            )
        return infos["a"]["fitness"], infos["a"]["lit_h"]

    assert once() == once()


def test_options_reach_the_plants_and_the_nodes() -> None:
    def end(wall: Any = LOW, **options: Any) -> bytes:
        env = wall_v0.parallel_env(wall, **{**SHORT, **options})
        rollout(env, 1)
        state: bytes = env.state().tobytes()
        return state

    root = Path(__file__).resolve().parents[3]
    plain = end()
    for options in (
        {"variation": 0.0},
        {"bean": root / "beans" / "internodal-bean.toml"},
        {"period_min": 10.0},
        {"learning_h": 5.0},
        {"faults": {"blind": 2, "silent": 1}},
        {"wall": {**LOW, "sensor": {"noise": 0.3}}},
        {"wall": {**LOW, "machine": {"detector": {"siblings": False}}}},
    ):
        assert end(**options) != plain, options
    from_file = wall_v0.parallel_env(root / "tasks" / "wall.toml")
    assert from_file.wall == wall_v0.parallel_env().wall
    assert wall_v0.parallel_env({"sensor": {"range_cm": 3}}).wall["sensor"]["range_cm"] == 3


def test_a_node_that_dies_observes_zeros_and_is_dark() -> None:
    env = wall_v0.parallel_env(LOW, faults={"killed": 1}, max_steps=40, learning_h=2.0)
    env.reset(seed=1)
    while env.agents:
        seen, _, _, _, infos = env.step(dict.fromkeys(env.agents, [1, 0]))
    [dead] = [node for node, info in infos.items() if not info["is_alive"]]
    assert infos[dead]["is_on_path"] and not seen[dead].any()
    # Two hours of its lamp, and 40 steps of the others.
    assert infos["a"]["lit_h"] == pytest.approx(3 * 40 / 12 + 2.0, abs=0.1)


def test_what_is_wrong_is_named() -> None:
    env = wall_v0.parallel_env(LOW, **SHORT)
    still = dict.fromkeys("abcd", [0, 0])
    with pytest.raises(tropism.PlanError, match="no episode has begun: call reset before step"):
        env.step(still)
    env.reset(seed=1)
    with pytest.raises(tropism.PlanError, match="found actions of a, wanted one for each of a, b, c, d"):
        env.step({"a": [0, 0]})
    for action, problem in (
        ([0, 2], r"c: found \[0, 2\], wanted 0 or 1"),
        ([0], r"c: found an array of shape \(1,\), wanted \(2,\)"),
        ([0.0, 1.0], "c: found float64, wanted whole numbers"),
    ):
        with pytest.raises(tropism.TropismError, match=problem):
            env.step({**still, "c": action})
    with pytest.raises(tropism.WrongTypeError, match="found list, wanted a dict"):
        env.step([[0, 0]])  # type: ignore[arg-type,unused-ignore]
    rollout(env, 1)
    with pytest.raises(tropism.PlanError, match="the episode is over: call reset before step"):
        env.step(still)
    for options, problem in (
        ({"wall": {"sensors": {}}}, "wall: sensors: unknown key"),
        (
            {"wall": {"wall": {**LOW["wall"], "path": ["a", "b"]}}},
            "no link joins a and b",
        ),
        ({"faults": {"lost": 2}}, "faults.*lost = 2"),
        ({"faults": {"losst": 0.2}}, "faults: losst: unknown key"),
        ({"variation": 9.0}, "variation = 9"),
        ({"learning_h": 0.0}, "learning_h = 0"),
        ({"period_min": 0.0}, "period_min = 0"),
        ({"max_steps": 0}, "max_steps"),
        ({"dtype": "int8"}, "wanted float32 or float64"),
    ):
        with pytest.raises(tropism.PlanError, match=problem):
            wall_v0.parallel_env(**options)


def test_a_picture_shows_plant_and_nodes() -> None:
    env = wall_v0.parallel_env(LOW, **SHORT, render_mode="rgb_array")
    env.reset(seed=1)
    dark = env.render()
    env.step(dict.fromkeys(env.agents, [1, 0]))
    picture = env.render()
    assert picture.shape == (324, 432, 3) and picture.dtype == np.uint8
    lit = (255, 220, 120)
    assert (picture == lit).all(axis=2).sum() > 4 * 50 > (dark == lit).all(axis=2).sum() == 0
    assert (picture == (230, 60, 60)).all(axis=2).sum() > 2 * 40
    assert wall_v0.parallel_env(LOW).render() is None
