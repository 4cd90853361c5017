"""Sends what no subscriber has to say to an endpoint of splid, until it is ended: ENDPOINT KIND."""

import os
import sys

import zmq

KINDS = {
    "long": lambda: b"\x01" + os.urandom(1000),
    "short": lambda: b"\x01" + os.urandom(3),
    "repeat": lambda: b"\x01frame",
    "unsubscribe": lambda: b"\x00" + os.urandom(3),
    "message": lambda: b"hello" * 100,
    "parts": lambda: b"x" * 1000,
}

endpoint, kind = sys.argv[1:]
socket = zmq.Context().socket(zmq.XSUB)
socket.linger = 0
socket.sndtimeo = 500
socket.connect(endpoint)
while True:
    try:
        socket.send(KINDS[kind](), zmq.SNDMORE if kind == "parts" else 0)
    except zmq.Again:
        pass
