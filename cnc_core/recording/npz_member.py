"""A member of an npz file, looked at before memory is taken for it.

Its size, header and data may say different things; a file of a stranger is
believed where all of them agree with the recording's own account.
"""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from math import prod
from typing import IO, Any

import numpy as np

from cnc_core.units import AnyArray

MEMBER_BYTES = 1 << 31
META_BYTES = 1 << 28
TEXT = np.dtype(np.str_)
KINDS: dict[str, np.dtype[Any]] = {
    "double": np.dtype(np.float64),
    "bool": np.dtype(np.bool_),
    "string": TEXT,
    **{
        f"{sign}int{bits}": np.dtype(f"{sign}int{bits}")
        for sign in ("", "u")
        for bits in (8, 16, 32, 64)
    },
}
"""The dtypes of Arrow types by their names."""
WAYS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
BROKEN = (
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
    tokenize.TokenError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    SyntaxError,
    RuntimeError,
    MemoryError,
)
"""What zipfile, numpy and Arrow raise for a file that is none of theirs."""


def array_of(
    file: zipfile.ZipFile,
    name: str,
    shape: tuple[int, ...],
    kind: np.dtype[Any],
    bound: int = MEMBER_BYTES,
) -> AnyArray:
    """The member's array, of this shape and kind; one of BROKEN otherwise."""
    info = file.getinfo(f"{name}.npy")
    if info.file_size > bound or info.compress_type not in WAYS:
        raise ValueError(f"{name} is too large, or packed in another way")
    with file.open(info) as member:
        found, dtype = _header(member)
        left = info.file_size - member.tell()
        _check(name, found == shape and _is_of(dtype, kind))
        _check(name, left == prod(shape) * dtype.itemsize)
        data = member.read()
    return np.frombuffer(data, dtype).reshape(shape)


def _header(member: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    shape, _, dtype = HEADERS[np.lib.format.read_magic(member)](member)
    return shape, dtype


def _is_of(dtype: np.dtype[Any], kind: np.dtype[Any]) -> bool:
    """Texts may have any width but none."""
    if kind == TEXT:
        return dtype.kind == "U" and dtype.isnative and dtype.itemsize > 0
    return dtype == kind


def _check(name: str, holds: bool) -> None:
    if not holds:
        raise ValueError(f"{name} is not what the recording says")
