"""The tolerance that a requirement needs, against closed forms, and when none is named."""

import math
import re
from dataclasses import replace

import chebclear as cc
import numpy as np
import pytest
from chebclear.notices import Notice, changes_answer
from chebclear.report.document import Verdict
from chebclear.study.report.document import study_document
from chebclear.study.requirements.document import (
    Tolerance,
    conformance_document,
    specification,
    what_to_do,
)
from chebclear.study.requirements.needed import needed_tolerance

T = [0.0, 0.5, 1.0]
# Of a normal distribution 99 % are within so many standard deviations.
WITHIN = 2.5758293035489004


def stack(gap, thread):
    return {"t": T, "play": [gap - thread] * 3}


def shares(gap, thread, runs=4000, model=stack, **limits):
    study = cc.Study(
        model, {"gap": gap, "thread": thread}, units=dict.fromkeys(("play", "gap", "thread"), "m")
    )
    found = cc.conformance(study, {"loose": cc.require("play", **limits)}, runs)
    return found, study.intervals


def needed(found, sides):
    return needed_tolerance(found["loose"], found.parameters, found.parameter_names, sides)


def test_the_tolerance_of_a_sum_of_normal_ones_is_that_of_the_closed_form():
    found, sides = shares(cc.normal(10.1, 0.03), cc.normal(10.0, 0.01), above=0.05, below=0.15)
    deviation = math.sqrt((0.05 / WITHIN) ** 2 - 0.01**2)
    answer = needed(found, sides)
    assert (answer.parameter, answer.share, answer.nominal_is_outside) == ("gap", 0.99, False)
    assert answer.part == pytest.approx(deviation / 0.03, rel=0.06)
    # It is checked by drawing such mechanisms.
    again, _ = shares(cc.normal(10.1, answer.part * 0.03), cc.normal(10.0, 0.01), above=0.05, below=0.15)
    assert again["loose"].lower < 0.99 < again["loose"].upper


def test_the_tolerance_of_a_uniform_product_with_a_share_of_999():
    """Of gap alone, uniform to either side, the part (1 - a) of the interval is outside of its limit."""
    side = cc.uniform(1.0, 3.0)
    found, sides = shares(
        side, cc.uniform(0.0, 1e-6), model=lambda gap, thread: stack(gap**2, thread), below=8.95
    )
    assert 0.99 < found["loose"].share < 0.999
    answer = needed(found, sides)
    # 2 + part reaches the limit, but for one in a thousand of 2 part.
    assert (answer.parameter, answer.share) == ("gap", 0.999)
    assert 2.0 + answer.part * (1.0 - 0.002) == pytest.approx(math.sqrt(8.95), abs=2e-3)


def test_where_no_tolerance_helps_that_is_said():
    found, sides = shares(cc.normal(10.16, 0.03), cc.normal(10.0, 0.01), below=0.15)
    assert needed(found, sides).nominal_is_outside
    tolerances = {name: Tolerance(side, "m") for name, side in sides.items()}
    assert what_to_do(found, tolerances)[0].startswith("No tolerance helps: the mechanism at the nominal")
    # Each of two equal ones is more than the limits allow alone.
    found, sides = shares(cc.normal(10.1, 0.03), cc.normal(10.0, 0.03), above=0.05, below=0.15)
    both = needed(found, sides)
    deviation = 0.05 / WITHIN / math.sqrt(2.0)
    assert both.parameter == "" and both.part == pytest.approx(deviation / 0.03, rel=0.06)
    tolerances = {name: Tolerance(side, "m") for name, side in sides.items()}
    (text,) = what_to_do(found, tolerances)
    assert text.startswith("To do: no single tolerance is enough. With all of them closed to about ")


def test_nothing_is_said_where_the_runs_do_not_tell():
    def scattered(gap, thread):
        return stack(np.sin(1e7 * gap * (1.0 + thread)), 0.0)

    found, sides = shares(cc.uniform(0.0, 1.0), cc.uniform(0.0, 1.0), 400, scattered, below=0.5)
    assert found["loose"].outside > 100 and needed(found, sides) is None
    kept, sides = shares(cc.normal(10.1, 0.01), cc.normal(10.0, 0.01), 400, below=1.0)
    assert needed(kept, sides) is None
    few, sides = shares(cc.normal(10.1, 0.03), cc.normal(10.0, 0.01), 50, above=0.05, below=0.15)
    assert needed(few, sides) is None, "one of 50 is more than one of 100"


def test_the_first_lines_say_what_fails_by_how_much_and_what_to_do():
    found, sides = shares(
        cc.normal("10.1 mm", "0.03 mm"), cc.normal("10 mm", "0.01 mm"), below="0.13 mm", above="0.01 mm"
    )
    tolerances = {name: Tolerance(side, "m", ("mm",)) for name, side in sides.items()}
    document = conformance_document(found, "A stack", tolerances)
    verdict, share, todo = document.answer
    loose = found["loose"]
    beyond = 1e3 * (loose.highest.max() - 0.13e-3)
    assert isinstance(verdict, Verdict) and verdict.judgment == "bad"
    assert verdict.word.startswith(f"loose fails in {loose.outside} of 4,000 mechanisms: ")
    assert float(re.search(r"([\d.]+) mm beyond", verdict.word)[1]) == pytest.approx(beyond, rel=1e-2)
    assert "in specification, between" in share
    now, then = re.search(r"instead of ±([\d.]+) mm", todo)[1], re.search(r"gap ±([\d.]+) mm", todo)[1]
    assert float(now) == 0.09, "three standard deviations"
    assert 0.0 < float(then) < 0.09 and len(then.lstrip("0.")) <= 2, "no more digits than are known"
    kept = replace(loose, outside=0, counts=np.array([[4000, 0]]))
    (line,) = specification(replace(found, shares={"loose": kept}))
    assert line.judgment == "good" and line.word.startswith("All 4,000 mechanisms keep to the requirement")


def energy(share, runs=1.0, of_runs=1.0):
    return Notice(
        "energy_balance", f"energy {share} in {runs}", (), {"share": share, "runs": runs, "of_runs": of_runs}
    )


def test_a_notice_is_shown_beside_the_answer_only_where_it_may_change_it(tmp_path):
    assert changes_answer(energy(0.02, 1999, 2000)) and not changes_answer(energy(0.02, 1, 2000))
    assert not changes_answer(energy(0.0015, 2000, 2000)), "three digits are the same"
    creep = Notice("creep", "it creeps", ("wrist",), {"share": 0.5, "creep": 1e-6})
    assert not changes_answer(creep)
    assert changes_answer(Notice("failed", "two failed", (), {"runs": 2, "of_runs": 2000}))
    assert changes_answer(Notice("settling", "widest at the start"))
    study = cc.Study(stack, {"gap": cc.Interval(10.0, 10.2), "thread": cc.Interval(9.9, 10.0)})
    large = replace(energy(0.3, 900, 2000), text="the energy is off")
    result = replace(study.sample(20), notices=(creep, energy(0.0015, 1, 2000), large))
    document = study_document(result, None)
    assert [text for text in document.doubts if "creep" in text or "energy" in text] == ["The energy is off."]
    (section,) = [one for one in document.sections if one.title == "Warnings"]
    assert list(section.blocks[0].items) == ["the energy is off", "it creeps", "energy 0.0015 in 1"]
    printed = str(result)
    assert [line for line in printed.splitlines() if line.startswith("warning:")] == [
        "warning: the energy is off"
    ]
    assert "2 notices more" in printed
