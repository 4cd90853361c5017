# The compiled part of the package. People import splid, whose modules document what stands here.
from typing import Any, Optional, Sequence

import numpy as np
import numpy.typing as npt

__version__: str

class SplidError(Exception):
    """What went wrong, as a sentence that says what was given, what was expected and what to do."""

class UsageError(SplidError):
    """A configuration or an argument is at fault."""

class DeviceError(SplidError):
    """An instrument, a socket or a disk is at fault."""

class DataError(SplidError):
    """The content of a recording, a pattern or a message is at fault."""

class Config:
    def __init__(self, text: str, file: str, shipped_patterns: str) -> None: ...
    @property
    def file(self) -> str: ...
    def json(self) -> str: ...

class Pattern:
    @staticmethod
    def read(file: str) -> Pattern: ...
    @staticmethod
    def from_json(text: str, file: str) -> Pattern: ...
    @staticmethod
    def interleaved(periods_ps: list[float]) -> Pattern: ...
    @staticmethod
    def random(period_ps: float, pulses: int, min_spacing_ps: float, seed: int,
               stratified: bool) -> Pattern: ...
    @staticmethod
    def periodic(period_ps: float, pulses: int, ambiguous: bool) -> Pattern: ...
    @staticmethod
    def mrr(periods_ps: list[float], repeats: list[int]) -> Pattern: ...
    def json(self) -> str: ...
    def write(self, file: str) -> None: ...
    def describe(self) -> str: ...
    @property
    def mode(self) -> str: ...
    @property
    def unambiguous_delay_ps(self) -> float: ...
    @property
    def subperiods_ps(self) -> list[float]: ...
    @property
    def calibrated_period_ps(self) -> Optional[float]: ...
    @property
    def period_ps(self) -> float: ...
    @property
    def pulses(self) -> int: ...
    @property
    def segments(self) -> list[dict[str, Any]]: ...
    @property
    def pulse(self) -> Optional[dict[str, Any]]: ...

class Reader:
    def __init__(self, file: str, period_ps: float) -> None: ...
    def facts(self) -> dict[str, Any]: ...
    def read(self, into: npt.NDArray[Any]) -> int: ...

class Target:
    """One of a frame's targets, with values like those of Estimate. Deviations are those with the
    other targets unknown too, and the significance is what this target adds to the others."""

    @property
    def status(self) -> str:
        """ok, or ambiguous where its range is not sure."""
    @property
    def distance_m(self) -> float: ...
    @property
    def delay_ns(self) -> float: ...
    @property
    def delay_start_ns(self) -> float: ...
    @property
    def velocity_mps(self) -> float: ...
    @property
    def signal_per_pulse(self) -> float: ...
    @property
    def std_distance_m(self) -> float: ...
    @property
    def std_delay_ns(self) -> float: ...
    @property
    def std_velocity_mps(self) -> float: ...
    @property
    def std_signal_per_pulse(self) -> float: ...
    @property
    def significance(self) -> float: ...
    @property
    def range_odds_nats(self) -> float: ...
    @property
    def pulse_misfit(self) -> float:
        """By how much its pulse is wider than configured; NaN where it is not surely so."""
    @property
    def acceleration_misfit_mps2(self) -> float:
        """About how much it accelerates though it is taken not to; NaN where it is not surely so."""
    @property
    def jerk_misfit_mps3(self) -> float:
        """About how much its acceleration changes though it is taken not to; NaN where it is not surely so."""
    @property
    def signal_gap(self) -> float:
        """The share of the frame without its light; NaN where there is surely none."""
    @property
    def shape_odds_nats(self) -> float:
        """How surely a weak target is no part of the pulse of a brighter one; NaN where none is close."""

