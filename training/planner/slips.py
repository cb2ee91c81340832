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
    "meant|i mean|no i meant|better|(no never mind|hmm no|sorry don't|oh no|what i meant to "
    "say was|no not that|or better still|ah no)|(oops|actually never mind|change of plan|well "
    "no|sorry i mean|oh forget it|actually i changed my mind|actually don't)|(well "
    "actually|actually i want you to|uh no|or actually|wait don't do that|forget about "
    "that|come to think of it|sorry that's wrong)|(better yet|skip that|i've changed my "
    "mind|oh hang on no|no i changed my mind|you know what actually|i've got a better "
    "idea|let's rather)|(i take that back|oh no wait|no instead|i should have said|no i take "
    "that back|actually wait|nah|forget what i just said)|(oops no|oh i changed my mind|belay "
    "that|sorry i changed my mind|my bad|never mind actually|wait no actually|sorry no "
    "wait)|(leave that|actually sorry|actually never mind that|well actually no|or no "
    "wait|wait sorry|oops wrong|no ignore that)|(ah forget it|i'd rather have you|i "
    "misspoke|that's not right|ignore what i said|or actually no|hm no|oh no sorry)|(actually "
    "forget that|let's not do that|wait wait no|no leave it|changed my mind|that's wrong|no "
    "leave that|wait not that)|(no forget it|silly me|let's start again|ignore that last "
    "bit|i said that wrong|that's not what i meant|let me rephrase that|what i wanted to say "
    "was)|(let me rephrase|correction|instead of that|or better yet|disregard|or rather|wait "
    "don't|on second thoughts)|(hold on no|i should say|no rather|no that's not right|better "
    "idea|let's not|you know what no|i meant to say)|(you know what|what am i saying|strike "
    "that|i changed my mind|oh never mind|ah sorry|no don't do that|forget about it)|(i would "
    "rather you|forget it|change of plans|sorry not that|i take it back|on second thoughts "
    "no|nah don't|pardon me i meant)|(scratch that no|sorry i misspoke|on second thought "
    "no|um no|that's not what i wanted|no actually|drop that idea|nope)|(you know what never "
    "mind|better still|actually i meant|no hang on|you know what forget it|actually you know "
    "what|come to think of it no|no wait don't do that)|(no strike that|or wait|no instead of "
    "that|no scrap that|i'm sorry i meant|actually i'd rather you|wrong|oh sorry)|(my "
    "mistake|i wanted to say|oops i mean|on second thought don't|no wrong|oops sorry|don't do "
    "that|hmm i changed my mind)|(ignore that|let me start again|nah forget it|oh actually|no "
    "wait wait|no that's not what i meant|er wait no|i'm sorry no)|(no let's not|no cancel "
    "that|i meant|no skip that|no my mistake|no that's wrong|what am i saying no|disregard "
    "that)|(no correction|cancel that order|no no no|no no|ah never mind|never mind|actually "
    "don't do that|let me start over)|(excuse me i meant|no never mind that|not that|even "
    "better|erm no|scrap that|that's not what i want|hmm no wait)|(undo that|hang on no|or "
    "maybe better|sorry no|forget what i said|what i meant was|er no|i've a better "
    "idea)|(actually instead|ah wait no|no forget that|ignore me|no wait don't|new plan|no "
    "i've changed my mind|actually scratch that)|(wait actually|i'd rather you|thinking about "
    "it|silly me i meant|or no|oh wait no|i have a better idea|sorry i've changed my "
    "mind)|(pardon i mean)) [just|please|now|simply|]"
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
