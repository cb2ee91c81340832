"""Show recordings and runs in Rerun: what viewers are shown anyway, as its entities."""
