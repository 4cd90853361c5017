"""A stand-in for National Instruments' module: as much of its interface as a bridge uses.

The counter reads 5000, 5001, ... from the clock's start, 1000 ticks a second; the 101st sample
and those after it cannot be read.
"""

import time

from nidaqmx.constants import AcquisitionType, AngleUnits, EncoderType


class DaqError(Exception):
    pass


class _Channels:
    def add_ci_ang_encoder_chan(self, counter, name_to_assign_to_channel="",
                                decoding_type=EncoderType.X_4, units=AngleUnits.DEGREES):
        if not counter.startswith("Dev7/"):
            raise DaqError("Device identifier is invalid.")
        assert counter == "Dev7/ctr0" and units is AngleUnits.TICKS

    def add_co_pulse_chan_freq(self, counter, name_to_assign_to_channel="", freq=1.0):
        assert counter == "Dev7/ctr1" and freq == 1000


class _Timing:
    def cfg_samp_clk_timing(self, rate, source="", sample_mode=AcquisitionType.FINITE):
        assert rate == 1000 and source == "/Dev7/Ctr1InternalOutput"
        assert sample_mode is AcquisitionType.CONTINUOUS

    def cfg_implicit_timing(self, sample_mode=AcquisitionType.FINITE):
        assert sample_mode is AcquisitionType.CONTINUOUS


class Task:
    def __init__(self):
        self.ci_channels = self.co_channels = _Channels()
        self.timing = _Timing()
        self._read = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def start(self):
        pass

    def read(self, number_of_samples_per_channel):
        if self._read + number_of_samples_per_channel > 100:
            raise DaqError("samples were overwritten before they were read")
        time.sleep(number_of_samples_per_channel / 1000)
        first = 5000 + self._read
        self._read += number_of_samples_per_channel
        return [float(first + i) for i in range(number_of_samples_per_channel)]
