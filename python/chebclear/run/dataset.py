"""What other programs get with every result: versions, settings, warnings, the scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from ..base.files import package_version
from ..scene.scene import Scene
from .settings import Settings


def common_facts(
    settings: Settings | None, scene: Scene | None, warnings: Sequence[str]
) -> dict[str, str | int | float]:
    """Facts common to all results: versions, settings, warnings and the scene, if a result has them."""
    metadata: dict[str, str | int | float] = {"chebclear": package_version(), "warnings": "\n".join(warnings)}
    if settings is not None:
        plain = dataclasses.asdict(settings)
        metadata |= {name: value for name, value in plain.items() if isinstance(value, str | int | float)}
    if scene is not None:
        metadata["scene"] = scene.to_json()
    return metadata
