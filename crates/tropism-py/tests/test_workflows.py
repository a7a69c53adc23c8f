"""Workflows: plans, results, monitors, errors and interruptions."""

from __future__ import annotations

import dataclasses
import inspect
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import types
import typing
from collections import abc
from pathlib import Path
from typing import Any

import pytest
import tropism
from tropism import _core
from tropism.plan import Plan
from tropism.plans import EvolvePlan, SimulatePlan
from tropism.results import Results

SMALL = {"runs": 2, "generations": 5, "neat": {"population": 20}}


@pytest.mark.parametrize("plan", tropism.PLANS.values(), ids=tropism.PLANS)
def test_a_dataclass_has_the_keys_of_its_workflow(plan: type[Plan[Any]]) -> None:
    assert plan.results is not Results
    assert plan.results.__name__ == plan.__name__.replace("Plan", "Results")
    signature = inspect.signature(getattr(tropism, plan.workflow))
    assert plan.workflow in tropism.__all__ and {"monitor", "threads"} <= set(signature.parameters)
    with pytest.raises(tropism.PlanError) as refusal:
        _core.complete_plan(plan.workflow, '{"nonsense": 1}')
    wanted = set(re.findall(r"`(\w+)`", str(refusal.value))) - {"nonsense"}
    names = {field.name.rstrip("_") for field in dataclasses.fields(plan)} - {"monitor", "threads"}
    assert names == wanted
    if plan.workflow in ("fit", "grow", "evolve"):
        assert set(plan().complete()) <= wanted


def test_what_is_left_out_is_the_papers() -> None:
    complete = EvolvePlan(seed=7).complete()
    assert complete["seed"] == 7
    assert complete["evolution"]["runs"] == 20
    assert complete["evolution"]["neat"]["population"] == 50


def test_unknown_keys_are_refused_by_name() -> None:
    with pytest.raises(tropism.PlanError, match=r"evolve: evolution\.neat\.populaton: unknown key"):
        tropism.evolve("model.json", evolution={"neat": {"populaton": 3}})
    with pytest.raises(TypeError, match="modle"):
        tropism.evolve("model.json", modle="model.json")  # type: ignore[call-arg]


def test_errors_name_the_file(tmp_path: Path) -> None:
    with pytest.raises(tropism.TropismError, match=r"nowhere\.json"):
        tropism.evolve(model=tmp_path / "nowhere.json", out=tmp_path / "out", monitor=False)


def test_the_whole_way_from_beans_to_a_report(model: Path, tmp_path: Path) -> None:
    evolved = tropism.evolve(model=model, out=tmp_path / "evolution", evolution=SMALL, monitor=False)
    assert len(evolved.runs) == 2
    champion = tropism.controller_of(tmp_path / "evolution/champion.json")
    track = tmp_path / "track.csv"
    simulated = tropism.simulate(model=model, controller=champion, episodes=3, out=track, monitor=False)
    scores = tropism.score(tracks=[track], monitor=False)
    assert scores.tracks[0].steps > 100
    assert simulated.episodes == 3
    compared = tropism.transfer(
        controllers=[
            {"name": "champion", "controller": champion},
            {"name": "greedy", "controller": {"kind": "greedy"}},
        ],
        plants=4,
        out=tmp_path / "transfer",
        monitor=False,
    )
    assert compared.is_virtual and [row.name for row in compared.controllers] == ["champion", "greedy"]
    assert "virtual plants" in compared._repr_html_()
    figures = tmp_path / "figures"
    report = tropism.report(
        sources=[tmp_path / "evolution"], out=tmp_path / "report.html", figures=figures, monitor=False
    )
    assert report.figures() and "<svg" in report._repr_html_()


def test_forecasts_of_models_are_compared(beans: Path, model: Path, tmp_path: Path) -> None:
    tropism.fit(tracks=[beans], kind="stem", out=tmp_path / "stem.json", monitor=False)
    models = [model, tmp_path / "stem.json"]
    found = tropism.forecast(models=models, plants=2, horizons_min=[60, 360], out=tmp_path / "out", monitor=False)
    assert found.is_virtual and found.horizons_min == [60, 360]
    for light in found.lights:
        assert [row.name for row in light.models] == ["standing still", "model", "stem"]
        still, tip, stem = light.models
        assert tip.stem is None and len(stem.stem) == 2
        # Six hours ahead any model is nearer than a plant that stands still.
        assert max(tip.tip[1].mean_cm, stem.tip[1].mean_cm) < still.tip[1].mean_cm
    assert (tmp_path / "out" / "forecast.json").exists()
    with pytest.raises(tropism.PlanError, match="`models` is empty"):
        tropism.forecast([])


