"""Mechanism files, and what else is read of files: models and texts that come along, what is piped in."""

from __future__ import annotations

import json
import os
import re
import sys
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO

from planar.document import LINK_PREFIX, read_mechanism
from planar.foundation.errors import BadInput
from planar.foundation.safe_files import is_existing, read_package_text
from planar.model.mechanism import Mechanism

OWN_FORMAT = "planar"
"""The name of planar's own form of file, among those of other programs."""
PIPED = "-"
"""What stands for the input of the process in place of a file's name."""
WEB_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://|www\.|[A-Za-z0-9-]+(\.[A-Za-z0-9-]+)+(:\d+)?/\S*\?|\?[a-z]+=")
"""How an address of the web begins, which is read and never opened."""
MAX_FILES_SEARCHED = 10_000
"""Files of a folder that are looked at for one that may be meant."""
MAX_FILE_BYTES = 8 * 1024 * 1024
"""Bytes; a mechanism of ten thousand links takes about two million."""


def loads(text: str | bytes, place: str = "$") -> Mechanism:
    """The mechanism in a JSON text. Raises BadInput.

    >>> import planar
    >>> planar.loads(planar.dumps("four-bar"))
    <Mechanism 'Four-bar chain': 4 links, 4 pairs, driven at A>
    """
    return read_mechanism(parse_json(text, place))


def from_dict(value: Any) -> Mechanism:
    """The mechanism in a JSON value (dicts, lists, texts, numbers). Raises BadInput.

    >>> import planar
    >>> planar.from_dict(planar.to_dict("four-bar"))
    <Mechanism 'Four-bar chain': 4 links, 4 pairs, driven at A>
    """
    return read_mechanism(value)


def to_dict(mechanism: Mechanism | str | os.PathLike[str]) -> dict[str, Any]:
    """The JSON value of a mechanism; `from_dict` gives the same mechanism back, to the last bit.

    >>> import planar
    >>> list(planar.to_dict("four-bar"))[:3]
    ['planar', 'name', 'about']
    """
    from planar.document.writer import write_mechanism

    return write_mechanism(as_mechanism(mechanism))


def dumps(mechanism: Mechanism | str | os.PathLike[str]) -> str:
    """The JSON text of a mechanism.

    >>> import planar
    >>> planar.loads(planar.dumps("four-bar"))
    <Mechanism 'Four-bar chain': 4 links, 4 pairs, driven at A>
    """
    return json.dumps(to_dict(mechanism), indent=2, ensure_ascii=False) + "\n"


def load(model: str | Path) -> Mechanism:
    """The mechanism in a file, a link, or the model of that name or id that comes along; "-" is what is piped in.

    Raises BadInput.

    >>> import planar
    >>> [link.name for link in planar.load("four-bar").links]
    ['AD', 'AB', 'BC', 'DC']
    """
    if str(model) == PIPED:
        return loads(_piped(), "standard input")
    return read_source(model)[0]


def read_source(
    model: str | os.PathLike[str], kind: str | None = None, length_unit: str | None = None
) -> tuple[Mechanism, str | None, tuple[str, ...]]:
    """The mechanism of a file, of another program's file, of a link, or of a model's name.

    With it the name of the other program's format, None for planar's own, and what could not be taken over; `kind`
    names the format that is not to be recognised, `length_unit` the unit of length of a file that names none. Raises
    BadInput.
    """
    place = os.fsdecode(model)
    if place == PIPED:
        place, content = "standard input", _piped()
    elif place.startswith(LINK_PREFIX):
        from planar.document.texts.mechanism_link import read_link

        return loads(read_link(place), "link"), None, ()
    elif WEB_ADDRESS.match(place) and not is_existing(place):
        content = place.encode()  # the mechanism is in the address, which is not opened
        place = f"link {place}" if len(place) <= 60 else f"link {place[:57]}..."
    else:
        path = find_model_file(place)
        place, content = str(path), read_limited(path)
    if (
        kind in (None, OWN_FORMAT)
        and content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")
        and b'"planar"' in content
    ):
        mechanism = loads(content, place)
        if length_unit is not None:
            raise BadInput("length unit", "a file of planar names its units; leave the unit of length out")
        return mechanism, None, ()
    return _read_foreign(content, place, kind, length_unit)


