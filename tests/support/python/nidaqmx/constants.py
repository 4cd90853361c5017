from enum import Enum


class AcquisitionType(Enum):
    FINITE = 10178
    CONTINUOUS = 10123


class AngleUnits(Enum):
    DEGREES = 10146
    TICKS = 10304


class EncoderType(Enum):
    X_4 = 10092
