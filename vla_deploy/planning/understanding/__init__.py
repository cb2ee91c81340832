"""Understand what a command refers to: by the conversation, the scene and the robot's places."""

from vla_deploy.planning.understanding.answers import Verdict, judge_answer
from vla_deploy.planning.understanding.conversation import (
    Candidate,
    Conversation,
    Mention,
    Outcome,
    Question,
    Role,
    Turn,
)

__all__ = [
    "Candidate",
    "Conversation",
    "Mention",
    "Outcome",
    "Question",
    "Role",
    "Turn",
    "Verdict",
    "judge_answer",
]
