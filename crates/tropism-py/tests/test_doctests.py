"""Each public function and class has an example, and all examples run."""

from __future__ import annotations

import doctest
import importlib
import inspect
import warnings
from pathlib import Path
from typing import Any

import pytest
import tropism

#: Packages that some examples need: they are skipped where one is missing.
PACKAGES = ("pandas", "polars", "pyarrow", "xarray", "gymnasium", "onnx", "networkx")
MODULES = (
    "edge",
    "errors",
    "loop",
    "models",
    "monitor",
    "neat",
    "plan",
    "plans",
    "results",
    "sweeps",
    "tracks",
    "workflows",
    "works",
    "_register",
)
#: Workflows that take longer than a second or two; a release runs them.
SLOW = {
    "acceptance",
    "export",
    "status",
    "calibrate",
    "forecast",
    "guide",
    "kinematics",
    "recovery",
    "study",
    "tune",
    "track",
    "timelapse",
}
#: What is a shape for subclasses, or is explained by the function that takes or returns it.
SHAPES = {
    "Camera", "Clock", "Edge", "Flash", "Lamps", "PlantModel", "Rig", "SideCamera", "Task", "Controller", "Champion", "Generation",
    "Species", "NetworkController", "Noise", "Observation", "Plant", "Genome", "Network", "Networks",
}  # fmt: skip


def public() -> list[tuple[str, Any]]:
    """The public functions and classes of the modules, but for plans and results, which are data."""
    found = {}
    for name in MODULES:
        module = importlib.import_module(f"tropism.{name}")
        for word, value in vars(module).items():
            is_own = getattr(value, "__module__", "") == module.__name__ and not word.startswith("_")
            if not is_own or not (inspect.isfunction(value) or inspect.isclass(value)):
                continue
            if (
                inspect.isclass(value)
                and word not in ("Plan", "Results")
                and issubclass(value, (tropism.Results, tropism.Plan))
            ):
                continue
            found[f"{name}.{word}"] = value
    return sorted(found.items())


def examples(name: str, value: Any) -> list[doctest.DocTest]:
    module = importlib.import_module(value.__module__)
    globals_ = {**vars(module), "tropism": tropism}
    return [test for test in doctest.DocTestFinder().find(value, name, module, globals_) if test.examples]


PUBLIC = public()


@pytest.mark.parametrize("name", [name for name, _ in PUBLIC])
def test_what_is_public_has_an_example(name: str) -> None:
    value = dict(PUBLIC)[name]
    word = name.split(".")[1]
    assert inspect.getdoc(value), name
    if word not in SHAPES and word != "of_call":
        assert examples(name, value), f"{name} has no example"


CASES = [
    pytest.param(name, marks=[pytest.mark.slow] if name.split(".")[1] in SLOW else [])
    for name, value in PUBLIC
    if examples(name, value)
]


@pytest.mark.parametrize("name", CASES)
def test_the_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = inspect.getsource(dict(PUBLIC)[name])
    for package in PACKAGES:
        if f"import {package}" in source or f"{package}." in source.replace("tropism.", ""):
            pytest.importorskip(package, reason=f"no {package}: the examples that need it are not run")
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(verbose=False, optionflags=doctest.ELLIPSIS)
    said: list[str] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for test in examples(name, dict(PUBLIC)[name]):
            runner.run(test, out=said.append, clear_globs=False)
    assert runner.summarize(verbose=False).failed == 0, "".join(said)
