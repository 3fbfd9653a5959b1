"""Numbers of ADS: commands, index groups, states, errors."""

from __future__ import annotations

from enum import IntEnum


class Command(IntEnum):
    """Commands of the AMS header."""

    DEVICE_INFO = 1
    READ = 2
    WRITE = 3
    READ_STATE = 4
    WRITE_CONTROL = 5
    ADD_NOTIFICATION = 6
    DELETE_NOTIFICATION = 7
    NOTIFICATION = 8
    READ_WRITE = 9


class Group(IntEnum):
    """Index groups."""

    HLI = 0x4040  # as the data of a PLC; the offset counts in the segment
    CONSTANTS = 0x4041  # a number of 4 bytes each
    PLC = 0x100000  # and the number of the program, list or task
    PLC_BITS = 0x200000  # the same; the offset counts bits
    HANDLE_BY_NAME = 0xF003
    VALUE_BY_NAME = 0xF004
    VALUE_BY_HANDLE = 0xF005
    RELEASE_HANDLE = 0xF006
    INFO_BY_NAME = 0xF007
    VERSION = 0xF008
    INFO_BY_NAME_EX = 0xF009
    UPLOAD = 0xF00B
    UPLOAD_INFO = 0xF00C
    TYPE_UPLOAD = 0xF00E
    UPLOAD_INFO_2 = 0xF00F
    TYPE_BY_NAME = 0xF011
    SUM_READ = 0xF080
    SUM_WRITE = 0xF081
    SUM_READ_WRITE = 0xF082
    SUM_READ_EX = 0xF083
    SUM_READ_EX_2 = 0xF084
    SUM_ADD = 0xF085
    SUM_DELETE = 0xF086
    DEVICE_DATA = 0xF100


class State(IntEnum):
    """States of a device."""

    RESET = 2
    START = 4
    RUN = 5
    STOP = 6
    CONFIG = 15
    RECONFIG = 16


class Mode(IntEnum):
    """When a notification is sent."""

    CYCLIC = 3
    ON_CHANGE = 4


class Code(IntEnum):
    """Errors of ADS."""

    NO_TARGET_PORT = 0x6
    SERVICE_NOT_SUPPORTED = 0x701
    INVALID_GROUP = 0x702
    INVALID_OFFSET = 0x703
    INVALID_ACCESS = 0x704
    INVALID_SIZE = 0x705
    INVALID_DATA = 0x706
    NOT_READY = 0x707
    INVALID_PARAMETER = 0x70B
    SYMBOL_NOT_FOUND = 0x710
    INVALID_STATE = 0x712
    MODE_NOT_SUPPORTED = 0x713
    INVALID_NOTIFICATION = 0x714
    NO_MORE_HANDLES = 0x716


class AdsError(Exception):
    """A request that is answered with an error of ADS."""

    def __init__(self, code: Code, text: str = "") -> None:
        super().__init__(f"{code.name} {text}".strip())
        self.code = code
