"""Control statements: $IF, $SWITCH, loops, $GOTO, and the old #IF.

A statement that sends the program elsewhere asks ``Flow`` for it.  Every open statement has a ``Frame`` in its
program level.  Loops jump to their first line, which is read again and tests.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.block_text import BlockText, read_block
from cnc_core.frontend.base.flow import Mark
from cnc_core.frontend.base.formula import Formula, number_of
from cnc_core.frontend.base.lexer import Kind, TokenStream, fail
from cnc_core.frontend.base.source import Source
from cnc_core.frontend.base.variables import Value
from cnc_core.frontend.isg.context import Context
from cnc_core.frontend.isg.formulas import Formulas
from cnc_core.frontend.isg.store import Setter
from cnc_core.frontend.isg.text import COMMENTS, CONTROL, DOUBTFUL, Head, head_of

NEST_MAX = 20
TRUE_FROM = 0.5  # $IF, $WHILE, $UNTIL
CASE_TOLERANCE = 0.001
OPENERS = {"IF": "IF", "SWITCH": "SWITCH", "FOR": "FOR", "WHILE": "WHILE", "DO": "DO", "REPEAT": "REPEAT"}
CLOSERS = {
    "ENDIF": "IF", "ENDSWITCH": "SWITCH", "ENDFOR": "FOR", "ENDWHILE": "WHILE", "ENDDO": "DO", "UNTIL": "REPEAT"
}  # fmt: skip
MIDDLES = {"ELSEIF": "IF", "IFELSE": "IF", "ELSE": "IF", "CASE": "SWITCH", "DEFAULT": "SWITCH"}
OLD_OPENERS, OLD_CLOSERS, OLD_MIDDLES = {"IF": "#IF"}, {"ENDIF": "#IF"}, {"ELSE": "#IF"}
LOOPS = ("FOR", "WHILE", "DO", "REPEAT")
WORDS = frozenset({*OPENERS, *CLOSERS, *MIDDLES, "BREAK", "CONTINUE", "GOTO"})

Run = Callable[[], None]


@dataclass
class Frame:
    """An open control statement.  ``head``: place of its first line.

    ``taken``: a branch of it has been chosen.  ``last``: its $ELSE or $DEFAULT has been passed.
    """

    kind: str
    head: Mark
    taken: bool = True
    last: bool = False
    value: Value = 0.0
    default: Mark | None = None
    end: float = 0.0
    step: float = 1.0
    once: bool = False  # its statement was wrong: the loop ends at its end


@dataclass(frozen=True)
class Found:
    """A statement found by a search: where it begins and ends."""

    head: Head
    before: Mark
    after: Mark
    text: BlockText


class Searcher:
    """Looks through the text of the current program level without executing it."""

    def __init__(self, context: Context, skip_mask: Callable[[], int]) -> None:
        self._flow, self._skip_mask = context.flow, skip_mask
        self.visit: Callable[[BlockText, Head], None] | None = None  # what is skipped is shown to it (check)

    def skipped(self, begin: Mark) -> Iterator[Found]:
        """As ``statements``, of text that will not be executed now."""
        if self.visit is None:
            yield from self.statements(begin)
            return
        for found in self.statements(begin, DOUBTFUL):
            yield found
            self.visit(found.text, found.head)

    def statements(self, begin: Mark, pattern: re.Pattern[bytes] = CONTROL) -> Iterator[Found]:
        """Blocks from ``begin`` on whose text ``pattern`` finds something in, to the end of the level."""
        source: Source = self._flow.source
        before = source.position
        try:
            source.seek(begin.position)
            line, comment = begin.line, 0
            while True:
                line += source.hop(pattern)
                here = Mark(source.position, line)
                block = read_block(source, line)
                if block is None:
                    return
                line += block.lines_read
                head = head_of(block.text)
                comment = _comment_depth(head, comment)
                if comment or (head.skip >= 0 and self._skipped(head.skip)):
                    continue
                if head.sign == "%" and here.position > self._flow.level.start.position:
                    return
                after = Mark(source.position, line)
                yield Found(head, here, after, block)
                source.seek(after.position)
        finally:
            source.seek(before)

    def _skipped(self, level: int) -> bool:
        return bool(self._skip_mask() >> (level - 1) & 1) if level else False


def _comment_depth(head: Head, depth: int) -> int:
    if head.sign == "#" and head.word == "COMMENT":
        return depth + 1 if head.next == "BEGIN" else max(0, depth - 1)
    return depth


def _opener(head: Head) -> str | None:
    if head.sign == "#":
        return OLD_OPENERS.get(head.word)
    if head.sign != "$" or (head.word == "IF" and "$" in head.text[head.text.index("$") + 1 :]):
        return None  # $IF .. $GOTO closes itself
    return OPENERS.get(head.word)


def _closer(head: Head) -> str | None:
    if head.sign == "#":
        return OLD_CLOSERS.get(head.word)
    return CLOSERS.get(head.word) if head.sign == "$" else None


def _middle(head: Head) -> str | None:
    if head.sign == "#":
        return OLD_MIDDLES.get(head.word)
    return MIDDLES.get(head.word) if head.sign == "$" else None


class Control:
    """Compiles and executes the control statements of one program."""

    def __init__(self, context: Context, searcher: Searcher) -> None:
        self._context, self._flow, self._search = context, context.flow, searcher

    # places

    def _branch(self, after: Mark, kind: str) -> Found:
        """The next statement that belongs to the innermost open statement of this kind."""
        key = ("branch", after.position)
        known: Found | None = self._flow.file.places.get(key)
        if known is None:
            known = self._find_branch(after, kind)
            self._flow.file.keep_place(key, known)
        return known

    def _find_branch(self, after: Mark, kind: str) -> Found:
        inner: list[str] = [kind]
        search = self._search.statements if kind == "#IF" else self._search.skipped
        for found in search(after):
            if len(inner) == 1 and kind in (_closer(found.head), _middle(found.head)):
                return found
            _nest(inner, found)
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
            if len(inner) == 1 and _closer(found.head) == inner[0]:
                return found
            _nest(inner, found)
        raise self._unclosed(inner[0])

    def _unclosed(self, kind: str) -> CncError:
        if kind == "#IF":
            return fail(20590, "#IF without #ENDIF", 0)
        return fail(907021, f"${kind} is not closed", 0)

    # frames

    @property
    def _nest(self) -> list[Frame]:
        nest: list[Frame] = self._flow.level.nest
        return nest

    def _push(self, frame: Frame, offset: int) -> Frame:
        if len(self._nest) >= NEST_MAX:
            raise fail(20211, f"more than {NEST_MAX} control statements in each other", offset)
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
            kind = self._nest[-1].kind
            self._nest.clear()
            raise self._unclosed(kind)

    # parsing

    def parse(self, stream: TokenStream, formulas: Formulas, mark: Mark) -> Run:
        """The statement at the stream, which stands behind ``$``; ``mark``: where its block begins."""
        token = stream.current
        word = token.text.upper() if token.kind is Kind.NAME else ""
        if word not in WORDS:
            name = f"${word}" if word else f"$ and {stream.describe()}"
            raise fail(900002, f"unknown control statement {name}", token.offset)
        stream.next()
        parser = _Parser(self, stream, formulas, mark, token.offset)
        run = getattr(parser, "_" + word.lower())()
        if not stream.at_end:
            raise fail(900010, f"unexpected {stream.current.text!r} behind ${word}", stream.current.offset)
        return run  # type: ignore[no-any-return]

    def old(self, word: str, stream: TokenStream, formulas: Formulas, mark: Mark, offset: int) -> Run:
        """#IF, #ELSE, #ENDIF."""
        if word == "IF":
            return self.if_(_truth(formulas, offset), mark, offset, "#IF")
        return self.else_("#IF", offset) if word == "ELSE" else self.endif("#IF", offset)

    # statements

    def if_(self, test: Callable[[], bool], mark: Mark, offset: int, kind: str = "IF") -> Run:
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
            frame = self._top(kind, "#ELSE" if kind == "#IF" else "$ELSE", offset)
            self._not_last(frame, "$ELSE", offset)
            frame.last = True
            if frame.taken:
                self._flow.skip(self._branch(self._behind(), kind).before)
            frame.taken = True

        return run

    def _not_last(self, frame: Frame, word: str, offset: int) -> None:
        if frame.last:
            raise fail(20590 if frame.kind == "#IF" else 907020, f"{word} behind $ELSE", offset)

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

    def for_(self, load: Formula, store: Setter, bounds: list[Callable[[], float]], mark: Mark, offset: int) -> Run:
        def run() -> None:
            frame = self._again("FOR", mark)
            if frame is None:
                frame = self._push(Frame("FOR", mark, once=True), offset)
                first, frame.end, frame.step = bounds[0](), bounds[1](), bounds[2]()
                frame.once = False
                if frame.step == 0:
                    self._context.warn(907026, ERRORS[907026], offset)
                store(first)
            else:
                store(_number(load(), offset) + frame.step)
            value = _number(load(), offset)
            if (frame.step > 0 and value > frame.end) or (frame.step < 0 and value < frame.end):
                self._leave_loop()

        return run

    def while_(self, test: Callable[[], bool], mark: Mark, offset: int) -> Run:
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
        return frame if frame is not None and frame.kind == kind and frame.head == mark else None

    def _leave_loop(self) -> None:
        frame = self._nest.pop()
        self._flow.skip(self._end(self._behind(), [frame.kind]).after)

    def break_(self, offset: int) -> Run:
        def run() -> None:
            place = self._innermost((*LOOPS, "SWITCH"), "$BREAK", offset)
            end = self._end(self._behind(), [frame.kind for frame in self._nest[place:]])
            del self._nest[place:]
            self._flow.skip(end.after)

        return run

    def continue_(self, offset: int) -> Run:
        def run() -> None:
            place = self._innermost(LOOPS, "$CONTINUE", offset)
            frame = self._nest[place]
            if frame.kind == "REPEAT":
                end = self._end(self._behind(), [frame.kind for frame in self._nest[place:]])
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

    def goto(self, n: Callable[[], float] | None, label: str, test: Callable[[], bool] | None, offset: int) -> Run:
        def run() -> None:
            if test is None or test():
                self._jump(label if n is None else round(n()), offset)

        return run

    def _jump(self, target: str | int, offset: int) -> None:
        behind = self._behind()
        key = ("label", target, behind.position, tuple(frame.head for frame in self._nest))
        known = self._flow.file.places.get(key)
        if known is None:
            known = self._find_label(target, behind, offset)
            self._flow.file.keep_place(key, known)
        mark, nest = known
        by_head = {frame.head: frame for frame in self._nest}
        self._flow.level.nest[:] = [by_head.get(head, Frame(kind, head)) for kind, head in nest]
        self._flow.jump(mark)

    def _find_label(self, target: str | int, behind: Mark, offset: int) -> tuple[Mark, list[tuple[str, Mark]]]:
        """Further down first, then from the beginning of the level; the statements that are open there."""
        open_here = [(frame.kind, frame.head) for frame in self._nest]
        ahead = self._targets(target, behind, list(open_here), 1)
        found = ahead or self._targets(target, self._flow.level.start, [], 2)
        name = f"N{target}" if isinstance(target, int) else f"[{target}]"
        if not found:
            raise fail(907023, f"jump target {name} is not in this program", offset)
        if len(found) > 1:
            self._context.warn(907025, f"{name}: {ERRORS[907025]}, the first one is taken", offset)
        mark, nest = found[0]
        for kind, head in nest:
            if (kind, head) not in open_here and kind in (*LOOPS, "SWITCH"):
                raise fail(907024, f"{name}: jump into ${kind}", offset)
        return mark, nest

    def _targets(
        self, target: str | int, begin: Mark, nest: list[tuple[str, Mark]], most: int
    ) -> list[tuple[Mark, list[tuple[str, Mark]]]]:
        found: list[tuple[Mark, list[tuple[str, Mark]]]] = []
        for statement in self._search.statements(begin, _label_pattern(target)):
            head = statement.head
            if (head.n == target) if isinstance(target, int) else (head.label == target):
                found.append((statement.before, list(nest)))
                if len(found) >= most:
                    break
            opener, closer = _opener(head), _closer(head)
            if opener:
                nest.append((opener, statement.before))
            elif closer and nest and nest[-1][0] == closer:
                nest.pop()
        return found

    # #COMMENT BEGIN

    def comment(self, offset: int) -> Run:
        """Skip to behind the matching #COMMENT END."""

        def run() -> None:
            behind = self._behind()
            place = self._flow.file.places.get(("comment", behind.position))
            if place is None:
                place = self._find_comment_end(behind, offset)
                self._flow.file.keep_place(("comment", behind.position), place)
            self._flow.skip(place)

        return run

    def _find_comment_end(self, begin: Mark, offset: int) -> Mark:
        source = self._flow.source
        line, depth, before = begin.line, 1, source.position
        try:
            while True:
                line += source.hop(COMMENTS)
                block = read_block(source, line)
                if block is None:
                    raise fail(20569, "#COMMENT BEGIN without #COMMENT END", offset)
                line += block.lines_read
                depth = _comment_depth(head_of(block.text), depth)
                if depth == 0:
                    return Mark(source.position, line)
        finally:
            source.seek(before)


