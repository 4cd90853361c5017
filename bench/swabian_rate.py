#!/usr/bin/env python3
"""Measures how many tags a second drivers/bridge/python/swabian_bridge.py carries.

    swabian_rate.py [--seconds S] [--splid PROGRAM] [RATE...]

A stand-in for Swabian's library hands the bridge blocks of 131,072 tags: a sync each 3.78 us, a
target's photon with every other, and ambient light. Without --splid it does so as soon as the
bridge has handed on the last, and waits while 100 blocks wait in the bridge, so that no block is
dropped; the reader throws everything away. With --splid the blocks come as the tagger's clock goes
on, at each RATE (million tags a second), to a `splid run` whose frames are counted. Prints a line
of a table for each, with processor time for a tag: of the bridge (all its threads, and the
busiest; the stand-in's is in it) and of the reader. These tell what a machine would carry whose
cores no other program has.
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
PERIOD_PS = 3_780_000
ECHO_PS = 945_000


def made_block(tags_per_s):
    """Tags of so many a second, as Swabian's library lays them out, and how long they take, ps."""
    syncs = round(TAGS / tags_per_s * 1e12 / PERIOD_PS)
    block_ps = syncs * PERIOD_PS
    layout = numpy.dtype([("type", "u1"), ("missed_events", "<u2"), ("channel", "<i4"),
                          ("time", "<i8")], align=True)
    tags = numpy.zeros(TAGS, layout)
    random = numpy.random.default_rng(1)
    times, channels = tags["time"], tags["channel"]
    times[:syncs] = numpy.arange(syncs) * PERIOD_PS
    channels[:syncs] = 8
    times[syncs:] = random.integers(0, block_ps, TAGS - syncs)
    channels[syncs:] = 1
    echoes = slice(syncs, syncs + syncs // 2)
    times[echoes] = times[:2 * (syncs // 2):2] + ECHO_PS + random.normal(0, 100, syncs // 2)
    return numpy.sort(tags, order="time"), block_ps


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


def feed(bridge, seconds, tags_per_s, paced):
    """Hands blocks on until the time is over. Returns how many, and the time that it took."""
    base, block_ps = made_block(tags_per_s)
    tags = base.copy()
    begin = time.monotonic()
    blocks = 0
    while time.monotonic() - begin < seconds:
        if paced:
            time.sleep(max(0, begin + (blocks + 1) * block_ps * 1e-12 - time.monotonic()))
        while not paced and bridge.server.blocks.qsize() > 100:
            time.sleep(0.0005)
        numpy.add(base["time"], blocks * block_ps, out=tags["time"])
        bridge.process(tags, blocks * block_ps, (blocks + 1) * block_ps)
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
    pattern = {"schema": "splid.pattern", "v": [1, 0], "mode": "baseline",
               "unambiguous_delay_ps": PERIOD_PS,
               "segments": [{"period_ps": PERIOD_PS, "pulse_times_ps": [0], "amplitudes": [1],
                             "repeats": 0}]}
    (Path(folder) / "pattern.json").write_text(json.dumps(pattern), encoding="ascii")
    config = {"schema": "splid.config", "v": [1, 0],
              "source": {"driver": "bridge", "address": address},
              "channels": {"photon": [1], "sync": "8"},
              "pattern": {"file": "pattern.json"},
              "scene": {"motion": "static"},
              "estimator": {"effort": "fast"},
              "control": {"endpoint": "off"},
              "publish": {"endpoint": f"ipc://{folder}/frames"}}
    path = Path(folder) / "config.json"
    path.write_text(json.dumps(config), encoding="ascii")
    return str(path)


def measure(reader_of, folder, seconds, tags_per_s=40e6, paced=False):
    """The bridge before a reader: tags a second; ns a tag of bridge and reader, as two texts."""
    import swabian_bridge
    import tags16
    address = f"unix:{folder}/{tags_per_s / 1e6:.0f}.sock"
    bridge = swabian_bridge.Bridge(None, [1, 8], tags16.Server(address))
    reader = reader_of(address)
    try:
        while bridge.server.client is None:
            time.sleep(0.01)
        time.sleep(1)  # until who listens to its frames is there
        before = thread_ns(os.getpid()), thread_ns(reader.pid)
        blocks, took_s = feed(bridge, seconds, tags_per_s, paced)
        after = thread_ns(os.getpid()), thread_ns(reader.pid)
    finally:
        reader.send_signal(signal.SIGTERM)
        reader.wait()
    tags = blocks * TAGS
    spent = [[(now - then.get(task, 0)) / tags for task, now in later.items()]
             for then, later in zip(before, after)]
    return tags / took_s, *(f"{sum(each):.1f}, {max(each):.1f}" for each in spent)


def measure_frames(program, folder, seconds, tags_per_s):
    """A line of the table: the bridge before a `splid run`, and what it made of the tags."""
    with open(Path(folder) / "frames.txt", "w+", encoding="utf-8") as text:
        listener = subprocess.Popen([program, "listen", "--json", "-e", f"ipc://{folder}/frames"],
                                    stdout=text)
        carried, bridge_ns, splid_ns = measure(
            lambda address: subprocess.Popen([program, "run", "--config",
                                              splid_config(folder, address)]),
            folder, seconds, tags_per_s, paced=True)
        listener.send_signal(signal.SIGINT)
        listener.wait()
        text.seek(0)
        frames = [json.loads(line) for line in text]
    frames = frames[:-1]  # the last ends with the stream
    bad = sum(frame["status"] != "ok" for frame in frames)
    lost = sum(frame.get("lost_tags") or 0 for frame in frames)
    unseen_ms = sum((1 - frame.get("seen_fraction", 1)) * frame["duration_ms"] for frame in frames)
    print(f"| {tags_per_s / 1e6:.0f} | {carried / 1e6:.1f} | {len(frames)} of {seconds * 20:.0f} | "
          f"{lost} tags, {unseen_ms:.1f} ms, {bad} of {len(frames)} frames | "
          f"{bridge_ns} | {splid_ns} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=float, default=5)
    parser.add_argument("--splid", help="the program, to measure with it")
    parser.add_argument("rates", nargs="*", type=float, default=[40], metavar="RATE")
    options = parser.parse_args()
    library = types.ModuleType("TimeTagger")
    library.CustomMeasurement = CustomMeasurement
    sys.modules["TimeTagger"] = library
    sys.path.insert(0, str(ROOT / "drivers/bridge/python"))
    with tempfile.TemporaryDirectory() as folder:
        if not options.splid:
            print("| reader | tags a second | bridge, its busiest thread: ns a tag "
                  "| reader: ns a tag |\n|---|---|---|---|")
            rate, bridge_ns, reader_ns = measure(
                lambda address: subprocess.Popen([sys.executable, "-c", READER, address[5:]]),
                folder, options.seconds)
            print(f"| discards | {rate / 1e6:.1f} M | {bridge_ns} | {reader_ns.split(',')[0]} |")
            return
        print("| M tags/s of the clock | of the bridge | frames | lost: tags counted, time unseen, "
              "frames of no use | bridge, ns a tag: all, busiest thread | splid run |\n"
              "|---|---|---|---|---|---|")
        for rate in options.rates:
            measure_frames(options.splid, folder, options.seconds, rate * 1e6)


if __name__ == "__main__":
    main()
