"""Plan anew after a failure: what is left of the plan, mended by one strategy after another."""
