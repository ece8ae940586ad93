# One command each: `make demo` and `make test` need only Python >= 3.10, make and pip.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out
WORKERS ?= 2

.PHONY: demo test lint check clean help

help:  ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

demo: $(VENV)/installed  ## push a film of a walking woman through the three nodes
	$(BIN)/gait_demo --out $(OUT)/demo

test: $(VENV)/installed lint  ## check the code and run all tests
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile

lint: $(VENV)/installed  ## format, lint and types only
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

clean:  ## remove everything that was made
	rm -rf $(VENV) $(OUT) build install log *.egg-info

# Editable, so that the tests run on the tree as it stands.
$(VENV)/installed: setup.py
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "Python 3.10 or newer is needed")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip setuptools
	$(BIN)/python -m pip install --quiet --editable '.[ros,test]'
	touch $@
