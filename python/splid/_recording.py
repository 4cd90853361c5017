"""Recordings: what their header says, and their tags."""

import enum
import json
import os
from collections.abc import Iterator
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._arguments import path_of
from splid._log import told
from splid._pattern import Pattern

TAG: np.dtype[Any] = _splid.tag_type()
"""A tag: time_ps (64-bit, tagger's clock), value (32-bit), kind (8-bit, a Kind), three zeros."""


class Kind(enum.IntEnum):
    """What a tag stands for, and what its value is."""

    PHOTON = 0  # the input, as the record numbers it
    SYNC = 1
    MARKER = 2  # the marker bits, 1 to 15
    HEARTBEAT = 3  # no event: the clock has reached time_ps
    LOSS_BEGIN = 4  # from here on, tags may be missing
    LOSS_END = 5  # how many were missing up to here; -1: not known
    MISSED = 6  # how many are missing near here
    CLOCK_BREAK = 7  # the tagger's clock was set anew


class Recording:
    """A recording, however large: it is read in pieces, as they are asked for.

    Errors: DataError with the file and the byte offset, here and from every method.
    """

    def __init__(self, file: "os.PathLike[str] | str") -> None:
        """Reads the header."""
        self.file = path_of("file", file)
        with told():
            self._facts = _splid.Reader(self.file, 0).facts()

    @property
    def header(self) -> dict[str, Any]:
        """All entries of the header by their name; one of several has its index behind it: Name(0).
        """
        header: dict[str, Any] = self._facts["header"]
        return header

    @property
    def is_t3(self) -> bool:
        """Whether times are counted from the last sync, in T3 mode."""
        is_t3: bool = self._facts["is_t3"]
        return is_t3

    @property
    def format(self) -> str:
        """What the file is, in words: "a PTU recording"."""
        format: str = self._facts["format"]
        return format

    @property
    def record_type(self) -> Optional[int]:
        """The header's TTResultFormat_TTTRRecType; None of formats that are not PicoQuant's."""
        record_type: Optional[int] = self._facts["record_type"]
        return record_type

    @property
    def resolution_s(self) -> float:
        """Seconds a time unit of the records; of T3, a unit of the time since the last sync."""
        resolution_s: float = self._facts["resolution_s"]
        return resolution_s

    @property
    def created_unix_s(self) -> Optional[float]:
        """UTC at time 0 of the records; None where the header does not say."""
        created_unix_s: Optional[float] = self._facts["created_unix_s"]
        return created_unix_s

    @property
    def start_unix_s(self) -> Optional[float]:
        """UTC at time 0 of the tags, the tagger's clock; None where the header does not say."""
        created = self.created_unix_s
        return None if created is None else created - float(self._facts["origin_ps"]) * 1e-12

    @property
    def losses(self) -> npt.NDArray[np.int64]:
        """The losses that the header lists: rows of begin_ps, end_ps and count (-1: not known)."""
        return np.array(self._facts["losses"], dtype=np.int64).reshape(-1, 3)

    @property
    def pattern(self) -> Optional[Pattern]:
        """The pattern that was configured while splid recorded; None in recordings of other
        programs.
        """
        text = self._facts["pattern_json"]
        return Pattern.from_json(text, self.file) if text else None

    @property
    def config(self) -> Optional[dict[str, Any]]:
        """The configuration in effect while splid recorded; None in recordings of other programs.
        """
        text = self._facts["config_json"]
        config: Optional[dict[str, Any]] = json.loads(text) if text else None
        return config

    def scan(self, max_tags: int = 0) -> dict[str, Any]:
        """Counts what the recording holds, up to its end or, after max_tags tags, up to about
        there.

        Returns photons (by input) and markers (by their bits) as dicts of counts, syncs, records,
        unknown_records, saturated_photons, first_ps and last_ps (None: no tags), steps_back,
        longest_step_back_ps, whole (read to the end) and warnings.
        """
        with told():
            return _splid.scan(self.file, max_tags)

    def tags(self, chunk: int = 1 << 20, period_ps: float = 0) -> Iterator[npt.NDArray[Any]]:
        """Iterates over the tags in the file's order, as arrays of TAG of at most `chunk` tags.

        Each array is new memory of 16 bytes a tag, into which the records are decoded. period_ps:
        of a T3 recording, the pattern period by which its syncs become times; 0: the
        period that the header has. Losses are not among them: see `losses`.
        """
        if chunk < 1:
            raise ValueError(f"chunk: {chunk} tags were asked for; give 1 or more")
        with told():
            reader = _splid.Reader(self.file, period_ps)
        while True:
            block = np.empty(chunk, TAG)
            with told():
                count = reader.read(block)
            if count == 0:
                return
            yield block[:count]

    def __repr__(self) -> str:
        return f"splid.Recording({self.file!r})"

