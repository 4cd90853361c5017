#!/usr/bin/env python3
"""Serves the tags of a Swabian Time Tagger (20, Ultra, X) to splid.

    swabian_bridge.py --listen unix:/run/splid/bridge.sock 1:0.5 8:0.25:1855000

opens inputs 1 and 8 with thresholds of 0.5 and 0.25 V, the second delayed by 1855 ns. Needs the
vendor's library (the Python module TimeTagger) and numpy; docs/guide/instruments/swabian.md has the
wiring.
"""

import argparse
import signal

import numpy
import TimeTagger

import tags16

# A call every 2 ms, or sooner when so many tags came: splid wants a block every 10 ms.
BLOCK_TAGS = 131072
LATENCY_MS = 2


class Bridge(TimeTagger.CustomMeasurement):
    """Hands on what the library hands out, on the library's own thread."""

    def __init__(self, tagger, channels, server):
        super().__init__(tagger)
        self.server = server
        for channel in channels:
            self.register_channel(channel)
        self.clear_impl()
        self.finalize_init()

    def __del__(self):
        self.stop()

    def clear_impl(self):
        self.reached_ps = None

    def on_start(self):
        self.reached_ps = None

    def process(self, incoming_tags, begin_time, end_time):
        # A tag of the library is laid out as a record. Its 16 bytes are copied as one number:
        # member by member it takes ten times as long. All go along: splid passes over those of
        # other inputs.
        tags = incoming_tags.view(numpy.complex128).copy().view(tags16.RECORD)
        # The library marks what it lost with tags of types 2 to 4, so nothing is between calls.
        begin_ps = begin_time if self.reached_ps is None else self.reached_ps
        self.server.send(tags, begin_ps, end_time)
        self.reached_ps = end_time


def channel(text):
    """CHANNEL[:THRESHOLD_V[:DELAY_PS]]"""
    number, level_v, delay_ps = (text.split(":") + [None, None])[:3]
    return int(number), level_v and float(level_v), delay_ps and int(delay_ps)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--listen", required=True, help="unix:PATH or tcp:HOST:PORT")
    parser.add_argument("--serial", default="", help="of the tagger; else any")
    parser.add_argument("channels", nargs="+", type=channel, metavar="CHANNEL[:VOLT[:DELAY_PS]]",
                        help="input, negative for its falling edge; threshold; delay")
    options = parser.parse_args()
    tagger = TimeTagger.createTimeTagger(options.serial)
    tagger.setStreamBlockSize(BLOCK_TAGS, LATENCY_MS)
    # No setConditionalFilter: it passes the first sync after a photon and drops all others, while
    # the pattern's clock is measured by its syncs, and a delay counts from the sync before it.
    for number, level_v, delay_ps in options.channels:
        if level_v is not None:
            tagger.setTriggerLevel(number, level_v)
        if delay_ps is not None:
            tagger.setInputDelay(number, delay_ps)
    server = tags16.Server(options.listen)
    bridge = Bridge(tagger, [number for number, _, _ in options.channels], server)
    signal.sigwait({signal.SIGINT, signal.SIGTERM})
    bridge.stop()
    TimeTagger.freeTimeTagger(tagger)


if __name__ == "__main__":
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    main()
