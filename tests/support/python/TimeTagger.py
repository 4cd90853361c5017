"""A stand-in for Swabian's library: as much of its interface as a bridge uses, and a made stream.

The stream has the pulses of the pattern file SPLID_PATTERN, seen from SPLID_DISTANCE_M, on input 1,
a sync a period on input 8, tags on input 3 that nobody registered, and once a second an
overflow with 513 missed events.
"""

import json
import os
import threading

import numpy

_TAG = numpy.dtype([("type", "u1"), ("missed_events", "<u2"), ("channel", "<i4"),
                    ("time", "<i8")], align=True)
_START_PS = 340_000_000_000_000_000
_SPEED_OF_LIGHT_MPS = 299_792_458.0


class TimeTagger:
    def __init__(self):
        self.latency_ms = None
        self.delays_ps = {}

    def setStreamBlockSize(self, max_events, max_latency):
        assert 256 <= max_events <= 32_000_000 and 1 <= max_latency <= 10_000
        self.latency_ms = max_latency

    def setTriggerLevel(self, channel, voltage):
        assert isinstance(channel, int) and isinstance(voltage, float)

    def setInputDelay(self, channel, delay):
        assert isinstance(channel, int) and isinstance(delay, int)
        self.delays_ps[channel] = delay


def createTimeTagger(serial=""):
    assert isinstance(serial, str)
    return TimeTagger()


def freeTimeTagger(tagger):
    assert isinstance(tagger, TimeTagger)


class CustomMeasurement:
    """Calls process() on a thread of its own, from finalize_init() to stop()."""

    def __init__(self, tagger):
        self.mutex = threading.Lock()
        self._tagger = tagger
        self._registered = set()
        self._stopped = threading.Event()
        self._thread = None

    def register_channel(self, channel):
        self._registered.add(channel)

    def finalize_init(self):
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self):
        self._stopped.set()
        if self._thread:
            self._thread.join()

    def on_start(self):
        pass

    def on_stop(self):
        pass

    def _run(self):
        stream = _Stream(self._tagger.delays_ps, self._registered)
        step_ps = self._tagger.latency_ms * 1_000_000_000
        with self.mutex:
            self.on_start()
        begin_ps = _START_PS
        while not self._stopped.wait(self._tagger.latency_ms / 1e3):
            tags = stream.take(begin_ps, begin_ps + step_ps)
            tags.flags.writeable = False
            with self.mutex:
                self.process(tags, begin_ps, begin_ps + step_ps)
            begin_ps += step_ps
        with self.mutex:
            self.on_stop()


class _Stream:
    def __init__(self, delays_ps, registered):
        with open(os.environ["SPLID_PATTERN"], encoding="ascii") as file:
            segment = json.load(file)["segments"][0]
        self.period_ps = segment["period_ps"]
        self.pulses_ps = numpy.array(segment["pulse_times_ps"])
        self.echo_ps = 2e12 * float(os.environ["SPLID_DISTANCE_M"]) / _SPEED_OF_LIGHT_MPS
        self.delays_ps = delays_ps
        self.registered = registered
        self.random = numpy.random.default_rng(1)
        self.later = numpy.zeros(0, _TAG)
        self.period = 0

    def take(self, begin_ps, end_ps):
        made = [self.later]
        until = int((end_ps - _START_PS) / self.period_ps) + 1
        starts_ps = numpy.arange(self.period, until) * self.period_ps
        self.period = until
        pulses_ps = (starts_ps[:, None] + self.pulses_ps[None, :]).ravel()
        seen_ps = pulses_ps[self.random.random(pulses_ps.size) < 0.02]
        jitter_ps = self.random.normal(0, 100, seen_ps.size)
        made.append(self._tags(1, seen_ps + self.echo_ps + jitter_ps))
        made.append(self._tags(8, starts_ps))
        made.append(self._tags(3, starts_ps[::100] + 17))
        if (begin_ps - _START_PS) % 1_000_000_000_000 == 500_000_000_000:
            made.append(numpy.array([(2, 0, 0, begin_ps + 1000), (4, 513, 1, begin_ps + 2000),
                                     (3, 0, 0, begin_ps + 3000)], _TAG))
        tags = numpy.sort(numpy.concatenate(made), order="time")
        self.later = tags[tags["time"] >= end_ps]
        return tags[tags["time"] < end_ps].copy()

    def _tags(self, channel, since_start_ps):
        if channel != 3 and channel not in self.registered:
            return numpy.zeros(0, _TAG)
        tags = numpy.zeros(since_start_ps.size, _TAG)
        tags["channel"] = channel
        # Whole numbers before they are added: a double has no ps left at 3.4e17 ps.
        tags["time"] = numpy.rint(since_start_ps).astype(numpy.int64)
        tags["time"] += _START_PS + self.delays_ps.get(channel, 0)
        return tags
