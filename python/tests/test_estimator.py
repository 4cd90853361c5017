"""splid.Estimator: the estimate of a frame's tags is that of the frame, and of nothing else."""

import numpy as np
import pytest

import splid

SAME = ("distance_m", "velocity_mps", "signal_per_pulse", "std_distance_m", "std_velocity_mps",
        "std_signal_per_pulse", "significance", "range_odds_nats", "sync_period_ps",
        "sync_drift_ppm", "sync_jitter_ps", "sync_count", "sync_missing", "sync_spurious",
        "photons")


def tags_of(recording):
    tags = np.concatenate(list(splid.Recording(recording).tags()))
    return (np.ascontiguousarray(tags["time_ps"][tags["kind"] == splid.Kind.PHOTON]),
            np.ascontiguousarray(tags["time_ps"][tags["kind"] == splid.Kind.SYNC]))


def inside(times_ps, start_ps, end_ps):
    return times_ps[(times_ps >= start_ps) & (times_ps < end_ps)]


def estimate_of(row, photons, syncs, estimator):
    start = int(row["start_ps"])
    end = start + round(float(row["duration_ms"]) * 1e9)
    return estimator.estimate(inside(photons, start, end), inside(syncs, start, end), start, end)


def test_the_same_tags_give_the_estimate_of_their_frame(interleaved):
    recording, config = interleaved
    photons, syncs = tags_of(recording)
    table = splid.frames(recording, config)
    estimator = splid.Estimator(config)
    whole = table[(table["seen_fraction"] == 1) & (table["status"] == "ok")]
    assert len(whole) >= 3
    found = [estimate_of(row, photons, syncs, estimator) for row in whole]
    for one, row in zip(found, whole):
        assert one.status == "ok"
        for name in SAME:
            std = row[f"std_{name}"] if f"std_{name}" in row.dtype.names else row[name]
            assert abs(getattr(one, name) - row[name]) <= 1e-6 * abs(std), name
    for one, row in zip(reversed(found), reversed(whole)):  # to the bit, in any order
        again = estimate_of(row, photons, syncs, estimator)
        for name in SAME:
            assert getattr(again, name) == getattr(one, name), name


def test_strong_light_on_a_detector_with_a_dead_time(scene):
    scene["source"].update(signal_per_pulse=0.5, ambient_per_s=2e6, detector={"dead_time_ns": 50})
    scene["source"]["target"]["velocity_mps"] = 20
    scene["detector"] = {"dead_time_ns": 50}
    scene["frame"]["length_ms"] = 2
    tags = splid.simulate(scene, 0.01).tags
    photons, syncs = (np.ascontiguousarray(tags["time_ps"][tags["kind"] == kind])
                      for kind in (splid.Kind.PHOTON, splid.Kind.SYNC))
    table = splid.frames(tags, scene)
    whole = table[(table["seen_fraction"] == 1) & (table["status"] == "ok")]
    assert len(whole) >= 3
    estimator = splid.Estimator(scene)
    for row in whole:
        start = int(row["start_ps"])
        end = start + round(float(row["duration_ms"]) * 1e9)
        before = photons[photons < start][-64:]
        found = estimator.estimate(inside(photons, start, end), inside(syncs, start, end), start,
                                   end, before_ps=before)
        assert 0.15 < found.blind_fraction < 0.4
        assert abs(found.blind_fraction - row["blind_fraction"]) < 1e-9
        assert abs(found.signal_per_pulse - 0.5) < 5 * found.std_signal_per_pulse
        assert (abs(found.distance_m - row["distance_m"]) < 1e-6 * found.std_distance_m)
        assert found.findings == []


