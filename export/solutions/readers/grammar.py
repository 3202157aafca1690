r"""The line grammar of solution files: one engine for every text layout of names and values.

A layout (`TextLayout`) declares what its lines look like. Blank lines, comments and claims may stand anywhere
between the entries. Lines may end as on Windows or old Macs, words may be separated by tabs or form feeds,
and the last line may lack its end. A regular expression checks a megabyte of entries at a time; only lines
that are no entries are processed one by one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import compress, count
from math import isclose
from operator import le

from ....models.errors import SolutionError

TOKEN_LIMIT = 63
"""Longest name or number, in bytes. Names of crossfield have at most 15, numbers at most 24."""

HEAD = 1 << 16
"""Number of bytes at the start of a file that determine its layout."""

PIECE = 1 << 20  # bytes processed at once: their words take some ten times as much
BLANK = rb"[ \t\f\v]"
NUMBER = (
    rb"[-+]?(?:(?:\d{1,63}(?:\.\d{0,63})?|\.\d{1,63})(?:[eEdD][-+]?\d{1,63})?"
    rb"|(?i:inf(?:inity)?)|1\.#(?i:inf)0{0,63})"
)
"""A number in the notation of solvers. Ignoring case everywhere would slow every character down."""

IS_NUMBER = re.compile(NUMBER)
FORTRAN = bytes.maketrans(b"dD", b"eE")
WINDOWS_INFINITY = re.compile(rb"1\.#inf0*", re.IGNORECASE)
NOT_TEXT = re.compile(rb"[^\t\f\v -\xff]")
GOAL = rb"[#*;%]?\s*obj(?:ective)?"
CLAIMS = (
    rb"=obj=\s+(?P<objective>.+?)",
    rb"(?P<infeasible>=infeas=)",
    rb"%b[ _]value(?:\s*[=:]\s*|\s+)(?P<objective>\S+)" % GOAL,
    rb"%b(?:\s*[=:]\s*|\s+)(?P<objective>%b)" % (GOAL, NUMBER),
    rb"[#*;%]\s*(?:solution[ _])?status(?:\s*[=:]\s*|\s+)(?P<status>.+?)",
)
"""Lines that state an objective or a status in every layout, with or without a mark of a comment."""

AGREEMENT = 1e-5
"""Largest difference of two objectives that agree, relative to their size, or 1: CBC writes eight digits."""

NUMBERS = frozenset({"objective", "bound"})
NO_NUMBERS = frozenset({b"NA", b"UNDF", b"NONE"})
"""Claims that are numbers, and what stands for none."""

RESERVED = rb"[#=]|obj(?:ective)?(?:[ _]value)?[\s=:]"
"""Start of a line that is no entry."""


AGAIN = "let the solver write the file again"


def line_error(data: bytes, position: int, text: str, remedy: str = f"; {AGAIN}") -> SolutionError:
    """An error with the line of a byte position in a text, and the remedy."""
    return SolutionError(f"line {data.count(10, 0, position) + 1}: {text}{remedy}")


def is_number(word: bytes) -> bool:
    """Whether a word is a number in the notation of solvers."""
    return len(word) <= TOKEN_LIMIT and IS_NUMBER.fullmatch(word) is not None


def float_of(word: bytes) -> float:
    """The number that a word is. Python's own rounding: exact."""
    return float(plain_numbers(word))


def plain_numbers(text: bytes) -> bytes:
    """Numbers in the notation of solvers as Python reads them."""
    text = text.translate(FORTRAN)
    return WINDOWS_INFINITY.sub(b"inf", text) if b"#" in text else text


def spellings(name: bytes) -> tuple[bytes, bytes]:
    """A name in lower case without quotes, and also without the prefix of a problem that SCIP transformed."""
    plain = name.strip(b"\"'").lower()
    return plain, plain[2:] if plain.startswith(b"t_") else plain


def quoted(text: bytes) -> str:
    """A short quotation for a message."""
    return repr(text[:40].decode(errors="replace"))