def is_of(value: Any, hint: Any) -> bool:
    """Whether a value is what a type says. An int is a float, too."""
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hint is Any:
        return True
    if origin in (typing.Union, types.UnionType):
        return any(is_of(value, one) for one in arguments)
    if origin is list:
        return isinstance(value, list) and all(is_of(item, arguments[0]) for item in value)
    if origin is abc.Mapping:
        return isinstance(value, abc.Mapping) and all(is_of(item, arguments[1]) for item in value.values())
    if hint in (int, float) and isinstance(value, bool):
        return False
    return isinstance(value, (int, float) if hint is float else hint)


def assert_typed(results: Results) -> None:
    """Asserts that a type names the keys of its results and their types, and that what it names and is not there may be None."""
    hints = {name: hint for name, hint in typing.get_type_hints(type(results)).items() if not name.startswith("_")}
    # Methods of all results hide two keys.
    found = {key for key in results if not key.startswith("_")} - {"values", "figures"}
    assert found <= set(hints), type(results)
    for name, hint in hints.items():
        value = getattr(results, name)
        assert is_of(value, hint), (type(results), name, value)
        for item in value if isinstance(value, list) else [value]:
            if isinstance(item, Results) and type(item) is not Results:
                assert_typed(item)


def test_types_of_results_name_their_keys(beans: Path, model: Path, tmp_path: Path) -> None:
    quiet: Any = {"monitor": False}
    stem = tropism.fit(tracks=[beans], kind="stem", out=tmp_path / "stem.json", **quiet)
    greedy: Any = {"kind": "greedy"}
    evolved = tropism.evolve(model=model, out=tmp_path / "e", evolution=SMALL, **quiet)
    assert isinstance(evolved.runs[0].trial.mean, float)
    sweep = {
        "model": str(model),
        "seeds": 1,
        "grid": {"evolution": {"runs": [2, 3]}},
        "evolve": {"evolution": {"generations": 3, "neat": {"population": 20}}},
    }
    short, disc = {"max_steps": 20}, {"kind": "obstacles", "max_steps": 20}
    controllers = [
        {"name": "a", "controller": greedy},
        {"name": "b", "controller": {"kind": "periodic", "minutes": 60}},
    ]
    for results in (
        stem,
        evolved,
        tropism.grow(plants=1, controller=greedy, task=short, out=tmp_path / "grown", **quiet),
        tropism.forecast(models=[model, stem.model], plants=2, out=tmp_path / "forecast", **quiet),
        tropism.simulate(model=model, controller=greedy, task=short, out=tmp_path / "t.csv", **quiet),
        tropism.tune(model=stem.model, search={"generations": 2}, out=tmp_path / "rule.json", **quiet),
        tropism.transfer(controllers=controllers, plants=2, task=short, out=tmp_path / "transfer", **quiet),
        tropism.transfer(controllers=controllers, plants=2, task=disc, out=tmp_path / "disc", **quiet),
        tropism.sweep(sweep, out=tmp_path / "sweep", **quiet),
        tropism.show(source=tmp_path / "e", **quiet),
        tropism.show(source=tmp_path / "e", model=model, out=tmp_path / "champion.svg", **quiet),
        tropism.score(tracks=[beans, tmp_path / "t.csv"], **quiet),
        tropism.score(tracks=[tmp_path / "grown"], task=disc, **quiet),
        tropism.report(sources=[tmp_path / "e"], out=tmp_path / "e.html", figures=tmp_path / "figures", **quiet),
        tropism.report(sources=[tmp_path / "sweep"], out=tmp_path / "sweep.html", **quiet),
    ):
        assert type(results) is not Results
        assert_typed(results)
    with pytest.raises(AttributeError, match="found no 'fitnes'"):
        _ = evolved.fitnes  # type: ignore[attr-defined]


