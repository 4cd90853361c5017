"""What arguments may be."""

import os
from typing import Any


def path_of(name: str, value: Any, otherwise: str = "") -> str:
    """A path as text. otherwise: what else the argument may be, for the error.

    Errors: TypeError naming the argument.
    """
    try:
        return os.fsdecode(value)
    except TypeError:
        raise TypeError(f"{name}: {value!r} was given, but the path of a file{otherwise} is "
                        "expected") from None
