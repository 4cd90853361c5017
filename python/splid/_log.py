"""What the compiled part has to say, handed to Python's logging once its call is over."""

import contextlib
import logging
from collections.abc import Iterator

from splid import _splid

_LOGGER = logging.getLogger("splid")
# The levels of spdlog, from trace to critical, as those of logging.
_LEVELS = (5, logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR, logging.CRITICAL)


@contextlib.contextmanager
def told() -> Iterator[None]:
    """A block after which all that was logged in it is told."""
    try:
        yield
    finally:
        for level, text in _splid.take_log():
            _LOGGER.log(_LEVELS[min(level, len(_LEVELS) - 1)], "%s", text)
