"""The list of codes of notices: it has each that the sources make, and no other."""

import re
from pathlib import Path

from chebclear.notices import CODES

ROOT = Path(__file__).parents[3]
MADE = re.compile(r'(?:\bNotice(?:::\w+)?\(\s*|\bcode: )(?:"(\w+)"|([A-Z_]+)\b)')


def test_every_code_is_listed_and_made():
    files = [*(ROOT / "rust/src").rglob("*.rs"), *(ROOT / "python/chebclear").rglob("*.py")]
    found = [pair for path in files for pair in MADE.findall(path.read_text(encoding="utf-8"))]
    made, named = ({one[k] for one in found if one[k]} for k in (0, 1))
    assert len(made) > 20 and named == {"HORIZON", "FAILED", "STOPPED", "TOO_FEW_RUNS", "SETTLING"}
    assert made | {name.lower() for name in named} == set(CODES)