class Estimate:
    """One frame's estimate. Values are NaN where has_values is False; std_ is one standard
    deviation.

    distance_m, delay_ns (round trip) and velocity_mps (positive away from the lidar) are at
    mid-frame, delay_start_ns is at the frame's start. An acceleration is NaN where the path was
    taken as straight.
    """

    @property
    def status(self) -> str:
        """ok, no_target, ambiguous, no_sync or not_run."""
    @property
    def has_values(self) -> bool: ...
    @property
    def distance_m(self) -> float:
        """c/2 times delay_ns, less scene.range_offset_m."""
    @property
    def delay_ns(self) -> float: ...
    @property
    def delay_start_ns(self) -> float: ...
    @property
    def velocity_mps(self) -> float: ...
    @property
    def acceleration_mps2(self) -> float: ...
    @property
    def signal_per_pulse(self) -> float:
        """Counts for each pulse of amplitude 1."""
    @property
    def background_per_s(self) -> float: ...
    @property
    def std_distance_m(self) -> float: ...
    @property
    def std_delay_ns(self) -> float: ...
    @property
    def std_velocity_mps(self) -> float: ...
    @property
    def std_acceleration_mps2(self) -> float: ...
    @property
    def std_signal_per_pulse(self) -> float: ...
    @property
    def std_background_per_s(self) -> float: ...
    @property
    def significance(self) -> float:
        """Nats gained over no target."""
    @property
    def range_odds_nats(self) -> float: ...
    @property
    def blind_fraction(self) -> float:
        """Of the time seen; NaN where the dead time is not modelled."""
    @property
    def dead_time_misfit_ns(self) -> float:
        """How long the detector is blind after a detection, where that is longer than configured
        and biases the values; NaN where it is not surely so."""
    @property
    def afterpulse_misfit(self) -> float:
        """The share of detections that an afterpulse follows; NaN where that does not surely raise
        the background."""
    @property
    def flicker_misfit(self) -> float:
        """The relative rms by which the light varies within the frame, where the dead time then
        makes values too low; NaN where it does not surely do so."""
    @property
    def pulse_misfit(self) -> float:
        """By how much the detected pulse is wider than configured; NaN where it is not surely so."""
    @property
    def pulse_excess(self) -> float:
        """By how much it appears wider, sure or not: to be averaged over frames by 1 / std_pulse_excess**2."""
    @property
    def std_pulse_excess(self) -> float: ...
    @property
    def acceleration_misfit_mps2(self) -> float:
        """About how much the target accelerates though it is taken not to; NaN where it is not surely so."""
    @property
    def jerk_misfit_mps3(self) -> float:
        """About how much its acceleration changes though it is taken not to; NaN where it is not surely so."""
    @property
    def path_excess(self) -> float:
        """By how many of chance's deviations the path appears to be another, sure or not: to be averaged over
        frames as a mean square. NaN where scene.motion is neither accelerating nor auto."""
    @property
    def signal_gap(self) -> float:
        """The share of the frame without the target's light; NaN where there is surely none."""
    @property
    def pulse_sigma_ps(self) -> float:
        """NaN where pulse.width is not fitted, and where the photons do not tell it."""
    @property
    def std_pulse_sigma_ps(self) -> float: ...
    @property
    def shape_misfit(self) -> float:
        """How far a pulse of fitted width is from a gaussian, relative rms; NaN where it is not surely so."""
    @property
    def pulse_skew(self) -> float:
        """Its skewness, sure or not: to be averaged over frames by 1 / std_pulse_skew**2."""
    @property
    def std_pulse_skew(self) -> float: ...
    @property
    def photons(self) -> int: ...
    @property
    def targets(self) -> list[Target]:
        """All targets of the frame, the brightest first, up to scene.targets; the values above are
        those of the first target. Empty where the frame shows no target."""
    @property
    def sync_locked(self) -> bool: ...
    @property
    def sync_count(self) -> int: ...
    @property
    def sync_missing(self) -> int: ...
    @property
    def sync_spurious(self) -> int: ...
    @property
    def sync_period_ps(self) -> float:
        """In the tagger's clock ([P] Eq. 19); NaN without a lock, as the next two."""
    @property
    def sync_drift_ppm(self) -> float: ...
    @property
    def sync_jitter_ps(self) -> float: ...

class Estimator:
    def __init__(self, config: Config) -> None: ...
    def estimate(self, photons_ps: npt.NDArray[np.int64], syncs_ps: npt.NDArray[np.int64],
                 start_ps: int, end_ps: int, losses: npt.NDArray[np.int64],
                 before_ps: npt.NDArray[np.int64],
                 photons_of_input: Sequence[int]) -> Estimate: ...

class Truth:
    @staticmethod
    def from_json(text: str) -> Truth: ...
    def json(self) -> str: ...
    def at(self, times_ps: npt.NDArray[np.int64]
           ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
    @property
    def signal_per_pulse(self) -> float: ...
    @property
    def background_per_s(self) -> float: ...
    @property
    def sigma_ps(self) -> float: ...
    @property
    def electronic_delay_ns(self) -> float: ...
    @property
    def drift_ppm(self) -> float: ...

class Bound:
    @property
    def delay_ns(self) -> float: ...
    @property
    def delay_start_ns(self) -> float: ...
    @property
    def velocity_mps(self) -> float: ...
    @property
    def signal_per_pulse(self) -> float: ...
    @property
    def background_per_s(self) -> float: ...
    @property
    def acceleration_mps2(self) -> float: ...

class BoundScene:
    def __init__(self, *, length_ms: float, seen_fraction: float, delay_ns: float,
                 velocity_mps: float, signal_per_pulse: float, background_per_s: float,
                 moving: bool, accelerating: bool) -> None: ...

def take_log() -> list[tuple[int, str]]: ...
def shipped_patterns_folder() -> str: ...
def tag_type() -> np.dtype[Any]: ...
def frame_type() -> np.dtype[Any]: ...
def frame_units() -> dict[str, str]: ...
def scan(file: str, max_tags: int) -> dict[str, Any]: ...
def frames_of_file(config: Config, recording: str, counts: str) -> npt.NDArray[Any]: ...
def frames_of_tags(config: Config, tags: npt.NDArray[Any],
                   start_unix_s: Optional[float]) -> npt.NDArray[Any]: ...
def simulate(config: Config, seconds: float, seed: Optional[int]
             ) -> tuple[npt.NDArray[Any], Truth, Optional[float]]: ...
def bound(pattern: Pattern, sigma_ps: float, tabulated: bool, scene: BoundScene) -> Bound: ...
def calibrate(config: Config, recording: str, distance_m: Optional[float], time_ps: float,
              amplitude_percent: float) -> tuple[Pattern, str, str, dict[str, Any]]: ...
