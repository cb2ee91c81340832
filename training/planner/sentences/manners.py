"""Name what people wrap commands in, joins them, or takes them back; none of it changes them."""

from typing import Final

from training.planner.sentences.grammar import parse
from training.planner.sentences.lists import read_file

_MANNERS: Final = read_file("manners")
CALLS: Final = parse(_MANNERS["calls"])
ENDINGS: Final = parse(_MANNERS["endings"])
ASKING: Final = parse(_MANNERS["asking"])
GERUND_ASKING: Final = parse(_MANNERS["gerund_asking"])
OPENINGS: Final = parse(_MANNERS["openings"])
REASONS: Final = parse(_MANNERS["reasons"])
JOINTS: Final = parse(_MANNERS["joints"])
SLIPS: Final = parse(_MANNERS["slips"])
CLAUSE_SLIPS: Final = parse(_MANNERS["clause_slips"])
FILLERS: Final[tuple[str, ...]] = tuple(_MANNERS["fillers"])
