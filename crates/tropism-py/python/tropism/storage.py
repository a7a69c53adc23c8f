"""A folder of work at an fsspec address, such as s3://bucket/sweep: fetched before work begins, and kept up to date during it.

The core writes to disks alone. So work happens in a folder of this machine, its mirror: files that changed are copied to the
address, each as a whole. Of the two files of a checkpoint one is whole there at any moment, as on the disk.
"""

from __future__ import annotations

import json
import os
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from tropism import _core
from tropism.edge import settings
from tropism.errors import PlanError, TropismError
from tropism.monitor import Monitor, Progress
from tropism.plan import Plan, execute
from tropism.plans import SweepPlan
from tropism.results import SweepResults

#: Seconds between two looks at what changed. Chosen: far below the minute between two checkpoints.
PUSH_S = 1.0


def is_address(path: object) -> bool:
    """Whether `path` is an fsspec address, and no path of a disk."""
    return isinstance(path, str) and "://" in path


class Mirror:
    """A folder of this machine that mirrors an address. `options` are those of the address's fsspec file system."""

    def __init__(self, address: str, folder: Path, options: Mapping[str, Any] | None = None) -> None:
        try:
            from fsspec.core import url_to_fs
        except ImportError as error:
            text = f"{address} needs fsspec: pip install 'tropism[fsspec]'"
            raise TropismError(text) from error
        try:
            self.files, root = url_to_fs(address, **dict(options or {}))
        except (ImportError, ValueError) as error:
            raise PlanError(f"out: found {address}, wanted an address that fsspec reads: {error}") from error
        self.address = address
        self.folder = folder
        self._root: str = root.rstrip("/")
        #: Time and size of the files that are the same at the address.
        self._known: dict[str, tuple[int, int]] = {}
        #: Folders at the address that are there.
        self._made: set[str] = set()
        #: Names, or beginnings of names, of what is copied to the address.
        self.only: tuple[str, ...] = ("",)

    def has(self, name: str) -> bool:
        """Whether there is a file of this name at the address."""
        # What other processes wrote must be seen.
        self.files.invalidate_cache()
        found: bool = self.files.exists(f"{self._root}/{name}")
        return found

    def fetch(self, name: str = "") -> None:
        """Copies a file, or all files of a folder, from the address. What is not there is left out."""
        self.files.invalidate_cache()
        for path in self.files.find(f"{self._root}/{name}".rstrip("/")):
            if path.endswith(".part"):
                continue  # What a lost process left.
            own = path[len(self._root) :].lstrip("/")
            target = self.folder / own
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(self.files.cat_file(path))
            self._known[own] = self._signature(target)

    def write(self, name: str, content: bytes) -> None:
        """Writes a file at the address alone."""
        path = f"{self._root}/{name}"
        folder = path.rpartition("/")[0]
        if folder not in self._made:
            self.files.makedirs(folder, exist_ok=True)
            self._made.add(folder)
        if "file" in self.files.protocol:
            # Disks show files that are half written; object storage does not.
            part = f"{path}.{os.getpid()}.part"
            self.files.pipe_file(part, content)
            os.replace(part, path)
        else:
            self.files.pipe_file(path, content)

    def push(self) -> None:
        """Copies the files that have changed to the address."""
        for name in self._changed():
            path = self.folder / name
            try:
                signature, content = self._signature(path), path.read_bytes()
            except FileNotFoundError:
                continue  # It was renamed at this moment: its new name comes next time.
            self.write(name, content)
            self._known[name] = signature

    def _changed(self) -> list[str]:
        found = []
        for path in self.folder.rglob("*"):
            name = path.relative_to(self.folder).as_posix()
            # Locks are of this machine, and files that are being written have no content yet.
            if path.suffix == ".part" or path.name == "run.lock" or not name.startswith(self.only):
                continue
            if not path.is_file():
                continue
            try:
                is_new = self._known.get(name) != self._signature(path)
            except FileNotFoundError:
                continue
            if is_new:
                found.append(name)
        # A checkpoint after the one before it, and what says that all is finished last.
        return sorted(found, key=lambda name: (name.endswith("/unit.json"), ".previous." not in name, name))

    @staticmethod
    def _signature(path: Path) -> tuple[int, int]:
        status = path.stat()
        return status.st_mtime_ns, status.st_size


@contextmanager
def mirror_of(address: str, options: Mapping[str, Any] | None) -> Iterator[Mirror]:
    """A mirror of an address in a folder that goes away at the end."""
    with tempfile.TemporaryDirectory(prefix="tropism-") as folder:
        yield Mirror(address, Path(folder), options)


