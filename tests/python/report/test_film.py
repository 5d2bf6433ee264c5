"""Films: what they hold, and how a real browser plays them."""

import json
import math

import chebclear as cc
import numpy as np
import pytest
from browser import BROWSER, Browser
from chebclear.report.film import Film, Panel, Shape, chart
from chebclear.report.html import film_page
from chebclear.run.report import run_document
from chebclear.study.report.film import study_film

STILL = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])


def crank(count=73):
    """A crank of length 1 that turns once, with its height and a band about it."""
    angle = np.linspace(0.0, 2.0 * math.pi, count)
    sine, cosine, zero = np.sin(angle), np.cos(angle), np.zeros(count)
    turns = np.column_stack([cosine, sine, -sine, cosine, zero, zero])
    shapes = [
        Shape("disc", np.zeros((1, 2)), 0, "#777777", 1.0, "#eeeeee", radius=1.5, name="ground"),
        Shape(
            "area",
            np.array([[0.0, -0.1], [1.0, -0.1], [1.0, 0.1], [0.0, 0.1]]),
            1,
            "#4477aa",
            1.0,
            "#4477aa",
            name="crank",
        ),
    ]
    degrees = np.degrees(angle)
    bounds = (sine - 0.01, sine + 0.02)
    return Film(
        "A crank",
        "crank [°]",
        degrees,
        [f"{one:.0f}°" for one in degrees],
        [Panel("A crank", (-1.6, 1.6, -1.6, 1.6), shapes, [STILL, turns], scale=(1e3, "mm"))],
        [
            chart("height", "m", degrees, sine, bounds, thin=0.1),
            chart("force", "N", degrees, 50.0 * cosine, (40.0 * cosine, 60.0 * cosine), thin=0.1),
            chart("power", "W", degrees, sine * cosine),
        ],
        shown=2,
        cyclic=True,
    )


def test_a_film_has_units_with_prefixes_and_gaps_where_nothing_is_known():
    film = json.loads(crank().to_json())
    assert [one["unit"] for one in film["charts"]] == ["m", "N", "mW"]
    assert [one["deviation"] for one in film["charts"]] == [True, False, False]
    values = np.array([0.0, np.nan, 2000.0])
    shown = chart("a", "N", np.arange(3.0), values)
    assert shown.unit == "kN" and shown.nominal[2] == 2.0
    film = Film("</script><script>&", "x", np.arange(3.0), list("abc"), [], [shown])
    assert json.loads(film.to_json())["charts"][0]["nominal"] == [0.0, None, 2.0]
    assert "<" not in film.to_json() and "&" not in film.to_json()
    assert json.loads(film.to_json())["title"] == "</script><script>&"


def test_of_many_samples_the_extremes_stay():
    t = np.linspace(0.0, 1.0, 100_001)
    rng = np.random.default_rng(5)
    values = rng.normal(size=len(t))
    values[rng.choice(len(t), 3)] = np.nan
    lower, upper = values - rng.random(len(t)), values + rng.random(len(t))
    shown = chart("a", "-", t, values, (lower, upper))
    assert len(shown.x) < 4000 and shown.x[[0, -1]].tolist() == [0.0, 1.0]
    for kept, all_of_it in ((shown.nominal, values), (shown.lower, lower), (shown.upper, upper)):
        assert np.nanmin(kept) == np.nanmin(all_of_it) and np.nanmax(kept) == np.nanmax(all_of_it)
    assert np.array_equal(np.sort(shown.x), shown.x)


def shift(film, name):
    """How far a body has moved along x since the first frame [m]."""
    (panel,) = film.panels
    moves = next(shape.moves for shape in panel.shapes if shape.name == name)
    return panel.transforms[moves][:, 4]


def study(**more):
    turn = cc.mechanisms.slider_crank().period
    return cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.01)},
        ["slider.x"],
        fixed={"clearance_at": ()},
        **{"duration": turn, "samples": 361, **more},
    )


