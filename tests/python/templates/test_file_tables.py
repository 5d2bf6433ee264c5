"""Scene files: features, settings of runs, ISO fits, units whose power is another field, changes by name."""

import json
import math
import re
import sys
import tomllib
from pathlib import Path

import chebclear as cc
import jsonschema
import pytest
from chebclear.base.units import UnitError, convert
from chebclear.templates.fits import radial_clearance
from chebclear.templates.reference.json_schema import scene_file_schema

CRANK = (Path(__file__).parents[3] / "examples" / "slider_crank.toml").read_text(encoding="utf-8")
STIFFNESS = "stiffness = 3.3265e11"
FEATURES = """
cycles = 2

[features]
"peak force" = "peak(wrist.normal_force)"
jerk = " rms ( slider.ax ) "
hits = "impacts(wrist)"
"""


def problems(text, **changes):
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text, "press.toml", changes=changes)
    return str(caught.value)


def test_features_of_a_file_are_those_of_runs_and_studies(tmp_path):
    template = cc.loads(CRANK + FEATURES)
    expected = {"peak force": cc.features.peak("wrist.normal_force"), "jerk": cc.features.rms("slider.ax")}
    assert template.features == expected | {"hits": cc.features.impacts("wrist")}
    short = {"duration": 2e-3, "skip": 0.0, "samples": 5}
    run = template.simulate(**short)
    assert run.settings.features == tuple(template.features.values())
    assert run.features.shape == (2, 3)
    direct = cc.simulate(template(), outputs=["slider.ax"], **short)
    assert run.feature(cc.features.rms("slider.ax"), cycles=2) == pytest.approx(
        direct.feature(cc.features.rms("slider.ax"), cycles=2), rel=1e-12
    )
    result = template.study(**short).sample(3)
    assert result.features.names == ("peak force", "jerk", "hits")
    again = cc.load(template.save(tmp_path / "crank"))
    assert (again, again.features, again.run) == (template, template.features, template.run)
    assert again() == template()


@pytest.mark.parametrize(
    "line",
    [
        'force = "peek(slider.ax)"',
        'force = "peak(slider.az)"',
        'force = "impacts(guide)"',
        'force = "peak()"',
        'force = "slider.ax"',
        "force = 3",
    ],
)
def test_wrong_features_have_their_line(line):
    text = f"{CRANK}\n[features]\n{line}\n"
    told = problems(text)
    assert re.match(rf"press.toml:{text.count(chr(10), 0, text.index(line)) + 1}:\d+: features.force", told)


@pytest.mark.parametrize(
    ("right", "wrong", "path"),
    [
        ("samples = 721", "samples = 1", "run.samples"),
        ("samples = 721", "samples = 7.5", "run.samples"),
        ("samples = 721", "samples = 721\nrtol = 5", "run.rtol"),
        ("samples = 721", 'samples = 721\nmethod = "rodas"', "run.method"),
        ("samples = 721", "samples = 721\ncycles = 0", "run.cycles"),
        ('skip = "30 ms"', 'skip = "-30 ms"', "run.skip"),
        ('"slider.vx"', '"slider.vz"', "run.outputs[1]"),
        ('outputs = ["slider.x", ', "outputs = [3, ", "run.outputs"),
    ],
)
def test_wrong_settings_are_found_when_the_file_is_read(right, wrong, path):
    assert right in CRANK
    told = problems(CRANK.replace(right, wrong))
    assert told.startswith("press.toml:") and f": {path}: " in told and "\n    | " in told


def test_every_fit_follows_the_formulas_of_iso_286():
    pytest.importorskip("pressfit", reason="the extra chebclear[fits] is not installed")
    sizes = [10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500]
    grades = {5: 7, 6: 10, 7: 16, 8: 25, 9: 40, 10: 64, 11: 100}
    shafts = {"d": (16, 0.44), "e": (11, 0.41), "f": (5.5, 0.41), "g": (2.5, 0.34)}
    for below, size in zip([6, *sizes], sizes, strict=False):
        middle = math.sqrt(below * size)
        unit = 0.45 * middle ** (1 / 3) + 0.001 * middle
        for grade, count in grades.items():
            for letter, (factor, power) in shafts.items():
                side = radial_clearance(f"{size} H{grade}/{letter}{grade}")
                gap = factor * middle**power
                # The tables are rounded to whole um and to preferred numbers.
                assert 2e6 * side.lower == pytest.approx(gap, rel=0.06, abs=1.01)
                assert 2e6 * (side.upper - side.lower) == pytest.approx(2 * count * unit, rel=0.06, abs=1.01)


def test_a_fit_gives_a_clearance_its_interval():
    pytest.importorskip("pressfit", reason="the extra chebclear[fits] is not installed")
    given = 'clearance = { nominal = "20 um", note = "radial; the bearing is 40 um wider than its journal" }'
    assert given in CRANK
    template = cc.loads(CRANK.replace(given, 'clearance = { fit = "25 H7/f6" }'))
    clearance = template.parameters["clearance"]
    assert (clearance.interval, clearance.unit) == (cc.Interval(10e-6, 27e-6), "um")
    assert clearance.note == "radial; 25 H7/f6 leaves 20 to 54 um between the diameters"
    assert template().joints[2].clearance == template.intervals["clearance"].midpoint
    for fit in ("25 H7/k6", "25 H7/h6", "25 H7", "25 P7/h6", "900 H7/f6"):
        told = problems(CRANK.replace(given, f'clearance = {{ fit = "{fit}" }}'))
        assert f'parameters.clearance.fit: "{fit}" ' in told
    assert "parameters.clearance" in problems(
        CRANK.replace(given, 'clearance = { fit = "25 H7/f6", rel = 0.1 }')
    )


