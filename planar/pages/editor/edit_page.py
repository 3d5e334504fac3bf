"""The page on which a mechanism is drawn: the page of `view`, with the pencil and the file that it changes."""

from __future__ import annotations

from typing import Any

from planar.document.files import from_dict
from planar.foundation.errors import BadInput, NoAnswer
from planar.pages.editor.answer import BACKDROP, edit_answer, file_answer
from planar.pages.page import EditedFile, page


def edit_page(value: Any, file: str | None, mark: str = "", note: str = "") -> str:
    """The page for a file's JSON value; `file` is the name under which it is saved, if it has one, with its `mark`.

    A file that is no mechanism yet, or cannot be assembled, is shown over an empty page. `note` is a sentence that the
    page shows when it is opened.
    """
    answer = edit_answer(value)
    mechanism = from_dict(value if "data" in answer else BACKDROP)
    answer.pop("functions", None)
    answer.pop("data", None)
    try:
        return page(mechanism, edited=EditedFile(value, file, answer, mark, note))
    except (BadInput, NoAnswer):  # a page lets less be shown than an answer
        return page(from_dict(BACKDROP), edited=EditedFile(value, file, answer, mark, note))


def pending_page(value: Any, file: str | None, mark: str = "", note: str = "") -> str:
    """The page of `edit_page` before anything is computed: empty paper, from which the page asks for its answer."""
    answer, mechanism = file_answer(value)
    title = BACKDROP["name"]
    if mechanism is not None:
        answer |= {"problem": "the drawing is being computed", "is_pending": True}
        title = mechanism.name
    return page(from_dict(BACKDROP | {"name": title}), edited=EditedFile(value, file, answer, mark, note))