def test_a_run_in_the_virtual_tent_becomes_a_track(tmp_path: Path) -> None:
    config = tropism.PLANS["run"]().complete()["config"]
    config["task"] = {"kind": "open_loop", "max_steps": 4}
    config["rig"]["greenhouse"]["scene"].update(width=432, height=324)
    results = tropism.run(out=tmp_path / "run", config=config, monitor=False)
    assert results.is_virtual and results.steps == 4
    assert_typed(results)
    # What every photograph of the virtual tent shows: 74 cm in width, the middle 20 cm above the soil.
    px_per_cm = 432 / 74
    base = [215.5, 161.5 + 20 * px_per_cm]
    followed = tropism.track(
        photographs=[tmp_path / "run" / "photographs"],
        scale={"px_per_cm": px_per_cm},
        plants=[{"name": "1", "base": base}],
        out=tmp_path / "again.csv",
        monitor=False,
    )
    assert_typed(followed)
    [plant] = followed.tracks
    assert plant.is_virtual and plant.plant is None
    assert plant.frames == 5 == sum(plant.classes.values())
    assert plant.calibration.px_per_cm == pytest.approx(px_per_cm) and plant.camera.moved == 0
    again = tropism.score(tracks=[tmp_path / "again.csv", tmp_path / "run" / "track.csv"], monitor=False)
    assert [track.steps for track in again.tracks] == [4, 4]


class Listening(tropism.Monitor):
    """Writes down what it hears; asks for an end after some generations."""

    def __init__(self, most: int | None = None) -> None:
        self.heard: list[str] = []
        self.generations: list[tuple[int, dict[str, float]]] = []
        self.thread = threading.get_ident()
        self.most = most

    def stage(self, name: str, total: int) -> None:
        self.heard.append(f"{name} {total}")

    def generation(self, run: int, statistics: str) -> None:
        assert threading.get_ident() == self.thread
        self.generations.append((run, json.loads(statistics)))

    def may_go_on(self) -> bool:
        return self.most is None or len(self.generations) < self.most


def test_a_monitor_hears_each_generation(model: Path, tmp_path: Path) -> None:
    monitor = Listening()
    tropism.evolve(model=model, out=tmp_path / "e", evolution=SMALL, monitor=monitor)
    assert monitor.heard[0] == "evolve 10"
    assert sorted((run, found["generation"]) for run, found in monitor.generations) == [
        (run, generation) for run in range(2) for generation in range(5)
    ]


def test_a_monitor_that_asks_for_an_end_gets_it_and_the_work_goes_on_to_the_same(model: Path, tmp_path: Path) -> None:
    evolution = {"runs": 2, "generations": 300, "neat": {"population": 20}}
    plan = EvolvePlan(model=model, evolution=evolution, monitor=False)
    whole = tmp_path / "whole"
    tropism.execute(_with(plan, out=whole))
    part = tmp_path / "part"
    with pytest.raises(tropism.Interrupted, match="is saved"):
        tropism.execute(_with(plan, out=part, monitor=Listening(most=10)))
    assert not (part / "champion.json").exists()
    tropism.execute(_with(plan, out=part, resume=True, threads=1))
    assert (part / "champion.json").read_bytes() == (whole / "champion.json").read_bytes()


def _with(plan: EvolvePlan, **changes: Any) -> EvolvePlan:
    return dataclasses.replace(plan, **changes)


def test_an_exception_of_a_monitor_is_raised(model: Path, tmp_path: Path) -> None:
    class Broken(tropism.Monitor):
        def stage(self, name: str, total: int) -> None:
            raise LookupError("not in the mood")

    with pytest.raises(LookupError, match="not in the mood"):
        tropism.evolve(model=model, out=tmp_path / "e", evolution=SMALL, monitor=Broken())


def test_ctrl_c_is_a_keyboard_interrupt_and_saves(model: Path, tmp_path: Path) -> None:
    # What started the tests may ignore the signal, and children would do so, too.
    code = (
        "import signal, sys, tropism\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "class Tell(tropism.Monitor):\n"
        "    def generation(self, run, statistics): print('going', flush=True)\n"
        "try:\n"
        f"    tropism.evolve(model={str(model)!r}, out={str(tmp_path / 'e')!r}, monitor=Tell(),\n"
        "        evolution={'runs': 2, 'generations': 1000000})\n"
        "except KeyboardInterrupt as end:\n"
        "    print(type(end).__name__, end, flush=True)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "going\n"
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=120)[0].splitlines()[-1]
    assert said.startswith("Interrupted interrupted:") and "is saved" in said
    assert any((tmp_path / "e").iterdir())


