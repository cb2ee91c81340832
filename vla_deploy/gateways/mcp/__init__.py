"""Serve AI agents by the Model Context Protocol: they may read and stop, and act while leased."""
