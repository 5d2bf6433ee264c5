"""Distributions of production in studies: what is kept, shown and allocated."""

import json

import chebclear as cc
import pytest
from refusals import refuses

KINDS = {
    "bore": cc.distributions.capable("9.99 mm", "10.03 mm", 1.33, shift="5 um", parts=50),
    "drift": cc.distributions.capable("9.99 mm", "10.03 mm", cp=1.33, shift=-1.5),
    "pin": cc.distributions.inspected(cc.distributions.capable(9e-3, 9.1e-3, 0.67)),
    "rod": cc.distributions.skewed("49.98 mm", "50 mm", "50.06 mm"),
    "disc": cc.distributions.sampled([2.0, 2.1, 2.3, 2.15, 2.2], lower=1.9),
    "offset": cc.distributions.eccentric("5 um"),
    "hole": cc.distributions.eccentric(tolerance="20 um"),
}


def total(bore, drift, pin, rod, disc, offset, hole):
    return {"total": bore + drift + pin + rod + disc + offset + hole}


def test_specifications_results_and_scripts_keep_them(tmp_path):
    study = cc.Study(total, KINDS, units=dict.fromkeys(KINDS, "m"))
    spec = study.sample(20).spec
    facts = json.loads(json.dumps(spec.facts()))
    again = type(spec).from_facts(facts)
    assert again.parameters == spec.parameters == KINDS
    assert {name: one.unit for name, one in again.parameters.items()} == {
        name: one.unit for name, one in KINDS.items()
    }
    found = cc.conformance(study, cc.require("total", below=2.4), 200)
    path = found.save(tmp_path / "shares.npz")
    assert cc.load_result(path) == found
    result = study.sample(20)
    loaded = cc.load_result(result.save(tmp_path / "result.npz"))
    assert loaded.spec.parameters == KINDS
    assert "(normal, inspected, 4.4 % scrapped, taken as an interval)" in str(result)
    assert "(sample of 5, taken as an interval)" in str(result)


def test_what_has_a_tolerance_may_be_allocated():
    """Two that cost and count alike are the cheapest if equal; of a lognormal one no tolerance is chosen."""

    def pair(disc, rod):
        return {"sum": disc + rod}

    cost = dict.fromkeys(("disc", "rod"), lambda tolerance: 1.0 / tolerance)
    made = cc.distributions.capable(0.99, 1.01, 1.0)
    good = cc.distributions.inspected(cc.lognormal(2.0, 0.1), 1.9, 2.2)
    with refuses('cost["disc"]'):
        cc.allocate(cc.Study(pair, {"disc": good, "rod": made}), cost, cc.require("sum", below=3.0))
    found = cc.allocate(
        cc.Study(pair, {"disc": made, "rod": made}),
        cost,
        cc.require("sum", above=1.98, below=2.02),
        share=0.99,
    )
    assert found["disc"].after == pytest.approx(found["rod"].after, rel=1e-3)
