"""Pictures of frames, tradeoffs, calibrations and studies, by matplotlib.

Every function draws into a new figure and returns it; `figure.savefig("run.png")` writes it, and a
notebook shows it. Measured values are drawn unchanged: nothing is smoothed or left out, but values
that are not known and those that a logarithmic axis has no place for.

    python3 -m splid.plots file frames.h5 frames.svg        (as `splid plot` does)
    python3 -m splid.plots run scene.ptu scene.json run.svg
    python3 -m splid.plots tradeoff tradeoff.csv tradeoff.svg
    python3 -m splid.plots calibration pattern.json photons.csv pulse.svg
    python3 -m splid.plots study results.csv fig2 fig2.svg

ImportError without matplotlib.
"""

import csv
import math
import os
import pathlib
import sys
from collections.abc import Callable, Iterable
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._frames import FRAME, Frames, frames
from splid._pattern import Pattern
from splid._recording import Kind, Recording
from splid._scene import Truth
from splid._studies import Calibration

try:
    import matplotlib
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
except ImportError as lacking:
    _why = f"splid.plots draws with matplotlib ({lacking}); on Debian it is python3-matplotlib"
    if __name__ == "__main__":
        sys.exit(_why)
    raise ImportError(_why) from lacking

AnyPath = Union["os.PathLike[str]", str]
Rows = list[dict[str, str]]

# Colours that eyes which see fewer colours tell apart too (Okabe and Ito).
_BLUE, _ORANGE, _GREEN, _PURPLE, _GREY = "#0072b2", "#d55e00", "#009e73", "#cc3f8e", "#555555"
_MODES = {"baseline": _GREY, "ambiguous": "#e69f00", "mrr": _PURPLE, "random": _BLUE,
          "interleaved": _GREEN}


def _figure(panels: int, title: str, height: float = 2.3) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(8.6, 0.6 + height * panels), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    return figure, [figure.add_subplot(panels, 1, k + 1) for k in range(panels)]


def run(table: Frames, truth: Optional[Truth] = None) -> Figure:
    """A run: distance and velocity of the valid frames of a table against time (s).

    table: of splid.frames() or read_table(). truth: of the scene, if it is known; then two more panels show the errors
    (mm, cm/s) in a band of two published standard deviations. Without it each frame has a bar of
    one standard deviation.

    Errors: ValueError for a table without a valid frame.
    """
    good = table[table["valid"]]
    if len(good) == 0:
        names, counts = np.unique(table["status"], return_counts=True)
        seen = ", ".join(f"{count} {name}" for name, count in zip(names, counts))
        raise ValueError(f"table: none of its {len(table)} frames is valid: {seen}")
    middle_ps = good["start_ps"] + np.rint(good["duration_ms"] * 0.5e9).astype(np.int64)
    seconds = (middle_ps - table["start_ps"][0]) * 1e-12
    values = [("distance", "m", "mm", 1e3), ("velocity", "m/s", "cm/s", 1e2)]
    names = ["distance_m", "velocity_mps"]
    figure, panels = _figure(2 if truth is None else 4, f"{len(good)} of {len(table)} frames valid")
    true = None if truth is None else truth.at(middle_ps)
    for k, (what, unit, small, factor) in enumerate(values):
        found, std = good[names[k]], good[f"std_{names[k]}"]
        axes = panels[k if true is None else 2 * k]
        axes.set_ylabel(f"{what} ({unit})")
        if true is None:
            axes.errorbar(seconds, found, yerr=np.nan_to_num(std), fmt=".", color=_BLUE,
                          markersize=3, elinewidth=0.6)
            continue
        axes.plot(seconds, true[k], color=_ORANGE, linewidth=1.2, label="truth")
        axes.plot(seconds, found, ".", color=_BLUE, markersize=3, label="measured")
        axes.legend(loc="best", fontsize="small")
        errors = panels[2 * k + 1]
        errors.fill_between(seconds, -2 * factor * std, 2 * factor * std, color=_BLUE, alpha=0.2,
                            linewidth=0, label="two published deviations")
        errors.plot(seconds, factor * (found - true[k]), ".", color=_BLUE, markersize=3)
        errors.set_ylabel(f"error of {what} ({small})")
        errors.legend(loc="best", fontsize="small")
    panels[-1].set_xlabel("time from the first frame (s)")
    return figure


