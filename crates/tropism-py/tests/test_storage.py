"""Sweeps at fsspec addresses: the same bits as in a folder, and nothing lost with a worker."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest
import tropism
from sweeping import config, worker_of_a_unit
from tropism.storage import Mirror, is_address

fsspec = pytest.importorskip("fsspec")


def units_at(address: str) -> dict[str, bytes]:
    files, root = fsspec.core.url_to_fs(address)
    files.invalidate_cache()
    return {path.split("/")[-2]: files.cat_file(path) for path in files.glob(f"{root}/units/*/unit.json")}


def fitness(results: Any) -> list[list[Any]]:
    keys = ("setting", "mean", "sd", "runs", "five_numbers")
    return [[row[key] for key in keys] for row in results["rows"]]


class StopsAt(tropism.Monitor):
    """Asks for an end after some generations."""

    def __init__(self, most: int) -> None:
        self.left = most

    def advance(self, count: int) -> None:
        self.left -= count

    def may_go_on(self) -> bool:
        return self.left > 0


@pytest.mark.parametrize("kind", ["memory", "file"])
def test_a_sweep_at_an_address_has_the_bits_of_a_folder(kind: str, model: Path, tmp_path: Path) -> None:
    address = f"memory://{tmp_path.name}" if kind == "memory" else f"file://{tmp_path}/sweep"
    wanted = tropism.sweep(config(model, 8), out=tmp_path / "folder", monitor=False)
    found = tropism.sweep(config(model, 8), out=address, monitor=False)
    assert fitness(found) == fitness(wanted)
    folder = {path.parent.name: path.read_bytes() for path in (tmp_path / "folder").glob("units/*/unit.json")}
    assert len(folder) == 4 and units_at(address) == folder
    files, root = fsspec.core.url_to_fs(address)
    names = {path[len(root) :].lstrip("/") for path in files.find(root)}
    assert {"sweep.toml", "sweep.csv", "sweep.json", "model.json"} <= names
    assert not [name for name in names if name.endswith(("run.lock", ".part"))]
    with pytest.raises(tropism.PlanError, match="found a sweep here already"):
        tropism.sweep(config(model, 8), out=address, monitor=False)
    again = tropism.sweep(config(model, 8), out=address, resume=True, monitor=False)
    assert fitness(again) == fitness(wanted)


def test_a_sweep_at_an_address_goes_on_where_it_was(model: Path, tmp_path: Path) -> None:
    address = f"memory://{tmp_path.name}"
    wanted = tropism.sweep(config(model, 300), out=tmp_path / "folder", monitor=False)
    with pytest.raises(tropism.Interrupted):
        tropism.sweep(config(model, 300), out=address, threads=1, monitor=StopsAt(700))
    files, root = fsspec.core.url_to_fs(address)
    assert files.glob(f"{root}/units/*/run-??.json") and len(units_at(address)) < 4
    found = tropism.sweep(config(model, 300), out=address, resume=True, monitor=False)
    assert fitness(found) == fitness(wanted)


def test_a_mirror_copies_what_changed_and_a_checkpoint_after_the_one_before(tmp_path: Path) -> None:
    address, unit = f"memory://{tmp_path.name}", tmp_path / "here" / "units" / "a"
    unit.mkdir(parents=True)
    order: list[str] = []

    class Telling(Mirror):
        def write(self, name: str, content: bytes) -> None:
            order.append(name)
            super().write(name, content)

    mirror = Telling(address, tmp_path / "here")
    for name in ("unit.json", "run-00.json", "run-00.previous.json", "run.lock", "history.csv.part", "history.csv"):
        (unit / name).write_text(name)
    mirror.push()
    wanted = ["run-00.previous.json", "history.csv", "run-00.json", "unit.json"]
    assert order == [f"units/a/{name}" for name in wanted]
    order.clear()
    (unit / "run-00.json").write_text("later")
    mirror.push()
    assert order == ["units/a/run-00.json"]
    other = Mirror(address, tmp_path / "there")
    other.fetch("units/a/")
    assert (tmp_path / "there/units/a/run-00.json").read_text() == "later"
    assert len(list((tmp_path / "there").rglob("*.*"))) == 4


def test_what_is_no_address_is_a_path(tmp_path: Path) -> None:
    assert is_address("s3://bucket/sweep") and not is_address("sweep") and not is_address(tmp_path)
    with pytest.raises(tropism.PlanError, match="wanted an address that fsspec reads"):
        tropism.sweep({"seeds": 1}, model="model.json", out="horses://stable", monitor=False)


class KillsAWorkerOf(tropism.Monitor):
    """Kills the process of a unit as soon as a checkpoint of a unit is at the address."""

    def __init__(self, address: str) -> None:
        self.files, self.root = fsspec.core.url_to_fs(address)
        self.killed: int | None = None

    def may_go_on(self) -> bool:
        saved = {path.rpartition("/")[0] for path in self.files.glob(f"{self.root}/units/*/run-??.json")}
        if self.killed is None and any(not self.files.exists(f"{unit}/unit.json") for unit in saved):
            self.killed = worker_of_a_unit()
            if self.killed is not None:
                os.kill(self.killed, signal.SIGKILL)
        return True


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").exists(), reason="processes are found in /proc")
def test_a_killed_worker_changes_no_bit_at_an_address(model: Path, tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    os.environ.setdefault("RAY_AUTH_MODE", "disabled")
    address = f"file://{tmp_path}/sweep"
    settings = config(model, 1600)
    wanted = tropism.sweep(settings, out=tmp_path / "folder", monitor=False)
    ray.init(num_cpus=2, log_to_driver=False, include_dashboard=False)
    try:
        monitor = KillsAWorkerOf(address)
        found = tropism.sweep(settings, out=address, engine="ray", workers=2, monitor=monitor)
    finally:
        ray.shutdown()
    assert monitor.killed is not None and monitor.killed not in {unit["process"] for unit in found.units}
    assert fitness(found) == fitness(wanted)
    folder = {path.parent.name: path.read_bytes() for path in (tmp_path / "folder").glob("units/*/unit.json")}
    assert units_at(address) == folder
