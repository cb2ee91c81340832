"""List what people wrap commands in: calls, politeness, reasons, joints, corrections, fillers."""

from typing import Final

from training.planner.grammar import Sequence, parse

CALLS: Final = parse(
    "(robot|hey robot|ok robot|okay robot|hi robot|hello robot|butler|hey butler|listen|hey"
    "|alright|okay"
    "|okay so|right|so|well|now|now then|dear robot|yo|attention|jarvis|excuse me|hello|buddy"
    "|hey there"
    "|my friend|okay listen|good morning|good morning robot|okay next|next|and|also|yes|oh|ah"
    "|mister robot)"
)
ASKING: Final = parse(
    "(please|kindly|just|go ahead and|now|next|first|quickly|carefully|slowly|gently|simply"
    "|maybe|then"
    "|(could|can|would|will) you [please|maybe|kindly|just|quickly|possibly|perhaps|now|go and"
    "|try to]"
    "|(please|kindly) (could|can|would|will) you"
    "|(i want|i need|i'd like|i would like|i'd love|i would love|i expect|i'm asking|i ask|i order"
    "|i command|i urge|i beg|i require|i wanted|we need|we want|we'd like) you [now|please|next] to"
    "|you (should|must|need to|have to|can|could|may|might want to|ought to|had better|are to"
    "|shall|will) [now]"
    "|(it would be|it'd be|that would be) (great|nice|good|lovely|helpful|awesome|cool|perfect"
    "|kind) if you (could|would|can)"
    "|(would you be|are you) (able to|so kind as to|willing to|ready to|kind enough to|free to)"
    "|(i was wondering|i wonder|do you think|is there any chance|any chance"
    "|would you say) [if] you (could|can|would)"
    "|(is it possible|would it be possible|could it be possible) (for you to|to have you|to)"
    "|(let's|let us|let me see you|time to|it is time to|it's time to|your task is to"
    "|your job is to"
    "|your next task is to|the next thing is to|what i want is for you to"
    "|all you have to do is|try to"
    "|attempt to|be sure to|make sure to|make sure you|see to it that you|remember to"
    "|don't forget to"
    "|get going and|hurry up and|hurry and|come on and|come on|be a dear and|be a good robot and"
    "|be so kind and|be so good as to|do me a favor and|do me a favour and|help me out and"
    "|help me and"
    "|why don't you|how about you|suppose you|could i (ask|get|have|bother|trouble) you to"
    "|(can|may) i (ask|get|have|bother|trouble) you to|i'd be (glad|grateful|happy) if you could"
    "|if you (can|could|would|don't mind|have time|are free|are not busy) [please]"
    "|when you (can|have time|are ready|have a minute|get a chance) [please]|whenever you are ready"
    "|i think you should|i believe you should|i suggest you|i'd suggest you|feel free to"
    "|you are supposed to"
    "|please help me to|what if you|will you please|the plan is to|the mission is to"
    "|your order is to"
    "|as a next step|as the next task|for me please|for my sake|at once|immediately))"
)
GERUND_ASKING: Final = parse(
    "(would you mind|do you mind|how about|what about|i'd appreciate you|i would appreciate you|try"
    "|start|start by|begin by|could you start|could you try|please start|consider|mind|thanks for"
    "|thank you for|i'd be grateful for you|any chance of you|would you consider"
    "|is there a chance of you)"
)
ENDINGS: Final = parse(
    "(please|thanks|thank you|for me|now|right now|right away|if you can|if you could|if you would"
    "|if you don't mind|if possible|if that is possible|would you|will you|could you|can you"
    "|okay|quickly"
    "|carefully|gently|slowly|immediately|asap|as soon as possible|at once|when you can"
    "|when you are ready"
    "|when you have time|robot|butler|buddy|my friend|real quick|again|one more time|once more"
    "|already"
    "|then|today|that would be great|that'd be great|that would be nice|that's all|for us"
    "|for a change"
    "|will you please|please and thank you|thank you very much|thanks a lot|and be careful"
    "|and hurry"
    "|and be quick|don't rush|no rush|take your time|quick|alright|if you are free"
    "|you got that|got it"
    "|if it isn't too much trouble|without bumping into anything|on your own|next|first"
    "|as well|too|instead)"
)
REASONS: Final = parse(
    "(because|since|as|so that|so) (i am thirsty|i need it|i'm in a hurry|it is late"
    "|we are leaving soon"
    "|the guests are coming|i want to drink|i can't do it myself|it is in the way"
    "|dinner is almost ready"
    "|my hands are full|i want to clean up|it gets dark|i can read|nobody trips"
    "|the dog can't get it"
    "|i forgot it there|i am busy|my back hurts|we can start|i have to go|it does not get lost)"
)
OPENINGS: Final = parse(
    "(i'm thirsty|i am thirsty|i'm tired|the guests are here|it's getting late|i'm in a hurry"
    "|dinner is ready"
    "|my hands are full|this room is a mess|i need your help|i have a job for you"
    "|here is a task|new task"
    "|here is what i want|one more thing|change of plans|good job|well done|very good|nice"
    "|that was good"
    "|we have guests|i can't get up|my leg hurts|i've got an idea|you know what|guess what"
    "|sorry to bother you"
    "|i am going to read|someone is coming|i have a task for you|wake up|are you there"
    "|can you hear me"
    "|thanks for that|okay good|i am cooking|i forgot something|it is too dark for me"
    "|tell you what) [so|and|now|please|]"
)
JOINTS: Final = parse(
    "(and|and|and|and then|and then|then|then|after that|and after that|afterwards|next"
    "|and next|and finally"
    "|finally|once that is done|when that is done|when you are done|once you are there"
    "|when you get there"
    "|and also|also|followed by that|and afterwards|and when you are done|and once done|plus"
    "|as well as|"
    "|before you|and when you arrive|from there|secondly|last|lastly|subsequently|later"
    "|thereafter|)"
)
SLIPS: Final = parse(
    "(no|no wait|wait no|i mean|i meant|sorry|sorry i mean|actually|actually no|or rather"
    "|rather|uh no|oh no"
    "|make that|no make that|no sorry|correction|er no|no i mean|scratch that|um no|wait"
    "|no not that)"
)
CLAUSE_SLIPS: Final = parse(
    "(no wait|no|actually|actually no|never mind that|forget that|scratch that|no sorry"
    "|wait no|on second thought"
    "|no don't|oh wait|instead|or better|no better|cancel that|sorry i meant|i mean|no i meant"
    "|better) [just|please|]"
)
FILLERS: Final = (
    "uh",
    "um",
    "er",
    "erm",
    "hmm",
    "well",
    "like",
    "you know",
    "ah",
    "eh",
    "so",
    "uhm",
    "mm",
    "okay",
)
ALL_MANNERS: Final[tuple[Sequence, ...]] = (
    CALLS, ASKING, GERUND_ASKING, ENDINGS, REASONS, OPENINGS, JOINTS, SLIPS, CLAUSE_SLIPS,
)  # fmt: skip
