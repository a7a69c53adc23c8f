"""The closed loop with parts in Python: own controller, task, plant model, camera and lamps."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tropism
from tropism import loop, neat
from tropism.loop import Camera, Controller, Lamps, Model, Noise, Observation, PlantModel, Task, Tent

SMALL = {"scene": {"width": 432, "height": 324}}


class Greedy(Controller):
    """The greedy rule, in Python."""

    targets = ((3.0, 6.0), (-5.0, 9.0), (-1.0, 13.5))

    def decide(self, seen: Observation) -> str:
        x = next((x for x, y in self.targets if seen.y < y), self.targets[-1][0])
        return "right" if seen.x < x else "left"


class Paper(Task):
    """The paper's task, in Python."""

    targets = Greedy.targets

    def __init__(self, max_steps: int = 1000) -> None:
        self.max_steps = max_steps
        self.highest = 0.0

    def is_over(self, step: int, seen: Observation) -> bool:
        if step == 0:
            self.highest = seen.y
        return seen.y >= 13.8 or step >= self.max_steps

    def step_fitness(self, first: Observation, before: Observation, after: Observation) -> float:
        self.highest = max(self.highest, after.y)
        x = next((x for x, y in self.targets if self.highest < y), None)
        if x is None:
            return 0.0
        return abs(before.x - x) - abs(after.x - x)


class Leaning(PlantModel):
    """Leans 1 mm a step towards the lit lamp and grows 0.3 mm."""

    def seedling(self, start: tuple[float, float], noise: Noise) -> tuple[float, float]:
        return start

    def step(self, plant: tuple[float, float], light: int, noise: Noise) -> tuple[float, float]:
        return plant[0] + (0.1 if light == 1 else -0.1), plant[1] + 0.03 + 0.01 * noise.normal()

    def observe(self, plant: tuple[float, float]) -> tuple[float, float]:
        return plant


@pytest.fixture(scope="module")
def tip_model() -> Model:
    return Model.of_virtual_beans(plants=2, steps=400)


def test_own_controller_and_task_are_as_those_of_the_core(tip_model: Model) -> None:
    wanted = loop.simulate(tip_model, {"kind": "greedy"}, seed=3, episode=2)
    found = loop.simulate(tip_model, Greedy(), Paper(), seed=3, episode=2)
    assert found == wanted
    assert wanted[0].fitness() == wanted[1]


def test_a_controller_of_the_core_is_an_object(tip_model: Model) -> None:
    for spec in ({"kind": "greedy"}, {"kind": "periodic", "minutes": 30}):
        found = loop.simulate(tip_model, loop.CoreController(spec), {"max_steps": 200}, seed=1)
        assert found == loop.simulate(tip_model, spec, {"max_steps": 200}, seed=1)
    with pytest.raises(tropism.PlanError, match="a switch every 1 minutes"):
        loop.CoreController({"kind": "periodic", "minutes": 1})


def test_own_parts_in_the_virtual_tent() -> None:
    """Own camera, lamps, controller and task before the virtual bean: the same photographs, track and fitness."""
    wanted = loop.run(Tent(seed=2, greenhouse=SMALL), {"kind": "greedy"}, {"max_steps": 30})
    tent = Tent(seed=2, greenhouse=SMALL)
    lit: list[str | None] = []
    sizes: list[int] = []

    class OwnCamera(Camera):
        def photograph(self) -> bytes:
            photograph = tent.photograph()
            sizes.append(len(photograph))
            return photograph

    class OwnLamps(Lamps):
        def light(self, light: str | None) -> None:
            lit.append(light)
            tent.light(light)

    found = loop.run(tent.rig(camera=OwnCamera(), lamps=OwnLamps()), Greedy(), Paper(30))
    assert found == wanted
    assert len(sizes) == 31 and min(sizes) > 1000
    assert lit[:-1] == found[0].columns()["light"][:-1]
    assert lit[-1] is None, "the lamps are out at the end"
    assert tent.truth_csv().count("\n") == 32


