"""A mapping for observers: the same values, and no way to change one."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest

import hli
from hli import Areas, HliNotFound, segment
from hli.handshake import snapshot
from support.fake_cnc import unique_name


def test_an_observer_sees_what_the_owner_writes() -> None:
    """Members, and copies under the seqlock; the mapping is read-only."""
    name = unique_name()
    with hli.create(name) as owner:
        seen = segment.observe(name)
        areas = Areas(seen)
        owner.root.channel[0].bahn_state.dist_prog_start = 4.5
        state = areas.gpCh[0].bahn_state
        assert state.dist_prog_start == 4.5
        assert snapshot(state).dist_prog_start == 4.5
        assert seen.owner_alive()
        lines = Path("/proc/self/maps").read_text().splitlines()
        mapped = [line for line in lines if line.endswith(f"/{name}")]
        assert [line.split()[1] for line in mapped] == ["r--s"]
        seen.close()


@pytest.mark.ci
def test_the_mapping_goes_with_the_last_view() -> None:
    """Nothing of it is left behind close and the views."""
    name = unique_name()
    with hli.create(name):
        seen = segment.observe(name)
        areas = Areas(seen)
        seen.close()
        del areas, seen
        gc.collect()
        maps = Path("/proc/self/maps").read_text()
        assert f"/{name}\n" not in maps


def test_nobody_observes_what_is_not_there() -> None:
    """As attach refuses it."""
    with pytest.raises(HliNotFound):
        segment.observe(unique_name())
