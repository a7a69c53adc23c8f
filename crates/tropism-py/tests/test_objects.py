"""Objects that fit together: what the command takes, Python takes, and its own objects too."""

from __future__ import annotations

import copy
import io
import logging
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tropism
from tropism import loop, neat
from tropism.monitor import Progress

OPEN: dict[str, Any] = {"kind": "open_loop", "max_steps": 60}
QUIET: dict[str, Any] = {"monitor": False}


@pytest.fixture(scope="module")
def track() -> tropism.Track:
    return loop.grow("periodic", OPEN)[0]


@pytest.fixture(scope="module")
def fitted(track: tropism.Track) -> tropism.Model:
    return tropism.Model.fit(track, is_virtual=True)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_calls_of_a_plant_scientist(track: tropism.Track, fitted: tropism.Model, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    tropism.grow(plants=2, task=OPEN, out="beans", **QUIET)
    frame, first = track.to_pandas(), sorted(Path("beans").glob("*.csv"))[0]
    model = tropism.fit([track, "beans", frame], out="model.json", **QUIET)
    assert model.tracks == 4 and model.shifts == 240
    simulated = tropism.simulate(fitted, controller="greedy", task={"max_steps": 20}, episodes=2, out="s.csv", **QUIET)
    assert simulated.episodes == 2
    Path("task.toml").write_text('kind = "targets"\nmax_steps = 20\n')
    genome = neat.Neat(inputs=2, outputs=1).ask()[0]
    rows = tropism.transfer(["greedy", genome], plants=2, task="task.toml", out="t", **QUIET).controllers
    assert [row.name for row in rows] == ["greedy", "network-2"]
    assert tropism.score(track, **QUIET).tracks[0].steps == 60
    assert tropism.show(genome, **QUIET).inputs == 2
    assert tropism.Track.of(str(first)) == tropism.Track.read(first)
    # The frame has the categories, the times and the settings of the track.
    assert frame["light"].cat.categories.tolist() == ["left", "right", "dark"]
    assert isinstance(frame.index, pandas.TimedeltaIndex) and frame.attrs["period_min"] == 5.0
    assert tropism.Track.from_pandas(frame).tips.tolist() == track.tips.tolist()
    assert fitted.shifts()["light"].cat.categories.tolist() == ["left", "right"]
    assert fitted.table()["left_cm"].notna().any()


def test_a_track_is_a_table(track: tropism.Track) -> None:
    assert len(list(track)) == 61 and list(track)[3] == track[3]
    assert track["tip_x_cm"][-1] == track[-1].x_cm
    assert track[10:20].tips.tolist() == track.tips[10:20].tolist()
    assert "<svg" in track._repr_html_()
    with pytest.raises(IndexError, match="row 61"):
        track[61]
    with pytest.raises(KeyError, match="tip_q_cm"):
        track["tip_q_cm"]


def test_a_track_of_arrays(track: tropism.Track) -> None:
    again = tropism.Track.from_arrays(track.tips, track.lights, quality="simulated", stems=track.stems)
    assert again.tips.tolist() == track.tips.tolist() and again.lights == track.lights
    single = np.asfortranarray(track.tips.astype(np.float32))[::2]
    assert len(tropism.Track.from_arrays(single, [0] * 31)) == 31
    assert tropism.Track.from_arrays([[0, 4], [1, 5]], ["front"]).lamps == ["left", "right", "front", "back"]
    for wrong, message in [
        (lambda: tropism.Track.from_arrays([[0, np.nan]]), "row 0, wanted finite"),
        (lambda: tropism.Track.from_arrays([1, 2, 3]), r"shape \(3,\), wanted \(rows, 2\)"),
        (lambda: tropism.Track.from_arrays([[0, 4], [1, 5]], ["top"]), "wanted one of left, right"),
        (lambda: tropism.Track.from_arrays([[0, 4], [1, 5]], [2.5]), "found float"),
    ]:
        with pytest.raises((tropism.PlanError, ValueError), match=message):
            wrong()


def test_tables_of_other_packages_come_back(track: tropism.Track) -> None:
    polars = pytest.importorskip("polars")
    pytest.importorskip("pyarrow")
    assert tropism.Track.from_polars(track.to_polars()).tips.tolist() == track.tips.tolist()
    assert isinstance(track.to_polars()["light"].dtype, polars.Enum)
    track.to_parquet("track.parquet")
    assert tropism.Track.read_parquet("track.parquet").lights == track.lights


def test_xarray(track: tropism.Track) -> None:
    pytest.importorskip("xarray")
    data = track.to_xarray()
    assert data["tip"].dims == ("time", "axis") and data["tip"].attrs["units"] == "cm"


def test_plots(track: tropism.Track, fitted: tropism.Model) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    assert track.plot(targets=[(3, 6)]).get_xlabel() == "tip x (cm)"
    pytest.importorskip("pandas")
    assert "left" in fitted.plot(lamp="left").get_title()


def test_a_model_is_stepped_and_sampled(track: tropism.Track, fitted: tropism.Model) -> None:
    lights = ["left"] * 5 + [1] * 5
    tips = fitted.sample(lights, plants=3, seed=7)
    assert tips.shape == (3, 11, 2)
    plant = fitted.plant(seed=7, number=2)
    for light in lights[:5]:
        plant.advance(light)
    fork = copy.copy(plant)
    for light in lights[5:]:
        assert plant.advance(light).tip == fork.advance(light).tip
    assert plant.seen.tip == tuple(tips[2, -1])
    assert fitted.predict(track, ["left"] * 3).shape == (3, 2)
    assert fitted.growth["mean"] == 0.03 and "<svg" in fitted._repr_html_()
    with pytest.raises(tropism.PlanError, match="observed shifts"):
        tropism.Model.fit(loop.grow("periodic", OPEN)[0], "stem").settings  # noqa: B018


def test_all_objects_are_pickled_and_copied(track: tropism.Track, fitted: tropism.Model) -> None:
    genome = neat.Neat(inputs=2, outputs=1, seed=3).ask()[0]
    network = neat.Network(genome)
    network.activate([0.5, 4.0])
    for again in (pickle.loads(pickle.dumps(network)), copy.deepcopy(network)):
        assert again.state == network.state and again.genome == genome
    networks = neat.Networks([genome, genome])
    networks.activate([[0.5, 4.0], [1.0, 2.0]])
    assert pickle.loads(pickle.dumps(networks)).states == networks.states
    results = tropism.Results({"plants": 2})
    controller = loop.CoreController("greedy")
    for thing in (track, fitted, genome, results, tropism.plans.GrowPlan(plants=2)):
        assert pickle.loads(pickle.dumps(thing)) == thing and copy.deepcopy(thing) == thing
    assert pickle.loads(pickle.dumps(controller)).decide_at(0, 4) == controller.decide_at(0, 4)
    error = tropism.PlanError("nothing")
    assert str(pickle.loads(pickle.dumps(error))) == "nothing"


def test_networks_take_what_numpy_makes_an_array_of() -> None:
    genome = neat.Neat(inputs=2, outputs=1, seed=3).ask()[0]
    network, networks = neat.Network(genome), neat.Networks([genome])
    wide = np.arange(12, dtype=np.float32).reshape(2, 6)[:, ::3]
    wanted = networks.run(wide.astype(float)).tolist()
    for inputs in (wide, wide.tolist(), wide.astype(np.int64), wide.astype(bool) * 1):
        assert np.asarray(networks.run(inputs)).shape == (1, 2, 1)
    assert networks.run(wide).tolist() == wanted
    assert network.run(wide[0]) == network.run(tuple(wide[0].tolist())) == network.run(np.float32(wide[0]))
    assert neat.Novelty().scores([[0, 1], [1, 0]]).shape == (2,)
    with pytest.raises(tropism.PlanError, match="NaN at place 1"):
        networks.run([[0.0, np.nan]])
    with pytest.raises(TypeError, match="inputs: found list, wanted numbers"):
        networks.run([["a", "b"]])
    with pytest.raises(ValueError, match=r"shape \(1, 3\)"):
        networks.run([[1, 2, 3]])
    assert "<svg" in genome._repr_svg_() and "links" in repr(network)


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda: tropism.fit([]), ValueError, "^fit: "),
        (lambda: tropism.fit("nowhere"), FileNotFoundError, "^fit: .*nowhere"),
        (lambda: tropism.Track.read("nowhere.csv"), FileNotFoundError, "nowhere.csv"),
        (lambda: tropism.Model.read("nowhere.json"), FileNotFoundError, "nowhere.json"),
        (lambda: tropism.grow(plants="three"), TypeError, "^grow: plants: .*expected a whole number"),
        (lambda: tropism.grow(controller="gready"), ValueError, "^grow: controller: found 'gready', wanted \"greedy\""),
        (lambda: tropism.grow(controller=3), TypeError, "^grow: controller: found int"),
        (lambda: tropism.fit([3]), TypeError, "^fit: track: found int"),
        (lambda: tropism.simulate(3), TypeError, "^simulate: model: found int"),
        (lambda: tropism.grow(period_min=float("nan")), ValueError, "^grow: period_min: found nan"),
        (lambda: loop.grow(3), TypeError, "controller: found int"),
        (lambda: loop.grow("greedy", {"kind": "windig"}), ValueError, "^loop.grow: task"),
        (lambda: tropism.Track(3), TypeError, "Track.read"),
    ],
)
def test_errors_are_those_of_python(call: Any, kind: type[Exception], message: str) -> None:
    with pytest.raises(tropism.TropismError, match=message) as refusal:
        call()
    assert isinstance(refusal.value, kind)
    for word in ("u32", "f64", "struct", "sequence", " map", "enum"):
        assert word not in str(refusal.value)


