"""Front end of 10-Series programs with High Speed Machining."""

from cnc_core.frontend.osai.front_end import OsaiFrontEnd

__all__ = ["OsaiFrontEnd"]
