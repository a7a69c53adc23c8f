"""Sweeps on Ray: each unit of work is a task of the cluster.

A unit saves checkpoints in its folder, which all machines share, or which lies at an fsspec address. Ray starts a unit whose
worker was lost on another one, where it goes on from its last checkpoint to the same bits.
"""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from tropism import _core
from tropism.edge import settings
from tropism.errors import Interrupted, PlanError, TropismError
from tropism.monitor import Monitor, Progress
from tropism.plan import execute
from tropism.plans import SweepPlan
from tropism.results import SweepResults
from tropism.storage import Mirror, execute_at, execute_unit, is_address

#: Seconds between two questions of a unit whether to end. Chosen: a thousand units ask an actor a thousand times a second, which
#: is a tenth of what one answers.
ASK_S = 1.0
#: Seconds for units to save and end, after which they are left to Ray. Chosen: to save takes a fraction of one.
END_S = 10.0


class _Ending:
    """An actor that knows whether the units are to end.

    Units are not cancelled: `ray.cancel` of a task that ends at this moment aborts the process that calls it (Ray 2.60, "Tried to
    complete task that was not pending"; https://github.com/ray-project/ray/pull/54798 mends a part of it).
    """

    def __init__(self) -> None:
        self._is_over = False

    def end(self) -> None:
        self._is_over = True

    def is_over(self) -> bool:
        return self._is_over


class _Asking(Monitor):
    """Ends a unit, which then saves, when the actor says so. It never waits for the answer: Ray lends the cores of who waits."""

    def __init__(self, ending: Any) -> None:
        self._ending = ending
        self._answer: Any = None
        self._due = time.monotonic()

    def may_go_on(self) -> bool:
        if self._answer is None and time.monotonic() >= self._due:
            self._answer = self._ending.is_over.remote().future()
            self._due = time.monotonic() + ASK_S
        if self._answer is None or not self._answer.done():
            return True
        # An actor that is lost with its machine says nothing.
        if self._answer.exception() is None and self._answer.result():
            return False
        self._answer = None
        return True


def _absolute(plan: SweepPlan) -> SweepPlan:
    """The plan with paths that mean the same on each worker, whose working folder is another one."""
    config = settings(plan.config)
    folder = os.path.abspath(os.fspath(plan.folder)) if plan.folder else os.getcwd()
    if config.get("model"):
        config["model"] = os.path.join(folder, os.fspath(config["model"]))
    out = plan.out if is_address(plan.out) else os.path.abspath(os.fspath(plan.out or "sweep"))
    return replace(plan, config=config, folder=folder, out=out)


def _unit(
    plan: str, number: int, threads: int, name: str, storage_options: Mapping[str, Any] | None, ending: Any
) -> dict[str, Any]:
    """Executes one unit on a worker: what it found, and what it cost."""
    import resource
    import socket

    import ray

    if ray.get(ending.is_over.remote()):
        raise Interrupted("interrupted before it began")
    began = time.monotonic()
    before = resource.getrusage(resource.RUSAGE_SELF)
    order = {"sweep": json.loads(plan), "unit": number}
    out = order["sweep"]["out"]
    if is_address(out):
        text = execute_unit(out, storage_options, order, name, threads, _Asking(ending))
    else:
        text = _core.execute_workflow("sweep_unit", json.dumps(order), _Asking(ending), threads)
    after = resource.getrusage(resource.RUSAGE_SELF)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    found = {"number": number, "results": json.loads(text), "host": socket.gethostname(), "process": os.getpid()}
    return {**found, "wall_seconds": time.monotonic() - began, "cpu_seconds": cpu, "bytes": len(text)}


