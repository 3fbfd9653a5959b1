"""Life of a segment: creation, attachment, refusals, leftovers."""

import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest
from hli._sync import lib

import hli
from hli import layout
from hli.segment import SEGMENT_SIZE, SHM_DIR
from support.fake_cnc import unique_name

pytestmark = pytest.mark.sanitize("hli")

CREATE_AND_SLEEP = """
import sys, time, hli
segment = hli.create(sys.argv[1], ready=sys.argv[2] == "1")
print("there", flush=True)
time.sleep(60)
"""


@pytest.fixture
def name() -> Iterator[str]:
    """A unique segment name whose file is removed after the test."""
    unique = unique_name()
    yield unique
    (SHM_DIR / unique).unlink(missing_ok=True)


def other_process(name: str, ready: bool = True) -> subprocess.Popen[str]:
    """A process that created the segment and sleeps."""
    command = [
        sys.executable,
        "-P",
        "-c",
        textwrap.dedent(CREATE_AND_SLEEP),
        name,
        str(int(ready)),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "there\n"
    return process


def end(process: subprocess.Popen[str]) -> None:
    """Kill a process of this test without giving it a chance to clean up."""
    process.send_signal(signal.SIGKILL)
    process.wait()
    if process.stdout is not None:
        process.stdout.close()


def patch(name: str, member: str, value: bytes) -> None:
    """Overwrite a member of the segment head."""
    with (SHM_DIR / name).open("r+b") as file:
        file.seek(getattr(layout.HLI_SEGMENT_HEAD, member).offset)
        file.write(value)


def test_created_segment_is_private_zeroed_and_published(name: str) -> None:
    """Mode 0600, full size, head filled, ready set."""
    with hli.create(name, channel_count=2, axis_count=5) as segment:
        info = (SHM_DIR / name).stat()
        assert (info.st_mode & 0o777, info.st_size) == (0o600, SEGMENT_SIZE)
        head = segment.root.segment_head
        assert (
            head.ready,
            head.channel_count,
            head.axis_count,
            head.owner_pid,
        ) == (1, 2, 5, os.getpid())
        assert segment.root.platform.axis_count_r == 5
        assert not any(bytes(segment.root.sidecar))


def test_attached_segment_shares_memory_and_closing_it_keeps_the_name(
    name: str,
) -> None:
    """Closing an attachment removes nothing."""
    with hli.create(name) as segment:
        other = hli.attach(name)
        other.root.channel[0].bahn_state.dist_prog_start = 12.5
        assert segment.root.channel[0].bahn_state.dist_prog_start == 12.5
        other.close()
        other.close()
        assert (SHM_DIR / name).exists()


def test_attaching_process_does_not_remove_the_segment_at_its_exit(
    name: str,
) -> None:
    """The resource tracker's trap: the attacher's end leaves the name alone."""
    with hli.create(name):
        subprocess.run(
            [sys.executable, "-P", "-c", f"import hli; hli.attach({name!r})"],
            check=True,
        )
        assert (SHM_DIR / name).exists()


def test_creator_unlinks_when_it_leaves(name: str) -> None:
    """The context manager of the creator removes the name; unlinking twice does no harm."""
    with hli.create(name) as segment:
        pass
    assert not (SHM_DIR / name).exists()
    segment.unlink()


def test_missing_segment_is_named(name: str) -> None:
    """HliNotFound."""
    with pytest.raises(hli.HliNotFound, match=name):
        hli.attach(name)


def test_unpublished_segment_is_not_ready_until_published(name: str) -> None:
    """The ready word decides."""
    with hli.create(name, ready=False) as segment:
        with pytest.raises(hli.HliNotReady):
            hli.attach(name)
        segment.publish()
        hli.attach(name).close()


def test_empty_file_is_not_ready(name: str) -> None:
    """Between shm_open and ftruncate of the creator."""
    (SHM_DIR / name).touch(mode=0o600)
    with pytest.raises(hli.HliNotReady):
        hli.attach(name)


@pytest.mark.parametrize(
    ("member", "value", "what"),
    [
        ("magic", b"NOTHLICO", "magic"),
        (
            "abi_version",
            (99).to_bytes(4, "little"),
            "ABI version is 99.*expects 1",
        ),
        ("segment_size", (4096).to_bytes(8, "little"), "size is 4096"),
        ("layout_hash", bytes(32), "layout hash is 0000"),
    ],
)
def test_other_layout_is_refused_with_both_values(
    name: str, member: str, value: bytes, what: str
) -> None:
    """HliVersionError names what differs and both values."""
    with hli.create(name):
        patch(name, member, value)
        with pytest.raises(hli.HliVersionError, match=what):
            hli.attach(name)


def test_truncated_file_is_refused(name: str) -> None:
    """A file shorter than its head says is not mapped."""
    segment = hli.create(name)
    segment.close()
    os.truncate(SHM_DIR / name, 8192)
    with pytest.raises(hli.HliVersionError, match="8192"):
        hli.attach(name)


def test_segment_open_to_others_is_refused(name: str) -> None:
    """HliAccessError names the mode."""
    with hli.create(name):
        (SHM_DIR / name).chmod(0o644)
        with pytest.raises(hli.HliAccessError, match="0644"):
            hli.attach(name)


def test_umask_does_not_matter(name: str) -> None:
    """Mode 0600 under any umask."""
    before = os.umask(0o277)
    try:
        with hli.create(name):
            assert (SHM_DIR / name).stat().st_mode & 0o777 == 0o600
    finally:
        os.umask(before)


def test_segment_of_another_user_is_refused(name: str, monkeypatch) -> None:
    """HliAccessError names both users."""
    with hli.create(name):
        monkeypatch.setattr(os, "getuid", lambda: 4242)
        with pytest.raises(hli.HliAccessError, match="4242"):
            hli.attach(name)


def test_name_of_a_living_owner_is_in_use(name: str) -> None:
    """HliInUse names the process; its segment stays untouched."""
    process = other_process(name)
    try:
        with pytest.raises(hli.HliInUse, match=str(process.pid)):
            hli.create(name)
        assert name not in hli.sweep()
        hli.attach(name).close()
    finally:
        end(process)


@pytest.mark.parametrize("ready", [True, False])
def test_segment_of_a_killed_owner_is_swept(name: str, ready: bool) -> None:
    """Published or half created, a dead owner's segment goes."""
    end(other_process(name, ready))
    assert (SHM_DIR / name).exists()
    hli.sweep()  # or another run's sweep was faster
    assert not Path("/dev/shm", name).exists()
    assert not (SHM_DIR / name).exists()


def test_creation_replaces_a_dead_owners_segment(name: str) -> None:
    """No operator is needed after a crash; an old attachment keeps its own memory."""
    process = other_process(name)
    old = hli.attach(name)
    end(process)
    assert not old.owner_alive()
    with hli.create(name) as new:
        old.root.platform.plc_present_w = True
        assert not new.root.platform.plc_present_w
    old.close()


def test_recycled_process_id_does_not_keep_a_segment_alive(name: str) -> None:
    """The owner is pid and start time: the same pid with another start is dead."""
    segment = hli.create(name)
    segment.root.segment_head.owner_start += 1
    assert not segment.owner_alive()
    hli.sweep()  # or another run's sweep was faster
    assert not Path("/dev/shm", name).exists()
    segment.close()


def test_foreign_files_are_never_touched(name: str) -> None:
    """A file that is no segment survives sweep and makes create refuse the name."""
    path = SHM_DIR / name
    path.write_bytes(b"someone else's" * 1000)
    assert name not in hli.sweep()
    with pytest.raises(hli.HliInUse, match="no segment"):
        hli.create(name)
    assert path.read_bytes() == b"someone else's" * 1000


def test_symbolic_links_are_not_followed(name: str, tmp_path: Path) -> None:
    """A link that looks like a stale segment is left alone, and so is its target."""
    target = tmp_path / "target"
    head = layout.HLI_SEGMENT_HEAD(magic=layout.HLI_MAGIC, owner_pid=2**30)
    target.write_bytes(bytes(head))
    (SHM_DIR / name).symlink_to(target)
    assert name not in hli.sweep()
    assert target.exists()


@pytest.mark.parametrize(
    "bad", ["", "a/b", "../x", ".hidden", "a b", "x" * 65, "ä", "a\n"]
)
def test_wrong_names_are_refused(bad: str) -> None:
    """ValueError before anything is opened."""
    for function in (hli.create, hli.attach):
        with pytest.raises(ValueError, match="segment name"):
            function(bad)


@pytest.mark.parametrize(
    ("channels", "axes"), [(0, 1), (13, 1), (1, 65), (1, -1)]
)
def test_wrong_counts_are_refused(name: str, channels: int, axes: int) -> None:
    """ValueError, nothing created."""
    with pytest.raises(ValueError, match="_count"):
        hli.create(name, channels, axes)
    assert not (SHM_DIR / name).exists()


def test_process_identity() -> None:
    """This process lives; with another start time, or as a zombie, it does not."""
    pid = os.getpid()
    start = lib.hs_process_start(pid)
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    assert start == int(
        fields[19]
    )  # starttime is field 22, two stand before the bracket
    assert lib.hs_process_alive(pid, start)
    assert not lib.hs_process_alive(pid, start + 1)
    assert not lib.hs_process_alive(0, 0)
    child = subprocess.Popen(
        [sys.executable, "-P", "-c", "input()"], stdin=subprocess.PIPE
    )
    started = lib.hs_process_start(child.pid)
    assert lib.hs_process_alive(child.pid, started)
    child.kill()
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    assert not lib.hs_process_alive(child.pid, started)
    child.communicate()
