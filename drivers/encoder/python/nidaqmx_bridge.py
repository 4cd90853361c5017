#!/usr/bin/env python3
"""Serves the counts of an encoder on a National Instruments DAQ to splid.

    nidaqmx_bridge.py --listen unix:/run/splid/encoder.sock --device Dev1 --rate-hz 1000

ctr0 counts the encoder's edges at each tick of ctr1, whose output also goes to a marker input of
the tagger. Needs the vendor's driver and its Python module nidaqmx; docs/guide/instruments/encoder.md has
the wiring.
"""

import argparse
import os
import socket
import time

import nidaqmx
from nidaqmx.constants import AcquisitionType, AngleUnits, EncoderType

BATCH_S = 0.01
# splid joins the counts to the markers where it sees the clock start: after 0.1 s without a tick.
PAUSE_S = 0.5


def listen(address):
    kind, _, place = address.partition(":")
    if kind == "tcp":
        host, _, port = place.rpartition(":")
        return socket.create_server((host, int(port)))
    if os.path.exists(place):
        os.unlink(place)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(place)
    listener.listen()
    return listener


def serve(client, device, rate_hz):
    """Starts the sample clock, and sends each 10 ms of counts until the client or the DAQ fails."""
    with nidaqmx.Task() as counter, nidaqmx.Task() as clock:
        counter.ci_channels.add_ci_ang_encoder_chan(
            f"{device}/ctr0", decoding_type=EncoderType.X_4, units=AngleUnits.TICKS)
        counter.timing.cfg_samp_clk_timing(rate_hz, source=f"/{device}/Ctr1InternalOutput",
                                           sample_mode=AcquisitionType.CONTINUOUS)
        clock.co_channels.add_co_pulse_chan_freq(f"{device}/ctr1", freq=rate_hz)
        clock.timing.cfg_implicit_timing(sample_mode=AcquisitionType.CONTINUOUS)
        counter.start()
        clock.start()
        batch = max(1, round(rate_hz * BATCH_S))
        index = 0
        while True:
            try:
                counts = counter.read(number_of_samples_per_channel=batch)
            except nidaqmx.DaqError as error:
                print(f"nidaqmx_bridge: {error}; the clock starts anew", flush=True)
                client.sendall(b"overrun\n")
                return
            line = ",".join(str(round(count)) for count in [index, *counts])
            client.sendall(line.encode() + b"\n")
            index += batch


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--listen", required=True, help="unix:PATH or tcp:HOST:PORT")
    parser.add_argument("--device", default="Dev1", help="as the vendor's software names it")
    parser.add_argument("--rate-hz", type=float, default=1000, help="of the sample clock")
    options = parser.parse_args()
    listener = listen(options.listen)
    while True:
        client, _ = listener.accept()
        with client:
            time.sleep(PAUSE_S)
            try:
                serve(client, options.device, options.rate_hz)
            except nidaqmx.DaqError as error:  # no such device, or no clock: splid connects again
                print(f"nidaqmx_bridge: {options.device}: {error}", flush=True)
            except OSError:
                pass  # splid has gone; it, or another, will connect again


if __name__ == "__main__":
    main()
