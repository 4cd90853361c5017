"""Serves tags16 blocks (docs/reference/tags16.md) to splid; what every bridge needs.

A bridge makes a Server and calls send() for each stretch of the tagger's time. Needs Python 3.9 or
later and numpy.
"""

import contextlib
import os
import queue
import socket
import struct
import threading

import numpy

# A record of a block. The names are those of Swabian's arrays.
RECORD = numpy.dtype([("type", "<u1"), ("reserved", "<u1"), ("missed_events", "<u2"),
                      ("channel", "<i4"), ("time", "<i8")])
HEADER = struct.Struct("<4sHHIIqq")
MAX_TAGS = 1 << 20
TAG, TIME_BASE_BROKEN, OVERFLOW_BEGIN, OVERFLOW_END, MISSED_EVENTS = range(5)


def records(times_ps, channels):
    """An array of tags; channels: one for all, or one a time."""
    made = numpy.zeros(len(times_ps), RECORD)
    made["time"] = times_ps
    made["channel"] = channels
    return made


class Server:
    """Listens at "unix:PATH" or "tcp:HOST:PORT" and sends blocks to one client, the newest.

    send() never waits: it may be called from where an instrument's library hands out its data. A
    thread sends what it left. While no client is there, or it reads too slowly, blocks are dropped
    whole; their sequence numbers tell splid.
    """

    def __init__(self, address, waiting_blocks=1000):
        self.sequence = 0
        self.blocks = queue.Queue(waiting_blocks)
        kind, _, place = address.partition(":")
        if kind == "unix":
            if os.path.exists(place):
                os.unlink(place)
            self.listener = socket.socket(socket.AF_UNIX)
            self.listener.bind(place)
        else:
            host, _, port = place.rpartition(":")
            self.listener = socket.create_server((host, int(port)))
        self.listener.listen()
        self.client = None
        threading.Thread(target=self._accept, daemon=True).start()
        threading.Thread(target=self._send_all, daemon=True).start()

    def send(self, tags, begin_ps, end_ps):
        """tags: an array of RECORD, sorted by time, all from begin_ps to end_ps, not to be changed
        any more.

        begin_ps: the end_ps of the call before, or what lies between counts as lost.
        """
        for first in range(0, max(len(tags), 1), MAX_TAGS):
            part = tags[first:first + MAX_TAGS]
            last = first + MAX_TAGS >= len(tags)
            until_ps = end_ps if last else int(part["time"].max())
            header = HEADER.pack(b"SPTB", 1, 0, len(part), self.sequence, begin_ps, until_ps)
            self.sequence = (self.sequence + 1) & 0xFFFFFFFF
            begin_ps = until_ps
            if self.client is None:
                continue
            with contextlib.suppress(queue.Full):
                self.blocks.put_nowait((header, part.view(numpy.uint8)))

    def close(self):
        """Sends what is left, and ends the connection."""
        self.blocks.join()
        if self.client:
            self.client.close()

    def _accept(self):
        while True:
            client, _ = self.listener.accept()
            before, self.client = self.client, client
            if before:
                with contextlib.suppress(OSError):  # it may be gone already
                    before.shutdown(socket.SHUT_RDWR)

    def _send_all(self):
        while True:
            header, part = self.blocks.get()
            client = self.client
            try:
                if client:
                    client.sendall(header)
                    client.sendall(part)
            except OSError:
                client.close()
                if self.client is client:
                    self.client = None
            self.blocks.task_done()
