"""Every command of docs/guide/first-hour.md runs, in the order of the page, and gives what it says."""

import os
import pathlib
import re
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

PAGE = ROOT / "docs" / "guide" / "first-hour.md"


def blocks():
    """The fenced blocks of the page: language, what stands after it, and text."""
    return re.findall(r"^```(\w+) ?(\S*)\n(.*?)^```$", PAGE.read_text(encoding="utf-8"),
                      re.MULTILINE | re.DOTALL)


def run(command, folder, program):
    """Runs a line of the page as a shell would, with this build's program and this Python."""
    path = f"{pathlib.Path(program.file).parent}:{pathlib.Path(sys.executable).parent}"
    environment = {**os.environ, "PATH": f"{path}:{os.environ['PATH']}", "MPLBACKEND": "agg"}
    done = subprocess.run(["sh", "-c", command], cwd=folder, env=environment, capture_output=True,
                          text=True, timeout=600)
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return done.stdout + done.stderr


def write(text, name, folder):
    (folder / name).write_text(text, encoding="utf-8")


@pytest.mark.slow
def test_the_page_from_its_first_command_to_its_last(program, tmp_path):
    made = [block for block in blocks() if block[1] in ("lab.json", "still.json", "simulate")]
    for language, name, text in sorted(made):  # the configurations before what needs them
        if language == "json":
            write(text, name, tmp_path)
        else:
            for command in text.splitlines():
                run(command, tmp_path, program)
    said = ""
    for language, name, text in blocks():
        if name in ("lab.json", "still.json", "simulate"):
            continue
        if language == "json":
            write(text, name, tmp_path)
            continue
        for command in text.splitlines():
            said += run(command, tmp_path, program)
    for line in ("sync period", "recommended at 50 ms: ", "found.json: random, 40 pulses", "81 frames: 80 ok, 1 incomplete",
                 '"pattern":{"file":"found.json"},"pulse":{"shape":"tabulated"}'):
        assert line in said, line
    table = np.genfromtxt(tmp_path / "frames.csv", delimiter=",", names=True, dtype=None,
                          encoding="utf-8")
    good = table[table["status"] == "ok"]
    assert len(good) == 80
    moved_m = good["distance_m"][-1] - good["distance_m"][0]
    assert abs(moved_m - 3 * 0.05 * 79) < 0.01
    for picture in ("pulse.svg", "run.png", "pulses.png", "tradeoff.svg"):
        assert (tmp_path / picture).stat().st_size > 5000, picture
    for made_file in ("frames.h5", "measured/lab.h5", "measured/still.h5", "measured/summary.csv"):
        assert (tmp_path / made_file).exists(), made_file


def test_what_the_page_shows_of_the_first_command_is_what_it_says(program, tmp_path):
    page = PAGE.read_text(encoding="utf-8")
    for language, name, text in sorted(blocks()):
        if name in ("lab.json", "still.json"):
            write(text, name, tmp_path)
        if name == "simulate":
            run(text.splitlines()[0], tmp_path, program)
    said = [line.split() for line in run("splid check lab.ptu", tmp_path, program).splitlines()]
    shown = [line.split() for line in re.findall(r"^    (?:lab.ptu:|  )(?:.*)$", page, re.MULTILINE)]
    assert len(shown) == 5
    for line in shown:
        assert line in said, line
