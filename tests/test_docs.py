"""The documentation is true: its commands parse, its links lead somewhere, its tables are what the code has."""

import importlib
import json
import re
import shlex
from pathlib import Path

import click
import pytest

from cli.main import cli
from sonarlog.mcap_file import McapReader
from sonarlog.run_topics import CHANNELS

HOME = Path(__file__).parents[1]
PAGES = sorted([HOME / "README.md", HOME / "CHANGELOG.md", *HOME.glob("recordings/*.md"), *HOME.glob("docs/**/*.md")])
PLACEHOLDER = re.compile(r"[…\[{]|\bCOMMAND\b")


def commands(text: str) -> list[str]:
    """Every `sonarlog …` in blocks of shell, without prompts and with continued lines joined, and in code in a line."""
    found: list[str] = []
    for block in re.findall(r"^```(?:console|sh)\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        lines = block.replace("\\\n", " ").splitlines()
        prompted = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
        found += [line for line in prompted or lines if line.startswith("sonarlog ")]
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    found += [code for code in re.findall(r"`([^`\n]+)`", prose) if code.startswith("sonarlog ")]
    return [line for line in found if not PLACEHOLDER.search(line)]


def parse(line: str) -> None:
    """Parse a command line as click would, running nothing. Raises click.UsageError."""
    words = re.split(r"\s(?:&&?|\||>)(?:\s|$)", line)[0]
    _, *arguments = shlex.split(words, comments=True)
    command: click.Command = cli
    context = click.Context(cli)
    while isinstance(command, click.Group) and arguments and not arguments[0].startswith("-"):
        name = arguments.pop(0)
        inner = command.get_command(context, name)
        if inner is None:
            raise click.UsageError(f"no command {name!r}")
        command = inner
    if isinstance(command, click.Group) or not arguments or set(arguments) & {"--help", "--version"}:
        return
    command.make_context(command.name, arguments, parent=context)


LINES = [(path.relative_to(HOME), line) for path in PAGES for line in commands(path.read_text(encoding="utf-8"))]


@pytest.mark.parametrize(("page", "line"), LINES, ids=[f"{page}: {line}" for page, line in LINES])
def test_every_command_shown_is_one(page: Path, line: str) -> None:
    parse(line)


def test_what_is_no_command_is_found() -> None:
    assert commands("```sh\nsonarlog fly \\\n  high\n```\nand `sonarlog replay --fast`") == [
        "sonarlog fly    high", "sonarlog replay --fast",
    ]  # fmt: skip
    for line in ("sonarlog fly", "sonarlog replay a.mcap --fast", "sonarlog record -o a --port b --max-stations none"):
        with pytest.raises(click.UsageError):
            parse(line)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(HOME)))
def test_links_lead_somewhere_and_make_has_its_targets(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    links = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]
    assert [link for link in links if link and not (page.parent / link).exists()] == []
    targets = set(re.findall(r"^([a-z]+):", (HOME / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    assert set(re.findall(r"[`$] ?make ([a-z]+)\b", text)) <= targets


def table(page: str, heading: str) -> list[list[str]]:
    """Rows of the first table after a heading, without its head."""
    text = (HOME / "docs" / page).read_text(encoding="utf-8")
    rows = re.search(r"^\|.*?(?:\n(?!\|)|\Z)", text[text.index(heading) :], re.MULTILINE | re.DOTALL)
    assert rows
    cells = [[cell.strip() for cell in row.strip("|").split(" | ")] for row in rows[0].strip().splitlines()]
    return cells[2:]


def test_the_paper_page_names_every_block_and_functions_that_exist() -> None:
    rows = table("paper.md", "# The paper, block by block")
    assert [row[0][0] for row in rows] == list("ABCDEFGHI")
    for row in rows:
        for path, names in re.findall(r"`([\w/]+)\.py: ([\w, ]+)`", row[1]):
            module = importlib.import_module(path.replace("/", "."))
            assert all(callable(getattr(module, name)) for name in names.split(", "))


def test_the_run_page_names_the_topics_and_keys_that_a_run_has(short_run: Path) -> None:
    reader = McapReader(short_run)
    topics = {topic for row in table("runs.md", "## Topics") for topic in re.findall(r"`(/[\w/]+)`", row[0])}
    assert topics >= {message.topic for message in reader.stream()}
    assert topics == {"/step", "/blocks", *CHANNELS}  # a run as short as this has no updates of its map
    keys = {key for row in table("runs.md", "## `/step`") for key in re.findall(r"`(\w+)`", row[0])}
    assert keys == set(json.loads(next(iter(reader.stream(["/step"]))).data))
    text = (HOME / "docs" / "runs.md").read_text(encoding="utf-8")
    for name in (*reader.metadata, *reader.metadata["run"], *reader.attachments):
        assert f"`{name}`" in text
