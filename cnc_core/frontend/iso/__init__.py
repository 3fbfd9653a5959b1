"""Front end of ordinary RS-274 programs, as CAM post-processors write them."""

from cnc_core.frontend.iso.front_end import IsoFrontEnd

__all__ = ["IsoFrontEnd"]
