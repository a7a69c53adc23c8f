"""Steers living plants with light: the loop of Wahby et al. 2016, from Python.

    import tropism

    tropism.grow(plants=6, out="beans")                         # tracks of virtual beans
    tropism.fit("beans", out="model.json")                      # a model of how they move
    tropism.evolve("model.json", out="runs")                    # controllers
    tropism.transfer(["greedy", "runs/champion.json"], out="transfer")

| what | where |
|---|---|
| workflows: a function each, which takes what the command takes, and objects | `grow`, `track`, `fit`, `evolve`, `transfer`, ... |
| tables of tips; models of plants | `Track`, `Model` |
| NEAT for any fitness | `tropism.neat` |
| the loop with parts of your own | `tropism.loop` |
| Gymnasium; Stable-Baselines3; PettingZoo | `tropism.envs`, `tropism.sb3`, `tropism.wall_v0` |

A path is a `str` or a `os.PathLike`, a controller is "greedy", "periodic", a file, a genome or data, a task is a file or data.
Results on virtual plants are labelled `is_virtual`: they are no measurement of a living plant.
"""

from typing import TYPE_CHECKING

from tropism import _register
from tropism._core import __version__
from tropism._register import register_envs
from tropism.errors import Interrupted, MissingFileError, Paused, PlanError, TropismError, WrongTypeError
from tropism.monitor import Monitor
from tropism.plan import Plan, execute
from tropism.plans import (
    acceptance,
    baseline,
    calibrate,
    calibrate_camera,
    check,
    depth,
    evolve,
    export,
    fit,
    forecast,
    grow,
    guide,
    kinematics,
    make_rig,
    measure,
    note,
    recovery,
    replicates,
    report,
    run,
    safe_state,
    score,
    show,
    simulate,
    status,
    stop,
    study,
    timelapse,
    track,
    transfer,
    tune,
    wall,
    wall_study,
)
from tropism.results import Results
from tropism.sweeps import sweep
from tropism.workflows import PLANS, controller_of, quick_study, resume
from tropism.works import execute_unit, on_ray, units

if TYPE_CHECKING:
    import tropism.envs as envs
    import tropism.loop as loop
    import tropism.neat as neat
    import tropism.sb3 as sb3
    import tropism.wall_v0 as wall_v0
    from tropism.models import Model
    from tropism.runs import Run
    from tropism.tracks import Track

__all__ = [
    "Interrupted",
    "MissingFileError",
    "Model",
    "Monitor",
    "PLANS",
    "Paused",
    "Plan",
    "PlanError",
    "Results",
    "Run",
    "Track",
    "TropismError",
    "WrongTypeError",
    "__version__",
    "acceptance",
    "baseline",
    "calibrate",
    "calibrate_camera",
    "check",
    "controller_of",
    "depth",
    "envs",
    "evolve",
    "execute",
    "execute_unit",
    "export",
    "fit",
    "forecast",
    "grow",
    "guide",
    "kinematics",
    "loop",
    "make_rig",
    "measure",
    "neat",
    "note",
    "on_ray",
    "quick_study",
    "recovery",
    "register_envs",
    "replicates",
    "report",
    "resume",
    "run",
    "safe_state",
    "sb3",
    "score",
    "show",
    "simulate",
    "status",
    "stop",
    "study",
    "sweep",
    "timelapse",
    "track",
    "transfer",
    "tune",
    "units",
    "wall",
    "wall_study",
    "wall_v0",
]

_LAZY = {"Model": "models", "Run": "runs", "Track": "tracks"}


def __getattr__(name: str) -> object:
    """Imports what needs numpy or Gymnasium when it is first asked for: `import tropism` stays quick."""
    from importlib import import_module

    if name in {"envs", "loop", "neat", "sb3", "wall_v0"}:
        return import_module(f"tropism.{name}")
    if name in _LAZY:
        return getattr(import_module(f"tropism.{_LAZY[name]}"), name)
    raise AttributeError(f"module 'tropism' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


_register.where_gymnasium_is()
