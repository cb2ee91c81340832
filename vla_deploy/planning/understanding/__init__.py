"""Understand what a command refers to: by the conversation, the scene and the robot's places."""

from vla_deploy.planning.understanding.answers import AnswerVerdict, judge_answer
from vla_deploy.planning.understanding.conversation import (
    Candidate,
    Conversation,
    ConversationTurn,
    Mention,
    MentionRole,
    Question,
    TurnOutcome,
)

__all__ = [
    "AnswerVerdict",
    "Candidate",
    "Conversation",
    "ConversationTurn",
    "Mention",
    "MentionRole",
    "Question",
    "TurnOutcome",
    "judge_answer",
]