def test_the_film_of_a_study_shows_mechanism_and_band_at_the_same_instants():
    result = study().scan(3)
    film = study_film(result)
    (shown,) = film.charts
    assert film.label == "time [ms]" and shown.unit == "mm" and shown.deviation
    there = np.interp(film.at, shown.x, shown.nominal)
    np.testing.assert_allclose(1e3 * shift(film, "slider"), there - there[0], rtol=0.0, atol=1e-6)
    assert film.places[30].endswith(f"at {3.0 * 30:.1f}°")


def test_the_film_of_a_band_by_angle_goes_by_the_angle():
    turn = cc.mechanisms.slider_crank().period
    result = study(duration=2.0 * turn, samples=91).band(9, revolutions=2, discard=0)
    film = study_film(result)
    (shown,) = film.charts
    assert film.label == "crank angle [°]" and film.at[0] == 0.0 and film.at[-1] == 360.0
    lean = np.sqrt(0.12**2 - (0.05 * np.sin(np.radians(film.at))) ** 2)
    expected = 0.05 * np.cos(np.radians(film.at)) + lean
    np.testing.assert_allclose(shown.nominal, 1e3 * expected, rtol=0.0, atol=1e-3)
    np.testing.assert_allclose(shift(film, "slider"), expected - expected[0], rtol=0.0, atol=1e-4)


def test_a_model_without_a_mechanism_has_charts_alone_and_a_run_without_positions_too():
    t = [0.0, 0.5, 1.0]
    own = cc.Study(lambda a: {"t": t, "x": [a, 2.0 * a, a]}, {"a": cc.Interval(1.0, 2.0)}).scan(3)
    film = study_film(own)
    assert not film.panels and film.charts[0].lower.tolist() == [1.0, 2.0, 1.0]
    run = cc.simulate(cc.mechanisms.slider_crank(), duration=0.003, samples=31, outputs=["slider.x"])
    kinds = [type(one).__name__ for one in run_document(run, None).first]
    assert kinds == ["Picture", "Moving", "Table"]
    whole = cc.simulate(run.scene, duration=0.003, samples=31)
    first, _ = run_document(whole, None).first
    np.testing.assert_allclose(
        shift(first.film(), "slider"), whole["slider.x"] - whole["slider.x"][0], atol=1e-12
    )


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if BROWSER is None:
        pytest.skip("no Chromium here: no browser plays the films")
    with Browser(tmp_path_factory.mktemp("browser")) as opened:
        yield opened


@pytest.fixture(params=[400, 1400])
def page(browser, tmp_path, request):
    path = tmp_path / "crank.html"
    path.write_text(film_page(crank(), "A note."), encoding="utf-8")
    browser.open(path.as_uri(), request.param)
    yield browser
    assert not browser.errors
    assert browser.find("document.documentElement.scrollWidth <= document.documentElement.clientWidth")


ANGLE = """(() => {
  const transform = document.querySelectorAll(".panel g g")[1].getAttribute("transform");
  const [a, b] = transform.slice(7, -1).split(" ").map(Number);
  return Math.atan2(b, a) * 180 / Math.PI;
})()"""


def place(browser, selector, x=0.5, y=0.5):
    """A place within an element, on the screen."""
    return browser.find(
        f"""(() => {{
          const one = document.querySelector({selector!r});
          one.scrollIntoView({{block: "center"}});
          const box = one.getBoundingClientRect();
          return [box.x + {x} * box.width, box.y + {y} * box.height];
        }})()"""
    )


def words(browser, selector):
    return browser.find(f"document.querySelector({selector!r}).textContent")


def test_the_keyboard_moves_mechanism_and_charts_together(page):
    page.find("document.querySelector('input[type=range]').focus()")
    for _ in range(6):
        page.key("ArrowRight")
    assert page.find(ANGLE) == pytest.approx(30.0, abs=1e-3)
    assert words(page, ".bar output") == "30°"
    assert page.find("document.querySelector('input[type=range]').getAttribute('aria-valuetext')") == "30°"
    assert words(page, ".chart output") == "0.5 (0.49 to 0.52)"
    # What does not move moves nothing.
    page.drag(place(page, ".panel svg", 0.3, 0.7), place(page, ".panel svg", 0.6, 0.7))
    assert words(page, ".bar output") == "30°"


