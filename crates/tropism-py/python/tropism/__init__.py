"""Steers living plants with light: the loop of Wahby et al. 2016, from Python.

Workflows take a plan and give results: `grow`, `run`, `track`, `fit`, `forecast`, `evolve`, `simulate`, `transfer`, `study`,
`sweep`, `score`, `report`. `tropism.neat` evolves networks for any fitness. `tropism.envs` has Gymnasium environments, which
are registered when `gymnasium` is imported. `tropism.loop` closes the loop with parts of your own.

Results on virtual plants are labelled `is_virtual`: they are no measurement of a living plant.
"""

from typing import TYPE_CHECKING

from tropism import _register
from tropism._core import Interrupted, Paused, PlanError, TropismError, __version__
from tropism.monitor import Monitor
from tropism.results import Results
from tropism.sweeps import sweep, sweep_units
from tropism.workflows import (
    PLANS,
    Plan,
    controller_of,
    evolve,
    execute,
    fit,
    forecast,
    grow,
    quick_study,
    report,
    resume,
    run,
    score,
    show,
    simulate,
    study,
    track,
    transfer,
    tune,
)

if TYPE_CHECKING:
    import tropism.envs as envs
    import tropism.loop as loop
    import tropism.neat as neat
    from tropism.runs import Run
    from tropism.tracks import Track

__all__ = [
    "PLANS",
    "Interrupted",
    "Monitor",
    "Paused",
    "Plan",
    "PlanError",
    "Results",
    "Run",
    "Track",
    "TropismError",
    "__version__",
    "controller_of",
    "envs",
    "evolve",
    "execute",
    "fit",
    "forecast",
    "grow",
    "loop",
    "neat",
    "quick_study",
    "report",
    "resume",
    "run",
    "score",
    "show",
    "simulate",
    "study",
    "sweep",
    "sweep_units",
    "track",
    "transfer",
    "tune",
]

_LAZY = {"Run": "runs", "Track": "tracks"}


def __getattr__(name: str) -> object:
    """Imports what needs numpy or Gymnasium when it is first asked for: `import tropism` stays quick."""
    from importlib import import_module

    if name in {"envs", "loop", "neat"}:
        return import_module(f"tropism.{name}")
    if name in _LAZY:
        return getattr(import_module(f"tropism.{_LAZY[name]}"), name)
    raise AttributeError(f"module 'tropism' has no attribute {name!r}")


_register.when_gymnasium_is_imported()
