"""Files and texts from strangers are refused with a typed error, or are sound."""

import hostile
import numpy as np
import pytest
from chebclear.base import files


def test_mutated_input_is_read_or_refused():
    wrong, counts = hostile.faults(inputs=300, seed=20261122)
    assert not wrong
    assert all(counts[f"{kind} refused"] > 10 for kind in ("scene", "file", "expression", "result"))
    # A piece that cannot be used is named and left out.
    assert counts["store read"] > 10 and counts["store refused"] > 3


def test_members_that_were_exchanged_are_told(tmp_path):
    path = files.save(
        tmp_path / "pair", "pair", {"first": np.arange(3.0), "second": np.arange(3.0) + 1.0}, {}
    )
    with np.load(path) as archive:
        members = dict(archive)
    np.savez(path, metadata=members["metadata"], first=members["second"], second=members["first"])
    with pytest.raises(ValueError, match="is damaged: first, second has changed"):
        files.load(path, "pair")
