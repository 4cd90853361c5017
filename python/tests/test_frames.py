"""splid.frames() against the program, against the truth, and beside other threads."""

import json
import math
import os
import signal
import threading
import time

import numpy as np
import pytest

import splid

TIMES_OF_THE_RUN = {"compute_ms", "latency_ms"}


def members(message, before=""):
    """A message's members by their columns' names."""
    found = {}
    for name, value in message.items():
        if name in ("schema", "v"):
            continue
        if isinstance(value, dict):
            found.update(members(value, f"{before}{name}_"))
        else:
            found[before + name] = value
    return found


def expect_same(row, message):
    """Every column is the message's member to the last bit, or says that there is none."""
    known = members(message)
    assert set(known) <= set(splid.FRAME.names)
    assert row["time"].astype("M8[us]").astype(float) * 1e-6 == pytest.approx(known["timestamp"], abs=1e-6)
    for name in set(splid.FRAME.names) - TIMES_OF_THE_RUN - {"time"}:
        value = row[name].item()
        if isinstance(value, str):
            assert value == known.get(name, ""), name
        elif name == "start_ps":
            assert value == int(known[name])
        elif name == "uncounted_losses":
            assert value == known.get(name, 0)
        elif name in known:
            assert value == known[name], name
        else:
            assert value == -1 or math.isnan(value), name


def test_frames_are_those_of_replay_to_the_bit(golden, program):
    table = splid.frames(*golden)
    messages = program.json_frames(*golden)
    assert len(table) == len(messages) > 5
    for row, message in zip(table, messages):
        expect_same(row, message)


def test_a_recording_and_a_loaded_configuration_do_as_well(interleaved):
    recording, config = interleaved
    table = splid.frames(splid.Recording(recording), splid.Config(config))
    again = splid.frames(str(recording), str(config))
    assert table["distance_m"].tobytes() == again["distance_m"].tobytes()


def test_tags_in_memory_give_the_frames_of_their_recording(interleaved):
    recording, config = interleaved
    file = splid.Recording(recording)
    tags = np.concatenate(list(file.tags()))
    table = splid.frames(recording, config)[:-1]  # only a file says how far its last frame reaches
    of_tags = splid.frames(tags, config, start_unix_s=file.start_unix_s)[:len(table)]
    for name in ("start_ps", "distance_m", "velocity_mps", "signal_per_pulse", "timestamp"):
        assert of_tags[name].tobytes() == table[name].tobytes(), name


def test_tags_without_a_date_begin_now(interleaved):
    recording, config = interleaved
    tags = np.concatenate(list(splid.Recording(recording).tags()))
    before = time.time()
    first = splid.frames(tags, config)[0]
    middle_s = 1e-3 * first["duration_ms"] / 2
    assert before - 1 < first["timestamp"] - middle_s < time.time() + 1
    assert len(splid.frames(tags[:0], config)) == 0


def test_several_pixels_have_a_row_each(interleaved):
    recording, config = interleaved
    alone = splid.frames(recording, config)
    several = json.loads(config.read_text())
    several["pattern"]["file"] = str(config.parent / several["pattern"]["file"])
    several["pixels"] = [{"input": 1, "name": "a"}, {"input": 77, "name": "dark"}]
    table = splid.frames(recording, several)
    assert list(table["pixel"]) == ["a", "dark"] * len(alone)
    assert np.array_equal(table["distance_m"][::2], alone["distance_m"], equal_nan=True)
    assert not table["valid"][1::2].any()


def test_the_frames_of_a_scene_are_near_its_truth(scene):
    played = splid.simulate(scene, 0.4)
    table = splid.frames(played.tags, scene, start_unix_s=played.start_unix_s)
    table = table[table["status"] == "ok"]
    assert len(table) >= 15
    middle = table["start_ps"] + (table["duration_ms"] * 0.5e9).astype(np.int64)
    distance_m, velocity_mps = played.truth.at(middle)
    assert np.all(np.abs(table["distance_m"] - distance_m) < 5 * table["std_distance_m"])
    assert np.all(np.abs(table["velocity_mps"] - velocity_mps) < 5 * table["std_velocity_mps"])


def test_columns_have_units():
    assert list(splid.UNITS) == list(splid.FRAME.names)
    assert splid.UNITS["distance_m"] == "m"
    assert splid.UNITS["status"] == ""


