"""Know plans as symbols: what each skill needs and leaves, and what holds at each step."""
