"""Single-photon lidar in Python: recordings, frames, patterns, scenes and what a running splid
publishes.

Times are picoseconds of the tagger's clock, as 64-bit integers, where they are absolute (`_ps`);
doubles hold only differences of times. Every name carries its unit. Arrays come and go as numpy's,
and no tag is copied on its way to the estimator. Calls that take long release the interpreter's
lock, so that threads of Python run beside them, and end at Ctrl-C.

Errors are the program's own sentences as exceptions: UsageError (a configuration or an argument),
DeviceError (a file, a socket) and DataError (what a recording holds), all of which are SplidError.
What the program would warn of goes to the logger "splid" of Python's logging.

[P] is TR2026-050, "Unambiguous Range Extension for Doppler Single-Photon Lidar" (Optics Express
2026).
"""

from splid._config import Config
from splid._estimator import Estimator
from splid._frames import FRAME, UNITS, Frames, frames
from splid._listen import Message, listen
from splid._pattern import Pattern
from splid._recording import TAG, Kind, Recording
from splid._scene import Scene, Truth, simulate
from splid._splid import (
    DataError,
    DeviceError,
    Estimate,
    SplidError,
    Target,
    UsageError,
    __version__,
)
from splid._studies import Bound, Calibration, bound, calibrate

__all__ = [
    "Bound", "Calibration", "Config", "DataError", "DeviceError", "Estimate", "Estimator", "FRAME",
    "Frames", "Kind", "Message", "Pattern", "Recording", "Scene", "SplidError", "TAG", "Target", "Truth",
    "UNITS", "UsageError", "__version__", "bound", "calibrate", "frames", "listen", "simulate",
]