# Of two inputs one counts a third of the photons less than the other, as its light is weaker.
def test_inputs_that_share_the_light_unevenly(scene):
    scene["source"].update(signal_per_pulse=0.02, ambient_per_s=2e6,
                           detector={"dead_time_ns": 50, "inputs": 2})
    scene["channels"] = {**scene.get("channels", {}), "photon": [1, 2]}
    scene["detector"] = {"dead_time_ns": 50}
    scene["frame"]["length_ms"] = 2
    tags = splid.simulate(scene, 0.005).tags
    is_second = (tags["kind"] == splid.Kind.PHOTON) & (tags["value"] == 2)
    tags = tags[~is_second | (np.cumsum(is_second) % 3 != 0)]
    photons, syncs = (np.ascontiguousarray(tags["time_ps"][tags["kind"] == kind])
                      for kind in (splid.Kind.PHOTON, splid.Kind.SYNC))
    inputs = tags["value"][tags["kind"] == splid.Kind.PHOTON]
    table = splid.frames(tags, scene)
    row = table[(table["seen_fraction"] == 1) & (table["status"] == "ok")][-1]
    start = int(row["start_ps"])
    end = start + round(float(row["duration_ms"]) * 1e9)
    counts = [int(((photons >= start) & (photons < end) & (inputs == k)).sum()) for k in (1, 2)]
    assert 0.6 < counts[1] / counts[0] < 0.75
    estimator = splid.Estimator(scene)
    frame = (inside(photons, start, end), inside(syncs, start, end), start, end)
    before = photons[photons < start][-64:]
    known = estimator.estimate(*frame, before_ps=before, photons_of_input=counts)
    assert abs(known.blind_fraction - row["blind_fraction"]) < 1e-9
    even = estimator.estimate(*frame, before_ps=before)
    assert known.blind_fraction - even.blind_fraction > 1e-3
    with pytest.raises(splid.UsageError, match="3 counts, and channels.photon has 2 inputs"):
        estimator.estimate(*frame, photons_of_input=[1, 2, 3])


def test_a_frame_has_all_its_targets(scene):
    scene["source"]["target"] = {"motion": "linear", "distance_m": 284.5, "velocity_mps": 20}
    scene["source"]["more_targets"] = [
        {"motion": "linear", "distance_m": 282.5, "velocity_mps": 20, "signal_per_pulse": 6e-4}]
    scene["scene"] = {**scene.get("scene", {}), "targets": 2}
    tags = splid.simulate(scene, 0.1).tags
    photons, syncs = (np.ascontiguousarray(tags["time_ps"][tags["kind"] == kind])
                      for kind in (splid.Kind.PHOTON, splid.Kind.SYNC))
    row = next(row for row in splid.frames(tags, scene) if row["status"] == "ok")
    found = estimate_of(row, photons, syncs, splid.Estimator(scene))
    assert len(found.targets) == 2
    first, second = found.targets
    assert first.distance_m == found.distance_m and first.significance > 100
    assert first.signal_per_pulse > second.signal_per_pulse
    assert first.findings == second.findings == []
    apart_m = first.distance_m - second.distance_m
    assert abs(apart_m - 2) < 5 * np.hypot(first.std_distance_m, second.std_distance_m)
    assert abs(second.velocity_mps - 20) < 5 * second.std_velocity_mps
    scene["scene"]["targets"] = 1
    one = estimate_of(row, photons, syncs, splid.Estimator(scene))
    assert [target.distance_m for target in one.targets] == [one.distance_m]


# A member's meaning is that of the message; see protocol/frame_members.hpp.
def test_members_are_those_of_the_message():
    shared = set(splid.FRAME.names) & set(dir(splid.Estimate))
    assert {"distance_m", "std_distance_m", "sync_period_ps", "findings"} <= shared
    assert splid.Estimate.distance_m.__doc__ == "distance, less `scene.range_offset_m` (m)"


def test_bounds_may_be_left_to_the_syncs(interleaved):
    recording, config = interleaved
    photons, syncs = tags_of(recording)
    estimator = splid.Estimator(config)
    found = estimator.estimate(photons, syncs[:1500])
    start = int(syncs[0])
    end = int(syncs[1499]) + round(float(np.median(np.diff(syncs[:1500]))))
    told = estimator.estimate(inside(photons, start, end), syncs[:1500], start, end)
    assert found.photons == told.photons
    assert found.distance_m == told.distance_m
    assert abs(found.distance_m - 284.5) < 0.1


def test_without_syncs_nothing_is_invented(interleaved):
    found = splid.Estimator(interleaved[1]).estimate(
        np.zeros(0, np.int64), np.zeros(0, np.int64), 0, 10**10)
    assert found.status == "no_sync"
    assert np.isnan(found.distance_m)
    assert np.isnan(found.sync_period_ps)


def test_tags_outside_of_the_frame_are_refused(interleaved):
    estimator = splid.Estimator(interleaved[1])
    with pytest.raises(splid.UsageError, match=r"photons_ps\[1\] = 5000"):
        estimator.estimate(np.array([1, 5000]), np.array([1, 2]), 0, 5000)
    with pytest.raises(splid.UsageError, match="two are needed"):
        estimator.estimate(np.array([1]), np.array([1]))


def test_doubles_are_refused(interleaved):
    with pytest.raises(TypeError):
        splid.Estimator(interleaved[1]).estimate(np.array([1.5]), np.array([1, 2]), 0, 5000)
