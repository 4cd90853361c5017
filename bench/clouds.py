#!/usr/bin/env python3
"""Clouds of a simulated scan and of a simulated array: their pictures, and the errors of their points.

  python3 bench/clouds.py --output docs/guide | scripts/evidence clouds

Simulates a scan of 64 x 64 dwells of 5 ms and an array of 10 x 6 pixels, makes a cloud of each with `splid cloud`, and
draws range and radial velocity as scan.png and array.png into the folder. Then 200 frames of 7 x 7 pixels that see a
plate before a wall, each pixel by itself and with scene.rigid. Prints a row for each: the points, and what they are off
by from the simulated truth. A point more than 0.3 m off, 20 pulse widths, is a wrong peak."""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from matplotlib.figure import Figure

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "build/release/splid"
SCENE_BEGINS_S = 1_767_225_600  # UTC of each simulated recording's start
WRONG_PEAK_M = 0.3
TYPES = {("F", "4"): "<f4", ("F", "8"): "<f8", ("U", "4"): "<u4"}

# A corridor that the sensor drives through on a slight curve. A car swings to and fro on the right, and a second car
# drives ahead of the sensor.
SURFACES = {
    "room": {"ahead_m": 90, "left_m": 9, "right_m": 12, "down_m": 3, "velocity_mps": [0.8, 0, 0],
             "turn_deg_per_s": [0, 0, 0.4], "signal_per_pulse": 0.02},
    "planes": [{"motion": "sinusoid", "distance_m": 24, "amplitude_m": 6, "period_s": 12, "signal_per_pulse": 0.03,
                "azimuth_deg": [3, 10], "elevation_deg": [-5, 4]},
               {"motion": "linear", "distance_m": 10, "velocity_mps": 1.5, "signal_per_pulse": 0.03,
                "azimuth_deg": [-9, -2], "elevation_deg": [-7, 2]}]}


PLATE = {"planes": [{"motion": "linear", "distance_m": 20, "velocity_mps": 1.2, "azimuth_deg": [-3, 3],
                     "elevation_deg": [-3, 3]},
                    {"motion": "linear", "distance_m": 25}]}


def config_of(columns, rows, pitch_deg, surfaces):
    return {"schema": "splid.config", "v": [1, 0],
            "source": {"driver": "simulator", "pace": "max", "seed": 3,
                       "array": {"columns": columns, "rows": rows, "pitch_deg": pitch_deg, **surfaces}},
            "pattern": {"file": str(ROOT / "config/patterns/interleaved-180-189.json")},
            "scene": {"max_speed_mps": 20}}


def scan():
    columns = rows = 64
    pitch_deg, dwell_ms, return_ms = 0.5, 5, 2
    config = config_of(columns, rows, pitch_deg, SURFACES)
    config["source"]["scanner"] = {"dwell_ms": dwell_ms, "return_ms": return_ms, "both_ways": True}
    edge_deg = pitch_deg * (columns - 1) / 2
    config["frame"] = {"length_ms": dwell_ms}
    config["scan"] = {"lines": rows, "azimuth_deg": [-edge_deg, edge_deg], "elevation_deg": [edge_deg, -edge_deg]}
    return config, rows * (columns * dwell_ms + return_ms) * 1e-3


def pixels_of(columns, rows, pitch_deg):
    return [{"input": row * columns + column + 1, "azimuth_deg": pitch_deg * (column - (columns - 1) / 2),
             "elevation_deg": pitch_deg * ((rows - 1) / 2 - row)}
            for row in range(rows) for column in range(columns)]


def array():
    config = config_of(10, 6, 3.0, SURFACES)
    config["pixels"] = pixels_of(10, 6, 3.0)
    return config, 0.051  # one frame


def plate(rigid):
    config = config_of(7, 7, 1.5, PLATE)
    config["pixels"] = pixels_of(7, 7, 1.5)
    config["scene"]["rigid"] = rigid
    return config, 10


def run(*arguments):
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"bench/clouds.py: splid {arguments[0]}: {done.stderr}")
    print(done.stderr.strip(), file=sys.stderr)


def read_pcd(file):
    head, _, data = file.read_bytes().partition(b"DATA binary\n")
    lines = dict(line.split(" ", 1) for line in head.decode().splitlines() if line[0] != "#")
    kinds = zip(lines["TYPE"].split(), lines["SIZE"].split())
    fields = list(zip(lines["FIELDS"].split(), (TYPES[kind] for kind in kinds)))
    return np.frombuffer(data, dtype=fields, count=int(lines["POINTS"]))


