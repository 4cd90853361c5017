"""Configurations, as the program reads them."""

import json
import os
import pathlib
from typing import Any, Union

from splid import _splid
from splid._arguments import path_of
from splid._log import told

_OWN_PATTERNS = pathlib.Path(__file__).parent / "patterns"


def _shipped_patterns() -> str:
    return str(_OWN_PATTERNS) if _OWN_PATTERNS.is_dir() else _splid.shipped_patterns_folder()


class Config:
    """A configuration that is valid as a whole (docs/reference/configuration.md has every key).

    Every function that takes a configuration also takes what its constructor takes.

    Errors: UsageError with the file, the JSON pointer, the value and its bound; for an unknown key
    the nearest known one.
    """

    def __init__(self, config: "os.PathLike[str] | str | dict[str, Any]",
                 folder: "os.PathLike[str] | str" = ".") -> None:
        """config: the path of a file, in which relative paths start in the file's folder; or its
        keys as a dict, of which "schema" may be left out and relative paths start in `folder`.
        """
        if isinstance(config, dict):
            text = json.dumps({"schema": "splid.config", **config})
            file = os.path.join(path_of("folder", folder), "(dict)")
        else:
            file = path_of("config", config, ", or a dict")
            try:
                text = pathlib.Path(file).read_text(encoding="utf-8")
            except OSError as error:
                raise _splid.UsageError(f"{file}: cannot be read: {error.strerror}") from error
        with told():
            self._bound = _splid.Config(text, file, _shipped_patterns())

    @property
    def file(self) -> str:
        """The name of the file, as given."""
        return self._bound.file

    def to_dict(self) -> dict[str, Any]:
        """All keys that are in effect, defaults included."""
        keys: dict[str, Any] = json.loads(self._bound.json())
        return keys

    def __repr__(self) -> str:
        return f"splid.Config({self.file!r})"


AnyConfig = Union[Config, "os.PathLike[str]", str, dict[str, Any]]


def bound_config(config: AnyConfig) -> _splid.Config:
    """The compiled part of a configuration."""
    return (config if isinstance(config, Config) else Config(config))._bound
