#!/usr/bin/env python3
"""Times splid.frames() against `splid replay --json` on the same recording, and says how much memory it took.

  PYTHONPATH=build/release/python python3 bench/python_frames.py [--seconds N] [--photons-per-s B] [--rounds R]

Simulates a recording of the scene of [P], lets both measure it in turn (R rounds), checks that they say the
same of every frame, and prints medians. With a background of --photons-per-s 40e6 a recording of 130 s has 20 GB."""

import argparse
import json
import pathlib
import resource
import statistics
import subprocess
import tempfile
import time

import splid

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/release/splid"


def simulated(folder, seconds, background):
    """A recording, and the configuration that it was simulated by."""
    config = {"schema": "splid.config", "v": [1, 0], "source": {"driver": "simulator", "pace": "max"},
              "pattern": {"file": str(ROOT / "config/patterns/interleaved-180-189.json")}}
    if background:
        config["source"]["ambient_per_s"] = background
    (folder / "config.json").write_text(json.dumps(config))
    subprocess.run([PROGRAM, "simulate", "--config", folder / "config.json", "--seconds", str(seconds),
                    "--log-level", "warning", "--output", folder / "scene.ptu"], check=True)
    return folder / "scene.ptu", folder / "config.json"


def timed(measure):
    begun = time.monotonic()
    result = measure()
    return time.monotonic() - begun, result


def replayed(recording, config):
    with open(recording.with_suffix(".jsonl"), "wb+") as lines:
        subprocess.run([PROGRAM, "replay", recording, "--config", config, "--json", "--no-publish",
                        "--log-level", "warning"], check=True, stdout=lines)
        lines.seek(0)
        return [json.loads(line) for line in lines]


def is_same(table, messages):
    return len(table) == len(messages) and all(
        row["sequence"] == message["sequence"] and row["status"] == message["status"]
        and (row["status"] != "ok" or row["distance_m"] == message["distance_m"])
        for row, message in zip(table, messages))


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=60)
    options.add_argument("--photons-per-s", type=float, default=0, help="background; 0: that of the scene")
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--folder", help="where the recording goes; by default the temporary one")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(dir=asked.folder) as folder:
        recording, config = simulated(pathlib.Path(folder), asked.seconds, asked.photons_per_s)
        size = recording.stat().st_size
        by_python, by_replay = [], []
        for _ in range(asked.rounds):
            seconds, table = timed(lambda: splid.frames(recording, json.loads(config.read_text())))
            by_python.append(seconds)
            seconds, messages = timed(lambda: replayed(recording, config))
            by_replay.append(seconds)
            if not is_same(table, messages):
                raise SystemExit("splid.frames() and splid replay do not agree")
        resident_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print("| recording | frames | splid.frames() | splid replay --json | ratio | most memory, Python |")
        print("|---|---|---|---|---|---|")
        ratios = [one / other for one, other in zip(by_python, by_replay)]
        print(f"| {size / 1e9:.3g} GB | {len(table)} | {statistics.median(by_python):.3g} s "
              f"| {statistics.median(by_replay):.3g} s | {statistics.median(ratios):.3f} "
              f"({min(ratios):.3f} to {max(ratios):.3f}) | {resident_mib:.0f} MiB |")


if __name__ == "__main__":
    main()
