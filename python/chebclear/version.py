"""The version of the package."""

from .base.files import package_version

__version__ = package_version()
