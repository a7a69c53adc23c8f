"""Sweeps at fsspec addresses: the same bits as in a folder, and nothing lost with a worker."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
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


@pytest.fixture
def address(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """An address of the kind that a test asks for. s3 is a server of this process."""
    if request.param != "s3":
        yield f"memory://{tmp_path.name}" if request.param == "memory" else f"file://{tmp_path}/sweep"
        return
    s3fs, moto = pytest.importorskip("s3fs"), pytest.importorskip("moto.server")
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    settings = {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "name",
        "AWS_SECRET_ACCESS_KEY": "word",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
    s3fs.S3FileSystem.clear_instance_cache()
    s3fs.S3FileSystem().makedirs("bucket", exist_ok=True)
    yield f"s3://bucket/{tmp_path.name}"
    server.stop()
    s3fs.S3FileSystem.clear_instance_cache()


@pytest.mark.parametrize("address", ["memory", "file", "s3"], indirect=True)
def test_a_sweep_at_an_address_has_the_bits_of_a_folder(address: str, model: Path, tmp_path: Path) -> None:
    wanted = tropism.sweep(config(model, 8), out=tmp_path / "folder", monitor=False)
    found = tropism.sweep(config(model, 8), out=address, monitor=False)
    assert fitness(found) == fitness(wanted)
    folder = {path.parent.name: path.read_bytes() for path in (tmp_path / "folder").glob("units/*/unit.json")}
    assert len(folder) == 4 and units_at(address) == folder
    files, root = fsspec.core.url_to_fs(address)
    names = {path[len(root) :].lstrip("/") for path in files.find(root)}
    assert {"sweep.toml", "sweep.csv", "sweep.json", "model.json"} <= names
    assert not [name for name in names if name.endswith(("run.lock", ".part"))]
    with pytest.raises(tropism.PlanError, match="a sweep is here already"):
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
        self.files.invalidate_cache()
        saved = {path.rpartition("/")[0] for path in self.files.glob(f"{self.root}/units/*/run-??.json")}
        if self.killed is None and any(not self.files.exists(f"{unit}/unit.json") for unit in saved):
            self.killed = worker_of_a_unit()
            if self.killed is not None:
                os.kill(self.killed, signal.SIGKILL)
        return True


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").exists(), reason="processes are found in /proc")
@pytest.mark.parametrize("address", ["file", "s3"], indirect=True)
def test_a_killed_worker_changes_no_bit_at_an_address(address: str, model: Path, tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    os.environ.setdefault("RAY_AUTH_MODE", "disabled")
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
    # From what is at the address alone, some units of which are lost.
    files, root = fsspec.core.url_to_fs(address)
    files.rm(f"{root}/units/setting-1-seed-1", recursive=True)
    again = ordered({"workflow": "sweep", "plan": None, "out": address, "engine": "ray", "address": None, "threads": 2})
    assert again.returncode == 0, again.stderr
    assert fitness(json.loads(again.stdout)) == fitness(wanted) and units_at(address) == folder


def ordered(order: dict[str, Any]) -> subprocess.CompletedProcess[str]:
    """What the command line starts, with what it sends."""
    words = [sys.executable, "-m", "tropism.work_command"]
    return subprocess.run(words, input=json.dumps(order), capture_output=True, text=True, timeout=300)


@pytest.mark.parametrize("address", ["file", "s3"], indirect=True)
def test_the_command_line_executes_a_sweep_at_an_address(address: str, model: Path, tmp_path: Path) -> None:
    wanted = tropism.sweep(config(model, 8), out=tmp_path / "folder", monitor=False)
    plan = {"out": address, "resume": False, "folder": "", "config": config(model, 8)}
    order = {"plan": plan, "out": address, "engine": "local", "workflow": "sweep", "address": None, "threads": 2}
    done = ordered(order)
    assert done.returncode == 0, done.stderr
    assert fitness(json.loads(done.stdout)) == fitness(wanted)
    refused = ordered(order)
    assert refused.returncode == 1 and "by --resume" in refused.stderr and "Traceback" not in refused.stderr
    # From what is at the address alone.
    files, root = fsspec.core.url_to_fs(address)
    files.rm(f"{root}/units", recursive=True)
    again = ordered({**order, "plan": None})
    assert again.returncode == 0, again.stderr
    assert fitness(json.loads(again.stdout)) == fitness(wanted)
    nothing = ordered({**order, "plan": None, "out": f"{address}-elsewhere"})
    assert nothing.returncode == 1 and "found no sweep.toml" in nothing.stderr, nothing.stderr


@pytest.mark.skipif("PROGRAM" not in os.environ, reason="PROGRAM names no command line")
def test_the_program_hands_a_sweep_at_an_address_over(model: Path, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text("seeds = 2\n[evolve]\nevolution = { runs = 2, generations = 5 }\n")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"

    def program(*words: str) -> dict[str, Any]:
        command = [os.environ["PROGRAM"], "--json", "sweep", *words]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, env={**os.environ, "PATH": path})
        assert done.returncode == 0, done.stderr
        results: dict[str, Any] = json.loads(done.stdout)
        return results

    files = [str(tmp_path / "s.toml"), "--model", str(model)]
    wanted = program(*files, "--out", str(tmp_path / "folder"))
    address = f"file://{tmp_path}/sweep"
    assert fitness(program(*files, "--out", address)) == fitness(wanted)
    assert fitness(program("--out", address, "--resume")) == fitness(wanted)
