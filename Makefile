# One command each: `make demo` and `make test` need only Python >= 3.10, make and pip.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
OUT ?= out
WORKERS ?= 2
OLDEST ?= .venv-oldest
MINUTES ?= 45
FAULTS ?= 300
SEED ?= $(shell od -An -N4 -tu4 /dev/urandom | tr -d ' ')

.PHONY: demo overlay film-given test test-oldest fuzz faults mutants lint clean help

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 12

demo: $(VENV)/demo  ## push a film of a walking woman through the three nodes (PRESET=paper; DETECTOR=boxes)
	$(BIN)/gait_demo --out $(OUT)/demo $(if $(PRESET),--preset $(PRESET)) $(if $(DETECTOR),--detector $(DETECTOR))
	@echo 'next, a film of your own: make overlay FILM=walk.mp4'

# As it was typed: make would take "a$b" for a variable, the shell "Tom's" for an open quote.
override export FILM := $(or $(value FILM),$(value film))
override export OUT := $(value OUT)
HERE = case "$$FILM" in '~/'*) FILM=$$HOME/$${FILM\#'~/'};; esac

# Made again each time, but nothing is replaced that is not of this film, as one's own or of another of that name.
overlay: film-given $(VENV)/demo  ## find who is in FILM=walk.mp4: overlay and masks (of three: PEOPLE=3; DETECTOR=boxes)
	@$(HERE); name=$$(basename -- "$$FILM"); place=$$(realpath -m -- "$$OUT")/$${name%.*}; \
	film=$$(realpath -- "$$FILM"); known="$${place%/*}/replay/$${name%.*}.film"; \
	for each in "$${place}_overlay.mp4" "$${place}_masks"; do \
		if test -e "$$each" -a "$$(cat -- "$$known" 2>/dev/null)" != "$$film"; then \
			echo "$$each is there already, and not of this film: OUT=... is another place" >&2; exit 1; fi; done; \
	mkdir -p -- "$${known%/*}" && printf '%s\n' "$$film" >"$$known" && \
	$(BIN)/gait_replay --force --out "$$OUT/replay" --overlay "$${place}_overlay.mp4" --masks "$${place}_masks" \
		--set people.max_people=$(or $(PEOPLE),3) $(if $(DETECTOR),--detector $(DETECTOR)) -- "$$FILM" && \
	echo "$${place}_overlay.mp4  the film with outline, box, direction and phase" && \
	echo "$${place}_masks  the silhouettes, a picture a frame"

# Before the installation, which takes minutes.
film-given:
	@$(HERE); test -e "$$FILM" || { echo "say which film: make overlay FILM=walk.mp4$${FILM:+ ($$FILM is not there)}" >&2; exit 1; }

# What is compiled to bytes is kept in any case: many processes are started, each would do it again.
test test-oldest fuzz: export PYTHONDONTWRITEBYTECODE :=

# In order, not the files of few tests last: these take longest, and one worker would wait for the other.
SHARED := -n $(WORKERS) --dist loadfile --no-loadscope-reorder

# Kernels are compiled meanwhile, once, and not by each worker.
test: $(VENV)/installed  ## check the code and run all tests
	$(BIN)/gait_warm_up & $(MAKE) lint; checked=$$?; wait; exit $$checked
	$(BIN)/python -m pytest $(SHARED)

# With a cache of its own: Numba's would be made anew each time.
test-oldest: $(OLDEST)/installed  ## run all tests with the oldest libraries that are promised to work
	NUMBA_CACHE_DIR=$(CURDIR)/$(OLDEST)/numba $(OLDEST)/bin/python -m pytest $(SHARED)

# The seed of each round is printed: with MINUTES=0 it gives that round alone again.
fuzz: $(VENV)/installed  ## other random examples, also of hostile messages, files and frames: rounds for MINUTES, SEED
	@seed=$(SEED); end=$$(($$(date +%s) + 60 * $(MINUTES))); \
	while :; do \
		echo "make fuzz SEED=$$seed MINUTES=0"; \
		$(BIN)/python -m pytest -n $(WORKERS) -q -m hypothesis --hypothesis-profile fuzz --hypothesis-seed $$seed || exit 1; \
		test $$(date +%s) -lt $$end || break; \
		seed=$$(((seed + 1) % 4294967296)); \
	done

faults: $(VENV)/installed  ## plant faults, one at a time, and tell which of them no test finds (half an hour)
	$(BIN)/python tools/faults.py --jobs $(WORKERS)

mutants: $(VENV)/installed  ## the same of FAULTS mechanical ones (300), drawn anew: SEED=... gives them again
	$(BIN)/python tools/faults.py --jobs $(WORKERS) --random $(FAULTS) --seed $(SEED) --least 0.85

lint: $(VENV)/installed  ## format, lint and types only
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

clean:  ## remove everything that was made
	rm -rf $(VENV) $(OLDEST) $(OUT) build install log tools/build *.egg-info tools/*.egg-info

# Editable, so that the tests run on the tree as it stands (setuptools warns of that). What only they need takes as
# long again.
$(VENV)/demo: setup.py tools/setup.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10) and "Python 3.10 or newer is needed")'
	@echo 'Installing into $(VENV): some minutes, once'
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --upgrade pip setuptools
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable '.[ros,tools,fast]' --editable ./tools
	@touch $@

$(VENV)/installed: $(VENV)/demo
	@echo 'Installing what the tests need: some minutes, once'
	PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable '.[ros,test]' \
		--editable './tools[evaluate,learn]'
	@touch $@

# matplotlib 3.6 has wheels for no newer Python.
$(OLDEST)/installed: setup.py tools/setup.py test/oldest.txt
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info < (3, 12) and \
		"Python 3.10 or 3.11 is needed: make test-oldest PYTHON=python3.11")'
	@echo 'Installing the oldest libraries into $(OLDEST): some minutes, once'
	@$(PYTHON) -m venv $(OLDEST)
	@$(OLDEST)/bin/python -m pip install --quiet --upgrade pip
	PYTHONWARNINGS=ignore $(OLDEST)/bin/python -m pip install --quiet --constraint test/oldest.txt --editable '.[ros,test]' \
		--editable './tools[evaluate,learn]'
	@touch $@