def _nest(inner: list[str], found: Found) -> None:
    """Follow one statement in the list of those that are open; an end that fits none of them is an error."""
    opener, closer = _opener(found.head), _closer(found.head)
    if opener:
        inner.append(opener)
    elif closer and inner[-1] == closer:
        inner.pop()
    elif closer and "#IF" not in (closer, inner[-1]):
        place = found.text.place(found.head.text.index(found.head.sign))
        raise CncError(907020, f"${found.head.word} does not end ${inner[-1]}, which is open", place)


def _label_pattern(target: str | int) -> re.Pattern[bytes]:
    if isinstance(target, int):
        return re.compile(rb"[$%#\\]|[nN][ \t]*=?[ \t]*0*" + str(target).encode() + rb"(?![0-9])")
    return re.compile(rb"[$%#\\]|\[[ \t]*" + re.escape(target.encode()) + rb"[ \t]*\]", re.I)


def _same(a: Value, b: Value) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    return abs(a - b) < CASE_TOLERANCE


def _number(value: Value, offset: int) -> float:
    if isinstance(value, str):
        raise fail(907011, ERRORS[907011], offset)
    return value


def _truth(formulas: Formulas, offset: int) -> Callable[[], bool]:
    value = formulas.expression()

    def test() -> bool:
        found = value()
        if isinstance(found, str):
            raise fail(907011, f"condition: {ERRORS[907011]}", offset)
        return abs(found) >= TRUE_FROM

    return test