def scan(table: Frames) -> Figure:
    """A scan: its photons a dwell and, where frames are valid, their distance and velocity.

    table: of read_table(), with the dwells of a scan. Of several pictures the fullest is drawn. A
    dwell without a value is left white.

    Errors: ValueError for a table without the dwells of a scan.
    """
    dwells = table[table["scan_column"] >= 0]
    if len(dwells) == 0 or np.max(dwells["scan_column"]) < 1:
        raise ValueError("table: its frames are no dwells of a scan's lines")
    pictures, counts = np.unique(dwells["scan_picture"], return_counts=True)
    seen = dwells[dwells["scan_picture"] == pictures[np.argmax(counts)]]
    shape = (np.max(seen["scan_line"]) + 1, np.max(seen["scan_column"]) + 1)
    values = [("photons", "photons", np.ones(len(seen), bool))]
    if np.any(seen["valid"]):
        values += [("distance_m", "distance (m)", seen["valid"]),
                   ("velocity_mps", "velocity (m/s)", seen["valid"])]
    figure = Figure(figsize=(5 * len(values), 5), layout="constrained")
    title = f"picture of {shape[0]} lines of {shape[1]} dwells"
    figure.suptitle(title if len(pictures) == 1 else f"fullest of {len(pictures)}: {title}",
                    fontsize="medium")
    for k, (name, label, known) in enumerate(values):
        picture = np.full(shape, np.nan)
        picture[seen["scan_line"][known], seen["scan_column"][known]] = seen[name][known]
        axes = figure.add_subplot(1, len(values), k + 1)
        drawn = axes.imshow(picture, interpolation="nearest")
        figure.colorbar(drawn, ax=axes, label=label, shrink=0.8)
        axes.set_xlabel("column")
        axes.set_ylabel("line")
    return figure


def _frames_figure(table: Frames) -> Figure:
    is_scan = len(table) > 0 and np.max(table["scan_column"]) > 0
    return scan(table) if is_scan else run(table)


def recording(file: "Union[Recording, AnyPath]", period_ps: Optional[float] = None) -> Figure:
    """A recording as it is, without a configuration: the rate of every channel against time, and
    where it has syncs the photons of each input against the time since the last sync.

    period_ps: between two syncs, on which photons behind a missing sync are folded; None: the
    header's or the recorded pattern's, or else only photons that closely follow a sync are drawn. The second panel is of the first 20 million tags, the first of all.

    Errors: DataError with the file and the byte offset; ValueError for a file without tags.
    """
    read = file if isinstance(file, Recording) else Recording(file)
    scan = read.scan()
    if scan["first_ps"] is None:
        raise ValueError(f"{read.file}: holds no tags")
    first_ps, last_ps = scan["first_ps"], scan["last_ps"]
    edges_ps = first_ps + np.linspace(0, max(1, last_ps - first_ps), 201).astype(np.int64)
    names = [f"input {number}" for number in sorted(scan["photons"])]
    names += ["sync"] if scan["syncs"] else []
    rates = {name: np.zeros(len(edges_ps) - 1) for name in names}
    fold = _Fold(_period_ps(read) if period_ps is None else period_ps, read.resolution_s * 1e12)
    for tags in read.tags():
        for name, times_ps in _channels(tags):
            rates[name] += np.histogram(times_ps, edges_ps)[0]
        fold.add(tags)
    seconds = np.diff(edges_ps) * 1e-12
    folded = fold.counts
    figure, panels = _figure(2 if folded else 1, os.path.basename(read.file))
    for name in names:
        panels[0].stairs(rates[name] / seconds, (edges_ps - first_ps) * 1e-12, label=name)
    panels[0].set_ylabel("rate (1/s)")
    means = [counts.mean() for counts in rates.values() if counts.any()]
    if means and max(means) > 5 * min(means):
        panels[0].set_yscale("log")
    else:
        panels[0].set_ylim(bottom=0)
    panels[0].set_xlabel("time (s)")
    panels[0].legend(loc="best", fontsize="small")
    for number, counts in folded.items():
        panels[1].stairs(counts, fold.edges_ps * 1e-3, label=f"input {number}")
    if folded:
        panels[1].set_xlabel("time since the last sync (ns)")
        panels[1].set_ylabel("photons")
        panels[1].legend(loc="best", fontsize="small")
    return figure


def _period_ps(read: Recording) -> float:
    """Between two syncs, as the header says; 0 where it does not."""
    if read.pattern is not None:
        return read.pattern.period_ps
    return float(read._facts["sync_period_s"]) * 1e12


