"""Keep accounts, tokens and audit log: the dashboard uses them, the command line edits them."""
