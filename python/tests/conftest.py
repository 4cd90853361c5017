"""What the tests share: the program itself, the golden recordings, and a scene."""

import json
import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "data" / "golden"
MODES = ("interleaved", "mrr", "random")


class Program:
    """The program that was built beside the module: ctest says where it is."""

    def __init__(self, file):
        self.file = file

    def run(self, *arguments):
        """Returns the finished process, whatever its exit code is."""
        return subprocess.run([self.file, *map(str, arguments)], capture_output=True, text=True,
                              timeout=600)

    def json_frames(self, recording, config):
        """The frames that `splid replay --json` prints."""
        done = self.run("replay", recording, "--config", config, "--json", "--no-publish")
        assert done.returncode == 0, done.stderr
        return [json.loads(line) for line in done.stdout.splitlines()]

    def error_of(self, *arguments):
        """The sentence that the program ends with."""
        done = self.run(*arguments)
        assert done.returncode != 0
        return done.stderr.strip()


@pytest.fixture(scope="session")
def program():
    file = os.environ.get("SPLID_BINARY", "")
    if not file:
        pytest.skip("SPLID_BINARY names no program to compare with; ctest sets it")
    return Program(file)


@pytest.fixture(params=MODES)
def golden(request):
    """A golden recording and its configuration."""
    return GOLDEN / f"{request.param}.ptu", GOLDEN / f"{request.param}.json"


@pytest.fixture
def interleaved():
    return GOLDEN / "interleaved.ptu", GOLDEN / "interleaved.json"


@pytest.fixture
def scene():
    """The keys of [P]'s moving target, with frames of 20 ms."""
    return {
        "source": {"driver": "simulator", "pace": "max", "target": {"distance_m": 284.5}},
        "pattern": {"file": str(ROOT / "config" / "patterns" / "interleaved-180-189.json")},
        "frame": {"length_ms": 20},
    }
