"""Publishes two days' worth of frames, 20 a second of their own time, as fast as a subscriber reads.

    two_days.py ENDPOINT

Nothing is dropped: it waits for a subscriber that is behind.
"""
import json
import math
import sys

import zmq

FRAMES = 2 * 86_400 * 20

socket = zmq.Context().socket(zmq.XPUB)
socket.setsockopt(zmq.XPUB_NODROP, 1)
socket.setsockopt(zmq.SNDHWM, 1000)
socket.bind(sys.argv[1])
while b"frame" not in socket.recv():
    pass
for i in range(FRAMES):
    frame = {"schema": "splid.frame", "v": [1, 0], "timestamp": 1790000000 + 0.05 * i, "sequence": i,
             "status": "ok" if i % 50 else "no_target", "valid": i % 50 != 0, "mode": "interleaved",
             "start_ps": str(50_000_000_000 * i), "duration_ms": 50}
    if frame["valid"]:
        frame.update(distance_m=284 + math.sin(1e-3 * i), velocity_mps=1e-3 * math.cos(1e-3 * i),
                     signal_per_pulse=0.00135, background_per_s=175000, sbr=0.08, photons=9470,
                     std={"distance_m": 6e-4, "velocity_mps": 0.04})
    socket.send_multipart([b"frame", json.dumps(frame).encode()])
socket.close()
socket.context.term()
