"""Units are the user's choice, and what is not connected changes nothing.

Each scene has the numbers of another one with lengths, masses and times multiplied by three factors: the
records say the units of their fields. With powers of two results have the same bits, with others they agree
within ten times the tolerance. No body has named points unless the element needs them: sizes follow from what
else a scene says, never from a meter.
"""

import dataclasses
import re
from fractions import Fraction

import chebclear as cc
import numpy as np
import pytest
from chebclear import laws
from chebclear.scene.columns import column_unit
from chebclear.scene.functions import Expression, Harmonic, Polynomial, Table
from chebclear.scene.motions import Coupling, Motion, Speed
from chebclear.scene.parts import ClearancePrismatic, PinInSlot, Prismatic, Stop

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

RTOL = 1e-6
# Powers of mass, length and time.
DIMENSIONS = {
    "-": (0, 0, 0), "rad": (0, 0, 0), "m": (0, 1, 0), "m/s": (0, 1, -1), "m/s²": (0, 1, -2), "kg": (1, 0, 0),
    "kg m²": (1, 2, 0), "N": (1, 1, -2), "N/m": (1, 0, -2), "N s/m": (1, 0, -1), "N m": (1, 2, -2),
    "N m/rad": (1, 2, -2), "N m s/rad": (1, 2, -1), "Pa s": (1, -1, -1), "s": (0, 0, 1), "s/m": (0, -1, 1),
    "rad/s": (0, 0, -1), "rad/s²": (0, 0, -2), "J": (1, 2, -2), "W": (1, 2, -3),
    "penetration": (0, 1, 0), "penetration_rate": (0, 1, -1), "impact_velocity": (0, 1, -1),
    "sliding_velocity": (0, 1, -1), "normal_force": (1, 1, -2), "time": (0, 0, 1),
}  # fmt: skip
NAME = re.compile(
    r"(?<![\w.])([a-z]\w*(?:\.\w+)+|time|penetration_rate|penetration|impact_velocity|sliding_velocity|normal_force)"
)


class Units:
    """Factors of the numbers of lengths, masses and times."""

    def __init__(self, length=1.0, mass=1.0, time=1.0):
        self.factors = (mass, length, time)

    def __repr__(self):
        return "mass {:g}, length {:g}, time {:g}".format(*self.factors)

    def of(self, powers):
        """The factor of a number with these powers; exact for powers of two."""
        factor = 1.0
        for base, power in zip(self.factors, powers, strict=True):
            root = base ** (1 / 2) if Fraction(power).denominator == 2 else base
            factor *= root ** int(power * Fraction(power).denominator)
        return factor

    def formula(self, expression, powers):
        """A formula whose value has these powers."""
        text = expression if isinstance(expression, str) else expression.text
        of_name = lambda name: DIMENSIONS.get(name) or DIMENSIONS[column_unit(name)]  # noqa: E731
        inner = NAME.sub(lambda found: f"({found[0]}/{self.of(of_name(found[0]))!r})", text)
        return f"{self.of(powers)!r}*({inner})"

    def value(self, value, powers):
        """A number, several, or a function in their place, with these powers."""
        match value:
            case None | bool():
                return value
            case str() | Expression():
                return self.formula(value, powers)
            case Polynomial(coefficients):
                return Polynomial(
                    [c * self.of((*powers[:2], powers[2] - k)) for k, c in enumerate(coefficients)]
                )
            case Harmonic():
                return dataclasses.replace(
                    value,
                    amplitude=self.value(value.amplitude, powers),
                    mean=self.value(value.mean, powers),
                    angular_frequency=self.value(value.angular_frequency, DIMENSIONS["rad/s"]),
                )
            case Table():
                over = "time" if value.over == "time" else column_unit(value.over)
                return dataclasses.replace(
                    value,
                    points=self.value(value.points, DIMENSIONS[over]),
                    values=self.value(value.values, powers),
                )
            case tuple() | list():
                return tuple(self.value(one, powers) for one in value)
            case dict():
                return {name: self.value(one, powers) for name, one in value.items()}
        return value * self.of(powers)

    def record(self, record, slides):
        """A record of a scene; `slides` are the names of its prismatic joints."""
        changed = {}
        for field in dataclasses.fields(record):
            value = getattr(record, field.name)
            symbol = field.metadata.get("unit")
            if symbol is not None:
                changed[field.name] = self.value(value, self.powers(record, symbol, slides))
            elif dataclasses.is_dataclass(value):
                changed[field.name] = self.record(value, slides)
            elif isinstance(value, (tuple, list)) and value and dataclasses.is_dataclass(value[0]):
                changed[field.name] = tuple(self.record(one, slides) for one in value)
        return dataclasses.replace(record, **changed)

    @staticmethod
    def powers(record, symbol, slides):
        """Those of a field, which may depend on what it belongs to."""
        if symbol == "N/m^exponent":
            return (1, 1 - Fraction(record.exponent), -2)
        if isinstance(record, Coupling) and symbol in ("- or m", "rad or m"):
            driven, driver = (
                name.rpartition(".")[2] == "displacement" for name in (record.driven, record.driver)
            )
            by_driver = symbol == "- or m" and isinstance(record.law, float)
            return (0, int(driven) - int(driver and by_driver), 0)
        if " or " in symbol:
            angle, other = symbol.split(" or ")
            return DIMENSIONS[other if record.joint in slides else angle]
        return DIMENSIONS[symbol]

    def scene(self, scene):
        slides = {joint.name for joint in scene.joints if isinstance(joint, Prismatic)}
        return self.record(scene, slides)

    def run(self, scene, duration, outputs=("*",)):
        """Samples in the units of the scene as it is written, and the run."""
        run = cc.simulate(
            self.scene(scene), duration=duration * self.factors[2], samples=51, outputs=outputs, rtol=RTOL
        )
        return {name: run[name] / self.of(DIMENSIONS[column_unit(name)]) for name in run}, run


