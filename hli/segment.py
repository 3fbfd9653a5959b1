"""The shared-memory segment: create, attach, publish, remove.

A segment is one POSIX shared-memory object of the owner's user, mode 0600.  Its
creator writes the head with the ``ready`` word last (release) and is the only
one that unlinks it; an attaching process checks owner, mode, magic, ABI
version, ``ready``, size and layout hash, in this order, and never removes
anything when it ends.  A segment whose owner (process id and start time) is
dead is stale: ``create`` replaces it and ``sweep`` removes it.
"""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import errno
import mmap
import os
import re
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import posix_ipc

from . import access, layout
from ._sync import ffi, lib
from .errors import (
    HliAccessError,
    HliError,
    HliInUse,
    HliNotFound,
    HliNotReady,
    HliTimeout,
    HliVersionError,
)
from .export import layout_hash

SHM_DIR = access.SHM_DIR
LOCK_S = 2.0
"""How long another process of this user may hold a segment's lock."""
NAME_RULE = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
SEGMENT_SIZE = ctypes.sizeof(layout.HLI_SEGMENT)
HEAD_SIZE = ctypes.sizeof(layout.HLI_SEGMENT_HEAD)
# process id, its start time, a random number
DRAFT_RULE = re.compile(r"\.hli-new-(\d{1,10})-(\d{1,20})-\d{1,20}")
_CREATE_TRIES = 5
_made: dict[str, tuple[int, tuple[int, int]]] = {}
"""Names that a process took, with its id and the file; see _remove_made()."""


class Segment:
    """A mapped segment.

    ``root`` is the ctypes structure over the memory, ``base`` its address.
    """

    def __init__(
        self,
        name: str,
        memory: mmap.mmap,
        owner: bool,
        identity: tuple[int, int] | None = None,
    ) -> None:
        self.name = name
        self._identity = identity  # device and inode
        self.owner = owner
        self.memory: mmap.mmap | None = memory
        self.root: Any = _root_over(memory)
        self.base = ctypes.addressof(self.root)
        lib.hs_guard(self.pointer(0), len(memory))

    def pointer(self, offset: int) -> Any:
        """cffi ``void *`` to the byte at ``offset``; valid as long as the
        segment is mapped.
        """
        return ffi.cast("void *", self.base + offset)

    def publish(self) -> None:
        """Set the ``ready`` word (release): from here on other processes may attach."""
        offset = (
            layout.HLI_SEGMENT.segment_head.offset
            + layout.HLI_SEGMENT_HEAD.ready.offset
        )
        lib.hs_store_u32(self.pointer(offset), 1)

    @property
    def lost(self) -> bool:
        """Somebody has cut the file or written over its head.

        The memory then holds zeros, and no other process sees it.
        """
        return self.root is not None and (
            bool(lib.hs_guard_lost(self.pointer(0)))
            or self.root.segment_head.magic != layout.HLI_MAGIC
        )

    def owner_alive(self) -> bool:
        """Whether the process that created the segment still runs."""
        head = self.root.segment_head
        return bool(lib.hs_process_alive(head.owner_pid, head.owner_start))

    @contextlib.contextmanager
    def locked(self, wait_s: float = LOCK_S) -> Iterator[None]:
        """Hold the segment's file lock: attaching PLCs look and register one
        after the other.

        HliNotFound: removed or replaced.  HliAccessError: no longer this
        user's alone.  HliTimeout: somebody has held the lock for ``wait_s``.
        """
        fd = access.open_file(self.name, os.O_RDONLY)
        try:
            if self._identity not in (None, _identity(fd)):
                raise HliNotFound(f"segment {self.name!r} has been replaced")
            if not access.lock(fd, wait_s):
                raise HliTimeout(
                    f"segment {self.name!r} has been locked for {wait_s:g} s"
                )
            yield
        finally:
            os.close(fd)

    def close(self) -> None:
        """Give the mapping up; memory that views still look at is unmapped when
        the last of them goes.
        """
        memory, self.memory, self.root = self.memory, None, None
        if memory is not None:
            lib.hs_unguard(self.pointer(0))
            with contextlib.suppress(
                BufferError
            ):  # a view still holds the memory
                memory.close()

    def unlink(self) -> None:
        """Remove the name (the creator's duty); attached processes keep their
        mapping.
        """
        remove(self.name)

    def __enter__(self) -> Segment:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
        if self.owner:
            self.unlink()


