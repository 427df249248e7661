# `make demo` and `make test` set up all they need in .venv (once), then work offline.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
WHEELHOUSE := .wheelhouse
OLDEST := .venv-oldest
OLDEST_GYMNASIUM := 1.2.2
SCENES := ../shared/data/paper_scenes
SOURCES := $(shell find farm_ar -name '*.py')

# Build back ends come from .venv too, so that a repeated installation fetches nothing.
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
HEADLINE = @printf '\n== %s\n'

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help demo play test test-all test-oldest setup lint format types imports wheel unit bench clean

help: ## Show this list
	@printf 'farm-ar: make TARGET [PYTHON=python3.12]\n\n'
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  \1|\2/p' $(MAKEFILE_LIST) | awk -F'|' '{ printf "%-12s %s\n", $$1, $$2 }'

demo: $(VENV)/compiled-films.stamp ## Set up, then film the game's two demonstrations, into out/
	$(HEADLINE) "Filming the Farm-to-Table game, into out/"
	@$(BIN)/farm-ar demo --out out

play: $(VENV)/web.stamp $(VENV)/compiled-films.stamp ## Set up, then play the game on a page in a browser
	@$(BIN)/farm-ar play

test: setup lint types imports wheel unit ## Set up, then run every check (some minutes)

test-all: export FARM_AR_TESTS := all
test-all: test ## The same with full counts and the long tests (up to three quarters of an hour)

setup: $(VENV)/dev.stamp $(WHEELHOUSE)/stamp $(VENV)/compiled.stamp ## Set up only, with all that the checks need

lint: $(VENV)/dev.stamp ## Check style and formatting (ruff)
	$(HEADLINE) "Style and formatting"
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .

format: $(VENV)/dev.stamp ## Rewrite the code in the project's format
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

types: $(VENV)/dev.stamp ## Check types (mypy --strict)
	$(HEADLINE) "Types"
	@$(BIN)/mypy --strict farm_ar

imports: $(VENV)/dev.stamp ## Check that packages import only what stands below them
	$(HEADLINE) "Import order of the packages"
	@$(BIN)/lint-imports --no-logo

unit: $(VENV)/dev.stamp ## Run the tests, examples among them, with coverage (PYTEST_ARGS=... adds to it)
	$(HEADLINE) "Tests"
	@if [ -z "$${FARM_AR_PAPER_SCENES:-}" ] && [ -d "$(SCENES)" ]; then \
	    FARM_AR_PAPER_SCENES="$(abspath $(SCENES))"; export FARM_AR_PAPER_SCENES; \
	fi; \
	$(BIN)/python -m pytest -n auto --maxprocesses 4 --cov --cov-report=term $(PYTEST_ARGS)

test-oldest: $(OLDEST)/stamp ## Run the environments' tests with the oldest Gymnasium that is supported
	$(HEADLINE) "Environments, with Gymnasium $(OLDEST_GYMNASIUM)"
	@$(OLDEST)/bin/python -m pytest -n auto --maxprocesses 4 tests/envs tests/testing tests/test_trainers.py $(PYTEST_ARGS)

wheel: $(VENV)/dev.stamp $(WHEELHOUSE)/stamp ## Build the wheel, install it into an empty environment, use it there
	$(HEADLINE) "The wheel, in an empty environment"
	@set -e; \
	work=$$(mktemp -d); trap 'rm -rf "$$work"' EXIT; trap 'exit 1' HUP INT TERM; \
	$(BIN)/python -m build --wheel --no-isolation --outdir "$$work" . >"$$work/log" 2>&1 || { cat "$$work/log"; exit 1; }; \
	$(BIN)/python -m venv "$$work/venv"; \
	"$$work/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
	    --no-index --find-links "$(WHEELHOUSE)" --constraint constraints.txt "$$work"/farm_ar-*.whl; \
	cd "$$work"; env -u PYTHONPATH venv/bin/farm-ar scenes list

bench: $(VENV)/dev.stamp ## Time all that is measured, as one page: docs/speed.md (half an hour)
	@SDL_VIDEODRIVER=dummy $(BIN)/python benchmarks/page.py

clean: ## Remove all that make and the checks have left, .venv among it
	rm -rf $(VENV) $(OLDEST) $(WHEELHOUSE) out build dist .coverage .coverage.* .hypothesis .import_linter_cache \
	    .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# A stamp stands for a finished step; an interrupted one is done again.
$(VENV)/made.stamp:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	    echo 'farm-ar needs Python 3.11 or newer; "$(PYTHON)" is not. Name one: make PYTHON=python3.12'; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	    echo '"$(PYTHON)" lacks the modules venv and ensurepip (on Debian and Ubuntu: the package python3-venv).'; \
	    echo 'Install them, or name another Python: make PYTHON=python3.12'; exit 1; }
	$(HEADLINE) "Making $(VENV) with $$($(PYTHON) --version)"
	@$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/core.stamp: $(VENV)/made.stamp pyproject.toml constraints.txt
	$(HEADLINE) "Installing farm-ar and what it needs into $(VENV) (once; a minute or two)"
	@$(INSTALL) hatchling editables
	@$(INSTALL) --no-build-isolation --editable .
	@touch $@

$(VENV)/dev.stamp: $(VENV)/core.stamp
	$(HEADLINE) "Installing what the checks need, learners among it (once; some minutes)"
	@$(INSTALL) --no-build-isolation --editable '.[dev,train,vision,vision-paper,service,distributed]'
	@touch $@

$(VENV)/web.stamp: $(VENV)/core.stamp
	$(HEADLINE) "Installing what the page needs (once)"
	@$(INSTALL) --no-build-isolation --editable '.[web]'
	@touch $@

# Only what has changed since the last time is compiled.
$(VENV)/compiled-films.stamp: $(VENV)/core.stamp $(SOURCES)
	$(HEADLINE) "Compiling what films need (half a minute, once)"
	@$(BIN)/farm-ar compile films
	@touch $@

$(VENV)/compiled.stamp: $(VENV)/dev.stamp $(SOURCES)
	$(HEADLINE) "Compiling (some minutes, once)"
	@$(BIN)/farm-ar compile
	@touch $@

$(OLDEST)/stamp: pyproject.toml constraints.txt
	$(HEADLINE) "Setting up $(OLDEST) (once; some minutes)"
	@$(PYTHON) -m venv $(OLDEST)
	@grep -v '^gymnasium==' constraints.txt >$(OLDEST)/constraints.txt
	@$(OLDEST)/bin/python -m pip install --quiet --disable-pip-version-check \
	    --constraint $(OLDEST)/constraints.txt gymnasium==$(OLDEST_GYMNASIUM) 'ray[rllib]' --editable '.[dev,train,vision,service]'
	@touch $@

$(WHEELHOUSE)/stamp: $(VENV)/core.stamp
	$(HEADLINE) "Keeping the core's wheels in $(WHEELHOUSE), for the wheel check (once)"
	@mkdir -p $(WHEELHOUSE)
	@keep="$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --constraint constraints.txt \
	    --no-build-isolation --find-links $(WHEELHOUSE) --wheel-dir $(WHEELHOUSE)"; \
	$$keep --no-index . >/dev/null 2>&1 || $$keep .  # first with the wheels kept before, without a network
	@rm -f $(WHEELHOUSE)/farm_ar-*.whl
	@touch $@