def block(name="block", **more):
    """A body without points."""
    return cc.Body(name, 0.4, 2e-4, **more)


def sliding(*forces, start=0.0, velocity=0.0, drives=(), joints=(), friction=None):
    """A block on a slide."""
    return cc.Scene(
        [block()],
        [Prismatic("slide", "ground", "block", axis=(1.0, 0.0), friction=friction), *joints],
        list(forces),
        list(drives),
        start=[] if drives else [cc.JointStart("slide", position=start, velocity=velocity)],
    )


WEIGHT = cc.Gravity((1.3, -9.0))
DOWN = cc.Gravity((0.0, -9.0))
SPRING = cc.Spring("spring", "ground", "block", 900.0, 0.0)
CONTACTS = {
    "hertz": laws.Hertz(2e8),
    "lankarani": laws.LankaraniNikravesh(2e8, 0.9),
    "flores": laws.Flores(2e8, 0.6),
    "exact": laws.ExactRestitution(3e6, 0.5, exponent=1.0),
    "hunt": laws.HuntCrossley(2e8, 0.8),
    "kelvin": laws.KelvinVoigt(3e6, 40.0),
    "impact": laws.Impact(2e8, 300.0, 1e-5),
    "formula": laws.ContactFormula("3e6*penetration*(1 + 0.5*penetration_rate)"),
}
FRICTION = {
    "smoothed": laws.SmoothedCoulomb(0.2, 0.01),
    "modified": laws.ModifiedCoulomb(0.3, 0.2, 0.01, 0.02),
    "sticking": laws.StickSlip(0.4, 0.3, 0.05),
    "formula": laws.FrictionFormula("0.2*tanh(sliding_velocity/0.01)"),
}
HARMONIC = Harmonic(amplitude=3.0, angular_frequency=60.0)
TABLE = Table([0.0, 0.01, 0.02, 0.05, 0.1], [0.0, 2.0, 1.0, -2.0, 1.0])


