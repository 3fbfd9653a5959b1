"""PLC program of a test: answers an NC program through external variables."""

import ctypes

from hli.view import overlay
from plc_client import task


class Shared(ctypes.Structure):
    """24-byte blocks: GO (UNS32), REQUEST and ANSWER (REAL64)."""

    _fields_ = [
        ("go", ctypes.c_uint32),
        ("fill_1", ctypes.c_uint8 * 20),
        ("request", ctypes.c_double),
        ("fill_2", ctypes.c_uint8 * 16),
        ("answer", ctypes.c_double),
        ("fill_3", ctypes.c_uint8 * 16),
    ]


@task(interval=0.002)
class Answer:
    """After 40 scans the answer to a request is twice the request."""

    def setup(self, hli):
        self.shared = overlay(hli.gpVECh[0].value, Shared)
        self.scans = 0

    def cyclic(self):
        self.scans += 1
        if self.shared.request and self.scans > 40:
            self.shared.answer = 2.0 * self.shared.request
            self.shared.go = 1

    def result(self):
        return self.shared.request
