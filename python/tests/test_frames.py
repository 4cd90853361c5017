"""splid.frames() against the program, against the truth, and beside other threads."""

import json
import math
import os
import signal
import threading

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
    for name in set(splid.FRAME.names) - TIMES_OF_THE_RUN:
        value = row[name].item()
        if isinstance(value, bytes):
            assert value.decode() == known.get(name, ""), name
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
    table = splid.frames(splid.Recording(recording), splid.Config.load(config))
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


def test_the_frames_of_a_scene_are_near_its_truth(scene):
    played = splid.simulate(scene, 0.4)
    table = splid.frames(played.tags, scene, start_unix_s=played.start_unix_s)
    table = table[table["status"] == b"ok"]
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
    keys = splid.Config.load(config).to_dict()
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
