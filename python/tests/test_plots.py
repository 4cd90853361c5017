"""splid.plots: what is drawn is what is there, and what cannot be drawn says why."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest
from conftest import ROOT

import splid

plots = pytest.importorskip("splid.plots")
RESULTS = [ROOT / "bench" / "studies" / "results" / f"results-{name}.csv"
           for name in ("search", "paper")]


def drawn(axes):
    """The points of the first line of an axes."""
    return axes.get_lines()[0].get_xydata()


def test_a_run_beside_its_truth(scene):
    played = splid.simulate(scene, 0.3)
    table = splid.frames(played.tags, scene)
    panels = plots.run(table, played.truth).axes
    assert len(panels) == 4
    measured = panels[0].get_lines()[1].get_ydata()
    assert np.array_equal(measured, table["distance_m"][table["valid"]])
    errors_mm = panels[1].get_lines()[0].get_ydata()
    assert 0 < np.abs(errors_mm).max() < 20
    assert len(plots.run(table).axes) == 2


def test_a_run_without_a_valid_frame_is_refused():
    with pytest.raises(ValueError, match="none of its 3 frames is valid: 3 "):
        plots.run(np.zeros(3, splid.FRAME))


@pytest.mark.slow
def test_a_tradeoff_of_the_program(program, scene, tmp_path):
    config = tmp_path / "scene.json"
    config.write_text(json.dumps({"schema": "splid.config", **scene}))
    table = tmp_path / "tradeoff.csv"
    done = program.run("tradeoff", "--config", config, "--frames", 12, "--lengths", "5,10", "--csv",
                       table, "--plot", tmp_path / "tradeoff.svg")
    assert done.returncode == 0, done.stderr
    rows = table.read_text().splitlines()
    assert (tmp_path / "tradeoff.svg").read_text().count("<use") > len(rows)
    panels = plots.tradeoff(table).axes
    assert len(panels) == 2  # no frame is lost
    points = len(rows) - 1
    assert plots.main(["tradeoff", str(table), str(tmp_path / "again.svg")]) == 0
    assert (tmp_path / "again.svg").read_text().count("<use") > points


def at_rest(folder, lost=0):
    """The table of a scene at rest: fast frames of 5 and 50 ms, the same tracked."""
    names = ("method,effort,findings,tracked,length_ms,compute_ms_p50,frames,wrong_peaks,no_value,"
             "knee,distance_rmse_m,distance_rmse_low_m,distance_rmse_high_m,distance_bound_m,"
             "velocity_rmse_mps,velocity_rmse_low_mps,velocity_rmse_high_mps,velocity_bound_mps,"
             "chosen")
    rows = [f"search,fast,on,false,5,1,20,0,{lost},false,0.002,0.0018,0.0023,0.002,,,,,false",
            f"search,fast,on,false,50,8,20,0,{lost},true,0.001,,,0.001,,,,,true",
            "search,fast,on,true,5,0.5,20,0,0,false,0.002,0.0018,0.0023,0.002,,,,,false",
            "search,fast,on,true,50,4,20,0,0,false,0.001,0.0009,0.0012,0.001,,,,,false"]
    table = folder / "rest.csv"
    table.write_text("\n".join([names, *rows]) + "\n")
    return table


def test_tracked_settings_are_hollow_and_lost_frames_have_a_panel(tmp_path):
    panels = plots.tradeoff(at_rest(tmp_path, lost=2)).axes
    assert [axes.get_ylabel() for axes in panels] == ["RMSE of distance (mm)",
                                                      "wrong or missing frames (%)"]
    alone, tracked = panels[1].get_lines()
    assert list(alone.get_ydata()) == [10, 10] and list(tracked.get_ydata()) == [0, 0]
    assert alone.get_markerfacecolor() == alone.get_color()
    assert tracked.get_markerfacecolor() == "white" != tracked.get_color()


def test_an_interval_is_drawn_as_it_is_said(tmp_path):
    bars = plots.tradeoff(at_rest(tmp_path)).axes[0].containers[0].lines[2][0].get_segments()
    assert np.allclose([bar[:, 1] for bar in bars], [[1.8, 2.3], [1, 1]])


def test_an_error_that_is_not_known_has_no_panel(tmp_path):
    panels = plots.tradeoff(at_rest(tmp_path)).axes
    assert [axes.get_ylabel() for axes in panels] == ["RMSE of distance (mm)"]
    chosen = [line for line in panels[0].get_lines() if line.get_label().startswith("chosen")]
    assert [(*line.get_xdata(), *line.get_ydata()) for line in chosen] == [(8, 1)]


@pytest.mark.slow
def test_a_calibration_of_the_program(program, scene, tmp_path):
    scene["source"] |= {"target": {"motion": "linear", "distance_m": 30, "velocity_mps": 0},
                        "signal_per_pulse": 0.08}
    config = tmp_path / "still.json"
    config.write_text(json.dumps({"schema": "splid.config", **scene}))
    recording, pattern = tmp_path / "still.ptu", tmp_path / "found.json"
    done = program.run("simulate", "--config", config, "--seconds", 0.5, "--output", recording)
    assert done.returncode == 0, done.stderr
    done = program.run("calibrate", recording, "--config", config, "--output", pattern, "--plot",
                       tmp_path / "pulse.svg")
    assert done.returncode == 0, done.stderr
    words = (tmp_path / "pulse.svg").read_text()
    for label in ("photons of all pulses", "calibrated shape", "gaussian of 100 ps"):
        assert label in words
    photons = splid.calibrate(recording, config).photons
    written = np.genfromtxt(tmp_path / "pulse.csv", delimiter=",", names=True)
    for name, values in photons.items():
        assert np.array_equal(written[name], values)


def test_a_scan_is_drawn_dwell_by_dwell():
    table = splid.Frames.of_columns(np.zeros(7, splid.FRAME))
    table["scan_line"] = [0, 0, 0, 1, 1, 1, 0]
    table["scan_column"] = [0, 1, 2, 2, 1, 0, 0]
    table["scan_picture"] = [0, 0, 0, 0, 0, 0, 1]
    table["photons"] = [1, 2, 3, 4, 5, 6, 7]
    photons, = plots.scan(table).axes[0].images
    assert photons.get_array().tolist() == [[1, 2, 3], [6, 5, 4]]
    table["valid"][4] = True
    table["distance_m"] = 20
    _, distance, _ = (axes.images[0] for axes in plots.scan(table).axes[::2])
    assert np.isnan(distance.get_array().filled(np.nan)).tolist() == [[True] * 3, [True, False, True]]
    with pytest.raises(ValueError, match="no dwells of a scan"):
        plots.scan(table[:1])


@pytest.mark.slow
def test_a_run_from_the_command_line(program, scene, tmp_path):
    config = tmp_path / "scene.json"
    config.write_text(json.dumps({"schema": "splid.config", **scene}))
    recording = tmp_path / "scene.ptu"
    done = program.run("simulate", "--config", config, "--seconds", 0.1, "--output", recording)
    assert done.returncode == 0, done.stderr
    pictures = [tmp_path / "one.svg", tmp_path / "two.svg"]
    for picture in pictures:
        assert plots.main(["run", str(recording), str(config), str(picture)]) == 0
    assert "error of distance" in pictures[0].read_text()  # the truth is beside the recording
    assert pictures[0].read_bytes() == pictures[1].read_bytes()


@pytest.mark.slow
def test_the_program_draws_what_it_wrote(program, interleaved, tmp_path):
    recording, config = interleaved
    table = splid.frames(recording, config)
    for name in ("frames.csv", "frames.h5"):
        if name.endswith(".h5"):
            pytest.importorskip("h5py")
        file = tmp_path / name
        done = program.run("replay", recording, "--config", config, "--no-publish", "--output", file)
        assert done.returncode == 0, done.stderr
        read = plots.read_table(file)
        assert read.dtype == splid.FRAME
        for column in splid.FRAME.names:
            if column not in ("compute_ms", "latency_ms"):
                np.testing.assert_array_equal(read[column], table[column], column)
        picture = tmp_path / f"{name}.svg"
        done = program.run("plot", file, "--output", picture)
        assert done.returncode == 0, done.stderr
        assert "distance (m)" in picture.read_text()
    assert program.run("plot", tmp_path / "frames.csv").returncode == 0
    assert (tmp_path / "frames.png").read_bytes().startswith(b"\x89PNG")
    measured = tmp_path / "measured.svg"
    done = program.run("plot", recording, "--config", config, "--output", measured)
    assert done.returncode == 0, done.stderr
    assert "velocity (m/s)" in measured.read_text()


def test_the_golden_recording_as_it_is(interleaved):
    recording, _ = interleaved
    rates, folded = plots.recording(recording).axes
    assert [patch.get_label() for patch in rates.patches] == ["input 1", "sync"]
    period_ns = splid.Recording(recording).pattern.period_ps / 1e3
    counts, edges_ns, _ = folded.patches[0].get_data()
    assert edges_ns[-1] == pytest.approx(period_ns, rel=0.01)
    total = sum(np.count_nonzero(tags["kind"] == splid.Kind.PHOTON)
                for tags in splid.Recording(recording).tags())
    assert 0.97 * total < counts.sum() <= total


@pytest.mark.parametrize("name, words", [
    ("other.csv", "is no table of frames or of a tradeoff"),
    ("photons.csv", "draw them with their pattern"),
    ("none.csv", "No such file"),
    ("frames.h5", "frames.h5")])
def test_a_file_that_cannot_be_drawn_says_why(name, words, tmp_path, capsys):
    texts = {"other.csv": "a,b\n1,2\n", "photons.csv": "offset_ps,density_per_ns\n",
             "frames.h5": "no HDF5"}
    if name in texts:
        (tmp_path / name).write_text(texts[name])
    assert plots.main(["file", str(tmp_path / name), str(tmp_path / "a.png")]) == 4
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("name", sorted(plots.STUDIES))
def test_every_study_that_has_results(name):
    panels = plots.study(RESULTS, name).axes
    assert [axes.get_ylabel() for axes in panels] == [
        "RMSE of S (counts/pulse)", "RMSE of b (counts/ns)",
        "RMSE of τ at the frame's start (ps)", "RMSE of v (m/s)"]
    assert all(axes.has_data() for axes in panels)


def test_a_study_shows_its_rows():
    figure = plots.study(RESULTS[0], "fig2")
    bounds_ps = drawn(figure.axes[2])
    with open(RESULTS[0], encoding="utf-8") as text:
        row = next(row for row in csv.DictReader(text) if row["study"] == "fig2")
    assert bounds_ps[0] == pytest.approx([float(row["background_per_ns"]),
                                          1e3 * float(row["crb_delay_start_ns"])])


def test_of_two_runs_of_a_cell_the_longer_is_drawn(tmp_path):
    lines = RESULTS[0].read_text().splitlines()
    names = lines[0].split(",")
    cell = next(line for line in lines if line.startswith("fig2,interleaved")).split(",")
    short = list(cell)
    short[names.index("trials")] = "10"
    short[names.index("rmse_all_velocity_mps")] = "1e9"
    for order in ([cell, short], [short, cell]):
        table = tmp_path / "results.csv"
        table.write_text("\n".join([lines[0], *(",".join(row) for row in order)]) + "\n")
        velocity = plots.study(table, "fig2").axes[3]
        assert velocity.get_ylim()[1] < 1e6


def stage_table(tmp_path):
    """Three frames of a mode, of which one has no value, and one of the other method."""
    names = ("light", "mode", "method", "time_s", "signal_per_period", "background_per_period", "sbr",
             "distance_m", "velocity_mps", "true_signal", "true_background", "true_sbr",
             "reference_m", "reference_mps")
    truth = (0.05, 0.6, 0.083)
    rows = [("low", "random", "search", 10, 0.051, 0.6, 0.083, 7.001, 1.02, *truth, 7, 1),
            ("low", "random", "search", 11, "", 0.6, "", "", "", *truth, 7.1, 1),
            ("low", "random", "search", 12, 0.049, 0.6, 0.083, 7.202, 1.01, *truth, 7.2, 1),
            ("low", "random", "paper", 12, 0.05, 0.6, 0.083, 99, 99, *truth, 7.2, 1)]
    table = tmp_path / "stage.csv"
    table.write_text("\n".join(",".join(map(str, row)) for row in [names, *rows]) + "\n")
    return table


def test_a_stage_is_drawn_beside_its_encoder(tmp_path):
    table = stage_table(tmp_path)
    panels = plots.stage(table, "low").axes
    encoder, measured, of_paper = panels[3].get_lines()
    assert encoder.get_ydata().tolist() == [7, 7.1, 7.2]
    assert np.nan_to_num(measured.get_ydata()).tolist() == [7.001, 0, 7.202]
    assert of_paper.get_ydata().tolist() == [99]
    assert panels[3].get_ylim()[1] < 8  # a wrong distance of [P]'s does not flatten the others
    # The root of (1 + 4) / 2 mm^2 and so on.
    assert [axes.get_title("left") for axes in panels] == [
        "RMSE 0.001, [P] 0", "RMSE 0, [P] 0", "RMSE 0, [P] 0", "RMSE 0.0016 m, [P] 92 m",
        "RMSE 0.016 m/s, [P] 98 m/s"]
    with pytest.raises(ValueError, match="no frame is of the light strong"):
        plots.stage(table, "strong")


def test_a_stage_without_the_other_method_is_drawn_too(tmp_path):
    table = stage_table(tmp_path)
    table.write_text("".join(line for line in table.read_text().splitlines(True)
                             if ",paper," not in line))
    panels = plots.stage(table, "low").axes
    assert len(panels[3].get_lines()) == 2
    assert panels[3].get_title("left") == "RMSE 0.0016 m"


def test_without_matplotlib_it_says_what_is_lacking():
    lacking = "import sys; sys.modules['matplotlib'] = None; "
    as_program = "import runpy; runpy.run_module('splid.plots', run_name='__main__')"
    done = subprocess.run([sys.executable, "-c", lacking + as_program], capture_output=True,
                          text=True, check=False)
    assert done.returncode == 1
    assert "on Debian it is python3-matplotlib" in done.stderr
    assert "Traceback" not in done.stderr
    done = subprocess.run([sys.executable, "-c", lacking + "import splid.plots"],
                          capture_output=True, text=True, check=False)
    assert "ImportError: splid.plots draws with matplotlib" in done.stderr


def test_what_cannot_be_drawn_says_why(tmp_path, capsys):
    table = tmp_path / "other.csv"
    table.write_text("a,b\n1,2\n")
    with pytest.raises(ValueError, match="other.csv: has no column method"):
        plots.tradeoff(table)
    with pytest.raises(ValueError, match="one of fig2, fig3"):
        plots.study(RESULTS, "fig7")
    with pytest.raises(ValueError, match="no pulse shape"):
        plots.calibration(splid.Pattern.periodic())
    assert plots.main(["tradeoff", str(table), "picture.svg"]) == 4
    assert plots.main(["tradeoff"]) == 2
    assert "usage: python3 -m splid.plots" in capsys.readouterr().err
    assert plots.main(["study", str(RESULTS[0]), "fig9", str(tmp_path / "no" / "a.svg")]) == 3