class Points:
    """The points of a cloud by their pixel, row by row from the upper left, and what is true of each."""

    def __init__(self, cloud, truth, array):
        place = np.stack([cloud[axis].astype(float) for axis in "xyz"])
        self.distance = np.linalg.norm(place, axis=0)
        self.velocity = cloud["radial_velocity"].astype(float)
        self.std = {"distance": cloud["std_distance"], "velocity": cloud["std_radial_velocity"]}
        azimuth = np.degrees(np.arctan2(-place[1], place[0]))
        elevation = np.degrees(np.arcsin(place[2] / self.distance))
        column = np.rint(azimuth / array["pitch_deg"] + (array["columns"] - 1) / 2).astype(int)
        row = np.rint((array["rows"] - 1) / 2 - elevation / array["pitch_deg"]).astype(int)
        self.pixel = row * array["columns"] + column
        # Between two samples of the truth: the cubic of their places and velocities. Each dwell of a scan has a sample.
        step_s = truth["step_ps"] * 1e-12
        first_s = np.array([pixel.get("first_ps", 0) for pixel in truth["pixels"]])[self.pixel] * 1e-12
        along = (cloud["time"] - SCENE_BEGINS_S - first_s) / step_s
        before = np.clip(along.astype(int), 0, len(truth["distance_m"]) - 2)
        t = along - before
        z, v = (np.array([pixel[name] for pixel in truth["pixels"]])[self.pixel[:, None],
                                                                     before[:, None] + [0, 1]].T
                for name in ("distance_m", "velocity_mps"))
        self.true_distance = (z[0] * (1 + 2 * t) * (1 - t)**2 + z[1] * t * t * (3 - 2 * t)
                              + step_s * (v[0] * t * (1 - t)**2 + v[1] * t * t * (t - 1)))
        self.true_velocity = v[0] * (1 - t) + v[1] * t
        self.right = np.abs(self.distance - self.true_distance) < WRONG_PEAK_M


def draw(points, array, dwell):
    rows, columns = array["rows"], array["columns"]
    width, height = (array["pitch_deg"] * count / 2 for count in (columns, rows))
    figure = Figure(figsize=(8.6, 0.9 + 4.3 * rows / columns), layout="constrained")
    figure.suptitle(f"{columns} x {rows} pixels, {dwell}", fontsize="medium")
    panels = (("range (m)", points.distance, "viridis_r"), ("radial velocity (m/s)", points.velocity, "RdBu_r"))
    for axes, (title, values, colours) in zip(figure.subplots(1, 2), panels):
        picture = np.full(rows * columns, np.nan)
        picture[points.pixel] = values
        most = np.nanpercentile(np.abs(picture), 99)
        limits = {"vmin": -most, "vmax": most} if colours == "RdBu_r" else {}
        axes.set_facecolor("0.6")  # no point
        drawn = axes.imshow(picture.reshape(rows, columns), cmap=colours, extent=(-width, width, -height, height),
                            interpolation="nearest", **limits)
        axes.set_title(title, fontsize="small")
        axes.set_xlabel("azimuth (degrees)")
        axes.set_ylabel("elevation (degrees)")
        figure.colorbar(drawn, ax=axes, shrink=0.85)
    return figure


def row_of(name, points, most):
    right = points.right
    cells = [name, f"{len(right)} of {most}", f"{np.sum(~right)}"]
    for what, factor in (("distance", 1e3), ("velocity", 1e2)):
        errors = (getattr(points, what) - getattr(points, "true_" + what))[right]
        std = points.std[what][right]
        cells += [f"{factor * np.sqrt(np.mean(errors**2)):.2f}", f"{factor * np.sqrt(np.mean(std**2)):.2f}",
                  f"{100 * np.mean(np.abs(errors) < std):.1f}"]
    return cells


def cloud_of(config, seconds):
    with tempfile.TemporaryDirectory() as scratch:
        files = {kind: pathlib.Path(scratch) / f"cloud.{kind}" for kind in ("json", "ptu", "truth.json", "pcd")}
        files["json"].write_text(json.dumps(config))
        run("simulate", "--config", files["json"], "--seconds", seconds, "--output", files["ptu"])
        run("cloud", files["ptu"], "--config", files["json"], "--output", files["pcd"])
        return Points(read_pcd(files["pcd"]), json.loads(files["truth.json"].read_text()), config["source"]["array"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    folder = parser.parse_args().output
    print("| cloud | points of pixels | wrong peaks | distance: RMSE, mm | published, mm | within 1, % | "
          "velocity: RMSE, cm/s | published, cm/s | within 1, % |\n" + "|---" * 9 + "|")
    clouds = [("scan", scan(), 1, "one after another, 5 ms each"), ("array", array(), 1, "a frame of 50 ms"),
              ("a plate before a wall, each pixel by itself", plate(False), 200, ""),
              ("a plate before a wall, `rigid`", plate(True), 200, "")]
    for name, (config, seconds), frames, dwell in clouds:
        points = cloud_of(config, seconds)
        grid = config["source"]["array"]
        if dwell:
            draw(points, grid, dwell).savefig(folder / f"{name}.png", dpi=110)
        print("| " + " | ".join(row_of(name, points, grid["columns"] * grid["rows"] * frames)) + " |", flush=True)


if __name__ == "__main__":
    main()
