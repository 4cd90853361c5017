"""What a running splid publishes, by pyzmq."""

import json
import os
import re
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Optional

from splid import _splid

if TYPE_CHECKING:
    import zmq

_KEY = re.compile(r"[0-9a-zA-Z.\-:+=^!/*?&<>()\[\]{}@%$#]{40}")
# A publisher takes twice as many bytes of topics from one connection, each with what CURVE adds.
_MOST_TOPIC_BYTES = 2048
_BYTES_AROUND = 45
_ALL_PIXELS = "frame/"
_SLICE_MS = 100  # how long Python waits in the socket before it looks for Ctrl-C and the end


class Message(NamedTuple):
    """A message as it was published (docs/reference/messages.md has its members)."""

    topic: str
    body: dict[str, Any]


def listen(endpoint: str = "tcp://127.0.0.1:9872", *, topics: "Sequence[str] | str" = ("frame",),
           key: "Optional[os.PathLike[str] | str]" = None,
           server_key: "Optional[os.PathLike[str] | str]" = None,
           timeout_s: Optional[float] = None) -> Iterator[Message]:
    """Iterates over the messages of a running splid until its status says that it stops.

    topics: beginnings of topics, or one as text: frame, status, version; "" is everything. key: the
    file of a secret key that `splid keys` made, where the endpoint is protected; server_key: then
    the server's public key, as its 40 characters or its file. timeout_s: how long nothing may come;
    None: any time. Subscribes at the first step of the iteration, and disconnects when the iterator
    is closed.

    Errors: UsageError for text that is no endpoint or no key; DeviceError after timeout_s of
    silence; DataError for a message that is no JSON. ImportError without pyzmq.
    """
    import zmq

    topics = (topics,) if isinstance(topics, str) else topics
    socket = zmq.Context.instance().socket(zmq.SUB)
    try:
        _connect(socket, endpoint, topics, key, server_key)
        heard_s = time.monotonic()
        while True:
            if socket.poll(_SLICE_MS):
                message = _message(socket.recv_multipart())
                heard_s = time.monotonic()
                if any(message.topic.startswith(topic) for topic in topics):
                    yield message
                    heard_s = time.monotonic()
                if message.topic == "status" and message.body.get("state") == "stopping":
                    return
            elif timeout_s is not None and time.monotonic() - heard_s >= timeout_s:
                raise _splid.DeviceError(
                    f"nothing came for {timeout_s:g} s: no message at {endpoint}; is a splid "
                    "publishing there, and does it know this key?")
    finally:
        socket.close(linger=0)


def _connect(socket: "zmq.Socket[bytes]", endpoint: str, topics: Sequence[str],
             key: "Optional[os.PathLike[str] | str]",
             server_key: "Optional[os.PathLike[str] | str]") -> None:
    import zmq

    socket.set(zmq.RECONNECT_IVL, 100)
    # As in daemon/sockets/subscriber.cpp: a machine that has lost its power closes no connection.
    socket.set(zmq.HEARTBEAT_IVL, 2000)
    socket.set(zmq.HEARTBEAT_TIMEOUT, 6000)
    socket.set(zmq.CONNECT_TIMEOUT, 5000)
    socket.set(zmq.RCVHWM, 20_000)  # a replay at full speed sends thousands of messages a second
    socket.set(zmq.IPV6, "[" in endpoint)
    if (key is None) != (server_key is None):
        raise _splid.UsageError("key and server_key: one was given, but the two go together")
    if key is not None and server_key is not None:
        socket.curve_publickey = _key(os.fspath(key), "public-key", "key")
        socket.curve_secretkey = _key(os.fspath(key), "secret-key", "key")
        socket.curve_serverkey = _key(os.fspath(server_key), "public-key", "server_key")
    # The status tells when the daemon stops.
    for topic in _few_enough({*topics, "status"}):
        socket.subscribe(topic)
    try:
        socket.connect(endpoint)
    except zmq.ZMQError as error:
        raise _splid.UsageError(f"endpoint {endpoint}: {error.strerror}; give it as "
                                "tcp://127.0.0.1:PORT or ipc:///PATH") from error


def _few_enough(topics: set[str]) -> set[str]:
    """All pixels in the place of many; what was not asked for is left out as it comes."""
    if sum(len(topic.encode()) + _BYTES_AROUND for topic in topics) <= _MOST_TOPIC_BYTES:
        return topics
    others = {topic for topic in topics if not topic.startswith(_ALL_PIXELS)}
    return topics if others == topics else {*others, _ALL_PIXELS}


def _key(given: str, name: str, asked_by: str) -> bytes:
    """The key itself, or that in a file's line `name = "..."`."""
    if asked_by == "server_key" and _KEY.fullmatch(given):
        return given.encode("ascii")
    try:
        with open(given, encoding="utf-8") as file:
            line = re.compile(rf'^\s*{name}\s*=\s*["\']?(.*?)["\']?\s*$', re.MULTILINE)
            lines: list[str] = line.findall(file.read())
    except OSError as error:
        raise _splid.UsageError(
            f"{asked_by}: {given}: cannot be read: {error.strerror}") from error
    if not lines:
        raise _splid.UsageError(
            f'{asked_by}: {given}: has no line {name} = "..."; splid keys makes such a file')
    if not _KEY.fullmatch(lines[0]):
        raise _splid.UsageError(
            f"{asked_by}: {given}: its {name} is no key: a key has 40 characters of Z85")
    return lines[0].encode("ascii")


def _message(parts: list[bytes]) -> Message:
    try:
        topic, body = parts
        return Message(topic.decode("utf-8"), json.loads(body))
    except ValueError as error:
        raise _splid.DataError(f"a message that is not a topic and JSON: {error}") from error
