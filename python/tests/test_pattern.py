"""splid.Pattern: the patterns of `splid pattern`, files, and a picture."""

import numpy as np
import pytest

import splid

MADE = [
    (["interleaved", "--subperiods-ns", 180, 189], lambda: splid.Pattern.interleaved([180, 189])),
    (["random", "--seed", 7], lambda: splid.Pattern.random(seed=7)),
    (["random", "--stratified"], lambda: splid.Pattern.random(stratified=True)),
    (["periodic", "--period-ns", 400, "--pulses", 4, "--ambiguous"],
     lambda: splid.Pattern.periodic(400, 4, ambiguous=True)),
    (["mrr", "--periods-ns", 180, 189, "--repeats", 1000],
     lambda: splid.Pattern.mrr([180, 189], 1000)),
]


@pytest.mark.parametrize("words,make", MADE)
def test_patterns_are_those_of_the_program(words, make, program, tmp_path):
    file = tmp_path / "pattern.json"
    done = program.run("pattern", *words, "--output", file)
    assert done.returncode == 0, done.stderr
    made = make()
    assert made == splid.Pattern(file)
    made.write(tmp_path / "again.json")
    assert (tmp_path / "again.json").read_bytes() == file.read_bytes()


def test_what_a_pattern_says():
    pattern = splid.Pattern.interleaved([180, 189])
    assert pattern.mode == "interleaved"
    assert pattern.period_ps == pattern.unambiguous_delay_ps == 3_780_000
    assert pattern.pulses == len(pattern.pulse_times_ps) == len(pattern.amplitudes) == 40
    assert list(pattern.subperiods_ps) == [180_000, 189_000]
    assert np.all(np.diff(pattern.pulse_times_ps) > 0)
    assert pattern.pulse is None
    assert pattern.calibrated_period_ps is None
    assert splid.Pattern.from_json(pattern.to_json()) == pattern
    assert pattern != splid.Pattern.random()


def test_several_segments_have_no_single_train():
    with pytest.raises(ValueError, match="2 segments"):
        splid.Pattern.mrr([180, 189], [10, 20]).pulse_times_ps


def test_faults_name_their_place(tmp_path):
    with pytest.raises(splid.DataError, match="/mode"):
        splid.Pattern.from_json('{"schema":"splid.pattern","v":[1,0],"mode":"odd"}')
    with pytest.raises(splid.UsageError):
        splid.Pattern.interleaved([180])


def test_a_picture_has_a_line_for_each_pulse():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = splid.Pattern.mrr([180, 189], [1, 1]).plot()
    assert sum(len(lines.get_segments()) for lines in axes.collections) == 2
    assert "ns" in axes.get_xlabel()
