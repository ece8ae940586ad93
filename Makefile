# One command each: `make demo` and `make test` need only Python >= 3.10, make and pip.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out
WORKERS ?= 2

.PHONY: demo test lint check clean help

help:  ## list the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

demo: $(VENV)/demo  ## push a film of a walking woman through the three nodes
	$(BIN)/gait_demo --out $(OUT)/demo

test: $(VENV)/installed lint  ## check the code and run all tests
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile

lint: $(VENV)/installed  ## format, lint and types only
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

clean:  ## remove everything that was made
	rm -rf $(VENV) $(OUT) build install log *.egg-info

# Editable, so that the tests run on the tree as it stands (setuptools warns of that). What only they need takes as
# long again.
$(VENV)/demo: setup.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "Python 3.10 or newer is needed")'
	@echo 'Installing into $(VENV): some minutes, once'
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --upgrade pip setuptools
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable '.[ros]'
	@touch $@

$(VENV)/installed: $(VENV)/demo
	@echo 'Installing what the tests need: some minutes, once'
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable '.[ros,test]'
	@touch $@
