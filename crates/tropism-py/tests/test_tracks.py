"""Tracks as tables, and runs as photographs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tropism
from tropism import Run, Track


@pytest.fixture
def track(beans: Path) -> Track:
    return Track.read(beans / "plant-0001.csv")


def test_a_track_comes_back_from_its_file(track: Track, beans: Path, tmp_path: Path) -> None:
    assert track.to_csv() == (beans / "plant-0001.csv").read_bytes()
    track.write(tmp_path / "again.csv")
    assert Track.read(tmp_path / "again.csv") == track
    assert len(track) == 501 and track.lamps == ["left", "right"] and track.period_min == 5.0
    assert track.tips.shape == (501, 2) and track.stems.shape == (501, 10, 2)
    assert (
        Track.from_csv(b"tip_x_cm,tip_y_cm,light\n0,4,right\n3,5.9,left\n-5,8.9,right\n-1,13.4,dark\n").fitness()
        == 15.0
    )


def test_frames_hold_the_columns(track: Track) -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    arrow = pytest.importorskip("pyarrow")
    frames = track.to_pandas(), track.to_polars().to_pandas(), track.to_arrow().to_pandas()
    for frame in frames:
        assert list(frame.columns) == list(track.columns())
        np.testing.assert_array_equal(frame["tip_x_cm"], track.tips[:, 0])
        assert frame["light"].iloc[0] == "left" and frame["light"].iloc[-1] == "dark"
    assert isinstance(frames[0], pandas.DataFrame) and isinstance(track.to_polars(), polars.DataFrame)
    assert isinstance(track.to_arrow(), arrow.Table)


def test_parquet_keeps_all(track: Track, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    track.to_parquet(tmp_path / "track.parquet")
    table = parquet.read_table(tmp_path / "track.parquet")
    assert table.equals(track.to_arrow()) and table.schema.metadata[b"tropism.period_min"] == b"5.0"


def test_a_line_that_is_wrong_is_named(tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("tip_x_cm,tip_y_cm,light\n0,4,left\nhere,4,left\n")
    with pytest.raises(tropism.PlanError, match=r"track\.csv.*line 3: found tip_x_cm"):
        Track.read(tmp_path / "track.csv")


def test_a_run_is_its_photographs(tmp_path: Path) -> None:
    tropism.grow(
        plants=1,
        photographs=True,
        greenhouse={"scene": {"width": 432, "height": 324}},
        task={"kind": "open_loop", "max_steps": 3},
        out=tmp_path / "beans",
        monitor=False,
    )
    run = Run(tmp_path / "beans" / "plant-0001")
    photographs = list(run)
    assert [photograph.step for photograph in photographs] == [0, 1, 2, 3] and len(run) == 4
    assert photographs[0].pixels().shape == (324, 432, 3)
    assert [photograph.light for photograph in photographs] == ["left", "left", "left", None]
    np.testing.assert_array_equal([photograph.tip for photograph in photographs], run.track.tips)
    with pytest.raises(tropism.PlanError, match=r"no run\.toml"):
        Run(tmp_path)


def test_stems_of_other_numbers_of_points_are_resampled(tmp_path: Path) -> None:
    stems = np.arange(90.0).reshape(3, 15, 2)
    track = Track.from_arrays(np.zeros((3, 2)), ["left"] * 3, stems=stems)
    assert track.stems[0, -1].tolist() == [28.0, 29.0] and track.stems.shape == (3, 10, 2)
    track.write(tmp_path / "stems.csv")
    assert np.allclose(Track.read(tmp_path / "stems.csv").stems, track.stems, atol=1e-5)


def test_a_track_is_scored_by_what_it_has(track: Track) -> None:
    flat = Track.from_arrays(np.zeros((3, 2)), ["left"] * 3)
    disc = {"kind": "obstacles", "targets": [[1, 6]], "obstacles": [{"disc": [0, 6], "radius_cm": 1}]}
    for task, wanted in [
        (disc, "scored by the stem"),
        ({"targets": [[3, 6], [1, 2]]}, "targets"),
        ({"kind": "random_targets", "count": 3}, "still to be drawn"),
    ]:
        with pytest.raises(tropism.PlanError, match=wanted):
            flat.fitness(task)
