"""What a store takes for the same model: no change of anything that it reaches passes for none."""

import json
import os
import platform
import subprocess
import sys
import sysconfig
import textwrap
from pathlib import Path
from typing import NamedTuple

import chebclear as cc
import numpy as np
import pytest
from chebclear.execution.store import differences
from chebclear.study.sources.reached import model_facts
from refusals import refuses

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")


class Model(NamedTuple):
    """A model in files, and a change of one of them."""

    files: dict[str, str]
    old: str
    new: str
    whole: bool
    """Whether all of a module counts, so that no function may be added."""


def models():
    """Those of `identity.txt`, by name."""
    found = {}
    for block in Path(__file__).with_name("identity.txt").read_text().split("=== ")[1:]:
        title, _, text = block.partition("\n")
        name, _, edit = title.partition(": ")
        whole, edit = edit.endswith(" (whole module)"), edit.removesuffix(" (whole module)")
        old, _, new = edit.partition(" -> ")
        first, *others = text.split("--- ")
        files = {"study.py": first} | {
            file: rest for file, _, rest in (one.partition("\n") for one in others)
        }
        assert any(old in text for text in files.values()), name
        found[name] = Model(files, old, new, whole)
    return found


MODELS = models()
CHANGES = {name: model for name, model in MODELS.items() if model.old}
REFUSED = MODELS.keys() - CHANGES.keys()


PROGRAM = """
import importlib, json, sys
from pathlib import Path
from chebclear.errors import ArgumentError
from chebclear.study.sources.reached import model_facts

sys.dont_write_bytecode = True
found = {}
for folder in json.load(sys.stdin):
    sys.path.insert(0, folder)
    importlib.invalidate_caches()
    import numpy
    kept = dict(vars(numpy))
    try:
        study = importlib.import_module("study")
        found[folder] = model_facts(study.model, {}, None)
    except ArgumentError as error:
        found[folder] = str(error)
    vars(numpy).update(kept)
    sys.path.remove(folder)
    for name in list(sys.modules):
        if name.partition(".")[0] in ("study", "helper", "config", "pack", "xxlimited"):
            del sys.modules[name]
print(json.dumps(found))
"""


def identities(folders, seed):
    """Identity of the model in each folder, or why it is refused, in another process."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=json.dumps(list(map(str, folders))),
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONHASHSEED": str(seed)},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def written(folder, files):
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """Identities of all models: as they are, in two processes; after edits of something else; changed."""
    root = tmp_path_factory.mktemp("models")
    folders = {}
    for number, (name, model) in enumerate(MODELS.items()):
        folders["as", name] = written(root / f"as{number}", model.files)
        if name in CHANGES:
            more = "# Another.\n" if model.whole else "def another_one():\n    return 'nothing of it'\n"
            edited = {file: f"# A comment.\n\n{text}{more}" for file, text in model.files.items()}
            changed = {file: text.replace(model.old, model.new, 1) for file, text in model.files.items()}
            folders["edited", name] = written(root / f"edited{number}", edited)
            folders["changed", name] = written(root / f"changed{number}", changed)
    first = identities(folders.values(), 1)
    again = identities([folder for (kind, _), folder in folders.items() if kind == "as"], 2)
    return {key: first[str(folder)] for key, folder in folders.items()} | {
        ("again", name): again[str(folder)] for (kind, name), folder in folders.items() if kind == "as"
    }


@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_model_is_another_one(known, name):
    assert isinstance(known["as", name], dict), known["as", name]
    assert known["as", name] == known["again", name] == known["edited", name]
    assert known["changed", name] != known["as", name]


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_what_cannot_be_known_asks_for_a_version(known, name):
    assert isinstance(known["as", name], str), known["as", name]
    assert "version=" in known["as", name]


def facts(model, fixed=None, version=None):
    return model_facts(model, fixed or {}, version)


def test_compiled_modules_of_the_user_are_compared_by_their_bytes(tmp_path):
    libraries = Path(sysconfig.get_path("stdlib"), "lib-dynload").glob("xxlimited.*")
    library = next(iter(libraries), None)
    if library is None:
        pytest.skip("needs the example of a compiled module that comes with Python")
    text = "import xxlimited\ndef model(a):\n    return {'y': xxlimited.foo(1, 2) * a}\n"
    folders = [written(tmp_path / name, {"study.py": text}) for name in ("one", "same", "other")]
    for folder, more in zip(folders, (b"", b"", b"more"), strict=True):
        (folder / library.name).write_bytes(library.read_bytes() + more)
    one, same, other = (identities([folder], 1)[str(folder)] for folder in folders)
    assert one == same != other
    (changed,) = (name for name in one["settings"] if one["settings"][name] != other["settings"][name])
    assert changed == "compiled xxlimited"


def test_packages_count_by_their_versions(monkeypatch):
    def model(a):
        return {"y": float(np.sin(a))}

    def unnamed(a):  # an array has the methods of its package
        return {"y": TABLE.cumsum()[-1] * a}

    before = facts(model)["settings"]
    assert facts(unnamed)["settings"]["package numpy"] == before["package numpy"]
    assert before["package numpy"] == f"numpy {np.__version__}"
    assert before["package python"] == platform.python_version()
    monkeypatch.setattr(platform, "python_version", lambda: "3.99.0")
    assert differences(facts(model) | {"settings": before}, facts(model)) == [
        f"package python: the store has '{before['package python']}', this study '3.99.0'"
    ]


def test_a_script_is_known_by_the_name_under_which_others_import_it(tmp_path):
    text = "K = 1.5\ndef model(a):\n    return {'y': K * a}\n"
    ending = f"if __name__ == '__main__':\n    import json, sys\n{textwrap.indent(SHOWN, '    ')}"
    written(tmp_path, {"study.py": text + ending})
    run = [sys.executable, str(tmp_path / "study.py")]
    done = subprocess.run(run, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout) == identities([tmp_path], 1)[str(tmp_path)]


SHOWN = """
from chebclear.study.sources.reached import model_facts
print(json.dumps(model_facts(model, {}, None)))
"""


def test_fixed_values_are_compared_with_a_version_too():
    one = {"k": 1.5, "table": np.arange(4.0), "names": {"a": ["b", (1, None)]}}
    assert facts(len, one, "1") == facts(len, dict(one), "1")
    assert facts(len, one, "1") != facts(len, one, "2")
    for name, other in (("k", 2.5), ("table", np.arange(5.0)), ("names", {"a": ["b", (2, None)]})):
        assert facts(len, one, "1") != facts(len, one | {name: other}, "1")


EVERYDAY = """
import abc, collections, dataclasses, datetime, decimal, enum, functools, json, logging, operator, pathlib
import random, re, sys, threading, types, typing
import numpy as np
from scipy import signal, sparse, stats
from scipy.interpolate import CubicSpline, RegularGridInterpolator
import chebclear as cc
from chebclear.study.sources.reached import value_text

