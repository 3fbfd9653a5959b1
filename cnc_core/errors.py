"""One error base and one table of numbers.

Vendor numbers are used where they are public (companion specifications, "DG"
pages). All other numbers lie in our own range 900000..909999.
docs/reference/errors.md is printed from this table.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

# number -> meaning, without the particulars of one occurrence
ERRORS: dict[int, str] = {
    # vendor numbers
    20003: "G60 without motion",
    20007: "G63: no spindle speed is programmed",
    20013: "G04: a number and an axis word together",
    20014: "G04: only the first main axis may carry the time",
    20108: "two motion or plane functions in one block",
    20112: "two mirror functions in one block",
    20113: "two corner functions of tool radius compensation in one block",
    20114: "two functions of tool radius compensation in one block",
    20115: "two diameter functions in one block",
    20116: "two zero offsets in one block",
    20117: "two exact stop or contouring functions in one block",
    20118: "G70 and G71 in one block",
    20123: "two measuring functions in one block",
    20124: "two look-ahead functions in one block",
    20126: "two modes of tool radius compensation in one block",
    20127: "G161 and G162 in one block",
    20128: "G164 and G165 in one block",
    20129: "two manual mode functions in one block",
    20130: "chamfer and rounding in one block",
    20131: "unknown G function",
    20156: "two functions of type MNE_SNS in one block",
    20151: "G115: number of functions out of range 0..14",
    20211: "control statements nested too deeply",
    20223: "$DEFAULT outside $SWITCH",
    20133: "plane change during tool radius compensation",
    20301: "block too long",
    20400: "parameter P0",
    20566: "#COMMENT BEGIN does not stand alone in its block",
    20351: "chamfer or rounding without a motion before it",
    20569: "#COMMENT END does not stand alone in its block, or has no beginning",
    20590: "#IF, #ELSE, #ENDIF do not fit together",
    20612: "#PSET while mirroring is active",
    20635: "G63 together with G95",
    20636: "G63 together with G96",
    20651: "flush or synchronous wait during tool radius compensation",
    20669: "#TLC and #TRAFO exclude each other",
    20687: "change of the kinematic while it is active",
    20726: "message: a value is missing",
    20752: "G04: time out of range",
    20802: "change of coordinates during tool radius compensation",
    20312: "axis exchange: the cell has no such logical axis number",
    20546: "axis exchange of the facing axis while diameters are programmed",
    20684: "axis exchange while a coordinate system or a transformation acts",
    20821: "coordinate system is not defined",
    20794: "G12 and G13 in one block",
    20795: "G13 without #CORNER PARAM",
    20860: "G351: only 1 and -1 are allowed",
    20927: "expression nested too deeply",
    50130: "weight above what the machine allows",
    22003: "a real-time cycle that is global, or only defined, needs an ID",
    22004: "this # command may not stand in a real-time cycle",
    22009: "only synchronised variables may be written in a real-time cycle",
    22073: "only motion blocks, #SPLINE and look-ahead markers may stand in a real-time loop",
    22128: "#RT WHILE while a spline is active",
    22129: "#RT ENDWHILE while a spline is active",
    22156: "G68: the third main axis may not be programmed",
    22158: "real-time loop during tool radius compensation",
    22181: "#RT ENDWHILE without #RT WHILE; real-time loops do not nest",
    50917: "radii of the orbit: 0 <= MAX_SCALE <= MAX_EQUID, or MAX_EQUID 0",
    50918: "orbited contour: concave, or turned away from the origin",
    50991: "a real-time loop has to end where it begins",
    20990: "the tool is for another kinematic than the active one",
    21024: "I, J, K and R together",
    21251: "axis exchange: a comma is missing behind the name",
    21252: "axis exchange: a comma is missing behind the logical number",
    21253: "axis exchange: logical axis number out of range",
    21254: "axis exchange: axis index out of range",
    21256: "axis exchange: the same name twice",
    21257: "axis exchange: the same index twice",
    21258: "axis exchange: the same logical axis number twice",
    21260: "axis exchange: the index is taken in the channel",
    21261: "axis exchange: the name is taken in the channel",
    21381: "cycle call while a modal cycle is active",
    22178: "call pattern without a retraction plane",
    13164: "pocket: finishing without an allowance",
    13320: "cycle: parameter missing or invalid (CYC_PARAM_MISSING, CYC_PARAM_INVALID)",
    21525: "#PTP during tool radius compensation",
    21527: "#PTP needs an active kinematic transformation",
    21531: "#MCS during #PTP",
    21550: "#CS or #ACS during #PTP",
    21552: "#TRAFO during #PTP",
    21601: "coordinate system of this name does not exist",
    21209: "#FGROUP: circles need all main axes in the group, or none",
    21545: "DELETE: position out of range",
    20995: "number of a signal out of range",
    20996: "number of a channel out of range",
    21344: "#WAIT SYN and #SIGNAL READ: values, or SYN, where it may not stand",
    21549: "#WAIT: the value did not come with the signal, or has no variable",
    21648: "beyond the machine's own software limit, which holds",
    21649: "the negative software limit is not below the positive one",
    21758: "G164: the radii at the start and the end of the circle differ",
    90008: "selection of tool radius compensation needs a linear block",
    90011: "too many blocks without motion in the plane during tool radius compensation",
    90017: "tool radius greater than or equal to the contour radius",
    90031: "compensated circles do not intersect",
    90047: "the tool radius can change in a linear block only",
    120129: "corner deviation is smaller than the smallest one possible",
    120131: "corner distance is smaller than the smallest one possible",
    120206: "contouring is active at the program's end",
    120207: "wrong parameter of contouring",
    120216: "block too short for contouring",
    120433: "not possible together with #HSC",
    120698: "the contour mode does not change from or to a dynamic one while contouring is active",
    250001: "more signals than the cell keeps",
    250008: "the cell has no such channel",
    280611: "a program that is a job orders no jobs",
    270053: "watchdog: the PLC has not shown in time that it lives",
    292005: "kinematic is not defined",
    270061: "mode command: target state not possible",
    1005: "homing: not finished within TIME_OUT_HOME",
    # our own: program text
    900001: "unknown word",
    900002: "unknown command",
    900003: "not supported",
    900004: "malformed number or expression",
    900005: "word programmed twice in one block",
    900006: "feed missing or not positive",
    900007: "wrong circle: no radius, or centre, radius and end point do not fit",
    900008: "circle without centre and radius",
    900009: "M function not defined",
    900010: "malformed command",
    900011: "two functions of one group in a block",
    900012: "value out of range",
    900013: "unclosed bracket or comment",
    900014: "unknown tool",
    900015: "centre word without circular motion",
    900016: "the machine lacks an axis of the plane",
    900017: "command before the first program definition",
    900018: "G04 stands alone in its block",
    900019: "spindle speed missing",
    900020: "program ends at a later % line",
    900021: "real-time loop too long",
    900022: "too many errors, the rest is not checked: more than",
    # our own: tool radius compensation
    906001: "contour damage: nothing is left of the compensated element",
    906002: "deselection of tool radius compensation needs a linear block",
    906003: "not possible during tool radius compensation",
    906004: "no tangential arc to the compensated contour",
    906005: "circle replaced by a line at the change of the compensated side",
    906007: "tool radius compensation without a tool",
    906008: "the program ends during tool radius compensation",
    906006: "G05 without selection or deselection of tool radius compensation",
    # our own: program flow and variables
    907001: "the program does not end",
    907002: "too many subprograms in each other",
    907010: "variable is not declared",
    907011: "a number is expected, not a text",
    907012: "a text is expected, not a number",
    907013: "value does not fit the variable's type",
    907014: "array index out of range",
    907015: "wrong number of indices or initial values",
    907016: "variable is read only",
    907017: "variable is declared twice",
    907018: "text function: position or count out of range",
    907020: "control statement without its beginning",
    907021: "control statement is not closed",
    907022: "$BREAK or $CONTINUE outside a loop",
    907023: "jump target not found",
    907024: "jump into a loop",
    907025: "jump target exists more than once",
    907026: "$FOR with step 0 does not end by itself",
    907030: "subprogram not found",
    907031: "too many local subprograms in one file",
    907032: "program end inside a subprogram ends the whole program",
    907033: "no main program in the file",
    907034: "cycle call: parameter wrong or programmed twice",
    907040: "accepted, though not written as the manual wants it",
    907041: "not defined, accepted by the lenient mode",
    907042: "stored without effect",
    907043: "words beside a # command",
    907050: "#ERROR of the program",
    907051: "message format and values do not fit",
    907052: "#WAIT for a signal that nobody sends",
    907053: "file name leaves the folders of the program and of the run",
    907054: "external variable does not fit its storage",
    907056: "channels wait for each other",
    907057: "job: unknown, ended otherwise, or not possible",
    907058: "axis exchange: the axis does not fit its place",
    907060: "zero offset number out of range",
    907061: "not possible in this feed mode",
    # our own: cycles
    907101: "cycle: parameters that exclude or need each other (CYC_PARAM_CONFLICT)",
    907102: "cycle: the points do not determine the result (CYC_DEGENERATE)",
    907103: "cycle: a kinematic transformation has to be active (CYC_NO_TRAFO)",
    907104: "call pattern does not exist (PAT_UNKNOWN_ID)",
    907105: "call pattern: wrong definition (PAT_SYNTAX)",
    907106: "call pattern: rotation about X or Y (PAT_ROTATION)",
    907107: "cycle: the tool has no radius (CYC_NO_TOOL)",
    907108: "a cycle call stands alone in its block",
    907110: "cycle: unknown parameter",
    # our own: die sinking
    907120: "#TRACK CHAN ON [EXTEND] needs FCT_EXTENSION_EQUIDIST (P-CHAN-00650)",
    907121: "orbited contour: only lines may meet in a corner",
    907122: "orbited contour: nothing is left of the element at R_MAX_SCALE",
    907112: "obsolete name",
    907070: "G63: spindle functions do not stand in the block",
    907071: "G63: the spindle has to be at rest",
    # our own: RS-274 programs
    908001: "word that no function of the block uses",
    908002: "parameter is not defined",
    908003: "axis words without a motion function",
    908004: "drilling cycle: a word is missing or wrong",
    908005: "two functions that use the axis words in one block",
    908006: "accepted with a limit",
    # our own: IsoNs programs
    909101: "unknown system variable",
    909102: "variable is read before it was written: 0",
    909103: "array without index",
    909104: "too many variables",
    909105: "a whole number is expected",
    909106: "index outside the variable list",
    909107: "variable list cannot be read",
    909108: "bit operators beside comparisons without brackets: bit operators bind tighter",
    909110: "slot number out of range",
    909111: "assignment behind the words of its block",
    909112: "malformed label",
    909113: "not a rotary axis",
    909114: "G48: the axis lies in the plane",
    909115: "arcs are not possible in this plane",
    909116: "arcs do not stay arcs under the transformations in force",
    909117: "the mode needs the look-ahead of G69",
    909120: "OPT: unknown event",
    909121: "a parameter of the HM call is missing",
    909122: "unknown machine parameter",
    909123: "RETURN and GOSUB, IMPORT and END_IMPORT do not fit together",
    909124: "macro not found",
    909130: "stopped by the program's ERROR",
    909131: "alarm of WAIT_INPUT",
    909140: "positioner does not exist",
    909141: "positioner is not enabled",
    909142: "SDO: node or object does not exist",
    # our own: the path
    911001: "spline of too few points",
    911002: "only lines may stand in a spline",
    911004: "chamfer or rounding does not fit between its blocks",
    911005: "chamfers and roundings stand between two blocks of the plane",
    911003: "spline during tool radius compensation",
    # our own: High Speed Machining
    909201: "no setup file",
    909202: "malformed setup line",
    909203: "unknown setup code",
    909204: "setup: an obligatory field is empty",
    909205: "setup: wrong value",
    909206: "setup: a code stands twice",
    909207: "setup: a code is missing",
    909208: "setup: the feed cannot refer to this curve",
    909209: "setup: wrong axis",
    909210: "setup: too many axes",
    909211: "setup: incomplete kinematic chain",
    909219: "profiles belong into part programs, not into manual data input (MDI)",
    909220: "G60 and G61 stand alone in their block",
    909221: "only inside, or only outside a profile (G61 .. G60)",
    909222: "the profile has no end (G60)",
    909223: "G61 while a virtualisation is active",
    909224: "not allowed inside a profile",
    909225: "the first point of a profile is incomplete",
    909226: "unknown word",
    909227: "expressions are not allowed inside a profile: a number, or an E or L variable",
    909228: "a transition code stands alone behind a point",
    909229: "wrong degree",
    909230: "wrong number of coefficients",
    909231: "polynomial: an axis is missing",
    909232: "malformed polynomial",
    909233: "polynomials do not meet",
    909240: "wrong number of knots",
    909241: "knots are not clamped",
    909242: "knots decrease, or coincide too often",
    909243: "too few control points",
    909244: "B-splines do not meet",
    909245: "G63 between B-splines",
    909250: "versor of length zero",
    909251: "a versor is not programmed",
    909252: "ijk may not be programmed with points of type AXI",
    909253: "the surface normal cannot be computed",
    909254: "tangential axis with polynomials or B-splines",
    909260: "the tool direction cannot be reached",
    909261: "operating limit of the setup exceeded",
    909262: "the motion does not become smooth: a singular pose, or a normal along the tool",
    909270: "words without use",
    909271: "the output would overwrite what it is made from",
    909272: "the output would be slower: the input is kept",
    909273: "the axes end elsewhere than with the input",
    # our own: kinematics and coordinate systems
    910101: "tool direction cannot be reached by the rotary axes",
    910102: "tool direction can be reached beyond the software limits of the rotary axes only",
    910103: "singular position: the linear axes do not span the space at these rotary angles",
    910104: "motion comes too close to a singular position of the machine",
    910105: "only straight lines during #PTP",
    910107: "not possible while machine coordinates (#MCS) are active",
    910109: "too many coordinate systems",
    910113: "circle or corner with different factors of scale of its axes",
    910110: "contour rotation ends with the change of the plane",
    910111: "contour rotation is active: cycles expect coordinate systems made with #CS",
    910106: "the cell has no such kinematic transformation",
    909150: "form: unknown object or property",
    909151: "form: value out of range",
    909152: "the operator is asked, and nobody answers",
    909160: "ACQ SENSOR ERROR: the target was reached without the sensor",
    909161: "homing: the mode is not known, or the simulated drive does not have it",
    909170: "restart: the program does not come to this place",
    909172: "RESUME_T: no T has been executed in this program",
    909174: (
        "M_GORETRACE: the path goes on meanwhile, "
        "the macro cannot move axes, put out functions or wait"
    ),
    909173: "the program does not seem to end, what follows is not executed",
    # our own: files, configuration, machine
    901001: "file not found",
    901002: "file cannot be read",
    901003: "dialect not available",
    901004: "file cannot be written",
    901005: "a program reads and writes regular files only, and follows no link",
    901006: "file too long",
    901007: "the program writes too much",
    901008: "the run has not written this file, so it does not replace it",
    901009: "file is no text",
    901010: "no NC program",
    902001: "configuration error",
    903001: "software limit exceeded",
    # our own: engine and co-simulation
    904001: "row not supported by the engine",
    904002: "row with numbers that are not finite",
    904003: "out of memory",
    904009: "the planner refuses a motion: its derivatives are no numbers",
    904005: "more writes of external variables in one cycle than the engine keeps",
    904010: "more real-time cycles, or longer ones, than the engine keeps",
    904004: "real-time loop too long: the interpolator holds it whole",
    905000: "shared memory",
    905001: "a process died",
    905002: "segment in use",
    905003: "error in the PLC program",
    905010: "segment not found",
    905011: "segment not published yet",
    905012: "segment of another version or layout",
    905013: "segment not accessible",
    905014: "no answer in time",
    905015: "wrong segment name",
    905016: "channel or axis not configured",
    905017: "segment cut or written over while in use",
    905020: "mode command: no program is selected and none is named",
    905021: "execution mode not supported",
    905022: "error record of the PLC",
    905023: "the PLC has aborted the program",
    905026: "a warning, with --strict",
    905025: "the run has not ended within its time",
    905024: "the program stands at a stop that waits for a PLC, and there is none (--plc none)",
}


EXCERPT, AHEAD = 76, 30
"""Columns of a line that an error shows, and how many ahead of its place."""


@dataclass
class Place:
    """Where in the program: file, 1-based line and column, the text of the line."""

    file: str = ""
    line: int = 0
    column: int = 0
    source: str = ""


def _excerpt(place: Place) -> str:
    """The line, or what stands around the place in a long one."""
    text = place.source
    if len(text) <= EXCERPT:
        return text
    room = EXCERPT - len("....")
    begin = min(max(place.column - AHEAD, 0), len(text) - room)
    shown = text[begin : begin + room]
    ends = begin + room >= len(text)
    return ("" if not begin else "..") + shown + ("" if ends else "..")


class CncError(Exception):
    """A numbered error with its place.

    ``str()`` gives ``FILE:LINE:COL: CODE: text`` and the source line.
    """

    def __init__(
        self, code: int, text: str = "", place: Place | None = None
    ) -> None:
        self.code = code
        self.text = text or ERRORS.get(code, "error")
        self.place = place or Place()
        self.also: list[CncError] = []  # further errors of the same block
        super().__init__(self.text)

    def at(self, place: Place) -> CncError:
        """The same error at ``place``, if it has none yet."""
        if not self.place.line:
            self.place = place
        return self

    def __str__(self) -> str:
        p = self.place
        head = (
            f"{p.file}:{p.line}:{p.column}: "
            if p.line
            else (f"{p.file}: " if p.file else "")
        )
        tail = f"\n    {_excerpt(p)}" if p.source else ""
        return f"{head}{self.code}: {self.text}{tail}"

    def as_json(self) -> dict[str, Any]:
        """``{file, line, column, code, text}`` as the contract wants it."""
        p = self.place
        return {
            "file": p.file,
            "line": p.line,
            "column": p.column,
            "code": self.code,
            "text": self.text,
        }


class ConfigError(CncError):
    """Wrong cell configuration."""

    def __init__(self, text: str, place: Place | None = None) -> None:
        super().__init__(902001, text, place)
