"""Describe the computers that the stack runs on."""

from platforms.errors import ProfileError
from platforms.profile import ProcessBudget, Profile, load_profile

__all__ = ["ProcessBudget", "Profile", "ProfileError", "load_profile"]
