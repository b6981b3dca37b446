# `make help` lists the targets. The environment is .venv; `make setup` brings everything it needs.

SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help setup demo test portable validate lint docs clean

BIN := .venv/bin
DEMO := out/demo
WORKERS ?= 2
# One thread per process: the processes share the cores, and times stay comparable. No window, no home packages.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MPLBACKEND := Agg
export PYTHONNOUSERSITE := 1

help:  ## this list
	@sed -n 's/^\([a-z]*\):.*## /  make \1\t/p' $(firstword $(MAKEFILE_LIST)) | expand -t 18

setup:  ## install what is missing (apt packages, .venv, pinned Python packages); quick when nothing is
	@.ci/setup.sh

# The demo's command ends with 1 when a row is computed but not converged: the report is there all the same.
demo: setup  ## ribbon against shell for the curl of section 4.3; report in out/demo
	@$(BIN)/ribbonbench compare curl_4_3 --out $(DEMO); code=$$?; \
	if [ $$code -le 1 ]; then echo "demo: the report is in $(DEMO) (result.json, tables, figures)"; fi; exit $$code

lint: setup  ## ruff and mypy
	@$(BIN)/ruff check . && $(BIN)/ruff format --check . && $(BIN)/mypy && echo "lint: ruff and mypy have no complaint"

test: lint  ## set-up, lint and tests, a few first as on another processor; pytest's own closing line comes last
	@mkdir -p out/test && echo "test: first those that rounding can turn, as on another processor"
	@WORKERS=$(WORKERS) $(BIN)/python -m tests.portable --turn; turn=$$?; \
	echo "test: running pytest, results below and in out/test/junit.xml"; \
	$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal -m "not validate" --junitxml=out/test/junit.xml; code=$$?; \
	if [ $$turn -ne 0 ]; then echo "test: red as on another processor, see its lines above"; fi; exit $$((code ? code : turn))

portable: setup  ## the tests that rounding can turn, as on other processors (VARIANT=name: one; python -m tests.portable --list)
	@WORKERS=$(WORKERS) $(BIN)/python -m tests.portable $(VARIANT)

# Long validation. Commands that check more than pytest does go into VALIDATE, one per line, each failing by exit code.
define VALIDATE
$(BIN)/ribbonbench doctor
$(BIN)/python -m tests.validation --remake
endef
export VALIDATE

# The packages of .ci/NAME.lock, in .venv/NAME: apart from what the tests run with. What they need stands in it, or is in .venv.
apart = { cmp -s .ci/$(1).lock .venv/$(1)/lock || { rm -rf .venv/$(1) && \
	$(BIN)/python -m pip --disable-pip-version-check install --quiet --no-deps --target .venv/$(1) -r .ci/$(1).lock && \
	cp .ci/$(1).lock .venv/$(1)/lock; }; }

validate: setup  ## the long validation: pytest -m validate and the commands listed in the Makefile
	@{ $(call apart,docs) && $(call apart,readers); } || echo "validate: without them the tests of the site and of tables are skipped"
	@echo "validate: long tests and commands, results below and in out/validate/junit.xml" && mkdir -p out/validate
	@$(BIN)/python -m pytest -n $(WORKERS) -m validate --junitxml=out/validate/junit.xml; code=$$?; \
	if [ $$code -eq 5 ]; then echo "validate: no test carries the marker validate yet"; else exit $$code; fi
	@set -euo pipefail; while IFS= read -r command; do echo "validate: $$command"; $$command; done <<< "$$VALIDATE"
	@echo "validate: done"

docs: setup  ## the site from the pages and notebooks, in out/site/html: no warning, no dead link, nothing from elsewhere
	@$(call apart,docs)
	@PYTHONPATH=$(CURDIR):.venv/docs $(BIN)/python -m docs.site out/site

clean:  ## remove results and caches in this folder (.venv stays)
	@rm -rf out build .pytest_cache .mypy_cache .ruff_cache .hypothesis ribbonbench.egg-info
	@find . -path ./.venv -prune -o -type d -name __pycache__ -prune -exec rm -rf {} +
	@echo "clean: removed out/ and caches; .venv stays (delete it by hand)"
