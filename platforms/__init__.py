"""Describe the computers that the stack runs on."""

from platforms.errors import ProfileError
from platforms.ladder import LadderAction, LadderStep, LadderTiming, ProcessBudget, TotalBudget
from platforms.profile import ModelChoice, ProcessSettings, Profile, SpeechSettings, load_profile

__all__ = [
    "LadderAction",
    "LadderStep",
    "LadderTiming",
    "ModelChoice",
    "ProcessBudget",
    "ProcessSettings",
    "Profile",
    "ProfileError",
    "SpeechSettings",
    "TotalBudget",
    "load_profile",
]
