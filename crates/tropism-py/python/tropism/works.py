"""Long work by its units: listed, one by one, or on the machines of a Ray cluster.

Evolutions, sweeps, studies, comparisons of controllers and methods, forecasts, calibrations and baselines consist of units,
which any number of programs may execute in the folder of the work. All come to the same bits.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TypeVar

from tropism import _core
from tropism.monitor import Progress
from tropism.plan import Plan
from tropism.results import Results

_R = TypeVar("_R", bound=Results)


def units(plan: Plan[Any]) -> list[dict[str, Any]]:
    """The units of a long work, in order: `number`, `stage`, `unit` (its name), `about` and `is_done` of each.

    >>> import tropism
    >>> plan = tropism.plans.TransferPlan(controllers=["greedy", "periodic"], plants=3, out="compared")
    >>> [unit["unit"] for unit in tropism.units(plan)][:2]
    ['greedy/plant-0001', 'greedy/plant-0002']
    """
    found: list[dict[str, Any]] = json.loads(_core.work_units(plan.workflow, plan.to_json()))
    return found


def execute_unit(plan: Plan[Any], unit: int) -> dict[str, Any]:
    """Executes unit `unit`, from 1, of a long work alone: others may be at work in its folder at the same time.

    The units of stages before its own must be done. When all are, `execute` with `resume=True` collects the results.

    >>> import tropism
    >>> plan = tropism.plans.TransferPlan(controllers=["greedy"], plants=2, task={"max_steps": 20}, out="alone", monitor=False)
    >>> done = tropism.execute_unit(plan, 2)
    >>> done["unit"], done["total"]
    ('greedy/plant-0002', 2)
    """
    progress = Progress(plan.workflow) if plan.monitor is None else None
    listener = progress if progress is not None else plan.monitor or None
    try:
        text = _core.execute_unit(plan.workflow, plan.to_json(), unit, listener, plan.threads)
    finally:
        if progress is not None:
            progress.close()
    found: dict[str, Any] = json.loads(text)
    return found


def on_ray(
    plan: Plan[_R],
    *,
    address: str | None = None,
    workers: int | None = None,
    threads: int = 1,
    retries: int = 3,
    storage_options: Mapping[str, Any] | None = None,
) -> _R:
    """Executes the units of a long work as tasks of a Ray cluster, and then collects the results.

    Parameters
    ----------
    plan : Plan
        Its folder (`out`) is one that all machines share; that of a sweep may be an fsspec address.
    address : str, default None
        Address of the cluster; None starts one on this machine.
    workers : int, default None
        Units that work at once, at most.
    threads : int, default 1
        Threads of each unit.
    retries : int, default 3
        How often a unit whose worker was lost is executed again; an evolution goes on from its last checkpoint.
    storage_options : Mapping, default None
        Those of the address's file system.

    Examples
    --------
    >>> import tropism
    >>> tropism.on_ray(tropism.plans.TunePlan())  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.PlanError: found "tune", wanted a long work: one of baseline, calibrate, evolve, forecast
    """
    # Says what is no long work before Ray is looked for.
    _core.has_begun(plan.workflow, plan.to_json())
    from tropism.ray_engine import execute_on_ray

    return execute_on_ray(
        plan,
        address=address,
        workers=workers,
        threads=threads,
        retries=retries,
        storage_options=storage_options,
    )
