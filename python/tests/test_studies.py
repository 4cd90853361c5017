"""Scenes, bounds and calibrations."""

import json

import numpy as np
import pytest

import splid


def test_one_seed_is_one_stream(scene):
    first, again = (splid.simulate(scene, 0.05, seed=3) for _ in range(2))
    other = splid.simulate(scene, 0.05, seed=4)
    assert np.array_equal(first.tags, again.tags)
    assert not np.array_equal(first.tags["time_ps"][:1000], other.tags["time_ps"][:1000])
    assert first.truth.signal_per_pulse > 0


def test_a_scene_has_the_photons_of_its_recording(scene, program, tmp_path):
    config = tmp_path / "scene.json"
    config.write_text(json.dumps({"schema": "splid.config", **scene}))
    recording = tmp_path / "scene.ptu"
    done = program.run("simulate", "--config", config, "--seconds", 0.05, "--output", recording)
    assert done.returncode == 0, done.stderr
    written = np.concatenate(list(splid.Recording(recording).tags()))
    played = splid.simulate(config, 0.05)
    for kind in (splid.Kind.PHOTON, splid.Kind.SYNC):
        assert np.array_equal(np.sort(played.tags["time_ps"][played.tags["kind"] == kind]),
                              np.sort(written["time_ps"][written["kind"] == kind]))
    truth = splid.Truth(tmp_path / "scene.truth.json")
    times = np.arange(0, 50_000_000_000, 777_777_777)
    for ours, file in zip(played.truth.at(times), truth.at(times)):
        assert np.array_equal(ours, file)
    assert np.isnan(truth.at(-1)[0])


def test_only_a_simulator_is_simulated(interleaved, scene):
    with pytest.raises(splid.UsageError, match='the driver "simulator"'):
        splid.simulate(interleaved[1], 1)
    with pytest.raises(splid.UsageError, match="seconds"):
        splid.simulate(scene, 0)


def test_a_bound_without_background_is_sigma_over_root_n():
    pattern = splid.Pattern.interleaved([180, 189])
    found = splid.bound(pattern, signal_per_pulse=1e-2, background_per_s=0, length_ms=50,
                        sigma_ps=100, moving=False)
    photons = 1e-2 * 40 * 50e6 / 3780
    assert found.delay_ns == pytest.approx(0.1 / photons**0.5, rel=1e-3)
    assert found.distance_m == pytest.approx(found.delay_ns * 0.149896229)
    assert found.velocity_mps == 0


def test_a_bound_of_nothing_is_refused():
    pattern = splid.Pattern.periodic()
    with pytest.raises(splid.UsageError, match="signal_per_pulse"):
        splid.bound(pattern, signal_per_pulse=0, background_per_s=0)
    with pytest.raises(splid.UsageError, match="tabulated"):
        splid.bound(pattern, signal_per_pulse=1, background_per_s=0, sigma_ps=None)


def test_a_bound_takes_a_pattern_by_its_path(tmp_path):
    pattern = splid.Pattern.periodic()
    path = tmp_path / "p.json"
    pattern.write(path)
    light = {"signal_per_pulse": 1e-2, "background_per_s": 1e3}
    assert splid.bound(path, **light) == splid.bound(pattern, **light)
    with pytest.raises(splid.SplidError, match="none.json"):
        splid.bound("none.json", **light)


@pytest.mark.slow
def test_a_calibration_is_that_of_the_program(scene, program, tmp_path):
    scene["source"]["target"] |= {"motion": "linear", "velocity_mps": 0}
    scene["source"]["signal_per_pulse"] = 0.05
    config = tmp_path / "scene.json"
    config.write_text(json.dumps({"schema": "splid.config", **scene}))
    recording = tmp_path / "rest.ptu"
    done = program.run("simulate", "--config", config, "--seconds", 1, "--output", recording)
    assert done.returncode == 0, done.stderr
    goal = {"time_ps": 20, "amplitude_percent": 20}
    done = program.run("calibrate", recording, "--config", config, "--output",
                       tmp_path / "pattern.json", "--time-ps", 20, "--amplitude-percent", 20)
    assert done.returncode == 0, done.stderr
    made = splid.calibrate(recording, config, **goal)
    assert made.pattern == splid.Pattern(tmp_path / "pattern.json")
    assert made.table == done.stdout
    assert made.pattern.pulse["density"].max() > 0
    with pytest.raises(splid.DataError):
        splid.calibrate(recording, config, time_ps=1e-3)
