"""Features of a run against closed forms: numbers of the continuous motion, whatever is sampled."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")


class TestHertzImpact:
    """A journal of 0.3 kg meets its bearing head-on at 0.4 m/s, without weight and without loss."""

    MASS, SPEED, CLEARANCE, STIFFNESS = 0.3, 0.4, 1e-3, 1e9
    ONSET = CLEARANCE / SPEED
    DEEPEST = (5.0 * MASS * SPEED**2 / (4.0 * STIFFNESS)) ** 0.4
    PEAK = STIFFNESS * DEEPEST**1.5
    LASTS = 2.0 * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9) * DEEPEST / SPEED
    SCENE = cc.Scene(
        [cc.Body("journal", MASS, 1e-4)],
        [cc.ClearanceRevolute("bearing", "ground", "journal", 0.01, CLEARANCE, cc.laws.Hertz(STIFFNESS))],
        start=[cc.ClearanceStart("bearing", (0.0, 0.0), (0.6 * SPEED, -0.8 * SPEED))],
    )

    @pytest.mark.parametrize("method", ["auto", "rodas5p", "rodas4"])
    def test_peak_between_two_samples(self, method):
        run = cc.simulate(self.SCENE, duration=4e-3, samples=2, rtol=1e-9, method=method)
        force, depth = run.peak("bearing.normal_force"), run.peak("bearing.penetration")
        assert force.value == pytest.approx(self.PEAK, rel=1e-6)
        assert depth.value == pytest.approx(self.DEEPEST, rel=1e-6)
        assert force.time == pytest.approx(self.ONSET + 0.5 * self.LASTS, abs=1e-4 * self.LASTS)
        assert run.lowest("bearing.normal_force").value == 0.0
        assert not force.in_transient

    def test_impulse_share_and_count(self):
        wanted = [
            cc.features.impulse("bearing"),
            cc.features.contact_share("bearing"),
            cc.features.impacts("bearing"),
            cc.features.loss("bearing"),
        ]
        run = cc.simulate(self.SCENE, duration=4e-3, samples=2, rtol=1e-9, features=wanted)
        impulse, share, count, loss = (run.feature(feature) for feature in wanted)
        assert impulse == pytest.approx(2.0 * self.MASS * self.SPEED, rel=1e-6)
        assert share == pytest.approx(self.LASTS / 4e-3, rel=1e-6)
        assert count == 1.0
        assert loss == pytest.approx(0.0, abs=1e-9 * self.MASS * self.SPEED**2)

    @pytest.mark.parametrize("part", [0.2, 0.49, 0.51, 0.8])
    def test_contact_open_at_the_end_counts_the_last_step(self, part):
        run = cc.simulate(self.SCENE, duration=self.ONSET + part * self.LASTS, samples=2, rtol=1e-9)
        peak = run.contacts.peak_force[-1]
        assert np.isnan(run.contacts.separation[-1])
        assert peak == pytest.approx(run.peak("bearing.normal_force").value, rel=1e-6)
        if part < 0.5:
            assert peak == pytest.approx(run["bearing.normal_force"][-1], rel=1e-12)
        else:
            assert peak == pytest.approx(self.PEAK, rel=1e-6)

    @pytest.mark.parametrize("part", [0.3, 0.7])
    def test_window_has_contacts_and_events_of_its_own(self, part):
        skip = self.ONSET + part * self.LASTS
        run = cc.simulate(self.SCENE, duration=4e-3 - skip, samples=2, rtol=1e-9, skip=skip)
        assert list(run.skipped_events.kind) == ["onset"]
        assert list(run.events.kind) == ["separation"]
        ((before,), (after,)) = run.skipped_contacts.peak_force, run.contacts.peak_force
        at_the_cut = run["bearing.normal_force"][0]
        assert before == pytest.approx(at_the_cut if part < 0.5 else self.PEAK, rel=1e-6)
        assert after == pytest.approx(self.PEAK if part < 0.5 else at_the_cut, rel=1e-6)
        assert after == pytest.approx(run.peak("bearing.normal_force").value, rel=1e-6)
        assert run.contacts.onset[0] == run.skipped_contacts.onset[0] == run.skipped_events.time[0]
        assert np.isnan(run.skipped_contacts.separation[0])
        assert run.contacts.separation[0] == run.events.time[0]

    def test_window_without_contacts(self):
        late = cc.simulate(self.SCENE, duration=1e-3, samples=2, skip=4e-3)
        assert len(late.events) == len(late.contacts) == 0
        assert len(late.skipped_events) == 2
        assert late.skipped_contacts.separation[0] == late.skipped_events.time[1]

    def test_cycles_divide_the_window(self):
        run = cc.simulate(self.SCENE, duration=4e-3, samples=2, rtol=1e-9)
        middle = self.ONSET + 0.5 * self.LASTS
        whole, pieces = (
            run.feature(cc.features.impulse("bearing")),
            run.feature(cc.features.impulse("bearing"), cycles=7),
        )
        assert pieces.shape == (7,)
        assert pieces.sum() == pytest.approx(whole, rel=1e-6)
        hit = int(7 * middle / 4e-3)
        assert np.array_equal(
            run.feature(cc.features.impacts("bearing"), cycles=7), [float(k == hit) for k in range(7)]
        )
        assert np.argmax(run.feature(cc.features.peak("bearing.normal_force"), cycles=7)) == hit


class TestPendulum:
    """A point-like mass on an ideal pin, let go at 1.2 rad: the force is m g (3 cos θ - 2 cos θ0)."""

    LENGTH, MASS, ANGLE, GRAVITY = 0.4, 0.7, 1.2, 9.81
    SCENE = cc.Scene(
        [cc.Body("bob", MASS, 1e-12, (0.0, -LENGTH), points={"P": (0.0, 0.0)})],
        [cc.Revolute("pin", "ground", "bob.P")],
        forces=[cc.Gravity((0.0, -GRAVITY))],
        start=[cc.JointStart("pin", position=ANGLE)],
    )

    def test_extrema(self):
        run = cc.simulate(
            self.SCENE, duration=2.5, samples=2, rtol=1e-9, outputs=["bob.angle", "pin.reaction_y"]
        )
        rest = 1.0 - math.cos(self.ANGLE)
        weight = self.MASS * self.GRAVITY
        assert run.peak("pin.reaction_y").value == pytest.approx(weight * (1.0 + 2.0 * rest), rel=1e-7)
        speed = math.sqrt(2.0 * self.GRAVITY * rest / self.LENGTH)
        assert run.peak("bob.angular_velocity").value == pytest.approx(speed, rel=1e-7)
        assert run.lowest("bob.angular_velocity").value == pytest.approx(-speed, rel=1e-7)
        assert run.lowest("bob.angle").value == pytest.approx(-self.ANGLE, rel=1e-7)
        assert run.peak("bob.angle").value == pytest.approx(self.ANGLE, rel=1e-7)


def ideal(scene):
    """The scene with all clearance taken out."""
    joints = [
        cc.Revolute(joint.name, joint.bearing, joint.journal)
        if isinstance(joint, cc.ClearanceRevolute)
        else joint
        for joint in scene.joints
    ]
    return dataclasses.replace(scene, joints=joints)


class TestPrescribed:
    """An ideal slider-crank turned at constant speed: nothing is integrated."""

    RADIUS, ROD, SPEED = 0.05, 0.12, 40.0
    SCENE = ideal(cc.mechanisms.slider_crank(crank_length=RADIUS, rod_length=ROD, crank_speed=SPEED))
    TURN = 2.0 * math.pi / SPEED

    def motion(self):
        angle = np.linspace(0.0, 2.0 * math.pi, 200_001)
        reach = np.sqrt(self.ROD**2 - (self.RADIUS * np.sin(angle)) ** 2)
        position = self.RADIUS * np.cos(angle) + reach
        slope = -self.RADIUS * np.sin(angle) * (1.0 + self.RADIUS * np.cos(angle) / reach)
        return position, self.SPEED * slope

    def test_extrema_and_means(self):
        run = cc.simulate(self.SCENE, duration=3.0 * self.TURN, samples=2)
        position, velocity = self.motion()
        assert run.peak("slider.vx").value == pytest.approx(velocity.max(), rel=1e-8)
        assert run.lowest("slider.vx").value == pytest.approx(velocity.min(), rel=1e-8)
        largest = self.RADIUS * self.SPEED**2 * (1.0 + self.RADIUS / self.ROD)
        assert run.lowest("slider.ax").value == pytest.approx(-largest, rel=1e-9)
        assert run.feature(cc.features.mean("slider.vx")) == pytest.approx(0.0, abs=1e-9)
        assert run.feature(cc.features.mean("slider.x")) == pytest.approx(position[1:].mean(), rel=1e-9)
        assert run.feature(cc.features.rms("slider.vx")) == pytest.approx(
            math.sqrt(np.mean(velocity[1:] ** 2)), rel=1e-9
        )
        assert run.feature(cc.features.peak_to_peak("slider.x")) == pytest.approx(2.0 * self.RADIUS, rel=1e-9)
        assert run.feature(cc.features.time_of_peak("slider.ax"), cycles=3)[1] > self.TURN

    def test_work_is_an_output_too(self):
        run = cc.simulate(
            self.SCENE, duration=3.0 * self.TURN, samples=2, outputs=["energy.input", "energy.kinetic"]
        )
        swing = run.feature(cc.features.peak_to_peak("energy.input"))
        assert swing == pytest.approx(run.feature(cc.features.peak_to_peak("energy.kinetic")), rel=1e-6)


def test_a_step_may_be_many_turns_long():
    """A lopsided crank beside a cart that coasts: nothing bounds the step but the end."""
    speed, radius = 50.0, 0.3
    scene = cc.Scene(
        [
            cc.Body("crank", 1.0, 0.01, (radius, 0.0), points={"A": (0.0, 0.0)}),
            cc.Body("cart", 2.0, 0.01, points={"C": (0.0, 0.0)}),
        ],
        [cc.Revolute("pin", "ground", "crank.A"), cc.Prismatic("rail", "ground", "cart.C", axis=(1.0, 0.0))],
        drives=[cc.motions.Speed("drive", "pin", speed)],
        start=[cc.JointStart("rail", velocity=1.0)],
    )
    run = cc.simulate(scene, duration=4.0, samples=2)
    assert run.stats.steps < 100
    assert run.peak("crank.x").value == pytest.approx(radius, rel=1e-9)
    assert run.lowest("crank.vy").value == pytest.approx(-radius * speed, rel=1e-9)
    assert run.feature(cc.features.rms("crank.y")) == pytest.approx(
        radius * math.sqrt(0.5 - math.sin(2.0 * speed * 4.0) / (4.0 * speed * 4.0)), rel=1e-9
    )


@pytest.fixture(scope="module", params=["auto", "rodas4"])
def runs(request):
    """The same run, hardly and finely sampled."""
    scene, duration = TestClearance.SCENE, TestClearance.DURATION
    rough = cc.simulate(scene, duration=duration, samples=2, method=request.param)
    fine = cc.simulate(
        scene, duration=duration, samples=100_001, method=request.param, outputs=TestClearance.OUTPUTS
    )
    return rough, fine


class TestClearance:
    """The slider-crank of the paper with a tenth of a millimeter of play: impacts, slides, no closed form."""

    SCENE = cc.mechanisms.slider_crank(
        crank_length=0.05, rod_length=0.12, clearance=1e-4, crank_speed=cc.rpm(2000)
    )
    DURATION = 0.01
    OUTPUTS = ("slider.ax", "slider.vx", "wrist.normal_force", "wrist.friction_force", "wrist.penetration")

    def test_extrema_are_those_of_a_finely_sampled_run(self, runs):
        rough, fine = runs
        for name in self.OUTPUTS:
            found = {1.0: rough.peak(name), -1.0: rough.lowest(name)}
            for sign, extremum in found.items():
                values = sign * fine[name]
                top = values.argmax()
                # A smooth top between samples is higher than they are by less than they differ.
                slack = np.abs(np.diff(values[max(top - 2, 0) : top + 3])).max()
                excess = (sign * extremum.value - values[top]) / np.ptp(values)
                assert -1e-9 <= excess <= min(slack / np.ptp(values), 1e-3), name
                assert extremum.time == pytest.approx(fine.t[top], abs=2e-7)

    def test_sampling_and_asking_before_change_nothing(self, runs):
        rough, _ = runs
        wanted = [
            cc.features.peak("slider.ax"),
            cc.features.time_of_peak("slider.ax"),
            cc.features.wear("wrist"),
            cc.features.mean("slider.x"),
        ]
        asked = cc.simulate(
            self.SCENE,
            duration=self.DURATION,
            samples=7,
            method=rough.settings.method,
            features=wanted,
            outputs=["slider.x"],
        )
        assert np.array_equal(asked.end.memory, rough.end.memory)
        assert asked.peak("slider.ax") == rough.peak("slider.ax")
        assert asked.feature(wanted[2]) == rough.feature(wanted[2]) > 0.0

    def test_losses_are_those_of_the_outputs(self, runs):
        method = runs[0].settings.method
        names = [f"wrist.{name}" for name in ("wear", "impact_loss", "friction_loss")]
        run = cc.simulate(self.SCENE, duration=self.DURATION, samples=2, method=method, outputs=names)
        wear, impact, friction = run.samples[-1]
        assert run.feature(cc.features.wear("wrist")) == pytest.approx(wear, rel=1e-5)
        assert run.feature(cc.features.loss("wrist")) == pytest.approx(impact + friction, rel=1e-5)
        assert run.peak("wrist.wear").value == pytest.approx(wear, rel=1e-12)

    def test_start_transient_is_told(self, runs):
        rough, _ = runs
        peak = rough.peak("wrist.normal_force")
        assert peak.in_transient and "in the starting transient" in str(peak)
        later = cc.simulate(self.SCENE, duration=1e-3, samples=2, skip=self.SCENE.period)
        assert not later.peak("wrist.normal_force").in_transient

    def test_a_run_that_fails_has_what_it_finished(self):
        wanted = [cc.features.peak("slider.vx"), cc.features.impacts("wrist")]
        with pytest.raises(cc.errors.SimulationError) as caught:
            cc.simulate(self.SCENE, duration=0.01, samples=2, max_steps=300, features=wanted, cycles=10)
        run = caught.value.trajectory
        finished = np.arange(1, 11) * 1e-3 <= run.end_time
        assert 0 < finished.sum() < 10
        assert np.array_equal(np.isfinite(run.features), np.stack([finished, finished], axis=1))
        assert math.isnan(run.peak("slider.vx").value)


class TestWrongArguments:
    SCENE = TestHertzImpact.SCENE

    def test_unknown_names_are_refused(self):
        wanted = [
            cc.features.peak("bearing.normal_forse"),
            cc.features.impacts("bearin"),
            cc.features.impulse("journal.x"),
        ]
        for call in (
            lambda run: cc.simulate(self.SCENE, duration=1e-3, samples=2, features=wanted),
            lambda run: run.peak("bearing.normal_forse"),
            lambda run: run.feature(cc.features.wear("journal")),
        ):
            with pytest.raises(cc.errors.ArgumentError):
                call(cc.simulate(self.SCENE, duration=1e-3, samples=2))

    @pytest.mark.parametrize(
        ("features", "name"),
        [
            ("peak", "features"),
            ([1.0], "features[0]"),
            (3, "features"),
            ([cc.features.peak("journal.x"), "journal.x"], "features[1]"),
        ],
    )
    def test_what_is_no_feature(self, features, name):
        with refuses(name, error=TypeError):
            cc.simulate(self.SCENE, duration=1e-3, samples=2, features=features)

    @pytest.mark.parametrize("cycles", [0, -1, 2.0, True, None, "all"])
    def test_cycles(self, cycles):
        with refuses("cycles"):
            cc.simulate(self.SCENE, duration=1e-3, samples=2, cycles=cycles)

    def test_kinds_and_names(self):
        with pytest.raises(cc.errors.ArgumentError):
            cc.features.Feature("peek", "journal.x")
        with pytest.raises(cc.errors.ArgumentTypeError):
            cc.features.wear(3)


@pytest.mark.parametrize("clearance_at", [("wrist",), ()])
def test_work_and_losses_do_not_depend_on_features(clearance_at):
    """Features are taken at instants inside the steps, and the work up to there must not count twice."""
    scene = cc.mechanisms.slider_crank(clearance_at=clearance_at)
    outputs = ["energy.*", *(f"{pin}.wear" for pin in clearance_at)]
    time = {"duration": 0.01, "samples": 61}
    alone = cc.simulate(scene, outputs=outputs, **time)
    with_features = cc.simulate(
        scene, outputs=outputs, features=[cc.features.peak("slider.ax"), cc.features.rms("slider.vx")], **time
    )
    np.testing.assert_array_equal(with_features.samples, alone.samples)
    assert np.max(np.abs(with_features["energy.balance"])) < 1e-5 * np.max(np.abs(alone["energy.total"]))