def test_a_fit_without_its_package_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "pressfit", None)
    told = problems('bodies = []\njoints = []\nparameters.c = { fit = "25 H7/f6" }\n')
    assert "install chebclear[fits], or give limits instead" in told


@pytest.mark.parametrize(
    ("written", "exponent"),
    [('"3.3e11 N/m"', ""), ('"3.3e11 N/m^1.5"', "exponent = 1.4, "), ('"3.3e11 N/m^1.5"', "exponent = 1, ")],
)
def test_the_unit_of_a_stiffness_must_fit_the_exponent(written, exponent):
    told = problems(CRANK.replace(STIFFNESS, f"{exponent}stiffness = {written}"))
    assert "joints[2].contact.stiffness" in told


@pytest.mark.parametrize(
    ("written", "exponent", "expected"),
    [
        ('"3.3265e11 N/m^1.5"', "", 3.3265e11),
        ('"10519.3 kN/mm^1.5"', "", 10519.3e3 * 1000.0**1.5),
        ('"2e8 N/m"', "exponent = 1, ", 2e8),
        ('"2e8 N/m^1.5"', 'exponent = "1 + clearance / clearance", ', 2e8),  # may be anything: not judged
    ],
)
def test_a_stiffness_is_converted_by_its_exponent(written, exponent, expected):
    template = cc.loads(CRANK.replace(STIFFNESS, f"{exponent}stiffness = {written}"))
    assert template().joints[2].contact.stiffness == pytest.approx(expected, rel=1e-15)


def test_all_numbers_of_a_parameter_have_one_dimension():
    rod = 'rod_length = { nominal = "120 mm", rel = 0.1 }'
    assert rod in CRANK
    for wrong in (
        'rod_length = { nominal = "120 mm", plus = "1 kg" }',
        'rod_length = { limits = ["119 mm", "121 ms"] }',
        'rod_length = { nominal = "120 mm", plus = "1 mm", unit = "s" }',
    ):
        assert "parameters.rod_length" in problems(CRANK.replace(rod, wrong))
    outside = 'rod_length = { nominal = "130 mm", limits = ["119 mm", "121 mm"] }'
    assert "parameters.rod_length.nominal" in problems(CRANK.replace(rod, outside))


def test_broken_powers_are_converted():
    # 1 mm^1.5 = 1e-4.5 m^1.5
    assert convert("1 mm^1.5", "m^1.5") == pytest.approx(10**-4.5, rel=1e-15)
    with pytest.raises(UnitError):
        convert("1 mm^1.4", "m^1.5")


def test_values_are_replaced_by_their_names():
    changes = {
        "rod_length": 0.13,
        "parameters.crank_length.rel": 0.05,
        "joints.wrist.clearance": "0.2 mm",
        "bodies.2.mass": "rod_mass / 2",
        "drives.drive.speed": "1000 rpm",
        "run.outputs": '["slider.x"]',
        "features.peak": "peak(slider.ax)",
    }
    template = cc.loads(CRANK, changes=changes)
    scene = template()
    assert template.values()["rod_length"] == 0.13
    assert template.intervals["rod_length"] == cc.Interval.around(0.13, rel=0.1)
    assert template.intervals["crank_length"] == cc.Interval.around(0.05, rel=0.05)
    assert (scene.joints[2].clearance, scene.bodies[2].mass) == (2e-4, 0.105)
    assert scene.drives[0].speed == cc.rpm(1000)
    assert (template.run["outputs"], list(template.features)) == (["slider.x"], ["peak"])
    assert cc.loads(CRANK, changes={}) == cc.loads(CRANK)


def test_wrong_changes_are_named_and_stand_at_no_line():
    told = problems(CRANK, **{"joints.wirst.clearance": 1, "rod_lenth": 2})
    assert "press.toml: joints.wirst.clearance: " in told and "press.toml: rod_lenth: " in told
    told = problems(CRANK, **{"joints.wrist.clearance": "20 kg"})
    assert told.startswith('press.toml: joints[2].clearance: "20 kg"')
    assert "|" not in told


def test_the_schema_knows_all_tables():
    validator = jsonschema.Draft4Validator(scene_file_schema())
    values = tomllib.loads(CRANK + FEATURES)
    values["parameters"]["clearance"] = {"fit": "25 H7/f6"}
    validator.validate(values)
    for name, wrong in [("features", {"a": "peek(x)"}), ("features", {"a": 3}), ("run", {"cycle": 2})]:
        assert not validator.is_valid(json.loads(json.dumps(values)) | {name: wrong})


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_report_carries_the_scene_file_in_a_script_that_runs(capsys):
    from chebclear.study.report.script import study_listings

    template = cc.loads(CRANK, changes={"rod_length.note": "with '''quotes'''", "rod_mass": "0.2 kg"})
    for each in (template, cc.loads(CRANK)):
        result = each.study(duration=1e-3, skip=0.0, samples=5, outputs=["slider.x"]).sample(3)
        listing, _ = study_listings(result)
        made = {}
        exec(listing.text, made)
        assert made["build"] == each
        assert made["result"]["slider.x"].intervals == result["slider.x"].intervals
        assert (made["result"]["slider.x"].runs == result["slider.x"].runs).all()
