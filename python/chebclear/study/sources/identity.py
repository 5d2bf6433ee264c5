"""What must be the same for a store to return old runs of a user's model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ...errors import ArgumentError
from .reached import UnknownValueError, is_data, reached, value_text


@dataclass(frozen=True)
class ModelIdentity:
    """Common properties of the runs of a model in a store."""

    name: str
    """Name of the function."""
    version: str | None
    """What the user calls the model; None if its parts are compared."""
    parts: Mapping[str, str]
    """The values of `fixed` (those that are data, with a version) and all parts that the model can reach."""

    @classmethod
    def of(cls, call: Callable[..., Any], fixed: Mapping[str, Any], version: str | None) -> ModelIdentity:
        """The identity of a model.

        Raises
        ------
        ValueError
            If something that it uses cannot be compared with what it uses in a later session.
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
        return cls(name, version, parts)

    def facts(self) -> dict[str, Any]:
        """As JSON has it; outputs and features are named when the first run is known."""
        version = "" if self.version is None else f", version {self.version}"
        return {
            "code": f"model {self.name}{version}",
            "topology": "",
            "settings": dict(self.parts),
            "outputs": [],
            "features": [],
        }
