# `make` alone lists the targets. Needs Python 3.11 or newer with venv; everything else goes into .venv.

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
PIP_FLAGS := --quiet --disable-pip-version-check
# A file's tests stay with one worker: they share hands and compiled functions. Of two workers, one takes all of
# tests/train and the other all of tests/envs first (tests/conftest.py): each folder shares sets and a training.
WORKERS ?= 2
# The robot hand of results-robots: a description's name, or the path of one.
HAND ?= allegro
# The environment of the newest Python here, and the Warp that pyproject.toml names.
NEWEST := .venv-newest
WARP := $(shell sed -n 's/^warp = .*warp-lang==\([0-9.]*\).*/\1/p' pyproject.toml)

.DEFAULT_GOAL := help
.PHONY: help setup demo results results-robots ablations test test-slow smoke lint format types docs bench lock clean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-14s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(STAMP)  ## make .venv with the locked packages (again only when they change)

# Candidates are run, not just looked up: a name on the PATH may be a launcher for a Python that is not there.
$(STAMP): requirements.lock pyproject.toml
	@set -e; \
	if [ ! -x $(BIN)/python ]; then \
	  found=; \
	  for candidate in $(PYTHON) python3.11 python3.12 python3.13 python3; do \
	    if $$candidate -c 'import sys, venv; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then found=$$candidate; break; fi; \
	  done; \
	  if [ -z "$$found" ]; then \
	    echo "make: found no Python 3.11 or newer with venv (tried $(PYTHON) python3.11 python3.12 python3.13 python3);" \
	      "install one, or name it: make setup PYTHON=/path/to/python3" >&2; exit 1; \
	  fi; \
	  echo "making $(VENV) with $$found ($$($$found -V))"; \
	  $$found -m venv $(VENV); \
	fi; \
	echo "installing the packages of requirements.lock (a minute or two)"; \
	$(BIN)/python -m pip install $(PIP_FLAGS) --require-hashes -r requirements.lock; \
	$(BIN)/python -m pip install $(PIP_FLAGS) --no-deps --no-build-isolation --no-index -e .; \
	touch $@

demo: $(STAMP)  ## retarget a recording, train a pinch policy, write a report with plots and a video
	$(BIN)/python -m train.demo

results: $(STAMP)  ## train and evaluate the five grasp types, three seeds each, on one page (hours; goes on where it stopped)
	$(BIN)/python -m train.results

results-robots: $(STAMP)  ## the same five types on a robot hand: make results-robots HAND=allegro (hours; goes on)
	$(BIN)/python -m train.results hand=$(HAND) results=outputs/results-$(HAND)

ablations: $(STAMP)  ## what each part of the method is worth: variants at equal budgets, three seeds, on one page (hours; goes on)
	$(BIN)/python -m train.ablations

test: $(STAMP)  ## run the tests
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile

test-slow: $(STAMP)  ## run the tests that take more than a minute each
	$(BIN)/python -m pytest -m slow

smoke: $(STAMP)  ## run a few tests, and a tiny training on every engine, under the newest Python here with its newest JAX
	@set -e; newest=$$(.ci/newest-python); \
	if [ -z "$$newest" ]; then echo "make smoke: no Python 3.12 or 3.13 here: newest JAX not tested"; exit 0; fi; \
	if [ ! -f $(NEWEST)/.installed ] || [ requirements.lock -nt $(NEWEST)/.installed ]; then \
	  echo "making $(NEWEST) with $$newest"; \
	  $(BIN)/uv venv --quiet --clear --python "$$newest" $(NEWEST); \
	  $(BIN)/uv pip install --quiet --compile-bytecode --python $(NEWEST)/bin/python --require-hashes -r requirements.lock; \
	  $(BIN)/uv pip install --quiet --compile-bytecode --python $(NEWEST)/bin/python --no-deps -e . warp-lang==$(WARP); \
	  touch $(NEWEST)/.installed; \
	fi; \
	$(NEWEST)/bin/python -c 'import jax, platform; print(f"Python {platform.python_version()}, jax {jax.__version__}")'; \
	$(NEWEST)/bin/python -m pytest -m "" tests/projection/test_project.py tests/train/settings/test_device.py tests/train/test_every_engine.py

lint: $(STAMP)  ## check style and formatting
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

format: $(STAMP)  ## mend what lint can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

types: $(STAMP)  ## check the types
	$(BIN)/pyright

docs: $(STAMP)  ## build the documentation into site/, warnings as errors
	$(BIN)/zensical build --strict --clean

bench: $(STAMP)  ## measure this machine: engines, solver settings, projection (a quarter of an hour)
	$(BIN)/python -m train.benchmark

lock: $(STAMP)  ## resolve requirements.lock again from pyproject.toml
	UV_CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/uv pip compile --quiet --upgrade --universal --generate-hashes --no-annotate \
	  --no-emit-index-url --no-emit-find-links --extra dev --extra docs --python-version 3.11 pyproject.toml -o requirements.lock

clean:  ## remove build products and caches of this folder (not .venv, not results)
	rm -rf build dist site .cache .pytest_cache .ruff_cache .hypothesis .jax_cache *.egg-info
	find . -path ./$(VENV) -prune -o -name __pycache__ -type d -print0 | xargs -0 rm -rf