def journal(contact, friction=None, film=None, gravity=WEIGHT):
    joint = cc.ClearanceRevolute("bearing", "ground", "block", 0.01, 1e-4, contact, friction, film=film)
    start = [cc.BodyStart("block", angular_velocity=30.0)]
    return cc.Scene([block()], [joint], [gravity], start=start)


def stopped(contact, friction=None):
    joint = Stop("stop", "ground", "block", normal=(0.0, 1.0), contact=contact, friction=friction)
    free = Prismatic("slide", "ground", "carrier", axis=(0.0, 1.0))
    across = Prismatic("across", "carrier", "block", axis=(1.0, 0.0))
    start = [cc.JointStart("slide", position=0.002), cc.JointStart("across", velocity=0.1)]
    return cc.Scene([block(), block("carrier")], [free, across, joint], [WEIGHT], start=start)


def geared(**more):
    wheels = [cc.Body("pinion", 0.3, 4e-4), cc.Body("wheel", 0.9, 3e-3)]
    joints = [cc.Revolute("first", "ground.A", "pinion"), cc.Revolute("second", "ground.B", "wheel")]
    coupling = Coupling("mesh", "wheel.angle", "pinion.angle", -0.5, **more)
    return cc.Scene(
        wheels,
        joints,
        [cc.Torque("motor", "pinion", HARMONIC), cc.TorsionDamper("load", "ground", "wheel", 0.05)],
        ground={"A": (0.0, 0.0), "B": (0.06, 0.0)},
        couplings=[coupling],
    )


def pendulum(**more):
    arm = cc.Body("arm", 0.5, 2e-3, center_of_mass=(0.2, 0.0), angle=0.3)
    return cc.Scene([arm], [cc.Revolute("pin", "ground", "arm", **more)], [WEIGHT])


