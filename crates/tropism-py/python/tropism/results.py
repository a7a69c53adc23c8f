"""Results of workflows: the JSON that the command line prints with --json, with attributes and a table in notebooks."""

from __future__ import annotations

import html
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any


def _wrapped(value: Any) -> Any:
    if isinstance(value, dict):
        return Results(value)
    if isinstance(value, list):
        return [_wrapped(item) for item in value]
    return value


class Results(Mapping[str, Any]):
    """What a workflow found. Keys are attributes, too: `results.mean_fitness` is `results["mean_fitness"]`."""

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = dict(values)

    def __getitem__(self, key: str) -> Any:
        return _wrapped(self._values[key])

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self._values:
            keys = ", ".join(self.__dict__.get("_values", {}))
            raise AttributeError(f"found no {name!r} in these results, wanted one of {keys}")
        return self[name]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._values]

    def __repr__(self) -> str:
        return f"Results({json.dumps(self._values, indent=2)})"

    def to_dict(self) -> dict[str, Any]:
        """The plain data."""
        return dict(self._values)

    def figures(self) -> list[Path]:
        """The figures (SVG) beside a report, in order."""
        report = self._values.get("report")
        folder = self._values.get("_figures") or (Path(report).parent / "figures" if report else None)
        return sorted(Path(folder).glob("*.svg")) if folder else []

    def _repr_html_(self) -> str:
        rows = []
        for key, value in self._values.items():
            if key.startswith("_"):
                continue
            text = json.dumps(value)
            text = text if len(text) <= 300 else text[:300] + " …"
            rows.append(f"<tr><th style='text-align:left'>{html.escape(key)}</th><td>{html.escape(text)}</td></tr>")
        label = "<p><em>virtual plants</em></p>" if self._values.get("is_virtual") else ""
        figures = "".join(path.read_text(encoding="utf-8") for path in self.figures())
        return f"{label}<table>{''.join(rows)}</table>{figures}"
