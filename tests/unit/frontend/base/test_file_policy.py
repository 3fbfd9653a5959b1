"""What a program may read and write: below its folder and the folder of the run.

One policy for all dialects.  Each way out is tried with each function that
names a file: it is refused by name, nothing blocks, and no text of the file
shows.
"""

from __future__ import annotations

import errno
import gc
import os
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from cnc_core.config import parse_config
from cnc_core.errors import CncError, Place
from cnc_core.files import RunFolder
from cnc_core.frontend.base.block_text import BlockText
from cnc_core.program import Program

SECRET = "G1 X77 F1000 ; the secret of another folder"
# function: dialect and program text with WAY
READERS = {
    "isg_call": ("isg", "L WAY\nM30\n"),
    "isg_cycle": ("isg", 'L CYCLE [NAME="WAY" @P1=1]\nM30\n'),
    "isg_file_m6": ("isg", '#FILE NAME [M6="WAY"]\nM6\nM30\n'),
    "isg_file_g80": ("isg", '#FILE NAME [G80="WAY"]\nG80\nM30\n'),
    "isons_import": ("isons", 'IMPORT "WAY"\nM30\n'),
    "isons_load": ("isons", 'LOAD_VAR "WAY"\nM30\n'),
    "isons_exists": ("isons", '$a = 0\nFILE_EXISTS $a, "WAY"\nM30\n'),
    "osai_call": ("osai", "(CLS,WAY)\nM30\n"),
    "osai_setup": ("osai", "(HSM,WAY)\nM30\n"),
}
WAYS = {
    "../out/secret.nc": 907053,
    "sub/../../out/secret.nc": 907053,
    "ABSOLUTE": 907053,
    "link.nc": 901005,
    "linked/secret.nc": 901005,
    "fifo": 901005,
    "sub/fifo": 901005,
    "null": 901005,
}


@pytest.fixture
def here() -> Iterator[Path]:
    """A program's folder with every way out of it; of a short name, since a
    program's name has 83 characters at most.
    """
    with tempfile.TemporaryDirectory() as folder:
        yield with_ways_out(Path(folder))


def with_ways_out(folder: Path) -> Path:
    own, out = folder / "own", folder / "out"
    (own / "sub").mkdir(parents=True)
    out.mkdir()
    (out / "secret.nc").write_text(SECRET)
    (own / "link.nc").symlink_to(out / "secret.nc")
    (own / "linked").symlink_to(out)
    (own / "null").symlink_to("/dev/null")
    os.mkfifo(own / "fifo")
    os.mkfifo(own / "sub" / "fifo")
    return own


def errors_of(
    folder: Path, dialect: str, text: str, cell: str = ""
) -> list[CncError]:
    """Errors of a program in ``folder``, as ``check`` collects them."""
    path = folder / f"main.{dialect}"
    path.write_text(text)
    program = Program(path, parse_config(cell), dialect, collect=True)
    for _ in program.batches():
        pass
    return [*program.reader.errors]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("function", READERS)
def test_no_dialect_reads_outside_its_folder(
    here: Path, function: str, way: str
) -> None:
    """By name: the name's error, its place, and no text of the file."""
    dialect, text = READERS[function]
    name = way.replace("ABSOLUTE", str(here.parent / "out" / "secret.nc"))
    errors = errors_of(here, dialect, text.replace("WAY", name))
    assert WAYS[way] in [error.code for error in errors], errors
    assert not any("secret of" in str(error) for error in errors)
    place = next(e.place for e in errors if e.code == WAYS[way])
    assert (Path(place.file).name, place.line > 0) == (f"main.{dialect}", True)


@pytest.mark.parametrize("name", ["sub.nc", "sub/inner.nc", "sub/INNER.NC"])
def test_what_lies_below_the_folder_is_read(here: Path, name: str) -> None:
    (here / "sub.nc").write_text("M17\n")
    (here / "sub" / "inner.nc").write_text("M17\n")
    assert not errors_of(here, "isg", f"L {name}\nM30\n")


