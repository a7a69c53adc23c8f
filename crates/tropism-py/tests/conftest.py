"""Beans and a model that the tests share: made once, by the workflows."""

from pathlib import Path

import pytest
import tropism


@pytest.fixture(scope="session")
def beans(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tracks of three virtual beans under periodic lamps."""
    out = tmp_path_factory.mktemp("beans") / "beans"
    tropism.grow(plants=3, out=out, task={"kind": "open_loop", "max_steps": 500}, monitor=False)
    return out


@pytest.fixture(scope="session")
def model(beans: Path) -> Path:
    """The tip-motion model of these beans."""
    path = beans.parent / "model.json"
    tropism.fit(tracks=[beans], out=path, monitor=False)
    return path
