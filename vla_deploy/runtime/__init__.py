"""What every process of a run is made of."""
