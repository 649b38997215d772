# Two commands do everything on a fresh machine: make demo, make test.
# PYTHON chooses the interpreter (3.11 or newer): make test PYTHON=python3.12

# An interpreter that will do: new enough, and with the headers that the C core is built against.
FIT := import sys, sysconfig, os; sys.exit(not (sys.version_info >= (3, 11) \
	and os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h"))))
PYTHON ?= $(firstword $(foreach name,python3.13 python3.12 python3.11 python3,\
	$(if $(filter 0,$(shell $(name) -c '$(FIT)' 2>/dev/null; echo $$?)),$(name))) python3)
VENV := .venv
RUN := $(VENV)/bin
# What was installed: the plain package, or everything that tests and checks take (the extra "dev").
PLAIN := $(VENV)/.plain
STAMP := $(VENV)/.installed
INSTALLED := $(if $(wildcard $(STAMP)),$(STAMP),$(PLAIN))
PAGE := src/scissorcal/prototype/page
KERNEL := setup.py $(wildcard src/scissorcal/kernel/build_*.py src/scissorcal/kernel/c/*.[ch] firmware/core/*.[ch])
READY := $(STAMP) $(if $(filter 1,$(SCISSORCAL_WITHOUT_PAGE)),,page)
NODE := cd $(PAGE) && PATH="$(CURDIR)/$(RUN):$$PATH"
PYTEST_ARGS ?=
# All cores; the tests of one file stay in one process, so that they share their fixtures.
PYTEST := $(RUN)/pytest -n auto --dist loadfile

export PIP_DISABLE_PIP_VERSION_CHECK = 1
# Test modules are compiled once, not in each worker of each run; the tree ignores what that writes.
export PYTHONDONTWRITEBYTECODE =

.PHONY: demo test test-slow test-realtime test-explore lint format format-check types schemas schemas-check docs pictures c-tests fuzz fuzz-coverage fuzz-merge kernel page page-check setup clean

demo: $(INSTALLED)
	$(RUN)/scissorcal demo

test: $(READY)
	$(PYTEST) -m "not slow and not realtime" $(PYTEST_ARGS)

test-slow: $(READY)
	$(PYTEST) -m "slow and not realtime" $(PYTEST_ARGS)

# What needs a port in real time: alone, in one process. CONTRIBUTING.md says what counts.
test-realtime: $(READY)
	$(RUN)/pytest -p no:xdist -m realtime $(PYTEST_ARGS)

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
	$(RUN)/python docs/tools/tables.py --write

schemas-check: $(STAMP)
	$(RUN)/python -m scissorcal.workday.schemas --check
	$(RUN)/python src/scissorcal/kernel/write_wire.py --check
	$(RUN)/python docs/tools/tables.py --check

# The documentation as a site, in site/: it opens from a file, with search. A dead link fails.
docs: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(RUN)/mkdocs build

# Every picture of README and documentation, from the tutorials' own commands; needs Chromium.
pictures: $(STAMP) page
	$(RUN)/python -m docs.tools.pictures

# Strict, and again under the address and undefined-behaviour sanitizers; then the fuzzers' inputs.
c-tests:
	$(MAKE) --no-print-directory --jobs=$$(getconf _NPROCESSORS_ONLN) -C tests/c check BUILD=$(CURDIR)/build/c-tests
	$(MAKE) --no-print-directory --jobs=$$(getconf _NPROCESSORS_ONLN) -C tests/c/fuzz corpus BUILD=$(CURDIR)/build/fuzz

# libFuzzer, MINUTES for each harness; then the lines of the C core that its inputs reach. Needs clang.
MINUTES ?= 1
fuzz fuzz-coverage fuzz-merge:
	$(MAKE) --no-print-directory -C tests/c/fuzz $(patsubst fuzz-%,%,$@) BUILD=$(CURDIR)/build/fuzz MINUTES=$(MINUTES)

setup kernel: $(READY)

# The prototype's page and the core as WebAssembly, where they are older than their sources; fetches
# Zig and Node where they are not there.
page: $(INSTALLED)
	@SCISSORCAL_WITHOUT_PAGE= $(RUN)/python build_backend/browser_files.py

# TypeScript's own check of the page's types; the bundler does not look at them.
page-check: $(STAMP) page
	$(NODE) npm run --silent check

# The C core is built by the install itself; a changed source installs again. Modules are compiled on
# all cores and without the tests of others, which pip does one by one and for all.
define INSTALL
	@$(PYTHON) -c '$(FIT)' || { echo "scissorcal needs Python 3.11 or newer with its headers (on \
	Debian and Ubuntu: apt install python3-dev); say which: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@test -x $(RUN)/pip || $(PYTHON) -m venv $(VENV) || \
	  { echo "Python's venv module is missing; on Debian and Ubuntu: apt install python3-venv" >&2; exit 1; }
	$(RUN)/python -m pip install --quiet --no-compile "setuptools>=77" "cffi>=1.17"
	SCISSORCAL_WITHOUT_PAGE=1 $(RUN)/python -m pip install --quiet --no-compile --no-build-isolation --editable "$(1)"
	@$(RUN)/python -m compileall -q -j 0 -x '/tests?/' $(VENV)/lib/python3*/site-packages src >/dev/null || true
	@touch $(PLAIN)
endef

$(PLAIN): pyproject.toml $(KERNEL)
	$(call INSTALL,.)

$(STAMP): pyproject.toml $(KERNEL)
	$(call INSTALL,.[dev])
	@touch $@

# One at a time: both stamps are of one environment.
.NOTPARALLEL:

clean:
	rm -rf $(VENV) build dist site src/*.egg-info
