"""Frames that are wrong in all ways, from a seed."""

from __future__ import annotations

import random
import struct

HEAD = struct.Struct("<6sH6sHHHIII")
GROUPS = [0x4040, 0x100000, 0x200000, 0x130100, 0x120100, 0x120101]
GROUPS += [*range(0xF000, 0xF012), *range(0xF07E, 0xF088), 0xF100, 0x9999]
NUMBERS = [0, 1, 2, 3, 4, 8, 84, 255, 65535, 1 << 20, (1 << 31) - 1]
NUMBERS += [1 << 31, (1 << 32) - 1]
NAMES = [b"", b"gpCh[0]", b"gpCh[0]^.x\0", b"gpCh[-1]", b"MAIN.pair\0", b"["]
NAMES += [b"gpCh" + b"[0]" * 300, b"Slow." * 100, b"\xff\0\xff", b"A" * 5000]


def ads(random: random.Random) -> bytes:
    """One frame for an ADS server, or what is none."""
    command = random.choice([0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 77])
    numbers = [random.choice([*GROUPS, *NUMBERS]) for _ in range(6)]
    data = struct.pack("<6I", *numbers)[: random.randrange(25)]
    if random.random() < 0.7:
        data = _command(random, command)
    body = HEAD.pack(
        bytes([127, 0, 0, 1, 1, 1]),
        random.choice([851, 851, 851, 553, 10000, 0, 65535]),
        bytes([1, 2, 3, 4, 1, 1]),
        32768,
        command,
        random.choice([4, 4, 4, 4, 5, 0, 65535]),
        len(data),
        0,
        random.randrange(1 << 32),
    )
    body += data
    return _damaged(random, struct.pack("<HI", 0, len(body)) + body)


def _command(random: random.Random, command: int) -> bytes:
    """Data that are nearly right."""
    group = random.choice(GROUPS)
    offset, length = random.choice(NUMBERS), random.choice(NUMBERS)
    tail = random.choice([*NAMES, random.randbytes(random.randrange(200))])
    if command == 9:
        size = random.choice([len(tail), length])
        return struct.pack("<4I", group, offset, length, size) + tail
    if command == 3:
        size = random.choice([len(tail), length])
        return struct.pack("<3I", group, offset, size) + tail
    if command == 6:
        mode, cycle = random.choice(NUMBERS), random.choice(NUMBERS)
        return struct.pack("<6I", group, offset, length, mode, 0, cycle)
    if command == 5:
        # CONFIG would take the devices away, and STOP the PLC
        return struct.pack("<HHI", random.choice([0, 1, 5, 99]), 0, 0)
    return struct.pack("<3I", group, offset, length)


def _damaged(random: random.Random, frame: bytes) -> bytes:
    kind = random.random()
    if kind < 0.75:
        return frame
    if kind < 0.85:
        at = random.randrange(len(frame))
        return frame[:at] + random.randbytes(1) + frame[at + 1 :]
    if kind < 0.95:
        return frame[: random.randrange(len(frame))]
    return random.randbytes(random.randrange(1, 300))


def opcua(random: random.Random) -> bytes:
    """One message for an OPC UA server, or what is none."""
    kind = random.choice([b"HEL", b"ACK", b"OPN", b"CLO", b"MSG", b"ERR", b"X"])
    body = random.randbytes(random.randrange(120))
    if kind == b"HEL" and random.random() < 0.7:
        url = random.choice([b"opc.tcp://x/", b"", b"\xff" * 50, b"A" * 5000])
        numbers = [random.choice(NUMBERS) for _ in range(5)]
        body = struct.pack("<5I", *numbers) + struct.pack("<i", len(url)) + url
    size = random.choice([len(body) + 8, random.choice(NUMBERS)])
    chunk = random.choice([b"F", b"C", b"A", b"?"])
    return _damaged(random, kind + chunk + struct.pack("<I", size) + body)
