"""Long work on Ray: each of its units is a task of the cluster.

Units save what they do in their folder, which all machines share, or which lies at an fsspec address. Ray starts a unit whose
worker was lost on another one: an evolution goes on from its last checkpoint, other units begin again, to the same bits.
"""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar, cast

from tropism import _core
from tropism.errors import Interrupted, PlanError, TropismError
from tropism.monitor import Monitor, Progress
from tropism.plan import Plan, execute
from tropism.results import Results, Rows
from tropism.storage import execute_at, execute_unit_at, is_address, units_at

_R = TypeVar("_R", bound=Results)

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


def _absolute(plan: Plan[_R]) -> Plan[_R]:
    """The plan with paths that mean the same on each worker, whose working folder is another one."""
    values = json.loads(_core.absolute_plan(plan.workflow, plan.to_json()))
    return type(plan)(**values, monitor=plan.monitor)


def _unit(
    workflow: str,
    plan: str,
    number: int,
    threads: int,
    name: str,
    storage_options: Mapping[str, Any] | None,
    ending: Any,
) -> dict[str, Any]:
    """Executes one unit on a worker: what it cost, and where it worked."""
    import resource
    import socket

    import ray

    if ray.get(ending.is_over.remote()):
        raise Interrupted("interrupted before it began")
    began = time.monotonic()
    before = resource.getrusage(resource.RUSAGE_SELF)
    out = json.loads(plan)["out"]
    if is_address(out):
        execute_unit_at(out, storage_options, json.loads(plan), number, name, threads, _Asking(ending))
    else:
        _core.execute_unit(workflow, plan, number, _Asking(ending), threads)
    after = resource.getrusage(resource.RUSAGE_SELF)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    found = {"number": number, "host": socket.gethostname(), "process": os.getpid()}
    return {**found, "wall_seconds": time.monotonic() - began, "cpu_seconds": cpu}


def execute_units(
    plan: Plan[Any],
    *,
    address: str | None,
    workers: int | None,
    threads: int,
    retries: int,
    storage_options: Mapping[str, Any] | None = None,
) -> list[dict[str, Any]]:
    """Executes the units of a long work as tasks of a Ray cluster: what each of them cost, and where it worked."""
    try:
        import ray
        import ray.exceptions
    except ImportError as error:
        text = 'the engine ray needs Ray: pip install "ray[default]"'
        raise TropismError(text) from error
    plan = _absolute(replace(plan, threads=None))
    plan.check()
    keys: dict[str, Any] = plan.complete()
    out: str | None = keys.get("out")
    if out is None:
        raise PlanError("`out` is missing: units of work lie in a folder")
    if is_address(out):
        units = units_at(plan, out, storage_options)
    else:
        _check_begun(plan, keys)
        units = json.loads(_core.work_units(plan.workflow, plan.to_json()))
    units = [unit for unit in units if not unit["is_done"]]
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
    text = ray.put(json.dumps(keys))
    named = {unit["number"]: unit["about"] for unit in units}
    names = {unit["number"]: unit["unit"] for unit in units}
    waiting: list[int] = [unit["number"] for unit in units]
    stage_of = {unit["number"]: unit["stage"] for unit in units}
    running: dict[Any, int] = {}
    costs: list[dict[str, Any]] = []
    most = workers or len(units)
    try:
        if monitor is not None:
            monitor.stage("units of work", len(units))
        while waiting or running:
            # A stage begins when all units of those before are done.
            begun = {stage_of[number] for number in running.values()}
            while waiting and len(running) < most and begun <= {stage_of[waiting[0]]}:
                begun.add(stage_of[waiting[0]])
                number = waiting.pop(0)
                named_task = task.options(name=f"unit {number}: {named[number]}")
                name = names[number]
                running[named_task.remote(plan.workflow, text, number, threads, name, storage_options, ending)] = number
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


def _check_begun(plan: Plan[Any], keys: dict[str, Any]) -> None:
    """Units go on with what is there: a work that begins anew must find nothing of its own."""
    if not keys["resume"] and _core.has_begun(plan.workflow, plan.to_json()):
        text = f"{keys['out']}: this work has begun already: choose a new folder (`out`), or go on with it by `resume`"
        raise PlanError(text)


def execute_on_ray(
    plan: Plan[_R],
    *,
    address: str | None,
    workers: int | None,
    threads: int,
    retries: int,
    storage_options: Mapping[str, Any] | None = None,
) -> _R:
    """Executes the units of a long work on Ray, and then collects the results from their folder.

    `units` of results that are no list has what each unit cost and where it worked.
    """
    costs = execute_units(
        plan, address=address, workers=workers, threads=threads, retries=retries, storage_options=storage_options
    )
    rest: Any = replace(_absolute(plan), threads=None, monitor=False, **{"resume": True})
    found: Results = execute_at(rest, storage_options) if is_address(rest.out) else execute(rest)
    if isinstance(found, Rows):
        return cast(_R, found)
    return cast(_R, plan.results({**found.to_dict(), "units": costs}))