T = typing.TypeVar("T")

class Base(abc.ABC, typing.Generic[T]):
    lock = threading.Lock()
    @abc.abstractmethod
    def f(self, x: T) -> T: ...

class Derived(Base[float]):
    def f(self, x):
        return x

class Color(enum.Flag):
    RED = enum.auto()
    BLUE = enum.auto()

@dataclasses.dataclass(frozen=True, slots=True)
class Options:
    x: float = 1.0
    y: "list[int] | None" = None

values = [
    logging.getLogger("x"), Derived().f, Color.RED | Color.BLUE, Options(), decimal.Decimal("1.5"),
    datetime.datetime(2020, 1, 1), pathlib.Path("a"), re.compile("x"), range(3), slice(1, 2),
    collections.OrderedDict(a=1), collections.defaultdict(list), collections.Counter("abc"),
    collections.deque([1]), types.SimpleNamespace(a=1), operator.itemgetter(1), {"x", "y", (1, "z")},
    CubicSpline([0, 1, 2], [0, 1, 2]), RegularGridInterpolator(([0, 1], [0, 1]), np.eye(2)), stats.norm,
    stats.norm(1.0, 2.0), signal.TransferFunction([1], [1, 2]), sparse.eye(3).tocsr(), np.dtype("f8"),
    np.ma.array([1.0, 2.0], mask=[0, 1]), np.poly1d([1, 2]), np.float32(1.5), np.datetime64("2020"),
    np.random.default_rng(1), np.random.normal, np.add.reduce, np.sum, random.Random(1), random.uniform,
    list[int], int | None, 10**5000, cc.mechanisms.slider_crank(), cc.Interval.around(1.0, rel=0.1),
    functools.lru_cache(maxsize=3)(len), threading.Event(),
]
print(json.dumps([value_text(value) for value in values]))
"""


def test_everyday_values_are_known_in_every_process():
    texts = set()
    for seed in range(2):
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", EVERYDAY],
            capture_output=True,
            text=True,
            check=False,
            env=os.environ | {"PYTHONHASHSEED": str(seed)},
        )
        assert done.returncode == 0, done.stderr
        texts.add(done.stdout)
    assert len(texts) == 1 and len(set(json.loads(texts.pop()))) > 40


def test_a_version_stands_for_objects_in_fixed():
    for one, other in (((x for x in [1.0]), (x for x in [2.0])), (Open(1.5), Open(2.5))):
        with pytest.raises(cc.errors.ArgumentError):
            facts(len, {"k": one, "table": [1.5]})
        assert facts(len, {"k": one, "table": [1.5]}, "1") == facts(len, {"k": other, "table": [1.5]}, "1")
        assert facts(len, {"k": one, "table": [1.5]}, "1") != facts(len, {"k": one, "table": [2.5]}, "1")


class Open:
    def __init__(self, k):
        self.k, self.file = k, sys.stdout


TABLE = np.arange(4.0)
COUNTS = {"calls": 0}


def counting(a):
    COUNTS["calls"] += 1
    return {"y": a}


def test_a_model_that_changes_what_it_reads_needs_a_version(tmp_path):
    box = {"a": cc.Interval.around(1.0, rel=0.1)}
    cc.Study(counting, box, store=tmp_path / "first").scan(2)
    with pytest.raises(cc.errors.StoreError):
        cc.Study(counting, box, store=tmp_path / "first").scan(2)
    for points in (2, 3):
        study = cc.Study(counting, box, store=tmp_path / "second", version="1")
        calls = COUNTS["calls"]
        study.scan(points)
        assert COUNTS["calls"] - calls == (3 if points == 2 else 0)
    with pytest.raises(cc.errors.StoreError):
        cc.Study(counting, box, store=tmp_path / "second", version="2").scan(2)


def test_a_version_is_for_a_store_of_a_model(tmp_path):
    box = {"a": cc.Interval.around(1.0, rel=0.1)}
    for wrong in ({"version": "1"}, {"version": 1, "store": tmp_path}, {"version": "", "store": tmp_path}):
        with refuses("version"):
            cc.Study(counting, box, **wrong)
    scenes, kept = {"crank_length": cc.Interval.around(0.05, rel=0.1)}, {"store": tmp_path, "version": "1"}
    with refuses("version"):
        cc.Study(cc.mechanisms.slider_crank, scenes, ["slider.x"], duration=1e-3, samples=11, **kept)
