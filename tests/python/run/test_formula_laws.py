"""Contact and friction laws as formulas, against the laws that are built in and against closed forms."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refused

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

ContactFormula, FrictionFormula = cc.laws.ContactFormula, cc.laws.FrictionFormula
Expression = cc.motions.Expression
METHODS = ["rodas5p", "rodas4", "dop853", "adams"]
MASS, SPEED, CLEARANCE = 0.3, 0.4, 1e-3


def exact_damping(c):
    """The root d of (1 + d) / (1 - c d) = exp(d (1 + c)), by halving."""
    low, high = 0.75 * (1.0 - c * c) / (1.0 + c**3), 1.0 / c
    for _ in range(60):
        d = 0.5 * (low + high)
        if math.log1p(d) - math.log1p(-c * d) < d * (1.0 + c):
            low = d
        else:
            high = d
    return 0.5 * (low + high)


# In the order of operations of the laws, so that rounding errors are the same.
HERTZ = "penetration*sqrt(penetration)*1e10"
LAWS = {
    "Hertz": (cc.laws.Hertz(1e10), HERTZ),
    "linear": (cc.laws.Hertz(1e7, 1.0), "penetration**1.0*1e7"),
    "power": (cc.laws.Hertz(1e8, 1.2), "penetration**1.2*1e8"),
    "LankaraniNikravesh": (
        cc.laws.LankaraniNikravesh(1e10, 0.9),
        f"{HERTZ}*(penetration_rate*(0.75*(1 - 0.9*0.9)/impact_velocity) + 1)",
    ),
    "Flores": (
        cc.laws.Flores(1e10, 0.1),
        f"{HERTZ}*(penetration_rate*(1.6*(1 - 0.1)/(0.1*impact_velocity)) + 1)",
    ),
    "ExactRestitution": (
        cc.laws.ExactRestitution(1e10, 0.5),
        f"{HERTZ}*(penetration_rate*({exact_damping(0.5)!r}/impact_velocity) + 1)",
    ),
    "HuntCrossley": (cc.laws.HuntCrossley(1e10, 0.5), f"{HERTZ}*(penetration_rate*0.5 + 1)"),
    "KelvinVoigt": (cc.laws.KelvinVoigt(2e7, 300.0), "penetration**1.0*2e7 + 300*penetration_rate"),
}
TANH = (cc.laws.SmoothedCoulomb(0.1, 5e-3), "tanh(sliding_velocity*200)*0.1")
# The core takes 1.5e-3 - 1e-3 as the width.
MODIFIED = (
    cc.laws.ModifiedCoulomb(0.1, 0.05, 1e-3, 1.5e-3),
    "if(abs(sliding_velocity) < 1e-3, sin(sliding_velocity*(pi/2/1e-3))*0.1, "
    "if(abs(sliding_velocity) > 1.5e-3, 0.05*sign(sliding_velocity), "
    "sign(sliding_velocity)*(0.075 + 0.025*cos((abs(sliding_velocity) - 1e-3)*(pi/(1.5e-3 - 1e-3))))))",
)


def wrist(law, friction=None):
    scene = cc.mechanisms.slider_crank(clearance=2e-5)
    joints = [
        dataclasses.replace(joint, contact=law, friction=friction, sliding="surface")
        if isinstance(joint, cc.ClearanceRevolute)
        else joint
        for joint in scene.joints
    ]
    return dataclasses.replace(scene, joints=joints)


def impact(law, friction=None, method="dop853", rtol=1e-10, **start):
    """A journal that flies head-on into its bearing, without weight, until it has left it again."""
    rate = (SPEED, start.pop("across", 0.0))
    scene = cc.Scene(
        [cc.Body("journal", MASS, 1e-4)],
        [cc.ClearanceRevolute("bearing", "ground", "journal", 0.01, CLEARANCE, law, friction)],
        start=[cc.ClearanceStart("bearing", (0.0, 0.0), rate)],
    )
    outputs = ["*", "energy.*"]
    return cc.simulate(scene, duration=8e-3, samples=801, rtol=rtol, method=method, outputs=outputs)


def assert_same(built_in, formula, tolerance=1e-13):
    if tolerance != 1e-9:
        assert built_in.stats == formula.stats
    for name in ("slider.x", "slider.ax", "wrist.penetration", "wrist.friction_force", "energy.contact"):
        scale = np.max(np.abs(built_in[name]))
        np.testing.assert_allclose(formula[name], built_in[name], rtol=0.0, atol=tolerance * scale)


class TestLawsThatAreBuiltIn:
    @pytest.mark.parametrize(
        ("name", "friction", "method"),
        [*((name, TANH, "dop853") for name in LAWS), *(("Flores", None, method) for method in METHODS)],
    )
    def test_the_same_law_retyped_makes_the_same_run(self, name, friction, method):
        law, text = LAWS[name]
        coefficient = friction and FrictionFormula(friction[1])
        runs = [
            cc.simulate(
                wrist(*laws), duration=2e-3, samples=101, rtol=1e-8, method=method, outputs=["*", "energy.*"]
            )
            for laws in ((law, friction and friction[0]), (ContactFormula(text), coefficient))
        ]
        assert len(runs[0].contacts) > 0
        # The elastic energy of a power is found by quadrature; the constant of an exact restitution is known
        # to a rounding or two, each of which moves the samples of this run by 1e-11.
        assert_same(*runs, tolerance={"power": 1e-8, "ExactRestitution": 1e-9}.get(name, 1e-13))

    def test_friction_with_pieces_agrees_within_the_tolerance(self):
        """The formula ends steps at its kinks, which the built-in law has inside them."""
        law = cc.laws.LankaraniNikravesh(1e10, 0.9)
        runs = [
            cc.simulate(wrist(law, friction), duration=0.01, samples=201, rtol=1e-9)
            for friction in (MODIFIED[0], FrictionFormula(MODIFIED[1]))
        ]
        scale = np.max(np.abs(runs[0]["slider.vx"]))
        np.testing.assert_allclose(runs[1]["slider.vx"], runs[0]["slider.vx"], rtol=0.0, atol=1e-6 * scale)

    @pytest.mark.parametrize("method", METHODS)
    def test_a_damper_that_grows_over_a_depth_changes_its_form_there(self, method):
        """The built-in law has the kink of its damper inside a step; both are within the tolerance."""
        depth, part = 2e-5, "min(penetration/2e-5, 1)"
        text = f"penetration**1.4*1e9 + 400*{part}**2*(3 - 2*{part})*penetration_rate"
        built_in = impact(cc.laws.Impact(1e9, 400.0, depth, 1.4), method=method)
        formula = impact(ContactFormula(text), method=method)
        assert formula["journal.vx"][-1] == pytest.approx(built_in["journal.vx"][-1], rel=1e-6)
        switches = formula.events.time[formula.events.kind == "switch"]
        assert len(switches) == 2  # on the way in and out
        for instant in switches:
            place = np.interp(instant, formula.t, formula["bearing.penetration"])
            assert place == pytest.approx(depth, rel=3e-2)
        # Closer than that of the built-in law, whose kink lies inside a step.
        assert np.max(np.abs(formula["energy.balance"])) < 1e-7 * 0.5 * MASS * SPEED**2


class TestClosedForms:
    @pytest.mark.parametrize("method", METHODS)
    def test_two_springs_one_behind_the_other(self, method):
        """Stiffness k up to a depth, K beyond it: the energy gives the peak, the rebound is elastic."""
        k, stiff, depth = 1e6, 1e8, 1e-4
        text = "if(penetration < depth, k*penetration, k*depth + stiff*(penetration - depth))"
        run = impact(
            ContactFormula(Expression(text, {"k": k, "stiff": stiff, "depth": depth})), method=method
        )
        energy = 0.5 * MASS * SPEED**2
        # k depth²/2 + k depth x + K x²/2 = E
        rest = energy - 0.5 * k * depth**2
        x = (-k * depth + math.sqrt((k * depth) ** 2 + 2.0 * stiff * rest)) / stiff
        assert run.contacts.peak_force[0] == pytest.approx(k * depth + stiff * x, rel=1e-6)
        assert -run["journal.vx"][-1] == pytest.approx(SPEED, rel=1e-8)
        assert list(run.events.kind) == ["onset", "switch", "switch", "separation"]
        assert set(run.events.joint) == {"bearing"}
        assert np.max(np.abs(run["energy.balance"])) < 1e-7 * energy

    @pytest.mark.parametrize("method", METHODS)
    def test_a_stiffness_that_falls_in_restitution_rebounds_with_the_root_of_the_ratio(self, method):
        """K in compression, c² K in restitution: the work of the way back is c² that of the way in."""
        text = "if(penetration_rate > 0, 1, c**2)*1e10*penetration**1.5"
        run = impact(ContactFormula(Expression(text, {"c": 0.6})), method=method)
        assert -run["journal.vx"][-1] == pytest.approx(0.6 * SPEED, rel=1e-7)
        assert run["energy.impact_loss"][-1] == pytest.approx(0.5 * MASS * SPEED**2 * 0.64, rel=1e-6)
        assert list(run.events.kind) == ["onset", "switch", "separation"]

    @pytest.mark.parametrize("method", METHODS)
    def test_friction_takes_the_impulse_of_its_coefficient(self, method):
        """A block falls askew on a stop: m vx = m gx t - I and m vy = m gy t - mu I for an impulse I."""
        law = cc.laws.ExactRestitution(1e8, 0.5)
        friction = FrictionFormula("0.2*tanh(sliding_velocity/1e-3)")
        scene = cc.Scene(
            [cc.Body("block", MASS, 1e-4)],
            [cc.Stop("stop", "ground.W", "block", (-1.0, 0.0), law, friction)],
            [cc.Gravity((30.0, 40.0))],
            ground={"W": (0.05, 0.0)},
        )
        run = cc.simulate(scene, duration=0.2, samples=401, rtol=1e-9, method=method)
        assert len(run.contacts) >= 2
        impulse = 30.0 * run.t - run["block.vx"]
        np.testing.assert_allclose(run["block.vy"], 40.0 * run.t - 0.2 * impulse, rtol=0.0, atol=1e-8)

    @pytest.mark.parametrize("method", METHODS)
    def test_a_law_that_would_pull_is_clipped(self, method):
        run = impact(ContactFormula("1e7*penetration + 2000*penetration_rate"), method=method)
        assert [str(kind) for kind in run.events.kind] == ["onset", "clip", "separation"]
        assert run["bearing.normal_force"].min() == 0.0


class TestEnergy:
    def test_the_balance_closes_for_a_law_with_everything(self):
        law = ContactFormula(
            "if(penetration < 2e-7, 1e10*penetration**1.5, 1e10*2e-7**1.5 + 3e7*(penetration - 2e-7))"
            "*(1 + 0.1*tanh(penetration_rate/impact_velocity))"
        )
        friction = FrictionFormula(
            "sign(sliding_velocity)*min(abs(sliding_velocity)/0.01, 0.1)/(1 + normal_force/500)"
        )
        run = cc.simulate(
            wrist(law, friction), duration=0.005, samples=101, rtol=1e-8, outputs=["*", "energy.*"]
        )
        largest = np.max(np.abs(run["energy.total"]))
        assert np.max(np.abs(run["energy.balance"])) < 1e-6 * largest
        assert np.all(np.diff(run["energy.friction_loss"]) >= 0.0)
        assert {"onset", "switch"} <= set(run.events.kind)


class TestWhereARunEnds:
    def test_a_law_without_a_number_ends_the_run_with_the_place(self):
        law = ContactFormula("1e9*penetration*sqrt(1 - penetration/5e-6)")
        with pytest.raises(cc.errors.SimulationError) as caught:
            impact(law)
        run = caught.value.trajectory
        assert run.status == "outside_domain"
        # 5 um at 0.4 m/s, slowed down.
        assert run["bearing.penetration"][np.isfinite(run["bearing.penetration"])].max() < 5e-6
        assert "penetration = " in str(caught.value)

    def test_dry_friction_by_the_sign_is_held_where_it_sticks(self):
        with pytest.raises(cc.errors.SimulationError) as caught:
            impact(
                ContactFormula("1e9*penetration**1.5"),
                FrictionFormula("0.1*sign(sliding_velocity)"),
                across=1e-3,
            )
        assert caught.value.trajectory.status == "held"
        assert caught.value.trajectory.joint == "bearing"


class TestScenesAndStudies:
    def test_a_study_varies_a_constant_of_a_formula(self):
        def build(stiffness):
            return wrist(ContactFormula(Expression("k*penetration*sqrt(penetration)", {"k": stiffness})))

        settings = {"duration": 1e-3, "samples": 11, "rtol": 1e-8}
        study = cc.Study(build, {"stiffness": cc.Interval(1e9, 1e10)}, ["wrist.penetration"], **settings)
        run = study.scan(3)["wrist.penetration"].runs[0]
        one = cc.simulate(wrist(cc.laws.Hertz(1e9)), **settings)["wrist.penetration"]
        np.testing.assert_allclose(run, one, rtol=0.0, atol=1e-9 * np.max(one))


class TestBadInput:
    @pytest.mark.parametrize(
        ("law", "friction", "path"),
        [
            ("1e10*penetraton", None, "contact.force"),
            ("1e10*wrist.penetration", None, "contact.force"),
            ("1e10*penetration*time", None, "contact.force"),
            ("1e10*penetration*(", None, "contact.force.text"),
            ("penetration*penetration_rate", None, "contact.force"),
            ("100 + 1e10*penetration", None, "contact.force"),
            ("-1e10*penetration", None, "contact.force"),
            ("1e10*penetration*(1 - penetration_rate)", None, "contact.force"),
            ("1e10*penetration", "0.1", "friction.coefficient"),
            ("1e10*penetration", "-0.1*tanh(sliding_velocity/0.1)", "friction.coefficient"),
            ("1e10*penetration", "penetration_rate/1", "friction.coefficient"),
            ("1e10*penetration", "0.1*tanh(sliding_velocity)", "friction.coefficient"),
        ],
    )
    def test_it_is_reported_by_its_path(self, law, friction, path):
        scene = wrist(ContactFormula(law), friction and FrictionFormula(friction))
        assert list(refused(scene)) == [f"joints[3].{path}"]

    def test_constants_that_are_not_used_or_hide_a_quantity(self):
        law = ContactFormula(Expression("k*penetration", {"k": math.nan, "penetration": 1.0, "more": 1.0}))
        assert {path.rpartition(".")[2] for path in refused(wrist(law))} == {"k", "penetration", "more"}


@pytest.mark.parametrize("method", METHODS)
def test_a_switch_over_a_power_of_the_penetration_lets_go(method):
    # Nowhere in the impact does the damping pull: the clipped force is the other one.
    bare = "2e9*penetration**1.5*(1 + 0.2*penetration_rate)"
    runs = [impact(ContactFormula(law), method=method, rtol=1e-8) for law in (bare, f"max(0, {bare})")]
    speeds = [run["journal.vx"][-1] for run in runs]
    assert runs[1].status == "done"
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-6)


def test_nothing_is_said_of_friction_where_there_is_none():
    # A journal that is pressed into its bearing, under damping that pulls it back for most of the time.
    for law in (cc.laws.KelvinVoigt(2e7, 3e4), ContactFormula("2e7*penetration + 3e4*penetration_rate")):
        scene = cc.Scene(
            [cc.Body("journal", MASS, 1e-4)],
            [cc.ClearanceRevolute("bearing", "ground", "journal", 0.01, CLEARANCE, law)],
            start=[cc.ClearanceStart("bearing", (0.0, 0.0), (SPEED, 0.0))],
        )
        for steps in range(10, 100, 5):
            with pytest.raises(cc.errors.SimulationError, match="max_steps") as failure:
                cc.simulate(scene, duration=1.0, rtol=1e-9, max_steps=steps)
            assert "Painlevé" not in str(failure.value)
