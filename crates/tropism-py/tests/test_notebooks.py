"""The notebooks hold their outputs, and the bench prints its figures."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CRATE = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("part", ["import", "calls"])
def test_a_bench_prints_its_figures(part: str) -> None:
    pytest.importorskip("gymnasium")
    words = [sys.executable, str(CRATE / "benches" / "speed.py"), part]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and (" ms" in done.stdout or " us a call" in done.stdout), done.stderr


def test_the_notebooks_hold_what_their_cells_gave() -> None:
    words = [sys.executable, str(CRATE.parents[1] / "scripts" / "notebooks"), "--check"]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