class EntryForm:
    """The words of an entry, as in `name value`.

    `name`, `value` and `index` (a number without a point) are kept; `number` and `word` are not. A word in
    capitals, or of one letter, stands for itself. separator: characters between words, besides blanks.
    reserved: pattern of the start of a line that is no entry.
    """

    numeric = frozenset({"value", "number", "index"})

    def __init__(self, words: str, separator: bytes = b"", reserved: bytes = RESERVED) -> None:
        self.words = words.split()
        split = re.escape(separator)
        between = rb"%b*[%b]%b*" % (BLANK, split, BLANK) if separator else BLANK + b"+"
        letter = rb"[^\0- %b]" % split
        whole = rb"(?=%b{1,%d}[\0- %b])" % (letter, TOKEN_LIMIT, split)
        kinds = {"name": whole + letter + b"+", "word": whole + letter + b"+", "index": rb"\d{1,18}"}
        kinds.update(value=NUMBER, number=NUMBER)
        tokens = [kinds.get(word, re.escape(word.encode())) for word in self.words]
        line = rb"%b*(?!(?i:%b))%b%b*\n" % (BLANK, reserved, between.join(tokens), BLANK)
        self.line = re.compile(line)
        self.run = re.compile(rb"(?:%b|%b*\n)*" % (line, BLANK))
        self.anywhere = re.compile(rb"^" + line, re.MULTILINE)
        self.spaces = bytes.maketrans(separator, b" " * len(separator)) if separator else None

    @property
    def ends_with_value(self) -> bool:
        """Whether a line that is cut off may end in a part of its value."""
        return self.words[-1] == "value"

    def split(self, text: bytes) -> list[bytes]:
        """The words of a text."""
        return (text.translate(self.spaces) if self.spaces else text).split()

    def column(self, words: list[bytes], kind: str) -> list[bytes]:
        """The words of one kind among those of whole lines; none if entries have no such word."""
        return words[self.words.index(kind) :: len(self.words)] if kind in self.words else []

    def read(self, data: bytes, start: int) -> Iterator[tuple[int, list[bytes]]]:
        """The words of lines from a byte position on while they are entries, and where each piece ends."""
        stop = end = start
        while end == stop < len(data):
            stop = data.rfind(b"\n", end, end + PIECE) + 1 or data.find(b"\n", end) + 1
            match = self.run.match(data, end, stop)
            start, end = end, match.end() if match and stop else end
            if end > start:
                yield end, self.split(data[start:end])

    def fault(self, line: bytes) -> str:
        """Reason why a line is no entry."""
        words = self.split(line)
        pairs = list(zip(self.words, words, strict=False))
        if NOT_TEXT.search(line):
            return "there is a byte that is not text, the file is damaged"
        if max(map(len, words), default=0) > TOKEN_LIMIT:
            return f"a word is longer than {TOKEN_LIMIT} characters"
        for kind, word in pairs:
            if kind not in {*self.numeric, "name", "word"} and word != kind.encode():
                return f"this line is of no column ({kind})"
        if len(words) != len(self.words):
            return f"{len(words)} words stand where {len(self.words)} should"
        for kind, word in pairs:
            if kind in self.numeric and not is_number(word):
                return f"{quoted(word)} is not a number"
        return f"{quoted(line.strip())} is not an entry of `{' '.join(self.words)}`"


@dataclass(frozen=True)
class TextLayout:
    """The look of a kind of text. Patterns are regular expressions of bytes that ignore case.

    signature: pattern of the start of the first line of an answer, or of a line in it if `heads` is false. A
    group `answer` begins with the only answer. forms: words of an entry (`EntryForm`); the first that fits
    the first entry is that of the whole text. claims: patterns of whole lines, with groups objective, bound,
    status and others that the reader knows; `none` states that there is no point. begin: pattern of the line
    before the entries, with groups `count` (negative: without zeros) and `sparse`; empty if they start at
    once. end: pattern of the line after them. needs: groups, `begin` or `end`, without which a text is cut
    off, and what is missing then. pointless: pattern of a status whose values are no point. refusals:
    patterns of lines that no answer has, and what the text is. omits_zeros: whether columns at 0 are left
    out; None: if there is no 0 in the text. rewrites: a literal, and pattern and replacement of the places
    that have it. digits: how the program writes all digits, if it rounds them here. silent: how it writes its
    status, if it has none here.
    """

    name: str
    description: str
    signature: bytes
    forms: tuple[str, ...] = ("name value",)
    separator: bytes = b""
    reserved: bytes = RESERVED
    comment: bytes = b"#"
    claims: tuple[bytes, ...] = ()
    begin: bytes = b""
    end: bytes = b""
    needs: tuple[tuple[str, str], ...] = ()
    pointless: bytes = b""
    refusals: tuple[tuple[bytes, str], ...] = ()
    omits_zeros: bool | None = False
    rewrites: tuple[tuple[bytes, bytes, bytes | Callable[[re.Match[bytes]], bytes]], ...] = ()
    heads: bool = True
    digits: str = ""
    silent: str = ""

    def recognises(self, head: bytes) -> bool:
        """Whether a text with this start has the layout."""
        return next(self._heads(head), None) is not None

    def _heads(self, text: bytes) -> Iterator[tuple[int, re.Match[bytes]]]:
        """The places of the signature, and its matches. A pattern that begins with a line end is faster."""
        first = _compile_patterns(self)["first head"].match(text)
        if first:
            yield 0, first
        for match in _compile_patterns(self)["later head"].finditer(text, first.end() if first else 0):
            yield match.start() + 1, match

    def answers(self, data: bytes) -> Iterator[bytes]:
        """The answers in a text, each in its lines: empty lines replace the text before it."""
        starts: list[int] = []
        for at, match in self._heads(data) if self.heads else ():
            if "answer" in match.groupdict():
                starts = [match.start("answer")]
                break
            # A line like the first one may stand among the claims of an answer, before its entries.
            if not starts or any(form.anywhere.search(data, starts[-1], at) for form in _forms(self)):
                starts.append(at)
        starts = starts or [0]
        for start, stop in zip(starts, [*starts[1:], len(data)], strict=True):
            yield b"\n" * data.count(b"\n", 0, start) + data[start:stop] if start else data[:stop]


