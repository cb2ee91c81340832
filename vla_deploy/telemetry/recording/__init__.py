"""Record any topics for as long as wanted: rolling MCAP files in a bounded folder."""
