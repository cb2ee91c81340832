"""Say what the scene holds, how things lie, and whether a goal can be reached: advice, no more.

Nothing here moves the robot, or publishes to a process that does. An analysis has no actions in it;
what acts on one goes through the planner's validator like any other command.
"""
