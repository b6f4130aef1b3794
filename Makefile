# Two commands: `make demo` runs the main job end to end, `make test` runs the tests. Both set up what they need.
PYTHON ?= $(shell for p in python3 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null && echo $$p && break; done)
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test slow check lint types contracts bench determinism golden lock clean

demo: $(READY)
	$(BIN)/sonarlog demo

test: $(READY)
	$(BIN)/python -m pytest

slow: $(READY)
	$(BIN)/python -m pytest -m slow

check: lint types contracts test

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(READY)
	$(BIN)/mypy

contracts: $(READY)
	$(BIN)/lint-imports

bench: $(READY)
	$(BIN)/sonarlog bench

# One digest on every machine that this one can pass for; WRITE=1 puts the tables into docs/determinism.md, and
# QUICK=1 gives the emulated machine, twenty times slower, only the shortest recording.
determinism: $(READY)
	$(BIN)/python -m tests.matrix $(if $(WRITE),--write) $(if $(QUICK),--quick)

# What replays of recordings/ give now against what was blessed; BLESS=1 writes it down.
golden: $(READY)
	$(BIN)/python -m tests.golden_runs $(if $(BLESS),--write)

# The lock holds exact versions and hashes of every dependency, for Python 3.11 to 3.13.
lock:
	uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --generate-hashes --no-header -o requirements.lock

$(READY): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "sonarlog needs Python 3.11 to 3.13: install one, or name it: make PYTHON=/path/to/python3"; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

clean:
	rm -rf $(VENV) out
