"""Front end of the IsoNs dialect."""

from cnc_core.frontend.isons.front_end import IsonsFrontEnd

__all__ = ["IsonsFrontEnd"]
