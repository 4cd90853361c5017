#!/usr/bin/env python3
"""[P] Fig. 7 and 8: a card on a stage, measured by the daemon in five modes and in low and strong light.

  PYTHONPATH=build/release/python python3 bench/stage.py --output docs/evidence [--seconds N]

Simulates the stage with its encoder, replays each recording through the daemon to a subscriber, and writes stage.md
and studies/fig7.png and fig8.png into the folder. The method of [P] measures the same recordings beside splid's."""

import argparse
import csv
import datetime
import json
import pathlib
import subprocess
import tempfile

import numpy as np

import splid
from splid import plots

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/release/splid"
PATTERNS = {"baseline": "periodic-3780", "ambiguous": "ambiguous-94.5", "mrr": "mrr-180-189",
            "random": "random-40", "interleaved": "interleaved-180-189"}
# [P] Table 1, counts a pulse. Strong light is ours: [P]'s is not known.
SIGNAL = {"baseline": 4.03e-4, "ambiguous": 13.6e-4, "mrr": 14.0e-4, "random": 13.2e-4, "interleaved": 13.8e-4}
LIGHTS = {"low": 1.75e-4, "strong": 1.75e-3}
SYNC_NS = 3780
METRES_PER_NS = 0.299792458 / 2
WRONG_M = 0.5
COLUMNS = ("light", "mode", "method", "time_s", "status", "signal_per_period", "background_per_period", "sbr",
           "distance_m", "velocity_mps", "true_signal", "true_background", "true_sbr", "reference_m", "reference_mps")


def scene(mode, light, method, endpoint):
    """The configuration: an electronic delay stands for range, and the stage goes 3 m to and fro."""
    delay_ns = 1855
    return {"schema": "splid.config", "v": [1, 0],
            "source": {"driver": "simulator", "pace": "max", "signal_per_pulse": SIGNAL[mode],
                       "ambient_per_s": LIGHTS[light] * 1e9 - 500, "electronic_delay_ns": delay_ns,
                       "encoder_rate_hz": 1000,
                       "target": {"motion": "sinusoid", "distance_m": 6.5, "amplitude_m": 1.5, "period_s": 8}},
            "encoder": {"m_per_count": 1e-4}, "scene": {"range_offset_m": delay_ns * METRES_PER_NS},
            "estimator": {"method": method}, "publish": {"endpoint": endpoint},
            "pattern": {"file": str(ROOT / f"config/patterns/{PATTERNS[mode]}.json")}}


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
    config = folder / "config.json"
    config.write_text(json.dumps(scene(mode, light, method, endpoint)))
    recording = folder / "stage.ptu"
    subprocess.run([PROGRAM, "simulate", "--config", config, "--seconds", str(seconds), "--log-level", "warning",
                    "--output", recording], check=True)
    pattern = splid.Pattern.read(str(ROOT / f"config/patterns/{PATTERNS[mode]}.json"))
    pulses = SYNC_NS * 1e3 * pattern.pulses / pattern.period_ps
    range_m = pattern.unambiguous_delay_ps * 1e-3 * METRES_PER_NS
    rows = []
    for frame in published(recording, config, endpoint):
        if "reference" not in frame:
            continue
        row = dict.fromkeys(COLUMNS, "")
        row.update(light=light, mode=mode, method=method, time_s=frame["timestamp"], status=frame["status"],
                   reference_m=frame["reference"]["distance_m"], reference_mps=frame["reference"]["velocity_mps"])
        row.update(true_signal=SIGNAL[mode] * pulses, true_background=LIGHTS[light] * SYNC_NS)
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


def table_line(rows, light, mode, method):
    these = [row for row in rows if (row["light"], row["mode"], row["method"]) == (light, mode, method)]
    valid = [row for row in these if row["distance_m"] != ""]
    off_m = np.array([row["distance_m"] - row["reference_m"] for row in valid])
    off_mps = np.array([row["velocity_mps"] - row["reference_mps"] for row in valid])
    right = np.abs(off_m) < WRONG_M

    def median(name):
        return f"{np.median([row[name] for row in valid]):.3g}" if valid else "–"

    def error(values):
        return f"{rmse(values):.3g}" if len(values) else "–"

    return (f"| {light} | {mode} | {method} | {len(these)} | {len(these) - len(valid)} | {int((~right).sum())} "
            f"| {median('signal_per_period')} | {median('background_per_period')} | {median('sbr')} "
            f"| {error(1e3 * off_m[right])} | {error(1e2 * off_mps[right])} "
            f"| {error(off_m)} | {error(off_mps)} |")


PAGE = """# The card on the stage

Generated by `bench/stage.py`; not for editing. [P] Fig. 7 and 8: a card on a stage that goes 3 m to and fro in 8 s, at
up to 1.2 m/s, behind an electronic delay of 1855 ns (278 m), with an encoder of 0.1 mm a count that is read 1000 times
a second. The simulator makes tags and counts; each recording is replayed through the daemon, and what a subscriber
gets is compared with the encoder, as frames of 50 ms. Signal is that of [P] Table 1. Low light is its background,
{low:g} counts/ns; strong light is ten times that, as [P]'s own is not known.

- none: frames without a value, because no target was found. wrong: more than {wrong:g} m off the encoder
- S, b, SBR: medians; S and b are counts in {period} ns, a sync period of [P]
- RMSE of right frames against the encoder, and of all frames with a value, as [P]'s panels have it
- `ambiguous` knows a distance modulo 14.2 m alone; it is compared modulo that. `mrr` has half as many pulses

{date}, {machine}. Again:

    PYTHONPATH=build/release/python python3 bench/stage.py --output docs/evidence

![Low light, method search](studies/fig7.png)

![Strong light, method search](studies/fig8.png)

| light | mode | method | frames | none | wrong | S | b | SBR | RMSE z, mm | RMSE v, cm/s | all z, m | all v, m/s |
|---|---|---|---|---|---|---|---|---|---|---|---|---|
"""


def machine():
    with open("/proc/cpuinfo", encoding="utf-8") as text:
        return next((line.split(":")[1].strip() for line in text if line.startswith("model name")), "unknown processor")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--output", type=pathlib.Path, required=True, help="folder of the page and its pictures")
    options.add_argument("--seconds", type=float, default=8.3, help="of each recording")
    asked = options.parse_args()
    rows = []
    kinds = [(light, mode, method) for light in LIGHTS for mode in PATTERNS for method in ("search", "paper")]
    for done, (light, mode, method) in enumerate(kinds):
        print(f"[{done + 1} of {len(kinds)}] {light} light, {mode}, {method}", flush=True)
        with tempfile.TemporaryDirectory() as folder:
            rows += measured(pathlib.Path(folder), light, mode, method, asked.seconds)
    pictures = asked.output / "studies"
    pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        table = pathlib.Path(folder) / "stage.csv"
        with open(table, "w", newline="", encoding="utf-8") as text:
            writer = csv.DictWriter(text, COLUMNS)
            writer.writeheader()
            writer.writerows(rows)
        for light, name in zip(LIGHTS, ("fig7", "fig8")):
            plots.stage(table, light).savefig(pictures / f"{name}.png", dpi=90)
    page = PAGE.format(low=LIGHTS["low"], wrong=WRONG_M, period=SYNC_NS, date=datetime.date.today(),
                       machine=machine())
    page += "\n".join(table_line(rows, *kind) for kind in kinds) + "\n"
    (asked.output / "stage.md").write_text(page)


if __name__ == "__main__":
    main()
