"""Compose whole commands with their answers: clauses, politeness, slips, joints, chatter, noise."""

from collections.abc import Mapping
from dataclasses import dataclass
from random import Random
from typing import Final

from training.planner.sentences.clause import (
    Clause,
    PhraseGroup,
    SaidWord,
    answer_text,
    load_groups,
    make_clause,
)
from training.planner.sentences.grammar import Sequence, expand
from training.planner.sentences.hearing import misheard
from training.planner.sentences.manners import (
    ASKING,
    CALLS,
    CLAUSE_SLIPS,
    ENDINGS,
    FILLERS,
    GERUND_ASKING,
    JOINTS,
    OPENINGS,
    REASONS,
)
from training.planner.sentences.telling import AFTER, BEFORE, load_remarks, load_told
from training.planner.sentences.words import DOUBLING
from vla_deploy.planning.command_parser.wording import MOST_COMMAND_WORDS

# How often each kind of step is drawn, of those that may stand among others.
WEIGHTS: Final[Mapping[str, float]] = {
    "go": 12, "pick": 13, "put": 22, "bring": 15, "find": 9, "where": 5, "look": 6, "move": 7,
    "turn": 7, "open": 4, "close": 3, "pose": 3, "say": 6, "wait": 5, "stop": 2, "give": 1.5,
    "tidy": 1.5, "ask": 2.5,
}  # fmt: skip
_TOLD: Final = 80
"""Of sentences that were written out whole, to 100 of all others."""
_REMARKED: Final = 0.15
"""Share of commands with a remark before, and of those with one behind."""
_ONLY_REMARKS: Final = 0.12
"""Share of what commands nothing."""
_LATER: Final = frozenset(WEIGHTS) - {"where", "stop"}
_ALONE: Final[Mapping[str, float]] = {"unknown": 12, "impossible": 7, "nothing": 3}


@dataclass(frozen=True, slots=True)
class Example:
    """Hold a command as plain words and the answer that is right for it."""

    command: str
    answer: str


class Composer:
    """Make examples by chance; the same random numbers give the same examples."""

    def __init__(self, held_out: bool = False, chatter: tuple[str, ...] = ()) -> None:
        self._every = load_groups(held_out=False)
        self._groups = load_groups(held_out=True) if held_out else self._every
        self._chatter = chatter
        self._told = load_told(held_out)
        self._before, self._after = (load_remarks(one, held_out) for one in (BEFORE, AFTER))
        alone = {do: weight for do, weight in _ALONE.items() if do in self._groups}
        several = {do: weight for do, weight in WEIGHTS.items() if do in self._groups}
        self._kinds = ["steps", "told", *alone]
        self._kind_weights = [
            100 - sum(alone.values()),
            _TOLD if self._told else 0,
            *alone.values(),
        ]
        self._actions, self._action_weights = [*several], [*several.values()]

    def example(self, random: Random) -> Example:
        """Return one command with its answer."""
        sentence: list[SaidWord] = []
        while not 0 < len(sentence) <= MOST_COMMAND_WORDS:
            clauses, sentence = self._drawn(random)
            sentence = _with_fillers(misheard(sentence, random), random)
        return Example(_text(sentence), _answer(clauses, sentence))

    def spoken(self, random: Random) -> str:
        """Return one command as somebody says it, before anything mishears it."""
        return _text(_with_fillers(self._drawn(random)[1], random))

    def _drawn(self, random: Random) -> tuple[list[Clause], list[SaidWord]]:
        kind = random.choices(self._kinds, self._kind_weights)[0]
        if kind == "steps":
            return self._steps(random)
        return self._whole(random) if kind == "told" else self._alone(kind, random)

    def _whole(self, random: Random) -> tuple[list[Clause], list[SaidWord]]:
        clauses, sentence = random.choice(self._told).drawn(random)
        # Whoever calls the robot speaks to nobody else.
        is_ours = clauses[0].step["do"] != "unknown"
        called = _words(CALLS, random) if is_ours and random.random() < 0.1 else []
        return clauses, self._remarked([*called, *sentence], clauses, random)

    def _alone(self, kind: str, random: Random) -> tuple[list[Clause], list[SaidWord]]:
        if kind == "unknown" and self._before and random.random() < _ONLY_REMARKS:
            return [Clause((), {"do": "unknown"}, False)], self._remarks(random)
        if kind == "unknown" and self._chatter and random.random() < 0.6:
            words = random.choice(self._chatter).split()
            clause = Clause(tuple((word, None) for word in words), {"do": "unknown"}, False)
        else:
            clause = self._clause(kind, random)
        sentence = self._polite(clause, 0, random, 0.6 if kind != "unknown" else 0.2)
        if kind == "unknown" and random.random() < 0.15:
            sentence += _plain(self._clause("unknown", random))
        if kind == "unknown" and random.random() < 0.06:
            random.shuffle(sentence)
        return [clause], sentence

    def _steps(self, random: Random) -> tuple[list[Clause], list[SaidWord]]:
        count = random.choices((1, 2, 3, 4), (64, 28, 7, 1))[0]
        clauses: list[Clause] = []
        sentence: list[SaidWord] = []
        for number in range(count):
            clause = self._clause(self._action(random, number), random, _names_thing(clauses))
            if number and not clause.is_imperative and random.random() < 0.8:
                clause = self._imperative(random, _names_thing(clauses))
            sentence += _words(JOINTS, random) if number else []
            sentence += self._polite(clause, number, random, 0.55 if number == 0 else 0.12)
            clauses.append(clause)
        return clauses, self._remarked(self._surrounded(sentence, random), clauses, random)

    def _surrounded(self, sentence: list[SaidWord], random: Random) -> list[SaidWord]:
        """Put a slip or a remark before a command, which change nothing."""
        chance = random.random()
        if chance < 0.03:
            dropped = self._imperative(random)
            return [*_plain(dropped), *_words(CLAUSE_SLIPS, random), *sentence]
        if chance < 0.07:
            return [*_words(OPENINGS, random), *sentence]
        if chance < 0.085:
            dropped = self._imperative(random)
            never = random.choice(
                ("but don't", "and do not", "but do not", "but never", "don't", "without trying to")
            )
            return [*sentence, *_unowned(never), *_plain(dropped)]
        return [*sentence, *_words(REASONS, random)] if chance < 0.11 else sentence

    def _remarked(
        self, sentence: list[SaidWord], clauses: list[Clause], random: Random
    ) -> list[SaidWord]:
        """Put what people say beside a command around it; behind what is to be said nothing."""
        before = self._before if random.random() < _REMARKED else ()
        after = self._after if random.random() < _REMARKED else ()
        after = () if clauses[-1].step["do"] == "say" else after
        return [*_one_of(before, random), *sentence, *_one_of(after, random)]

    def _remarks(self, random: Random) -> list[SaidWord]:
        kinds = random.choice(((self._before,), (self._after,), (self._before, self._after)))
        return [word for kind in kinds for word in _one_of(kind, random)]

    def _action(self, random: Random, number: int) -> str:
        while True:
            action = random.choices(self._actions, self._action_weights)[0]
            if number == 0 or action in _LATER:
                return action

    def _clause(self, do: str, random: Random, after_thing: bool = False) -> Clause:
        groups = self._groups[do]
        sizes = [len(group.imperative) + len(group.free) for group in groups]
        return make_clause(random.choices(groups, sizes)[0], random, self._every, after_thing)

    def _imperative(self, random: Random, after_thing: bool = False) -> Clause:
        while True:
            groups = self._groups[self._action(random, 1)]
            group = random.choice(groups)
            if group.imperative:
                commanding = PhraseGroup(group.fixed, group.imperative, ())
                return make_clause(commanding, random, self._every, after_thing)

    def _polite(self, clause: Clause, number: int, random: Random, share: float) -> list[SaidWord]:
        words = [SaidWord(text, (number, field) if field else None) for text, field in clause.words]
        before: list[SaidWord] = []
        if clause.is_imperative and random.random() < share:
            if random.random() < 0.12:
                before += _words(GERUND_ASKING, random)
                words = [SaidWord(_gerund(words[0].text), words[0].owner), *words[1:]]
            else:
                before += _words(ASKING, random)
        if random.random() < 0.35 * share:
            before = [*_words(CALLS, random), *before]
        after = (
            _words(ENDINGS, random)
            if random.random() < 0.4 * share and not _is_saying(clause)
            else []
        )
        return [*before, *words, *after]


