"""The exceptions of tropism. Each is also the built-in exception that Python's own functions raise for the same fault."""

from __future__ import annotations

__all__ = ["Interrupted", "MissingFileError", "Paused", "PlanError", "TropismError", "WrongTypeError"]


class TropismError(Exception):
    """What tropism refuses, or could not do. All exceptions here but `Interrupted` are of this class.

    >>> import tropism
    >>> try:
    ...     tropism.score(tracks=["nothing.csv"])
    ... except tropism.TropismError as error:
    ...     print(type(error).__name__)
    MissingFileError
    """


class PlanError(TropismError, ValueError):
    """A plan, setting or file that cannot be used. The text names the function, and the key or the place.

    >>> import tropism
    >>> tropism.fit(tracks=[])
    Traceback (most recent call last):
    tropism.errors.PlanError: fit: `tracks` is empty: name at least one
    """


class WrongTypeError(PlanError, TypeError):
    """A value of a type that cannot be used.

    >>> import tropism
    >>> tropism.grow(plants="three")
    Traceback (most recent call last):
    tropism.errors.WrongTypeError: grow: plants: invalid type: str "three", expected a whole number from 0
    """


class MissingFileError(PlanError, FileNotFoundError):
    """A file or folder that does not exist.

    >>> import tropism
    >>> tropism.Track.read("nothing.csv")
    Traceback (most recent call last):
    tropism.errors.MissingFileError: nothing.csv: cannot read: No such file or directory (os error 2)
    """


class Paused(TropismError):
    """A run met something that its user must decide; `resume=True` goes on.

    >>> import tropism
    >>> issubclass(tropism.Paused, tropism.TropismError)
    True
    """


class Interrupted(KeyboardInterrupt):
    """Ctrl-C, or a monitor that asked for an end. What was done is saved; `resume=True` goes on.

    >>> import tropism
    >>> issubclass(tropism.Interrupted, KeyboardInterrupt)
    True
    """


def of_call(error: TropismError, function: str) -> TropismError:
    """The same error with the name of the function that the user called."""
    return type(error)(f"{function}: {str(error).removeprefix('plan: ')}").with_traceback(error.__traceback__)
