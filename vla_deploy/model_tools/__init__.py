"""Prepare models for `vla-deploy models`: fetch, add, verify, measure; no robot imports it."""
