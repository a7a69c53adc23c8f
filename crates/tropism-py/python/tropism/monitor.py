"""What hears of a workflow while it works, and may ask for an end."""

from __future__ import annotations

import sys
from typing import Any, TextIO


class Monitor:
    """Listens to a workflow. Every method does nothing here: override those that you want.

    An exception of a method ends the workflow in order (what was done is saved) and is raised by the call.
    """

    def stage(self, name: str, total: int) -> None:
        """A stage begins that consists of `total` units of work (steps, generations, photographs)."""

    def advance(self, count: int) -> None:
        """`count` further units of the present stage are done."""

    def skip(self, count: int) -> None:
        """`count` units of the present stage were done before the workflow was resumed."""

    def status(self, text: str) -> None:
        """The present state in a few words."""

    def note(self, text: str) -> None:
        """A line that a user should read."""

    def generation(self, run: int, statistics: str) -> None:
        """A generation of evolutionary run `run` is complete; `statistics` is JSON."""

    def sample(self, step: int, x_cm: float, y_cm: float, light: int | None, quality: str) -> None:
        """A step of an experiment is complete; `light` is the number of the lit lamp, None is dark."""

    def event(self, text: str) -> None:
        """An event of an experiment happened."""

    def may_go_on(self) -> bool:
        """Whether the workflow may go on. It is asked about fifty times a second."""
        return True


class Progress(Monitor):
    """Shows stages as bars of tqdm, if it is installed, and notes as lines on `file` (stderr)."""

    def __init__(self, file: TextIO | None = None) -> None:
        self.file = file if file is not None else sys.stderr
        self.bar: Any = None
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self.tqdm: Any = None
        else:
            self.tqdm = tqdm

    def stage(self, name: str, total: int) -> None:
        self.close()
        if self.tqdm is not None:
            self.bar = self.tqdm(total=total, desc=name, file=self.file, leave=False)

    def advance(self, count: int) -> None:
        if self.bar is not None:
            self.bar.update(count)

    def skip(self, count: int) -> None:
        if self.bar is not None:
            self.bar.initial += count
            self.bar.update(count)

    def status(self, text: str) -> None:
        if self.bar is not None:
            self.bar.set_postfix_str(text, refresh=False)

    def note(self, text: str) -> None:
        if self.tqdm is not None:
            self.tqdm.write(text, file=self.file)
        else:
            print(text, file=self.file)

    def close(self) -> None:
        """Ends the present bar."""
        if self.bar is not None:
            self.bar.close()
            self.bar = None
