"""Find out what a command means: who and what it speaks of, and what was said before."""
