"""Long work by its units: listed, alone, and on Ray."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import tropism
from tropism.plans import EvolvePlan, TransferPlan

SMALL = {"runs": 3, "generations": 4, "neat": {"population": 20}}


def files(folder: Path) -> dict[str, bytes]:
    """What a plan decides of a folder: no times, locks and checkpoints before the last."""
    chance = ("run.lock", "summary.json", "report.html")
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name not in chance and ".previous." not in path.name
    }


def transfer(out: Path) -> TransferPlan:
    return TransferPlan(controllers=["greedy", "periodic"], plants=2, task={"max_steps": 30}, out=out, monitor=False)


def test_units_alone_come_to_the_same_as_the_whole(tmp_path: Path) -> None:
    whole = tropism.execute(transfer(tmp_path / "whole"))
    plan = transfer(tmp_path / "alone")
    units = tropism.units(plan)
    assert [unit["number"] for unit in units] == [1, 2, 3, 4] and not any(unit["is_done"] for unit in units)
    for unit in reversed(units):
        assert tropism.execute_unit(plan, unit["number"])["unit"] == unit["unit"]
    assert all(unit["is_done"] for unit in tropism.units(plan))
    again = tropism.resume(tmp_path / "alone", "transfer", monitor=False)
    assert again == whole and files(tmp_path / "alone") == files(tmp_path / "whole")
    with pytest.raises(tropism.PlanError, match="found unit = 5, wanted 1 to 4"):
        tropism.execute_unit(plan, 5)
    with pytest.raises(tropism.PlanError, match="wanted a long work"):
        tropism.units(tropism.plans.TunePlan())


@pytest.fixture
def cluster() -> Iterator[None]:
    ray = pytest.importorskip("ray", reason="no Ray: work on a cluster is not tested")
    ray.init(num_cpus=2, log_to_driver=False)
    yield
    ray.shutdown()


def test_every_long_work_is_executed_on_ray(
    cluster: None, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    alone = tropism.execute(transfer(tmp_path / "whole"))
    together = tropism.on_ray(transfer(Path("ray")))
    assert together.controllers == alone.controllers and files(tmp_path / "ray") == files(tmp_path / "whole")
    assert len(together["units"]) == 4
    with pytest.raises(tropism.PlanError, match="`out` is missing"):
        tropism.on_ray(tropism.plans.BaselinePlan(model=model, monitor=False))
    with pytest.raises(tropism.PlanError, match="has begun already"):
        tropism.on_ray(transfer(Path("ray")))
    evolve = EvolvePlan(model=model, evolution=SMALL, trial_plants=5, out="evolved", monitor=False)
    evolved = tropism.execute(evolve)
    also = tropism.on_ray(EvolvePlan(**{**evolve.to_dict(), "out": "on-ray"}, monitor=False))
    assert [run.best_fitness for run in also.runs] == [run.best_fitness for run in evolved.runs]
    assert files(tmp_path / "on-ray") == files(tmp_path / "evolved")
    # Stages one after the other: controllers of each replicate, then their test.
    search = {"generations": 1, "population": 4, "episodes": 2, "starts": 1}
    config = {
        "replicates": 2,
        "plants": 2,
        "steps": 150,
        "test_plants": 2,
        "task": {"max_steps": 30},
        "methods": [{"name": "rule", "kind": "tune", "model": "stem", "search": search}],
    }
    compared = tropism.on_ray(tropism.plans.ReplicatesPlan(config=config, out="replicates", monitor=False))
    assert [unit["number"] for unit in compared["units"]] == [1, 2, 3] and len(compared.scenarios) == 1
