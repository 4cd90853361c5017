#!/usr/bin/env python3
"""[P] Fig. 7 and 8: a card on a stage, measured by the daemon in five modes and in low and strong light.

  PYTHONPATH=build/release/python python3 bench/stage.py --output docs/evidence [--seconds N]

Simulates the stage with its encoder, replays each recording through the daemon to a subscriber, and writes
data/stage.csv, and studies/fig7.png and fig8.png into the folder. The method of [P] measures the same recordings
beside splid's. [P] has no mrr here, and knows an ambiguous range modulo 14.2 m alone, which is compared modulo that.
scripts/evidence then puts the lines into docs/evidence/accuracy.md."""

import argparse
import csv
import json
import pathlib
import subprocess
import tempfile

import numpy as np

import splid
from splid import plots

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/release/splid"
SHIPPED = ROOT / "config/patterns"
# In turns of one millisecond, [P]'s mrr has as many pulses of 180 ns as of 189.
PATTERNS = {"baseline": splid.Pattern(SHIPPED / "periodic-3780.json"),
            "ambiguous": splid.Pattern(SHIPPED / "ambiguous-94.5.json"),
            "mrr": splid.Pattern.mrr([180, 189], 2710),
            "random": splid.Pattern(SHIPPED / "random-40.json"),
            "interleaved": splid.Pattern(SHIPPED / "interleaved-180-189.json")}
METHODS = ("search", "paper")
# [P] Table 1, counts a pulse and counts a ns. Strong light is ours: [P]'s is not known.
SIGNAL = {"baseline": 4.03e-4, "ambiguous": 13.6e-4, "mrr": 14.0e-4, "random": 13.2e-4, "interleaved": 13.8e-4}
BACKGROUND = {"baseline": 1.75e-4, "ambiguous": 1.75e-4, "mrr": 1.74e-4, "random": 1.74e-4, "interleaved": 1.75e-4}
LIGHTS = {"low": 1, "strong": 10}  # times the background
SYNC_NS = 3780
METRES_PER_NS = 0.299792458 / 2
WRONG_M = 0.5
COLUMNS = ("light", "mode", "method", "time_s", "status", "signal_per_period", "background_per_period", "sbr",
           "distance_m", "velocity_mps", "true_signal", "true_background", "true_sbr", "reference_m", "reference_mps")


def pulses_in_sync(pattern):
    return SYNC_NS * 1e3 * pattern.pulses / pattern.period_ps


def scene(mode, light, method, pattern_file, endpoint):
    """The configuration: an electronic delay stands for range, and the stage goes 3 m to and fro."""
    delay_ns = 1855
    return {"schema": "splid.config", "v": [1, 0],
            "source": {"driver": "simulator", "pace": "max", "signal_per_pulse": SIGNAL[mode],
                       "ambient_per_s": LIGHTS[light] * BACKGROUND[mode] * 1e9 - 500, "electronic_delay_ns": delay_ns,
                       "encoder_rate_hz": 1000,
                       "target": {"motion": "sinusoid", "distance_m": 6.5, "amplitude_m": 1.5, "period_s": 8}},
            "encoder": {"m_per_count": 1e-4}, "scene": {"range_offset_m": delay_ns * METRES_PER_NS},
            "estimator": {"method": method}, "publish": {"endpoint": endpoint},
            "pattern": {"file": str(pattern_file)}}


def published(recording, config, endpoint):
    """What a subscriber of the daemon gets."""
    daemon = subprocess.Popen([PROGRAM, "replay", recording, "--config", config, "--wait-for-subscriber", "10",
                               "--log-level", "warning"])
    messages = [message.body for message in splid.listen(endpoint, timeout_s=600)
                if message.topic == "frame"]
    if daemon.wait() != 0:
        raise SystemExit(f"splid replay {recording} failed with exit code {daemon.returncode}")
    return messages