def _channels(tags: npt.NDArray[Any]) -> "list[tuple[str, npt.NDArray[np.int64]]]":
    """The times of each channel that `recording` draws."""
    photons = tags[tags["kind"] == Kind.PHOTON]
    found = [(f"input {number}", photons["time_ps"][photons["value"] == number])
             for number in np.unique(photons["value"])]
    syncs = tags["time_ps"][tags["kind"] == Kind.SYNC]
    return [*found, ("sync", syncs)] if len(syncs) else found


class _Fold:
    """Photons by input against the time since the last sync, in at most 500 bins."""

    BINS = 500
    MOST_TAGS = 20_000_000

    def __init__(self, period_ps: float, step_ps: float) -> None:
        """period_ps: 0 where it is not known. step_ps: of the recording's times."""
        self.edges_ps: npt.NDArray[np.float64] = np.zeros(0)
        self.counts: dict[int, npt.NDArray[Any]] = {}
        self._step_ps = step_ps
        self._period_ps = period_ps
        self._tags = 0
        self._sync_ps: Optional[int] = None  # the last one of the tags before
        if period_ps:
            self._set_range(period_ps)

    def _set_range(self, period_ps: float) -> None:
        bin_ps = self._step_ps * max(1, math.ceil(period_ps / self._step_ps / self.BINS))
        # Times lie on steps: an edge halfway between two of them leaves no doubt.
        self.edges_ps = bin_ps * np.arange(math.ceil(period_ps / bin_ps) + 1) - self._step_ps / 2

    def add(self, tags: npt.NDArray[Any]) -> None:
        syncs_ps = tags["time_ps"][tags["kind"] == Kind.SYNC]
        if self._sync_ps is not None:
            syncs_ps = np.concatenate([[self._sync_ps], syncs_ps])
        if self._tags > self.MOST_TAGS or len(syncs_ps) < 2:
            return
        self._tags += len(tags)
        self._sync_ps = int(syncs_ps[-1])
        photons = tags[tags["kind"] == Kind.PHOTON]
        last = np.searchsorted(syncs_ps, photons["time_ps"], side="right") - 1
        photons, last = photons[last >= 0], last[last >= 0]
        since_ps = photons["time_ps"] - syncs_ps[last]
        if not len(self.edges_ps) and len(since_ps):
            # Where syncs are missing, most gaps are far longer than photons come after a sync.
            self._set_range(float(min(np.quantile(np.diff(syncs_ps), 0.1),
                                      1.02 * np.quantile(since_ps, 0.99))) + self._step_ps)
        if self._period_ps:
            since_ps = since_ps % self._period_ps
        for number in np.unique(photons["value"]):
            counts = np.histogram(since_ps[photons["value"] == number], self.edges_ps)[0]
            self.counts[int(number)] = self.counts.get(int(number), 0) + counts


def calibration(made: "Union[Calibration, Pattern]", sigma_ps: Optional[float] = None,
                photons: Optional[AnyPath] = None) -> Figure:
    """A calibration: the pulse's shape on a linear and on a logarithmic axis (density per ns
    against the offset from the pulse's time), and the amplitude of each pulse.

    made: what calibrate() returns, or a pattern that a calibration made. Photons are drawn with
    their noise of one standard deviation where they are known: those of calibrate(), or of the file
    photons, which `splid calibrate --csv` wrote. sigma_ps: also draws a gaussian of this width.

    Errors: OSError and ValueError for such a file; ValueError for a pattern that no calibration
    made.
    """
    pattern = made if isinstance(made, Pattern) else made.pattern
    known = made.photons if isinstance(made, Calibration) else None
    if photons is not None:
        names = ("offset_ps", "density_per_ns", "std_per_ns")
        rows = _read(photons, names)
        known = {name: _column(rows, name) for name in names}
    shape = pattern.pulse
    if shape is None:
        raise ValueError("made: the pattern has no pulse shape; calibrate() finds one")
    density = np.asarray(shape["density"])
    density = density * 1e3 / (density.sum() * shape["step_ps"])  # of integral 1, per ns
    offset_ps = shape["first_ps"] + shape["step_ps"] * np.arange(len(density))
    figure, panels = _figure(3, f"{pattern.pulses} pulses in {pattern.period_ps / 1e3:g} ns")
    for axes in panels[:2]:
        if known is not None:
            _draw_photons(axes, known, offset_ps)
        axes.plot(offset_ps, density, color=_ORANGE, linewidth=1.2, label="calibrated shape")
        if sigma_ps is not None:
            peak = 1e3 / (sigma_ps * math.sqrt(2 * math.pi))
            axes.plot(offset_ps, peak * np.exp(-0.5 * (offset_ps / sigma_ps) ** 2), "--",
                      color=_GREY, linewidth=1, label=f"gaussian of {sigma_ps:g} ps")
        axes.set_ylabel("density (1/ns)")
        axes.set_xlabel("after the pulse's time (ps)")
    panels[0].legend(loc="best", fontsize="small")
    panels[1].set_yscale("log")
    panels[1].set_ylim(1e-4 * density.max(), 2 * density.max())
    panels[2].vlines(pattern.pulse_times_ps / 1e3, 0, pattern.amplitudes, color=_BLUE, linewidth=1)
    panels[2].plot(pattern.pulse_times_ps / 1e3, pattern.amplitudes, ".", color=_BLUE)
    panels[2].set_ylim(bottom=0)
    panels[2].set_xlabel("pulse's time in the pattern period (ns)")
    panels[2].set_ylabel("relative amplitude")
    return figure


