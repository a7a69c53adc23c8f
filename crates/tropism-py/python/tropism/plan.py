"""Plans: what a workflow is to do, as data, and how it is executed."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Generic, Literal, TypeVar, cast

from tropism import _core
from tropism.edge import Edge, plain, task_for
from tropism.errors import TropismError, of_call
from tropism.monitor import Monitor, Progress
from tropism.results import Results

_R = TypeVar("_R", bound=Results)


@dataclass(frozen=True, kw_only=True, repr=False, eq=False)
class Plan(Generic[_R]):
    """A plan of a workflow. Keys that are None are the workflow's own defaults, which `complete` shows.

    `monitor` and `threads` change no result and are no part of the plan's JSON.

    >>> import tropism
    >>> plan = tropism.plans.GrowPlan(plants=3, seed=2)
    >>> plan.to_dict()
    {'plants': 3, 'seed': 2}
    >>> plan.complete()["period_min"]
    5.0
    """

    workflow: ClassVar[str] = ""
    #: The type of its results.
    results: ClassVar[type[Results]] = Results
    #: How values of keys are converted: names of functions of `tropism.edge`.
    roles: ClassVar[Mapping[str, str]] = {}
    monitor: Monitor | Literal[False] | None = None
    threads: int | None = None

    # Methods of the base serve all plans: those that `dataclass` writes for each take most of the time of the import.
    def _key(self) -> tuple[Any, ...]:
        return tuple((name, value) for name, value in vars(self).items() if name not in ("monitor", "threads"))

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and isinstance(other, Plan) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in self._key() if value is not None)
        return f"{type(self).__name__}({values})"

    def _values(self, edge: Edge) -> dict[str, Any]:
        names = [field.name for field in fields(self) if field.name not in ("monitor", "threads")]
        values = {}
        for name in names:
            # Keys that are keywords of Python end in an underscore.
            key, value = name.rstrip("_"), getattr(self, name)
            if value is None:
                continue
            role = self.roles.get(key)
            if isinstance(value, range) and value.step == 1:
                value = {"start": value.start, "end": value.stop}
            values[key] = plain(value, key) if role is None else edge.converted(role, value, key)
        if self.workflow == "grow" and "controller" in values and "task" not in values:
            values["task"] = task_for(values["controller"])
        return values

    def to_dict(self) -> dict[str, Any]:
        """The keys that are set, as JSON knows them. Tracks and models that are no files yet cannot be in it."""
        return self._values(_NoFiles())

    def to_json(self) -> str:
        """The plan as JSON: what a page and the command line exchange."""
        return json.dumps(self.to_dict())

    def complete(self) -> dict[str, Any]:
        """All keys with their values, defaults included.

        Raises PlanError if a key is unknown or a value has the wrong type.
        """
        complete: dict[str, Any] = json.loads(_core.complete_plan(self.workflow, self.to_json()))
        return complete

    def check(self) -> None:
        """Raises PlanError, which names the key, if the plan cannot be executed."""
        _core.check_plan(self.workflow, self.to_json())


class _NoFiles(Edge):
    """Refuses what would have to be written into a file."""

    def _file(self, name: str, ending: str) -> str:
        raise TropismError(f"a plan as data holds files: write the {name} first, and give its path")


def execute(plan: Plan[_R]) -> _R:
    """Executes a plan.

    Raises PlanError if the plan cannot be executed, TropismError if it fails, Paused if a run needs its user, and Interrupted
    after Ctrl-C.

    >>> import tropism
    >>> task = {"kind": "open_loop", "max_steps": 10}
    >>> tropism.execute(tropism.plans.GrowPlan(plants=1, task=task, out="beans")).plants
    1
    """
    monitor = plan.monitor
    progress = Progress(plan.workflow) if monitor is None else None
    listener = progress if progress is not None else monitor or None
    try:
        with Edge() as edge:
            text = json.dumps(plan._values(edge))
            found = _core.execute_workflow(plan.workflow, text, listener, plan.threads)
    except TropismError as error:
        raise of_call(error, plan.workflow) from None
    finally:
        if progress is not None:
            progress.close()
    results = plan.results.of_json(json.loads(found))
    figures = getattr(plan, "figures", None)
    if figures is not None:
        results = plan.results({**results.to_dict(), "_figures": os.fspath(figures)})
    return cast(_R, results)
