"""Pulse patterns."""

import os
from collections.abc import Sequence
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._arguments import path_of

_PS_PER_NS = 1000.0


class Pattern:
    """What the waveform generator plays: the pulse times and amplitudes of one pattern period.

    Pattern("pattern.json") reads a file; interleaved(), random(), periodic() and mrr() make patterns, as
    `splid pattern` does. A pattern does not change. Times are doubles in ps and never rounded to a
    grid. Source: [P] section 2.

    Errors: DataError with the file, the JSON pointer, the value and the bound; UsageError for
    numbers of which no pattern can be made.
    """

    def __init__(self, file: "os.PathLike[str] | str") -> None:
        """Reads a pattern file."""
        self._bound = _splid.Pattern.read(path_of("file", file))

    @classmethod
    def _of(cls, bound: _splid.Pattern) -> "Pattern":
        pattern = cls.__new__(cls)
        pattern._bound = bound
        return pattern

    @classmethod
    def from_json(cls, text: str, name: str = "pattern") -> "Pattern":
        """Takes the text of a pattern file; `name` stands for the file in errors."""
        return cls._of(_splid.Pattern.from_json(text, name))

    @classmethod
    def interleaved(cls, subperiods_ns: Sequence[float]) -> "Pattern":
        """Pulses at all multiples of the sub-periods below their least common multiple.

        subperiods_ns: at least two, whole picoseconds; 180 and 189 ns give 40 pulses in 3780 ns.
        """
        return cls._of(_splid.Pattern.interleaved([_PS_PER_NS * period for period in subperiods_ns]))

    @classmethod
    def random(cls, period_ns: float = 3780, pulses: int = 40, min_spacing_ns: float = 9,
               seed: int = 1, stratified: bool = False) -> "Pattern":
        """Pulses at random times that keep a distance; stratified: one in each of equal slots
        instead.
        """
        return cls._of(_splid.Pattern.random(_PS_PER_NS * period_ns, pulses,
                                         _PS_PER_NS * min_spacing_ns, seed, stratified))

    @classmethod
    def periodic(cls, period_ns: float = 3780, pulses: int = 1,
                 ambiguous: bool = False) -> "Pattern":
        """Evenly spaced pulses; ambiguous: targets may be beyond the range that their spacing
        tells.
        """
        return cls._of(_splid.Pattern.periodic(_PS_PER_NS * period_ns, pulses, ambiguous))

    @classmethod
    def mrr(cls, periods_ns: Sequence[float], repeats: "int | Sequence[int]") -> "Pattern":
        """Several repetition rates in turn: period k is played repeats[k] times (or `repeats`
        times).
        """
        times = [repeats] * len(periods_ns) if isinstance(repeats, int) else list(repeats)
        return cls._of(_splid.Pattern.mrr([_PS_PER_NS * period for period in periods_ns], times))

    def write(self, file: "os.PathLike[str] | str") -> None:
        """Writes a pattern file, as a whole or not at all; one that is there is replaced.

        Errors: DeviceError with the file and the system's reason.
        """
        self._bound.write(path_of("file", file))

    def to_json(self) -> str:
        """The pattern as a line of JSON, which reads back to the same bits."""
        return self._bound.json()

    @property
    def mode(self) -> str:
        """baseline, ambiguous, mrr, random or interleaved."""
        return self._bound.mode

    @property
    def period_ps(self) -> float:
        """The pattern period, after which a sync comes; of MRR the sum of period times repeats."""
        return self._bound.period_ps

    @property
    def calibrated_period_ps(self) -> Optional[float]:
        """The period that a calibration measured, in the tagger's clock; None without one."""
        return self._bound.calibrated_period_ps

    @property
    def unambiguous_delay_ps(self) -> float:
        """The largest delay that the mode can tell apart ([P] Eq. 3)."""
        return self._bound.unambiguous_delay_ps

    @property
    def subperiods_ps(self) -> npt.NDArray[np.float64]:
        """The sub-periods t_k of an interleaved or MRR pattern; else empty."""
        return np.array(self._bound.subperiods_ps)

    @property
    def pulses(self) -> int:
        """The number of pulses in one pattern period."""
        return self._bound.pulses

    @property
    def segments(self) -> list[dict[str, Any]]:
        """The segments that are played in turn, one unless the mode is mrr.

        Each has period_ps, the arrays pulse_times_ps (ascending, from 0 to below period_ps) and
        amplitudes (relative, >= 0; one for each pulse), and repeats (0: for ever).
        """
        return self._bound.segments

    @property
    def pulse_times_ps(self) -> npt.NDArray[np.float64]:
        """The pulse times of the only segment, shape (pulses,). Errors: ValueError for a pattern of
        several.
        """
        pulse_times_ps: npt.NDArray[np.float64] = self._only_segment()["pulse_times_ps"]
        return pulse_times_ps

    @property
    def amplitudes(self) -> npt.NDArray[np.float64]:
        """The relative amplitudes of these pulses. Errors: ValueError for a pattern of several
        segments.
        """
        amplitudes: npt.NDArray[np.float64] = self._only_segment()["amplitudes"]
        return amplitudes

    @property
    def pulse(self) -> Optional[dict[str, Any]]:
        """The calibrated pulse shape: first_ps, step_ps and the array density; None without a
        calibration.
        """
        return self._bound.pulse

    def plot(self, axes: Any = None) -> Any:
        """Draws one pattern period with matplotlib, a line for each pulse, and returns the axes.

        axes: matplotlib's, to draw into; None: of a new figure. Errors: ImportError without
        matplotlib.
        """
        if axes is None:
            from matplotlib import pyplot
            axes = pyplot.figure(layout="constrained").subplots()
        start_ns = 0.0
        for segment in self.segments:
            times_ns = start_ns + segment["pulse_times_ps"] / _PS_PER_NS
            axes.vlines(times_ns, 0, segment["amplitudes"], linewidth=1)
            start_ns += segment["period_ps"] * max(1, segment["repeats"]) / _PS_PER_NS
        axes.set_xlim(0, self.period_ps / _PS_PER_NS)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("time in the pattern period (ns)")
        axes.set_ylabel("relative amplitude")
        axes.set_title(self._bound.describe(), fontsize="small")
        return axes

    def _only_segment(self) -> dict[str, Any]:
        segments = self.segments
        if len(segments) != 1:
            raise ValueError(f"the pattern has {len(segments)} segments; look at segments instead")
        return segments[0]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pattern) and self._bound == other._bound

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<splid.Pattern: {self._bound.describe()}>"
