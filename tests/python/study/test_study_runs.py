"""How many runs a study starts unasked, and what it passes on of their warnings."""

import warnings
from functools import partial

import chebclear as cc
import pytest
from chebclear.execution.batch import GatheredNotices
from chebclear.notices import Notice
from notices import codes
from refusals import refuses

BOX = {name: cc.Interval(1.0, 2.0) for name in "abcde"}


def resting(**parameters):
    return cc.Scene([cc.Body("block", sum(parameters.values()), 0.1)], [])


def study(build=resting, names="a", **options):
    parameters = {name: BOX[name] for name in names}
    return cc.Study(build, parameters, outputs=["block.y"], duration=0.1, samples=3, **options)


def never(**parameters):
    raise AssertionError("a run was started")


def test_thousands_of_runs_are_not_started_unasked():
    many = study(never, "abcde")
    for ask in (lambda: many.scan(10), lambda: many.chebyshev(7), lambda: cc.study_tradeoff(many)):
        with pytest.raises(ValueError):
            ask()
    for wrong in (0, 1.5, "all"):
        for start in (many.scan, many.chebyshev, partial(cc.study_tradeoff, many)):
            with refuses("max_runs"):
                start(max_runs=wrong)


def test_runs_that_are_asked_for_are_started():
    few = study(names="ab")
    with pytest.raises(cc.errors.ArgumentError):
        few.scan(3, max_runs=8)
    assert len(few.scan(3, max_runs=9).parameters) == 9
    assert len(few.chebyshev(2, max_runs=9).parameters) == 12
    with pytest.raises(ValueError):
        cc.study_tradeoff(few, [1], [], [], holdout=4, max_runs=11)
    assert cc.study_tradeoff(few, [1], [], [], holdout=4, max_runs=12).reference_runs == 8 + 4


def gathered(runs):
    """Texts and numbers of runs of the notices of some."""
    found = GatheredNotices()
    for number in reversed(range(len(runs))):  # runs end in any order
        found.add(number, runs[number])
    return [(one.text, one.numbers) for one in found.of(len(runs), lambda numbers: "")]


def test_notices_of_one_kind_are_one_whatever_their_numbers():
    def told(joint, percent):
        return Notice("creep", f"{joint}: {percent} %", (joint,), {"share": 0.01 * percent})

    runs = [
        [told("pin1", 10 + k), told("pin2", 20), told("3", 3), Notice("unsettled", "odd")] for k in range(3)
    ]
    runs[0].append(told("pin1", 99))
    counts = {"runs": 3.0, "of_runs": 4.0}
    assert gathered([*runs, []]) == [
        ("pin1: 10 % (in 3 of 4 runs)", {"share": 0.1, **counts}),
        ("pin2: 20 % (in 3 of 4 runs)", {"share": 0.2, **counts}),
        ("3: 3 % (in 3 of 4 runs)", {"share": 0.03, **counts}),
        ("odd (in 3 of 4 runs)", counts),
    ]


def test_what_build_warns_of_is_in_the_result():
    def build(a):
        warnings.warn(f"odd since a = {a:.3f}", cc.ChebclearWarning, stacklevel=1)
        warnings.warn("old", DeprecationWarning, stacklevel=1)
        return resting(a=a)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        result = study(build).scan(4)
    assert result.warnings == ("odd since a = 1.000 (in 5 of 5 runs)",)
    assert [str(one.message) for one in caught] == ["old", *result.warnings]
    with warnings.catch_warnings(), pytest.raises(cc.ChebclearWarning):
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", cc.ChebclearWarning)
        study(build).scan(4)


def test_mechanisms_that_jam_are_told_of_in_a_study():
    def jamming(crank):
        return cc.mechanisms.four_bar(crank_length=crank, clearance_at=("rocker_pin",))

    lengths = {"crank": cc.Interval(0.04, 0.07)}
    with pytest.warns(cc.ChebclearWarning):
        result = cc.Study(jamming, lengths, outputs=["crank.angle"], duration=1e-4, samples=2).scan(2)
    assert "build" in codes(result)
