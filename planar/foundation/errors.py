"""What can go wrong, and the sentence in which it is said."""

from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import Any

MAX_NAMES_LISTED = 12
"""Names that a sentence lists; of more it tells how many."""
INVISIBLE_JOINERS = "\u200c\u200d"
"""Invisible, but letters of some scripts need them."""
MAX_LOCATION_LENGTH, MAX_SENTENCE_LENGTH, MAX_REASON_LENGTH = 200, 400, 1200
"""Characters of a place, of a sentence about it, and of a reason why there is no answer."""


class Outcome(StrEnum):
    """How an attempt at a mechanism ended; the value is the phrase shown."""

    SOLVED = "solved"
    CANNOT_BE_ASSEMBLED = "cannot be assembled"
    DEAD_POINT = "dead point"
    CHANGE_POINT = "change point"
    TOO_FEW_INPUTS = "too few inputs"
    TOO_MANY_INPUTS = "too many inputs"
    INPUT_JAMMED = "input jammed"
    BRANCH_LOST = "branch lost"
    TOO_INEXACT = "too inexact"
    STOP = "stop"
    STRUCTURE = "structure"
    INTERRUPTED = "interrupted"

    @property
    def code(self) -> int:
        """The number that stands for it in arrays of statuses."""
        return [*Outcome].index(self)


class TrackingEnd(StrEnum):
    """How a motion ends that cannot be followed further."""

    DEAD_POINT = "dead point"
    ENDLESS = "endless"
    BRANCH_LOST = "lost"
    OUT_OF_RANGE = "far"
    WORK_LIMIT = "spent"
    INTERRUPTED = "interrupted"
    STOP = "stop"


def join_names(names: Iterable[str], max_names: int | None = MAX_NAMES_LISTED, last_joiner: str = " and ") -> str:
    """Names in a sentence: a, b and c; of very many the first, and how many more."""
    every = list(names)
    if max_names is not None and len(every) > max_names + 1:
        every = [*every[:max_names], f"{len(every) - max_names} more"]
    return last_joiner.join(filter(None, (", ".join(every[:-1]), every[-1]))) if every else "none"


def suggest_spelling(word: str, known: Iterable[str], sentence: str = "did you mean {!r}?", cutoff: float = 0.6) -> str:
    """A clause that offers the name nearest to a misspelt word; empty where none is near."""
    near = _nearest_names(word, list(known), cutoff)
    return "; " + sentence.format(near[0]) if near else ""


def suggest_name(word: str, known: Iterable[str], kind: str, max_names: int | None = MAX_NAMES_LISTED) -> str:
    """A clause that offers the nearest name and lists the names of this kind, the nearest first."""
    return suggest_name_of_kinds(word, {kind: known}, max_names)


def suggest_name_of_kinds(
    word: str, names_by_kind: Mapping[str, Iterable[str]], max_names: int | None = MAX_NAMES_LISTED
) -> str:
    """A clause that offers the nearest name, and lists the names of each kind ("links", "pairs"), nearest first."""
    names = {kind: list(known) for kind, known in names_by_kind.items()}
    near = _nearest_names(word, list(dict.fromkeys(name for known in names.values() for name in known)), 0.6)
    rank = {name: index for index, name in enumerate(near)}
    lists = [
        f"{kind} are {join_names(sorted(known, key=lambda name: rank.get(name, len(rank))), max_names)}"
        for kind, known in names.items()
        if known
    ]
    question = f"; did you mean {near[0]!r}? " if near else "; "
    return question + "; ".join(lists) if lists else "; there is none"


def _nearest_names(word: str, names: list[str], cutoff: float) -> list[str]:
    """The names that are spelt like the word, the nearest first."""
    from difflib import get_close_matches

    same_letters = [name for name in names if name.lower() == word.lower()]
    return [
        *dict.fromkeys(same_letters + get_close_matches(word[:MAX_LOCATION_LENGTH], names, MAX_NAMES_LISTED, cutoff))
    ]


def first_unprintable(text: str) -> str:
    """The first character that cannot be shown in a line, or turns the order of others there; empty where all can."""
    return next((each for each in text if not (each.isprintable() or each in INVISIBLE_JOINERS)), "")


def _printable_line(text: str, longest: int) -> str:
    """The text as one line that a screen can show, whatever a file put into it."""
    if len(text) > longest:
        text = f"{text[: longest * 3 // 5]} … {text[-longest * 3 // 10 :]}"
    return "".join(each if each.isprintable() else repr(each)[1:-1] for each in text)


class PlanarError(Exception):
    """Anything that planar refuses; its text is one sentence for a person."""


class BadInput(PlanarError):
    """A mechanism file or an argument says something that cannot be meant.

    `place` is a JSON path such as `$.pairs[2].links[0]`, or a file's name.
    """

    def __init__(self, place: str, sentence: str):
        self.place = _printable_line(place, MAX_LOCATION_LENGTH)
        self.sentence = _printable_line(sentence, MAX_SENTENCE_LENGTH)
        super().__init__(f"{self.place}: {self.sentence}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.place, self.sentence)


class Unknown(PlanarError, KeyError):
    """A name of a point, a link, a pair or an input is asked for that the mechanism does not have."""

    def __str__(self) -> str:
        return str(self.args[0])


class WriteFailure(BadInput):
    """A result that was found could not be written whole, as on a full disk; `place` is where it was to go."""


def unknown_format_error(suffix: str, what: str, endings: Iterable[str]) -> BadInput:
    """What to say of a file whose name ends in what cannot be written: the endings that can."""
    place = f"a file name that ends in {suffix!r}" if suffix else "a file name without an ending"
    return BadInput(place, f"{what} can be written to files that end in {join_names(endings, last_joiner=' or ')}")


class NoAnswer(PlanarError):
    """The mechanism is well described but has no answer here; `outcome` says which kind, `more` what a program asks.

    The sentence names a few of very many links or pairs; a program finds all of them in `more`. What takes long to find
    for a sentence is given as a function, which is called when the sentence is first read.
    """

    def __init__(self, outcome: Outcome, reason: str | Callable[[], str], **more: Any):
        super().__init__(outcome)
        self.outcome, self._reason = outcome, reason
        self.more: dict[str, Any] = more

    @property
    def reason(self) -> str:
        """The sentence."""
        if not isinstance(self._reason, str):
            self._reason = self._reason()
        return _printable_line(self._reason, MAX_REASON_LENGTH)

    def __str__(self) -> str:
        return f"{self.outcome.value}: {self.reason}"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.outcome, self.reason), {"more": self.more}


class MissingGlyphs(UserWarning):
    """No installed font has some `characters` of a drawing's texts."""

    def __init__(self, characters: Iterable[str]):
        self.characters = tuple(sorted(set(characters)))
        named = join_names([f"{each} (U+{ord(each):04X})" for each in self.characters])
        super().__init__(
            f"no installed font has {named}, so drawings show \N{REPLACEMENT CHARACTER} instead: install one that"
            " does, such as Noto Sans with its parts for other scripts"
        )
