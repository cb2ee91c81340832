"""List what joins commands, what takes them back, and what is said while thinking."""

from typing import Final

from training.planner.grammar import parse

JOINTS: Final = parse(
    "(and|and|and|and then|and then|then|then|after that|and after that|afterwards|next|and "
    "next|and finally|finally|once that is done|when that is done|when you are done|once you "
    "are there|when you get there|and also|also|followed by that|and afterwards|and when you "
    "are done|and once done|plus|as well as||before you|and when you arrive|from "
    "there|secondly|last|lastly|subsequently|later|thereafter||(and don't forget to|straight "
    "after that|when you have done that|then lastly|once that's been done|a little later|and "
    "in the end|and at once|once this is done)|(as the next thing|when that's finished|after "
    "this|as well as that|as soon as you've done that|and could you|and would you|also could "
    "you|once there)|(and you can|and later|then go ahead and|after doing so|along with "
    "that|when this is done|also can you|when you arrive there|another thing)|(when you've "
    "finished|once you have done that|then i need you to|next thing|while you're at "
    "it|following that|and quickly|and furthermore|immediately afterwards)|(later on|then "
    "please|directly after that|and then please|and yes|and could you also|and then can "
    "you|and perhaps|when you've done that)|(and along with that|and i need you to|lastly "
    "please|once you're done|the last step|then i'd like you to|once that's done|and after "
    "you've done that|as soon as you are done)|(after that please|and after you're done|when "
    "you arrive|while you are there|after you have done that|and you should|the next thing "
    "is|finally please|and then you can)|(together with that|and when you get there|then "
    "next|and to finish|and besides|oh and also|then proceed to|upon arrival|when you're at "
    "it)|(and just|right after that|after you are done|and remember to|oh and "
    "please|moreover|as soon as that is done|and make sure to|and please also)|(and while "
    "you're there|and a bit later|and then would you|done that|and maybe|then move on "
    "and|straight afterwards|following which|when it is done)|(then continue and|and once "
    "that's done|in turn|and i want you to|then you should|when you're finished|and when "
    "you're there|one more thing|and as a next step)|(and lastly|for the second step|after "
    "you're done|when you are there|as the last step|and kindly|and on top of that|after you "
    "did that|besides)|(and now|in the next step|after you finish|in the end|right "
    "afterwards|on arriving there|once you're there|and then i need you to|and when "
    "finished)|(whereupon|and right after|and please|and continue to|and at the end|and then "
    "i want you to|on top of that|also please|and once you're there)|(and later on|after you "
    "finish that|as a second step|and at last|as soon as you're there|and from there|once "
    "finished|and subsequently|and when that is done)|(and can you also|furthermore|and can "
    "you|and there|to finish|when you're there|once you are done|oh and|oh and then)|(now|at "
    "the end|and then|step two|from there go on and|for the next step|and i'd like you to|and "
    "afterwards|the second thing is)|(and directly|and one more thing|and straight away|after "
    "it|and once you've done that|plus could you|besides that|when finished|so next)|(and "
    "finally please|with that done|at which point|having done that|while you're there|on "
    "arrival|then you may|and try to|then you can)|(and then you should|this done|and "
    "following that|after doing that|and when you are there|once it's done|then after "
    "that|for step two|from there on)|(and next|that done|next step|so then|only "
    "then|immediately after that|when you finish|in addition|while you are at it)|(then could "
    "you|when you're done|having done so|as soon as you get there|then afterwards|and once "
    "there|shortly after that|when you have finished|then)|(and|once you have finished|once "
    "you've finished|the last thing is|and just then|and also please|once that's "
    "finished|after you've done that|and proceed to)|(then also|don't forget to|the next "
    "step|then finally|when done|as soon as you're done|second thing|when that's done|and "
    "oh)|(and after that|plus also|then i want you to|once done|then can you|step three|and "
    "be sure to|plus please|to end with)|(thirdly|once you've done that|once you get "
    "there|after which|and possibly|when you reach it|then go on and|to finish off|and only "
    "then)|(and last|and then could you|and additionally|and immediately|a bit later|and "
    "while you're at it|and go on to|at that point|and so)|(and when you're "
    "done|additionally))"
)
SLIPS: Final = parse(
    "(no|no wait|wait no|i mean|i meant|sorry|sorry i mean|actually|actually no|or "
    "rather|rather|uh no|oh no|make that|no make that|no sorry|correction|er no|no i "
    "mean|scratch that|um no|wait|no not that|(oh silly me|i should have said|oh wait no|i'm "
    "sorry|oh sorry)|(excuse me i mean|that is|let me rephrase|not that|hold on no)|(that's "
    "to say|well no|my bad i mean|oops|no i meant)|(sorry make that|what do you call it|hang "
    "on no|erm i mean|whoops)|(wait no i mean|goodness no|ah i mean|actually sorry|or better "
    "yet)|(what am i saying|sorry wrong|uh i mean|on second thought|or no)|(pardon me i "
    "mean|hang on i mean|my bad|nah i mean|pardon me)|(hmm no|oops no|what did i say|wrong i "
    "mean|no rather)|(dear me no|wait not that|sorry i meant|well actually|excuse me i "
    "meant)|(no silly me|actually i meant|correction no|no my mistake|no love)|(or better "
    "still|erm no|ignore that|nah|or no wait)|(uh sorry|no scratch that|er i mean|actually "
    "make that|what i mean is)|(no hang on|wait no sorry|better say|no i take that back|i'm "
    "sorry i mean)|(better|or make that|nope i mean|sorry not that|ah no i mean)|(oh i "
    "meant|pardon|ah sorry|strike that i mean|or actually)|(ah no|wait i mean|oops sorry|no "
    "not that one|or should i say)|(um i mean|er sorry|no wait i mean|oh i mean|how do you "
    "say)|(no dear|forget that|what's it called|excuse me|or better)|(actually wait|no that's "
    "wrong|silly me|oh sorry i mean|no i said that wrong)|(not that one but|let me correct "
    "myself|that's wrong|i want to say|no no)|(what i meant was|no actually|hm no|that is to "
    "say|pardon i mean)|(no actually i mean|wait sorry|what i meant is|i was going to say|not "
    "that one)|(er wait|i wanted to say|i take that back|no correction|whoops i mean)|(um "
    "sorry|that's wrong i mean|or let's say|no no no|on second thoughts)|(my mistake|silly me "
    "i mean|sorry no|er rather|oops i mean)|(strike that|nope|i should say|wrong|oh "
    "wait)|(wait make that|well i mean|actually i mean|hold on i mean|or i mean)|(well "
    "rather))"
)
CLAUSE_SLIPS: Final = parse(
    "(no wait|no|actually|actually no|never mind that|forget that|scratch that|no sorry|wait "
    "no|on second thought|no don't|oh wait|instead|or better|no better|cancel that|sorry i "
    "meant|i mean|no i meant|better|(or actually no|no that's wrong|never mind|no leave "
    "that|i'd rather you|i would rather you|on second thoughts no|forget what i "
    "said)|(actually i want you to|sorry not that|sorry no|no rather|or no|ah wait no|or "
    "rather|no wait don't do that)|(nah|even better|what am i saying no|sorry i "
    "misspoke|nope|oops sorry|i meant|actually never mind)|(you know what|actually i changed "
    "my mind|don't do that|oops wrong|you know what forget it|drop that idea|i've changed my "
    "mind|sorry i changed my mind)|(i take that back|actually don't do that|ah forget it|hmm "
    "no|wait wait no|or better yet|silly me i meant|ignore what i said)|(wait no actually|oh "
    "no wait|forget it|actually scratch that|no i take that back|actually wait|oh i changed "
    "my mind|wait sorry)|(i said that wrong|disregard|oh never mind|instead of that|that's "
    "not what i wanted|oh sorry|oh no|or maybe better)|(actually sorry|sorry no wait|never "
    "mind actually|ignore me|hmm no wait|or actually|i'd rather have you|no forget it)|(you "
    "know what no|no that's not right|leave that|wait not that|change of plan|let's "
    "rather|you know what never mind|no ignore that)|(oops no|that's not what i want|let me "
    "start over|let's start again|let me rephrase that|well actually|i should say|no strike "
    "that)|(or better still|wait don't do that|excuse me i meant|hold on no|what i wanted to "
    "say was|skip that|no wrong|i have a better idea)|(ah sorry|actually i meant|what i meant "
    "to say was|actually forget that|what am i saying|scrap that|changed my mind|ah never "
    "mind)|(er wait no|no not that|forget what i just said|no instead of that|you know what "
    "actually|better still|i should have said|i changed my mind)|(on second thoughts|i'm "
    "sorry no|no skip that|sorry that's wrong|pardon i mean|hm no|that's not right|actually "
    "instead)|(cancel that order|well actually no|no scrap that|better yet|no hang "
    "on|thinking about it|change of plans|forget about that)|(no instead|no i changed my "
    "mind|no actually|forget about it|let me rephrase|oh wait no|no i've changed my mind|no "
    "my mistake)|(oh actually|my bad|new plan|oh no sorry|on second thought no|my "
    "mistake|oops i mean|not that)|(that's not what i meant|ignore that last bit|i'm sorry i "
    "meant|well no|ah no|no wait wait|wrong|um no)|(i misspoke|i've a better idea|belay "
    "that|i wanted to say|no cancel that|oops|no that's not what i meant|pardon me i "
    "meant)|(strike that|or no wait|undo that|no no no|no no|no never mind that|no never "
    "mind|actually never mind that)|(let me start again|come to think of it|ignore that|no "
    "leave it|better idea|uh no|scratch that no|that's wrong)|(nah forget it|i take it "
    "back|hang on no|no correction|sorry i mean|no forget that|i meant to say|erm no)|(i've "
    "got a better idea|actually you know what|er no|oh forget it|disregard that|no don't do "
    "that|correction|sorry i've changed my mind)|(actually i'd rather you|wait actually|what "
    "i meant was|let's not do that|or wait|oh hang on no|silly me|hmm i changed my "
    "mind)|(come to think of it no)) [just|please|now|simply|]"
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
    "hm",
    "mhm",
    "umm",
    "uhh",
    "err",
    "oh",
    "ehm",
    "uh huh",
    "let me see",
    "let's see",
    "how do you say",
    "what's it called",
    "kind of",
    "sort of",
    "basically",
    "yeah",
    "you see",
    "see",
    "let me think",
    "please",
)
