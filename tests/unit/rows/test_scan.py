"""The C line scanner: what is plain, where it stops, numbers, fuzzing."""

import random
import struct

import numpy as np
import pytest
from cnc_core._engine import ffi, lib

from cnc_core.blocks import CIRCULAR, LINEAR, NC_BLOCK

pytestmark = pytest.mark.sanitize("rows")


def modal():
    """State of a machine with X Y Z and rotary A, all at 0."""
    m = ffi.new("nc_modal *")
    lib.nc_modal_init(m)
    m.axes = 4
    m.rotary[3] = 1
    for i, letter in enumerate("XYZA"):
        m.letter_axis[ord(letter) - 65] = i
    for i in range(3):
        m.main_axis[i] = i
    return m


def scan(text, final=True, room=64, m=None):
    """(reason, rows, result, state) of one scan; the buffer has exactly the size of the text."""
    m = m or modal()
    data = text if isinstance(text, bytes) else text.encode()
    buffer = ffi.new("char[]", len(data) or 1)
    ffi.memmove(buffer, data, len(data))
    rows = np.zeros(room, NC_BLOCK)
    result = ffi.new("nc_scan_result *")
    out = (
        ffi.from_buffer("nc_block[]", rows, require_writable=True)
        if room
        else ffi.NULL
    )
    stop = lib.nc_scan(m, buffer, len(data), final, out, room, result)
    return stop, rows[: result.rows], result, m


def test_layout_of_row_is_numpy_dtype():
    """The scanner writes the rows numpy reads."""
    assert ffi.sizeof("nc_block") == NC_BLOCK.itemsize
    assert ffi.offsetof("nc_block", "fill_1") == NC_BLOCK.fields["fill_1"][1]


@pytest.mark.parametrize(
    "line",
    [
        "G01X10Y-20F600",
        "g1 x 10 y-20. f=600.",
        "N5 G 01 X=10 Y = -20 F 600 ; end",
        "(a) G1 (b) X10 (c ; d) Y-20F600(e)",
    ],
)
def test_spellings_of_one_line(line):
    """Blanks, case, `=`, sign, comments and a missing line break do not matter."""
    stop, rows, result, _ = scan(line)
    assert (stop, len(rows), result.consumed) == (
        lib.NC_SCAN_MORE,
        1,
        len(line),
    )
    assert rows["end"][0][:2].tolist() == [10.0, -20.0]
    assert rows["feed"][0] == 10.0


@pytest.mark.parametrize(
    "line",
    [
        "M3",
        "G04 X1",
        "G54 X1",
        "#FLUSH",
        "%NAME",
        "X[1]",
        "X1e5",
        "X--1",
        "X.",
        "X",
        "X- 1",
        "X1.2.3",
        "X10+5",
        "X1\\",
        "; comment \\",
        "\\",
        "(open X1",
        "(a(b)) X1",
        "X1 X2",
        "G0 G1",
        "G90 G91",
        "B5",
        "E1",
        "N1.5",
        "N-1",
        "G1.5",
        "N99999999999 X1",
        "X1=10",
        "XP1",
        "X1 MOD 2",
        "$IF",
        "/X1",
        "X10 5",
        "X\0001",
    ],
)
def test_other_lines_stop_the_scanner_in_front(line):
    """What is not plain is left alone, with the state of the lines before it."""
    text = "G00 X1\n" + line + "\nX2\n"
    stop, rows, result, m = scan(text)
    assert (stop, len(rows), result.consumed) == (lib.NC_SCAN_OTHER, 1, 7)
    assert (m.line, m.count, m.pos[0]) == (1, 1, 1.0)


@pytest.mark.parametrize(
    "text",
    [
        "X1",
        "-.5",
        "+5.",
        ".5",
        "0.1",
        "123456789012345678",
        "0.30000000000000004",
        "1.7976931348623157",
    ],
)
def test_numbers_are_correctly_rounded(text):
    """Numbers are what strtod makes of them, in any length."""
    number = text.removeprefix("X")
    _, rows, _, m = scan(f"F{number}")
    assert not len(rows)
    assert m.feed == (float(number) if abs(float(number)) <= 1e9 else 0.0)


def test_many_random_numbers_are_correctly_rounded():
    """Random decimals of 1 to 30 digits agree with Python's float to the last bit."""
    rng = random.Random(7)
    for _ in range(2000):
        digits = "".join(
            rng.choice("0123456789") for _ in range(rng.randint(1, 30))
        )
        text = digits[: rng.randint(1, 9)] + "." + digits
        m = scan(f"F{text}")[3]
        assert struct.pack("d", m.feed) == struct.pack("d", float(text))


def test_lines_and_line_breaks():
    """Empty lines and comments are plain and counted; CRLF, TAB and blanks end
    nothing but the line.
    """
    stop, rows, _, m = scan(
        "\r\n; comment\r\n(comment)\r\n\tG00\tX1 \r\n  \r\nN7 X2\t\r\n"
    )
    assert stop == lib.NC_SCAN_MORE
    assert rows["line"].tolist() == [4, 6]
    assert rows["count"].tolist() == [4, 6]
    assert rows["n"].tolist() == [0, 7]
    assert (m.line, m.count, m.programmed) == (6, 6, 2)


