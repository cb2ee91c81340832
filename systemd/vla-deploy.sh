#!/bin/sh
# Runs the release in use.
exec @PREFIX@/current/bin/vla-deploy "$@"