def _read_foreign(
    content: bytes, place: str, kind: str | None, length_unit: str | None
) -> tuple[Mechanism, str | None, tuple[str, ...]]:
    """The mechanism of another program's text."""
    from planar.formats.known_formats import foreign_text, known_links, named_format, recognised_format

    ending = Path(place).suffix
    told = "name a JSON file that describes a mechanism, another program's file of one, or a model that comes along"
    if b"\0" in content and ending.lower() not in ("", ".json"):
        raise BadInput(place, f"this is a {ending} file and no mechanism; {told}")
    opens = content.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]
    value, problem = None, None
    if opens in (b"{", b"["):
        try:
            value = parse_json(content, place)
        except BadInput as found_problem:  # other forms open with a brace, too
            problem = found_problem
    source = foreign_text(content, place, value, length_unit)
    found = named_format(kind, OWN_FORMAT) if kind not in (None, OWN_FORMAT) else recognised_format(source)
    if found is not None:
        if length_unit is not None and found.names_length_unit:
            message = f"a file of {found.title} names its unit of length; leave it out"
            raise BadInput("length unit", message)
        read = found.read(source)
        return read_mechanism(read.document), found.name, read.notes
    if place.startswith("link "):
        raise BadInput(place, f"no reader knows this link; links are read in these forms: {known_links()}")
    if problem is not None:
        raise problem
    if value is not None:
        return read_mechanism(value), None, ()
    if ending.lower() in ("", ".json"):
        return loads(content, place), None, ()
    raise BadInput(place, f"this is a {ending} file and no mechanism; {told}")


def load_value(source: str | os.PathLike[str], what: str) -> Any:
    """The JSON value in a file of another kind, as "a task's file"; "-" is what is piped in. Raises BadInput."""
    place = os.fsdecode(source)
    if place == PIPED:
        return parse_json(_piped(), "standard input")
    try:
        if not Path(place).is_file():
            raise BadInput(place or "''", f"there is no such file; name {what} (JSON)")
    except OSError as problem:
        told = f"{place[:60]}…" if len(place) > 100 else place
        raise BadInput(told, f"this cannot be the name of a file: {problem.strerror}") from None
    return parse_json(read_limited(Path(place)), place)


def as_mechanism(source: Any) -> Mechanism:
    """The mechanism that is given, or that of a file or of a model's name. Raises BadInput."""
    if isinstance(source, Mechanism):
        return source
    if isinstance(source, str | os.PathLike) and isinstance(path := os.fspath(source), str):
        return load(path)
    told = f"{type(source).__name__} {source!r:.60}"
    raise BadInput("mechanism", f"a Mechanism, a file or a model's name is wanted, not {told}")


def read_packaged_text(room: str, name: str) -> str:
    """A text that comes along in a room of the package, by its path there."""
    return read_package_text(Path(__file__).parents[1] / room / name)


def read_asset(name: str) -> str:
    """A text that comes along for pages."""
    return read_packaged_text("pages", f"assets/{name}")


def find_model_file(model: str | Path) -> Path:
    """The file that a MODEL argument means: a path, else the name or id of a model that comes along."""
    path = Path(model)
    try:
        if path.is_file():
            return path
        if path.is_dir():
            raise BadInput(str(model) or "''", "this is a folder; name a mechanism file in it")
        if path.exists():
            raise BadInput(str(model), "this is a pipe or a device; save the mechanism to a file and name that")
    except OSError as problem:
        told = f"{str(model)[:60]}…" if len(str(model)) > 100 else str(model)
        raise BadInput(told, f"this cannot be the name of a file: {problem.strerror}") from None
    known = {file.stem: file for file in model_files()}
    if str(model) in known:
        return known[str(model)]
    for file in known.values():
        if str(model) in parse_json(read_limited(file), str(file)).get("ids", ()):
            return file
    raise BadInput(str(model), _explain_missing(path, known))


