"""List the small words that single a thing out: articles, relations, sides, rows, amounts."""

from typing import Final

ARTICLES: Final = ("the",) * 9 + (
    "a",
    "my",
    "my",
    "your",
    "that",
    "this",
    "some",
    "our",
    "his",
    "her",
    "",
)
# Where a thing stands; "the" is left out of what is copied.
NEAR: Final = ("on", "on", "on", "in", "in", "next to", "near", "beside", "by", "under", "behind",
               "in front of", "left of", "right of", "on top of", "inside", "close to", "below",
               "to the left of", "to the right of", "from", "at", "underneath", "against",
               "on", "in", "next to", "by", "beneath", "alongside", "opposite", "inside of",
               "just on", "up on", "down on", "over on", "over by", "right next to",
               "right beside", "down by", "over in", "right behind", "just under", "up against",
               "just behind", "right by", "directly under", "just beside", "back on",
               "just inside")  # fmt: skip
# What says only how exactly: "right next to", "over by".
LEADING: Final = frozenset({"just", "up", "down", "over", "right", "directly", "back"})
CLAUSES: Final = ("that is", "which is", "that's", "lying", "sitting", "standing", "over there",
                  "that stands", "that lies", "that you see", "located", "placed",
                  "which you see", "that's standing", "that's lying", "that's sitting",
                  "that is standing", "that is lying", "which is lying", "which stands",
                  "which lies", "that sits", "resting", "that's resting", "that are", "which are",
                  "that was", "there", "that is there", "that's over there",
                  "that i left", "that i put", "i left", "i put", "that you can see",
                  "you can see", "lying there", "lying around", "standing there", "that's right",
                  "that somebody left", "someone left", "we keep", "that we have", "that lives",
                  "stood", "sat", "that's sat", "that's stood",
                  "waiting")  # fmt: skip
SIDES: Final = ("on the left", "on the right", "in the middle", "to the left", "to the right",
                "on your left", "on your right", "in the back", "in the front", "at the front",
                "on the far left", "on the far right", "on my left", "on my right",
                "on the left hand side", "on the right hand side", "on the left side",
                "on the right side", "on your left side", "on your right side", "in the centre",
                "in the center", "at the left", "at the right", "to your left", "to your right",
                "over on the left", "over on the right", "to my left", "to my right",
                "furthest to the left", "furthest to the right", "at the back",
                "on the very left", "on the very right", "that's on the left",
                "that's on the right", "that is on your left", "that is on your right",
                "that's in the middle", "standing on the left", "standing on the right",
                "lying in the middle")  # fmt: skip
TAILS: Final = ("over there", "there", "here", "in front of you", "that i like", "you see",
                "i mentioned", "from before", "right there", "that fell down", "that i dropped",
                "we talked about", "over here", "right here", "in front of me", "you can see",
                "that you see there", "i showed you", "that i showed you", "that tom gave me",
                "that grandma gave me", "i always use", "i was reading", "i was drinking from",
                "i just used", "i bought yesterday", "you had before", "you just put down",
                "you brought me", "that i was looking for", "i'm looking at", "i'm pointing at",
                "that i need", "i asked for", "i like so much", "as usual", "that i told you about",
                "that belongs to me", "that is mine", "that's mine", "i left there",
                "that's lying there", "that's lying around", "that's standing there",
                "standing around there", "lying about", "that you found",
                "that you brought earlier", "that somebody forgot", "the kids left",
                "that nobody uses")  # fmt: skip
PRONOUNS: Final = ("it",) * 14 + ("that", "this", "them", "that one", "this one", "those", "these",
                   "that thing", "the thing", "the object", "everything", "something", "them",
                   "this thing", "the same one", "the other one", "the other", "another one",
                   "all of them", "both of them", "both", "one of them", "that other one",
                   "everything else", "all of it", "these things", "those things", "this one here",
                   "that one there", "this here", "that there", "the others", "the other ones",
                   "these ones", "those ones", "the same thing", "the next one", "the last one",
                   "the first one", "the second one", "any of them", "either of them",
                   "one of those", "that stuff", "the lot", "the two of them", "all these things",
                   "the thing you are holding", "what you are holding", "whatever you are holding",
                   "what you have in your hand", "the thing in your hand",
                   "what you're holding")  # fmt: skip
# Before several of which one is meant.
OF_WHICH: Final = ("the two", "the three", "those two", "these two", "two", "three", "both", "the",
                   "those", "these", "both the", "my two", "our", "my", "a couple of",
                   "the pair of", "a few", "four", "all those", "two different")  # fmt: skip
# Before several, and before one.
QUANTITIES: Final = ("all the", "both", "all", "all of the", "both of the", "two", "three",
                     "the two", "one of the", "most of the", "both the", "both my", "all my",
                     "all these", "all those", "all of my", "both of these", "both of those",
                     "a couple of", "a pair of", "a few", "some of the", "these two", "those two",
                     "the three", "these three", "those three", "the other two", "my two", "four",
                     "all three", "all four", "any two", "two of the", "three of the", "any of the",
                     "either of the", "the other", "these", "those", "one of my", "one of these",
                     "one of those", "the rest of the", "several", "another two",
                     "all the other")  # fmt: skip
SINGLES: Final = ("every", "each", "any", "another", "either", "every single", "any old",
                  "one", "any other", "every other")  # fmt: skip
COMPARED: Final = ("bigger", "smaller", "larger", "taller", "shorter", "longer", "thinner",
                   "thicker", "wider", "narrower", "flatter", "lower", "higher", "closer",
                   "nearer", "biggest", "smallest", "largest", "tallest", "shortest", "longest",
                   "thinnest", "thickest", "widest", "nearest", "closest", "furthest",
                   "farthest")  # fmt: skip
OF_SEVERAL: Final = ("of the two", "of the", "of the three", "of these", "of those", "of all the",
                     "of these two", "of those two", "of my", "out of the two",
                     "of the four")  # fmt: skip
ROWS: Final = ("from the left", "from the right", "from the left", "from the right", "on the left",
               "on the right", "counting from the left", "counting from the right",
               "from the left hand side", "from the right hand side", "in the row",
               "counted from the left", "counted from the right", "from the left side",
               "from the right side", "from your left", "from your right", "from my left",
               "from my right", "in line", "in that row")  # fmt: skip
ORDINALS: Final = ("first", "second", "second", "third", "third", "fourth", "last", "fifth")
NUMBERED: Final = ("number one", "number two", "number three", "number four")
DISTANCES: Final = ("closest to you", "closest to me", "nearest to me", "nearest to you",
                    "furthest from you", "farthest from me", "closest to us", "furthest away",
                    "farthest away", "closest to yourself", "nearest to us", "nearest you",
                    "nearest me", "furthest off", "closest by", "nearest to where you are",
                    "furthest from here")  # fmt: skip
CLOSEST: Final = ("closest to", "nearest to", "nearest", "furthest from", "farthest from",
                  "closer to", "nearer to")  # fmt: skip
BUT: Final = ("but", "but not", "except", "except for", "apart from", "other than")
BUT_COLOUR: Final = ("that isn't", "that is not", "which isn't", "which is not", "that's not")
PARTS: Final = ("cover", "lid", "handle", "label", "cap", "top", "jacket", "stripes", "dots", "rim",
                "back", "edge", "pattern")  # fmt: skip
# Left out of what is copied: code puts those back that tell how many.
DROPPED: Final = frozenset({"the", "a", "an", "my", "your", "our", "his", "her", "some", "their",
                            "its", "that", "this", "these", "those", "which", "is", "that's", "of",
                            "over", "standing", "lying"})  # fmt: skip