GUIDE = {"axis": (1.0, 0.0), "clearance": 2e-4}
SCENES = {
    "spring": (sliding(WEIGHT, SPRING), 0.3),
    "spring that is stretched": (sliding(SPRING, start=0.02), 0.3),
    "spring that is hit": (sliding(SPRING, velocity=0.3), 0.3),
    "long spring": (sliding(dataclasses.replace(SPRING, length=0.05), start=0.03), 0.3),
    "damper": (sliding(WEIGHT, cc.Damper("damper", "ground", "block", 3.0), start=0.01), 0.3),
    "bushing": (
        cc.Scene([block()], [], [WEIGHT, cc.Bushing("rubber", "ground", "block", 4e3, 6.0, 3.0, 0.01)]),
        0.1,
    ),
    "bushing by formulas": (
        cc.Scene(
            [block()],
            [],
            [WEIGHT, cc.Bushing("rubber", "ground", "block", "4e3 + 1e5*rubber.deflection", 6.0, 3.0, 0.01)],
        ),
        0.1,
    ),
    "torsion spring": (
        cc.Scene(
            [block()],
            [cc.Revolute("pin", "ground", "block")],
            [
                cc.TorsionSpring("coil", "ground", "block", 0.7),
                cc.TorsionDamper("oil", "ground", "block", 1e-3),
            ],
            start=[cc.JointStart("pin", position=0.4)],
        ),
        0.3,
    ),
    "harmonic force": (sliding(SPRING, cc.Force("push", "block", HARMONIC, 0.0)), 0.3),
    "free under a harmonic force": (sliding(DOWN, cc.Force("push", "block", HARMONIC, 0.0)), 0.3),
    "table of a force": (sliding(SPRING, cc.Force("push", "block", TABLE, 0.0)), 0.1),
    "growing force": (sliding(SPRING, cc.Force("push", "block", Polynomial([0.5, 0.0, 40.0]), 0.0)), 0.3),
    "force by a formula": (
        sliding(DOWN, cc.Force("pull", "block", "-900*block.x - 2*abs(block.vx)*block.vx", 0.0), start=0.02),
        0.2,
    ),
    "tension by a formula": (
        sliding(dataclasses.replace(SPRING, tension="30*spring.lengthening"), start=0.02),
        0.2,
    ),
    "driven slide": (sliding(WEIGHT, drives=[Motion("motor", "slide", Harmonic(0.03, 40.0))]), 0.2),
    "dry slide": (sliding(SPRING, start=0.02, friction=laws.GuideFriction(0.2, 0.02)), 0.3),
    "dry pin": (pendulum(friction=laws.JournalFriction(0.3, 0.01)), 0.6),
    "pendulum": (pendulum(), 0.6),
    "rack": (
        cc.Scene(
            [block(), block("pinion")],
            [Prismatic("slide", "ground", "block", axis=(1.0, 0.0)), cc.Revolute("axle", "ground", "pinion")],
            [WEIGHT, dataclasses.replace(SPRING, b="block")],
            couplings=[Coupling("rack", "slide.displacement", "axle.angle", 0.02)],
        ),
        0.3,
    ),
    "cam": (
        cc.Scene(
            [block(), block("cam")],
            [Prismatic("slide", "ground", "block", axis=(1.0, 0.0)), cc.Revolute("axle", "ground", "cam")],
            [dataclasses.replace(SPRING, b="block")],
            [Speed("motor", "axle", 20.0)],
            couplings=[Coupling("lift", "slide.displacement", "axle.angle", "0.01*(1 - cos(axle.angle))")],
        ),
        0.3,
    ),
    "gears": (geared(pressure_angle=0.35), 0.3),
    "gears with backlash": (
        geared(pressure_angle=0.35, backlash=1e-4, contact=laws.ExactRestitution(2e6, 0.5, exponent=1.0)),
        0.02,
    ),
    "film": (journal(CONTACTS["hertz"], film=laws.ShortBearing(0.02, 0.01, 1e-6)), 0.03),
    "finite film": (journal(CONTACTS["hertz"], film=laws.FiniteBearing(0.02, 0.01, 1e-6)), 0.03),
    "rod without mass": (
        cc.Scene(
            [cc.Body("rod", 0.0, 0.0, points={"A": (0.0, 0.0), "B": (0.3, 0.0)}, angle=0.5), block()],
            [cc.Revolute("pin", "ground", "rod.A"), cc.Revolute("bob", "rod.B", "block")],
            [WEIGHT],
            start=[cc.BodyStart("block", angular_velocity=3.0)],
        ),
        0.5,
    ),
    **{f"journal, {name}": (journal(law), 0.02) for name, law in CONTACTS.items()},
    **{
        f"journal, {name} friction": (journal(CONTACTS["exact"], law), 0.01) for name, law in FRICTION.items()
    },
    **{f"stop, {name}": (stopped(law), 0.03) for name, law in CONTACTS.items()},
    **{f"stop, {name} friction": (stopped(CONTACTS["exact"], law), 0.03) for name, law in FRICTION.items()},
    "guide": (
        cc.Scene(
            [block()],
            [
                ClearancePrismatic(
                    "guide", "ground", "block", length=0.04, height=0.02, contact=CONTACTS["exact"], **GUIDE
                )
            ],
            [WEIGHT],
            start=[cc.GuideStart("guide", tilt=0.002)],
        ),
        0.02,
    ),
    "pin in a slot": (
        cc.Scene(
            [block()],
            [PinInSlot("slot", "ground", "block", pin_radius=0.005, contact=CONTACTS["exact"], **GUIDE)],
            [WEIGHT],
        ),
        0.02,
    ),
}


def sizes_of(run):
    """The size of every output: the largest of its dimension, since some are zero but for rounding."""
    dimensions = {name: DIMENSIONS[column_unit(name)] for name in run}
    largest = {name: np.nanmax(np.abs(values)) for name, values in run.items()}
    return {
        name: max(largest[other] for other in run if dimensions[other] == dimensions[name]) for name in run
    }


BITS = [
    Units(length=2.0**-12),
    Units(length=2.0**20),
    Units(mass=2.0**-11),
    Units(time=2.0**-10),
    Units(2.0**10, 2.0**-3, 2.0**5),
]
ROUNDED = [Units(1e-6), Units(1e6), Units(mass=1e-6), Units(mass=1e6), Units(time=1e-6), Units(time=1e6)]


