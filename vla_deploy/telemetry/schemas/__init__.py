"""The robot's topics as messages that viewers know, in Foxglove's schemas."""