def _explain_missing(path: Path, models: Iterable[str]) -> str:
    """What to say of an argument that is no file and no model: what was meant, by its looks a path or a name."""
    from difflib import get_close_matches

    name = path.name.lower()
    stem = name.removesuffix(".json").replace("_", "-").replace(" ", "-")
    alone = len(path.parts) == 1
    if alone and (stem in models or not path.suffix):
        near = get_close_matches(stem, models, 1, 0.6)
        meant = f"did you mean the model {near[0]!r}?" if near else "`planar models` lists the models that come along"
        return f"there is no such file, and no model of that name; {meant}"
    if not path.parent.is_dir():
        return f"there is no such file: there is no folder {str(path.parent)!r}"
    there = {each.stem.lower(): each.name for each in islice(path.parent.glob("*.json"), MAX_FILES_SEARCHED)}
    near = get_close_matches(path.stem.lower(), there, 1, 0.6)  # an ending that all have makes none alike
    told = f"; did you mean {str(path.parent / there[near[0]])!r}?" if near else ""
    return f"there is no such file{told or '; name a mechanism file (JSON), or a model that comes along by its name'}"


def model_files() -> tuple[Path, ...]:
    """The files of the models that come along, in the order of their names."""
    package = Path(__file__).parents[1]
    folder = package / "models" if (package / "models").is_dir() else package.parent / "models"
    return tuple(sorted(folder.rglob("*.json"), key=lambda file: file.stem))


def load_models() -> Iterator[tuple[Path, Mechanism]]:
    """Every model that comes along, read."""
    for file in model_files():
        yield file, load(file)


def read_limited(path: Path) -> bytes:
    """The content of a file that is no larger than a mechanism may be. Raises BadInput."""
    try:
        with path.open("rb") as file:
            return _limited(file, str(path))
    except OSError as problem:
        raise BadInput(str(path), f"the file cannot be read: {problem.strerror}") from None


def _piped() -> bytes:
    """What is piped into the process, no longer than a mechanism may be. Raises BadInput."""
    place = "standard input"
    try:
        content = b"" if sys.stdin is None else _limited(sys.stdin.buffer, place)
    except OSError as problem:
        raise BadInput(place, f"it cannot be read: {problem.strerror}") from None
    if not content:
        raise BadInput(place, "it is empty; pipe a mechanism (JSON) into the command, or name a file")
    return content


def _limited(file: BinaryIO, place: str) -> bytes:
    content = file.read(MAX_FILE_BYTES + 1)
    if len(content) > MAX_FILE_BYTES:
        raise BadInput(place, f"the file is larger than the {MAX_FILE_BYTES // 2**20} MiB that a mechanism may take")
    return content


def parse_json(text: str | bytes, place: str) -> Any:
    """The value of a JSON text, with every key once and every number finite. Raises BadInput."""

    def constant(word: str) -> Any:
        raise BadInput(place, f"{word} is not a number that a mechanism can have")

    def once(members: list[tuple[str, Any]]) -> dict[str, Any]:
        value = dict(members)
        if len(value) < len(members):
            twice = Counter(name for name, _ in members).most_common(1)[0][0]
            raise BadInput(place, f"the key {twice!r} stands twice in one object, so one of the two would be lost")
        return value

    try:
        if isinstance(text, bytes):
            text = text.decode("utf-8-sig")
        return json.loads(text, parse_constant=constant, object_pairs_hook=once)
    except UnicodeDecodeError as problem:
        raise BadInput(place, f"the file is not UTF-8 text (byte {problem.start})") from None
    except json.JSONDecodeError as problem:
        where = f"line {problem.lineno}, column {problem.colno}"
        what = problem.msg.removesuffix(" at")  # some messages of the library end in it
        raise BadInput(place, f"this is not JSON: {what} at {where}") from None
    except RecursionError:
        raise BadInput(place, "the file is nested too deeply to be a mechanism") from None
    except ValueError:
        raise BadInput(place, "a whole number has more digits than can be read") from None
