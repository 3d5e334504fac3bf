"""The page on which a mechanism is drawn: the page of `view`, with the pencil and the file that it changes."""

from __future__ import annotations

from typing import Any

from planar.document.files import from_dict
from planar.foundation.errors import BadInput, NoAnswer
from planar.pages.editor.answer import BACKDROP, edit_answer
from planar.pages.page import EditedFile, page


def edit_page(value: Any, file: str | None, mark: str = "") -> str:
    """The page for a file's JSON value; `file` is the name under which it is saved, if it has one, with its `mark`.

    A file that is no mechanism yet, or does not go together, is drawn on all the same, over an empty page.
    """
    answer = edit_answer(value)
    mechanism = from_dict(value if "data" in answer else BACKDROP)
    answer.pop("functions", None)
    answer.pop("data", None)
    try:
        return page(mechanism, edited=EditedFile(value, file, answer, mark))
    except (BadInput, NoAnswer):  # a page lets less be shown than an answer
        return page(from_dict(BACKDROP), edited=EditedFile(value, file, answer, mark))
