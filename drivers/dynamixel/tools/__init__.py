"""Work on single servos at the bench, without a robot file."""
