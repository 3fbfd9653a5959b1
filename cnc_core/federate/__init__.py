"""A cell as one federate of a HELICS co-simulation (extra ``federate``).

CNC and PLC stay together: their handshake is local.  What goes over the
federation are symbols, at a coupling step of 10 ms or more.
"""

from __future__ import annotations

from .federate import CellFederate, Coupling

__all__ = ["CellFederate", "Coupling"]
