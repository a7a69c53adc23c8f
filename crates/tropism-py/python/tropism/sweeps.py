"""Sweeps: seeds times settings, on this machine or on the machines of a Ray cluster."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

from tropism import _core
from tropism.edge import PathLike, settings
from tropism.errors import PlanError
from tropism.monitor import Monitor
from tropism.plan import execute
from tropism.plans import SweepPlan
from tropism.results import SweepResults


def sweep(
    plan: SweepPlan | Mapping[str, Any] | PathLike,
    grid: Mapping[str, Any] | None = None,
    *,
    engine: Literal["local", "ray"] = "local",
    model: PathLike | None = None,
    out: PathLike | None = None,
    resume: bool | None = None,
    address: str | None = None,
    workers: int | None = None,
    threads: int | None = None,
    retries: int = 3,
    storage_options: Mapping[str, Any] | None = None,
    monitor: Monitor | Literal[False] | None = None,
) -> SweepResults:
    """Executes a sweep: seeds times settings, one unit of work each, and one table.

    `plan` is a SweepPlan, the settings of a sweep file as a mapping, or the path of such a file. `grid` and `model` replace those
    of the plan. The units' results are the same bits with any engine, number of workers and order.

    `engine="ray"` executes each unit as a task of a Ray cluster (`address`; None starts one on this machine). `out` must then
    be a folder that all machines share, or an fsspec address such as "s3://bucket/sweep", for units save checkpoints there: a
    unit whose worker is lost goes on from its last checkpoint, `retries` times at most. `storage_options` are those of the
    address's file system. `workers` bounds the units that work at once, `threads` the threads of each (1 by
    default with Ray).

    >>> import tropism
    >>> tropism.sweep({"nonsense": 1})  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.PlanError: sweep: config.nonsense: unknown key
    """
    chosen = as_plan(plan)
    config = settings(chosen.config)
    if grid is not None:
        config["grid"] = dict(grid)
    if model is not None:
        config["model"] = os.path.abspath(os.fspath(model))
    chosen = replace(chosen, config=config)
    if monitor is not None:
        chosen = replace(chosen, monitor=monitor)
    if threads is not None:
        chosen = replace(chosen, threads=threads)
    if out is not None:
        chosen = replace(chosen, out=out)
    if resume is not None:
        chosen = replace(chosen, resume=resume)
    if engine == "local":
        from tropism.storage import execute_at, is_address

        return execute_at(chosen, storage_options) if is_address(chosen.out) else execute(chosen)
    if engine != "ray":
        raise PlanError(f"found engine {engine!r}, wanted local or ray")
    from tropism.works import on_ray

    return on_ray(
        chosen,
        address=address,
        workers=workers,
        threads=chosen.threads or 1,
        retries=retries,
        storage_options=storage_options,
    )


def as_plan(plan: SweepPlan | Mapping[str, Any] | PathLike) -> SweepPlan:
    """The plan of a sweep: as it is, of the settings of a sweep file, or of the file at a path.

    >>> as_plan({"seeds": 3}).config
    {'seeds': 3}
    """
    if isinstance(plan, SweepPlan):
        return plan
    if isinstance(plan, Mapping):
        return SweepPlan(config=plan)
    folder = os.path.dirname(os.path.abspath(os.fspath(plan)))
    return SweepPlan(config=json.loads(_core.read_sweep(plan)), folder=folder)
