"""List the words of a command that need no place in an answer: small words, courtesies, verbs.

Every other word that no step has copied was left out, and the person is asked.
"""

from typing import Final

_SMALL: Final = (
    "the a an my your our his her their its this that these those some any it them him there here "
    "of to in on at by with from for into onto over up down out off back along near next beside "
    "behind front inside top around about through across between and then also too as so well "
    "just now right please thanks thank kindly i me we us you he she they i'm i'd i'll i've we're "
    "you're it's that's there's can could would will shall am is are be have has had do does did "
    "need want like what where's who which how where let's one ones thing things bit little"
)
_COURTESY: Final = (
    "robot butler hey hi hello ok okay oh um uh er erm hmm alright good great nice kind dear love "
    "mate friend sir favour favor moment minute second sec quick quickly slowly carefully gently "
    "yes yeah sure lovely mind possible possibly maybe perhaps chance cheers ta straight again "
    "today first finally able grateful glad appreciate so's though really"
)
_VERBS: Final = (
    "go come drive move head roll navigate return travel walk run visit approach make way "
    "pick grab take get lift grasp hold collect fetch catch reach keep bring carry deliver hand "
    "give pass put place set lay drop leave stick pop store stow stand throw toss tidy clear clean "
    "find look search locate seek hunt spot check see seen know tell show say announce repeat "
    "turn spin rotate face glance watch open close shut release let tuck fold rest wait stay pause "
    "stop help use try start"
)
FILLERS: Final = frozenset(f"{_SMALL} {_COURTESY} {_VERBS}".split())
"""They say nothing that a step could leave out; what changes a command's scope is none of them."""
