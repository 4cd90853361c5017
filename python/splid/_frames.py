"""Recordings and tags measured, as tables of frames."""

import os
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._config import AnyConfig, bound_config
from splid._log import told
from splid._recording import Recording

FRAME: np.dtype[Any] = _splid.frame_type()
"""A frame: the columns of docs/reference/tables.md in their order, without gaps between them."""

UNITS: dict[str, str] = _splid.frame_units()
"""The unit of each column; empty where a column has none."""


def frames(recording: "Union[Recording, os.PathLike[str], str, npt.NDArray[Any]]",
           config: AnyConfig, *, encoder: "Union[os.PathLike[str], str]" = "",
           start_unix_s: Optional[float] = None) -> npt.NDArray[Any]:
    """Measures a recording, or an array of TAG, and returns one row of FRAME for each frame, in
    order.

    Every value is what `splid replay --json` prints, to the last bit, but for compute_ms and
    latency_ms, which are times of this run. A number that is not known is NaN, a whole number
    -1, a text empty; texts are bytes of ASCII (b"ok"). Distance (m), velocity (m/s) and their
    deviations are at mid-frame; UNITS has the unit of every column.

    config: its source is not used. It decides how many threads estimate
    (pipeline.estimation_threads). encoder: a file of an encoder's counts; by default the file
    beside the recording, or the configured file. start_unix_s: of an array, UTC at its tags' time
    0, for the column timestamp; None: the time of now.

    The recording may be larger than memory; the table takes less than 500 bytes a frame.

    Errors: those of Config and Recording; DataError where no frame could lock although syncs came,
    with the period that the syncs have. KeyboardInterrupt ends the measurement.
    """
    bound = bound_config(config)
    with told():
        if isinstance(recording, np.ndarray):
            if encoder:
                raise ValueError("encoder: an array of tags has no counts to be joined with"
                                 "; give the recording's file")
            return _splid.frames_of_tags(bound, recording, start_unix_s)
        file = recording.file if isinstance(recording, Recording) else os.fspath(recording)
        return _splid.frames_of_file(bound, file, os.fspath(encoder))
