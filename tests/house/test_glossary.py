"""The glossary: every word of the field that tables, outcomes and quantities have is explained there."""

import ast
import re
from pathlib import Path

from planar.foundation.errors import Outcome
from planar.guide.topics import read_page
from planar.model.mechanism import PUBLISHED_QUANTITIES

TABLES = Path(__file__).parents[2] / "planar" / "reports" / "tables"
ENTRY = re.compile(r"^- \*\*(.+?)\*\*(.*(?:\n  .*)*)", re.MULTILINE)
EVERYDAY = (
    "a about after along also among an and another answer are as at by cannot change changed few from go goes handed "
    "here how in instead is it its kg line list m many mark missing mm model much n name no not number of off on one "
    "or other read right set sn step student than that the these this to together turn two value w what where which "
    "whose why with within would x xy y"
)
"""Words that need no explanation, units, and what options are called."""


def headings() -> set[str]:
    """Titles and heads of all tables, as they stand in the calls that make them."""
    found = set()
    for path in TABLES.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and "table" in getattr(node.func, "id", ""):
                parts = [part for each in node.args for part in ast.walk(each)]
                found |= {
                    each.value for each in parts if isinstance(each, ast.Constant) and isinstance(each.value, str)
                }
    return found


def singular(word: str) -> str:
    for ending, one in (("ies", "y"), ("ches", "ch"), ("s", "")):
        if word.endswith(ending) and not word.endswith(("ss", "us", "is")):
            return word.removesuffix(ending) + one
    return word


def words_of(text: str) -> set[str]:
    text = text.lower().replace("ang.", "angular").replace("s.n.", "sn")
    return {singular(word) for word in re.findall(r"[a-z]+", text.partition(", ")[0] if "N" not in text else text)}


GLOSSARY = dict(ENTRY.findall(read_page("look-up/glossary")))
EXPLAINED = {
    singular(word)
    for term, text in GLOSSARY.items()
    for part in (term, *re.findall(r"\*(.+?)\*", text))
    for word in re.findall(r"[a-z]+", part.lower())
}


def test_every_word_of_a_heading_is_in_the_glossary():
    explained = EXPLAINED | {singular(word) for word in EVERYDAY.split()}
    texts = headings() | {outcome.value for outcome in Outcome} | set(PUBLISHED_QUANTITIES)
    assert len(texts) > 200
    assert {text: missing for text in texts if (missing := words_of(text) - explained)} == {}


def test_the_glossary_goes_by_the_alphabet_and_leads_from_other_words_to_its_own():
    terms = [re.sub(r"[^a-z ]", "", term.split(",")[0].lower()) for term in GLOSSARY]
    assert terms == sorted(terms)
    for text in GLOSSARY.values():
        for target in re.findall(r"^, see (.+)\.$", text):
            assert any(target in term for term in GLOSSARY), target