def _root_over(memory: mmap.mmap) -> Any:
    """The structure over a mapping; it keeps the mapping alive."""
    with memoryview(memory) as view:
        writable = not view.readonly
    if writable:
        return layout.HLI_SEGMENT.from_buffer(memory)
    # ctypes takes no buffer that cannot be written, so it gets the address
    held = ffi.from_buffer(memory)
    root: Any = layout.HLI_SEGMENT.from_address(
        int(ffi.cast("uintptr_t", held))
    )
    root.held = held
    return root


def check_name(name: str) -> str:
    """The name itself, or ValueError: 1 to 64 letters, digits, ``.``, ``_``,
    ``-``, beginning with letter or digit.
    """
    if not NAME_RULE.fullmatch(name):
        raise ValueError(
            f"segment name {name!r}: use 1 to 64 letters, digits, '.', '_' or '-', "
            "beginning with a letter or digit"
        )
    return name


def remove(name: str) -> None:
    """Unlink the name; nothing happens if it is gone already.

    Raises HliAccessError for another user's file; ValueError for a wrong name.
    """
    _unlink(check_name(name))
    _made.pop(name, None)


@atexit.register
def _remove_made() -> None:
    """A creator that an exception ends at any point leaves no name behind."""
    for name, (pid, identity) in list(_made.items()):
        with contextlib.suppress(OSError, HliError):
            info = (SHM_DIR / name).lstat()
            if (pid, identity) == (os.getpid(), (info.st_dev, info.st_ino)):
                _unlink(name)


def _unlink(name: str) -> None:
    try:
        posix_ipc.unlink_shared_memory("/" + name)
    except posix_ipc.ExistentialError:
        pass
    except (posix_ipc.PermissionsError, PermissionError):
        raise HliAccessError(
            f"segment {name!r} may not be removed by this user"
        ) from None


# ------------------------------------------------------------------------------------------------
# create
def create(
    name: str, channel_count: int = 1, axis_count: int = 3, ready: bool = True
) -> Segment:
    """Create, zero and (unless ``ready`` is False) publish the segment; a stale
    one of this name is replaced.

    With ``ready=False`` the creator fills in the areas and calls
    ``Segment.publish()`` itself. Raises ValueError (name, counts), HliInUse (a
    living owner, or a file that is no segment, holds the name), HliError (no
    room in /dev/shm).
    """
    check_name(name)
    if not 1 <= channel_count <= layout.HLI_SYS_CH_MAXIDX + 1:
        raise ValueError(
            f"channel_count {channel_count}: 1..{layout.HLI_SYS_CH_MAXIDX + 1}"
        )
    if not 0 <= axis_count <= layout.HLI_SYS_AX_MAXIDX + 1:
        raise ValueError(
            f"axis_count {axis_count}: 0..{layout.HLI_SYS_AX_MAXIDX + 1}"
        )
    memory, identity = _map_new(name, channel_count, axis_count)
    segment = Segment(name, memory, True, identity)
    if ready:
        segment.publish()
    return segment


def _map_new(
    name: str, channel_count: int, axis_count: int
) -> tuple[mmap.mmap, tuple[int, int]]:
    """The memory, head written, with its name in one step: a creator that dies
    leaves no nameless head behind.
    """
    _sweep_drafts()
    shared = _open_draft(name)
    try:
        _reserve(name, shared.fd)
        memory = mmap.mmap(shared.fd, SEGMENT_SIZE)
        try:
            _write_head(memory, channel_count, axis_count)
            _made[name] = os.getpid(), _identity(shared.fd)
            _take_name(name, shared.name)
        except BaseException:
            memory.close()
            raise
        return memory, _identity(shared.fd)
    finally:
        shared.close_fd()
        _unlink(shared.name[1:])