def test_own_pictures_are_tracked() -> None:
    """A camera that gives PNG files of a drawn plant: the tracker finds its tip, and the loop ends at its height."""
    image = pytest.importorskip("PIL.Image")
    import io

    tent = Tent(seed=5, greenhouse=SMALL)

    class Png(Camera):
        def photograph(self) -> bytes:
            file = io.BytesIO()
            image.open(io.BytesIO(tent.photograph())).save(file, "PNG")
            return file.getvalue()

    jpeg = loop.run(Tent(seed=5, greenhouse=SMALL), Greedy(), Paper(5))[0]
    png = loop.run(tent.rig(camera=Png()), Greedy(), Paper(5))[0]
    assert np.abs(png.tips - jpeg.tips).max() < 0.1 and len(png) == 6


def test_own_plant_model_is_steered_and_evolved_on() -> None:
    track, fitness = loop.simulate(Leaning(), Greedy(), seed=1)
    assert fitness > 8.0 and track.tips[0].tolist() == [0.0, 4.0]
    assert loop.simulate(Leaning(), Greedy(), seed=1) == (track, fitness)
    assert loop.simulate(Leaning(), Greedy(), seed=2) != (track, fitness)
    runs = loop.evolve(
        Leaning(), {"max_steps": 60}, seed=1, runs=2, generations=3, neat=neat.config("wahby2016", population=12)
    )
    assert len(runs) == 2 and len(runs[0].history) == 3
    again = loop.simulate(Leaning(), loop.NetworkController(runs[0].genome), {"max_steps": 60})
    assert math.isfinite(again[1])


def test_own_task_is_evolved_for(tip_model: Model) -> None:
    own = loop.evolve(tip_model, Paper(80), seed=2, runs=1, generations=3, neat=neat.config("wahby2016", population=10))
    core = loop.evolve(
        tip_model, {"max_steps": 80}, seed=2, runs=1, generations=3, neat=neat.config("wahby2016", population=10)
    )
    assert own[0].genome == core[0].genome
    assert own[0].fitness == pytest.approx(core[0].fitness, abs=1e-9)


def test_a_stem_is_seen(tip_model: Model) -> None:
    stems: list[Any] = []

    class Looking(Controller):
        def decide(self, seen: Observation) -> int:
            stems.append(seen.stem)
            return 0

    loop.grow(Looking(), {"kind": "open_loop", "max_steps": 3}, seed=1)
    assert stems[0].shape == (10, 2)
    loop.simulate(tip_model, Looking(), {"kind": "open_loop", "max_steps": 1})
    assert stems[-1] is None


@pytest.mark.parametrize("part", ["decide", "is_over", "step_fitness", "observe", "step", "photograph", "light"])
def test_an_exception_of_a_part_is_raised_and_the_lamps_go_out(part: str, tip_model: Model) -> None:
    def fails(*_: object) -> None:
        raise LookupError(part)

    def failing(kind: type[Any], *arguments: Any) -> Any:
        return type("Failing", (kind,), {part: fails})(*arguments)

    with pytest.raises(LookupError, match=part):
        if part == "decide":
            loop.simulate(tip_model, failing(Greedy))
        elif part in ("is_over", "step_fitness"):
            loop.simulate(tip_model, Greedy(), failing(Paper))
        elif part in ("observe", "step"):
            loop.simulate(failing(Leaning), Greedy())
        else:
            tent = Tent(greenhouse=SMALL)
            camera = failing(Camera) if part == "photograph" else None
            lamps = failing(Lamps) if part == "light" else None
            loop.run(tent.rig(camera=camera, lamps=lamps), Greedy(), Paper(3))


