"""Recordings and tags measured, as tables of frames."""

import os
import time
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._arguments import path_of
from splid._config import AnyConfig, bound_config
from splid._log import told
from splid._recording import TAG, Recording

if TYPE_CHECKING:
    import pandas
    import xarray

    _Rows = np.recarray[Any, np.dtype[Any]]
else:
    _Rows = np.recarray

_COLUMNS: np.dtype[Any] = _splid.frame_type()


def _with_text(name: str) -> tuple[str, str]:
    kind = _COLUMNS[name]
    return name, f"U{kind.itemsize}" if kind.kind == "S" else kind.str


FRAME: np.dtype[Any] = np.dtype([("time", "M8[ns]")] + [_with_text(n) for n in _COLUMNS.names or ()])
"""A frame: its time (UTC at mid-frame), and the columns of docs/reference/tables.md in their order.
"""

UNITS: dict[str, str] = {"time": "", **_splid.frame_units()}
"""The unit of each column; empty where a column has none."""


class Frames(_Rows):
    """Frames in order, one a row: an array of numpy whose columns are also attributes.

    frames.distance_m is frames["distance_m"]; frames[frames.status == "ok"] are Frames again. A
    number that is not known is NaN, a whole number -1, a text empty. UNITS has the units.
    """

    @classmethod
    def of_columns(cls, columns: npt.NDArray[Any]) -> "Frames":
        """From rows with columns of FRAME; those that are missing are 0 or empty."""
        rows = np.zeros(len(columns), FRAME)
        for name in columns.dtype.names or ():
            if name in _COLUMNS.fields:  # type: ignore[operator]  # it has fields
                rows[name] = columns[name]
        microseconds = np.rint(rows["timestamp"] * 1e6)  # as good as a double of this size
        rows["time"] = microseconds.astype("M8[us]").astype("M8[ns]")
        frames: Frames = rows.view((np.record, FRAME)).view(cls)
        return frames

    def to_pandas(self) -> "pandas.DataFrame":
        """A data frame with these columns. Errors: ImportError without pandas."""
        try:
            import pandas
        except ImportError as lacking:
            raise ImportError(f"to_pandas: {lacking}; on Debian it is python3-pandas") from lacking
        return pandas.DataFrame({name: np.asarray(self[name]) for name in self.dtype.names or ()})

    def to_xarray(self) -> "xarray.Dataset":
        """A data set along "time", each variable with its unit. Errors: ImportError without xarray.
        """
        try:
            import xarray
        except ImportError as lacking:
            raise ImportError(f"to_xarray: {lacking}; on Debian it is python3-xarray") from lacking
        return xarray.Dataset(
            {name: ("time", np.asarray(self[name]), {"units": unit} if unit else {})
             for name, unit in UNITS.items() if name != "time"},
            {"time": np.asarray(self["time"])})

    def __repr__(self) -> str:
        # Fields of one row, and what numpy derives, are other arrays.
        if self.dtype.names != FRAME.names or self.ndim != 1:
            return repr(np.asarray(self))
        if len(self) == 0:
            return "<splid.Frames: none>"
        pixels = len(np.unique(self["pixel"]))
        seconds = float(np.sum(self["duration_ms"])) * 1e-3 / pixels
        valid = int(np.sum(self["valid"]))
        of_pixels = f" of {pixels} pixels" if pixels > 1 else ""
        return (f"<splid.Frames: {len(self)} frames{of_pixels}, {seconds:.6g} s from "
                f"{self['time'][0].astype('M8[s]')}Z, {valid} valid>")

    __str__ = __repr__


def frames(recording: "Union[Recording, os.PathLike[str], str, npt.NDArray[Any]]",
           config: AnyConfig, *, encoder: "Union[os.PathLike[str], str]" = "",
           start_unix_s: Optional[float] = None) -> Frames:
    """Measures a recording, or an array of TAG, and returns the table of its frames: of several
    pixels a row for each, named in the column pixel.

    Every value is what `splid replay --json` prints, to the last bit, but for compute_ms and
    latency_ms, which are times of this run. Distance (m), velocity (m/s) and their deviations are
    at mid-frame.

    config: its source is not used. It decides how many threads estimate
    (pipeline.estimation_threads). encoder: a file of an encoder's counts; by default the file
    beside the recording, or the configured file. start_unix_s: of an array, UTC at its tags' time
    0, for the columns time and timestamp; None: the first tag came now.

    The recording may be larger than memory; the table takes less than 1 kB a frame.

    Errors: those of Config and Recording; DataError where no frame could lock although syncs came,
    with the period that the syncs have. KeyboardInterrupt ends the measurement.
    """
    bound = bound_config(config)
    with told():
        if isinstance(recording, np.ndarray):
            if encoder:
                raise ValueError("encoder: an array of tags has no counts to be joined with"
                                 "; give the recording's file")
            if start_unix_s is None and recording.dtype == TAG and recording.size > 0:
                start_unix_s = time.time() - 1e-12 * float(recording["time_ps"].flat[0])
            return Frames.of_columns(_splid.frames_of_tags(bound, recording, start_unix_s))
        file = (recording.file if isinstance(recording, Recording)
                else path_of("recording", recording, ", a Recording or an array of TAG"))
        return Frames.of_columns(
            _splid.frames_of_file(bound, file, path_of("encoder", encoder) if encoder else ""))
