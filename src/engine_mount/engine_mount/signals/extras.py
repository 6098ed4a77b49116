"""Libraries that not every installation has: asked for where they are used, missed in one sentence."""

import importlib
from types import ModuleType


class MissingLibraryError(ValueError):
    """A library is not installed; the text says what needs it and how it is installed."""


def required(module: str, what: str) -> ModuleType:
    """Return the module `module`; raises `MissingLibraryError` where it, or what it needs, is not installed.

    `what` is what needs it, as the subject of a sentence: 'reading s3:// places'.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingLibraryError(
            f'{what} needs the Python package {error.name or module}, which is not installed; '
            'make setup-desk installs it'
        ) from None
