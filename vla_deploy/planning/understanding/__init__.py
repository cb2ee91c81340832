"""Understand what a command refers to: by the conversation, the scene and the robot's places."""

from vla_deploy.planning.understanding.answers import Reply, Verdict, described, guess, reply
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
    "Reply",
    "Role",
    "Turn",
    "Verdict",
    "described",
    "guess",
    "reply",
]
