"""Hold the dialogue with people: questions, confirmation, corrections, and what is under way."""
