"""The notebooks and the examples do what they say."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CRATE = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize("path", sorted((CRATE / "notebooks").glob("*.ipynb")), ids=lambda path: path.stem)
def test_a_notebook_is_executed(path: Path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    book = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(book, timeout=300).execute()
    assert all(cell.get("execution_count") for cell in book.cells if cell.cell_type == "code")


@pytest.mark.parametrize("part", ["import", "calls"])
def test_a_bench_prints_its_figures(part: str) -> None:
    pytest.importorskip("gymnasium")
    words = [sys.executable, str(CRATE / "benches" / "speed.py"), part]
    done = subprocess.run(words, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and (" ms" in done.stdout or " us a call" in done.stdout), done.stderr


def test_the_notebooks_are_without_output() -> None:
    for path in (CRATE / "notebooks").glob("*.ipynb"):
        assert '"output_type"' not in path.read_text(encoding="utf-8"), f"{path.name}: found outputs, wanted none"