def execute_units(
    plan: SweepPlan,
    *,
    address: str | None,
    workers: int | None,
    threads: int,
    retries: int,
    storage_options: Mapping[str, Any] | None = None,
) -> list[dict[str, Any]]:
    """Executes the units of a sweep as tasks of a Ray cluster: what each of them cost, and where it worked."""
    try:
        import ray
        import ray.exceptions
    except ImportError as error:
        text = 'the engine ray needs Ray: pip install "ray[default]"'
        raise TropismError(text) from error
    plan = _absolute(replace(plan, threads=None))
    plan.check()
    units: list[dict[str, Any]] = json.loads(_core.sweep_units(plan.to_json()))
    out = os.fspath(plan.out or "sweep")
    mirror = Mirror(out, Path(), storage_options) if is_address(out) else None
    is_there = mirror.has("sweep.toml") if mirror else Path(out, "sweep.toml").exists()
    if is_there and not plan.resume:
        raise PlanError(f"{out}: a sweep is here already: choose a new folder (`out`), or go on with it by `resume`")
    if mirror and not is_there and (model := settings(plan.config).get("model")):
        # Workers find the model beside the sweep: the disk of this machine is not theirs.
        mirror.write("model.json", Path(model).read_bytes())
    monitor: Monitor | None = Progress() if plan.monitor is None else plan.monitor or None
    started = not ray.is_initialized()
    if started:
        count = None if address or workers is None else workers * threads
        context = ray.init(address=address, num_cpus=count, log_to_driver=False, logging_level=logging.WARNING)
        if monitor is not None and context.dashboard_url:
            monitor.note(f"Ray's dashboard: http://{context.dashboard_url}")
    # A worker that is lost is no fault of its unit; an exception is, and is raised at once.
    task = ray.remote(num_cpus=threads, max_retries=retries, retry_exceptions=False)(_unit)
    actor: Any = ray.remote(num_cpus=0, max_restarts=-1, max_task_retries=-1)(_Ending)
    ending = actor.remote()
    text = ray.put(plan.to_json())
    named = {unit["number"]: f"{unit['setting']}; seed {unit['seed']}" for unit in units}
    waiting: list[int] = [unit["number"] for unit in units]
    running: dict[Any, int] = {}
    costs: list[dict[str, Any]] = []
    most = workers or len(units)
    try:
        if monitor is not None:
            monitor.stage("units of the sweep", len(units))
        while waiting or running:
            while waiting and len(running) < most:
                number = waiting.pop(0)
                named_task = task.options(name=f"unit {number}: {named[number]}")
                name = units[number - 1]["unit"]
                running[named_task.remote(text, number, threads, name, storage_options, ending)] = number
            done, _ = ray.wait(list(running), timeout=0.1)
            for reference in done:
                costs.append(ray.get(reference))
                del running[reference]
                if monitor is not None:
                    monitor.advance(1)
                    monitor.status(named[costs[-1]["number"]])
            if monitor is not None and not monitor.may_go_on():
                raise Interrupted(f"interrupted: {out} is saved; `resume` goes on")
    except ray.exceptions.RayTaskError as error:
        raise TropismError(str(error.cause)) from error
    except ray.exceptions.WorkerCrashedError as error:
        text = f"{out}: a unit lost its worker more than {retries} times; `resume` goes on"
        raise TropismError(text) from error
    finally:
        if running:
            # Units that still work save what they did.
            ending.end.remote()
            ray.wait(list(running), num_returns=len(running), timeout=END_S)
        if isinstance(monitor, Progress):
            monitor.close()
        if started:
            ray.shutdown()
    return sorted(costs, key=lambda cost: cost["number"])


def sweep_on_ray(
    plan: SweepPlan,
    *,
    address: str | None,
    workers: int | None,
    threads: int,
    retries: int,
    storage_options: Mapping[str, Any] | None = None,
) -> SweepResults:
    """Executes the units of a sweep on Ray, and then makes the table from their folders.

    `units` of the results tells what each unit cost and where it worked.
    """
    costs = execute_units(
        plan, address=address, workers=workers, threads=threads, retries=retries, storage_options=storage_options
    )
    table = replace(_absolute(plan), threads=None, resume=True, monitor=False)
    results = execute_at(table, storage_options) if is_address(plan.out) else execute(table)
    keys = ("number", "host", "process", "wall_seconds", "cpu_seconds", "bytes")
    return SweepResults({**results.to_dict(), "units": [{key: cost[key] for key in keys} for cost in costs]})
