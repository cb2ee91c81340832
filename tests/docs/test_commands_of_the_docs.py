"""Every command that the documentation or a `--help` names is one that the program takes."""

import argparse
import contextlib
import io
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from vla_deploy.cli.main import parser

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("*.md")))
# What may stand before a command in a line: a prompt, another user, a variable, a folder.
BEFORE = r"(?:\$ |sudo (?:-u \S+ )?|[A-Z_]+=\S+ |[\w./-]*/)*"
LINE = re.compile(rf"^\s*{BEFORE}(?:vla-deploy|\$vla) +(?P<words>.*)")
BEHIND = re.compile(
    r' {2,}.*| #.*| [|>&] .*| &$|;(?=(?:[^"]*"[^"]*")*[^"]*$).*'
)  # not within quotes
FENCED = r"^```(?P<language>.*)\n(?P<fenced>[\s\S]*?)^```"
BLOCK = re.compile(rf"{FENCED}|(?P<indented>(?:^ {{4}}.*\n)+)", re.M)
INLINE = re.compile(rf"`{BEFORE}vla-deploy +([^`]*)`")
# What a sentence may leave out, put a word for, or say before the command.
LOOSE = re.compile(r"--runtime-base \S+ |\[[^]]*\]|\b[A-Z][A-Z_]+\b|…|\.\.\.")


def commands_below(top: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Yield a parser and all those of its commands."""
    yield top
    for action in top._actions:
        if isinstance(action, argparse._SubParsersAction):
            for one in dict.fromkeys(action.choices.values()):
                yield from commands_below(one)


PROGRAM = parser()
COMMANDS = {one.prog: one for one in commands_below(PROGRAM)}


def complaint(words: list[str]) -> str:
    """Return what the command line says against these words; nothing where it takes them."""
    told = io.StringIO()
    with contextlib.redirect_stderr(told), contextlib.redirect_stdout(io.StringIO()):
        try:
            PROGRAM.parse_args(words)
        except SystemExit as ended:
            return told.getvalue() if ended.code else ""
    return ""


def in_blocks(text: str) -> Iterator[str]:
    """Yield each command of the blocks of a page, without what stands around it."""
    for block in BLOCK.finditer(text):
        for line in (block["fenced"] or block["indented"] or "").splitlines():
            for part in line.split(" && "):
                if found := LINE.search(part):
                    yield BEHIND.sub("", found["words"]).strip()


def in_sentences(text: str) -> Iterator[str]:
    """Yield each command that a sentence names, often without what it needs; `a|b` as two."""
    for told in INLINE.findall(" ".join(BLOCK.sub("", text).split())):
        words = [word.split("|") for word in re.sub(r" \| ", "|", told).split()]
        alternatives = max(words, key=len)
        for one in alternatives:
            yield " ".join(one if word is alternatives else "|".join(word) for word in words)


def test_the_commands_are_found() -> None:
    page = "    $ vla-deploy status --json   all of it\n\nor `vla-deploy can scan|monitor`.\n"
    assert list(in_blocks(page)) == ["status --json"]
    assert list(in_sentences(page)) == ["can scan", "can monitor"]
    assert sum(len([*in_blocks(one.read_text())]) for one in PAGES) > 100


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_block_is_taken(page: Path) -> None:
    commands = list(in_blocks(page.read_text(encoding="utf-8")))
    assert [told for one in commands if (told := complaint(shlex.split(one)))] == []


def strange_options(words: list[str]) -> list[str]:
    """Return the options among these words that their command does not have."""
    names = [" ".join(["vla-deploy", *words[:count]]) for count in range(len(words) + 1)]
    known = {one for name in names if name in COMMANDS for one in options_of(COMMANDS[name])}
    return [word for word in words if word.startswith("-") and word not in known]


def options_of(command: argparse.ArgumentParser) -> set[str]:
    return {name for action in command._actions for name in action.option_strings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_command_of_a_sentence_is_there_with_its_options(page: Path) -> None:
    for command in in_sentences(page.read_text(encoding="utf-8")):
        words = shlex.split(LOOSE.sub("", command))
        told = complaint([*words, "--help"])
        assert not told or "expected one argument" in told, f"vla-deploy {command}: {told}"
        assert strange_options(words) == [], f"vla-deploy {command}"


@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
def test_every_example_of_a_help_is_taken(command: argparse.ArgumentParser) -> None:
    examples = list(in_blocks(re.sub("^  ", "    ", f"{command.epilog}\n", flags=re.M)))
    assert examples
    assert [told for one in examples if (told := complaint(shlex.split(one)))] == []