def test_nothing_long_begins_without_its_main_argument() -> None:
    for name in ("study", "evolve", "replicates", "tune", "run", "transfer", "forecast", "sweep"):
        with pytest.raises(TypeError, match="missing 1 required positional argument"):
            getattr(tropism, name)()


def test_notes_go_to_the_log(caplog: pytest.LogCaptureFixture) -> None:
    out = io.StringIO()
    with caplog.at_level(logging.DEBUG, "tropism"):
        progress = Progress("fit", out)
        progress.stage("tracks", 2)
        progress.advance(2)
        progress.note("two tracks")
        progress.close()
    assert [record.name for record in caplog.records] == ["tropism.fit"] * 3
    assert "two tracks" in caplog.text and out.getvalue() == ""


def test_a_bar_is_drawn_on_a_terminal() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    out = Terminal()
    progress = Progress("fit", out)
    progress.stage("tracks", 4)
    progress.advance(2)
    assert "tracks" in out.getvalue() and " 50 %" in out.getvalue()
    progress.close()


def test_help_is_whole() -> None:
    for name in tropism.__all__:
        assert name == "sb3" or getattr(tropism, name, None) is not None, name
        assert name in dir(tropism)
    text = tropism.grow.__doc__ or ""
    assert "Parameters\n" in text and "plants : int, default 6" in text and "Returns\n" in text