def test_folders_of_the_cell_are_read(here: Path) -> None:
    """Macros of an IsoNs cell, a tool change that the cell names."""
    macros = here.parent / "macros"
    macros.mkdir()
    (macros / "M200.isons").write_text("X1\n")
    (macros / "change.nc").write_text("M17\n")
    text = f'[isons]\nmacro_folder = "{macros}"\n'
    assert not errors_of(here, "isons", "M200\nM30\n", text)
    text = f'[channel]\nm6_program = "{macros}/change.nc"\n'
    assert not errors_of(here, "isg", "M6\nM30\n", text)


@pytest.mark.parametrize("dialect", ["isg", "iso", "isons", "osai"])
def test_a_program_that_is_a_fifo_does_not_block(
    here: Path, dialect: str
) -> None:
    with pytest.raises(CncError) as caught:
        Program(here / "fifo", parse_config(""), dialect)
    assert caught.value.code == 901005


def test_variables_that_are_none_do_not_show(here: Path) -> None:
    (here / "values.txt").write_text("1\nhush\n")
    (error,) = errors_of(here, "isons", 'LOAD_VAR "values.txt"\nM30\n')
    assert (error.code, "hush" in str(error)) == (909107, False)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[isons]\nFEEDRES = inf\n", "FEEDRES"),
        ("[isons]\nFEEDRES = nan\n", "FEEDRES"),
        ("[isons]\nFEEDRES = 1e400\n", "FEEDRES"),
        (
            '[kinematics.9]\ntype = "head-head"\nlinear = ["X", "", "Z"]\n'
            'rotary = ["C", "B"]\ndirections = { X = [-1.0, 0.0, 0.0] }\n',
            "linear",
        ),
        ("[axes.X" + "1" * 16 + "]\n", "at most 15"),
        ('[axes."XÄ"]\n', "axis name"),
        ("a = " + "[" * 20_000 + "]" * 20_000, "deeply"),
    ],
)
def test_a_wrong_cell_is_an_error_with_words(text: str, said: str) -> None:
    with pytest.raises(CncError, match=said) as caught:
        parse_config(text)
    assert caught.value.code == 902001


@pytest.mark.parametrize(
    ("dialect", "line"),
    [
        ("isg", "G1 X Y"),
        ("iso", "G1 X Y"),
        ("isons", "G1 X Y"),
        ("isons", "IF $a"),
        ("isons", "END_LOOP"),
        ("osai", "G1 X Y"),
    ],
)
@pytest.mark.ci
def test_errors_that_check_collects_are_bounded(
    here: Path, dialect: str, line: str
) -> None:
    """A file of wrong lines only: 1000 errors, one that says so, the end.

    What is looked for ahead of the first block is bounded as well: no more
    errors and blocks are kept than are told.
    """
    path = here / f"main.{dialect}"
    path.write_text(f"{line}\n" * 6_000)
    program = Program(path, parse_config(""), dialect, collect=True)
    for _ in program.batches():
        pass
    gc.collect()
    kept = Counter(type(item) for item in gc.get_objects())
    assert len(program.errors) == 1001
    assert program.errors[-1].code == 900022
    assert all(error.__traceback__ is None for error in program.errors)
    assert kept[CncError] + kept[BlockText] < 4_000


def test_errors_of_stages_are_bounded_with_the_others(here: Path) -> None:
    """Errors that lie behind the front end count to the same 1000."""
    path = here / "main.isg"
    path.write_text("G1 X1 F1000\nX Y\nM30\n")
    program = Program(path, parse_config(""), "isg", collect=True)
    for line in range(5000):
        program.reader.collect_once(CncError(906001, "", Place("", line)))
    for _ in program.batches():
        pass
    assert len(program.errors) == 1001
    assert 900022 in [error.code for error in program.errors]


# writing


@pytest.mark.parametrize("how", ["append", "write"])
@pytest.mark.parametrize(
    "name", ["link.txt", "folder/x.txt", "hard.txt", "fifo", "sub"]
)
def test_writing_never_leaves_the_folder(
    tmp_path: Path, how: str, name: str
) -> None:
    """No link, no FIFO, no second name of a file elsewhere."""
    out, other = tmp_path / "run", tmp_path / "other"
    (out / "sub").mkdir(parents=True)
    other.mkdir()
    kept = other / "kept.txt"
    kept.write_text("kept")
    (out / "link.txt").symlink_to(kept)
    (out / "folder").symlink_to(other)
    (out / "hard.txt").hardlink_to(kept)
    os.mkfifo(out / "fifo")
    with pytest.raises(CncError) as caught:
        getattr(RunFolder(out), how)(name, "x")
    assert caught.value.code in (901002, 901005, 901008)
    assert kept.read_text() == "kept"
    assert [path.name for path in other.iterdir()] == ["kept.txt"]


