"""The commands of ``hli-cosim`` by what they are about, in the order in which
the help lists them.
"""

# isort: off
from . import new
from . import program
from . import cell
from . import recordings
from . import sweep
from . import fmu
from . import online
from . import live
from . import monitor
from . import bridges
from . import export
from . import explain
from . import bench

__all__ = [
    "bench",
    "bridges",
    "cell",
    "explain",
    "export",
    "fmu",
    "live",
    "monitor",
    "new",
    "online",
    "program",
    "recordings",
    "sweep",
]
