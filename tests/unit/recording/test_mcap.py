"""MCAP: what the library's own reader finds in it."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from cnc_core.recording.parts import Parts
from cnc_core.recording.targets import check_kind
from hli.part_file import PartFile

mcap_reader = pytest.importorskip("mcap.reader")
ROWS = 500
TABLES = {
    "cycles": {"cycle": "uint64", "t": "double", "X": "double", "Y": "double",
               "C": "double", "v": "double"},
    "events": {"cycle": "uint64", "t": "double", "kind": "string"},
    "elements": {"element": "uint64"},
}  # fmt: skip
META = {
    "version": 1,
    "columns": {"cycles": {"v": "mm/s"}},
    "axes": {
        "X": {"kind": "linear"},
        "Y": {"kind": "linear"},
        "C": {"kind": "rotary"},
    },
}


def test_scenes_and_tables_are_read_by_the_library(tmp_path: Path) -> None:
    """A message a cycle with its time, the path in one scene, the tool where the
    cycle of that time has it; schemas are JSON schemas.
    """
    cycle = np.arange(1, ROWS + 1, dtype=np.uint64)
    t = cycle * 1e-3
    v = np.full(ROWS, 100.0)
    v[3] = np.nan
    parts = Parts(tmp_path / "a.mcap")
    part = PartFile(parts.cnc, TABLES, json.dumps(META).encode())
    rows = {"cycle": cycle, "t": t, "X": t * 100, "Y": -t, "C": t, "v": v}
    event = {"cycle": [7], "t": [0.007], "kind": ["start"]}
    assert part.add({"cycles": rows, "events": event})
    part.close()
    parts.finish(end="completed")
    found: Counter[str] = Counter()
    tool = []
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = mcap_reader.make_reader(file)
        for schema, channel, message in reader.iter_messages():
            found[channel.topic] += 1
            value = json.loads(message.data)
            assert schema.encoding == "jsonschema"
            members = json.loads(schema.data)["properties"]
            assert set(value) == set(members)
            if channel.topic == "/cycles":
                assert message.log_time == round(value["t"] * 1e9)
            elif channel.topic == "/path":
                assert schema.name == "foxglove.SceneUpdate"
                (line,) = value["entities"][0]["lines"]
                x = [point["x"] for point in line["points"]]
                assert np.allclose(x, t * 100)
            elif channel.topic == "/tool":
                (ball,) = value["entities"][0]["spheres"]
                tool.append((message.log_time, ball["pose"]["position"]))
        about = next(m for m in reader.iter_metadata() if m.name == "hli-cosim")
    assert found == {"/cycles": ROWS, "/events": 1, "/path": 1, "/tool": 25}
    for ns, place in tool:
        assert place["x"] == pytest.approx(ns * 1e-7)
        assert place["z"] == 0.0
    assert json.loads(about.metadata["axes"]) == META["axes"]


def test_the_package_is_named_where_it_is_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Before the run, with the way to install it."""
    monkeypatch.setattr(
        "cnc_core.recording.mcap_file.find_spec", lambda _: None
    )
    with pytest.raises(Exception, match=r"pip install hli-cosim\[mcap\]"):
        check_kind(Path("a.mcap"))