def measured(folder, light, mode, method, seconds):
    """The rows of one panel: the frames that have a reference."""
    endpoint = f"ipc://{folder}/socket"
    pattern = PATTERNS[mode]
    pattern.write(folder / "pattern.json")
    config = folder / "config.json"
    config.write_text(json.dumps(scene(mode, light, method, folder / "pattern.json", endpoint)))
    recording = folder / "stage.ptu"
    subprocess.run([PROGRAM, "simulate", "--config", config, "--seconds", str(seconds), "--log-level", "warning",
                    "--output", recording], check=True)
    pulses = pulses_in_sync(pattern)
    range_m = pattern.unambiguous_delay_ps * 1e-3 * METRES_PER_NS
    rows = []
    for frame in published(recording, config, endpoint):
        if "reference" not in frame:
            continue
        row = dict.fromkeys(COLUMNS, "")
        row.update(light=light, mode=mode, method=method, time_s=frame["timestamp"], status=frame["status"],
                   reference_m=frame["reference"]["distance_m"], reference_mps=frame["reference"]["velocity_mps"])
        row.update(true_signal=SIGNAL[mode] * pulses, true_background=LIGHTS[light] * BACKGROUND[mode] * SYNC_NS)
        row["true_sbr"] = row["true_signal"] / row["true_background"]
        row["background_per_period"] = frame["background_per_s"] * SYNC_NS * 1e-9
        if frame["valid"]:
            # An ambiguous range is told from the others by the reference.
            error_m = np.remainder(frame["distance_m"] - row["reference_m"] + range_m / 2, range_m) - range_m / 2
            row["signal_per_period"] = frame["signal_per_pulse"] * pulses
            row["sbr"] = row["signal_per_period"] / row["background_per_period"]
            row["distance_m"] = row["reference_m"] + error_m
            row["velocity_mps"] = frame["velocity_mps"]
        rows.append(row)
    return rows


def rmse(errors):
    return float(np.sqrt(np.mean(np.square(errors)))) if len(errors) else float("nan")


SUMMARY = ("light", "mode", "method", "frames", "none", "wrong", "signal_per_period", "background_per_period", "sbr",
           "signal_per_pulse", "background_per_ns", "rmse_distance_mm", "rmse_velocity_cm_per_s", "rmse_all_distance_m",
           "rmse_all_velocity_mps")


def summary(rows, light, mode, method):
    """A line of stage.csv."""
    these = [row for row in rows if (row["light"], row["mode"], row["method"]) == (light, mode, method)]
    valid = [row for row in these if row["distance_m"] != ""]
    off_m = np.array([row["distance_m"] - row["reference_m"] for row in valid])
    off_mps = np.array([row["velocity_mps"] - row["reference_mps"] for row in valid])
    right = np.abs(off_m) < WRONG_M
    line = dict.fromkeys(SUMMARY, "")
    line.update(light=light, mode=mode, method=method, frames=len(these), none=len(these) - len(valid),
                wrong=int((~right).sum()))
    if not valid:
        return line
    numbers = {name: np.median([row[name] for row in valid])
               for name in ("signal_per_period", "background_per_period", "sbr")}
    numbers["signal_per_pulse"] = numbers["signal_per_period"] / pulses_in_sync(PATTERNS[mode])
    numbers["background_per_ns"] = numbers["background_per_period"] / SYNC_NS
    numbers.update(rmse_distance_mm=rmse(1e3 * off_m[right]), rmse_velocity_cm_per_s=rmse(1e2 * off_mps[right]),
                   rmse_all_distance_m=rmse(off_m), rmse_all_velocity_mps=rmse(off_mps))
    line.update({name: f"{number:.3g}" for name, number in numbers.items()})
    return line


def write_csv(file, columns, rows):
    with open(file, "w", newline="", encoding="utf-8") as text:
        writer = csv.DictWriter(text, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--output", type=pathlib.Path, required=True, help="folder of data/ and studies/")
    options.add_argument("--seconds", type=float, default=8.3, help="of each recording")
    asked = options.parse_args()
    rows = []
    kinds = [(light, mode, method) for light in LIGHTS for mode in PATTERNS for method in METHODS]
    for done, (light, mode, method) in enumerate(kinds):
        print(f"[{done + 1} of {len(kinds)}] {light} light, {mode}, {method}", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            rows += measured(pathlib.Path(folder), light, mode, method, asked.seconds)
    pictures = asked.output / "studies"
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        table = pathlib.Path(folder) / "frames.csv"
        write_csv(table, COLUMNS, rows)
        for light, name in zip(LIGHTS, ("fig7", "fig8")):
            plots.stage(table, light).savefig(pictures / f"{name}.png", dpi=90)
    lines = [summary(rows, *kind) for kind in kinds]
    data = asked.output / "data"
    data.mkdir(exist_ok=True)
    write_csv(data / "stage.csv", SUMMARY, lines)


if __name__ == "__main__":
    main()