def test_a_run_replaces_only_what_it_has_written(tmp_path: Path) -> None:
    """A file of before may grow, it is never replaced."""
    (tmp_path / "old.txt").write_text("old\n")
    folder = RunFolder(tmp_path)
    folder.write("a/new.txt", "long text\n")
    folder.write("a/new.txt", "1\n")
    assert folder.read("a/new.txt") == "1\n"
    with pytest.raises(CncError) as caught:
        folder.write("old.txt", "x")
    assert caught.value.code == 901008
    folder.append("old.txt", "more\n")
    with pytest.raises(CncError):
        folder.write("old.txt", "x")
    assert (tmp_path / "old.txt").read_text() == "old\nmore\n"


def test_a_list_of_numbers_is_kept_from_run_to_run(tmp_path: Path) -> None:
    """SAVE_VAR of a later run takes the place of an earlier one's list."""
    for text in ("7", "-0.5\n1e3\n", ""):
        (tmp_path / "list.txt").write_text(text)
        folder = RunFolder(tmp_path)
        folder.write("list.txt", "8.0\n")
        folder.write("list.txt", "9.0\n")
        assert (tmp_path / "list.txt").read_text() == "9.0\n"
    assert [path.name for path in tmp_path.iterdir()] == ["list.txt"]


def test_a_result_with_labels_is_written_anew(tmp_path: Path) -> None:
    """The same words and other numbers; other words are kept."""
    old, new = "X-Axis: 1.0 0.0 0.0\n", "X-Axis: 0.0 -1.0 0.0\n"
    (tmp_path / "a.txt").write_text(old)
    RunFolder(tmp_path).write("a.txt", new)
    assert (tmp_path / "a.txt").read_text() == new
    with pytest.raises(CncError) as caught:
        RunFolder(tmp_path).write("a.txt", "1.0\n")
    assert caught.value.code == 901008
    assert (tmp_path / "a.txt").read_text() == new


def test_a_list_that_is_replaced_is_never_half(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that cannot write the new list leaves the old one, and no other
    file.
    """
    (tmp_path / "count.txt").write_text("41.0\n")

    def fail(*_: object, **__: object) -> None:
        raise OSError(errno.EIO, "no")

    monkeypatch.setattr(os, "rename", fail)
    with pytest.raises(CncError) as caught:
        RunFolder(tmp_path).write("count.txt", "42.0\n")
    assert caught.value.code == 901004
    assert (tmp_path / "count.txt").read_text() == "41.0\n"
    assert [path.name for path in tmp_path.iterdir()] == ["count.txt"]


def test_a_file_laid_in_the_way_is_not_written(tmp_path: Path) -> None:
    """The run's own file was taken away, another one has its name."""
    folder = RunFolder(tmp_path)
    folder.write("a.txt", "mine")
    (tmp_path / "a.txt").rename(tmp_path / "b.txt")
    (tmp_path / "a.txt").write_text("foreign")
    with pytest.raises(CncError):
        folder.write("a.txt", "x")
    assert (tmp_path / "a.txt").read_text() == "foreign"


def test_writing_has_a_quota(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bytes and files of a run, in ``check`` as well."""
    monkeypatch.setattr("cnc_core.files.WRITTEN_BYTES", 1000)
    loop = '$WHILE 1\n#MSG SAVE ["0123456789"]\n$ENDWHILE\nM30\n'
    (tmp_path / "a.nc").write_text(loop)
    program = Program(tmp_path / "a.nc", parse_config(""), "isg")
    with pytest.raises(CncError) as caught:
        for _ in program.batches():
            pass
    assert caught.value.code == 901007
    folder = RunFolder(tmp_path)
    monkeypatch.setattr("cnc_core.files.WRITTEN_FILES", 3)
    for number in range(3):
        folder.append(f"{number}", "")
    with pytest.raises(CncError) as caught:
        folder.append("4", "")
    assert caught.value.code == 901007