class _Parser:
    """One statement: its operands, then the run that ``Control`` makes of them."""

    def __init__(self, control: Control, stream: TokenStream, formulas: Formulas, mark: Mark, offset: int) -> None:
        self._control, self._stream, self._formulas = control, stream, formulas
        self._mark, self._offset = mark, offset

    def _test(self) -> Callable[[], bool]:
        return _truth(self._formulas, self._offset)

    def _if(self) -> Run:
        test = self._test()
        if not self._stream.is_op("$"):
            return self._control.if_(test, self._mark, self._offset)
        self._stream.next()
        if not self._stream.accept_name("GOTO"):
            raise fail(900010, "only $GOTO may follow a condition", self._stream.current.offset)
        return self._goto(test)

    def _elseif(self) -> Run:
        return self._control.elseif(self._test(), self._offset)

    _ifelse = _elseif

    def _else(self) -> Run:
        return self._control.else_("IF", self._offset)

    def _endif(self) -> Run:
        return self._control.endif("IF", self._offset)

    def _switch(self) -> Run:
        """``$SWITCH e`` or ``$SWITCH P1=e``, which assigns first."""
        stream, formulas = self._stream, self._formulas
        if not formulas.is_variable():
            return self._control.switch(formulas.expression(), self._mark, self._offset)
        start = stream.place
        target = formulas.reference()
        if not stream.accept("="):
            stream.go_to(start)
            return self._control.switch(formulas.expression(), self._mark, self._offset)
        value, store = formulas.expression(), target.store
        assert store is not None

        def assigned() -> Value:
            found = value()
            store(found)
            return found

        return self._control.switch(assigned, self._mark, self._offset)

    def _case(self) -> Run:
        return self._control.case(self._formulas.expression(), self._offset)

    def _default(self) -> Run:
        return self._control.default(self._offset)

    def _endswitch(self) -> Run:
        return self._control.endswitch(self._offset)

    def _for(self) -> Run:
        stream, formulas = self._stream, self._formulas
        if not formulas.is_variable():
            raise fail(900010, f"$FOR: expected a variable, found {stream.describe()}", stream.current.offset)
        target = formulas.reference()
        stream.expect("=", 900010)
        bounds = [formulas.number("$FOR", self._offset)]
        while stream.accept(","):
            bounds.append(formulas.number("$FOR", self._offset))
        if len(bounds) == 2:
            bounds.append(lambda: 1.0)
        if len(bounds) != 3:
            raise fail(900010, "$FOR takes a first value, a last value and a step", self._offset)
        assert target.store is not None
        return self._control.for_(target.load, target.store, bounds, self._mark, self._offset)

    def _while(self) -> Run:
        return self._control.while_(self._test(), self._mark, self._offset)

    def _do(self) -> Run:
        return self._control.loop("DO", self._mark, self._offset)

    def _repeat(self) -> Run:
        return self._control.loop("REPEAT", self._mark, self._offset)

    def _endfor(self) -> Run:
        return self._control.endloop("FOR", "$ENDFOR", self._offset)

    def _endwhile(self) -> Run:
        return self._control.endloop("WHILE", "$ENDWHILE", self._offset)

    def _enddo(self) -> Run:
        return self._control.endloop("DO", "$ENDDO", self._offset)

    def _until(self) -> Run:
        return self._control.until(self._test(), self._offset)

    def _break(self) -> Run:
        return self._control.break_(self._offset)

    def _continue(self) -> Run:
        return self._control.continue_(self._offset)

    def _goto(self, test: Callable[[], bool] | None = None) -> Run:
        stream, offset = self._stream, self._stream.current.offset
        if stream.is_op("["):
            end = stream.text.find("]", offset)
            if end < 0:
                raise fail(900013, "bracket is not closed", offset)
            label = stream.text[offset + 1 : end].strip().upper()
            stream.skip_to(end + 1)
            return self._control.goto(None, label, test, offset)
        if stream.current.kind is Kind.NAME and stream.current.text[0] in "nN":
            stream.take_letters(1)
            number = number_of(self._formulas.expression(), "N", offset)
            stream.accept(":")
            return self._control.goto(number, "", test, offset)
        raise fail(900010, f"$GOTO: expected N or [label], found {stream.describe()}", offset)
