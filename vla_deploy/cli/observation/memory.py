"""`vla-deploy memory`: show what the robot remembers, correct it, and delete it."""

import argparse
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from drivers.clock import MonotonicClock
from vla_deploy.cli.commands import Run, add_command, add_top_command, emit
from vla_deploy.cli.errors import UsageError
from vla_deploy.cli.session import base_of
from vla_deploy.inference.roles import ModelShelf
from vla_deploy.memory import Episode, EpisodeOutcome, MemoryStore
from vla_deploy.memory.episode import place_words, sentence_of, unix_s
from vla_deploy.memory.judgement import MOST_CHARACTERS
from vla_deploy.memory.meaning import installed_embedder

EXAMPLES: Final[Mapping[str, str]] = {
    "list": "  vla-deploy memory list\n",
    "search": '  vla-deploy memory search "where did the keys go"\n',
    "things": "  vla-deploy memory things --kind keys\n",
    "outcome": '  vla-deploy memory outcome 12 failed --why "it was the wrong cup"\n',
    "export": "  vla-deploy memory export memory.jsonl\n",
    "erase": "  vla-deploy memory erase 12\n  vla-deploy memory erase --all --yes\n",
}


def register(commands: Any) -> None:
    """Add the command."""
    memory = add_top_command(commands, "memory", "".join(EXAMPLES.values()))
    acts = memory.add_subparsers(required=True)
    listed = _act(acts, "list", "the last commands and what came of them", list_episodes)
    listed.add_argument("--count", type=int, default=20, help="how many (default: 20)")
    found = _act(acts, "search", "what is remembered that fits some words", find)
    found.add_argument("text", help="such as a command or a thing")
    found.add_argument("--count", type=int, default=5, help="how many (default: 5)")
    things = _act(acts, "things", "where things were seen last", list_things)
    things.add_argument("--kind", default="", help='such as "keys"')
    things.add_argument("--colour", default="", help='such as "red"')
    judged = _act(acts, "outcome", "correct what came of a command", correct)
    judged.add_argument("number", type=int, help="its number in the list")
    judged.add_argument("outcome", choices=_OUTCOMES, help="what really came of it")
    judged.add_argument("--why", default="", help="in a few words, for the next time")
    exported = _act(acts, "export", "write everything to a file, a JSON document a line", export)
    exported.add_argument("file", type=Path, help="where to; it must not exist yet")
    erased = _act(acts, "erase", "forget one command, or everything", erase)
    erased.add_argument("number", type=int, nargs="?", help="its number in the list")
    erased.add_argument("--all", action="store_true", help="everything, things too")
    erased.add_argument("--yes", action="store_true", help="do not ask")


_OUTCOMES: Final = (EpisodeOutcome.SUCCEEDED.value, EpisodeOutcome.FAILED.value)


def _act(acts: Any, name: str, summary: str, run: Run) -> argparse.ArgumentParser:
    return add_command(acts, name, summary, EXAMPLES[name], run, "print JSON")


def list_episodes(arguments: argparse.Namespace) -> int:
    """Print the last commands, the newest first."""
    with _store(arguments) as store:
        episodes = store.newest(arguments.count)
    document = [one.document() for one in episodes]
    return emit(arguments, document, _numbered(episodes) or "nothing is remembered yet")


def find(arguments: argparse.Namespace) -> int:
    """Print the episodes that match some words, the best first."""
    embedder = installed_embedder(ModelShelf.of_base(base_of(arguments), MonotonicClock()))
    with closing(MemoryStore.of_base(base_of(arguments), embedder=embedder)) as store:
        found = store.recall(arguments.text, arguments.count)
    document = [{**one.episode.document(), "score": round(one.score, 5)} for one in found]
    text = _numbered([one.episode for one in found])
    return emit(arguments, document, text or "nothing like that is remembered")


def list_things(arguments: argparse.Namespace) -> int:
    """Print where things were seen last."""
    with _store(arguments) as store:
        things = store.last_seen(arguments.kind, arguments.colour)
    now_s = unix_s()
    text = "\n".join(place_words(one, now_s) for one in things)
    document = [one.document() for one in things]
    return emit(arguments, document, text or "no such thing is remembered")


def correct(arguments: argparse.Namespace) -> int:
    """Correct what came of a command; plans and models go by it from then on."""
    outcome = EpisodeOutcome(arguments.outcome)
    with _store(arguments) as store:
        judged = store.update_outcome(arguments.number, outcome, arguments.why[:MOST_CHARACTERS])
    return emit(arguments, judged.document(), _numbered([judged]))


def _numbered(episodes: Sequence[Episode]) -> str:
    now_s = unix_s()
    return "\n".join(f"{one.number:>5}  {sentence_of(one, now_s)}" for one in episodes)


def export(arguments: argparse.Namespace) -> int:
    """Write everything to a new file that only its owner can read."""
    with _store(arguments) as store:
        count = _written(store.export(), arguments.file)
    document = {"file": str(arguments.file), "documents": count}
    text = f"{count} documents written to {arguments.file}"
    return emit(arguments, document, text, indent=None)


def _written(documents: Iterable[Mapping[str, Any]], path: Path) -> int:
    count = 0
    try:
        with path.open("x", encoding="utf-8") as file:
            path.chmod(0o600)
            for one in documents:
                file.write(json.dumps(one) + "\n")
                count += 1
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; name another file") from error
    return count


def erase(arguments: argparse.Namespace) -> int:
    """Delete one command or everything, after asking."""
    if arguments.all == (arguments.number is not None):
        raise UsageError("give either the number of a command, or --all")
    what = "everything" if arguments.all else f"number {arguments.number}"
    _confirm(arguments, what)
    with _store(arguments) as store:
        if arguments.all:
            store.erase_all()
        else:
            store.erase(arguments.number)
    return emit(arguments, {"erased": what}, f"forgotten: {what}", indent=None)


def _confirm(arguments: argparse.Namespace, what: str) -> None:
    if arguments.yes:
        return
    if not sys.stdin.isatty():
        raise UsageError(f"forgetting {what} cannot be undone: say so with --yes")
    if input(f"Forget {what}? This cannot be undone. [y/N] ").strip().lower() not in ("y", "yes"):
        raise UsageError("nothing was forgotten")


def _store(arguments: argparse.Namespace) -> closing[MemoryStore]:
    return closing(MemoryStore.of_base(base_of(arguments)))