@cache
def _compile_patterns(layout: TextLayout) -> dict[str, re.Pattern[bytes]]:
    """The patterns of a layout, compiled: signature, begin, end, and claims and refusals by number."""
    lines = {"begin": layout.begin, "end": layout.end}
    lines.update({f"refusal {at}": pattern for at, (pattern, _) in enumerate(layout.refusals)})
    lines.update({f"claim {at}": claim for at, claim in enumerate((*layout.claims, *CLAIMS))})
    whole_lines = {
        key: re.compile(rb"%b*(?:%b)%b*(?=\n)" % (BLANK, line, BLANK), re.IGNORECASE)
        for key, line in lines.items()
        if line
    }
    head = rb"%b*(?:%b)" % (BLANK, layout.signature)
    heads = {"first head": head, "later head": rb"\n" + head}
    flags = re.IGNORECASE | re.MULTILINE
    return {**whole_lines, **{key: re.compile(pattern, flags) for key, pattern in heads.items()}}


@cache
def _forms(layout: TextLayout) -> tuple[EntryForm, ...]:
    return tuple(EntryForm(words, layout.separator, layout.reserved) for words in layout.forms)


class Scan:
    """The entries of a text in a layout, and its claims, which are complete once the entries are read.

    claims: texts by group. entries: number of entries. first: number of the first entry that counts, if the
    numbering of lines starts again there. sparse: whether the text states that it omits zeros. cut: name of
    the last entry, if its value ends the text without the end of a line, and so may be cut off.
    """

    def __init__(self, data: bytes, layout: TextLayout) -> None:
        self.layout = layout
        self.patterns = _compile_patterns(layout)
        self.form = _forms(layout)[0]
        self.chosen = len(layout.forms) == 1
        for literal, pattern, replacement in layout.rewrites:
            if literal in data:
                data = re.sub(pattern, replacement, data)
        self.unended = bool(data[data.rfind(b"\n") + 1 :].strip())
        self.data = data if data.endswith(b"\n") else data + b"\n"
        self.claims: dict[str, bytes] = {}
        self.places: dict[str, int] = {}
        self.entries = self.first = self.last_index = 0
        self.restarts = 0
        self.sparse = self.ended = False
        self.begun = not layout.begin
        self.cut = b""

    def read(self) -> Iterator[tuple[list[bytes], list[bytes]]]:
        """Names and values of all lists, piece by piece. Raises SolutionError."""
        at, inside = 0, not self.layout.begin
        while at < len(self.data):
            if inside and self._chooses_form(at):
                for stop, words in self.form.read(self.data, at):
                    if words:
                        yield self._entries(words, at, stop)
                    at = stop
                if at == len(self.data):
                    break
            end = self.data.index(b"\n", at)
            if inside and (entry := self._entry_before_comment(at, end)):
                yield self._entries(self.form.split(entry), at, at)
                at = end + 1
                continue
            at, inside = self._odd_line(at, end, inside)
        self._check()

    def _chooses_form(self, at: int) -> bool:
        """Whether the form of entries is known: the first that fits the line."""
        if not self.chosen:
            fitting = (form for form in _forms(self.layout) if form.line.match(self.data, at))
            form = next(fitting, None)
            self.form, self.chosen = form or self.form, form is not None
        return self.chosen

    def _entries(self, words: list[bytes], start: int, end: int) -> tuple[list[bytes], list[bytes]]:
        names, values = self.form.column(words, "name"), self.form.column(words, "value")
        index = list(map(int, self.form.column(words, "index")))
        if index:
            again = list(compress(count(), map(le, index, [self.last_index - (not self.entries), *index])))
            self.restarts += len(again)
            if self.restarts > 1:
                place = place_of_entry(self.data, start, again[-1])
                raise line_error(self.data, place, "the numbers start again for the second time")
            self.first = self.entries + again[0] if again else self.first
            self.last_index = index[-1]
        self.entries += len(names)
        if self.unended and end == len(self.data) and self.form.ends_with_value:
            self.cut = names[-1]
        return names, values

    def _entry_before_comment(self, at: int, end: int) -> bytes:
        """The entry on a line that ends in a comment, or nothing."""
        mark = self.data.find(b" " + self.layout.comment, at, end) if self.layout.comment else -1
        entry = self.data[at:mark] + b"\n" if mark > at else b""
        return entry if self.form.line.match(entry) else b""

    def _odd_line(self, at: int, end: int, inside: bool) -> tuple[int, bool]:
        """Process a line that is no entry; the next position, and whether entries may follow."""
        data, patterns = self.data, self.patterns
        line = data[at:end].strip()
        for key, pattern in patterns.items() if line else ():
            match = None if key.endswith("head") else pattern.match(data, at)
            if match is None or key == ("begin" if self.begun else "end"):
                continue
            if key.startswith("refusal"):
                raise line_error(data, at, self.layout.refusals[int(key[8:])][1], "")
            self._keep(match)
            if key == "end":
                self.ended = True
                return len(data), False
            self.begun = self.begun or key == "begin"
            return data.index(b"\n", match.end()) + 1, self.begun
        if not line or not inside or (self.layout.comment and line.startswith(self.layout.comment)):
            return end + 1, inside
        if self._is_other_text(at):
            return len(data), False
        if self.unended and end + 1 == len(data):
            raise line_error(data, at, "the file is cut off in the middle of this line")
        raise line_error(data, at, self.form.fault(data[at:end]))

    def _is_other_text(self, at: int) -> bool:
        """Whether the text from a line on is no part of the answer: after an empty line, without entries."""
        before = self.data[self.data.rfind(b"\n", 0, max(at - 1, 0)) + 1 : at]
        return self.entries > 0 and not before.strip() and not self.form.anywhere.search(self.data, at)

    def _keep(self, match: re.Match[bytes]) -> None:
        """Keep what a line states."""
        for group, text in match.groupdict().items():
            if text is None:
                continue
            place = self.places.setdefault(group, match.start(group))
            if group in NUMBERS and not is_number(text):
                if text.upper() in NO_NUMBERS:
                    continue
                raise line_error(self.data, match.start(group), f"{quoted(text)} is not a number")
            before = self.claims.setdefault(group, text)
            if group == "objective" and not isclose(
                float_of(before), float_of(text), rel_tol=AGREEMENT, abs_tol=AGREEMENT
            ):
                line = self.data.count(10, 0, place) + 1
                raise line_error(self.data, match.start(group), f"this is not the objective of line {line}")

    def _check(self) -> None:
        """Refuse a text whose counts or marks show that it is not whole."""
        if "count" in self.claims:
            text, place = self.claims["count"], self.places["count"]
            if not re.fullmatch(rb"-?\d{1,12}", text):
                line = self.data[self.data.rfind(b"\n", 0, place) + 1 : self.data.index(b"\n", place)]
                raise line_error(self.data, place, f"{quoted(line)} is not the number of columns")
            announced, held = abs(int(text)), self.entries - bool(self.cut)
            self.sparse = text.startswith(b"-") or "sparse" in self.claims or not announced
            if held != announced:
                words = f"{announced} columns are announced, {held} whole lines follow"
                raise line_error(self.data, place, words)
        none = {"none", "infeasible"} & set(self.claims)
        for group, missing in () if none else self.layout.needs:
            marks = {"end": self.ended or not self.begun, "begin": self.begun}
            if not marks.get(group, group in self.places):
                raise SolutionError(f"the file is cut off: it has no {missing}; {AGAIN}")

    @property
    def status(self) -> str:
        """The words of the status, or nothing."""
        return self.claims.get("status", b"").decode(errors="replace")

    @property
    def has_point(self) -> bool:
        """Whether the text holds a point."""
        if {"none", "infeasible"} & set(self.claims):
            return False
        pattern = self.layout.pointless
        if pattern and re.match(pattern, self.claims.get("status", b""), re.IGNORECASE):
            return False
        return self.entries > 0 or (self.begun and self.layout.omits_zeros is True) or self.sparse


def place_of_entry(data: bytes, start: int, entry: int) -> int:
    """The byte position of an entry among the lines from a position on."""
    for _ in range(entry + 1):
        while not data[start : data.index(b"\n", start)].strip():
            start = data.index(b"\n", start) + 1
        before, start = start, data.index(b"\n", start) + 1
    return before