def _draw_photons(axes: Axes, photons: dict[str, npt.NDArray[np.float64]],
                  shape_ps: npt.NDArray[np.float64]) -> None:
    margin_ps = 0.2 * (shape_ps[-1] - shape_ps[0])
    at_ps = photons["offset_ps"]
    near = (at_ps > shape_ps[0] - margin_ps) & (at_ps < shape_ps[-1] + margin_ps)
    axes.errorbar(at_ps[near], photons["density_per_ns"][near], yerr=photons["std_per_ns"][near],
                  fmt=".", color=_BLUE, markersize=3, elinewidth=0.6,
                  label="photons of all pulses")


def tradeoff(table: AnyPath) -> Figure:
    """A tradeoff: RMSE of distance and velocity against the processor time for a frame, and the
    frames that are lost.

    table: the file of `splid tradeoff --csv`. A curve is a setting of the estimator, hollow where
    frames are tracked; its points are frame lengths, with their interval of 95 %. Level lines are
    the bound of Cramer and Rao, a ring is around each length's knee, and a star is on the setting
    that splid recommends. An error that is not known of any setting has no panel, and lost frames
    have none where none is lost.

    Errors: OSError; ValueError for a file that is no such table, with the column it lacks.
    """
    rows = _read(table, ("method", "effort", "findings", "tracked", "length_ms", "compute_ms_p50",
                         "frames", "wrong_peaks", "no_value", "knee", "distance_rmse_m",
                         "distance_rmse_low_m", "distance_rmse_high_m", "distance_bound_m",
                         "velocity_rmse_mps", "velocity_rmse_low_mps", "velocity_rmse_high_mps",
                         "velocity_bound_mps"))
    known = [kind for kind in _ERRORS if np.isfinite(_column(rows, f"{kind[0]}_{kind[1]}")).any()]
    lost = _column(rows, "wrong_peaks") + _column(rows, "no_value")
    has_lost = not known or bool(lost.any())
    figure, panels = _figure(len(known) + has_lost, "What a frame costs, and what it is worth", 2.7)
    settings: dict[str, Rows] = {}
    for row in rows:
        settings.setdefault(_setting(row), []).append(row)
    for name, points in settings.items():
        cost_ms = _column(points, "compute_ms_p50")
        for axes, (what, unit, factor, _) in zip(panels, known):
            rmse, low, high = (factor * _column(points, f"{what}{end}_{unit}")
                               for end in ("", "_low", "_high"))
            _draw_setting(axes, name, points, (rmse, low, high), cost_ms)
        if has_lost:
            share = _column(points, "wrong_peaks") + _column(points, "no_value")
            panels[-1].plot(cost_ms, 100 * share / _column(points, "frames"), label=name,
                            **_style(points))
    for axes, (what, unit, factor, label) in zip(panels, known):
        _draw_bounds(axes, rows, f"{what.removesuffix('_rmse')}_bound_{unit}", factor)
        axes.set_ylabel(label)
        axes.set_yscale("log")
        _number(axes.yaxis)
    for axes in panels:
        axes.set_xscale("log")
        axes.margins(x=0.1)
        _number(axes.xaxis)
    if has_lost:
        panels[-1].set_ylabel("wrong or missing frames (%)")
        most = max(1.0, 1.1 * panels[-1].get_ylim()[1])
        panels[-1].set_ylim(-0.03 * most, most)
    panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize="x-small", ncols=4)
    panels[-1].set_xlabel("processor time for a frame, median (ms); points: frame lengths")
    return figure


# Column of an error without its unit, the unit, what turns it into the axis' unit, and the axis'
# title.
_ERRORS = (("distance_rmse", "m", 1e3, "RMSE of distance (mm)"),
           ("velocity_rmse", "mps", 1e2, "RMSE of velocity (cm/s)"))


