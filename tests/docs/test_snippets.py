"""The code and the commands on the pages run, and their links lead on."""

import re
import shlex
from pathlib import Path

import matplotlib as mpl
import pytest

from drake_mobarm import cli, load_scenario
from drake_mobarm.job import find_tables, job_names

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"^(?:#|<!--) ([\w.]+\.(?:py|yaml|sdf))(?: -->)?\n")


def blocks(page):
    """The fenced blocks of a page: language and text."""
    return _BLOCK.findall(page.read_text(encoding="utf-8"))


def file_of(text):
    """The file that a block is of, by its first line; None for most."""
    named = _FILE.match(text)
    return None if named is None else named[1]


def write_files(page, folder):
    """Writes the files that a page shows into a folder."""
    for _, text in blocks(page):
        if file_of(text) is not None:
            (folder / file_of(text)).write_text(text)


def commands(page):
    """The words of each `mobarm` command of a page, without `mobarm`."""
    found = []
    shown = [text for language, text in blocks(page) if language == "sh"]
    # The README's set-up lines stand in an indented block.
    shown += re.findall(r"^    (\S.*)$", page.read_text(encoding="utf-8"), re.M)
    for line in "\n".join(shown).splitlines():
        for command in line.split("&&"):
            words = shlex.split(command, comments=True)
            if words and Path(words[0]).name == "mobarm":
                found.append(words[1:])
    return found


WITH_PYTHON = [
    page for page in PAGES if any(kind == "python" for kind, _ in blocks(page))
]
WITH_COMMANDS = [page for page in PAGES if commands(page)]


@pytest.mark.parametrize("page", WITH_PYTHON, ids=lambda page: page.name)
def test_the_python_of_a_page_runs_and_its_robots_succeed(
    page, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    write_files(page, tmp_path)
    names = {"__name__": "snippets"}
    for language, text in blocks(page):
        if language == "python" and file_of(text) is None:
            exec(compile(text, page.name, "exec"), names)
            if "result = run(" in text:
                assert names["result"].success, names["result"].reason


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=lambda page: page.name)
def test_the_commands_of_a_page_are_valid(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_files(page, tmp_path)
    for words in commands(page):
        options = cli._make_parser().parse_args(words)
        if words[0] in ("run", "draw"):
            load_scenario(options.scenario, getattr(options, "overrides", []))
        elif words[0] == "reproduce":
            assert options.table in find_tables()


def test_the_pages_have_python_and_commands():
    assert ROOT / "README.md" in WITH_PYTHON
    assert ["run", "homing"] in commands(ROOT / "README.md")
    assert {page.stem for page in WITH_COMMANDS} >= {*job_names(), "worlds"}


def anchors(page):
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    words = [re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings]
    return {text.replace(" ", "-") for text in words}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_links_of_a_page_lead_somewhere(page):
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.M | re.S)
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    assert links
    for link in links:
        if link.startswith("https://"):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


def test_every_page_shows_a_picture_and_is_in_the_index():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    for page in PAGES:
        assert re.search(r"!\[.+?\]\(.+?\.png\)", page.read_text()), page.name
        if page.parent == DOCS and page.stem != "index":
            assert f"\n- [{page.read_text()[2:].splitlines()[0]}](" in index
            assert f"]({page.name})" in index


@pytest.mark.parametrize("job", job_names())
def test_every_job_has_its_page_its_notebook_and_its_line_in_the_readme(job):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    for file in (f"docs/{job}.md", f"notebooks/{job}.ipynb"):
        assert (ROOT / file).is_file()
        assert f"]({file})" in readme
    assert f"`mobarm run {job}`" in readme


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 120


def test_pictures_are_small():
    pictures = list((DOCS / "images").iterdir())
    assert pictures
    assert [p.name for p in pictures if p.stat().st_size > 300_000] == []
