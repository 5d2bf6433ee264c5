"""Properties of what reads texts and files: anything is refused with a typed error, or is sound."""

import contextlib
import hashlib
import json
import math
import os
import random
import warnings
from pathlib import Path

import chebclear as cc
import pytest
from chebclear.execution.store import Store
from chebclear.templates.expressions import ExpressionError, parse
from hostile import mutated, other_facts, other_members, other_piece, results, scenes, stores, torn

hypothesis = pytest.importorskip("hypothesis", reason="needs hypothesis")
from hypothesis import (  # noqa: E402
    HealthCheck,
    given,
    settings,
    strategies as st,
)

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

# The same examples every time; more of them by the environment variable.
MANY = int(os.environ.get("CHEBCLEAR_CASES", "150"))
few = settings(
    max_examples=MANY, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
)
EXAMPLE = (Path(__file__).parents[3] / "examples" / "slider_crank.toml").read_text(encoding="utf-8")

numbers = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(abs).map(repr), st.integers(0, 10**30).map(str)
)
names = st.sampled_from(["a", "b", "pi", "c", "sqrt", "__class__"])
functions = st.sampled_from(["sqrt", "sin", "cos", "atan2", "min", "max", "abs", "eval", "getattr"])


def larger(inner):
    operators = st.sampled_from([" + ", " - ", " * ", " / ", " ** ", " // ", " % ", " < ", ".", ", "])
    return st.one_of(
        st.tuples(inner, operators, inner).map("".join),
        inner.map("({})".format),
        inner.map("-{}".format),
        st.tuples(functions, inner).map(lambda pair: f"{pair[0]}({pair[1]})"),
        st.tuples(inner, inner).map(lambda pair: f"{pair[0]}[{pair[1]}]"),
    )


expressions = st.one_of(st.recursive(st.one_of(numbers, names), larger, max_leaves=12), st.text(max_size=30))


@few
@given(expressions, st.floats(), st.floats(-1e3, 1e3))
def test_expressions_give_a_number_or_are_refused(text, a, b):
    try:
        found = parse(text).evaluate({"a": a, "b": b})
    except ExpressionError:
        return
    assert isinstance(found, float) and math.isfinite(found)


scalars = st.one_of(
    st.text(max_size=12).map(lambda text: json.dumps(text, ensure_ascii=True)),
    st.floats().map(repr),
    st.integers(-(2**63), 2**63 - 1).map(str),
    st.sampled_from(
        ["true", "[]", "{}", "'20 um'", "'1 kg'", "'a'", "'ground.O'", "1979-05-27", "'1e999 m'"]
    ),
)
toml_values = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4).map(lambda items: f"[{', '.join(items)}]"),
    max_leaves=8,
)


@few
@given(st.data())
def test_files_with_any_value_are_read_or_refused(data):
    lines = EXAMPLE.splitlines()
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(lines) - 1))
        key, sign, _ = lines[place].partition("=")
        lines[place] = f"{key}= {data.draw(toml_values)}" if sign else data.draw(st.text(max_size=20))
    try:
        scene = cc.loads("\n".join(lines))()
    except cc.errors.SceneError as error:
        assert error.problems and all(str(problem) for problem in error.problems)
        return
    assert cc.Scene.from_json(scene.to_json()) == scene


SCENES = [json.loads(scene.to_json()) for scene in scenes()]


@few
@given(st.integers(0, 2**64 - 1))
def test_scenes_with_something_changed_are_read_or_refused(seed):
    chance = random.Random(seed)
    text = json.dumps(mutated(chance.choice(SCENES), chance))
    try:
        cc.Scene.from_json(torn(text, chance) if chance.random() < 0.2 else text).check()
    except cc.errors.SceneError as error:
        assert error.problems and all(str(problem) for problem in error.problems)


def test_a_type_that_is_no_word_is_refused():
    with pytest.raises(cc.errors.SceneError):
        cc.loads(EXAMPLE.replace('type = "', 'type = [] # "', 1))()


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """Saved results of every kind with the bytes of their files, and a file."""
    folder = tmp_path_factory.mktemp("saved")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        files = results(folder)
    path = folder / "changed.npz"
    known = []
    for data in files:
        path.write_bytes(data)
        known.append((cc.load_result(path), data))
    return known, path


bytes_anywhere = st.lists(
    st.tuples(st.integers(0, 10**6), st.binary(min_size=1, max_size=8)), min_size=1, max_size=4
)
seeds = st.integers(0, 2**64 - 1)


@few
@given(st.integers(0, 3), bytes_anywhere)
def test_result_files_with_any_bytes_are_the_same_or_refused(saved, which, changes):
    (result, data), path = saved[0][which], saved[1]
    changed = bytearray(data)
    for place, put in changes:
        start = place % len(changed)
        changed[start : start + len(put)] = put
    path.write_bytes(changed)
    try:
        found = cc.load_result(path)
    except ValueError:
        return
    assert found == result


@few
@given(st.integers(0, 3), seeds, st.sampled_from([other_facts, other_facts, other_members]))
def test_result_files_whose_checksums_fit_are_read_or_refused(saved, which, seed, change):
    known, path = saved
    path.write_bytes(change(known[which][1], random.Random(seed)))
    try:
        found = cc.load_result(path)
    except ValueError:
        return
    assert type(found) in {type(result) for result, _ in known}


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Files of some stores, and a folder."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return stores(tmp_path_factory.mktemp("stores")), tmp_path_factory.mktemp("store")


json_values = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8), st.just("runs of a study")
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(
            st.one_of(
                st.sampled_from(["format", "kind", "settings", "outputs", "ends"]), st.text(max_size=5)
            ),
            inner,
            max_size=4,
        ),
    ),
    max_leaves=8,
)


@few
@given(st.data())
def test_stores_with_any_bytes_give_their_runs_or_are_refused(kept, data):
    known, folder = kept
    files = dict(data.draw(st.sampled_from(known)))
    facts = json.loads(files["store.json"])
    victim = data.draw(st.sampled_from(sorted(files)))
    changed = bytearray(files.pop(victim))
    honest = data.draw(st.booleans())
    if victim == "store.json" and honest:
        changed[:] = json.dumps(data.draw(json_values)).encode()
    elif honest:
        changed[:] = other_piece(bytes(changed), random.Random(data.draw(seeds)))
    else:
        places = st.tuples(st.integers(0, len(changed) - 1), st.binary(min_size=1, max_size=8))
        for start, put in data.draw(st.lists(places, min_size=1, max_size=4)):
            changed[start : start + len(put)] = put
        del changed[data.draw(st.one_of(st.just(len(changed)), st.integers(0, len(changed)))) :]
    if victim != "store.json" and honest:
        victim = f"piece-{hashlib.sha256(changed).hexdigest()[:32]}.npz"
    files[victim] = bytes(changed)
    for path in folder.iterdir():
        path.unlink()
    for name, content in files.items():
        (folder / name).write_bytes(content)
    try:
        with contextlib.closing(Store(folder, facts)) as store:
            found = list(store.read([(0, key) for key in store._where]))
    except cc.errors.StoreError:
        return
    for numbers, piece in found:
        assert (
            len(numbers) == len(piece.values) == len(piece.features) == len(piece.counts) == len(piece.ends)
        )
