#!/usr/bin/env python3
"""Measures how many tags a second drivers/bridge/python/swabian_bridge.py carries.

    swabian_rate.py [--seconds S] [--splid PROGRAM]

A stand-in for Swabian's library hands the bridge blocks of 131,072 tags, photons at random times and
a sync each 3.78 us, as soon as the bridge has handed on the last; it waits while 100 blocks wait in
the bridge, so that no block is dropped. The bridge serves a reader that throws everything away, and
with --splid a `splid run`. Prints a line of a table for each: tags a second, and processor time of the
bridge (all its threads, and the busiest) and of the reader for a tag. The processor times tell what a
machine would carry whose cores no other program has.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import types
from pathlib import Path

import numpy

ROOT = Path(__file__).resolve().parent.parent
TAGS = 131072
TAGS_PER_S = 40e6
PERIOD_PS = 3_780_000
BLOCK_PS = round(TAGS / TAGS_PER_S * 1e12 / PERIOD_PS) * PERIOD_PS


def made_block():
    """Tags of 40 million a second, as Swabian's library lays them out."""
    layout = numpy.dtype([("type", "u1"), ("missed_events", "<u2"), ("channel", "<i4"),
                          ("time", "<i8")], align=True)
    tags = numpy.zeros(TAGS, layout)
    syncs = BLOCK_PS // PERIOD_PS
    tags["time"][:syncs] = numpy.arange(syncs) * PERIOD_PS
    tags["channel"][:syncs] = 8
    tags["time"][syncs:] = numpy.random.default_rng(1).integers(0, BLOCK_PS, TAGS - syncs)
    tags["channel"][syncs:] = 1
    return numpy.sort(tags, order="time")


class CustomMeasurement:
    def __init__(self, tagger):
        pass

    def register_channel(self, channel):
        pass

    def finalize_init(self):
        pass

    def stop(self):
        pass


def thread_ns(process):
    """Processor time that each thread of a process took so far."""
    times = {}
    for task in Path(f"/proc/{process}/task").iterdir():
        times[task.name] = int((task / "schedstat").read_text(encoding="ascii").split()[0])
    return times


def feed(bridge, seconds):
    """Hands blocks on until the time is over. Returns how many, and the time that it took."""
    base, tags = made_block(), made_block()
    begin = time.monotonic()
    blocks = 0
    while time.monotonic() - begin < seconds:
        while bridge.server.blocks.qsize() > 100:
            time.sleep(0.0005)
        numpy.add(base["time"], blocks * BLOCK_PS, out=tags["time"])
        bridge.process(tags, blocks * BLOCK_PS, (blocks + 1) * BLOCK_PS)
        blocks += 1
    bridge.server.blocks.join()
    return blocks, time.monotonic() - begin


READER = """
import socket, sys
link = socket.socket(socket.AF_UNIX)
link.connect(sys.argv[1])
room = bytearray(1 << 20)
while link.recv_into(room):
    pass
"""


def splid_config(folder, address):
    config = {"schema": "splid.config", "v": [1, 0],
              "source": {"driver": "bridge", "address": address},
              "channels": {"photon": [1], "sync": "8"},
              "pattern": {"file": str(ROOT / "config/patterns/interleaved-180-189.json")},
              "estimator": {"effort": "fast"},
              "publish": {"endpoint": f"ipc://{folder}/frames"}}
    path = Path(folder) / "config.json"
    path.write_text(json.dumps(config), encoding="ascii")
    return str(path)


def measure(name, command, folder, seconds):
    """One line of the table: the bridge before a reader, which the command starts."""
    import swabian_bridge
    import tags16
    address = f"unix:{folder}/{name}.sock"
    bridge = swabian_bridge.Bridge(None, [1, 8], tags16.Server(address))
    reader = subprocess.Popen(command(address), stdout=subprocess.DEVNULL)
    try:
        while bridge.server.client is None:
            time.sleep(0.01)
        before = thread_ns(os.getpid()), thread_ns(reader.pid)
        blocks, took_s = feed(bridge, seconds)
        after = thread_ns(os.getpid()), thread_ns(reader.pid)
    finally:
        reader.send_signal(signal.SIGTERM)
        reader.wait()
    tags = blocks * TAGS
    spent = [[(now - then.get(task, 0)) / tags for task, now in later.items()]
             for then, later in zip(before, after)]
    print(f"| {name} | {tags / took_s / 1e6:.1f} M | {sum(spent[0]):.1f}, {max(spent[0]):.1f} | "
          f"{sum(spent[1]):.1f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--splid", help="the program, to measure with it too")
    options = parser.parse_args()
    library = types.ModuleType("TimeTagger")
    library.CustomMeasurement = CustomMeasurement
    sys.modules["TimeTagger"] = library
    sys.path.insert(0, str(ROOT / "drivers/bridge/python"))
    print("| reader | tags a second | bridge, its busiest thread: ns a tag | reader: ns a tag |")
    print("|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        measure("discards", lambda address: [sys.executable, "-c", READER, address[5:]], folder,
                options.seconds)
        if options.splid:
            measure("splid", lambda address: [options.splid, "run", "--config",
                                              splid_config(folder, address)], folder,
                    options.seconds)


if __name__ == "__main__":
    main()
