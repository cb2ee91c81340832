"""Reach a running robot: how the command line, the page and the gateways read it and command it."""
