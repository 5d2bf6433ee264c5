"""Reports make no runs, unless they are asked to."""

import json
import math
import re

import chebclear as cc
import numpy as np
import pytest
from chebclear.cli import main
from chebclear.execution import pieces
from chebclear.plots.drawing.pose import pose_columns, simulated_poses
from chebclear.run import simulation
from chebclear.run.settings import Settings

SIDES = {"crank_length": cc.Interval.around(0.05, rel=0.02), "rod_length": cc.Interval.around(0.12, rel=0.01)}
TURN = cc.mechanisms.slider_crank().period
RUN = {"duration": TURN, "samples": 31, "rtol": 1e-4}
TITLE = "The nominal run at other tolerances"


@pytest.fixture
def runs_made(monkeypatch):
    """Counts the runs that are made from here on, whoever makes them."""
    made = []

    def counting(*arguments):
        made.append(arguments)
        return simulated(*arguments)

    simulated = simulation.run_scene
    monkeypatch.setattr(simulation, "run_scene", counting)
    # The runs of studies, of which a report makes none even if it is asked to check.
    monkeypatch.setattr(pieces._core, "sweep", None)
    return made


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Files of a study of each kind, of scenes."""
    folder = tmp_path_factory.mktemp("results")
    study = cc.Study(
        cc.mechanisms.slider_crank,
        SIDES,
        ["slider.x", "wrist.normal_force"],
        features={"stroke": cc.features.peak_to_peak("slider.x")},
        **RUN,
    )
    made = {
        "band": study.band(20),
        "chebyshev": study.chebyshev(2),
        "scan": study.scan(3),
        "turns": study.band(8, revolutions=2),
    }
    return {kind: (one, one.save(folder / kind)) for kind, one in made.items()}


def film_of(path):
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)[1])


@pytest.mark.parametrize("kind", ["band", "chebyshev", "scan", "turns"])
def test_a_report_of_a_loaded_file_makes_no_run_and_is_the_same(kind, results, runs_made, tmp_path):
    result, file = results[kind]
    loaded = cc.load_result(file)
    written = loaded.report(tmp_path / "loaded.html", title="t")
    assert not runs_made
    own = result.report(tmp_path / "own.html", title="t")
    assert not runs_made
    assert own.read_text(encoding="utf-8") == written.read_text(encoding="utf-8")
    assert TITLE not in written.read_text(encoding="utf-8")
    # The drawing moves all the same.
    assert max(len(one) for one in film_of(written)["panels"][0]["transforms"]) == 31


def test_the_drawing_moves_as_the_nominal_run_does(results):
    result, _ = results["band"]
    scene = result.scene
    run = cc.simulate(scene, settings=Settings(outputs=pose_columns(scene), **RUN))
    assert np.array_equal(result.nominal_poses, simulated_poses(run))
    # Crank and slider in closed form, up to the clearance.
    crank = result.nominal_poses[:, 0, 2]
    slider = 0.05 * np.cos(crank) + np.sqrt(0.12**2 - (0.05 * np.sin(crank)) ** 2)
    assert result.nominal_poses[:, -1, 0] == pytest.approx(slider, abs=1e-4)


def test_bodies_have_their_names_in_the_drawing_that_moves(results, tmp_path):
    result, _ = results["band"]
    (panel,) = film_of(result.report(tmp_path / "named.html"))["panels"]
    names = {one["text"]: one for one in panel["labels"]}
    assert list(names) == ["crank", "rod", "slider"]
    # In the middle of the crank at the start, and with it.
    x, y = names["crank"]["at"]
    assert math.hypot(x, y) == pytest.approx(0.025, abs=1e-6)
    assert len(panel["transforms"][names["crank"]["moves"]]) == 31


def test_what_another_tolerance_would_give_is_asked_for(results, runs_made, tmp_path):
    _, file = results["band"]
    written = cc.load_result(file).report(tmp_path / "asked", check=True)
    assert len(runs_made) == 9, "three tolerances with two companions each"
    assert TITLE in written.read_text(encoding="utf-8")
    own = cc.Study(lambda a: {"t": [0.0, 1.0], "x": [a, 2 * a]}, {"a": cc.Interval(0.0, 1.0)}).band(20)
    with pytest.raises(ValueError, match="check"):
        own.report(tmp_path / "own.html", check=True)


def test_the_command_asks_for_it(results, runs_made, tmp_path, capsys):
    _, file = results["band"]
    to = tmp_path / "again.html"
    assert main(["report", str(file), "--to", str(to)]) == 0
    assert not runs_made and TITLE not in to.read_text(encoding="utf-8")
    assert main(["report", str(file), "--to", str(to), "--check"]) == 0
    assert runs_made and TITLE in to.read_text(encoding="utf-8")
    run = cc.simulate(cc.mechanisms.slider_crank(), **RUN).save(tmp_path / "run.npz")
    with pytest.raises(SystemExit):
        main(["report", str(run), "--check"])
    assert "--check" in capsys.readouterr().err
