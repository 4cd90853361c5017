"""Simulated scenes."""

import dataclasses
import os
import pathlib
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._arguments import path_of
from splid._config import AnyConfig, bound_config
from splid._log import told


class Truth:
    """Where a simulated target really was, and the constants of its scene.

    Truth("scene.truth.json") reads what `splid simulate` writes beside a recording.
    """

    def __init__(self, file: "os.PathLike[str] | str") -> None:
        """Errors: OSError; DataError naming the member that is missing or wrong."""
        text = pathlib.Path(path_of("file", file)).read_text(encoding="utf-8")
        self._bound = _splid.Truth.from_json(text)

    @classmethod
    def _of(cls, bound: _splid.Truth) -> "Truth":
        truth = cls.__new__(cls)
        truth._bound = bound
        return truth

    def at(self, times_ps: npt.ArrayLike
           ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """The distance (m) and the velocity (m/s, positive away) at times of the tagger's clock.

        times_ps: integers, shape (n,) or one. Both arrays have that shape, with NaN outside of the
        scene. Of a row of FRAME mid-frame is start_ps + duration_ms * 0.5e9.
        """
        times = np.ascontiguousarray(times_ps)
        if times.dtype.kind not in "iu":
            raise TypeError(f"times_ps: {times.dtype} was given, but whole ps are expected")
        shape = np.shape(times_ps)
        distance_m, velocity_mps = self._bound.at(times.astype(np.int64).reshape(-1))
        return distance_m.reshape(shape), velocity_mps.reshape(shape)

    @property
    def signal_per_pulse(self) -> float:
        """Mean detections of a pulse of amplitude 1."""
        return self._bound.signal_per_pulse

    @property
    def background_per_s(self) -> float:
        """Mean background and dark counts a second."""
        return self._bound.background_per_s

    @property
    def sigma_ps(self) -> float:
        """The gaussian part of a detection's time, one standard deviation."""
        return self._bound.sigma_ps

    @property
    def electronic_delay_ns(self) -> float:
        """A lidar without range offset reads c/2 times this more than the distance."""
        return self._bound.electronic_delay_ns

    @property
    def drift_ppm(self) -> float:
        """The drift of the pattern's clock at the stream's start."""
        return self._bound.drift_ppm


@dataclasses.dataclass(frozen=True)
class Scene:
    """A simulated stream: tags (an array of TAG in stream order), its truth, and UTC at device time
    0.
    """

    tags: npt.NDArray[Any]
    truth: Truth
    start_unix_s: Optional[float]


def simulate(config: AnyConfig, seconds: float, seed: Optional[int] = None) -> Scene:
    """Plays the scene of a configuration with the driver "simulator" into memory, 16 bytes a tag.

    seconds: length of the stream, above 0. seed: another seed, other photons; None: the configured
    one. The same scene and seed give the same tags on every machine. `splid simulate` writes the
    same scene to a recording, which may be larger than memory.

    Errors: UsageError for another driver, and for values out of bounds.
    """
    if not 0 < seconds < float("inf"):
        raise _splid.UsageError(f"seconds: {seconds} was given, but a number above 0 is expected")
    with told():
        tags, truth, start_unix_s = _splid.simulate(bound_config(config), seconds, seed)
    return Scene(tags, Truth._of(truth), start_unix_s)
