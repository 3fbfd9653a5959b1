"""A cell as an FMU: a part of somebody else's simulation.

``variables.py`` says what the FMU shows, ``description.py`` writes that as the
standard has it, ``export.py`` packs the file.  ``shim`` is C, loaded by the
importer; it starts ``slave.py``, a process that runs the cell (``instance.py``)
and shares a page with it as ``wire.py`` says.  ``symbols.py`` finds what was
chosen, ``looking.py`` the M functions and the contour ahead.
"""

from __future__ import annotations

from .export import export_fmu

__all__ = ["export_fmu"]
