#!/usr/bin/env python3
"""Serves tags from a text file to splid, at the pace of their times: how to write a bridge.

    file_bridge.py --listen tcp:127.0.0.1:9880 TAGS.txt

TAGS.txt has a line "TIME_PS CHANNEL" or "TIME_PS,CHANNEL" a tag, sorted by time; its first line may
name the columns. Replace read() by what your instrument's library gives: for each stretch of time the
tags in it, their channels, and up to when they are all.
"""

import argparse
import sys
import time
import warnings

import numpy

import tags16

BLOCK_PS = 2_000_000_000


def lines(file):
    """The lines of a file, without commas, a byte order mark, and a first line that names columns."""
    with open(file, encoding="utf-8-sig") as text:
        for number, line in enumerate(text):
            line = line.replace(",", " ")
            if number > 0 or not line.split("#")[0].strip(" \t\r\n-0123456789"):
                yield line


def load(file):
    """(times_ps, channels) of a file; ends the program with a sentence where they are not right."""
    warnings.simplefilter("error")  # numpy only warns of numbers that are not whole
    try:
        times_ps, channels = numpy.loadtxt(lines(file), dtype=numpy.int64, ndmin=2, unpack=True)
    except (OSError, ValueError, Warning) as error:
        what = str(error).partition(".  ")[0]
        sys.exit(f"{file}: {what}; each line must be TIME_PS CHANNEL, both whole numbers")
    back = numpy.flatnonzero(numpy.diff(times_ps) < 0)
    if len(back):
        before_ps, after_ps = times_ps[back[0]:back[0] + 2]
        sys.exit(f"{file}: tag {back[0] + 2}, at {after_ps} ps, follows a tag at {before_ps} ps; "
                 "sort the file by time, as sort -n does")
    return times_ps, channels


def read(times_ps, channels):
    """Yields (times_ps, channels, end_ps) for 2 ms after 2 ms."""
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
    tags = load(options.file)
    server = tags16.Server(options.listen)
    while server.client is None:
        time.sleep(0.01)
    start_s = time.monotonic()
    begin_ps = first_ps = None
    for times_ps, channels, end_ps in read(*tags):
        if begin_ps is None:
            begin_ps = first_ps = int(times_ps[0])
        time.sleep(max(0, start_s + (end_ps - first_ps) * 1e-12 - time.monotonic()))
        server.send(tags16.records(times_ps, channels), begin_ps, end_ps)
        begin_ps = end_ps
    server.close()


if __name__ == "__main__":
    main()
