# The project's menu: make compare | test | lint | check | clean
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed

.PHONY: help install compare test lint check clean

help:
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

# torch first, and pinned: whatever depends on it then takes the build that is already there
$(INSTALLED): pyproject.toml constraints.txt
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt torch
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[train,dev]'
	touch $@

install: $(INSTALLED)  ## create .venv with the project and its pinned dependencies

compare: $(INSTALLED)  ## run all controllers on the same scenarios; table and HTML report
	$(BIN)/python evaluate.py

test: $(INSTALLED)  ## run the test suite
	$(BIN)/python -m pytest --numprocesses 2

lint: $(INSTALLED)  ## ruff and mypy
	$(BIN)/ruff check .
	$(BIN)/mypy

check: lint test  ## lint and test

clean:  ## remove the environment and all results
	rm -rf $(VENV) results runs build *.egg-info