class Pushing(Monitor):
    """Keeps an address up to date while a workflow works, and passes on what it reports."""

    def __init__(self, mirror: Mirror, listener: Monitor | None = None) -> None:
        self._mirror = mirror
        self._next = listener or Monitor()
        self._due = time.monotonic() + PUSH_S

    def stage(self, name: str, total: int) -> None:
        self._next.stage(name, total)

    def advance(self, count: int) -> None:
        self._next.advance(count)

    def skip(self, count: int) -> None:
        self._next.skip(count)

    def status(self, text: str) -> None:
        self._next.status(text)

    def note(self, text: str) -> None:
        self._next.note(text)

    def generation(self, run: int, statistics: str) -> None:
        self._next.generation(run, statistics)

    def may_go_on(self) -> bool:
        if time.monotonic() >= self._due:
            self._mirror.push()
            self._due = time.monotonic() + PUSH_S
        return self._next.may_go_on()


def plan_at(address: str, options: Mapping[str, Any] | None = None) -> SweepPlan:
    """The plan that goes on with the sweep at an address, from what is there alone."""
    with mirror_of(address, options) as mirror:
        if not mirror.has("sweep.toml"):
            raise PlanError(f"{address}: found no sweep.toml, wanted a sweep to go on with, or a sweep file")
        mirror.fetch("sweep.toml")
        plan = SweepPlan(**json.loads(_core.plan_of_folder("sweep", mirror.folder)))
    # The folder of the mirror is gone; the model is fetched again. Replicates name a folder of their own.
    folder = None if plan.folder == os.fspath(mirror.folder) else plan.folder
    return replace(plan, out=address, folder=folder)


def execute_at(plan: SweepPlan, options: Mapping[str, Any] | None) -> SweepResults:
    """Executes a sweep on this machine whose `out` is an address."""
    address = os.fspath(plan.out or "")
    with mirror_of(address, options) as mirror:
        if mirror.has("sweep.toml") and not plan.resume:
            text = f"{address}: a sweep is here already: choose a new address (`out`), or go on with it by `resume`"
            raise PlanError(text)
        mirror.fetch()
        progress = Progress() if plan.monitor is None else None
        listener = Pushing(mirror, progress or plan.monitor or None)
        model = mirror.folder / "model.json"
        config = settings(plan.config)
        if model.exists():
            config["model"] = os.fspath(model)
        try:
            results = execute(replace(plan, out=mirror.folder, config=config, monitor=listener))
        finally:
            mirror.push()
            if progress is not None:
                progress.close()
        return results


def units_at(plan: Plan[Any], address: str, options: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    """The units of a sweep at an address, which must be free for it, or have it. Its model is put beside it: the disk of this
    machine is not that of the workers."""
    if not isinstance(plan, SweepPlan):
        raise PlanError(f"out: found the address {address}, wanted a folder: only sweeps work at addresses")
    with mirror_of(address, options) as mirror:
        is_there = mirror.has("sweep.toml")
        if is_there and not plan.resume:
            text = f"{address}: a sweep is here already: choose a new folder (`out`), or go on with it by `resume`"
            raise PlanError(text)
        config = settings(plan.config)
        model = config.get("model")
        if not is_there and model:
            mirror.write("model.json", Path(plan.folder or "", model).read_bytes())
        mirror.fetch()
        if model:
            config["model"] = os.fspath(mirror.folder / "model.json")
        own = replace(plan, out=mirror.folder, config=config)
        units: list[dict[str, Any]] = json.loads(_core.work_units("sweep", own.to_json()))
        return units


def execute_unit_at(
    address: str,
    options: Mapping[str, Any] | None,
    plan: dict[str, Any],
    number: int,
    name: str,
    threads: int,
    listener: Monitor,
) -> str:
    """Executes a unit of a sweep from where its files at an address are: what became of it (JSON)."""
    with mirror_of(address, options) as mirror:
        for file in ("sweep.toml", "model.json", f"units/{name}/"):
            mirror.fetch(file)
        mirror.only = ("sweep.toml", f"units/{name}/")
        plan = {**plan, "out": os.fspath(mirror.folder)}
        if (mirror.folder / "model.json").exists():
            plan["config"] = {**plan["config"], "model": os.fspath(mirror.folder / "model.json")}
        try:
            return _core.execute_unit("sweep", json.dumps(plan), number, Pushing(mirror, listener), threads)
        finally:
            mirror.push()
