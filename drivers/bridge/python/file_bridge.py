#!/usr/bin/env python3
"""Serves tags from a text file to splid, at the pace of their times: how to write a bridge.

    file_bridge.py --listen tcp:127.0.0.1:9880 TAGS.txt

TAGS.txt has a line "TIME_PS CHANNEL" a tag, sorted by time. Replace read() by what your instrument's
library gives: for each stretch of time the tags in it, their channels, and up to when they are all.
"""

import argparse
import time

import numpy

import tags16

BLOCK_PS = 2_000_000_000


def read(file):
    """Yields (times_ps, channels, end_ps) for 2 ms after 2 ms."""
    times_ps, channels = numpy.loadtxt(file, dtype=numpy.int64, ndmin=2, unpack=True)
    begin_ps = times_ps[0]
    while begin_ps <= times_ps[-1]:
        end_ps = begin_ps + BLOCK_PS
        part = slice(*numpy.searchsorted(times_ps, [begin_ps, end_ps]))
        yield times_ps[part], channels[part], int(end_ps)
        begin_ps = end_ps


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--listen", required=True, help="unix:PATH or tcp:HOST:PORT")
    parser.add_argument("file")
    options = parser.parse_args()
    server = tags16.Server(options.listen)
    while server.client is None:
        time.sleep(0.01)
    start_s = time.monotonic()
    begin_ps = first_ps = None
    for times_ps, channels, end_ps in read(options.file):
        if begin_ps is None:
            begin_ps = first_ps = int(times_ps[0])
        time.sleep(max(0, start_s + (end_ps - first_ps) * 1e-12 - time.monotonic()))
        server.send(tags16.records(times_ps, channels), begin_ps, end_ps)
        begin_ps = end_ps
    server.close()


if __name__ == "__main__":
    main()
