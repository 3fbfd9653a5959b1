"""The runs that a study lays out, and what a study refuses."""

from __future__ import annotations

from pathlib import Path

import pytest

from cnc_core.errors import CncError
from cnc_core.sweep.points import points
from cnc_core.sweep.study import Study


def of(text: str, folder: Path) -> Study:
    """A study of one program with these further lines."""
    file = folder / "study.toml"
    file.write_text(f'programs = ["a.nc"]\n{text}')
    return Study.read(file)


def test_a_grid_takes_every_combination_in_one_order(tmp_path: Path) -> None:
    """The last parameter changes first; a range has both its ends."""
    study = of(
        '[parameters]\n"run.tolerance" = [0.0, 0.1]\n'
        '"cell.cycle_s" = {low = 1.0, high = 100.0, count = 3, scale = "log"}',
        tmp_path,
    )
    runs = [tuple(point.parameters.values()) for point in points(study)]
    steps = (1.0, pytest.approx(10.0), 100.0)
    assert runs == [(t, c) for t in (0.0, 0.1) for c in steps]
    assert [point.number for point in points(study)] == list(range(6))


@pytest.mark.parametrize("text", ["a=" + "[" * 3000, "a." * 32000 + "b=1"])
def test_a_study_that_is_nested_too_deeply(text: str, tmp_path: Path) -> None:
    """It is refused as other mistakes of a study are, with its file."""
    with pytest.raises(CncError, match="study: nested too deeply") as caught:
        of(text, tmp_path)
    assert caught.value.code == 902001


def test_rows_go_together(tmp_path: Path) -> None:
    """A row is one alternative; it is combined with the other parameters."""
    study = of(
        'rows = [{"cell.a" = 1, "cell.b" = 2}, {"cell.a" = 3, "cell.b" = 4}]\n'
        '[parameters]\n"run.tolerance" = [0.0, 0.1]',
        tmp_path,
    )
    runs = [tuple(point.parameters.values()) for point in points(study)]
    assert runs == [(1, 2, 0.0), (1, 2, 0.1), (3, 4, 0.0), (3, 4, 0.1)]


def test_a_draw_does_not_depend_on_what_is_drawn_beside_it(
    tmp_path: Path,
) -> None:
    """One parameter more leaves the others' values as they were."""
    span = '"cell.a" = {low = 0.0, high = 1.0}'
    head = 'mode = "random"\ncount = 20\nseed = 4\n[parameters]\n'
    one = points(of(head + span, tmp_path))
    two = points(of(head + '"run.tolerance" = [0, 1]\n' + span, tmp_path))
    assert [p.parameters["cell.a"] for p in one] == [
        p.parameters["cell.a"] for p in two
    ]
    assert len({p.parameters["cell.a"] for p in one}) == 20
    assert {p.parameters["run.tolerance"] for p in two} == {0, 1}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[parameters]\n"speed" = [1]', "'speed' is no parameter"),
        ('[parameters]\n"run.name" = ["a"]', "the study sets it itself"),
        ('[parameters]\n"cell.a" = []', "cell.a has no value"),
        ('[parameters]\n"cell.a" = {low = 2, high = 1}', "low is above high"),
        (
            '[parameters]\n"cell.a" = {low = 0, high = 1, scale = "log"}',
            "begins above 0",
        ),
        ('rows = [{"cell.a" = 1}, {"cell.b" = 1}]', "the same parameters"),
        (
            'rows = [{"cell.a" = 1}]\n[parameters]\n"cell.a" = [1]',
            "cell.a is a parameter and stands in a row",
        ),
        (
            'measure = ["plan"]\n[figures]\nv = {symbol = "v"}',
            "figures are taken from a run",
        ),
        ("worker = 3", "worker: Extra inputs"),
        ("seed = ", "study:"),
    ],
)
def test_a_wrong_study_is_refused_with_its_member(
    text: str, said: str, tmp_path: Path
) -> None:
    """The error names the file, the member and the reason."""
    with pytest.raises(CncError) as caught:
        of(text, tmp_path)
    assert said in str(caught.value)
    assert "study.toml" in str(caught.value)


def test_too_many_runs_are_refused(tmp_path: Path) -> None:
    """Before the first of them is laid out."""
    span = "{low = 0, high = 1, count = 1000}"
    names = "\n".join(f'"cell.{name}" = {span}' for name in "abc")
    with pytest.raises(CncError, match="more than 1000000 runs"):
        points(of(f"[parameters]\n{names}", tmp_path))
