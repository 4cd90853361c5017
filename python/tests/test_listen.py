"""splid.listen() at an endpoint of the test's own."""

import json
import threading

import pytest
import zmq

import splid

STATUS = ("status", {"schema": "splid.status", "state": "stopping"})


def publish(socket, messages):
    """Sends all messages once somebody subscribes to frames."""
    while socket.recv() != b"\x01frame":
        pass
    for topic, body in messages:
        socket.send_multipart([topic.encode(), json.dumps(body).encode()])


@pytest.fixture
def publisher(tmp_path):
    socket = zmq.Context.instance().socket(zmq.XPUB)
    socket.setsockopt(zmq.RCVTIMEO, 60_000)
    yield socket, f"ipc://{tmp_path}/publish"
    socket.close(linger=0)


def test_messages_come_until_the_daemon_stops(publisher):
    socket, endpoint = publisher
    socket.bind(endpoint)
    messages = splid.listen(endpoint, timeout_s=60)
    frames = [("frame", {"schema": "splid.frame", "sequence": i}) for i in range(3)]
    heard = []
    sender = threading.Thread(target=publish, args=(socket, [*frames, STATUS]))
    sender.start()
    for message in messages:
        heard.append((message.topic, message.body))
    sender.join()
    assert heard == frames


def test_topics_that_were_not_asked_for_stay_away(publisher):
    socket, endpoint = publisher
    socket.bind(endpoint)
    sender = threading.Thread(target=publish, args=(socket, [("frame", {}), STATUS]))
    sender.start()
    heard = [message.topic for message in splid.listen(endpoint, topics=["status", "frame"],
                                                       timeout_s=60)]
    sender.join()
    assert heard == ["frame", "status"]


def test_text_is_one_topic(publisher):
    socket, endpoint = publisher
    socket.bind(endpoint)
    messages = [("frame", {}), ("frame", {"last": True}), ("ferry", {}), STATUS]
    sender = threading.Thread(target=publish, args=(socket, messages))
    sender.start()
    heard = [message.topic for message in splid.listen(endpoint, topics="frame", timeout_s=60)]
    sender.join()
    assert heard == ["frame", "frame"]


def test_many_pixels_are_one_subscription(publisher):
    socket, endpoint = publisher
    socket.bind(endpoint)
    asked_for = []

    def publish_pixels():
        while len(asked_for) < 2:
            asked_for.append(socket.recv())
        for topic, body in [("frame/other", {}), ("frame/7", {"a": 1}), STATUS]:
            socket.send_multipart([topic.encode(), json.dumps(body).encode()])

    sender = threading.Thread(target=publish_pixels)
    sender.start()
    topics = [f"frame/{i}" for i in range(2, 100)]
    heard = [(message.topic, message.body) for message in
             splid.listen(endpoint, topics=topics, timeout_s=60)]
    sender.join()
    assert sorted(asked_for) == [b"\x01frame/", b"\x01status"]
    assert heard == [("frame/7", {"a": 1})]


def test_silence_ends_with_an_error(publisher):
    endpoint = publisher[1]
    with pytest.raises(splid.DeviceError, match="nothing came for 0.2 s"):
        next(splid.listen(endpoint, timeout_s=0.2))


def test_keys_of_the_program_open_a_protected_endpoint(publisher, program, tmp_path):
    if not zmq.has("curve"):
        pytest.skip("this libzmq has no CURVE")
    socket, endpoint = publisher
    for name in ("anna", "server"):
        done = program.run("keys", name, "--output", tmp_path)
        assert done.returncode == 0, done.stderr
    socket.curve_server = True
    lines = (tmp_path / "server.key_secret").read_text().splitlines()
    secret = next(line.split('"')[1] for line in lines if "secret-key" in line)
    socket.curve_secretkey = secret.encode()
    socket.bind(endpoint)
    sender = threading.Thread(target=publish, args=(socket, [("frame", {"a": 1}), STATUS]))
    sender.start()
    heard = list(splid.listen(endpoint, key=tmp_path / "anna.key_secret",
                              server_key=tmp_path / "server.key", timeout_s=60))
    sender.join()
    assert heard == [("frame", {"a": 1})]


def test_keys_that_are_none_are_refused(tmp_path):
    file = tmp_path / "no.key"
    file.write_text("nothing")
    with pytest.raises(splid.UsageError, match="go together"):
        next(splid.listen(key=file))
    with pytest.raises(splid.UsageError, match="secret-key|public-key"):
        next(splid.listen(key=file, server_key=file))
    with pytest.raises(splid.UsageError, match="give it as"):
        next(splid.listen("nowhere"))
