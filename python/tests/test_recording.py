"""splid.Recording: facts, and tags in chunks of any size."""

import numpy as np
import pytest

import splid


def test_tags_are_those_that_are_counted(golden):
    recording = splid.Recording(golden[0])
    counts = recording.scan()
    tags = np.concatenate(list(recording.tags()))
    assert counts["whole"]
    assert counts["syncs"] == np.count_nonzero(tags["kind"] == splid.Kind.SYNC) > 0
    photons = tags[tags["kind"] == splid.Kind.PHOTON]
    assert counts["photons"] == {1: len(photons)}
    assert set(photons["value"]) == {1}
    assert counts["first_ps"] == tags["time_ps"].min()
    assert counts["last_ps"] == tags["time_ps"].max()


def test_chunks_of_any_size_are_the_same_tags(interleaved):
    recording = splid.Recording(interleaved[0])
    whole = np.concatenate(list(recording.tags()))
    chunks = list(recording.tags(chunk=997))
    assert max(map(len, chunks)) <= 997
    assert np.array_equal(np.concatenate(chunks), whole)
    with pytest.raises(ValueError, match="chunk"):
        next(recording.tags(chunk=0))


def test_facts_of_the_header(interleaved):
    recording = splid.Recording(str(interleaved[0]))
    assert recording.header["TTResultFormat_TTTRRecType"] == recording.record_type == 0x01010204
    assert recording.header["Measurement_Mode"] == 2
    assert not recording.is_t3
    assert recording.resolution_s == pytest.approx(1e-12)
    assert recording.losses.shape == (len(recording.losses), 3)


def test_another_format_than_ptu(tmp_path):
    file = tmp_path / "a.qutag"
    events = np.array([(5, 1), (340_000_000_000_000_007, 5)], dtype=[("t", "<i8"), ("c", "<i2")])
    file.write_bytes(bytes(40) + events.tobytes())
    recording = splid.Recording(file)
    assert recording.format == "a quTAG recording"
    assert recording.record_type is None
    tags = np.concatenate(list(recording.tags()))
    assert tags["time_ps"].tolist() == events["t"].tolist()
    assert tags["value"].tolist() == [1, 5]


def test_no_recording(tmp_path):
    with pytest.raises(splid.SplidError, match="absent.ptu"):
        splid.Recording(tmp_path / "absent.ptu")
