"""Distributions of production in scene files: what is read, written and refused."""

from math import pi, sqrt

import chebclear as cc
import jsonschema
import pytest
from chebclear.templates.changes import changed
from chebclear.templates.reference.json_schema import scene_file_schema
from scipy import stats

FILE = """
format = 1
bodies = [{{ name = "bob", mass = 1, inertia = 1, points.A = ["-length / 2", 0] }}]
joints = [{{ type = "revolute", name = "pin", a = "ground", b = "bob.A" }}]

[parameters]
length = {{ {} }}
"""
AROUND = 'nominal = "50 mm", plus = "60 um", minus = "20 um", '
SAMPLE = 'sample = ["50.01 mm", "50.02 mm", "50.02 mm", "50.03 mm", "50.05 mm"]'


def read(text):
    """The parameter, and the template back from what it writes."""
    template = cc.loads(FILE.format(text))
    again = cc.loads(template.to_toml())
    assert again == template and again.parameters == template.parameters
    jsonschema.validate(template.source, scene_file_schema())
    return template.parameters["length"]


def test_limits_and_capability():
    # The middle of the limits is 50.02 mm; the nearer one is 35 um from the mean, 3.99 standard deviations.
    one = read(AROUND + 'distribution = "normal", cpk = 1.33, shift = "5 um"').distribution
    assert one.moments == pytest.approx((0.050025, 35e-6 / 3.99), rel=1e-9) and one.unit == "mm"
    one = read(AROUND + 'distribution = "normal", cpk = 1.33, parts = 50').distribution
    bound = 1.33 * (1.0 - stats.norm.ppf(0.95) * sqrt(1.0 / (450.0 * 1.33**2) + 1.0 / 98.0))
    assert one.moments == pytest.approx((0.05002, 40e-6 / (3.0 * bound)), rel=1e-9)
    one = read(AROUND + 'distribution = "normal", cp = 2, shift = 1.5').distribution
    assert one.moments == pytest.approx((0.05003, 40e-6 / 6.0), rel=1e-9)


def test_inspected_and_skewed_parts():
    one = read(AROUND + 'distribution = "normal", cpk = 0.67, inspected = true').distribution
    truth = stats.truncnorm(-2.01, 2.01, 0.05002, 40e-6 / 2.01)
    assert one.support == pytest.approx((0.04998, 0.05006), rel=1e-14)
    assert one.quantile(0.1) == pytest.approx(truth.ppf(0.1), rel=1e-12)
    one = read(AROUND + 'distribution = "skewed"').distribution
    assert one.mean == pytest.approx(0.05 + sqrt(2.0 / pi) * 40e-6 / 3.0, rel=1e-12)
    one = read(AROUND + 'distribution = "skewed", inspected = true').distribution
    assert one.scrapped == pytest.approx(2.0 * stats.norm.sf(3.0), rel=1e-9)
    whole = read(AROUND + 'distribution = "skewed", inspected = false').distribution
    assert isinstance(whole, cc.results.Skewed)


def test_samples_and_eccentricities_bring_their_interval():
    one = read(SAMPLE)
    assert one.interval == cc.Interval("50.01 mm", "50.05 mm", "50.02 mm") == one.distribution.interval
    assert one.nominal == pytest.approx(0.05002) and one.unit == one.distribution.unit == "mm"
    one = read(SAMPLE + ', limits = ["49.9 mm", "50.1 mm"]')
    assert one.distribution.support == pytest.approx((0.0499, 0.0501))
    values = [0.05001, 0.05002, 0.05002, 0.05003, 0.05005]
    one = read(SAMPLE + ', distribution = "normal"').distribution
    assert one == cc.distributions.sampled(values).as_normal()
    text = ', distribution = "normal", limits = ["50 mm", "50.04 mm"], inspected = true'
    one = read(SAMPLE + text).distribution
    assert one.process == cc.distributions.sampled(values).as_normal()
    assert one.support == pytest.approx((0.05, 0.05004))
    one = read('deviation = "5 um"')
    assert one.distribution == cc.distributions.eccentric("5 um") and one.nominal == 0.0
    one = read('tolerance = "20 um", distribution = "eccentric"')
    assert one.interval == cc.Interval(0.0, "10 um", 0.0)


def test_changes_keep_the_dimension_of_a_sample():
    source = cc.loads(FILE.format(SAMPLE)).source
    assert changed(source, {"length.limits": '["49.9 mm", "50.1 mm"]'})[0]["parameters"]["length"]["limits"]
    with pytest.raises(cc.errors.SceneError, match="dimension"):
        changed(source, {"length.sample": "2 N"})
    capable = cc.loads(FILE.format(AROUND + 'distribution = "normal", cpk = 1.33')).source
    with pytest.raises(cc.errors.SceneError, match="dimension"):
        changed(capable, {"length.shift": "2 N"})
    assert changed(capable, {"length.cpk": 1.0})[0]["parameters"]["length"]["cpk"] == 1.0


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        (AROUND + "cpk = 1.33, parts = 50", {"cpk", "parts"}),
        (AROUND + 'distribution = "normal", cpk = -1, parts = 1, shift = "2 mm"', {"cpk", "parts", "shift"}),
        (AROUND + 'distribution = "normal", cpk = 1, shift = "2 N", parts = 2.5', {"shift", "parts"}),
        (AROUND + 'distribution = "normal", cp = 2, shift = "5 um"', {"shift"}),
        (AROUND + 'distribution = "normal", shift = "5 um"', {"cpk"}),
        (AROUND + 'distribution = "normal"', {"distribution"}),
        (AROUND + 'distribution = "skewed", cpk = 1', {"cpk"}),
        (AROUND + 'distribution = "skewed", inspected = 1', {"inspected"}),
        (AROUND + 'distribution = "triangular", inspected = true', {"inspected"}),
        (AROUND + 'distribution = "sampled"', {"distribution"}),
        ('sample = ["1 mm", "2 N", "3 mm", "four", "5 mm"]', {"sample[1]", "sample[3]"}),
        ('sample = ["1 mm", "2 mm"]', {"sample"}),
        ('sample = "bores.csv"', {"sample"}),
        (SAMPLE + ', limits = ["50.02 mm", "50.03 mm"]', {"limits"}),
        (SAMPLE + ', distribution = "normal", cpk = 1.0', {"cpk"}),
        (SAMPLE + ', distribution = "normal", limits = ["49 mm", "51 mm"]', {"limits"}),
        (SAMPLE + ', nominal = "50.02 mm", plus = "1 mm"', {"length"}),
        (SAMPLE + ", inspected = true", {"inspected"}),
        ('deviation = "5 um", tolerance = "5 um"', {"deviation"}),
        ('deviation = "-5 um"', {"deviation"}),
    ],
)
def test_what_does_not_fit_is_named_at_its_key(text, wrong):
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(FILE.format(text))
    found = {problem.path.rpartition("length.")[2] for problem in caught.value.problems}
    found = {path.rpartition("parameters.")[2] for path in found}
    assert found == wrong
