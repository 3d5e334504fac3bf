"""README's commands and snippets, run as a reader would."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from PIL import Image, ImageChops, ImageStat

from tests import command
from tests.draws import SEARCH
from tests.house.conftest import COARSE

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", README, re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    name, text = re.search(r"<!-- file: (\S+) -->\n```json\n(.*?)```", README, re.DOTALL).groups()
    (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


COMMANDS = [
    shlex.split(line, comments=True)
    for text in blocks("sh")
    for line in text.splitlines()
    if line.startswith("planar ")
] + [shlex.split(text) for text in re.findall(r"\) `(planar [^`]*)` \|", README)]


def installed_by_the_first_command() -> set[str]:
    """The distributions that README's first command installs: what planar and the extras named there need."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = re.search(r"pip install -q '\.\[([\w,]+)\]'", README).group(1).split(",")
    waiting = [
        *project["dependencies"],
        *(line for extra in extras for line in project["optional-dependencies"][extra]),
    ]
    names = set()
    while waiting:
        requirement = Requirement(waiting.pop())
        name = canonicalize_name(requirement.name)
        if name in names or (requirement.marker and not requirement.marker.evaluate({"extra": ""})):
            continue
        names.add(name)
        waiting += metadata.requires(name) or ()
    return names


TOUR = """
import json, sys
from importlib import import_module
from planar.cli import main

for module, numbers in json.loads(sys.argv[3]).items():
    for name, value in numbers.items():
        setattr(import_module(module), name, value)

for words in json.loads(sys.argv[1]):
    print("==", *words, flush=True)
    try:
        main(words[1:], prog_name="planar")
    except SystemExit as ending:
        if ending.code:
            sys.exit(f"{words}: exit status {ending.code}")
exec(sys.argv[2], {"__name__": "__main__"})
"""


def test_commands_and_snippet_of_the_tour_run_with_what_the_first_command_installs(folder):
    """In one process for which no other packages than those are installed."""
    (snippet,) = blocks("python")
    tried = [["6" if word == "8" else word for word in words] for words in COMMANDS]  # chains of fewer links
    installed = folder / "installed"
    installed.mkdir()
    for name in installed_by_the_first_command():
        distribution = metadata.distribution(name)
        for top in {file.parts[0] for file in distribution.files or ()} - {"..", "__pycache__"}:
            (installed / top).symlink_to(distribution.locate_file(top))
    paths = {"PYTHONPATH": os.pathsep.join(map(str, (installed, ROOT)))}
    environment = os.environ | paths | {"PYTHONWARNINGS": "error", "PYTHONIOENCODING": "utf-8"}
    done = subprocess.run(
        [sys.executable, "-S", "-c", TOUR, json.dumps(tried), snippet, json.dumps({} if SEARCH else COARSE)],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        env=environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    _, *printed = re.split(r"^== planar .*$", done.stdout, flags=re.MULTILINE)
    for words, text in zip(COMMANDS, printed, strict=True):
        if "-o" in words:
            assert (folder / words[words.index("-o") + 1]).stat().st_size > 1000
        else:
            assert len(text) > 100


def test_the_tour_has_twelve_pictures_which_are_there_as_all_that_it_leads_to():
    targets = re.findall(r"\]\(([^)\s]+)\)", README)
    assert sum(target.startswith("planar/guide/pictures/") for target in targets) == 12
    assert [target for target in targets if not (ROOT / target).is_file()] == []


def test_the_tour_runs_as_it_stands_once_the_environment_is_activated(folder):
    """In a shell that has no `planar`, in an environment where the set-up's own command put it."""
    (line,) = re.search(r"<!-- activate -->\n```sh\n(.*?)```", README, re.DOTALL).groups()
    assert README.index(line) < README.index("\nplanar ")
    made = folder / re.search(r"-m venv (\S+)", README).group(1)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", made], check=True)
    script = made / "bin" / "planar"
    entry = "import sys; from planar.cli import main; sys.exit(main())"
    script.write_text(f"#!/bin/sh\nexec '{sys.executable}' -c '{entry}' \"$@\"\n", encoding="utf-8")
    script.chmod(0o755)
    elsewhere = [each for each in os.get_exec_path() if not (Path(each) / "planar").exists()]
    done = subprocess.run(
        [shutil.which("sh"), "-ec", f"{line}\n{shlex.join(COMMANDS[0])}"],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | {"PATH": os.pathsep.join(elsewhere), "PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Press" in done.stdout


def test_the_first_screen_has_a_sentence_a_picture_and_two_commands():
    first = README.splitlines()[:24]
    assert any(re.fullmatch(r"!\[.+\]\(\.pictures/klann-leg\.gif\)", line) for line in first)
    assert sum(line == "```sh" for line in first) == 2


def test_the_moving_picture_is_what_the_tool_makes_now(tmp_path):
    command.run(tmp_path, "animate", "klann-leg", "--point", "foot", "-o", "now.gif").done()
    with Image.open(tmp_path / "now.gif") as now, Image.open(ROOT / ".pictures/klann-leg.gif") as shown:
        assert (now.n_frames, now.size) == (shown.n_frames, pytest.approx(shown.size, rel=0.02))
        for frame in (0, now.n_frames // 3):
            now.seek(frame)
            shown.seek(frame)
            apart = ImageChops.difference(now.convert("L"), shown.convert("L").resize(now.size))
            assert ImageStat.Stat(apart).mean[0] < 2.0  # of 255: other versions of the library smooth otherwise


def test_the_checks_run_exactly_the_readmes_test_command():
    script = (ROOT / ".ci" / "run").read_text()
    assert "README.md" in script
    assert "pip install" not in script
    shell = shutil.which("bash")
    found = subprocess.run(
        [shell, "-c", re.search(r"command=\$\((.*)\)\n", script).group(1)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert found.strip() == next(text for text in blocks("sh") if "pytest" in text).strip()


def test_the_wheel_brings_the_models_and_works_from_another_folder(tmp_path):
    """Built once, unpacked into an empty folder, and run from there with the libraries of this environment alone."""
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "-o", str(tmp_path / "wheel"), str(ROOT)]
    done = subprocess.run(build, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,) = (tmp_path / "wheel").glob("*.whl")
    place = tmp_path / "site"
    shutil.unpack_archive(wheel, place, "zip")
    code = "import planar, json; print(json.dumps([planar.__file__, planar.solve(planar.load('000-P1')).mobility]))"
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | {"PYTHONPATH": str(place)}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    file, mobility = json.loads(done.stdout)
    assert Path(file).is_relative_to(place)
    assert mobility == 1
    names = {path.stem for path in (place / "planar" / "models").rglob("*.json")}
    assert names == {path.stem for path in (ROOT / "models").rglob("*.json")}
