"""The picture of a T3 scan by a reader of its own, and how it differs from splid's table of frames.

    scan_picture.py SCAN.ptu FRAMES.csv    prints JSON

The rules are those of PicoQuant's format: a marker's number n in the header is the bit n - 1, the
times of a line are numbers of syncs, and a photon is in pixel (time - start) * PixX / (stop - start)
of its line. PixY is not used.
"""

import csv
import json
import struct
import sys

import numpy as np

PAYLOADS = {0x2001FFFF, 0x4001FFFF, 0x4002FFFF, 0xFFFFFFFF}


def header(data):
    facts, at = {}, 16
    while True:
        name = data[at:at + 32].split(b"\0")[0].decode()
        kind, = struct.unpack_from("<I", data, at + 36)
        value, = struct.unpack_from("<q", data, at + 40)
        at += 48 + (value if kind in PAYLOADS else 0)
        if name == "Header_End":
            return facts, at
        facts.setdefault(name, value)


def pico_harp(records):
    """Times in syncs, which records are photons, and the marker bits of each."""
    channel, time = records >> 28, (records & 0xFFFF).astype(np.int64)
    dtime = (records >> 16) & 0xFFF
    special = channel == 15
    overflow = special & ((dtime & 0xF) == 0)
    time += 65536 * np.cumsum(overflow)
    return time, ~special, np.where(special & ~overflow, dtime & 0xF, 0)


def picture(data):
    facts, at = header(data)
    assert facts["TTResultFormat_TTTRRecType"] == 0x00010303
    time, photon, marker = pico_harp(np.frombuffer(data, "<u4", offset=at))
    bits = {key: 1 << (facts[f"ImgHdr_{key}"] - 1) for key in ("LineStart", "LineStop")}
    starts = time[marker & bits["LineStart"] != 0]
    stops = time[marker & bits["LineStop"] != 0]
    photons, width, lines = time[photon], facts["ImgHdr_PixX"], []
    for start, after in zip(starts, np.append(starts[1:], np.iinfo(np.int64).max)):
        stop = stops[(stops > start) & (stops <= after)]
        if len(stop):
            inside = photons[(photons >= start) & (photons < stop[0])]
            lines.append(np.bincount((inside - start) * width // (stop[0] - start),
                                     minlength=width))
    return np.array(lines), len(photons)


def splids(file):
    with open(file, newline="", encoding="utf-8") as text:
        rows = [(int(r["scan_line"]), int(r["scan_column"]), int(r["photons"]))
                for r in csv.DictReader(text)]
    line, column, photons = np.array(rows).T
    seen = np.zeros((line.max() + 1, column.max() + 1), np.int64)
    np.add.at(seen, (line, column), photons)
    return seen, len(rows)


def main():
    with open(sys.argv[1], "rb") as file:
        theirs, photons = picture(file.read())
    ours, frames = splids(sys.argv[2])
    print(json.dumps({
        "photons": photons, "in_lines": int(theirs.sum()), "shape": theirs.shape, "frames": frames,
        "brightest": int(theirs.max()),
        "different": int(np.sum(ours != theirs)) if ours.shape == theirs.shape else -1}))


main()