@pytest.mark.parametrize("name", SCENES)
def test_units_that_are_powers_of_two_give_the_same_bits(name):
    scene, duration = SCENES[name]
    base, run = Units().run(scene, duration)
    for units in BITS:
        found, other = units.run(scene, duration)
        assert (other.status, other.stats.steps, len(other.events)) == (
            run.status,
            run.stats.steps,
            len(run.events),
        ), units
        for column in base:
            np.testing.assert_array_equal(found[column], base[column], err_msg=f"{units}: {column}")


@pytest.mark.parametrize("name", SCENES)
def test_other_units_give_the_same_results(name):
    scene, duration = SCENES[name]
    base, run = Units().run(scene, duration)
    for units in ROUNDED:
        found, other = units.run(scene, duration)
        assert (other.status, len(other.events)) == (run.status, len(run.events)), units
        sizes = sizes_of(base)
        for column, size in sizes.items():
            error = np.nanmax(np.abs(found[column] - base[column]))
            assert error <= 10 * RTOL * size, f"{units}: {column} {error / size:.1e}"


def beside(scene, neighbor):
    """A scene with bodies that are connected with none of its own."""
    fields = {field.name: getattr(scene, field.name) for field in dataclasses.fields(scene)}
    for name, more in neighbor.items():
        fields[name] = {**fields[name], **more} if isinstance(more, dict) else (*fields[name], *more)
    return cc.Scene(**fields)


ROTOR = cc.Body("rotor", 30.0, 5.0, points={"rim": (0.7, 0.0)})
AXLE = cc.Revolute("rotor_axle", "ground", "rotor")
NEIGHBORS = {
    "driven rotor": {
        "bodies": [ROTOR],
        "joints": [AXLE],
        "drives": [Speed("rotor_drive", "rotor_axle", 1500.0)],
    },
    "rotor": {"bodies": [ROTOR], "joints": [AXLE], "start": [cc.JointStart("rotor_axle", velocity=300.0)]},
    "block": {
        "bodies": [cc.Body("other", 1e-3, 1e-9)],
        "joints": [Prismatic("other_slide", "ground", "other", axis=(0.0, 1.0))],
        "start": [cc.JointStart("other_slide", velocity=200.0)],
    },
    "crank": {
        "bodies": [
            cc.Body("crank", 1.0, 1e-3, points={"A": (0.0, 0.0), "B": (0.05, 0.0)}),
            cc.Body("link", 1.0, 1e-3, points={"B": (0.0, 0.0), "C": (0.2, 0.0)}),
            cc.Body("piston", 1.0, 1e-3),
        ],
        "joints": [
            cc.Revolute("main", "ground", "crank.A"),
            cc.Revolute("big_end", "crank.B", "link.B"),
            cc.Revolute("wrist", "link.C", "piston"),
            Prismatic("cylinder", "ground", "piston", axis=(1.0, 0.0)),
        ],
        "drives": [Speed("crank_drive", "main", 400.0)],
    },
}


@pytest.mark.parametrize("name", SCENES)
def test_what_is_not_connected_changes_nothing(name):
    scene, duration = SCENES[name]
    # The motion: work and losses would resolve every turn of a neighbor.
    outputs = [
        column for column in scene.check().columns if column_unit(column) in ("m", "rad", "m/s", "rad/s")
    ]
    alone, run = Units().run(scene, duration, outputs)
    for neighbor, parts in NEIGHBORS.items():
        together = beside(scene, parts)
        found, other = Units().run(together, duration, outputs)
        assert scene.check().impact_velocity_floors == together.check().impact_velocity_floors, neighbor
        assert (other.status, len(other.events)) == (run.status, len(run.events)), neighbor
        for column, size in sizes_of(alone).items():
            error = np.nanmax(np.abs(found[column] - alone[column]))
            assert error <= 10 * RTOL * size, f"{neighbor}: {column} {error / size:.1e}"
