"""Make the embedded detector: draw labelled images of the twin, train, export, quantise, judge."""
