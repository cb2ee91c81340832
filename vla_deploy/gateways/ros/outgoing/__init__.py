"""What the executor asks of servers beyond the robot: action clients, and what they are lent."""
