"""Scene files that would take too long: the work grows with their length, and what is too large is said."""

import signal
import subprocess
import sys
import threading

import chebclear as cc
import pytest
from chebclear.base.shown import did_you_mean
from chebclear.templates import template as module
from chebclear.templates.expressions import parse
from refusals import refuses

BODY = '[[bodies]]\nname = "b"\nmass = 1\ninertia = 1\n'


@pytest.mark.parametrize("levels", [5, 10, 20, 40])
def test_each_parameter_is_settled_once(levels):
    """Two names a level that both need both of the next one: every way through them doubled the work."""
    asked = []

    class Counted(dict):
        def __getitem__(self, name):
            asked.append(name)
            return super().__getitem__(name)

    nominal = Counted()
    for level in range(levels):
        nominal |= {f"{side}{level}": parse(f"a{level + 1} + b{level + 1}") for side in "ab"}
    nominal = Counted(nominal | {f"a{levels}": parse("a0"), f"b{levels}": parse("b0")})
    with pytest.raises(cc.errors.SceneError):
        module.evaluated(nominal)
    assert len(asked) <= 2 * levels + 2


CYCLE = "joints = []\n" + "".join(
    f'parameters.{side}{level} = "a{(level + 1) % 18} + b{(level + 1) % 18}"\n'
    for level in range(18)
    for side in "ab"
)
LONG = "a" + ".a" * 20_000
QUICK = {
    "a cycle of 800 bytes": CYCLE + BODY,
    "blanks in a feature": 'features.x = "peak(' + " " * 40_000 + '"\n',
    "dots": f"{LONG} = 1",
    "dots in a header": f"[{LONG}]",
    "dots in an inline table": f"x = {{ {LONG} = 1 }}",
    "dots behind a quoted key": f'"=".{LONG} = 1',
    "dots behind a quoted hash": f'"#" . {LONG} = 1',
    "dots behind a string": f"x = ['''\n=''', {{ {LONG} = 1 }}]",
    "quoted parts": "x = { " + ".".join(['"a"'] * 20_000) + " = 1 }",
    "quotes that are escaped": '"\\' * 20_000,
    "a line of empty bodies": "joints = []\nbodies = [" + "{}," * 2_000 + "]",
    "a line of unknown outputs": "joints = []\nrun.duration = 1\nrun.outputs = ["
    + "".join(f'"b.q{number}",' for number in range(2_000))
    + f"]\n{BODY}",
    "long names": "joints = []\n"
    + BODY.replace('"b"', f'"{"b" * 20_000}"')
    + f'[[start]]\ntype = "body"\nbody = "{"c" * 20_000}"\n',
}

PROGRAM = """
import sys
import chebclear as cc
try:
    cc.loads(sys.stdin.read())
except cc.errors.SceneError as error:
    print(len(str(error)), error)
"""


@pytest.mark.parametrize("kind", QUICK)
def test_what_took_long_is_refused_at_once(kind):
    """In hundredths of a second; where the work grows with the square or worse it takes minutes to ages."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], input=QUICK[kind], capture_output=True, text=True, timeout=60
    )
    letters, _, told = done.stdout.partition(" ")
    assert int(letters) < 500 * len(QUICK[kind])
    if "dots" in kind or kind == "quoted parts":
        assert "a key with more than 20 dots is not accepted" in told


def test_dots_in_texts_and_comments_are_no_keys():
    dots = ".".join("a" * 30)
    text = f'title = "{dots}" # {dots}\njoints = []\n{BODY}'
    assert cc.loads(text).title == dots
    with refuses("scene: line 2", error=cc.errors.SceneError):
        cc.loads(f"joints = []\nx = {{ {dots} = 1 }}\n")


def chain(bodies):
    links = [cc.Body(f"b{k}", 1.0, 1.0, points={"A": (0.0, 0.0), "B": (1.0, 0.0)}) for k in range(bodies)]
    pins = [cc.Revolute(f"j{k}", f"b{k - 1}.B" if k else "ground", f"b{k}.A") for k in range(bodies)]
    return cc.Scene(links, pins)


def test_the_size_of_a_scene_is_limited():
    assert chain(500).check().degrees_of_freedom == 500
    with pytest.raises(cc.errors.SceneError) as caught:
        chain(3000).check()
    assert [str(problem) for problem in caught.value.problems] == [
        "bodies: must have at most 500 entries, got 3000",
        "joints: must have at most 500 entries, got 3000",
    ]
    body = cc.Body("b", 1.0, 1.0, points={f"p{k}": (0.0, 0.0) for k in range(501)})
    with refuses("bodies[0].points", error=cc.errors.SceneError):
        cc.Scene([body], []).check()


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="no signals to threads here")
def test_ctrl_c_ends_a_check_that_takes_long():
    """The work goes on without anybody who waits for it; how long it takes does not matter."""
    laws = cc.laws.Hertz(1e7)
    scene = chain(400)
    loose = [
        cc.ClearanceRevolute(one.name, one.a, one.b, journal_radius=0.01, clearance=1e-4, contact=laws)
        for one in scene.joints
    ]
    scene = cc.Scene(scene.bodies, loose)
    scene.to_json()
    main = threading.main_thread().ident
    timer = threading.Timer(0.2, lambda: signal.pthread_kill(main, signal.SIGINT))
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            scene.check()
            timer.join()
    finally:
        signal.signal(signal.SIGINT, usual)


def test_a_long_line_is_shown_around_the_place():
    text = "joints = []\nbodies = [" + "{}, " * 200 + "]"
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text)
    for problem in caught.value.problems:
        _, line, mark = problem.message.split("\n")
        assert len(line) < 150 and line[mark.index("^")] == "{"


def test_nothing_is_near_a_name_that_is_longer_than_a_line():
    assert did_you_mean("a" * 99, ["a" * 100]) and not did_you_mean("a" * 101, ["a" * 100])


@pytest.mark.parametrize("name", ["pi", "sin", "atan2", "lambda"])
def test_names_of_expressions_are_no_parameters(name):
    with pytest.raises(cc.errors.SceneError):
        cc.loads(f"joints = []\nparameters.{name} = 2\n{BODY}")


@pytest.mark.parametrize("digits", ["\u0662\u0660", "\uff12", "\u096a"])
def test_only_our_digits_are_numbers(digits):
    for written in (f"{digits} kg", f"1e{digits} kg", digits, f"2 kg{digits}", f"2 kg^{digits}"):
        with pytest.raises(cc.errors.SceneError) as caught:
            cc.loads("joints = []\n" + BODY.replace("mass = 1", f'mass = "{written}"'))
        assert caught.value.problems[0].path.endswith(" bodies[0].mass")