def test_a_file_that_is_no_recording_has_the_sentence_of_the_program(interleaved, program):
    config = interleaved[1]
    sentence = program.error_of("replay", config, "--config", config, "--no-publish")
    with pytest.raises(splid.DataError) as raised:
        splid.frames(config, config)
    assert str(raised.value) in sentence


def test_frames_that_cannot_lock_have_the_sentence_of_the_program(interleaved, program, tmp_path):
    recording, config = interleaved
    keys = splid.Config(config).to_dict()
    other = tmp_path / "other.json"
    splid.Pattern.random(period_ns=4000).write(tmp_path / "pattern.json")
    keys["pattern"]["file"] = "pattern.json"
    other.write_text(json.dumps(keys), encoding="utf-8")
    sentence = program.error_of("replay", recording, "--config", other, "--no-publish")
    with pytest.raises(splid.DataError) as raised:
        splid.frames(recording, other)
    assert str(raised.value) in sentence


def test_other_arrays_than_tags_are_refused(interleaved):
    with pytest.raises(TypeError, match="splid.TAG"):
        splid.frames(np.zeros(3), interleaved[1])
    tags = np.zeros(8, splid.TAG)
    with pytest.raises(TypeError, match="contiguous"):
        splid.frames(tags[::2], interleaved[1])


def test_threads_run_and_signals_come_while_it_computes(scene):
    # 60 s of light take seconds, and 400 MB if nothing ends them. The timer's thread needs the
    # interpreter's lock to send its signal.
    timer = threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT))
    is_finished = False
    with pytest.raises(KeyboardInterrupt):
        timer.start()
        splid.simulate(scene, 60)
        is_finished = True
    timer.join()
    assert not is_finished


def test_an_interrupted_measurement_ends(scene):
    tags = splid.simulate(scene, 0.5).tags
    later = tags["time_ps"][-1] + 1_000_000
    many = np.concatenate([tags] * 40)
    for k in range(40):
        many["time_ps"][k * len(tags):(k + 1) * len(tags)] += k * later
    scene["pipeline"] = {"estimation_threads": 1}  # a second of work, whatever the machine
    timer = threading.Timer(0.05, lambda: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        timer.start()
        splid.frames(many, scene)
    timer.join()


def test_a_table_has_text_times_and_one_line(interleaved):
    recording, config = interleaved
    table = splid.frames(recording, config)
    assert "ok" in table.status
    good = table[table.status == "ok"]
    assert isinstance(good, splid.Frames)
    assert len(good) == np.sum(table["valid"]) > 0
    start = np.datetime64(round(splid.Recording(recording).start_unix_s * 1e6), "us")
    middle_us = (good.start_ps + good.duration_ms * 0.5e9) * 1e-6
    assert np.abs((good.time - start).astype("m8[ns]").astype(float) * 1e-3 - middle_us).max() < 2
    text = repr(table)
    assert "\n" not in text and f"{len(table)} frames" in text and f"{len(good)} valid" in text
    assert repr(table[:0]) == "<splid.Frames: none>"
    assert "Frames" not in repr(table.distance_m)


def test_pandas_and_xarray_take_the_table(interleaved):
    table = splid.frames(*interleaved)
    pandas = pytest.importorskip("pandas")
    frame = table.to_pandas()
    assert list(frame.columns) == list(splid.FRAME.names)
    assert frame.time.dtype == "datetime64[ns]"
    assert len(frame[frame.status == "ok"]) == np.sum(table.status == "ok") > 0
    assert frame.distance_m.to_numpy().tobytes() == table.distance_m.tobytes()
    assert isinstance(frame, pandas.DataFrame)
    pytest.importorskip("xarray")
    data = table.to_xarray()
    assert data.distance_m.dims == ("time",)
    assert data.distance_m.attrs == {"units": "m"}
    assert data.status.attrs == {}
    assert data.sel(time=data.time[2]).sequence == table.sequence[2]


def test_errors_name_the_argument(interleaved):
    recording, config = interleaved
    for call, name in ((lambda: splid.frames(3, config), "recording: 3"),
                       (lambda: splid.frames(recording, 3), "config: 3"),
                       (lambda: splid.frames(recording, config, encoder=3), "encoder: 3"),
                       (lambda: splid.Pattern(None), "file: None"),
                       (lambda: splid.Config([]), r"config: \[\]"),
                       (lambda: splid.bound(3, signal_per_pulse=1, background_per_s=1),
                        "pattern: 3"),
                       (lambda: splid.calibrate(3, config), "recording: 3")):
        with pytest.raises(TypeError, match=f"^{name} was given, but .* is expected$"):
            call()
