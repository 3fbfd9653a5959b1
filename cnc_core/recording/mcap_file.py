"""Recordings as MCAP: a topic a table, and scenes that a viewer draws.

Messages are JSON.  ``/path`` and ``/tool`` are ``foxglove.SceneUpdate``: the
driven path once, the tool fifty times a second.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import CncError
from .source import Source

FRAME = "machine"
POINTS = 20_000  # of the path
TOOL_S = 0.02  # from one scene of the tool to the next
TOOL_MM, PATH_MM = 2.0, 0.3
PATH_COLOR = {"r": 0.0, "g": 0.45, "b": 0.7, "a": 1.0}
TOOL_COLOR = {"r": 0.84, "g": 0.37, "b": 0.0, "a": 1.0}
JSON_TYPES = {"double": "number", "bool": "boolean", "string": "string"}


def need_mcap() -> None:
    """CncError tells how to install what writes MCAP."""
    if find_spec("mcap") is None:
        raise CncError(
            902001, ".mcap needs the package mcap: pip install hli-cosim[mcap]"
        )


def write_mcap(source: Source, aside: Path) -> None:
    """Every table with times, a message a row; memory for a chunk of rows."""
    from mcap.writer import Writer  # noqa: PLC0415

    with aside.open("wb") as file:
        writer: Any = Writer(file)
        writer.start(profile="", library="hli-cosim")
        about = {k: _text(v) for k, v in source.meta.items()}
        writer.add_metadata("hli-cosim", about)
        scene = writer.register_schema(
            "foxglove.SceneUpdate", "jsonschema", json.dumps(SCENE).encode()
        )
        for topic, messages in (("/path", _path), ("/tool", _tool)):
            channel = writer.register_channel(topic, "json", scene)
            for t, message in messages(source):
                _add(writer, channel, t, message)
        for table, columns in source.tables.items():
            if "t" in columns and source.rows(table):
                _write_table(writer, source, table)
        writer.finish()


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _add(writer: Any, channel: int, t: float, message: Any) -> None:
    ns = round(t * 1e9)
    data = json.dumps(message).encode()
    writer.add_message(channel, log_time=ns, data=data, publish_time=ns)


def _write_table(writer: Any, source: Source, table: str) -> None:
    columns = source.tables[table]
    units = source.meta.get("columns", {}).get(table, {})
    schema = {
        "type": "object",
        "properties": {
            name: {
                "type": JSON_TYPES.get(kind, "integer"),
                "description": units.get(name, ""),
            }
            for name, kind in columns.items()
        },
    }
    identity = writer.register_schema(
        f"hli-cosim.{table}", "jsonschema", json.dumps(schema).encode()
    )
    channel = writer.register_channel(f"/{table}", "json", identity)
    for chunk in source.chunks(table, list(columns)):
        for row in chunk.to_pylist():
            # JSON knows no NaN
            plain = {k: None if v != v else v for k, v in row.items()}  # noqa: PLR0124
            _add(writer, channel, row["t"], plain)


# -------------------------------------------------------------------- scenes
def _places(source: Source) -> Iterator[tuple[Any, Any]]:
    """Times (n,) and places (n, 3) in mm of the first three linear axes."""
    recorded = source.tables.get("cycles", {})
    axes = [
        name
        for name, axis in source.meta.get("axes", {}).items()
        if name in recorded and axis.get("kind") != "rotary"
    ][:3]
    if not axes or "t" not in recorded:
        return
    for chunk in source.chunks("cycles", ["t", *axes]):
        place = np.zeros((len(chunk), 3))
        for i, name in enumerate(axes):
            place[:, i] = chunk.column(name).to_numpy()
        yield chunk.column("t").to_numpy(), place


def _path(source: Source) -> Iterator[tuple[float, Any]]:
    """One scene: the driven path."""
    step = max(1, math.ceil(source.rows("cycles") / POINTS))
    points: list[list[float]] = []
    first, row = 0.0, 0
    for t, place in _places(source):
        first = first if points else float(t[0])
        points += place[-row % step :: step].tolist()
        row += len(t)
        last = place[-1].tolist()
    if points:
        if points[-1] != last:
            points.append(last)
        line = {
            "type": 0,
            "pose": _pose([0.0, 0.0, 0.0]),
            "thickness": PATH_MM,
            "scale_invariant": False,
            "points": [_vector(p) for p in points],
            "color": PATH_COLOR,
            "colors": [],
            "indices": [],
        }
        yield first, _entity("path", first, lines=[line])


def _tool(source: Source) -> Iterator[tuple[float, Any]]:
    """The place of the tool, again and again."""
    due = -math.inf
    for t, place in _places(source):
        for i in range(len(t)):
            if t[i] < due:
                continue
            due = t[i] + TOOL_S - 1e-9
            ball = {
                "pose": _pose(place[i].tolist()),
                "size": {"x": TOOL_MM, "y": TOOL_MM, "z": TOOL_MM},
                "color": TOOL_COLOR,
            }
            yield float(t[i]), _entity("tool", float(t[i]), spheres=[ball])


def _vector(place: list[float]) -> dict[str, float]:
    return dict(zip("xyz", place, strict=True))


def _pose(place: list[float]) -> dict[str, Any]:
    upright = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    return {"position": _vector(place), "orientation": upright}


def _entity(name: str, t: float, **shapes: Any) -> dict[str, Any]:
    ns = round(t * 1e9)
    stamp = {"sec": ns // 1_000_000_000, "nsec": ns % 1_000_000_000}
    entity = {
        "timestamp": stamp,
        "frame_id": FRAME,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        **{shape: [] for shape in SHAPES},
        **shapes,
    }
    return {"deletions": [], "entities": [entity]}


SHAPES = (
    "arrows",
    "cubes",
    "spheres",
    "cylinders",
    "lines",
    "triangles",
    "texts",
    "models",
)


def _object(**members: Any) -> dict[str, Any]:
    return {"type": "object", "properties": members}


def _list(item: Any) -> dict[str, Any]:
    return {"type": "array", "items": item}


def _scene_schema() -> dict[str, Any]:
    """The members of foxglove.SceneUpdate that are written here."""
    number, whole = {"type": "number"}, {"type": "integer"}
    text, flag = {"type": "string"}, {"type": "boolean"}
    time = _object(sec=whole, nsec=whole)
    vector = _object(x=number, y=number, z=number)
    color = _object(r=number, g=number, b=number, a=number)
    turn = _object(x=number, y=number, z=number, w=number)
    pose = _object(position=vector, orientation=turn)
    sphere = _object(pose=pose, size=vector, color=color)
    line = _object(
        type=whole,
        pose=pose,
        thickness=number,
        scale_invariant=flag,
        points=_list(vector),
        color=color,
        colors=_list(color),
        indices=_list(whole),
    )
    shapes = {name: _list({"type": "object"}) for name in SHAPES}
    entity = _object(
        timestamp=time,
        frame_id=text,
        id=text,
        lifetime=time,
        frame_locked=flag,
        metadata=_list(_object(key=text, value=text)),
        **(shapes | {"spheres": _list(sphere), "lines": _list(line)}),
    )
    deletion = _object(timestamp=time, type=whole, id=text)
    return {
        "title": "foxglove.SceneUpdate",
        **_object(deletions=_list(deletion), entities=_list(entity)),
    }


SCENE = _scene_schema()