def _open_draft(name: str) -> posix_ipc.SharedMemory:
    """Sized memory under a name that tells whose it is and that nobody guesses."""
    pid = os.getpid()
    start = lib.hs_process_start(pid)
    draft = f"/.hli-new-{pid}-{start}-{secrets.randbits(60)}"
    try:
        shared = posix_ipc.SharedMemory(
            draft, posix_ipc.O_CREX, mode=access.MODE, size=SEGMENT_SIZE
        )
    except (posix_ipc.Error, OSError, ValueError) as error:
        raise _no_room(name, error) from None
    os.fchmod(shared.fd, access.MODE)  # whatever the umask takes away
    return shared


def _reserve(name: str, fd: int) -> None:
    """All pages now: on a full /dev/shm this is an error here, and not a SIGBUS
    at some later store.
    """
    try:
        os.posix_fallocate(fd, 0, SEGMENT_SIZE)
    except OSError as error:
        raise _no_room(name, error) from None


def _no_room(name: str, error: Exception) -> HliError:
    why = getattr(error, "strerror", None) or error
    if isinstance(error, ValueError):  # as posix_ipc tells EFBIG
        why = os.strerror(errno.EFBIG)
    return HliError(
        f"segment {name!r} cannot be created in {SHM_DIR}: "
        f"{why} ({SEGMENT_SIZE} bytes needed)"
    )


def _take_name(name: str, draft: str) -> None:
    """Link the written file; a stale segment of this name is replaced."""
    for _ in range(_CREATE_TRIES):
        try:
            os.link(SHM_DIR / draft[1:], SHM_DIR / name)
        except FileExistsError:
            if not _remove_stale(SHM_DIR / name):
                raise HliInUse(_in_use(name)) from None
        else:
            return
    raise HliInUse(f"segment {name!r}: other processes keep taking the name")


def _write_head(memory: mmap.mmap, channel_count: int, axis_count: int) -> None:
    root = layout.HLI_SEGMENT.from_buffer(memory)
    head = root.segment_head
    head.owner_pid = os.getpid()
    head.owner_start = lib.hs_process_start(os.getpid())
    head.abi_version = layout.HLI_ABI_VERSION
    head.segment_size = SEGMENT_SIZE
    head.channel_count = channel_count
    head.axis_count = axis_count
    head.layout_hash[:] = layout_hash()
    root.platform.channel_count_r = channel_count
    root.platform.axis_count_r = axis_count
    head.magic = layout.HLI_MAGIC


def _in_use(name: str) -> str:
    try:
        fd = access.open_file(name, os.O_RDONLY)
    except (HliNotFound, HliAccessError):
        head = None
    else:
        head = _read_head(fd)
        os.close(fd)
    if head is None:
        return (
            f"segment {name!r}: {SHM_DIR / name} is there but is no segment "
            "of this user; choose another name"
        )
    return (
        f"segment {name!r} is in use by process {head.owner_pid}; "
        "end it or choose another name"
    )


def _identity(fd: int) -> tuple[int, int]:
    info = os.fstat(fd)
    return info.st_dev, info.st_ino


# ------------------------------------------------------------------------------------------------
# attach
def attach(name: str) -> Segment:
    """Map an existing segment after checking that it is ours, published and
    laid out like this version's.

    Raises HliNotFound, HliAccessError, HliNotReady, HliVersionError; ValueError
    for a wrong name.
    """
    return _attached(name, os.O_RDWR)


def observe(name: str) -> Segment:
    """As ``attach``, with a mapping that cannot be written: a store through it
    ends the process.
    """
    return _attached(name, os.O_RDONLY)


def _attached(name: str, flags: int) -> Segment:
    check_name(name)
    fd = access.open_file(name, flags)
    mapping = mmap.ACCESS_WRITE if flags & os.O_RDWR else mmap.ACCESS_READ
    try:
        memory = _map_checked(name, fd, mapping)
        return Segment(name, memory, False, _identity(fd))
    finally:
        os.close(fd)


