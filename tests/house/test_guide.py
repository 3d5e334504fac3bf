"""The guide: its commands and snippets run as a reader would, its links lead somewhere, its site is whole."""

import ast
import inspect
import io
import json
import os
import re
import shlex
import subprocess
import sys
from contextlib import chdir, redirect_stdout
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from PIL import Image, ImageChops, ImageStat
from rich.cells import cell_len

import planar
from planar import plot
from planar.cli import main
from planar.foundation.errors import BadInput
from planar.guide import reference, site
from planar.guide.keys_page import key_sections, keys_page, read_example, task_keys_page
from planar.guide.reference import reference_names
from planar.guide.topics import FIRST_PAGE, find_topic, guide_topics, read_page
from planar.model.file_units import FileUnits
from tests import command
from tests.draws import covering, part
from tests.guide_pictures import PICTURES
from tests.guide_screens import SCREENS
from tests.house.conftest import FAMILY_DESIGNS

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "planar" / "guide"
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = {path: read_page(path) for path in (FIRST_PAGE, *(each.path for each in guide_topics()))}
FILES = {
    name: text
    for page in PAGES.values()
    for name, text in re.findall(r"<!-- file: (\S+) -->\n```\w+\n(.*?)```", page, re.DOTALL)
}


def blocks(page: str, kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", PAGES[page], re.DOTALL)


TIMES = ("time-designs", "time-links")
"""Pictures of speeds, which `python -m benchmarks` draws."""
COMMANDS = {
    line: None
    for page in PAGES
    for text in blocks(page, "sh")
    for line in text.splitlines()
    if line.startswith("planar ") and line not in README
}
"""Those of README's tour are tried with it."""


def kinds_of(line: str) -> set[tuple[str, ...]]:
    """What a command shows: itself, its drawing, the format of its file, a refusal."""
    words = shlex.split(line.partition(" > ")[0], comments=True)
    drawing = [("plot", words[3])] if words[1] == "plot" else []
    files = [(words[1], Path(words[k + 1]).suffix) for k, word in enumerate(words[:-1]) if word == "-o"]
    refusals = [(words[1], "refused")] if "# refused" in line else []
    return {(words[1],), *drawing, *files, *refusals}


SHORTER = {
    "--duration 5s": "--duration 200ms",
    "--duration 2s": "--duration 200ms",
    "chains 8 --m": "chains 6 --m",
    "--count 200 --steps 60": "--count 4 --steps 12",
    "--samples 200": "--samples 20",
}
"""What commands are tried with: they do the same."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.usefixtures("coarse_pictures")
@pytest.mark.parametrize("line", covering(COMMANDS, kinds_of))
def test_a_command_of_the_guide_runs(line, folder):
    line = re.sub(r"--vary \d+", "--vary 1", line.partition(" > ")[0])  # of a class one is like another
    for written, tried in SHORTER.items():
        line = line.replace(written, tried)
    words = shlex.split(line, comments=True)
    words += ["--steps", "8"] if words[1] == "simulate" and "--steps" not in words else []
    done = command.run(folder, *words[1:])
    if "# refused" in line:
        assert done.status in (1, 2)
        assert done.err
        return
    if words[1] == "convert":  # tells what cannot be taken over
        assert (done.status, done.err.count("\n")) == (0, done.err.count("planar: "))
    else:
        done.done()
    if "-o" in words:
        made = folder / words[words.index("-o") + 1]
        assert made.is_dir() or made.stat().st_size > (50 if made.suffix == ".csv" else 500)
    else:
        assert len(done.out) > 100


SHORTER_SNIPPETS = {
    '"stick-slip", 5.0)': '"stick-slip", 0.2, steps=8)',
    ", 21)": ", 4)",  # positions of a map of forces
    "0.7, 1000)": "0.7, 20)",  # designs of a sweep
    "0.3, 1000)": "0.3, 20)",
    "cycle(mechanism, steps=360)": "cycle(mechanism, steps=60)",
    "met > 20": f"met > {FAMILY_DESIGNS}",
    "\n24 4 True": f"\n{FAMILY_DESIGNS} 4 True",
}
"""What snippets, and what they print, are tried with."""


@pytest.mark.usefixtures("coarse_pictures")
@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")])
def test_the_snippets_of_a_page_run(page, folder):
    code, expected = ("".join(blocks(page, kind)) for kind in ("python", "text"))
    for written, tried in SHORTER_SNIPPETS.items():
        code, expected = code.replace(written, tried), expected.replace(written, tried)
    whole, told = compile(code, page, "exec"), io.StringIO()
    with chdir(folder), redirect_stdout(told):
        exec(whole, {"__name__": "__main__"})
    printed = told.getvalue().splitlines()
    assert [line for line in expected.splitlines() if line not in printed] == []


def test_what_snippets_name_of_modules_is_there_in_a_process_that_has_imported_no_more():
    named = set()
    for page in PAGES:
        nodes = [*ast.walk(ast.parse("\n".join(blocks(page, "python"))))]
        imports = [each for each in nodes if isinstance(each, ast.Import | ast.ImportFrom)]
        modules = {alias.asname or alias.name for each in imports for alias in each.names}
        taken = [each for each in nodes if isinstance(each, ast.Attribute) and isinstance(each.value, ast.Name)]
        named.add("\n".join(map(ast.unparse, [*imports, *(each for each in taken if each.value.id in modules)])))
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "error"}
    code = [sys.executable, "-c", f"for text in {sorted(named)!r}: exec(text, {{}})"]
    done = subprocess.run(code, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("page", PAGES)
def test_every_link_and_picture_of_a_page_is_there(page):
    for target in re.findall(r"\]\(([^)\s]+)\)", PAGES[page]):
        if not target.startswith("http"):
            assert ((FOLDER / page).parent / target).is_file(), target


def test_every_page_is_listed_once_and_begins_with_its_title():
    held = [path.relative_to(FOLDER).with_suffix("").as_posix() for path in FOLDER.rglob("*.md")]
    assert sorted(PAGES) == sorted(held)
    assert len({each.name for each in guide_topics()}) == len(guide_topics())
    for each in guide_topics():
        assert each.text().startswith(f"# {each.title}\n")


def test_the_page_of_keys_is_that_of_the_schema():
    assert PAGES["begin/keys"] == keys_page()
    assert PAGES["design/task"] == task_keys_page()


def keys_of(value) -> set[str]:
    """All keys of a JSON value, at any depth."""
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return set(value if isinstance(value, dict) else ()).union(*map(keys_of, parts))


NOT_DRAWN = {"A published value", "Units"}
"""Sections of keys that no drawing has."""
WORDS = {"ids", "about", "source", "geometry", "notes", "published", *FileUnits._fields[2:]}
"""Keys of the file that are words, and those of its units."""


DRAWN_SECTIONS = [each for each in key_sections() if each.title not in NOT_DRAWN]


@pytest.mark.parametrize("section", DRAWN_SECTIONS, ids=lambda each: each.title)
def test_every_key_that_can_be_drawn_stands_in_an_example_with_its_picture(section):
    """Of keys of which the schema takes one, as radii or teeth, one is drawn; so where one is in place of another."""
    names = [each.example for each in key_sections() if each.example]
    of_parts = {"The file": names, "A point of a link": ["link"]}
    drawn = set().union(*(keys_of(read_example(name)) for name in of_parts.get(section.title, [section.example])))
    for kind in section.kinds:
        choice = {key for each in kind.get("oneOf", ()) for key in each.get("required", ())}
        drawn_here = drawn | (choice if choice & drawn else set())
        for key, own in kind["properties"].items():
            wanted = {key, *own.get("properties", {})} - WORDS
            assert wanted <= drawn_here or "in place of" in own["description"], key
    constants = {own["const"] for kind in section.kinds for own in kind["properties"].values() if "const" in own}
    assert constants <= {1, *(piece["motion"] for piece in read_example("law")["inputs"][0]["law"])}


@pytest.mark.parametrize("name", [each.example for each in key_sections() if each.example])
def test_an_example_of_keys_is_a_mechanism_file_that_goes_together(name):
    value = read_example(name)
    Draft202012Validator(planar.schema()).validate(value)
    assert planar.solve(planar.from_dict(value)).residual < 1e-12
    assert f"![{value['name']}](../pictures/keys/{name}.png)" in PAGES["begin/keys"]


def test_every_command_public_function_and_drawing_stands_on_a_page():
    whole = "\n".join(PAGES.values())
    assert [name for name in main.modules if not re.search(rf"planar {name}\b", whole)] == []
    functions = [name for name in planar.__all__ if inspect.isroutine(getattr(planar, name))]
    assert [name for name in functions if not re.search(rf"planar\.{name}\b", whole)] == []
    drawn = [name for name in plot.__all__ if not re.search(rf"planar plot \S+ {name}\b|plot\.{name}\b", whole)]
    assert drawn == []


def test_every_option_stands_on_a_page_and_every_option_of_a_page_is_one():
    known = {
        name
        for each in main.load_commands().values()
        for part in each.params
        if not getattr(part, "hidden", False)
        for name in (*part.opts, *part.secondary_opts)
    }
    known = {name for name in known if name.startswith("--")}
    whole = "\n".join(PAGES.values())
    shown = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*[a-z]", whole))
    assert known - shown == set()
    assert shown - known - {"--set", "--write"} == set()  # that of every command; that of the benchmarks


@pytest.mark.parametrize("page", [*PAGES, "README"])
def test_the_commands_and_options_that_prose_names_exist(page):
    """In prose a command stands between back quotes, as `planar solve --json`."""
    text = README if page == "README" else PAGES[page]
    commands = main.load_commands()
    shared = {"--set", "--help", "--version"}
    for code in re.findall(r"`(planar [^`]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL)):
        words = code.split()
        if words[1].startswith("-") or words[1].isupper():  # an option of the program, a placeholder
            continue
        assert words[1] in commands, code
        options = {option for part in commands[words[1]].params for option in (*part.opts, *part.secondary_opts)}
        assert {word.partition("=")[0] for word in words if word.startswith("--")} <= options | shared, code


def test_every_page_of_an_answer_shows_how_and_says_where_its_theory_is_from():
    for page in (each for each in PAGES if each.startswith(("answers/", "design/"))):
        assert blocks(page, "sh") or blocks(page, "python"), page
        assert re.search(r"^\*Sources?\*: ", PAGES[page], re.MULTILINE) or page in WITHOUT_THEORY, page


WITHOUT_THEORY = {"answers/pages", "answers/classroom", "design/task"}
"""Pages on what shows answers and has none of its own."""


def test_a_topic_is_known_by_its_name_and_its_title_and_others_are_offered():
    assert find_topic("first-hour") == find_topic("The first hour")
    with pytest.raises(BadInput, match="did you mean 'first-hour'"):
        find_topic("first-our")


def test_the_terminal_shows_a_page_and_what_there_is(tmp_path):
    shown = command.run(tmp_path, "guide").done()
    assert all(each.title in shown for each in guide_topics())
    assert "dead point" in command.run(tmp_path, "guide", "glossary").done()


def test_every_topic_fits_a_terminal_of_80_columns_without_marks_of_its_source(tmp_path):
    for each in guide_topics():
        shown = command.run(tmp_path, "guide", each.name, COLUMNS="80").done()
        assert max(cell_len(line.rstrip()) for line in shown.splitlines()) <= 80, each.name
        assert not re.search(r"!\[|<!--|\]\(|^\|", shown, re.MULTILINE), each.name


def test_every_public_name_is_in_the_reference():
    held = [name for names in reference_names().values() for name in names]
    assert sorted(held) == sorted(planar.__all__)
    assert all(reference_names().values())


def test_the_site_holds_pages_and_names_of_the_reference(tmp_path, monkeypatch):
    """All of them where one searches."""
    pages = part(guide_topics(), 2)
    names = {room: part(held, 3) for room, held in reference_names().items()}
    monkeypatch.setattr(site, "guide_topics", lambda: pages)
    monkeypatch.setattr(reference, "reference_names", lambda: names)
    done = command.run(tmp_path, "guide", "--html", "-o", "site").done()
    folder = tmp_path / "site"
    assert Path(done.strip()).name == "index.html"
    whole = {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
    assert {f"{each.path}.html" for each in pages} <= set(whole)
    assert sum(path.stat().st_size for path in whole.values()) < 6e6
    index = whole["searchindex.js"].read_text(encoding="utf-8")
    assert "linkag" in index  # what is searched are stems
    shown = "".join(path.read_text(encoding="utf-8") for name, path in whole.items() if name.startswith("reference"))
    assert [name for held in names.values() for name in held if f"planar.{name}" not in shown] == []


def test_every_picture_is_shown_and_one_is_what_the_tool_makes_now(tmp_path):
    shown = {target for page in PAGES.values() for target in re.findall(r"\]\((?:\.\./)*pictures/(\S+)\.png\)", page)}
    assert (
        shown
        == {*PICTURES, *TIMES, *SCREENS}
        == {
            path.relative_to(FOLDER / "pictures").with_suffix("").as_posix()
            for path in (FOLDER / "pictures").rglob("*.png")
        }
    )
    plot.save(PICTURES["sliding"](), tmp_path / "now.png")
    now, kept = (Image.open(path).convert("L") for path in (tmp_path / "now.png", FOLDER / "pictures" / "sliding.png"))
    apart = ImageChops.difference(now.resize(kept.size), kept)
    assert ImageStat.Stat(apart).mean[0] < 2.0  # of 255: other versions of the library smooth otherwise


def test_entries_that_the_page_on_writing_shows_are_such(folder):
    """Every entry of pairs, and of loads, springs and masses put into its own mechanism file."""
    check = Draft202012Validator({"$ref": "#/$defs/pair", "$defs": planar.schema()["$defs"]})
    shown = [text for block in blocks("begin/writing", "json") for text in block.splitlines()]
    pairs = [json.loads(text) for text in shown if re.match(r'\{"(turning|sliding|slot|gear|belt|rack)"', text)]
    assert len(pairs) >= 7
    for entry in pairs:
        check.validate(entry)
    value = json.loads((folder / "press.json").read_text(encoding="utf-8"))
    acting = next(block for block in blocks("begin/writing", "json") if '"loads"' in block)
    mechanism = planar.from_dict(value | json.loads("{" + acting + "}"))
    assert [len(each) for each in (mechanism.loads, mechanism.springs, mechanism.masses)] == [4, 1, 1]
    assert planar.forces(planar.solve(mechanism)).proof.equilibrium < 1e-10


def test_the_page_on_how_it_is_built_names_every_room():
    rooms = {path.relative_to(ROOT / "planar").with_suffix("").parts[0] for path in (ROOT / "planar").rglob("*.py")}
    rooms -= {"__init__", "__main__"}
    assert [room for room in rooms if not re.search(rf"\b{room}\b", PAGES["look-up/house"])] == []
