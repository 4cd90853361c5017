"""Configurations, as the program reads them."""

import json
import os
import pathlib
from typing import Any, Union

from splid import _splid
from splid._log import told

_OWN_PATTERNS = pathlib.Path(__file__).parent / "patterns"


def _shipped_patterns() -> str:
    return str(_OWN_PATTERNS) if _OWN_PATTERNS.is_dir() else _splid.shipped_patterns_folder()


class Config:
    """A configuration that is valid as a whole (docs/reference/configuration.md has every key).

    Config.load() reads a file, Config.from_dict() takes the same keys as a dict. Every function
    that takes a configuration also takes the path of its file, or such a dict.

    Errors: UsageError with the file, the JSON pointer, the value and its bound; for an unknown key
    the nearest known one.
    """

    def __init__(self, text: str, file: str) -> None:
        """text: JSON. file: its name in errors; relative paths in it are relative to that file."""
        with told():
            self._bound = _splid.Config(text, file, _shipped_patterns())

    @classmethod
    def load(cls, file: "os.PathLike[str] | str") -> "Config":
        """Reads a configuration file."""
        path = os.fspath(file)
        try:
            return cls(pathlib.Path(path).read_text(encoding="utf-8"), path)
        except OSError as error:
            raise _splid.UsageError(f"{path}: cannot be read: {error.strerror}") from error

    @classmethod
    def from_dict(cls, keys: dict[str, Any], folder: "os.PathLike[str] | str" = ".") -> "Config":
        """Takes the keys of a file; "schema" may be left out. Relative paths start in `folder`."""
        text = json.dumps({"schema": "splid.config", **keys})
        return cls(text, os.path.join(os.fspath(folder), "(dict)"))

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
    if isinstance(config, Config):
        return config._bound
    if isinstance(config, dict):
        return Config.from_dict(config)._bound
    return Config.load(config)._bound
