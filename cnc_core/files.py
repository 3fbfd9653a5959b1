"""The files that a program may read and write: one policy for all dialects.

A program reads below its own folder and below the folders that the cell names.
It writes below the folder of the run.  A name with ``..`` or an absolute one is
refused.  So is a link on the way, and what is no regular file.  Nothing is
opened before its kind is known, so a FIFO or a device cannot block.
"""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import BinaryIO, NamedTuple

from .errors import ERRORS, CncError, Place

DATA_BYTES = 16 << 20
"""The largest file that is read at once: variables, answers."""
WRITTEN_BYTES = 64 << 20
"""What a program may write in one run, all files together."""
WRITTEN_FILES = 1000
"""Files that a program may write in one run."""
_FOLDER = os.O_PATH | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_LOOK = os.O_PATH | os.O_NOFOLLOW | os.O_CLOEXEC
_KINDS = (
    (stat.S_ISLNK, "a link"),
    (stat.S_ISFIFO, "a FIFO"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def inside(name: str) -> PurePosixPath:
    """A name as a path that stays in its folder; CncError 907053 for any other."""
    path = PurePosixPath(name.replace("\\", "/"))
    if (
        not name.strip()
        or path.is_absolute()
        or ".." in path.parts
        or ":" in name
        or "\0" in name
    ):
        raise CncError(907053, f"{name!r}: {ERRORS[907053]}")
    return path


def _refuse_kind(path: Path, mode: int) -> None:
    if stat.S_ISDIR(mode):
        raise CncError(
            901002,
            "file cannot be read: Is a directory",
            Place(file=str(path)),
        )
    for is_kind, kind in _KINDS:
        if is_kind(mode):
            raise CncError(
                901005,
                f"{path} is {kind}: {ERRORS[901005]}",
                Place(file=str(path)),
            )


def _reopened(look: int, flags: int) -> int:
    """A descriptor for the very file that was looked at."""
    return os.open(f"/proc/self/fd/{look}", flags | os.O_CLOEXEC)


def open_regular(path: Path) -> BinaryIO:
    """A file that the user has named, for reading.

    Links are followed.  CncError 901001, 901002; 901005: no regular file.
    """
    try:
        look = os.open(path, os.O_PATH | os.O_CLOEXEC)
        try:
            _refuse_kind(path, os.fstat(look).st_mode)
            return os.fdopen(_reopened(look, os.O_RDONLY), "rb")
        finally:
            os.close(look)
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from None


def need_program(path: Path) -> None:
    """A program that other processes shall read.

    CncError 901001: it is not there; 901005: it is a folder, a device, a FIFO or
    a socket; 901002: its name is no text, so it cannot be handed over, recorded
    or shown.
    """
    if not path.exists():
        raise CncError(901001, "file not found", Place(str(path)))
    if path.is_dir():
        text = "a folder, no program; name the file"
        raise CncError(901005, text, Place(str(path)))
    _refuse_kind(path, path.stat().st_mode)
    try:
        str(path).encode()
    except UnicodeEncodeError:
        shown = str(path).encode(errors="backslashreplace").decode()
        text = "the name of the program is not UTF-8; rename it"
        raise CncError(901002, text, Place(shown)) from None


def unreadable(path: Path, error: OSError | ValueError) -> CncError:
    """901001 for a file that is not there, 901002 for any other failure."""
    place = Place(file=str(path))
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        return CncError(901001, f"file not found: {path}", place)
    reason = error.strerror if isinstance(error, OSError) else "no file name"
    return CncError(901002, f"file cannot be read: {reason}", place)


def read_text(path: Path) -> str:
    """Text of a file that the user has named, at most DATA_BYTES.

    CncError as ``open_regular``; 901006: too long.
    """
    with open_regular(path) as file:
        return _text_of(file, path)


def _text_of(file: BinaryIO, path: Path) -> str:
    data = file.read(DATA_BYTES + 1)
    if len(data) > DATA_BYTES:
        raise CncError(
            901006,
            f"{path}: more than {DATA_BYTES >> 20} MiB",
            Place(file=str(path)),
        )
    return data.decode("utf-8", "replace")


@contextmanager
def _parent_of(root: Path, parts: tuple[str, ...]) -> Iterator[int]:
    """The folder of the last part, reached from ``root`` without a link."""
    folder = os.open(root, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        way = root
        for part in parts[:-1]:
            way /= part
            try:
                inner = os.open(part, _FOLDER, dir_fd=folder)
            except NotADirectoryError:
                mode = os.stat(
                    part, dir_fd=folder, follow_symlinks=False
                ).st_mode
                _refuse_kind(way, mode)
                raise
            os.close(folder)
            folder = inner
        yield folder
    finally:
        os.close(folder)


class Folders:
    """The folders below which a program may read; its own is the first.

    ``named``: files that the cell names by an absolute path.
    """

    def __init__(
        self,
        own: Path,
        configured: Iterable[Path] = (),
        named: Iterable[str] = (),
    ) -> None:
        self.own = own
        self._named = frozenset(n for n in named if Path(n).is_absolute())
        self._roots = [own, *configured]
        self._roots += [Path(name).parent for name in sorted(self._named)]

    def place(self, name: str, folder: Path) -> Path:
        """Where ``name`` is below ``folder``; CncError 907053: nowhere."""
        if name in self._named:
            return Path(name)
        return folder / inside(name)

    def _root(self, path: Path) -> Path:
        for root in self._roots:
            if path == root or not path.is_relative_to(root):
                continue
            if ".." not in path.relative_to(root).parts:
                return root
        raise CncError(907053, f"{str(path)!r}: {ERRORS[907053]}")

    @contextmanager
    def _looked_at(self, path: Path) -> Iterator[int]:
        """A descriptor that knows what ``path`` is and opens nothing."""
        root = self._root(path)
        parts = path.relative_to(root).parts
        with _parent_of(root, parts) as folder:
            look = os.open(parts[-1], _LOOK, dir_fd=folder)
        try:
            yield look
        finally:
            os.close(look)

    def has(self, path: Path) -> bool:
        """There is a file; CncError 901005: it is a link, a FIFO, a device."""
        try:
            with self._looked_at(path) as look:
                mode = os.fstat(look).st_mode
        except (OSError, ValueError):
            return False
        if stat.S_ISDIR(mode):
            return False
        _refuse_kind(path, mode)
        return True

    def open(self, path: Path) -> BinaryIO:
        """A regular file below one of the folders, for reading.

        CncError 901001, 901002; 901005: a link on the way, or no regular file.
        """
        try:
            with self._looked_at(path) as look:
                _refuse_kind(path, os.fstat(look).st_mode)
                return os.fdopen(_reopened(look, os.O_RDONLY), "rb")
        except (OSError, ValueError) as error:
            raise unreadable(path, error) from None

    def read_text(self, path: Path) -> str:
        """Text of a file below one of the folders, at most DATA_BYTES."""
        with self.open(path) as file:
            return _text_of(file, path)


class Quota:
    """How much a program may write in one run; CncError 901007 behind it."""

    def __init__(self) -> None:
        self._bytes = 0
        self._names: set[str] = set()

    def take(self, name: str, text: str) -> None:
        self._bytes += len(text.encode("utf-8", "replace"))
        self._names.add(name)
        if self._bytes > WRITTEN_BYTES:
            raise CncError(
                901007,
                f"{name}: the program has written {WRITTEN_BYTES >> 20} MiB,"
                " more is not allowed in a run",
            )
        if len(self._names) > WRITTEN_FILES:
            raise CncError(
                901007,
                f"{name}: the program has written {WRITTEN_FILES} files,"
                " more are not allowed in a run",
            )


class _Wanted(NamedTuple):
    """A file that a program writes: its path, its place in the run's folder, a
    descriptor of the folder that holds it, O_APPEND or O_TRUNC, the bytes.
    """

    path: Path
    inner: PurePosixPath
    folder: int
    how: int
    data: bytes


class RunFolder:
    """The folder of the run; it is made with the first file.

    A file of an earlier run may be read and grow.  It is replaced if it
    differs from the new one in its numbers alone: a list of variables is kept
    from run to run, and no program, cell or PLC looks like one.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._quota = Quota()
        self._made: dict[PurePosixPath, tuple[int, int]] = {}

    def read(self, name: str) -> str | None:
        """Text of a file, None if there is none; errors as ``Folders``."""
        folders = Folders(self._folder)
        path = folders.place(name, self._folder)
        return folders.read_text(path) if folders.has(path) else None

    def append(self, name: str, text: str) -> None:
        """Add text to a file.

        CncError 907053, 901004, 901005; 901007: too much.
        """
        self._put(name, text, os.O_APPEND)

    def write(self, name: str, text: str) -> None:
        """Write a file, or write it again.

        Errors as ``append``; 901008: the run has not written the file, and its
        words are others.
        """
        self._put(name, text, os.O_TRUNC)

    def _put(self, name: str, text: str, how: int) -> None:
        inner = inside(name)
        path = self._folder / inner
        self._quota.take(str(inner), text)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._make_folders(inner)
            data = text.encode("utf-8", "replace")
            with _parent_of(self._folder, inner.parts) as folder:
                fd = self._opened(_Wanted(path, inner, folder, how, data))
                if fd is None:
                    self._replace(inner, folder, data)
                    return
            with os.fdopen(fd, "wb") as file:
                file.write(data)
        except OSError as error:
            raise CncError(901004, f"{path}: {error.strerror}") from None

    def _make_folders(self, inner: PurePosixPath) -> None:
        for count in range(1, len(inner.parts)):
            part = inner.parts[:count]
            with _parent_of(self._folder, part) as folder:
                try:
                    os.mkdir(part[-1], dir_fd=folder)
                except FileExistsError:
                    continue

    def _opened(self, wanted: _Wanted) -> int | None:
        """A descriptor for writing: of a new file, or of one that may grow.

        None: the file is there and may be replaced.
        """
        new = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        name, folder = wanted.inner.name, wanted.folder
        try:
            fd = os.open(name, new, 0o666, dir_fd=folder)
        except FileExistsError:
            return self._again(wanted)
        info = os.fstat(fd)
        self._made[wanted.inner] = info.st_dev, info.st_ino
        return fd

    def _again(self, wanted: _Wanted) -> int | None:
        """As ``_opened``, for a file that is there."""
        path, inner, how = wanted.path, wanted.inner, wanted.how
        look = os.open(inner.name, _LOOK, dir_fd=wanted.folder)
        try:
            info = os.fstat(look)
            _refuse_kind(path, info.st_mode)
            own = self._made.get(inner) == (info.st_dev, info.st_ino)
            foreign = info.st_nlink != 1 or info.st_uid != os.getuid()
            if own or not (foreign or how == os.O_TRUNC):
                return _reopened(look, os.O_WRONLY | how)
            if foreign or not _is_like(look, wanted.data):
                raise CncError(901008, f"{path}: {ERRORS[901008]}")
            return None
        finally:
            os.close(look)

    def _replace(self, inner: PurePosixPath, folder: int, data: bytes) -> None:
        """Put a whole file in the place of an old one: a run that dies
        meanwhile leaves the old one.
        """
        aside = f".{secrets.token_hex(8)}.new"
        new = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        fd = os.open(aside, new, 0o666, dir_fd=folder)
        try:
            with os.fdopen(fd, "wb") as file:
                info = os.fstat(fd)
                file.write(data)
            os.rename(aside, inner.name, src_dir_fd=folder, dst_dir_fd=folder)
        except BaseException:
            os.unlink(aside, dir_fd=folder)
            raise
        self._made[inner] = info.st_dev, info.st_ino


def _is_like(look: int, new: bytes) -> bool:
    """The file has the words of ``new``; the numbers may differ."""
    with os.fdopen(_reopened(look, os.O_RDONLY), "rb") as file:
        old = file.read(DATA_BYTES + 1)
    return len(old) <= DATA_BYTES and _words(old) == _words(new)


def _words(data: bytes) -> list[bytes]:
    """All that is no number."""
    return [word for word in data.split() if not _is_number(word)]


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