def _number(axis: Axis) -> None:
    """Gives a logarithmic axis plain numbers at 1, 2 and 5 of each decade."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _setting(row: dict[str, str]) -> str:
    if row["method"] == "paper":
        return "[P]'s method"
    return (row["effort"] + (", tracked" if row["tracked"] == "true" else "")
            + (", no findings" if row["findings"] == "off" else ""))


def _style(points: Rows) -> dict[str, Any]:
    """The colour says the effort, and a hollow marker that frames are tracked."""
    row = points[0]
    colour = (_GREY if row["method"] == "paper" else _GREEN if row["findings"] == "off" else
              _BLUE if row["effort"] == "balanced" else _ORANGE)
    tracked = row["tracked"] == "true"
    return {"color": colour, "marker": "o", "markersize": 4, "linewidth": 0.8,
            "linestyle": ":" if tracked else "-", "markerfacecolor": "white" if tracked else colour}


def _draw_setting(axes: Axes, name: str, points: Rows, ends: tuple[npt.NDArray[np.float64], ...],
                  cost_ms: npt.NDArray[np.float64]) -> None:
    rmse, low, high = ends
    bars = np.nan_to_num(np.stack([rmse - low, high - rmse]))
    drawn = axes.errorbar(cost_ms, rmse, yerr=bars, label=name, elinewidth=0.6, **_style(points))
    for row, x, y in zip(points, cost_ms, rmse):
        if not math.isfinite(y):
            continue
        if row["knee"] == "true":
            axes.plot([x], [y], "o", markersize=10, fillstyle="none", color=drawn[0].get_color())
        if row.get("chosen") == "true":
            axes.plot([x], [y], "*", markersize=13, color=drawn[0].get_color(),
                      label=f"chosen: {name}, {float(row['length_ms']):g} ms")


def _draw_bounds(axes: Axes, rows: Rows, column: str, factor: float) -> None:
    label: Optional[str] = "Cramer-Rao bound"
    for length in sorted({row["length_ms"] for row in rows}, key=float):
        same = [row for row in rows if row["length_ms"] == length]
        bound = factor * np.nanmax(_column(same, column), initial=-math.inf)
        if math.isfinite(bound):
            cost_ms = _column(same, "compute_ms_p50")
            axes.hlines(bound, cost_ms.min(), cost_ms.max(), colors=_GREY, linestyles="--",
                        linewidth=0.8, label=label)
            axes.annotate(f"{float(length):g} ms", (cost_ms.min(), bound), xytext=(-4, 0),
                          textcoords="offset points", ha="right", va="center",
                          fontsize="x-small", color=_GREY)
            label = None


# A study's name -> its column on the horizontal axis, the axis' title, and whether it is
# logarithmic.
_BACKGROUND = ("background_per_ns", "background (counts/ns)", True)
_LENGTH = ("length_ms", "frame length (ms)", True)
_VELOCITY = ("velocity_mps", "velocity (m/s)", False)
STUDIES: dict[str, tuple[str, str, bool]] = {
    "fig2": _BACKGROUND, "fig3": _BACKGROUND, "fig4": _VELOCITY, "fig5": _BACKGROUND,
    "fig5-whole": _BACKGROUND, "fig9": _LENGTH, "any": _BACKGROUND, "velocities": _VELOCITY,
    "experiment": ("signal_per_pulse", "signal (counts/pulse)", True),
}
"""The studies of bench/studies, and the axis of each."""

# The panels, as [P] has them: column, title, and what turns the column into the title's unit.
_PANELS = (("signal_per_pulse", "S (counts/pulse)", 1.0),
           ("background_per_ns", "b (counts/ns)", 1.0),
           ("delay_start_ns", "τ at the frame's start (ps)", 1e3),
           ("velocity_mps", "v (m/s)", 1.0))
_MARKERS = {"search": ("o", "full", "search"), "paper": ("s", "none", "[P]'s method"),
            "paper-start": ("D", "none", "start of [P]'s"),
            "wang": ("^", "none", "[P]'s with Wang's theorem"),
            "wang-start": ("v", "none", "start with Wang's theorem")}
# Where one mode is estimated in many ways, these have the colours.
_ESTIMATORS = {"search": _GREEN, "paper": _BLUE, "paper-start": "#56b4e9", "wang": _ORANGE,
               "wang-start": "#e69f00"}


def study(results: "Union[AnyPath, Iterable[AnyPath]]", name: str) -> Figure:
    """A study's figure as [P] draws it: RMSE of S, b, delay at the frame's start and velocity in
    four panels, bounds of Cramer and Rao dashed, one colour a mode.

    results: one file of bench/studies/results or several; of a cell that is in several, the row
    with the most trials counts. name: of STUDIES. Markers are the RMSE of all frames with a value,
    wrong peaks included, where half of the frames or more have one. Source: [P] Figs. 2 to 5 and 9;
    docs/evidence/accuracy.md.

    Errors: OSError; ValueError for another name, and for files without results of that study.
    """
    if name not in STUDIES:
        raise ValueError(f"name: {name!r} was given, but one of {', '.join(STUDIES)} is expected")
    files = [results] if isinstance(results, (str, os.PathLike)) else list(results)
    column, title, logarithmic = STUDIES[name]
    needed = ("study", "mode", "estimator", "rmse_all_delay_start_ns", column)
    rows = [row for file in files for row in _read(file, needed) if row["study"] == name]
    if not rows:
        raise ValueError(f"results: no row of {', '.join(map(str, files))} is of the study {name}")
    figure = Figure(figsize=(9.6, 7.6))
    figure.set_layout_engine("constrained", rect=(0, 0, 1, 0.86))  # the legend is above
    panels = [figure.add_subplot(2, 2, k + 1) for k in range(4)]
    lines: dict[tuple[str, str], dict[str, dict[str, str]]] = {}
    for row in sorted(rows, key=lambda row: int(row["trials"])):
        scene = ",".join(row[key] for key in ("length_ms", "signal_per_pulse", "background_per_ns",
                                              "velocity_mps", "effort"))
        lines.setdefault((row["mode"], row["estimator"]), {})[scene] = row
    one_mode = len({mode for mode, _ in lines}) == 1
    for (mode, estimator), scenes in lines.items():
        points = sorted(scenes.values(), key=lambda row: float(row[column]))
        colour = _ESTIMATORS[estimator] if one_mode else _MODES[mode]
        for axes, panel in zip(panels, _PANELS):
            _draw_rmse(axes, points, _column(points, column), (mode, estimator, colour), panel)
    for axes, (_, what, _) in zip(panels, _PANELS):
        axes.set_ylabel(f"RMSE of {what}")
        axes.set_yscale("log")
        axes.set_xscale("log" if logarithmic else "linear")
        axes.set_xlabel(title)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="upper center", ncols=4,
                  fontsize="small", title=f"{name}: RMSE of all frames with a value")
    return figure


def _draw_rmse(axes: Axes, points: Rows, x: npt.NDArray[np.float64], line: tuple[str, str, str],
               panel: tuple[str, str, float]) -> None:
    mode, estimator, colour = line
    name, _, factor = panel
    if estimator == "search":
        axes.plot(x, factor * _column(points, f"crb_{name}"), "--", color=colour, linewidth=0.9,
                  label=f"{mode}, bound")
    trials, none = (_column(points, kind) for kind in ("trials", "no_value"))
    known = 2 * none <= trials
    rmse = factor * _column(points, f"rmse_all_{name}")[known]
    marker, fill, label = _MARKERS[estimator]
    size = 4 if fill == "full" else 7  # so that both are seen where they agree
    axes.errorbar(x[known], rmse, yerr=rmse / np.sqrt(2 * (trials - none)[known]), fmt=marker,
                  fillstyle=fill, color=colour, markersize=size, elinewidth=0.8,
                  label=f"{mode}, {label}")


# The panels of a mode: column, title, unit, and the column of the truth or of the encoder.
_STAGE = (("signal_per_period", "S (counts/sync)", "", "true_signal"),
          ("background_per_period", "b (counts/sync)", "", "true_background"),
          ("sbr", "SBR", "", "true_sbr"),
          ("distance_m", "distance (m)", " m", "reference_m"),
          ("velocity_mps", "velocity (m/s)", " m/s", "reference_mps"))


def stage(table: AnyPath, light: str) -> Figure:
    """A target on a stage beside its encoder, as [P] Figs. 7 and 8 draw it: a column a mode, with S
    and b (counts a sync period), their ratio, distance and velocity against time.

    table: the frames that bench/stage.py wrote; light: which of its lights. Markers are the frames
    with a value: dots of method `search`, open squares of method `paper` where the table has it.
    Lines are the encoder, and the scene's light. Each panel has the RMSE of its markers against its
    line; its axis is that of `search`, and a square beyond it is not seen.

    Errors: OSError; ValueError for a file that is no such table, or has no frame of that light.
    """
    names = [name for panel in _STAGE for name in (panel[0], panel[3])]
    rows = [row for row in _read(table, ("light", "mode", "method", "time_s", *names))
            if row["light"] == light]
    modes = list(dict.fromkeys(row["mode"] for row in rows if row["method"] == "search"))
    if not modes:
        raise ValueError(f"{os.fspath(table)}: no frame is of the light {light}")
    figure = Figure(figsize=(2.6 * len(modes), 9.0), layout="constrained")
    figure.suptitle(f"{light} light: search (dots), [P]'s method (squares), and the encoder (line)",
                    fontsize="medium")
    grid = figure.subplots(len(_STAGE), len(modes), sharex=True, sharey="row", squeeze=False)
    for method in ("search", "paper"):
        limits = [panels[0].get_ylim() for panels in grid]
        for column, mode in enumerate(modes):
            these = [row for row in rows if (row["mode"], row["method"]) == (mode, method)]
            for axes, panel in zip(grid[:, column], _STAGE):
                _draw_stage(axes, these, _MODES[mode], panel)
        if method == "paper":
            for panels, limit in zip(grid, limits):
                panels[0].set_ylim(limit)
    for axes, (_, title, _, _) in zip(grid[:, 0], _STAGE):
        axes.set_ylabel(title)
    for axes, last, mode in zip(grid[0], grid[-1], modes):
        axes.annotate(mode, (0.5, 1), (0, 14), "axes fraction", "offset points", ha="center",
                      fontsize="small")
        last.set_xlabel("time (s)")
    return figure


def _draw_stage(axes: Axes, rows: Rows, colour: str, panel: tuple[str, str, str, str]) -> None:
    """Frames of one method; those of `search` come first, with the line that both are beside."""
    if not rows:
        return
    name, _, unit, reference = panel
    seconds, found, true = (_column(rows, kind) for kind in ("time_s", name, reference))
    seconds -= seconds[0]
    errors = (found - true)[np.isfinite(found)]
    told = f"{math.sqrt(np.mean(errors**2)):.2g}{unit}" if len(errors) else "no value"
    if rows[0]["method"] == "search":
        axes.plot(seconds, true, color=_ORANGE, linewidth=1)
        axes.plot(seconds, found, ".", color=colour, markersize=3)
        told = f"RMSE {told}"
    else:
        axes.plot(seconds, found, "s", color=colour, markersize=4.5, markeredgewidth=0.4,
                  fillstyle="none")
        told = f"{axes.get_title('left')}, [P] {told}"
    axes.set_title(told, fontsize="x-small", loc="left", pad=2)


def _read(file: AnyPath, needed: Iterable[str],
          expected: str = "a table of `splid tradeoff --csv`, of `splid calibrate --csv` or of "
                          "bench/studies/results is expected") -> Rows:
    with open(file, newline="", encoding="utf-8") as text:
        reader = csv.DictReader(text)
        missing = [name for name in needed if name not in (reader.fieldnames or [])]
        if missing:
            raise ValueError(f"{os.fspath(file)}: has no column {missing[0]}; {expected}")
        return list(reader)


def _column(rows: Rows, name: str) -> npt.NDArray[np.float64]:
    """The numbers of a column; NaN where a field is empty."""
    return np.array([float(row[name]) if row[name] else math.nan for row in rows])


def _run_of(file: str, config: str) -> Figure:
    """A run of a recording, against the truth file if there is one beside it."""
    truth = pathlib.Path(file).with_suffix(".truth.json")
    return run(frames(file, config), Truth(truth) if truth.exists() else None)


def read_table(file: AnyPath) -> Frames:
    """The frames of a table that `splid replay --output` or `splid batch` wrote.

    Errors: OSError; ValueError for a file that is no such table, and for one in HDF5 without
    Python's h5py (on Debian python3-h5py).
    """
    path = os.fspath(file)
    if not path.endswith(".csv"):
        return _read_hdf5(path)
    names = list(_splid.frame_units())
    rows = _read(path, names, "a table of `splid replay --output` is expected")
    table = np.zeros(len(rows), FRAME)
    for name in names:
        texts = [row[name] for row in rows]
        kind = FRAME[name].kind
        if kind == "f":
            table[name] = _column(rows, name)
        elif kind == "b":
            table[name] = [text == "true" for text in texts]
        elif kind == "U":
            table[name] = texts
        else:
            table[name] = [int(text) if text else -1 for text in texts]
    return Frames.of_columns(table)


def _read_hdf5(path: str) -> Frames:
    try:
        import h5py
    except ImportError as error:
        raise ValueError(f"{path}: HDF5 is read with h5py ({error}); on Debian it is python3-h5py; "
                         "or have `splid replay --output` write a .csv") from error
    try:
        tables = h5py.File(path)
    except OSError as error:
        raise ValueError(f"{path}: {error}") from error
    with tables:
        if "frames" not in tables:
            raise ValueError(f"{path}: holds no frames; a table of `splid replay --output` is "
                             "expected")
        rows = tables["frames"][:]
    return Frames.of_columns(rows)


def _csv_figure(file: str) -> Figure:
    with open(file, newline="", encoding="utf-8") as text:
        names: list[str] = next(csv.reader(text), [])
    if "start_ps" in names:
        return _frames_figure(read_table(file))
    if "compute_ms_p50" in names:
        return tradeoff(file)
    if "offset_ps" in names:
        raise ValueError(f"{file}: has the photons of a calibration; draw them with their pattern: "
                         "python3 -m splid.plots calibration PATTERN.json PHOTONS.csv PICTURE")
    raise ValueError(f"{file}: is no table of frames or of a tradeoff; `splid replay --output` and "
                     "`splid tradeoff --csv` write those")


def of_file(file: AnyPath, config: Optional[AnyPath] = None) -> Figure:
    """What a file holds: a table of frames, a tradeoff, a pattern, or a recording.

    config: of a recording, which is then measured and drawn as run() does.

    Errors: those of the function that draws it.
    """
    path = os.fspath(file)
    if path.endswith(".csv"):
        return _csv_figure(path)
    if path.endswith((".h5", ".hdf5")):
        return _frames_figure(read_table(path))
    if path.endswith(".json"):
        pattern = Pattern(path)
        if pattern.pulse is not None:
            return calibration(pattern)
        figure, panels = _figure(1, f"{pattern.mode}, {pattern.pulses} pulses in "
                                 f"{pattern.period_ps / 1e3:g} ns")
        pattern.plot(panels[0])
        return figure
    return recording(path) if config is None else _run_of(path, os.fspath(config))


def main(arguments: list[str]) -> int:
    """The command line: what to draw, its files, and last the picture to write.

    Exit codes: those of the program, 0 done, 2 usage, 3 for a picture that cannot be written, 4
    data.
    """
    makes: dict[tuple[str, int], Callable[[], Figure]] = {
        ("file", 3): lambda: of_file(arguments[1]),
        ("file", 4): lambda: of_file(arguments[1], arguments[2]),
        ("run", 4): lambda: _run_of(arguments[1], arguments[2]),
        ("tradeoff", 3): lambda: tradeoff(arguments[1]),
        ("calibration", 3): lambda: calibration(Pattern(arguments[1])),
        ("calibration", 4): lambda: calibration(Pattern(arguments[1]), photons=arguments[2]),
        ("calibration", 5): lambda: calibration(Pattern(arguments[1]), float(arguments[3]),
                                                arguments[2]),
        ("study", 4): lambda: study(arguments[1].split(","), arguments[2])}
    make = makes.get((arguments[0] if arguments else "", len(arguments)))
    if make is None:
        print("usage: python3 -m splid.plots file FILE [CONFIG.json] PICTURE\n"
              "       python3 -m splid.plots run RECORDING.ptu CONFIG.json PICTURE\n"
              "       python3 -m splid.plots tradeoff TABLE.csv PICTURE\n"
              "       python3 -m splid.plots calibration PATTERN.json [PHOTONS.csv [SIGMA_PS]] "
              "PICTURE\n"
              "       python3 -m splid.plots study RESULTS.csv[,MORE.csv] STUDY PICTURE",
              file=sys.stderr)
        return 2
    try:
        drawn = make()
    except OSError as error:
        print(f"splid.plots: {error.filename}: {error.strerror}", file=sys.stderr)
        return 4
    except (ValueError, _splid.SplidError) as error:
        print(f"splid.plots: {error}", file=sys.stderr)
        return 4
    picture = pathlib.Path(arguments[-1])
    # The same picture has the same bytes, in SVG too, whose text stays text.
    told = {"metadata": {"Date": None}} if picture.suffix == ".svg" else {}
    try:
        with matplotlib.rc_context({"svg.hashsalt": "splid", "svg.fonttype": "none"}):
            drawn.savefig(picture, **told)
    except (ValueError, OSError) as error:
        print(f"splid.plots: {arguments[-1]}: {error}", file=sys.stderr)
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
