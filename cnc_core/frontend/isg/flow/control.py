"""Control statements executed: $IF, $SWITCH, loops, $GOTO, and the old #IF.

A statement that sends the program elsewhere asks ``Flow`` for it.  Every open
statement has a ``Frame`` in its program level.  Loops jump to their first line,
which is read again and tests.
"""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.block_text import read_block
from cnc_core.frontend.base.flow import Mark
from cnc_core.frontend.base.formula import Formula
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.variables import Value

from ..language.text import COMMENTS, comment_depth, head_of
from ..state.state import ProgramState
from ..state.store import Setter
from .search import (
    LOOPS,
    Found,
    Frame,
    Searcher,
    closer_of,
    follow,
    label_pattern,
    middle_of,
    opener_of,
    unclosed,
)

NEST_MAX = 20
CASE_TOLERANCE = 0.001
Run = Callable[[], None]
Test = Callable[[], bool]


class Control:
    """Compiles and executes the control statements of one program."""

    def __init__(self, state: ProgramState, searcher: Searcher) -> None:
        self._state, self._flow, self._search = (
            state,
            state.flow,
            searcher,
        )

    # places

    def _branch(self, after: Mark, kind: str) -> Found:
        """The next statement that belongs to the innermost open statement of
        this kind.
        """
        key = ("branch", after.position)
        known: Found | None = self._flow.file.places.get(key)
        if known is None:
            known = self._find_branch(after, kind)
            self._flow.file.keep_place(key, known)
        return known

    def _find_branch(self, after: Mark, kind: str) -> Found:
        inner: list[str] = [kind]
        search = (
            self._search.statements if kind == "#IF" else self._search.skipped
        )
        for found in search(after):
            if len(inner) == 1 and kind in (
                closer_of(found.head),
                middle_of(found.head),
            ):
                return found
            follow(inner, found)
        raise self._unclosed(kind)

    def _end(self, after: Mark, kinds: list[str]) -> Found:
        """The end of the outermost of these open statements."""
        key = ("end", after.position, tuple(kinds))
        known: Found | None = self._flow.file.places.get(key)
        if known is None:
            known = self._find_end(after, list(kinds))
            self._flow.file.keep_place(key, known)
        return known

    def _find_end(self, after: Mark, inner: list[str]) -> Found:
        for found in self._search.skipped(after):
            if len(inner) == 1 and closer_of(found.head) == inner[0]:
                return found
            follow(inner, found)
        raise self._unclosed(inner[0])

    def _unclosed(self, kind: str) -> CncError:
        """The error, at the innermost open statement of this kind if one is known."""
        error = unclosed(kind)
        frame = next(
            (each for each in reversed(self._nest) if each.kind == kind), None
        )
        return self._at_head(error, frame.head) if frame else error

    # frames

    @property
    def _nest(self) -> list[Frame]:
        nest: list[Frame] = self._flow.level.nest
        return nest

    def _push(self, frame: Frame, offset: int) -> Frame:
        if len(self._nest) >= NEST_MAX:
            raise fail(
                20211,
                f"more than {NEST_MAX} control statements in each other",
                offset,
            )
        self._nest.append(frame)
        return frame

    def _top(self, kind: str, word: str, offset: int) -> Frame:
        frame = self._nest[-1] if self._nest else None
        if frame is None or frame.kind != kind:
            if word == "$DEFAULT":
                raise fail(20223, ERRORS[20223], offset)
            if kind == "#IF":
                raise fail(20590, f"{word} without #IF", offset)
            inside = f" (${frame.kind} is open)" if frame else ""
            raise fail(907020, f"{word} without {'$' + kind}{inside}", offset)
        return frame

    def check_closed(self) -> None:
        """A program level has come to the end of its text."""
        if self._nest:
            error = self._unclosed(self._nest[-1].kind)
            self._nest.clear()
            raise error

    def check_closing(self) -> None:
        """Check a program level that ends inside statements.

        Each of them has to be closed further down.
        """
        if not self._nest:
            return
        behind, nest = self._behind(), list(self._nest)
        self._nest.clear()
        for depth in reversed(range(len(nest))):
            frame = nest[depth]
            try:
                if frame.kind == "#IF":
                    self._branch(behind, "#IF")
                else:
                    self._end(
                        behind,
                        [
                            each.kind
                            for each in nest[depth:]
                            if each.kind != "#IF"
                        ],
                    )
            except CncError as error:
                raise self._at_head(error, frame.head) from None

    def _at_head(self, error: CncError, head: Mark) -> CncError:
        """The error at the statement that begins there."""
        source = self._flow.source
        behind = source.position
        source.seek(head.position)
        block = read_block(source, head.line)
        source.seek(behind)
        if block is None:
            return error
        found = head_of(block.text)
        return error.at(block.place(found.text.find(found.sign) + 1))

    # statements

    def if_(
        self,
        test: Callable[[], bool],
        mark: Mark,
        offset: int,
        kind: str = "IF",
    ) -> Run:
        def run() -> None:
            frame = self._push(Frame(kind, mark), offset)
            frame.taken = test()
            if frame.taken:
                return
            try:
                self._flow.skip(self._branch(self._behind(), kind).before)
            except CncError:
                self._nest.pop()
                raise

        return run

    def elseif(self, test: Callable[[], bool], offset: int) -> Run:
        def run() -> None:
            frame = self._top("IF", "$ELSEIF", offset)
            self._not_last(frame, "$ELSEIF", offset)
            if not frame.taken and test():
                frame.taken = True
                return
            self._flow.skip(self._branch(self._behind(), "IF").before)

        return run

    def else_(self, kind: str, offset: int) -> Run:
        def run() -> None:
            frame = self._top(
                kind, "#ELSE" if kind == "#IF" else "$ELSE", offset
            )
            self._not_last(frame, "$ELSE", offset)
            frame.last = True
            if frame.taken:
                self._flow.skip(self._branch(self._behind(), kind).before)
            frame.taken = True

        return run

    def _not_last(self, frame: Frame, word: str, offset: int) -> None:
        if frame.last:
            raise fail(
                20590 if frame.kind == "#IF" else 907020,
                f"{word} behind $ELSE",
                offset,
            )

    def endif(self, kind: str, offset: int) -> Run:
        def run() -> None:
            self._top(kind, "#ENDIF" if kind == "#IF" else "$ENDIF", offset)
            self._nest.pop()

        return run

    def switch(self, value: Formula, mark: Mark, offset: int) -> Run:
        def run() -> None:
            frame = self._push(Frame("SWITCH", mark, taken=False), offset)
            frame.value = value()
            self._flow.skip(self._branch(self._behind(), "SWITCH").before)

        return run

    def case(self, value: Formula, offset: int) -> Run:
        def run() -> None:
            frame = self._top("SWITCH", "$CASE", offset)
            if frame.taken:
                return
            frame.taken = _same(frame.value, value())
            if not frame.taken:
                self._flow.skip(self._branch(self._behind(), "SWITCH").before)

        return run

    def default(self, offset: int) -> Run:
        def run() -> None:
            frame = self._top("SWITCH", "$DEFAULT", offset)
            if not frame.taken:
                frame.default = self._behind()
                self._flow.skip(self._branch(frame.default, "SWITCH").before)

        return run

    def endswitch(self, offset: int) -> Run:
        def run() -> None:
            frame = self._top("SWITCH", "$ENDSWITCH", offset)
            if not frame.taken and frame.default is not None:
                frame.taken = True
                self._flow.jump(frame.default)
            else:
                self._nest.pop()

        return run

    def for_(
        self,
        load: Formula,
        store: Setter,
        bounds: list[Callable[[], float]],
        mark: Mark,
        offset: int,
    ) -> Run:
        def run() -> None:
            frame = self._again("FOR", mark)
            if frame is None:
                frame = self._push(Frame("FOR", mark, once=True), offset)
                first, frame.end, frame.step = (
                    bounds[0](),
                    bounds[1](),
                    bounds[2](),
                )
                frame.once = False
                if frame.step == 0:
                    self._state.warn(907026, ERRORS[907026], offset)
                store(first)
            else:
                store(_number(load(), offset) + frame.step)
            value = _number(load(), offset)
            if (frame.step > 0 and value > frame.end) or (
                frame.step < 0 and value < frame.end
            ):
                self._leave_loop()

        return run

    def while_(self, test: Test, mark: Mark, offset: int) -> Run:
        def run() -> None:
            frame = self._again("WHILE", mark)
            if frame is None:
                frame = self._push(Frame("WHILE", mark), offset)
            frame.once = True
            goes_on = test()
            frame.once = False
            if not goes_on:
                self._leave_loop()

        return run

    def loop(self, kind: str, mark: Mark, offset: int) -> Run:
        """$DO, $REPEAT."""

        def run() -> None:
            if self._again(kind, mark) is None:
                self._push(Frame(kind, mark), offset)

        return run

    def endloop(self, kind: str, word: str, offset: int) -> Run:
        """$ENDFOR, $ENDWHILE, $ENDDO."""

        def run() -> None:
            frame = self._top(kind, word, offset)
            if frame.once:
                self._nest.pop()
            else:
                self._flow.jump(frame.head)

        return run

    def until(self, test: Callable[[], bool], offset: int) -> Run:
        def run() -> None:
            frame = self._top("REPEAT", "$UNTIL", offset)
            self._nest.pop()
            if not test():
                self._nest.append(frame)
                self._flow.jump(frame.head)

        return run

    def _again(self, kind: str, mark: Mark) -> Frame | None:
        """The frame of the loop whose first line is read again."""
        frame = self._nest[-1] if self._nest else None
        return (
            frame
            if frame is not None and frame.kind == kind and frame.head == mark
            else None
        )

    def _leave_loop(self) -> None:
        frame = self._nest.pop()
        self._flow.skip(self._end(self._behind(), [frame.kind]).after)

    def break_(self, offset: int) -> Run:
        def run() -> None:
            place = self._innermost((*LOOPS, "SWITCH"), "$BREAK", offset)
            end = self._end(
                self._behind(), [frame.kind for frame in self._nest[place:]]
            )
            del self._nest[place:]
            self._flow.skip(end.after)

        return run

    def continue_(self, offset: int) -> Run:
        def run() -> None:
            place = self._innermost(LOOPS, "$CONTINUE", offset)
            frame = self._nest[place]
            if frame.kind == "REPEAT":
                end = self._end(
                    self._behind(), [frame.kind for frame in self._nest[place:]]
                )
                self._flow.skip(end.before)
            else:
                self._flow.jump(frame.head)
            del self._nest[place + 1 :]

        return run

    def _innermost(self, kinds: tuple[str, ...], word: str, offset: int) -> int:
        for place in range(len(self._nest) - 1, -1, -1):
            if self._nest[place].kind in kinds:
                return place
        raise fail(907022, f"{word} outside a loop", offset)

    def _behind(self) -> Mark:
        """Behind the block that is being executed."""
        return Mark(self._flow.source.position, self.line_behind())

    line_behind: Callable[[], int]

    # jumps

    def goto(
        self,
        n: Callable[[], float] | None,
        label: str,
        test: Callable[[], bool] | None,
        offset: int,
    ) -> Run:
        def run() -> None:
            if test is None or test():
                self._jump(label if n is None else round(n()), offset)

        return run

    def _jump(self, target: str | int, offset: int) -> None:
        behind = self._behind()
        key = (
            "label",
            target,
            behind.position,
            tuple(frame.head for frame in self._nest),
        )
        known = self._flow.file.places.get(key)
        if known is None:
            known = self._find_label(target, behind, offset)
            self._flow.file.keep_place(key, known)
        mark, nest = known
        by_head = {frame.head: frame for frame in self._nest}
        self._flow.level.nest[:] = [
            by_head.get(head, Frame(kind, head)) for kind, head in nest
        ]
        self._flow.jump(mark)

    def _find_label(
        self, target: str | int, behind: Mark, offset: int
    ) -> tuple[Mark, list[tuple[str, Mark]]]:
        """Search further down first, then from the beginning of the level.

        Returns the statements that are open there too.
        """
        open_here = [(frame.kind, frame.head) for frame in self._nest]
        ahead = self._targets(target, behind, list(open_here), 1)
        found = ahead or self._targets(target, self._flow.level.start, [], 2)
        name = f"N{target}" if isinstance(target, int) else f"[{target}]"
        if not found:
            raise fail(
                907023, f"jump target {name} is not in this program", offset
            )
        if len(found) > 1:
            self._state.warn(
                907025,
                f"{name}: {ERRORS[907025]}, the first one is taken",
                offset,
            )
        mark, nest = found[0]
        for kind, head in nest:
            if (kind, head) not in open_here and kind in (*LOOPS, "SWITCH"):
                raise fail(907024, f"{name}: jump into ${kind}", offset)
        return mark, nest

    def _targets(
        self,
        target: str | int,
        begin: Mark,
        nest: list[tuple[str, Mark]],
        most: int,
    ) -> list[tuple[Mark, list[tuple[str, Mark]]]]:
        found: list[tuple[Mark, list[tuple[str, Mark]]]] = []
        for statement in self._search.statements(begin, label_pattern(target)):
            head = statement.head
            if (
                (head.n == target)
                if isinstance(target, int)
                else (head.label == target)
            ):
                found.append((statement.before, list(nest)))
                if len(found) >= most:
                    break
            opener, closer = opener_of(head), closer_of(head)
            if opener:
                nest.append((opener, statement.before))
            elif closer and nest and nest[-1][0] == closer:
                nest.pop()
        return found

    # #COMMENT BEGIN

    def comment(self, offset: int) -> Run:
        """Skip to behind the matching #COMMENT END."""

        def run() -> None:
            behind, places = self._behind(), self._flow.file.places
            key = ("comment", behind.position)
            if key not in places:
                self._find_comment_ends(behind)
            place: Mark | None = places[key]
            if place is None:
                raise fail(20569, "#COMMENT BEGIN without #COMMENT END", offset)
            self._flow.skip(place)

        return run

    def _find_comment_ends(self, begin: Mark) -> None:
        """Keep the end of this comment and of those in it, None where there is
        none: the text behind is read once, however many begin.
        """
        source, file = self._flow.source, self._flow.file
        line, before = begin.line, source.position
        found: dict[int, Mark | None] = {}
        begun = [begin.position]
        try:
            while begun:
                line += source.hop(COMMENTS)
                block = read_block(source, line)
                if block is None:
                    break
                line += block.lines_read
                change = comment_depth(head_of(block.text), 1) - 1
                if change > 0:
                    begun.append(source.position)
                elif change < 0:
                    found[begun.pop()] = Mark(source.position, line)
        finally:
            source.seek(before)
        found.update(dict.fromkeys(begun))
        for position in sorted(found, reverse=True):  # the next ones stay
            file.keep_place(("comment", position), found[position])


def _same(a: Value, b: Value) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    return abs(a - b) < CASE_TOLERANCE


def _number(value: Value, offset: int) -> float:
    if isinstance(value, str):
        raise fail(907011, ERRORS[907011], offset)
    return value
