"""An instrument for the checks of the live page, until it is killed: a target at 100 m that returns a
photon in each pattern period, of one pulse after the other.

    instrument.py ADDRESS    as source.address of a bridge
"""
import json
import os
import sys
import time

import numpy

sys.path.insert(0, os.path.join(os.environ["SPLID_SOURCE"], "drivers/bridge/python"))
import tags16

PERIOD_PS = 3_780_000
PERIODS = 5000  # in a block of 19 ms

server = tags16.Server(sys.argv[1])
while server.client is None:
    time.sleep(0.01)
with open(os.path.join(os.environ["SPLID_SOURCE"], "config/patterns/interleaved-180-189.json")) as file:
    pulses_ps = numpy.array(json.load(file)["segments"][0]["pulse_times_ps"]).astype(numpy.int64)
syncs_ps = PERIOD_PS * numpy.arange(PERIODS, dtype=numpy.int64)
lags_ps = (pulses_ps[numpy.arange(PERIODS) % len(pulses_ps)] + 667_128) % PERIOD_PS
times_ps = numpy.stack([syncs_ps, syncs_ps + lags_ps], axis=1).ravel()
channels = numpy.tile(numpy.array([8, 1], dtype=numpy.int64), PERIODS)
begin_ps = 0
start_s = time.monotonic()
while True:
    end_ps = begin_ps + PERIODS * PERIOD_PS
    time.sleep(max(0, start_s + end_ps * 1e-12 - time.monotonic()))
    server.send(tags16.records(begin_ps + times_ps, channels), begin_ps, end_ps)
    begin_ps = end_ps
