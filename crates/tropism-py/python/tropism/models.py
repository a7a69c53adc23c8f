"""Models of how plants move: fitted to tracks, looked at, and simulated."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from tropism import _core
from tropism._core import Plant
from tropism.edge import kind_of, path
from tropism.errors import WrongTypeError
from tropism.tracks import Track, lamp_numbers

if TYPE_CHECKING:
    import numpy as np
    import pandas
    from numpy.typing import NDArray

__all__ = ["Model", "Plant"]


class Model:
    """A model of how plants move. It does not change; copies and pickles have the same bits.

    `kind` is "tip" (the paper's tip-motion model, eqs. (1)-(8)), "stem", or "space".

    >>> import tropism
    >>> model = tropism.Model.of_virtual_beans(plants=2, steps=100)
    >>> model
    Model(kind='tip', steps=200, lamps=['left', 'right'], is_virtual=True)
    """

    def __init__(self, model: _core.Model) -> None:
        if not isinstance(model, _core.Model):
            raise WrongTypeError(
                f"Model: found {kind_of(model)}, wanted Model.fit(tracks), Model.read(path) or Model.of_virtual_beans()"
            )
        self._model = model

    @classmethod
    def of(cls, value: Model | _core.Model | str | os.PathLike[str]) -> Model:
        """A model as it is, or that of a model file.

        >>> import tropism
        >>> model = tropism.Model.of_virtual_beans(plants=1, steps=50)
        >>> tropism.Model.of(model) is model
        True
        """
        if isinstance(value, Model):
            return value
        return cls(value) if isinstance(value, _core.Model) else cls.read(value)

    @classmethod
    def fit(cls, tracks: Any, kind: str = "tip", is_virtual: bool = False) -> Model:
        """A model of tracks.

        `tracks`: a track or several, each a `Track`, a frame, or a track file. `is_virtual` says that its plants were virtual.

        >>> import tropism
        >>> track, _ = tropism.loop.grow("periodic", {"kind": "open_loop", "max_steps": 60})
        >>> tropism.Model.fit(track, is_virtual=True).steps
        60
        """
        from tropism.edge import _several

        return cls(_core.Model.fit([Track.of(track)._track for track in _several(tracks)], kind, is_virtual))

    @classmethod
    def of_virtual_beans(cls, kind: str = "tip", seed: int = 1, plants: int = 6, steps: int = 1000) -> Model:
        """A model of virtual beans under periodic lamps, as in the paper's open-loop experiments; of kind "space" with four lamps.

        >>> import tropism
        >>> tropism.Model.of_virtual_beans("stem", plants=1, steps=100).kind
        'stem'
        """
        return cls(_core.Model.of_virtual_beans(kind, seed, plants, steps))

    @classmethod
    def read(cls, file: str | os.PathLike[str]) -> Model:
        """Reads a model file of any kind, from `tropism.fit`."""
        return cls(_core.Model.read(path(file, "model")))

    @classmethod
    def from_json(cls, text: str) -> Model:
        """The model that `to_json` wrote."""
        return cls(_core.Model(text))

    def to_json(self) -> str:
        """The content of a model file."""
        return self._model.to_json()

    def write(self, file: str | os.PathLike[str]) -> None:
        """Writes a model file."""
        with open(file, "w", encoding="utf-8") as out:
            out.write(self.to_json())

    @property
    def kind(self) -> str:
        """tip, stem or space."""
        return self._model.kind

    @property
    def is_virtual(self) -> bool:
        """Whether it was made of virtual plants."""
        return self._model.is_virtual

    @property
    def period_min(self) -> float:
        """Minutes of a step."""
        return self._model.period_min

    @property
    def lamps(self) -> list[str]:
        """Names of the lamps."""
        return self._model.lamps

    @property
    def layout(self) -> list[dict[str, Any]]:
        """The lamps: name and place (x, y, z in cm) of each."""
        found: list[dict[str, Any]] = json.loads(self._model.layout)
        return found

    @property
    def steps(self) -> int:
        """Measured steps that it is made of, without their mirror images."""
        return self._model.steps

    @property
    def tips(self) -> NDArray[np.float64]:
        """The measured tips, in cm: (steps, 2)."""
        return self._model.tips()

    @property
    def settings(self) -> dict[str, Any]:
        """How a tip-motion model was made: window, grid, growth, and what holds where there are no data."""
        found: dict[str, Any] = json.loads(self._model.settings())
        return found

    @property
    def growth(self) -> Mapping[str, float]:
        """Growth of a step of a tip-motion model, eq. (4): mean and sd in cm.

        >>> import tropism
        >>> tropism.Model.of_virtual_beans(plants=1, steps=50).growth
        {'mean': 0.03, 'sd': 0.01}
        """
        found: dict[str, float] = self.settings["growth"]
        return found

    def shifts(self) -> pandas.DataFrame:
        """The observed shifts of a tip-motion model, as a frame: x_cm, y_cm, dx_cm, dy_cm and light, a row a step.

        >>> import tropism
        >>> list(tropism.Model.of_virtual_beans(plants=1, steps=50).shifts())
        ['x_cm', 'y_cm', 'dx_cm', 'dy_cm', 'light']
        """
        import pandas

        numbers, lights = self._model.shifts()
        frame = pandas.DataFrame(numbers, columns=["x_cm", "y_cm", "dx_cm", "dy_cm"])
        frame["light"] = pandas.Categorical.from_codes(lights.tolist(), categories=self.lamps)
        return frame

    def mean_shift(self, places: Any) -> NDArray[np.float64]:
        """The mean shift in x at places under each lamp, in cm, eq. (5).

        `places`: (x, y), or rows of them, in cm. Returns (lamps,), or (rows, lamps); NaN where there are no data.

        >>> import tropism
        >>> tropism.Model.of_virtual_beans(plants=2, steps=100).mean_shift((0, 5)).shape
        (2,)
        """
        import numpy as np

        given = np.asarray(places, dtype=np.float64)
        found = self._model.mean_shifts(np.atleast_2d(given))
        return found[0] if given.ndim == 1 else found

    def table(self, step_cm: float = 0.25) -> pandas.DataFrame:
        """The mean shifts on a grid over the data, as a frame: x_cm, y_cm, and a column a lamp (`left_cm`, ...); NaN without data.

        >>> import tropism
        >>> list(tropism.Model.of_virtual_beans(plants=1, steps=50).table())
        ['x_cm', 'y_cm', 'left_cm', 'right_cm']
        """
        import numpy as np
        import pandas

        low, high = self.tips.min(axis=0), self.tips.max(axis=0)
        far = max(abs(low[0]), abs(high[0]))
        x, y = np.arange(-far, far + step_cm, step_cm), np.arange(low[1], high[1] + step_cm, step_cm)
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        frame = pandas.DataFrame(places, columns=["x_cm", "y_cm"])
        means = self.mean_shift(places)
        for number, lamp in enumerate(self.lamps):
            frame[f"{lamp}_cm"] = means[:, number]
        return frame

    def plant(self, start: Sequence[float] = (0.0, 4.0), seed: int = 1, number: int = 0, after: Any = None) -> Plant:
        """One simulated plant, to be stepped by hand: `advance(lamp)`, `seen`, `copy.copy`.

        `start` is its tip in cm; `after` is a track whose plant goes on instead. The noise is that of plant `number` of
        `tropism.simulate` under `seed`.

        >>> import tropism
        >>> plant = tropism.Model.of_virtual_beans(plants=2, steps=100).plant()
        >>> plant.advance("left").y > 4.0
        True
        """
        past = None if after is None else Track.of(after)._track
        return self._model.plant((float(start[0]), float(start[1])), seed, number, past)

    def sample(
        self,
        lights: Iterable[int | str],
        plants: int = 100,
        seed: int = 1,
        start: Sequence[float] = (0.0, 4.0),
        after: Any = None,
    ) -> NDArray[np.float64]:
        """Tips of simulated plants under given lamps, in cm: (plants, steps + 1, 2), or 3 numbers each in space.

        `lights`: the lamp of each step, by number or name. The plants begin at `start`, or where the track `after` ends.

        >>> import tropism
        >>> model = tropism.Model.of_virtual_beans(plants=2, steps=100)
        >>> model.sample(["left"] * 10, plants=5).shape
        (5, 11, 2)
        """
        past = None if after is None else Track.of(after)._track
        numbers = lamp_numbers(lights, self.lamps)
        return self._model.tips_under(numbers, plants, seed, (float(start[0]), float(start[1])), past)

    def predict(self, after: Any, lights: Iterable[int | str], plants: int = 100, seed: int = 1) -> NDArray[np.float64]:
        """The mean tip after each step under given lamps, of the plant that the track `after` shows: (steps, 2), in cm.

        >>> import tropism
        >>> track, _ = tropism.loop.grow("periodic", {"kind": "open_loop", "max_steps": 60})
        >>> tropism.Model.fit(track).predict(track, ["left"] * 3).shape
        (3, 2)
        """
        found: NDArray[np.float64] = self.sample(lights, plants, seed, after=after)[:, 1:].mean(axis=0)
        return found

    def plot(self, ax: Any = None, lamp: int | str = 0) -> Any:
        """Draws the mean shifts in x under a lamp with matplotlib (Fig. 5); returns the axes.

        A notebook shows the whole of Fig. 5 for a model that stands in the last line of a cell.
        """
        import numpy as np
        from matplotlib import pyplot

        [number] = lamp_numbers([lamp], self.lamps)
        name = self.lamps[number]
        frame = self.table().pivot(index="y_cm", columns="x_cm", values=f"{name}_cm")
        ax = ax if ax is not None else pyplot.subplots()[1]
        most = float(np.nanmax(np.abs(frame.to_numpy())))
        picture = ax.pcolormesh(
            frame.columns, frame.index, frame.to_numpy(), cmap="RdBu_r", vmin=-most, vmax=most, shading="nearest"
        )
        ax.figure.colorbar(picture, ax=ax, label="mean shift in x (cm)")
        ax.set(xlabel="tip x (cm)", ylabel="tip y (cm)", title=f"lamp {name}", aspect="equal")
        return ax

    def _repr_html_(self) -> str:
        drawing = self._model.draw() if self.kind == "tip" else ""
        return f"<p>{self!r}</p><div style='max-width:56em'>{drawing}</div>"

    def __repr__(self) -> str:
        virtual = self.is_virtual
        return f"Model(kind={self.kind!r}, steps={self.steps}, lamps={self.lamps}, is_virtual={virtual})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self._model == other._model

    def __hash__(self) -> int:
        return hash(self.to_json())

    def __reduce__(self) -> tuple[Any, ...]:
        return Model.from_json, (self.to_json(),)