def _text(sentence: list[SaidWord]) -> str:
    return " ".join(word.text for word in sentence)


def _answer(clauses: list[Clause], sentence: list[SaidWord]) -> str:
    """Return the answer; copied words are taken from the sentence as it arrived."""
    steps = []
    for number, clause in enumerate(clauses):
        copied: dict[str, list[str]] = {}
        for word in sentence:
            if word.owner is not None and word.owner[0] == number:
                copied.setdefault(word.owner[1], []).append(word.text)
        steps.append({**clause.step, **{field: " ".join(words) for field, words in copied.items()}})
    return answer_text(steps)


def _with_fillers(sentence: list[SaidWord], random: Random) -> list[SaidWord]:
    if random.random() > 0.07:
        return sentence
    filled = list(sentence)
    for _ in range(random.choice((1, 1, 2))):
        filled.insert(random.randrange(len(filled) + 1), SaidWord(random.choice(FILLERS), None))
    return filled


def _gerund(verb: str) -> str:
    if verb in DOUBLING:
        return f"{verb}{verb[-1]}ing"
    return f"{verb[:-1] if verb.endswith('e') and not verb.endswith('ee') else verb}ing"


def _names_thing(clauses: list[Clause]) -> bool:
    return any(field == "what" for clause in clauses for _, field in clause.words)


def _is_saying(clause: Clause) -> bool:
    """Return whether what follows would belong to what is to be said."""
    return any(field in ("text", "name") for _, field in clause.words)


def _words(sequence: Sequence, random: Random) -> list[SaidWord]:
    return [SaidWord(str(word), None) for word in expand(sequence, random)]


def _one_of(remarks: tuple[tuple[str, ...], ...], random: Random) -> list[SaidWord]:
    return [SaidWord(word, None) for word in random.choice(remarks)] if remarks else []


def _plain(clause: Clause) -> list[SaidWord]:
    return [SaidWord(text, None) for text, _ in clause.words]


def _unowned(text: str) -> list[SaidWord]:
    return [SaidWord(word, None) for word in text.split()]