def test_other_threads_work_while_a_workflow_does(model: Path, tmp_path: Path) -> None:
    counted = []
    stop = threading.Event()

    def count() -> None:
        while not stop.is_set():
            counted.append(1)
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = len(counted)
    tropism.simulate(model=model, episodes=200, out=tmp_path / "t.csv", monitor=False)
    during = len(counted) - before
    stop.set()
    thread.join()
    assert during > 3


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork here")
def test_a_fork_with_threads_is_refused(model: Path, tmp_path: Path) -> None:
    code = (
        "import os, sys, tropism\n"
        f"tropism.simulate(model={str(model)!r}, episodes=2, out={str(tmp_path / 'a.csv')!r}, monitor=False)\n"
        "if os.fork() == 0:\n"
        "    try:\n"
        f"        tropism.simulate(model={str(model)!r}, out={str(tmp_path / 'b.csv')!r}, monitor=False)\n"
        "    except RuntimeError as error:\n"
        "        print(error, flush=True)\n"
        "    os._exit(0)\n"
        "os.wait()\n"
    )
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, timeout=120)
    assert "forked after tropism had started threads" in done.stdout, done.stderr


def test_threads_change_no_bit(model: Path, tmp_path: Path) -> None:
    for threads in (1, 2):
        tropism.evolve(model=model, out=tmp_path / str(threads), evolution=SMALL, monitor=False, threads=threads)
    one, two = ((tmp_path / name / "champion.json").read_bytes() for name in "12")
    assert one == two


def test_plans_are_data() -> None:
    plan = SimulatePlan(model=Path("m.json"), episodes=3, monitor=False)
    assert json.loads(plan.to_json()) == {"model": "m.json", "episodes": 3}
    assert SimulatePlan(**plan.complete()).complete() == plan.complete()


def test_a_sweep_is_resumed_from_its_folder(model: Path, tmp_path: Path) -> None:
    settings = {"model": str(model), "seeds": [3], "evolve": {"trial_plants": 5, "evolution": SMALL}}
    grid = {"evolution": {"generations": [2, 4]}}
    results = tropism.sweep(settings, grid, out=tmp_path / "sweep", monitor=False)
    assert [row.setting for row in results.rows] == ["generations=2", "generations=4"]
    plan = tropism.PLANS["sweep"](config={**settings, "grid": grid})
    assert [unit["unit"] for unit in tropism.units(plan)] == ["setting-1-seed-3", "setting-2-seed-3"]
    again = tropism.resume(tmp_path / "sweep", "sweep", monitor=False)
    with pytest.raises(tropism.PlanError, match="wanted a long work"):
        tropism.resume(tmp_path / "sweep", "nonsense")
    assert again == results
    with pytest.raises(tropism.PlanError, match="a sweep is here already"):
        tropism.sweep(settings, grid, out=tmp_path / "sweep", monitor=False)


@pytest.mark.slow
def test_a_small_study_has_its_report(tmp_path: Path) -> None:
    config = tropism.quick_study()
    config.update(experiments=2, steps=200, random_controllers=1000, reality_plants=1, test_plants=4, trial_plants=10)
    config["evolution"].update(generations=5, runs=2)
    results = tropism.study(config=config, out=tmp_path / "study", monitor=False)
    assert results.is_virtual and (tmp_path / "study" / "report.html").exists()
    assert_typed(results)
    assert results.many_greedy.plants == 4 and results.reality_champion.plants == 1
    assert tropism.resume(tmp_path / "study", "study", monitor=False) == results


def test_a_steering_controller_has_its_task_and_threads_have_a_bound(tmp_path: Path) -> None:
    grown = tropism.grow(plants=1, seed=5, controller="greedy", out=tmp_path / "g")
    assert grown.mean_fitness is not None and grown.mean_fitness > 5.0
    plan = tropism.plans.RunPlan(config={"controller": "greedy"}, out=tmp_path / "r")
    assert plan.to_dict()["config"]["task"]["targets"] == [[3.0, 6.0], [-5.0, 9.0], [-1.0, 13.5]]
    with pytest.raises(tropism.PlanError, match="threads: found 2000, wanted 1 to 1024"):
        tropism.grow(plants=1, out=tmp_path / "t", threads=2000)
