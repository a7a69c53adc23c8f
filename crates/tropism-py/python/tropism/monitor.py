"""What hears of a workflow while it works, and may ask for an end."""

from __future__ import annotations

import sys
import time
from typing import TextIO


class Monitor:
    """Listens to a workflow. Every method does nothing here: override those that you want.

    An exception of a method ends the workflow in order (what was done is saved) and is raised by the call.

    >>> import tropism
    >>> class Count(tropism.Monitor):
    ...     done = 0
    ...     def advance(self, count):
    ...         self.done += count
    >>> count = Count()
    >>> task = {"kind": "open_loop", "max_steps": 10}
    >>> _ = tropism.grow(plants=2, task=task, out="beans", monitor=count)
    >>> count.done
    2
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
    """The monitor of calls without one: a bar on a terminal or in a notebook, and notes.

    Notes go to the logger `tropism.WORKFLOW` (level INFO) where a program has set up `logging`, and to `file` (stderr) elsewhere.
    Stages and their ends are logged at level DEBUG.

    >>> import io
    >>> progress = Progress("fit", io.StringIO())
    >>> progress.stage("tracks", 2)
    >>> progress.advance(1)
    >>> progress.done
    1
    """

    #: Columns of the bar.
    WIDTH = 24
    #: Seconds between two drawings.
    PAUSE_S = 0.1

    def __init__(self, workflow: str = "", file: TextIO | None = None) -> None:
        # Not by the package's own import, which is to be quick.
        import logging

        self.file = file if file is not None else sys.stderr
        self.log = logging.getLogger(f"tropism.{workflow}" if workflow else "tropism")
        # IPython's streams are no terminals, and show a line that is drawn anew as terminals do.
        self.is_drawn = self.file.isatty() or type(self.file).__module__.startswith("ipykernel")
        self.name, self.text = "", ""
        self.total, self.done, self.began, self.drawn_at = 0, 0, 0.0, 0.0
        self.is_shown = False

    def stage(self, name: str, total: int) -> None:
        self.close()
        self.name, self.total, self.done, self.text = name, total, 0, ""
        self.began = time.monotonic()
        self.log.debug("%s: begins, %d to do", name, total)

    def advance(self, count: int) -> None:
        self.done += count
        self._draw()

    def skip(self, count: int) -> None:
        self.total = max(0, self.total - count)

    def status(self, text: str) -> None:
        self.text = text
        self._draw()

    def note(self, text: str) -> None:
        if self.log.hasHandlers():
            self.log.info("%s", text)
            return
        self._wipe()
        print(text, file=self.file)

    def event(self, text: str) -> None:
        self.log.info("%s", text)

    def _draw(self) -> None:
        now = time.monotonic()
        if not self.is_drawn or now - self.drawn_at < self.PAUSE_S:
            return
        self.drawn_at = now
        share = min(1.0, self.done / self.total) if self.total else 0.0
        bar = "=" * round(share * self.WIDTH)
        left = (now - self.began) * (1 - share) / share if share > 0 else None
        time_left = f"{left:.0f} s left" if left is not None else ""
        line = f"{self.name:<22} {bar:<{self.WIDTH}} {100 * share:>3.0f} %  {time_left}  {self.text}"
        print(f"\r{line[:119]:<119}", end="", file=self.file, flush=True)
        self.is_shown = True

    def _wipe(self) -> None:
        if self.is_shown:
            print(f"\r{'':<119}\r", end="", file=self.file, flush=True)
            self.is_shown = False

    def close(self) -> None:
        """Ends the present bar."""
        self._wipe()
        if self.name:
            self.log.debug("%s: %d done in %.1f s", self.name, self.done, time.monotonic() - self.began)
            self.name = ""
