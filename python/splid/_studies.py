"""Bounds and calibrations."""

import dataclasses
import os
from typing import Optional, Union

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._arguments import path_of
from splid._config import AnyConfig, bound_config
from splid._log import told
from splid._pattern import Pattern
from splid._recording import Recording

_M_PER_NS_OF_DELAY = 299_792_458 * 1e-9 / 2


@dataclasses.dataclass(frozen=True)
class Bound:
    """The smallest standard deviations that an unbiased estimate can have.

    A deviation is infinite where the photons tell nothing, and 0 for a velocity, an acceleration or
    a background that is known.
    """

    distance_m: float  # at mid-frame
    delay_ns: float  # at mid-frame
    delay_start_ns: float  # at the frame's start, as [P] gives it
    velocity_mps: float
    acceleration_mps2: float
    signal_per_pulse: float
    background_per_s: float


def bound(pattern: "Union[Pattern, os.PathLike[str], str]", *, signal_per_pulse: float,
          background_per_s: float, length_ms: float = 50, seen_fraction: float = 1,
          sigma_ps: Optional[float] = 100, delay_ns: float = 1898, velocity_mps: float = 0,
          moving: bool = True, accelerating: bool = False) -> Bound:
    """The bound of Cramer and Rao of one frame. Source: [P] Eq. 12 and 13, for any pattern and
    shape.

    pattern: a Pattern, or the path of its file. signal_per_pulse: S > 0, detections of a pulse of
    amplitude 1. background_per_s: b >= 0. length_ms: of the frame. seen_fraction: the share of it
    that was seen. sigma_ps: of a gaussian pulse; None: the shape of a calibrated pattern. moving:
    False for a velocity that is known to be zero. accelerating: True for an unknown acceleration
    near zero. To 1e-6 relative for gaussian pulses.

    Errors: UsageError for values out of bounds, and for a pattern without a shape; those of
    Pattern.
    """
    if not isinstance(pattern, Pattern):
        pattern = Pattern(path_of("pattern", pattern, " or a Pattern"))
    scene = _splid.BoundScene(
        length_ms=length_ms, seen_fraction=seen_fraction, delay_ns=delay_ns,
        velocity_mps=velocity_mps, signal_per_pulse=signal_per_pulse,
        background_per_s=background_per_s, moving=moving, accelerating=accelerating)
    found = _splid.bound(pattern._bound, sigma_ps or 0, sigma_ps is None, scene)
    return Bound(_M_PER_NS_OF_DELAY * found.delay_ns, found.delay_ns, found.delay_start_ns,
                 found.velocity_mps, found.acceleration_mps2, found.signal_per_pulse,
                 found.background_per_s)


@dataclasses.dataclass(frozen=True)
class Calibration:
    """A pattern as a target at rest shows it; table and summary are for people.

    photons: the photons of all pulses laid upon each other, less background and neighbours, as
    arrays of one length: offset_ps from the pulse's time, density_per_ns with integral 1, and
    std_per_ns, the density's noise (one standard deviation).
    """

    pattern: Pattern
    table: str
    summary: str
    photons: dict[str, npt.NDArray[np.float64]]


def calibrate(recording: "Union[Recording, os.PathLike[str], str]", config: AnyConfig, *,
              distance_m: Optional[float] = None, time_ps: float = 5,
              amplitude_percent: float = 2) -> Calibration:
    """Finds a pattern's period, pulses and shape in a recording of a target at rest (`splid
    calibrate`).

    config: channels, nominal pattern and pulse width, which need only hold within a factor of two;
    its source is not used. distance_m: where the target is; without it, the target reads the middle
    of the range. time_ps, amplitude_percent: how well each pulse has to be
    known, one standard deviation, and how far the target may have moved.

    Errors: those of Config and Recording; DataError, which says what was seen, where the syncs do
    not fit, no pulse stands out, the target moved or the photons are too few.
    """
    for name, value in (("time_ps", time_ps), ("amplitude_percent", amplitude_percent)):
        if not value > 0:
            raise _splid.UsageError(f"{name}: {value} was given, but a number above 0 is expected")
    file = (recording.file if isinstance(recording, Recording)
            else path_of("recording", recording, " or a Recording"))
    with told():
        pattern, table, summary, photons = _splid.calibrate(
            bound_config(config), file, distance_m, time_ps, amplitude_percent)
    return Calibration(Pattern._of(pattern), table, summary, photons)
