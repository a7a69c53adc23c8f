"""Tracks as tables: numpy, pandas, polars, Arrow, Parquet and xarray."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, overload

from tropism import _core
from tropism.edge import is_path, kind_of, path, task
from tropism.errors import PlanError, WrongTypeError

if TYPE_CHECKING:
    import numpy as np
    import pandas
    import polars
    import pyarrow
    import xarray
    from numpy.typing import NDArray

_REQUIRED = ("step", "time_s", "tip_x_cm", "tip_y_cm", "light", "quality")
_QUALITIES = ("measured", "carried_forward", "simulated")


class Row(NamedTuple):
    """A step of a track.

    >>> import tropism
    >>> track = tropism.Track.from_arrays([[0, 4], [0.1, 4.1]], ["left", "dark"])
    >>> track[0].light
    'left'
    """

    #: Number of the step, from 0.
    step: int
    #: Seconds since the start.
    time_s: float
    #: Tip, in cm: to the right, and up from the soil.
    x_cm: float
    y_cm: float
    #: Name of the lamp that is lit until the next row, or dark.
    light: str
    #: measured, carried_forward (from an earlier photograph) or simulated.
    quality: str


def is_frame(value: object) -> bool:
    """Whether a value is a table of pandas, polars or Arrow.

    >>> is_frame([1, 2])
    False
    """
    module = type(value).__module__.split(".")[0]
    return module in ("pandas", "polars", "pyarrow") and hasattr(value, "columns")


def lamp_numbers(lights: Iterable[Any], names: Sequence[str]) -> list[int]:
    """The numbers of lamps that are given by number or name.

    >>> lamp_numbers(["left", 1], ["left", "right"])
    [0, 1]
    """
    if isinstance(lights, str):
        raise WrongTypeError(f"lights: found the word {lights!r}, wanted a list with the lamp of each step")
    numbers = []
    for place, light in enumerate(lights):
        if isinstance(light, str):
            if light not in names:
                raise PlanError(f"lights[{place}]: found {light!r}, wanted one of {', '.join(names)}")
            numbers.append(names.index(light))
            continue
        try:
            numbers.append(int(light.__index__()))
        except AttributeError as error:
            text = f"lights[{place}]: found {kind_of(light)}, wanted the number or the name of a lamp"
            raise WrongTypeError(text) from error
    return numbers


class Track:
    """The path of a tip over an experiment: a row a step. A track of N lights has N + 1 rows.

    Columns are those of the file, with the units in their names: step, time_s, tip_x_cm, tip_y_cm, light (lit from this row
    to the next), quality (measured, carried_forward, simulated), and further ones. It does not change; copies and pickles have
    the same bits.

    >>> import tropism
    >>> track, fitness = tropism.loop.grow("greedy", {"max_steps": 20})
    >>> track
    Track(21 rows, a step every 5 min, lamps left, right)
    >>> track["tip_x_cm"].shape, len(track[5:]), track[-1].quality
    ((21,), 16, 'simulated')
    """

    def __init__(self, track: _core.Track) -> None:
        if not isinstance(track, _core.Track):
            wanted = "Track.read(path), Track.from_arrays(tips, lights) or Track.from_pandas(frame)"
            raise WrongTypeError(f"Track: found {kind_of(track)}, wanted {wanted}")
        self._track = track

    @classmethod
    def of(cls, value: Any) -> Track:
        """A track as it is, of a frame of pandas or polars, of an Arrow table, or of a track file (CSV or Parquet).

        >>> import tropism
        >>> track = tropism.Track.from_arrays([[0, 4], [0, 5]], ["left", "dark"])
        >>> tropism.Track.of(track.to_pandas()) == track
        True
        """
        if isinstance(value, Track):
            return value
        if isinstance(value, _core.Track):
            return cls(value)
        if is_path(value):
            return cls.read_parquet(value) if str(os.fspath(value)).endswith(".parquet") else cls.read(value)
        if is_frame(value):
            return cls._of_frame(value)
        raise WrongTypeError(f"track: found {kind_of(value)}, wanted a Track, a frame, or the path of a track file")

    @classmethod
    def read(cls, file: str | os.PathLike[str]) -> Track:
        """Reads a track file (CSV). Raises PlanError, which names the line and the column."""
        return cls(_core.Track.read(path(file, "track")))

    @classmethod
    def from_csv(cls, content: bytes) -> Track:
        """Reads the bytes of a track file.

        >>> import tropism
        >>> len(tropism.Track.from_csv(b"tip_x_cm,tip_y_cm,light\\n0,4,left\\n0.1,4.1,dark\\n"))
        2
        """
        return cls(_core.Track.from_csv(content))

    @classmethod
    def from_arrays(
        cls,
        tips: Any,
        lights: Iterable[Any] | None = None,
        *,
        period_min: float = 5.0,
        step: Any = None,
        time_s: Any = None,
        quality: str | Iterable[str] = "measured",
        stems: Any = None,
        lamps: Sequence[Mapping[str, Any]] | None = None,
        columns: Mapping[str, Any] | None = None,
    ) -> Track:
        """A track of arrays.

        Parameters
        ----------
        tips : array (rows, 2)
            Places of the tip, in cm: x to the right, y up from the soil.
        lights : list of str, int or None
            The lamp that is lit from each row to the next, by name or number; None or "dark" is dark. One less than the rows is
            enough, for in the last row nothing is lit. None: dark throughout.
        period_min : float, default 5.0
            Minutes between two steps.
        step, time_s : arrays (rows,)
            Numbers of the steps, by default from 0; and seconds since the start, by default of the steps.
        quality : str or list of str, default "measured"
            measured, carried_forward or simulated, for all rows or for each.
        stems : array (rows, points, 2), resampled to ten points
            Points of the stem from the base up, in cm; NaN where none was seen.
        lamps : list of dict
            Name and place (`at`: x, y, z in cm) of each lamp; by default the paper's two, or four where front or back is lit.
        columns : dict
            Further columns: numbers or words, a value a row.

        Examples
        --------
        >>> import tropism
        >>> track = tropism.Track.from_arrays([[0, 4], [0.1, 4.1], [0.2, 4.2]], ["left", "right"])
        >>> list(track["light"])
        ['left', 'right', 'dark']
        """
        import numpy as np

        def array(value: Any, what: str, shape: tuple[int | None, ...]) -> NDArray[np.float64]:
            try:
                found = np.asarray(value, dtype=np.float64)
            except (TypeError, ValueError) as error:
                raise WrongTypeError(f"{what}: found {kind_of(value)}, wanted numbers: {error}") from error
            fits = found.ndim == len(shape) and all(b in (None, a) for a, b in zip(found.shape, shape, strict=False))
            if not fits:
                wanted = "(" + ", ".join("rows" if size is None else str(size) for size in shape) + ")"
                raise PlanError(f"{what}: found an array of shape {found.shape}, wanted {wanted}")
            return found

        places = array(tips, "tips", (None, 2))
        rows = len(places)
        if not np.isfinite(places).all():
            row = int(np.argwhere(~np.isfinite(places))[0][0])
            raise PlanError(f"tips: found {places[row].tolist()} in row {row}, wanted finite numbers")
        steps = np.arange(rows) if step is None else array(step, "step", (rows,)).astype(int)
        times = steps * period_min * 60.0 if time_s is None else array(time_s, "time_s", (rows,))
        words = [
            None if light is None or light in ("dark", "") or light != light else light for light in (lights or [])
        ]
        words += [None] * (rows - len(words) if lights is None or len(words) == rows - 1 else 0)
        if len(words) != rows:
            raise PlanError(f"lights: found {len(words)}, wanted one a row: {rows}, or {rows - 1}")
        layout = list(lamps) if lamps is not None else _lamps_for(words)
        names = [str(lamp["name"]) for lamp in layout]
        numbers = iter(lamp_numbers([word for word in words if word is not None], names))
        qualities = [quality] * rows if isinstance(quality, str) else [str(word) for word in quality]
        unknown = next((word for word in qualities if word not in _QUALITIES), None)
        if unknown is not None:
            raise PlanError(f"quality: found {unknown!r}, wanted one of {', '.join(_QUALITIES)}")
        whole: dict[str, Any] = {
            "layout": layout,
            "period_min": float(period_min),
            "step": steps.tolist(),
            "time_s": times.tolist(),
            "tips": places.tolist(),
            "lights": [None if word is None else next(numbers) for word in words],
            "quality": qualities,
            "columns": [_column(name, values, rows) for name, values in (columns or {}).items()],
        }
        if stems is not None:
            found = np.asarray(stems, dtype=np.float64)
            if found.ndim != 3 or found.shape[0] != rows or found.shape[2] != 2:
                raise PlanError(f"stems: found an array of shape {found.shape}, wanted ({rows}, points, 2)")
            whole["stems"] = [None if np.isnan(stem).any() else stem.tolist() for stem in found]
        return cls(_core.Track(json.dumps(whole)))

    @classmethod
    def from_pandas(cls, frame: pandas.DataFrame) -> Track:
        """The track of a frame of pandas with the columns of a track file; tip_x_cm and tip_y_cm are required.

        >>> import pandas, tropism
        >>> frame = pandas.DataFrame({"tip_x_cm": [0.0, 0.1], "tip_y_cm": [4.0, 4.1], "light": ["left", "dark"]})
        >>> tropism.Track.from_pandas(frame).tips.tolist()
        [[0.0, 4.0], [0.1, 4.1]]
        """
        return cls._of_frame(frame)

    @classmethod
    def from_polars(cls, frame: polars.DataFrame) -> Track:
        """The track of a frame of polars with the columns of a track file."""
        return cls._of_frame(frame)

    @classmethod
    def from_arrow(cls, table: pyarrow.Table) -> Track:
        """The track of an Arrow table with the columns of a track file; period and lamps come from its metadata."""
        return cls._of_frame(table)

    @classmethod
    def read_parquet(cls, file: str | os.PathLike[str]) -> Track:
        """The track in a Parquet file, which `to_parquet` wrote.

        >>> import tropism
        >>> track = tropism.Track.from_arrays([[0, 4], [0, 5]], ["left"])
        >>> track.to_parquet("track.parquet")
        >>> tropism.Track.read_parquet("track.parquet") == track
        True
        """
        from pyarrow import parquet

        return cls.from_arrow(parquet.read_table(path(file, "track")))

    @classmethod
    def _of_frame(cls, frame: Any) -> Track:
        """The track of a frame or an Arrow table."""
        attributes = dict(getattr(frame, "attrs", {}))
        if hasattr(frame, "column_names"):
            names = list(frame.column_names)
            data = {name: frame.column(name).to_pylist() for name in names}
            metadata = frame.schema.metadata or {}
            attributes = {key.decode().removeprefix("tropism."): value.decode() for key, value in metadata.items()}
            if "layout" in attributes:
                attributes["layout"] = json.loads(attributes["layout"])
        else:
            names = [str(name) for name in frame.columns]
            data = {name: frame[name].to_list() for name in names}
        missing = [name for name in ("tip_x_cm", "tip_y_cm") if name not in names]
        if missing:
            raise PlanError(f"frame: found columns {', '.join(names)}, wanted {' and '.join(missing)} among them")
        stem_points = 0
        while f"stem_{stem_points + 1}_x_cm" in names and f"stem_{stem_points + 1}_y_cm" in names:
            stem_points += 1
        stems = None
        if stem_points:
            stems = [
                [[_number(data[f"stem_{n}_{axis}_cm"][row]) for axis in "xy"] for n in range(1, stem_points + 1)]
                for row in range(len(data["tip_x_cm"]))
            ]
        time = data.get("time_s")
        period = attributes.get("period_min")
        if period is None:
            period = _period(time, data.get("step"))
        return cls.from_arrays(
            list(zip(data["tip_x_cm"], data["tip_y_cm"], strict=True)),
            [_word(light) for light in data["light"]] if "light" in data else None,
            period_min=float(period),
            step=data.get("step"),
            time_s=time,
            quality=[str(word) for word in data["quality"]] if "quality" in data else "measured",
            stems=stems,
            lamps=attributes.get("layout"),
            columns={name: data[name] for name in names if name not in _REQUIRED},
        )

    def to_csv(self) -> bytes:
        """The bytes of a track file."""
        return self._track.to_csv()

    def write(self, file: str | os.PathLike[str]) -> None:
        """Writes a track file (CSV), with the stems as columns; lengths have five decimals."""
        self._track.write(path(file, "file"))

    def columns(self) -> dict[str, Any]:
        """All columns in the order of the file: arrays of numbers, lists of words.

        >>> import tropism
        >>> list(tropism.Track.from_arrays([[0, 4]]).columns())
        ['step', 'time_s', 'tip_x_cm', 'tip_y_cm', 'light', 'quality']
        """
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
    def lights(self) -> list[str]:
        """Name of the lamp that is lit from each row to the next, or dark."""
        words: list[str] = self._track.columns()["light"]
        return words

    @property
    def period_min(self) -> float:
        """Minutes between two steps."""
        return self._track.period_min

    @property
    def lamps(self) -> list[str]:
        """Names of the lamps."""
        return self._track.lamps

    @property
    def layout(self) -> list[dict[str, Any]]:
        """The lamps: name and place (x, y, z in cm) of each."""
        found: list[dict[str, Any]] = json.loads(self._track.layout)
        return found

    def fitness(self, wanted: Any = None) -> float:
        """The fitness for a task (data, or a task file), in cm: eq. (9) for the paper's three targets if none is given.

        >>> import tropism
        >>> track, fitness = tropism.loop.grow("greedy", {"max_steps": 20})
        >>> track.fitness({"max_steps": 20}) == fitness
        True
        """
        return self._track.fitness(json.dumps(task(wanted)))

    def to_pandas(self) -> pandas.DataFrame:
        """The columns as a pandas frame: light and quality are categories, the index is the time; `attrs` has period and lamps.

        >>> import tropism
        >>> frame = tropism.Track.from_arrays([[0, 4], [0, 5]], ["left"]).to_pandas()
        >>> frame.index.name, str(frame["light"].dtype), frame.attrs["period_min"]
        ('time', 'category', 5.0)
        """
        import pandas

        columns = self.columns()
        frame = pandas.DataFrame(columns, index=pandas.to_timedelta(columns["time_s"], unit="s"))
        frame.index.name = "time"
        frame["light"] = pandas.Categorical(columns["light"], categories=[*self.lamps, "dark"])
        frame["quality"] = pandas.Categorical(columns["quality"], categories=list(_QUALITIES))
        frame.attrs.update(period_min=self.period_min, lamps=self.lamps, layout=self.layout)
        return frame

    def to_polars(self) -> polars.DataFrame:
        """The columns as a polars frame; light and quality are of the type Enum.

        >>> import tropism
        >>> tropism.Track.from_arrays([[0, 4], [0, 5]], ["left"]).to_polars().shape
        (2, 6)
        """
        import polars

        kinds = {"light": polars.Enum([*self.lamps, "dark"]), "quality": polars.Enum(list(_QUALITIES))}
        return polars.DataFrame(self.columns()).cast(kinds)  # type: ignore[arg-type,unused-ignore]

    def to_arrow(self) -> pyarrow.Table:
        """The columns as an Arrow table; period and lamps are its metadata.

        >>> import tropism
        >>> tropism.Track.from_arrays([[0, 4]]).to_arrow().num_rows
        1
        """
        import pyarrow

        metadata = {
            "tropism.period_min": str(self.period_min),
            "tropism.lamps": ",".join(self.lamps),
            "tropism.layout": json.dumps(self.layout),
        }
        return pyarrow.table(self.columns(), metadata=metadata)

    def to_parquet(self, file: str | os.PathLike[str]) -> None:
        """Writes the Arrow table as a Parquet file."""
        from pyarrow import parquet

        parquet.write_table(self.to_arrow(), path(file, "file"))

    def to_xarray(self) -> xarray.Dataset:
        """The track as a dataset of xarray: `tip` (time, axis) and `stem` (time, point, axis) in cm, light and quality.

        >>> import tropism
        >>> dict(tropism.Track.from_arrays([[0, 4], [0, 5]], ["left"]).to_xarray().sizes)["time"]
        2
        """
        import numpy as np
        import xarray

        columns = self.columns()
        time = (np.asarray(columns["time_s"]) * 1e9).round().astype("timedelta64[ns]")
        data: dict[str, Any] = {
            "tip": (("time", "axis"), self.tips, {"units": "cm"}),
            "light": (("time",), np.asarray(columns["light"])),
            "quality": (("time",), np.asarray(columns["quality"])),
        }
        stems = self.stems
        if not np.isnan(stems).all():
            data["stem"] = (("time", "point", "axis"), stems, {"units": "cm"})
        coordinates = {"time": time, "axis": ["x", "y"], "step": (("time",), columns["step"])}
        return xarray.Dataset(data, coordinates, {"period_min": self.period_min, "lamps": self.lamps})

    def plot(self, ax: Any = None, targets: Iterable[Sequence[float]] = ()) -> Any:
        """Draws the path of the tip with matplotlib, a colour a lamp, and targets as crosses; returns the axes."""
        import numpy as np
        from matplotlib import pyplot

        ax = ax if ax is not None else pyplot.subplots()[1]
        tips, lights = self.tips, np.asarray(self.lights)
        ax.plot(tips[:, 0], tips[:, 1], color="0.8", linewidth=1, zorder=1)
        # Nothing is lit in the last row.
        for name in (name for name in [*self.lamps, "dark"] if (lights[:-1] == name).any()):
            chosen = tips[lights == name]
            ax.scatter(chosen[:, 0], chosen[:, 1], s=6, label=name, zorder=2)
        goals = np.array([goal[:2] for goal in targets])
        if len(goals):
            ax.plot(goals[:, 0], goals[:, 1], "x", color="tab:red", markersize=9, label="target")
        ax.set(xlabel="tip x (cm)", ylabel="tip y (cm)", aspect="equal")
        ax.legend()
        return ax

    def _repr_html_(self) -> str:
        is_virtual = "simulated" in self.columns()["quality"]
        drawing = _core.draw_tracks([self._track], is_virtual)
        return f"<p>{self!r}</p><div style='max-width:28em'>{drawing}</div>"

    @overload
    def __getitem__(self, key: int) -> Row: ...
    @overload
    def __getitem__(self, key: slice) -> Track: ...
    @overload
    def __getitem__(self, key: str) -> Any: ...
    def __getitem__(self, key: int | slice | str) -> Row | Track | Any:
        """A row by its number, rows by a slice, a column by its name."""
        if isinstance(key, str):
            columns = self.columns()
            if key not in columns:
                raise KeyError(f"found no column {key!r}, wanted one of {', '.join(columns)}")
            return columns[key]
        if isinstance(key, slice):
            start, stop, stride = key.indices(len(self))
            if stride != 1:
                raise PlanError(f"track[...]: found a stride of {stride}, wanted 1: steps in a row")
            return Track(self._track.rows(start, max(start, stop)))
        number = key + len(self) if key < 0 else key
        if not 0 <= number < len(self):
            raise IndexError(f"found row {key}, wanted one of {len(self)}")
        return self._row(self._track.columns(), number)

    @staticmethod
    def _row(columns: Mapping[str, Any], number: int) -> Row:
        x, y, time = (float(columns[name][number]) for name in ("tip_x_cm", "tip_y_cm", "time_s"))
        return Row(int(columns["step"][number]), time, x, y, columns["light"][number], columns["quality"][number])

    def __iter__(self) -> Iterator[Row]:
        columns = self._track.columns()
        return (self._row(columns, number) for number in range(len(self)))

    def __len__(self) -> int:
        return len(self._track)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Track) and self._track == other._track

    def __hash__(self) -> int:
        return hash(self.to_csv())

    def __repr__(self) -> str:
        return f"Track({len(self)} rows, a step every {self.period_min:g} min, lamps {', '.join(self.lamps)})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _of_json, (self._track.to_json(),)


def _of_json(text: str) -> Track:
    """The track that was pickled."""
    return Track(_core.Track(text))


def _lamps_for(words: Sequence[Any]) -> list[Mapping[str, Any]]:
    """The paper's two lamps, or four where front or back is lit."""
    numbers = [word for word in words if word is not None and not isinstance(word, str)]
    has_four = any(word in ("front", "back") for word in words) or any(number > 1 for number in numbers)
    row = "front" if has_four else "left"
    track = _core.Track.from_csv(f"tip_x_cm,tip_y_cm,light\n0,0,{row}\n".encode())
    found: list[Mapping[str, Any]] = json.loads(track.layout)
    return found


def _column(name: str, values: Any, rows: int) -> dict[str, Any]:
    """A further column, as the compiled part reads it."""
    found = list(values)
    if len(found) != rows:
        raise PlanError(f"columns: {name}: found {len(found)} values, wanted {rows}")
    if all(value is None or hasattr(value, "__float__") for value in found):
        numbers = [_number(value) for value in found]
        whole = all(number != number or number == int(number) for number in numbers)
        cells = [None if number != number else number for number in numbers]
        return {"name": name, "numbers": cells, "decimals": 0 if whole else 5}
    return {"name": name, "words": ["" if value is None else str(value) for value in found]}


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def _word(light: Any) -> Any:
    return None if light is None or light != light else light


def _period(time: Sequence[float] | None, step: Sequence[int] | None) -> float:
    """Minutes between steps, of the median interval of the times; 5 without times."""
    if time is None or len(time) < 2:
        return 5.0
    steps = range(len(time)) if step is None else step
    gaps = sorted((b - a) / (m - n) for a, b, n, m in zip(time, time[1:], steps, steps[1:], strict=False))
    return round(gaps[len(gaps) // 2] / 60.0, 6) or 5.0
