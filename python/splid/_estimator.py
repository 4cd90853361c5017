"""One frame at a time, from its photons to its estimate."""

from typing import Any, Optional, Sequence

import numpy as np
import numpy.typing as npt

from splid import _splid
from splid._config import AnyConfig, bound_config
from splid._log import told

_NO_LOSSES = np.empty((0, 3), dtype=np.int64)
_NO_TIMES = np.empty(0, dtype=np.int64)


class Estimator:
    """Estimates one frame after the other, by the pattern, pulse, scene, detector and
    estimator of a configuration.

    The same frame gives the same estimate, to the last bit, whatever was estimated before. In
    splid.frames() the fit of the pattern's clock begins at the period of the frame before, so that
    its values of the same frame differ from these in their last digits (by less than a millionth
    of a deviation), and more with estimator.tracked: here no frame follows another. One call at a time uses
    an estimator; other threads wait. Source: docs/estimation.md; [P] Eq. 4, 7, 19 and 20.

    Errors: UsageError where the pattern and the options do not fit together.
    """

    def __init__(self, config: AnyConfig) -> None:
        with told():
            self._bound = _splid.Estimator(bound_config(config))

    def estimate(self, photons_ps: npt.NDArray[np.int64], syncs_ps: npt.NDArray[np.int64],
                 start_ps: Optional[int] = None, end_ps: Optional[int] = None,
                 losses: Optional[npt.ArrayLike] = None,
                 before_ps: npt.NDArray[np.int64] = _NO_TIMES,
                 photons_of_input: Sequence[int] = ()) -> _splid.Estimate:
        """Estimates a frame of the tags in [start_ps, end_ps), all in ps of the tagger's clock.

        photons_ps: shape (n,), in any order. syncs_ps: shape (m,), nearly sorted; one a pattern
        period. Both are contiguous arrays of int64, and are not copied. start_ps, end_ps: by
        default from the first sync to one period after the last, which leaves out photons before
        and after; the frame should be a whole number of pattern periods. losses: rows of begin_ps,
        end_ps and count, sorted, in the frame. before_ps: the photons of a few dead times before
        the frame, after which its detector may still be dead. photons_of_input: how many photons
        came on each input that shares the light, in any order; without it the light is taken as
        shared evenly. Both count where detector.dead_time is modelled.

        Errors: TypeError for arrays of another type; UsageError for tags outside of bounds that
        were given, and where fewer than two syncs leave the bounds open.
        """
        if start_ps is None or end_ps is None:
            first, end = _bounds(syncs_ps)
            start_ps = first if start_ps is None else start_ps
            end_ps = end if end_ps is None else end_ps
            photons_ps = _inside(photons_ps, start_ps, end_ps)
            syncs_ps = _inside(syncs_ps, start_ps, end_ps)
        rows = _NO_LOSSES if losses is None else np.ascontiguousarray(losses, dtype=np.int64)
        return self._bound.estimate(photons_ps, syncs_ps, start_ps, end_ps, rows, before_ps,
                                    photons_of_input)


def _bounds(syncs_ps: npt.NDArray[np.int64]) -> tuple[int, int]:
    if len(syncs_ps) < 2:
        raise _splid.UsageError(
            f"syncs_ps: has {len(syncs_ps)} syncs, and two are needed to tell where the frame is; "
            "give start_ps and end_ps")
    first, last = int(np.min(syncs_ps)), int(np.max(syncs_ps))
    period = float(np.median(np.diff(np.sort(syncs_ps))))
    return first, last + round(period)


def _inside(times_ps: npt.NDArray[Any], start_ps: int, end_ps: int) -> npt.NDArray[Any]:
    inside = (times_ps >= start_ps) & (times_ps < end_ps)
    return times_ps if inside.all() else times_ps[inside]
