"""Function blocks on the HLI."""

from .contour_lookahead import ContourLookahead
from .feed_control import FeedControl
from .program_flow import AcknowledgeAll, AutoContinue, TechnoFunction

__all__ = ["AcknowledgeAll", "AutoContinue", "ContourLookahead", "FeedControl", "TechnoFunction"]