def test_answers_that_cannot_be_are_refused(tip_model: Model) -> None:
    class Far(Controller):
        def decide(self, seen: Observation) -> int:
            return 7

    with pytest.raises(tropism.PlanError, match="found light 7, wanted 0 to 1"):
        loop.simulate(tip_model, Far())

    class Forgets(Leaning):
        def step(self, plant: Any, light: int, noise: Noise) -> Any:
            return None

    with pytest.raises(tropism.PlanError, match="step returned None"):
        loop.simulate(Forgets(), Greedy())
    with pytest.raises(NotImplementedError, match="Controller lacks decide"):
        loop.simulate(tip_model, Controller())


def test_a_model_is_a_file(tip_model: Model, tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    path.write_text(tip_model.to_json())
    again = Model.read(path)
    assert (again.kind, again.is_virtual, again.lamps) == ("tip", True, ["left", "right"])
    assert loop.simulate(again, seed=3) == loop.simulate(tip_model, seed=3)
    path.write_text("{}")
    with pytest.raises(tropism.PlanError, match=r"model\.json"):
        Model.read(path)


DISC: dict[str, Any] = {
    "kind": "obstacles",
    "targets": [[0.0, 13.0]],
    "obstacles": [{"disc": [0.0, 8.0], "radius_cm": 1.0}],
    "way_points": [[-3.0, 10.0]],
}
SPACE: dict[str, Any] = {"kind": "space", "targets": [[2.0, 6.5], [-2.0, 10.0]], "depths_cm": [1.5, 2.0]}


class Watching(Controller):
    """The greedy rule of the core, which keeps what it sees."""

    def __init__(self, task: dict[str, Any], lamps: Any = None) -> None:
        self.rule = loop.CoreController({"kind": "greedy"}, task=task, layout=lamps)
        self.seen: list[Observation] = []

    def decide(self, seen: Observation) -> int:
        self.seen.append(seen)
        return self.rule.decide(seen)


@pytest.mark.parametrize("task", [DISC, SPACE], ids=["obstacles", "space"])
def test_beans_of_every_task_are_grown_with_what_it_needs(task: dict[str, Any], tmp_path: Path) -> None:
    greenhouse = loop.greenhouse_for(task)
    watching = Watching(task, greenhouse.get("layout"))
    track, fitness = loop.grow(watching, task, seed=5)
    assert (track, fitness) == loop.grow({"kind": "greedy"}, task, seed=5)
    # A plan of one plant whose seed is known: the same bean by the workflow.
    seeds = {"start": 5, "end": 6}
    controllers = [{"name": "greedy", "controller": {"kind": "greedy"}}]
    out = tmp_path / "transfer"
    judged = tropism.transfer(
        controllers=controllers, plant_seeds=seeds, task=task, greenhouse=greenhouse, out=out, monitor=False
    )
    assert judged.controllers[0].fitness[0] == pytest.approx(fitness, abs=0.05)  # of a file with five decimals
    stem, in_space = watching.seen[40].stem, watching.seen[40].stem_in_space
    assert stem is not None and stem.shape == (10, 2)
    if task is SPACE:
        assert track.lamps == ["left", "right", "front", "back"]
        assert watching.seen[40].z is not None and in_space is not None
        np.testing.assert_array_equal(in_space[:, :2], stem)
    else:
        assert watching.seen[40].z is None and in_space is None and len(greenhouse["solids"]) == 1


@pytest.mark.parametrize("task", [DISC, SPACE], ids=["obstacles", "space"])
def test_photographs_of_every_task_are_those_of_run(task: dict[str, Any], tmp_path: Path) -> None:
    """The loop over the tent's devices, one of them a camera at the side, sees what `tropism.run` records."""
    task = {**task, "max_steps": 25}
    tent = Tent(seed=2, greenhouse=SMALL, task=task)
    watching = Watching(task, tent.rig().layout)
    track, fitness = loop.run(tent, watching, task)
    config = tropism.PLANS["run"]().complete()["config"]
    config.update(seed=2, controller={"kind": "greedy"}, task=task)
    config["rig"]["greenhouse"] = loop.greenhouse_for(task, SMALL)
    recorded = tropism.run(out=tmp_path / "run", config=config, monitor=False)
    np.testing.assert_allclose(tropism.Track.read(recorded.track).tips, track.tips, rtol=0, atol=6e-6)
    assert recorded.fitness == pytest.approx(fitness, abs=1e-4)
    assert (tent.side_photograph() is not None) == (task["kind"] == "space")
    if task["kind"] == "space":
        # Both cameras see the tip at each step, about where it is.
        assert all(seen.z is not None and abs(seen.z) < 3 for seen in watching.seen)


def test_a_rig_that_lacks_what_a_task_needs_is_refused() -> None:
    with pytest.raises(tropism.PlanError, match="without the obstacles of the task"):
        loop.run(Tent(greenhouse=SMALL), {"kind": "greedy"}, DISC)
    with pytest.raises(tropism.PlanError, match="a task in space needs a second camera"):
        loop.run(Tent(greenhouse=SMALL), {"kind": "greedy"}, SPACE)
    rig = Tent(greenhouse=SMALL, task=SPACE).rig()
    assert rig.side is not None
    rig.side.stands = "above"  # type: ignore[assignment]
    with pytest.raises(tropism.PlanError, match='side.stands: found "above"'):
        loop.run(rig, {"kind": "greedy"}, SPACE)


def test_an_exception_of_the_side_camera_is_raised() -> None:
    class Broken(Camera):
        def photograph(self) -> bytes:
            raise LookupError("side")

    rig = Tent(greenhouse=SMALL, task=SPACE).rig()
    assert rig.side is not None
    rig.side.camera = Broken()
    with pytest.raises(LookupError, match="side"):
        loop.run(rig, {"kind": "greedy"}, SPACE)


def test_a_model_comes_back_from_its_file(tmp_path: Path) -> None:
    model = Model.of_virtual_beans("stem", plants=1, steps=100)
    (tmp_path / "stem.json").write_text(model.to_json())
    again = Model.read(tmp_path / "stem.json")
    assert again.kind == "stem"
    assert loop.simulate(again, seed=3) == loop.simulate(model, seed=3)
    with pytest.raises(tropism.PlanError, match="wanted tip, stem, space"):
        Model.of_virtual_beans("lstm", plants=1, steps=10)


class Nowhere(Leaning):
    """A model that sees no number."""

    def observe(self, plant: Any) -> Any:
        return (math.nan, 5.0)


def test_a_tent_is_of_one_run() -> None:
    tent = Tent(seed=1, greenhouse=SMALL)
    loop.run(tent, "greedy", {"max_steps": 2})
    with pytest.raises(tropism.PlanError, match="wanted a new one"):
        loop.run(tent, "greedy", {"max_steps": 2})


def test_numbers_that_are_none_and_periods_of_no_clock_are_refused() -> None:
    with pytest.raises(tropism.PlanError, match="wanted finite numbers"):
        loop.simulate(Nowhere(), "greedy", {"max_steps": 3})
    for period in (-5.0, 0.0, math.nan, math.inf, 1e7):
        with pytest.raises(tropism.PlanError, match=r"period_min .*, wanted 0\.01 to 1440"):
            loop.grow("greedy", {"max_steps": 2}, period_min=period)
        with pytest.raises(tropism.PlanError, match=r"period_min .*, wanted 0\.01 to 1440"):
            Tent(period_min=period)
    with pytest.raises(tropism.PlanError, match="still to be drawn"):
        loop.grow("greedy", {"kind": "random_targets", "count": 3})


def test_parts_of_the_core_go_from_thread_to_thread() -> None:
    tent, greedy = Tent(seed=2, greenhouse=SMALL), loop.CoreController("greedy")
    with ThreadPoolExecutor(1) as other:
        photograph = other.submit(tent.photograph).result()
        assert other.submit(greedy.decide_at, 0.0, 4.0).result() == greedy.decide_at(0.0, 4.0)
    assert photograph == Tent(seed=2, greenhouse=SMALL).photograph()
