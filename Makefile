# Two commands for a newcomer: `make demo` and `make test`. Each sets up what it needs first.
PYTHON ?= python3
VENV := .venv
STAMP := $(VENV)/.installed
ROS_VENV := .venv-ros

.PHONY: help demo test ros campaign mutation lock clean
help:
	@echo "make demo      install what is needed, then pick up the red cup on the twin"
	@echo "make test      install what is needed, then format, lint, types, import rules and all tests"
	@echo "make ros       make the environment of the ROS gateway in $(ROS_VENV), where wheels of ROS 2 exist"
	@echo "make campaign  the long tests: twenty scenes of pick and place, every fault, a million streams into every parser"
	@echo "make mutation  change vla_deploy/safety in every small way: each change must fail a test; minutes, nightly"
	@echo "make lock      pin every dependency afresh"

$(STAMP): pyproject.toml requirements-dev.lock scripts/install
	scripts/install $(VENV) $(PYTHON)
	touch $@

# Python's packages and the system's come at the same time.
.PHONY: set-up system-packages
set-up:
	@$(MAKE) --no-print-directory -j2 $(STAMP) system-packages

system-packages:
	@scripts/system-packages

demo: set-up
	$(VENV)/bin/vla-deploy demo

# Left out where no wheels of ROS exist; the tests that need it say so.
ros:
	@scripts/ros-environment $(ROS_VENV) $(PYTHON)

test:
	@$(MAKE) --no-print-directory -j3 $(STAMP) system-packages ros
	scripts/check

campaign: set-up
	$(VENV)/bin/python -m pytest -m "slow and not nightly" --timeout 3600

mutation: $(STAMP)
	$(VENV)/bin/python -m pytest -m nightly -s

lock: $(STAMP)
	scripts/lock

clean:
	rm -rf $(VENV) $(ROS_VENV) $(ROS_VENV).lock out build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache
