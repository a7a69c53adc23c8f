"""What tests of sweeps share: a small sweep, and where its units work."""

from __future__ import annotations

from pathlib import Path


def config(model: Path, generations: int) -> dict[str, object]:
    return {
        "model": str(model),
        "seeds": 2,
        "grid": {"evolution": {"neat": {"population": [20, 30]}}},
        "evolve": {"evolution": {"runs": 3, "generations": generations}},
    }


def worker_of_a_unit() -> int | None:
    """The process of a worker that executes a unit now."""
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            title = path.read_bytes()
        except OSError:
            continue
        if title.startswith(b"ray::unit") or title.startswith(b"ray::_unit"):
            return int(path.parent.name)
    return None
