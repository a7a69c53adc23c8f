"""Sweeps on a real Ray cluster of several worker processes give the bits of one machine, also after a lost worker."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
import tropism
from sweeping import config, worker_of_a_unit

ray = pytest.importorskip("ray")


def units(folder: Path) -> dict[str, bytes]:
    return {path.parent.name: path.read_bytes() for path in sorted(folder.glob("units/*/unit.json"))}


class KillsAWorker(tropism.Monitor):
    """Kills the process of a unit as soon as it has saved a checkpoint."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.killed: int | None = None

    def may_go_on(self) -> bool:
        saved = {path.parent for path in self.folder.glob("units/*/run-??.json")}
        if self.killed is None and any(not (unit / "unit.json").exists() for unit in saved):
            self.killed = worker_of_a_unit()
            if self.killed is not None:
                os.kill(self.killed, signal.SIGKILL)
        return True


@pytest.fixture
def cluster() -> object:
    os.environ.setdefault("RAY_AUTH_MODE", "disabled")  # else Ray writes a token into the user's home
    ray.init(num_cpus=2, log_to_driver=False, include_dashboard=False)
    yield
    ray.shutdown()


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").exists(), reason="processes are found in /proc")
def test_a_killed_worker_changes_no_bit(model: Path, tmp_path: Path, cluster: object) -> None:
    settings = config(model, 800)
    alone = tropism.sweep(settings, out=tmp_path / "alone", monitor=False)
    monitor = KillsAWorker(tmp_path / "ray")
    together = tropism.sweep(settings, out=tmp_path / "ray", engine="ray", workers=2, monitor=monitor)
    assert monitor.killed is not None
    assert len({unit["process"] for unit in together.units}) >= 2
    assert monitor.killed not in {unit["process"] for unit in together.units}
    assert len(units(tmp_path / "alone")) == 4
    assert units(tmp_path / "ray") == units(tmp_path / "alone")
    fitness = [[row[key] for key in ("setting", "mean", "sd", "runs")] for row in together["rows"]]
    assert fitness == [[row[key] for key in ("setting", "mean", "sd", "runs")] for row in alone["rows"]]


@pytest.mark.slow
def test_a_unit_that_fails_says_why(tmp_path: Path, cluster: object) -> None:
    # All units fail at once, while others are about to begin: to cancel these aborts the process in one of ten cases.
    for number in range(20):
        with pytest.raises(tropism.TropismError, match=r"nowhere\.json"):
            out = tmp_path / str(number)
            tropism.sweep(config(tmp_path / "nowhere.json", 5), out=out, engine="ray", monitor=False)


class StopsAtACheckpoint(tropism.Monitor):
    """Asks for an end as soon as a unit has saved a checkpoint."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def may_go_on(self) -> bool:
        return not list(self.folder.glob("units/*/run-??.json"))


@pytest.mark.slow
def test_an_interrupted_sweep_leaves_no_unit_at_work_and_goes_on_to_the_same(
    model: Path, tmp_path: Path, cluster: object
) -> None:
    settings, out = config(model, 800), tmp_path / "ray"
    tropism.sweep(settings, out=tmp_path / "alone", monitor=False)
    with pytest.raises(tropism.Interrupted, match="is saved"):
        tropism.sweep(settings, out=out, engine="ray", workers=2, monitor=StopsAtACheckpoint(out))
    assert len(units(out)) < 4 and worker_of_a_unit() is None
    tropism.sweep(settings, out=out, engine="ray", workers=2, resume=True, monitor=False)
    assert units(out) == units(tmp_path / "alone")


def test_an_unknown_engine_is_refused(model: Path) -> None:
    with pytest.raises(tropism.PlanError, match="wanted local or ray"):
        tropism.sweep(config(model, 5), engine="horses")  # type: ignore[arg-type]
