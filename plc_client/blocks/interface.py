"""MCV_HliInterface: does the PLC's picture of the HLI agree with the CNC's?
(hli_reference 1.2)
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from enum import Enum

from hli import layout
from hli.areas import Areas

from .base import FunctionBlock
from .owner import areas_of

ERR_PLC_NO_ERROR = 0
ERR_PLC_PFORM_PTR_ZERO = 40014
ERR_PLC_WRONG_VERSION = 40015
ERR_PLC_WRONG_PARAMETER = 40016
ERR_PLC_WRONG_AXIFC_SIZE = 40017
ERR_PLC_WRONG_CHIFC_SIZE = 40018
ERR_PLC_HLIINFO_PTR_ZERO = 40019
ERR_PLC_AXIS_NR_UNEQUAL = 40020
ERR_PLC_CHANNEL_NR_UNEQUAL = 40021
ERR_PLC_WRONG_PFIFC_SIZE = 40022
ERR_PLC_EXT_VAR_PTR_ZERO = 40024

RETRY_SCANS = 100
PLC_VERSION = "hli-cosim 0.1"


@dataclass(frozen=True)
class HliShape:
    """HLI_SHAPE: version, highest numbers, sizes in bytes and configured
    numbers of one side.
    """

    version: str
    max_channels: int
    max_axes: int
    sizeof_platform: int
    sizeof_channel: int
    sizeof_axis: int
    channels: int
    axes: int


class InterfaceState(Enum):
    """States of the block (docs/reference/plc.md draws them)."""

    CHECKING = "checking"
    INITIALIZED = "initialized"
    ERROR = "error"  # for RETRY_SCANS scans, then CHECKING again


class MCV_HliInterface(FunctionBlock):
    """One instance, called every scan without inputs; touch the HLI only when
    ``Initialized`` is TRUE.

    Outputs ``Initialized`` (also ``Initialised``), ``PlcHli`` and ``CncHli``
    (also ``ExpectedHli``, ``ActualHli``), ``Error``, ``ErrorID``.  Checked in
    the order 40019, 40014, 40015, 40016, 40022, 40018, 40017, 40021, 40020,
    40024; after an error it waits 100 scans and checks again.  ``version`` is
    the PLC library's version, None: the CNC's is taken (the bytes were compared
    when the connection was made).
    """

    def __init__(self, hli: Areas, version: str | None = PLC_VERSION) -> None:
        hli = areas_of(self, hli)
        super().__init__()
        self._hli = hli
        self._version = version
        self.state = InterfaceState.CHECKING
        self.PlcHli: HliShape | None = None
        self.CncHli: HliShape | None = None
        self._wait = 0

    @property
    def Initialized(self) -> bool:
        """The areas may be used."""
        return self.state is InterfaceState.INITIALIZED

    Initialised = Initialized

    @property
    def ExpectedHli(self) -> HliShape | None:
        """``PlcHli`` under the diagnosis pages' name."""
        return self.PlcHli

    @property
    def ActualHli(self) -> HliShape | None:
        """``CncHli`` under the diagnosis pages' name."""
        return self.CncHli

    def __call__(self) -> bool:
        """One scan; returns ``Initialized``."""
        if self.state is InterfaceState.ERROR:
            self._wait -= 1
            if self._wait <= 0:
                self.state, self.error, self.error_id = (
                    InterfaceState.CHECKING,
                    False,
                    0,
                )
        elif self.state is InterfaceState.CHECKING:
            self._check_all()
        self.done, self.busy = (
            self.Initialized,
            self.state is InterfaceState.CHECKING,
        )
        return self.Initialized

    def _check_all(self) -> None:
        self.error_id = self._first_error()
        self.error = self.error_id != ERR_PLC_NO_ERROR
        self.state = (
            InterfaceState.ERROR if self.error else InterfaceState.INITIALIZED
        )
        self._wait = RETRY_SCANS

    def _first_error(self) -> int:
        hli = self._hli
        head = hli.root.segment_head
        if not head.channel_count or not head.axis_count:
            return ERR_PLC_HLIINFO_PTR_ZERO
        if hli.gpPform is None:
            return ERR_PLC_PFORM_PTR_ZERO
        cnc = self.CncHli = cnc_shape(hli)
        plc = self.PlcHli = plc_shape(
            hli, cnc.version if self._version is None else self._version
        )
        checks = (
            (ERR_PLC_WRONG_VERSION, plc.version == cnc.version),
            (
                ERR_PLC_WRONG_PARAMETER,
                (plc.max_channels, plc.max_axes)
                == (cnc.max_channels, cnc.max_axes),
            ),
            (
                ERR_PLC_WRONG_PFIFC_SIZE,
                plc.sizeof_platform == cnc.sizeof_platform,
            ),
            (
                ERR_PLC_WRONG_CHIFC_SIZE,
                plc.sizeof_channel == cnc.sizeof_channel,
            ),
            (ERR_PLC_WRONG_AXIFC_SIZE, plc.sizeof_axis == cnc.sizeof_axis),
            (ERR_PLC_CHANNEL_NR_UNEQUAL, plc.channels == cnc.channels),
            (ERR_PLC_AXIS_NR_UNEQUAL, plc.axes == cnc.axes),
            (
                ERR_PLC_EXT_VAR_PTR_ZERO,
                all(area is not None for area in hli.gpVECh[: cnc.channels]),
            ),
        )
        return next(
            (number for number, good in checks if not good), ERR_PLC_NO_ERROR
        )


def cnc_shape(hli: Areas) -> HliShape:
    """What the CNC published: segment head, platform, heads of the first
    channel and axis.
    """
    head, pform = hli.root.segment_head, hli.gpPform
    others = ctypes.sizeof(layout.HLI_SEGMENT) - ctypes.sizeof(
        layout.HLI_PLATFORM
    )
    return HliShape(
        pform.nc_config.hli_version_r.zeichen,
        layout.HLI_SYS_CH_MAXIDX + 1,
        layout.HLI_SYS_AX_MAXIDX + 1,
        head.segment_size - others,
        hli.gpCh[0].head.sizeof_interface_r,
        hli.gpAx[0].head.sizeof_interface_r,
        head.channel_count,
        head.axis_count,
    )


def plc_shape(hli: Areas, version: str) -> HliShape:
    """What this library was built with, and the pointers it has."""
    return HliShape(
        version,
        layout.HLI_SYS_CH_MAXIDX + 1,
        layout.HLI_SYS_AX_MAXIDX + 1,
        ctypes.sizeof(layout.HLI_PLATFORM),
        ctypes.sizeof(layout.HLI_CHANNEL),
        ctypes.sizeof(layout.HLI_AXIS),
        sum(area is not None for area in hli.gpCh),
        sum(area is not None for area in hli.gpAx),
    )
