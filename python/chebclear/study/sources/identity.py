"""What must be the same for a store to return old runs of a user's model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ...errors import ArgumentError
from .reached import UnknownValueError, is_data, reached, value_text


def model_facts(call: Callable[..., Any], fixed: Mapping[str, Any], version: str | None) -> dict[str, Any]:
    """What the runs of a model have in common, as JSON has it: all parts that it can reach, or its version.

    Its outputs and features are named when the first run is known. ArgumentError is raised if something that
    it uses cannot be compared with what it uses in a later session.
    """
    name = getattr(call, "__qualname__", type(call).__qualname__)
    try:
        parts = {
            f"fixed {key}": value_text(value) if version is None or is_data(value) else "of the version"
            for key, value in fixed.items()
        }
        if version is None:
            parts |= reached(call)
    except UnknownValueError as error:
        raise ArgumentError(
            f"store needs to know whether the model is the same the next time, but {error}: give "
            'version="1" to the study, and another version whenever the model is another'
        ) from None
    code = f"model {name}" if version is None else f"model {name}, version {version}"
    return {"code": code, "topology": "", "settings": parts, "outputs": [], "features": []}