def test_the_crank_is_dragged_by_the_mouse(page):
    x, y = place(page, ".panel svg")
    size = page.find("document.querySelector('.panel svg').getBoundingClientRect().height") / 3.2
    # From the right to the top and on to the left: over the dead point of its height.
    page.mouse("mousePressed", x + 0.8 * size, y, buttons=1, clickCount=1)
    for angle in range(10, 171, 10):
        turn = math.radians(angle)
        page.mouse("mouseMoved", x + 0.8 * size * math.cos(turn), y - 0.8 * size * math.sin(turn), buttons=1)
        assert page.find(ANGLE) == pytest.approx(angle, abs=5.1)
    page.mouse("mouseReleased", x, y, clickCount=1)
    assert words(page, ".panel .place").endswith(" mm")


def test_charts_are_hovered_dragged_and_zoomed(page):
    page.mouse("mouseMoved", *place(page, ".chart .nominal"), button="none")
    assert words(page, ".chart output") == "crank [°] 180: 0 (-0.01 to 0.02)"
    left, right = place(page, ".chart .nominal", 0.25), place(page, ".chart .nominal", 0.75)
    page.drag(left, right)
    assert page.find(ANGLE) % 360.0 == pytest.approx(270.0, abs=1.0)
    page.mouse("mouseMoved", 1.0, 1.0, button="none")
    assert words(page, ".chart output") == "-1 (-1.01 to -0.98)"
    labels = "[...document.querySelectorAll('.chart text[text-anchor=middle]')]"
    ticks = f"{labels}.map(one => Number(one.textContent)).filter(isFinite)"
    before = page.find(ticks)
    page.find("document.querySelector('[aria-label=\"larger: charts\"]').click()")
    assert max(page.find(ticks)) - min(page.find(ticks)) < max(before) - min(before)
    page.find("document.querySelector('[aria-label=\"all: charts\"]').click()")
    assert page.find(ticks) == before


def test_outputs_are_chosen_and_bands_are_shown_as_deviations(page):
    count = "document.querySelectorAll('.chart').length"
    assert page.find(count) == 2
    page.find("document.querySelectorAll('fieldset input')[2].click()")
    assert page.find(count) == 3
    # What is thin against the motion is a deviation at first: its axis has the width of the band.
    ticks = "[...document.querySelectorAll('.chart')][0].querySelectorAll('text[text-anchor=end]')"
    largest = f"Math.max(...[...{ticks}].map(one => Number(one.textContent)))"
    assert page.find(largest) <= 0.02
    page.find("document.querySelector('.chart input').click()")
    assert page.find(largest) >= 0.5


def test_what_is_under_the_pointer_stays_there_when_a_drawing_is_enlarged(page):
    x, y = map(round, place(page, ".panel svg", 0.75, 0.25))
    where = f"""(() => {{ const one = document.querySelector(".panel g").getScreenCTM().inverse();
      const p = new DOMPoint({x}, {y}).matrixTransform(one); return [p.x, p.y, one.a]; }})()"""
    before = page.find(where)
    page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-100, modifiers=2)
    page.until(f"{where}[2] < 0.5 * {before[2]}")
    assert page.find(where)[:2] == pytest.approx(before[:2], abs=1e-6)


def test_every_control_has_a_name_and_can_be_reached(page):
    page.call("Accessibility.enable")
    nodes = page.call("Accessibility.getFullAXTree")["nodes"]
    roles = [
        (node["role"]["value"], node.get("name", {}).get("value", ""))
        for node in nodes
        if not node["ignored"]
    ]
    controls = [name for role, name in roles if role in ("button", "slider", "checkbox", "image")]
    assert len(controls) > 10 and all(controls)
    assert ("slider", "crank [°]") in roles and ("image", "A crank") in roles
