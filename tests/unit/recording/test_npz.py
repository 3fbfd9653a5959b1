"""An npz of a stranger: what its members say is compared before it is read."""

from __future__ import annotations

import io
import json
import resource
import subprocess
import sys
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.errors import CncError
from cnc_core.recording.inspect import first_rows, state_at, statistics
from cnc_core.recording.reading import Recording

TYPES = {"cycle": "uint64", "t": "double", "v": "double", "text": "string"}
ROWS = 3
GOOD: dict[str, Any] = {
    "cycle": np.arange(ROWS, dtype=np.uint64),
    "t": np.arange(ROWS) * 0.5,
    "v": np.arange(ROWS) * 1.5,
    "text": np.array(["", "a", "\N{GREEK SMALL LETTER MU}m"]),
}


def bytes_of(array: Any) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array(file, np.asarray(array))
    return file.getvalue()


def with_header(header: str) -> bytes:
    """A member that ends behind its header."""
    text = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text


def claiming(shape: str, descr: str = "<f8") -> bytes:
    return with_header(
        f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}}}"
    )


def npz(folder: Path, **members: Any) -> Path:
    """A recording; ``members``: columns that are others, None: missing."""
    path = folder / "a.npz"
    meta = {"types": {"cycles": TYPES}, "rows": {"cycles": ROWS}}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("meta.npy", bytes_of(json.dumps(meta)))
        for name, array in (GOOD | members).items():
            if array is None:
                continue
            data = array if isinstance(array, bytes) else bytes_of(array)
            file.writestr(f"cycles.{name}.npy", data)
    return path


def test_a_good_one_is_read(tmp_path: Path) -> None:
    """Numbers and texts are what was written."""
    cycles = Recording(npz(tmp_path)).cycles
    for name, values in GOOD.items():
        assert cycles[name].tolist() == values.tolist()


@pytest.mark.parametrize(
    "column",
    [
        None,
        claiming("(1000000000000,)"),
        claiming("(3,)"),
        claiming("(3,)", "|O"),
        claiming("(-3,)"),
        with_header("__import__('os')"),
        with_header("[" * 3000),
        b"",
        b"no array",
        bytes_of(np.zeros(3)) + b"more",
        np.zeros(2),
        np.zeros(4),
        np.zeros((3, 1)),
        np.zeros(3, np.float32),
        np.zeros(3, ">f8"),
        np.zeros(3, bool),
        np.array(["a", "b", "c"]),
    ],
)
def test_a_column_that_is_not_what_it_says(column: Any, tmp_path: Path) -> None:
    """The file is named with one number, by whatever reads it."""
    recording = Recording(npz(tmp_path, v=column))
    readers = (
        lambda: recording.cycles["v"],
        lambda: state_at(recording, "time", 0.0),
        lambda: first_rows(recording.cycles, (), 1),
    )
    for read in readers:
        with pytest.raises(CncError, match=r"a\.npz: no recording") as caught:
            read()
        assert caught.value.code == 901002


@pytest.mark.parametrize("text", [claiming("(3,)", "<U0"), np.zeros(3)])
def test_texts_that_are_none(text: Any, tmp_path: Path) -> None:
    """Texts without a width would take no bytes, however many there are."""
    with pytest.raises(CncError, match="no recording"):
        _ = Recording(npz(tmp_path, text=text)).cycles["text"]


@pytest.mark.parametrize(
    "meta",
    [
        {"types": {"cycles": {}}, "rows": {"cycles": 3}},
        {"types": {"cycles": {"v": "list"}}, "rows": {"cycles": 0}},
        {"types": {"cycles": TYPES}, "rows": {"cycles": -1}},
        {"types": {"cycles": TYPES}, "rows": {"cycles": float("inf")}},
        {"types": {"cycles": TYPES}, "rows": {}, "columns": []},
        {"types": {"cycles": TYPES}, "rows": {}, "columns": {"cycles": 1}},
    ],
)
def test_an_account_that_cannot_be(meta: Any, tmp_path: Path) -> None:
    """It is refused when the file is opened."""
    path = tmp_path / "a.npz"
    np.savez(path, meta=np.array(json.dumps(meta)))
    with pytest.raises(CncError, match=r"a\.npz: no recording"):
        Recording(path)


READ = "import sys\nfrom cnc_core.recording.reading import Recording\n"


def test_a_bomb_takes_no_memory(tmp_path: Path) -> None:
    """512 MiB of zeros where few rows are told."""
    path = npz(tmp_path, v=None)
    with (
        zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as z,
        z.open("cycles.v.npy", "w") as out,
    ):
        out.write(claiming(f"({1 << 26},)"))
        for _ in range(1 << 5):
            out.write(bytes(1 << 24))
    code = "Recording(sys.argv[1]).cycles['v']"
    limit = (1 << 29, 1 << 29)
    done = subprocess.run(
        [sys.executable, "-P", "-c", READ + code, path],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, limit),
    )
    assert "901002" in done.stderr
    assert "MemoryError" not in done.stderr


def test_a_member_of_more_than_the_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A good column is refused where it is larger than a member may be."""
    bound = "cnc_core.recording.npz_member.array_of.__defaults__"
    monkeypatch.setattr(bound, (100,))
    with pytest.raises(CncError, match="no recording"):
        _ = Recording(npz(tmp_path)).cycles["v"]


def test_a_column_without_a_number_warns_of_nothing(tmp_path: Path) -> None:
    """Nothing is recorded at any time of it; figures are what they are."""
    nan = np.full(ROWS, np.nan)
    recording = Recording(npz(tmp_path, t=nan, v=nan))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(CncError, match="nothing is recorded"):
            state_at(recording, "time", 1.0)
        assert state_at(recording, "cycle", 1)["cycles"] is not None
        assert statistics(recording.cycles)[0] == ROWS
