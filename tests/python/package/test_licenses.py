"""Licenses of what the package is built from and needs: those that let anyone use and pass on it."""

import importlib.metadata
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
ALLOWED = {
    *(
        "MIT",
        "MIT-0",
        "Apache-2.0",
        "BSD-2-Clause",
        "BSD-3-Clause",
        "0BSD",
        "Zlib",
        "ISC",
        "BSL-1.0",
        "CC0-1.0",
    ),
    *("Unlicense", "Unicode-3.0", "PSF-2.0", "HPND", "MPL-2.0", "Python-2.0", "MIT-CMU"),
}
WORDS = {
    "BSD License": "BSD-3-Clause",
    "MIT License": "MIT",
    "Apache Software License": "Apache-2.0",
    "Python Software Foundation License": "PSF-2.0",
    "Mozilla Public License 2.0 (MPL 2.0)": "MPL-2.0",
    "Historical Permission Notice and Disclaimer (HPND)": "HPND",
}
"""What packages say whose license is no SPDX expression, by the names of their classifiers."""


def allowed(expression):
    """Whether one choice that an SPDX expression leaves has allowed licenses only."""
    text = re.sub(r"\s+WITH\s+LLVM-exception", "", expression.replace("/", " OR "))
    terms = re.findall(r"[()]|[^\s()]+", text)
    words = {"AND": "and", "OR": "or", "(": "(", ")": ")"}
    python = " ".join(words.get(term) or str(term in ALLOWED) for term in terms)
    assert re.fullmatch(r"(True|False|and|or|[() ])+", python), expression
    return eval(python)


def test_expressions_are_read_as_choices():
    assert allowed("MIT OR GPL-3.0-only") and allowed("Unlicense/MIT")
    assert allowed("(MIT OR Apache-2.0) AND Unicode-3.0") and allowed("Apache-2.0 WITH LLVM-exception")
    assert not allowed("MIT AND GPL-3.0-only") and not allowed("AGPL-3.0-or-later")


@pytest.mark.skipif(shutil.which("cargo") is None, reason="needs cargo")
def test_crates_have_licenses_that_are_allowed():
    version = subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout
    host = re.search(r"host: (.*)", version)[1]
    command = [
        "cargo",
        "metadata",
        "--format-version",
        "1",
        "--locked",
        "--offline",
        "--filter-platform",
        host,
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"the crates are not here: {done.stderr.strip().splitlines()[-1]}")
    crates = {crate["name"]: crate["license"] for crate in json.loads(done.stdout)["packages"]}
    assert len(crates) > 20
    assert not {name: license for name, license in crates.items() if not (license and allowed(license))}


def needed(name, extra=""):
    """Names of the packages that a package needs, if they are installed, and those that these need."""
    found = {}
    for text in importlib.metadata.requires(name) or ():
        other = re.match(r"[\w.-]+", text)[0]
        marker = re.search(r"extra == ['\"]([\w-]+)['\"]", text)
        if (marker[1] if marker else "") not in ("", extra) or other in found:
            continue
        try:
            found[other] = importlib.metadata.metadata(other)
        except importlib.metadata.PackageNotFoundError:
            continue
        found |= needed(other)
    return found


def test_packages_have_licenses_that_are_allowed():
    wrong = {}
    packages = needed("chebclear", "test")
    assert {"numpy", "scipy", "pytest"} <= set(packages)
    for name, facts in packages.items():
        stated = facts.get("License-Expression") or ""
        classified = [
            text.rpartition(" :: ")[2]
            for text in facts.get_all("Classifier", [])
            if text.startswith("License ::")
        ]
        if not stated and classified:
            stated = " AND ".join(WORDS.get(word, word.replace(" ", "-")) for word in classified)
        stated = stated or (facts.get("License") or "none").strip().splitlines()[0]
        if not re.fullmatch(r"[\w.+() /-]+", stated) or not allowed(WORDS.get(stated, stated)):
            wrong[name] = stated
    assert not wrong