def test_incomplete_last_line_is_left():
    """Without `final` a line without line break may go on in the next chunk."""
    _, rows, result, m = scan("G00 X1\nX2", final=False)
    assert (len(rows), result.consumed, m.line) == (1, 7, 1)


def test_output_array_full():
    """A full array stops the scanner; it goes on where it stopped."""
    stop, rows, result, m = scan("G00 X1\nX2\nX3\n", room=2)
    assert (stop, len(rows), result.consumed) == (lib.NC_SCAN_FULL, 2, 10)
    assert scan("X3\n", m=m)[1]["end"][0][0] == 3.0


def test_error_stops_at_its_line():
    """An error leaves the state before its line; the column is the first motion word's."""
    stop, rows, result, m = scan("G00 X1\nN5 G01 X2\n")
    assert (stop, len(rows), result.consumed) == (lib.NC_SCAN_ERROR, 1, 7)
    assert (result.error, result.column) == (900006, 8)
    assert (m.motion, m.line, m.pos[0]) == (0, 1, 1.0)


def test_zero_length_motion_gives_no_row_but_updates_state():
    """A motion to where the axes are stands in no row, its words act all the same."""
    _, rows, _, m = scan("G01 X0 F600\nX5\n")
    assert rows["type"].tolist() == [LINEAR]
    assert rows["line"].tolist() == [2]
    assert m.motion == 1


def test_longest_block():
    """4096 characters are a block; one more is left to the parser."""
    stop, rows, _, _ = scan("G00 X1" + " " * 4089 + ";")
    assert (stop, len(rows)) == (lib.NC_SCAN_MORE, 1)
    assert scan("G00 X1" + " " * 4090 + ";")[0] == lib.NC_SCAN_OTHER
    assert scan("G00 X1;" + "x" * 9000, final=False)[0] == lib.NC_SCAN_OTHER


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("G02 X10 I5 R5", 21024),
        ("G02 X10 I0 J0", 900007),
        ("G02 X10 R0", 900007),
        ("G02 X10 R2", 900007),
        ("G02 X10 I3", 900007),
        ("G02 X10", 900008),
        ("G01 X10 I5", 900015),
        ("G01 X10000000000", 900012),
        ("G02 Z1000 I1 K0.0001", 900012),
    ],
)
def test_wrong_geometry(line, error):
    """Wrong circles and values are refused by number."""
    stop, _, result, _ = scan("F600\n" + line)
    assert (stop, result.error) == (lib.NC_SCAN_ERROR, error)


def test_missing_plane_axis():
    """A circle needs both axes of its plane."""
    m = modal()
    m.main_axis[1] = -1
    assert scan("F1 G02 X1 R1", m=m)[2].error == 900016


def test_tool_length_acts_at_next_absolute_word():
    """An offset waits for its axis's next absolute word and follows the plane."""
    m = modal()
    m.tool_length = 20.0
    lib.nc_modal_offsets(m)
    _, rows, _, _ = scan("G00 X1\nG91 Z1\nG90 Z5\nG18 Y1\nZ5\n", m=m)
    assert rows["end"][:, :3].tolist() == [
        [1, 0, 0],
        [1, 0, 1],
        [1, 0, 25],
        [1, 21, 25],
        [1, 21, 5],
    ]


def test_absolute_centre_carries_the_offset():
    """With G161 the centre stands in the same frame as the end point."""
    m = modal()
    m.zero[0], m.centre_absolute = 100.0, 1
    lib.nc_modal_offsets(m)
    _, rows, _, _ = scan("G00 X10\nG03 F60 X0 Y10 I0 J0\n", m=m)
    assert rows["type"].tolist() == [LINEAR, CIRCULAR]
    assert rows["center"][1].tolist() == [100.0, 0.0]
    assert rows["radius"][1] == 10.0


def test_random_bytes_do_no_harm():
    """Any bytes give a reason to stop; the state stays finite and nothing is
    written behind the rows.
    """
    rng = random.Random(1)
    words = [
        b"G01",
        b"G2",
        b"X",
        b"Y-",
        b"I",
        b"R",
        b"F9",
        b".",
        b"1",
        b"9999999999",
        b"(",
        b")",
        b";",
        b"\\",
        b"\n",
        b"\r\n",
        b" ",
        b"=",
        b"\0",
    ]
    for _ in range(3000):
        raw = (
            rng.randbytes(rng.randint(0, 60))
            if rng.random() < 0.3
            else b"".join(rng.choices(words, k=rng.randint(0, 40)))
        )
        stop, rows, result, m = scan(
            raw, final=rng.random() < 0.5, room=rng.randint(0, 4)
        )
        assert stop in (0, 1, 2, 3)
        assert result.consumed <= len(raw)
        assert np.isfinite(rows["end"]).all()
        assert np.isfinite(list(m.pos)).all()
