"""Run folders: the photographs of an experiment in order, with what was seen and decided."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tropism import _core
from tropism.errors import MissingFileError
from tropism.tracks import Track

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Photograph:
    """A photograph of a run. `light` is the lamp lit after it, None where the run ended or missed the step."""

    step: int
    path: Path
    tip: tuple[float, float] | None
    light: str | None
    quality: str | None

    def bytes(self) -> bytes:
        """The bytes of the file; none if the camera gave no photograph."""
        return self.path.read_bytes()

    def pixels(self) -> NDArray[np.uint8]:
        """The picture, upright: (height, width, 3). Raises PlanError if the file is no whole picture."""
        return _core.decode(self.bytes())


class Run:
    """A run folder, from `tropism.run` or `tropism.grow(photographs=True)`: an iterable of its photographs."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        if not (self.folder / "run.toml").exists():
            raise MissingFileError(f"{self.folder}: this is no run folder: it has no run.toml")

    @property
    def track(self) -> Track:
        """The track of the run."""
        return Track.read(self.folder / "track.csv")

    def photographs(self) -> list[Path]:
        """The files in the order of the steps."""
        return sorted((self.folder / "photographs").glob("*.jpg"))

    def __len__(self) -> int:
        return len(self.photographs())

    def __iter__(self) -> Iterator[Photograph]:
        columns = self.track.columns()
        rows: dict[int, Any] = {int(step): row for row, step in enumerate(columns["step"])}
        for path in self.photographs():
            step = int(path.stem)
            row = rows.get(step)
            if row is None:
                yield Photograph(step, path, None, None, None)
                continue
            tip = float(columns["tip_x_cm"][row]), float(columns["tip_y_cm"][row])
            light = columns["light"][row]
            yield Photograph(step, path, tip, None if light == "dark" else light, columns["quality"][row])
