"""The edge of the package: what users hand over becomes the JSON and the files that workflows take. One function a kind of thing.

A path is a `str` or any `os.PathLike`. Objects that a workflow reads as files (tracks, models, genomes) are written into a folder
that lives as long as the call.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeAlias, Union

from tropism import _core
from tropism.errors import PlanError, WrongTypeError

if TYPE_CHECKING:
    import tempfile

    from tropism.models import Model
    from tropism.neat import Champion

#: A file or a folder.
PathLike: TypeAlias = "str | os.PathLike[str]"
#: Settings by key, as in a TOML file.
Settings: TypeAlias = Mapping[str, Any]
#: Settings by key, or the TOML file that holds them.
AnySettings: TypeAlias = "Settings | PathLike"
#: "greedy", "periodic", a champion or rule file, a genome or champion, or a controller as data, such as
#: {"kind": "periodic", "minutes": 180}.
AnyController: TypeAlias = Union["Settings", "PathLike", "_core.Genome", "Champion"]
#: A task as data, such as {"kind": "targets", "targets": [[3, 6]]}; a task file, or a champion, rule or run folder with a task.
AnyTask: TypeAlias = "Settings | PathLike"
#: A `Model`, or a model file.
AnyModel: TypeAlias = Union["Model", "PathLike"]
#: A `Track`, a frame of pandas or polars, an Arrow table, a track file, or a folder of them.
AnyTrack: TypeAlias = Any
#: A genome, a champion, or a file of either.
AnyNetwork: TypeAlias = Union["_core.Genome", "Champion", "PathLike"]

#: Controllers that a word names.
WORDS: Mapping[str, Settings] = {
    "greedy": {"kind": "greedy"},
    "periodic": {"kind": "periodic", "minutes": 360.0},
}


def is_path(value: object) -> bool:
    """Whether a value is a `str` or an `os.PathLike`.

    >>> is_path("beans"), is_path(3)
    (True, False)
    """
    return isinstance(value, (str, os.PathLike))


def kind_of(value: object) -> str:
    """The type of a value, as messages name it.

    >>> kind_of(3)
    'int'
    """
    return type(value).__name__


def plain(value: Any, place: str = "") -> Any:
    """`value` as JSON knows it: of arrays and numbers of numpy, of paths, ranges, mappings and sequences.

    >>> from pathlib import Path
    >>> plain({"out": Path("beans"), "plants": range(2), "point": (1, 2.5)})
    {'out': 'beans', 'plants': [0, 1], 'point': [1, 2.5]}
    """
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        if not math.isfinite(value):
            raise PlanError(f"{place or 'value'}: found {value}, wanted a finite number")
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item, f"{place}.{key}" if place else str(key)) for key, item in value.items()}
    if isinstance(value, (list, tuple, range)):
        return [plain(item, f"{place}[{number}]") for number, item in enumerate(value)]
    if hasattr(value, "tolist"):
        return plain(value.tolist(), place)
    raise WrongTypeError(
        f"{place or 'value'}: found {kind_of(value)}, wanted data such as numbers, words, lists and dicts"
    )


def path(value: Any, place: str = "path") -> str:
    """A path as a word.

    >>> from pathlib import Path
    >>> path(Path("beans"))
    'beans'
    """
    if is_path(value):
        return str(os.fspath(value))
    raise WrongTypeError(f"{place}: found {kind_of(value)}, wanted a path: str or os.PathLike")


def settings(value: Any, place: str = "settings") -> dict[str, Any]:
    """Settings of a mapping or of a TOML file.

    >>> settings({"plants": 3})
    {'plants': 3}
    """
    if value is None:
        return {}
    if is_path(value):
        found: dict[str, Any] = json.loads(_core.read_settings(path(value)))
        return found
    if hasattr(value, "to_dict"):
        value = value.to_dict()
    if isinstance(value, Mapping):
        found = plain(value, place)
        return found
    raise WrongTypeError(f"{place}: found {kind_of(value)}, wanted a dict or the path of a TOML file")


def run_config(value: Any, place: str = "config") -> dict[str, Any]:
    """The settings of a run: keys that are left out are those of a run in the virtual tent.

    >>> run_config({"task": {"max_steps": 3}})["task"]
    {'max_steps': 3}
    """
    given = settings(value, place)
    if "schema" in given:
        return given
    config: dict[str, Any] = json.loads(_core.complete_plan("run"))["config"]
    unknown = [key for key in given if key not in config]
    if unknown:
        raise PlanError(f"{place}: unknown key {unknown[0]!r}, wanted one of {', '.join(config)}")
    for key, role in (("task", task), ("controller", controller)):
        if key in given:
            given[key] = role(value[key] if isinstance(value, Mapping) else given[key], f"{place}.{key}")
    if "controller" in given and "task" not in given:
        given["task"] = task_for(given["controller"])
    return {**config, **given}


def task_for(controller: Settings) -> dict[str, Any]:
    """The task for a controller where none is named: the one that it was made for, an open-loop experiment, or the paper's.

    >>> task_for({"kind": "greedy"})["targets"]
    [[3.0, 6.0], [-5.0, 9.0], [-1.0, 13.5]]
    """
    found: dict[str, Any] = json.loads(_core.default_task(json.dumps(controller)))
    return found


def task(value: Any, place: str = "task") -> dict[str, Any]:
    """A task as data: of a mapping, a task file, a champion or rule file, or a run folder.

    >>> task({"targets": [(3, 6)]})
    {'targets': [[3, 6]]}
    """
    if value is not None and is_path(value):
        found: dict[str, Any] = json.loads(_core.read_task(path(value)))
        return found
    if isinstance(value, Mapping) or value is None or hasattr(value, "to_dict"):
        return settings(value, place)
    raise WrongTypeError(f"{place}: found {kind_of(value)}, wanted a dict or the path of a task file")


def controller(value: Any, place: str = "controller") -> dict[str, Any]:
    """A controller as data: of a word, a file, a genome, a champion, or a mapping.

    >>> controller("greedy")
    {'kind': 'greedy'}
    """
    if isinstance(value, str) and value in WORDS:
        return dict(WORDS[value])
    genome = getattr(value, "genome", value)
    if isinstance(genome, _core.Genome):
        of_genome: dict[str, Any] = json.loads(_core.champion_of(genome))
        return of_genome
    if is_path(value):
        name = path(value)
        if not os.path.exists(name) and os.sep not in name and "." not in name:
            words = ", ".join(f'"{word}"' for word in WORDS)
            raise PlanError(f"{place}: found {name!r}, wanted {words}, or a file of a champion or a rule")
        of_file: dict[str, Any] = json.loads(_core.read_controller(name))
        return of_file
    if isinstance(value, Mapping):
        return settings(value, place)
    raise WrongTypeError(
        f"{place}: found {kind_of(value)}, wanted a word, a file, a genome or a dict; "
        "a controller written in Python steers in tropism.loop"
    )


def controllers(value: Any, place: str = "controllers") -> list[dict[str, Any]]:
    """Named controllers: of a list of controllers, or of a mapping from names to them.

    >>> controllers(["greedy"])
    [{'name': 'greedy', 'controller': {'kind': 'greedy'}}]
    >>> controllers({"slow": {"kind": "periodic", "minutes": 720}})[0]["name"]
    'slow'
    """
    if isinstance(value, Mapping):
        pairs = list(value.items())
    elif isinstance(value, Iterable) and not is_path(value):
        pairs = [_named(item, number) for number, item in enumerate(value, 1)]
    else:
        pairs = [_named(value, 1)]
    return [{"name": name, "controller": controller(item, f"{place}: {name}")} for name, item in pairs]


def _named(value: Any, number: int) -> tuple[str, Any]:
    """A controller with the name that it brings, else that of its file or its kind."""
    if isinstance(value, Mapping):
        if set(value) == {"name", "controller"}:
            return str(value["name"]), value["controller"]
        return str(value.get("kind", f"controller-{number}")), value
    if is_path(value):
        return (value if value in WORDS else Path(value).stem), value
    return f"network-{number}", value


def species(value: Any, place: str = "species") -> dict[str, Any]:
    """The plants of a bean file, or of a mapping.

    >>> species({})
    {}
    """
    if value is not None and is_path(value):
        found: dict[str, Any] = json.loads(_core.read_species(path(value)))
        return found
    return settings(value, place)


def greenhouse(value: Any, place: str = "greenhouse") -> dict[str, Any]:
    """The virtual tent. Its `bean` may be a bean file.

    >>> greenhouse({"variation": 0.5})
    {'variation': 0.5}
    """
    if isinstance(value, Mapping) and is_path(value.get("bean")):
        value = {**value, "bean": species(value["bean"], f"{place}.bean")}
    return settings(value, place)


class Edge:
    """Converts the values of one call. In-memory tracks, models and genomes become files, which are deleted at its end."""

    def __init__(self) -> None:
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._count = 0

    def __enter__(self) -> Edge:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._folder is not None:
            self._folder.cleanup()

    def _file(self, name: str, ending: str) -> str:
        if self._folder is None:
            import tempfile

            self._folder = tempfile.TemporaryDirectory(prefix="tropism-")
        self._count += 1
        return os.path.join(self._folder.name, f"{name}-{self._count}{ending}")

    def converted(self, role: str, value: Any, place: str) -> Any:
        """`value` as the JSON of a plan, by the role of its key."""
        convert = getattr(self, f"_{role}", None)
        if convert is not None:
            return convert(value, place)
        return globals()[role](value, place)

    def _paths(self, value: Any, place: str) -> list[str]:
        return [path(item, place) for item in _several(value)]

    def _tracks(self, value: Any, place: str) -> list[str]:
        return [self._track(item, place) for item in _several(value)]

    def _track(self, value: Any, place: str) -> str:
        if is_path(value):
            return path(value, place)
        from tropism.tracks import Track

        file = self._file("track", ".csv")
        Track.of(value).write(file)
        return file

    def _model(self, value: Any, place: str) -> str:
        if is_path(value):
            return path(value, place)
        text = getattr(value, "to_json", None)
        if text is None or not hasattr(value, "kind"):
            raise WrongTypeError(f"{place}: found {kind_of(value)}, wanted a Model or the path of a model file")
        return self._written("model", text())

    def _models(self, value: Any, place: str) -> list[str]:
        several = _several(value)
        return [item if item in ("tip", "stem", "space") else self._model(item, place) for item in several]

    def _network(self, value: Any, place: str) -> str:
        genome = getattr(value, "genome", value)
        if isinstance(genome, _core.Genome):
            return self._written("genome", genome.to_json())
        return path(value, place)

    def _written(self, name: str, text: str) -> str:
        file = self._file(name, ".json")
        Path(file).write_text(text, encoding="utf-8")
        return file


def _several(value: Any) -> Sequence[Any]:
    """A list of things as it is, one thing as a list of one."""
    from tropism.tracks import Track, is_frame

    if is_path(value) or isinstance(value, (Track, _core.Track)) or is_frame(value) or hasattr(value, "to_json"):
        return [value]
    if isinstance(value, Iterable):
        return list(value)
    raise WrongTypeError(f"found {kind_of(value)}, wanted one thing or a list of them")
