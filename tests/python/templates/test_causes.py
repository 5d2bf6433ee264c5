"""One mistake in a scene file is one problem: what follows from it is not reported again."""

import chebclear as cc
import pytest
from chebclear.cli.commands.new import starter

FOUR_BAR = (
    starter("four_bar").replace('duration = "30 ms"', 'duration = "2*pi/crank_speed"')
    + """
[features]
top = "peak(rocker.angle)"
[requirements]
reach = { of = "top", below = "170 deg" }
late = { of = "rocker.angle", below = "170 deg", at = "2*pi/crank_speed" }
[costs]
crank_length = "3 + 2e-5 / tolerance"
coupler_length = "3 + 2e-5 / tolerance"
"""
)


def problems(text, **options):
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text, **options)
    return caught.value.problems


def test_the_file_itself_is_right():
    assert cc.loads(FOUR_BAR).requirements["late"].at == pytest.approx(0.03, rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"100 mm"', '"100 mmm"', 'unknown unit "mmm"'),
        ('= "2000 rpm"', '= "2000 rpmm"', 'unknown unit "rpmm"'),
        ('"300 g"', '"30o g"', "no arithmetic expression"),
        ('"crank_length * cos', '"crnk_length * cos', 'unknown name "crnk_length"'),
        ('"young_modulus / (1', '"1/0 * (1', "divides by zero"),
        ("[parameters]", "[parameter]", 'did you mean "parameters"?'),
        ('= "2000 rpm"', '= "20 kg"', "is in kg, which is not of the dimension of [rad/s]"),
        ('= "2000 rpm"', '= "2000 1/min"', "is in 1/min, which is not of the dimension of [rad/s]"),
    ],
)
def test_one_mistake_is_one_problem(old, new, said):
    assert old in FOUR_BAR
    (problem,) = problems(FOUR_BAR.replace(old, new, 1))
    assert said in problem.message


def test_one_name_that_is_missing_everywhere_is_said_once():
    found = problems(FOUR_BAR.replace("crank_length = {", "crank_lenght = {", 1))
    assert len(found) == 2  # the formulas, and the cost of a parameter that there is not
    assert "the same at 4 more places, the last of them bodies[0].points.B[0]" in found[0].message
    assert 'did you mean "crank_lenght"?' in found[0].message


CAM = """
format = 1
bodies = [
  { name = "cam", mass = "1 kg", inertia = 1e-3 },
  { name = "valve", mass = "100 g", inertia = 1e-6 },
]
[[joints]]
type = "revolute"
name = "camshaft"
a = "ground"
b = "cam"
[[joints]]
type = "prismatic"
name = "guide"
a = "ground"
b = "valve"
axis = [0, 1]
[[drives]]
type = "speed"
name = "motor"
joint = "camshaft"
speed = "750 rpm"
[[forces]]
type = "force"
name = "push"
point = "valve"
x = 0
y = %s
"""


def test_a_table_in_degrees_is_one_problem_that_names_the_angle():
    points = ", ".join(f'"{4 * k} deg"' for k in range(91))
    table = f'{{ function = "table", points = [{points}], values = [{", ".join(91 * ["1"])}] }}'
    (problem,) = problems(CAM % table)
    assert 'over = "camshaft.angle"' in problem.message
    assert "the same at 90 more places" in problem.message
    right = table.replace("points =", 'over = "camshaft.angle", points =')
    assert cc.loads(CAM % right)().forces[0].y.points[-1] == pytest.approx(6.283185307179586)


@pytest.mark.parametrize("formula", ["5*sin(t)", "5*sin(t)*valve.vy"])
def test_the_time_is_called_time(formula):
    (problem,) = problems(CAM % f'"{formula}"')
    assert 'did you mean "time"?' in problem.message


def test_a_replaced_value_keeps_the_dimension_of_the_file():
    for changes in ({"coupler_length": "12 kg"}, {"coupler_length.plus": "12 kg"}, {"coupler_mass": "1 m"}):
        (problem,) = problems(FOUR_BAR, changes=changes)
        assert "is not of the dimension of" in problem.message
    assert cc.loads(FOUR_BAR, changes={"crank_speed": "2 rev/s"}).values()["crank_speed"] == cc.rpm(120)


def test_a_template_takes_texts_with_units():
    template = cc.loads(FOUR_BAR)
    assert template(crank_length="5 cm") == template(crank_length=0.05)
    with pytest.raises(ValueError, match="may be given in m, mm"):
        template(crank_length="5 kg")
