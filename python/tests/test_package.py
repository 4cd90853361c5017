"""What the package says of itself: names, stubs, docstrings, configurations, warnings."""

import ast
import inspect
import logging
import pathlib

import pytest

import splid
from splid import _splid

STUB = pathlib.Path(splid.__file__).with_name("_splid.pyi")


def names_in(body):
    """Names that a piece of the stub declares, with those inside of its classes."""
    found = {}
    for node in body:
        if isinstance(node, ast.ClassDef):
            found[node.name] = names_in(node.body)
        elif isinstance(node, ast.FunctionDef):
            found[node.name] = {}
        elif isinstance(node, ast.AnnAssign):
            found[node.target.id] = {}
    return found


def test_the_stub_declares_what_is_there_and_nothing_else():
    declared = names_in(ast.parse(STUB.read_text(encoding="utf-8")).body)
    there = {name for name in dir(_splid) if not name.startswith("__")} | {"__version__"}
    assert set(declared) == there
    for name, inner in declared.items():
        kind = getattr(_splid, name)
        if inspect.isclass(kind) and not issubclass(kind, Exception):
            own = {member for member in vars(kind) if not member.startswith("_")}
            assert {member for member in inner if not member.startswith("_")} == own, name


def test_everything_public_has_a_docstring():
    for name in splid.__all__:
        thing = getattr(splid, name)
        if callable(thing) and not inspect.isclass(thing):
            assert thing.__doc__, name
        if inspect.isclass(thing):
            assert thing.__doc__, name
        if inspect.isclass(thing) and thing.__module__ != "splid._splid":
            for member, value in vars(thing).items():
                if not member.startswith("_") and (inspect.isfunction(value)
                                                   or isinstance(value, property)):
                    assert value.__doc__, f"{name}.{member}"


def test_an_unknown_key_names_its_place(scene):
    with pytest.raises(splid.UsageError, match="/frame/lenght_ms.*length_ms"):
        splid.Config({**scene, "frame": {"lenght_ms": 20}})
    with pytest.raises(splid.UsageError, match="absent.json"):
        splid.Config("absent.json")
    assert issubclass(splid.UsageError, splid.SplidError)


def test_defaults_are_in_effect(scene):
    assert splid.Config(scene).to_dict()["pipeline"]["estimation_threads"] >= 1


def test_a_pattern_that_comes_with_the_package_is_found_and_told(scene, tmp_path, caplog):
    scene["pattern"]["file"] = "interleaved-180-189.json"
    with caplog.at_level(logging.WARNING, logger="splid"):
        splid.Config(scene, folder=tmp_path)
    assert "splid's own pattern" in caplog.text
