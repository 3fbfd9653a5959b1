"""Front end of the ISG kernel's dialect (TwinCAT CNC)."""

from cnc_core.frontend.isg.front_end import IsgFrontEnd

__all__ = ["IsgFrontEnd"]
