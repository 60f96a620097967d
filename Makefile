# The project's menu: make compare | benchmark | agents | test | test-core | wheel | lint | check | clean
# PYTHON=... names the interpreter; else the first of these that runs and is new enough makes .venv
PYTHON ?=
PYTHONS := $(or $(PYTHON),python3.11 python3.12 python3.13 python3.14 python3)
VENV := .venv
BIN := $(VENV)/bin
CORE := $(VENV)/.core
INSTALLED := $(VENV)/.installed
PIP_INSTALL := $(BIN)/python -m pip install --quiet --constraint constraints.txt

.PHONY: help install compare benchmark agents committed test test-core wheel lint check clean

# Processes that run tests; 0 is one, without another to start it
WORKERS := 2

help:
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

# A candidate is run, since a name on the path need not be a Python that works
$(BIN)/python:
	@for python in $(PYTHONS); do \
	  if $$python -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; \
	  then echo "$$python -m venv $(VENV)"; $$python -m venv $(VENV); exit; fi; \
	done; \
	echo "None of these is a Python 3.11 or newer with its venv module: $(PYTHONS)." >&2; \
	echo "Install one, or name one: make ... PYTHON=/path/to/python" >&2; \
	exit 1

$(CORE): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP_INSTALL) --editable .
	touch $@

# torch first, and pinned: whatever depends on it then takes the build that is already there
$(INSTALLED): pyproject.toml constraints.txt | $(BIN)/python
	$(PIP_INSTALL) torch
	$(PIP_INSTALL) --editable '.[train,dev]'
	touch $(CORE) $@

install: $(INSTALLED)  ## create .venv with the project and its pinned dependencies

compare: $(CORE)  ## run all controllers on the same scenarios; table and HTML report
	$(BIN)/python evaluate.py

benchmark: $(CORE)  ## run all suites with all agents; writes docs/results.md and the agents' scores
	$(PIP_INSTALL) --editable '.[qp]'  # mpc takes part
	$(BIN)/python evaluate.py --suites all --episodes all --members all --output results/benchmark
	$(BIN)/defmanip agents --score results/benchmark
	$(BIN)/python docs/make_results.py

# defmanip ship takes no run of changed sources: better to say so before than after half a day
committed:
	@git diff --quiet HEAD || { echo "Commit your changes first: cards name the revision."; exit 1; }

agents: $(INSTALLED) committed  ## train and ship all agents, half a day; runs that are there are kept
	$(BIN)/defmanip trainings
	$(BIN)/defmanip trainings --env DeformTransportRandomized-v0 --algos ppo
	$(BIN)/defmanip trainings --env DeformTransport-v1 --algos ppo sac --filter storage
	$(BIN)/defmanip trainings --env DeformTransportRandomized-v1 --algos ppo --filter storage
	$(BIN)/defmanip ship runs/*

test: $(INSTALLED)  ## run the test suite
	$(BIN)/python -m pytest --numprocesses $(WORKERS)

test-core: | $(BIN)/python  ## run the tests that need no torch, with every Python found or PYTHON=...
	$(BIN)/python .ci/test_core.py --workers $(WORKERS) $(PYTHON)

wheel: | $(BIN)/python  ## build dist/, try the wheel with every Python found or PYTHON=...
	$(BIN)/python .ci/check_wheel.py $(PYTHON)

lint: $(INSTALLED)  ## ruff and mypy
	$(BIN)/ruff check .
	$(BIN)/mypy

check: lint test  ## lint and test

clean:  ## remove the environment and all results
	rm -rf $(VENV) results runs build dist *.egg-info
