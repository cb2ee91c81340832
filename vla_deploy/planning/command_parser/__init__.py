"""Plan commands by the embedded model: it says what was said, code decides what that means."""
