"""Tracks as tables: numpy, pandas, polars and Arrow."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from tropism import _core

if TYPE_CHECKING:
    import numpy as np
    import pandas
    import polars
    import pyarrow
    from numpy.typing import NDArray


class Track:
    """The path of a tip over an experiment: a row a step. A track of N lights has N + 1 rows.

    Columns are those of the file, with the units in their names: step, time_s, tip_x_cm, tip_y_cm, light (lit from this row
    to the next), quality (measured, carried_forward, simulated), and further ones.
    """

    def __init__(self, track: _core.Track) -> None:
        self._track = track

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Track:
        """Reads a track file (CSV). Raises PlanError, which names the line and the column."""
        return cls(_core.Track.read(path))

    @classmethod
    def from_csv(cls, content: bytes) -> Track:
        """Reads the bytes of a track file."""
        return cls(_core.Track.from_csv(content))

    def to_csv(self) -> bytes:
        """The bytes of a track file."""
        return self._track.to_csv()

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes a track file (CSV)."""
        with open(path, "wb") as file:
            file.write(self.to_csv())

    def columns(self) -> dict[str, Any]:
        """All columns in the order of the file: arrays of numbers, lists of words."""
        return self._track.columns()

    @property
    def tips(self) -> NDArray[np.float64]:
        """The tips, in cm: (rows, 2)."""
        import numpy as np

        columns = self._track.columns()
        return np.column_stack([columns["tip_x_cm"], columns["tip_y_cm"]])

    @property
    def stems(self) -> NDArray[np.float64]:
        """The stems, ten points each from the base up, in cm: (rows, 10, 2), NaN where none was seen."""
        return self._track.stems()

    @property
    def period_min(self) -> float:
        """Minutes between two steps."""
        return self._track.period_min

    @property
    def lamps(self) -> list[str]:
        """Names of the lamps."""
        return self._track.lamps

    def fitness(self, task: Mapping[str, Any] | None = None) -> float:
        """The fitness for a task, in cm: eq. (9) for the paper's three targets if none is given."""
        return self._track.fitness(json.dumps(dict(task or {})))

    def to_pandas(self) -> pandas.DataFrame:
        """The columns as a pandas frame."""
        import pandas

        return pandas.DataFrame(self.columns())

    def to_polars(self) -> polars.DataFrame:
        """The columns as a polars frame."""
        import polars

        return polars.DataFrame(self.columns())

    def to_arrow(self) -> pyarrow.Table:
        """The columns as an Arrow table; period and lamps are its metadata."""
        import pyarrow

        metadata = {"tropism.period_min": str(self.period_min), "tropism.lamps": ",".join(self.lamps)}
        return pyarrow.table(self.columns(), metadata=metadata)

    def to_parquet(self, path: str | os.PathLike[str]) -> None:
        """Writes the Arrow table as a Parquet file."""
        from pyarrow import parquet

        parquet.write_table(self.to_arrow(), path)

    def __len__(self) -> int:
        return len(self._track)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Track) and self._track == other._track

    def __repr__(self) -> str:
        return f"Track({len(self)} rows, a step every {self.period_min:g} min, lamps {', '.join(self.lamps)})"