def _map_checked(name: str, fd: int, access_: int) -> mmap.mmap:
    size = os.fstat(fd).st_size
    if size < HEAD_SIZE:
        raise HliNotReady(
            f"segment {name!r} is being created ({size} bytes so far)"
        )
    memory = mmap.mmap(fd, size, access=access_)
    try:
        with ffi.from_buffer(memory) as held:
            at = ffi.cast("char *", held) + layout.HLI_SEGMENT_HEAD.ready.offset
            ready = lib.hs_load_u32(at)
        # behind the ready word, which was stored last
        head = layout.HLI_SEGMENT_HEAD.from_buffer_copy(memory)
        problem = _head_problem(name, head, ready, size)
        # behind the ready word: the creator's draft is gone when it publishes
        if problem is None and os.fstat(fd).st_nlink > 1:
            problem = HliAccessError(f"segment {name!r} has a second name")
        if problem is not None:
            raise problem
    except BaseException:
        memory.close()
        raise
    return memory


def _head_problem(
    name: str, head: Any, ready: int, file_size: int
) -> Exception | None:
    """The first thing wrong with the head, as the exception to raise; None if
    all is well.
    """
    if head.magic == 0:
        return HliNotReady(f"segment {name!r} is being created")
    magics = (f"{head.magic:#018x}", f"{layout.HLI_MAGIC:#018x}")
    for what, found, expected in (
        ("magic", *magics),
        ("ABI version", head.abi_version, layout.HLI_ABI_VERSION),
    ):
        if found != expected:
            return _differs(name, what, found, expected)
    if ready != 1:
        return HliNotReady(
            f"segment {name!r} is not published yet by process {head.owner_pid}"
        )
    hashes = (bytes(head.layout_hash).hex(), layout_hash().hex())
    sizes = (
        ("size", head.segment_size, SEGMENT_SIZE),
        ("file size", file_size, SEGMENT_SIZE),
    )
    for what, found, expected in (*sizes, ("layout hash", *hashes)):
        if found != expected:
            return _differs(name, what, found, expected)
    return None


def _differs(
    name: str, what: str, found: object, expected: object
) -> HliVersionError:
    return HliVersionError(
        f"segment {name!r}: {what} is {found}, this version expects {expected}"
    )


# ------------------------------------------------------------------------------------------------
# stale segments
def sweep() -> list[str]:
    """Remove this user's segments whose owner is dead (published or not);
    returns their names.

    Touched are only files in /dev/shm that belong to this user and begin with
    the segment magic, and the unfinished ones of dead creators.
    """
    _sweep_drafts()
    candidates = [
        path
        for path in sorted(SHM_DIR.iterdir())
        if NAME_RULE.fullmatch(path.name)
    ]
    return [path.name for path in candidates if _remove_stale(path)]


def _sweep_drafts() -> None:
    """Remove what creators of this user left that died before their segment had
    its name.
    """
    for path in SHM_DIR.iterdir():
        found = DRAFT_RULE.fullmatch(path.name)
        if found and not lib.hs_process_alive(int(found[1]), int(found[2])):
            # swept by someone else meanwhile
            with contextlib.suppress(HliAccessError, OSError):
                if path.lstat().st_uid == os.getuid():
                    _unlink(path.name)


def _remove_stale(path: Path) -> bool:
    """Unlink `path` if it is our segment and its owner is dead, or True too if
    it is gone already.

    The lock and the second look at the inode keep two sweeping processes from
    removing each other's new segment.
    """
    try:
        fd = access.open_file(path.name, os.O_RDONLY)
    except HliNotFound:
        return True
    except HliAccessError:
        return False
    try:
        # before the lock: nobody waits for what is no stale segment
        head = _read_head(fd)
        if head is None or lib.hs_process_alive(
            head.owner_pid, head.owner_start
        ):
            return False
        if not access.lock(fd, LOCK_S):
            return False
        if os.lstat(path).st_ino == os.fstat(fd).st_ino:
            _unlink(path.name)
    except FileNotFoundError:
        pass
    except (HliAccessError, OSError):
        return False
    finally:
        os.close(fd)
    return True


def _read_head(fd: int) -> layout.HLI_SEGMENT_HEAD | None:
    """The head of this user's file if it is a segment's, else None."""
    if os.fstat(fd).st_size < HEAD_SIZE:
        return None
    head = layout.HLI_SEGMENT_HEAD.from_buffer_copy(os.pread(fd, HEAD_SIZE, 0))
    return head if head.magic == layout.HLI_MAGIC else None
