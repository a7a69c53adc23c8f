"""Workflows by their folders and files: what is resumed, and what settings files hold."""

from __future__ import annotations

import json
from typing import Any, Literal

from tropism import _core, plans
from tropism.edge import AnyController, PathLike, controller, path
from tropism.errors import TropismError, of_call
from tropism.monitor import Monitor
from tropism.plan import Plan, execute
from tropism.results import Results

#: The plan of each workflow.
PLANS: dict[str, type[Plan[Any]]] = {
    plan.workflow: plan
    for plan in vars(plans).values()
    if isinstance(plan, type) and issubclass(plan, Plan) and plan.workflow
}


def resume(
    folder: PathLike,
    workflow: str,
    *,
    monitor: Monitor | Literal[False] | None = None,
    threads: int | None = None,
) -> Results:
    """Goes on with the work in `folder`, from this folder alone: a "run", or a long work such as "evolve", "study", "sweep",
    "transfer", "replicates", "forecast", "calibrate" or "baseline".

    >>> import tropism
    >>> tropism.resume("nothing", "run")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    tropism.errors.MissingFileError: nothing/run.toml: cannot read: No such file or directory
    """
    try:
        found = json.loads(_core.plan_of_folder(workflow, path(folder, "folder")))
    except TropismError as error:
        raise of_call(error, "resume") from None
    plan: Plan[Any] = PLANS[workflow](**found, monitor=monitor, threads=threads)
    results: Results = execute(plan)
    return results


def quick_study() -> dict[str, Any]:
    """The settings of a study of about a minute: `tropism.study(tropism.quick_study())`.

    >>> import tropism
    >>> "evolution" in tropism.quick_study()
    True
    """
    config: dict[str, Any] = json.loads(_core.quick_study())
    return config


def controller_of(source: AnyController) -> dict[str, Any]:
    """A controller as data: of a champion or rule file, of a word ("greedy", "periodic"), or of a genome.

    >>> import tropism
    >>> tropism.controller_of("greedy")
    {'kind': 'greedy'}
    """
    return controller(source)
