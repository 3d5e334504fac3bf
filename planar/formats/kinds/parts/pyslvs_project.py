"""The two entries of a Pyslvs project (YAML) that say the mechanism, found without a reader of all YAML."""

from __future__ import annotations

import re

from planar.foundation.errors import BadInput

PAIR = re.compile(r"\[\s*(\d+)\s*,\s*(\d+)\s*\]")
BLOCK_PAIR = re.compile(r"^-\s+-\s*(\d+)\s*\n\s+-\s*(\d+)\s*$", re.MULTILINE)


def project_entries(text: str, place: str) -> tuple[str, list[tuple[int, int]]]:
    """The expression of a project, and its input pairs (base joint, driven joint). Raises BadInput.

    Only the entries `mechanism` and `input` of the outermost map are looked for, as a block or in braces; nothing of
    the file makes an object of a program, whatever tags it has.
    """
    flow = text.lstrip().startswith("{")
    mechanism = _entry(text, "mechanism", flow)
    if mechanism is None:
        raise BadInput(place, "the project has no entry 'mechanism'")
    expression = mechanism.strip().strip("'\"").replace("\\\n", "").replace("\\", "")
    pairs = _entry(text, "input", flow) or ""
    result = BLOCK_PAIR.findall(pairs.strip("\n")) or PAIR.findall(pairs)
    return expression, [(int(base), int(driven)) for base, driven in result if len(base) + len(driven) < 12]


def _entry(text: str, key: str, flow: bool) -> str | None:
    """What stands under a key of the outermost map."""
    if flow:
        return _flow_entry(text, key)
    start = re.search(rf"^{key}:", text, re.MULTILINE)
    if start is None:
        return None
    rest = text[start.end() :]
    end = re.search(r"^[A-Za-z_]\w*:", rest, re.MULTILINE)
    return rest[: end.start()] if end else rest


def _flow_entry(text: str, key: str) -> str | None:
    """The same of a map in braces: the text up to the comma or brace at its own depth."""
    depth, start, quote = 0, None, ""
    at = 0
    while at < len(text):
        item = text[at]
        if quote:
            quote = "" if item == quote else quote
        elif item in "'\"":
            quote = item
        elif item in "[{":
            depth += 1
        elif item in "]}":
            depth -= 1
        if start is not None and ((item == "," and depth == 1 and not quote) or depth == 0):
            return text[start:at]
        if start is None and depth == 1 and item in "{," and (result := re.compile(rf"\s*{key}:").match(text, at + 1)):
            start = at = result.end()
            continue
        at += 1
    return None
