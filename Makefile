# make          says what there is
# make demo     from nothing to the whole flow, with pictures in demo/
# PYTHON=python3.12 chooses the Python that .venv is made with.

PYTHON ?= python3
bin := .venv/bin
pip := $(bin)/python -m pip --disable-pip-version-check --no-input -q
# --no-compile below: Python compiles a module when it is first imported; to compile all of them takes twice as long.

# The same everywhere: text is UTF-8 whatever the caller's locale (each of the two where the other does not reach), pip
# installs into .venv whatever its settings, and no other project's packages get in.
export LC_ALL := C.UTF-8
export PYTHONUTF8 := 1
export PIP_USER := 0
unexport PYTHONPATH
unexport PYTHONHOME

# A virtual environment works only in its own place: in a moved checkout it is made anew, and so it is for another PYTHON.
ifneq ($(shell cat .venv/.made-in 2>/dev/null),$(CURDIR))
anew := FORCE
endif
ifneq ($(origin PYTHON),file)
ifneq ($(shell cat .venv/.made-with 2>/dev/null),$(PYTHON))
anew := FORCE
endif
endif

.PHONY: help setup demo docs docs-quick test test-slow lint fuzz mutants peers bench dist constraints clean FORCE

help:
	@echo 'make setup   installs the package and what its commands need into .venv, and ngspice where there is none: as'
	@echo '             root, or by a sudo without password, as a package of the system, else into .venv. Fetches by npm'
	@echo '             what ilg-circuit page carries'
	@echo 'make demo    runs the whole flow once, results in demo/'
	@echo 'make test    runs the tests, but for slow ones; minutes'
	@echo 'make test-slow runs the slow ones: trials with known truth, the examples, what the pages show; twice as long'
	@echo 'make docs    builds the documentation, gallery included, into docs/_build/html'
	@echo 'make docs-quick  the same without running the examples'
	@echo 'make lint    checks style and types'
	@echo 'make fuzz    runs 20000 random commands and 50000 damaged files; hours, goes on where it stopped'
	@echo 'make mutants counts how many of 300 small faults in the engine the tests notice; hours, later only what changed'
	@echo 'make peers   installs other programs that the tests compare with'
	@echo 'make bench   measures every figure that is stated again, beside its peers; most of an hour'
	@echo 'make dist    builds the sdist, the wheel for every system and the one with ngspice for this Linux, into dist/'
	@echo 'make constraints chooses the versions anew that are installed above, and writes their hashes'
	@echo 'make clean   removes .venv and everything generated'
	@echo 'PYTHON=python3.12 after any of them chooses the Python.'

setup: .venv/.stamp-package .venv/.stamp-ngspice .venv/.stamp-page

demo: setup
	$(bin)/ilg-circuit demo --out demo

test: setup .venv/.stamp-dev
	$(bin)/python -m pytest --numprocesses 2 --dist loadfile -m "not slow"

test-slow: setup .venv/.stamp-dev
	$(bin)/python -m pytest --numprocesses 2 --dist loadfile -m slow

# Warnings are errors. Nothing is fetched: packages come from PyPI before, what a strip's page carries by npm.
docs: setup .venv/.stamp-docs
	$(bin)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html

docs-quick: setup .venv/.stamp-docs
	$(bin)/python -m sphinx -W --keep-going -q -b html -D plot_gallery=0 docs docs/_build/quick

lint: .venv/.stamp-dev
	$(bin)/python -m ruff check .
	$(bin)/python -m ruff format --check .
	$(bin)/python -m mypy
	$(bin)/python scripts/validate_docstrings.py

fuzz: .venv/.stamp-dev
	$(bin)/python tests/fuzz files 50000 --state fuzz-files.jsonl
	$(bin)/python tests/fuzz commands 20000 --state fuzz-commands.jsonl

mutants: .venv/.stamp-dev
	$(bin)/python scripts/calls_of_tests.py --state calls_of_tests.jsonl
	$(bin)/python scripts/mutants.py

# Other programs that answers are compared with; some of them do not install everywhere.
peers: .venv/.stamp-dev
	@$(pip) install -e '.[peers]' || echo 'not all peers could be installed: their tests are skipped'

bench: setup .venv/.stamp-bench
	$(bin)/python benchmarks/all.py

dist: .venv/.stamp-release
	rm -rf dist
	$(bin)/python -m build
	! command -v apt-get >/dev/null || ILG_CARRY_NGSPICE=1 $(bin)/python -m build --wheel
	$(bin)/python -m twine check --strict dist/*

constraints: .venv/.stamp-release
	$(bin)/python scripts/make_constraints.py

clean:
	rm -rf .venv build dist demo docs/_build docs/gallery ilg_circuit/browser/assets .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

.venv/.stamp-venv: $(anew)
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo '$(PYTHON) is not Python 3.11 or later: install one and name it, as in: make $(MAKECMDGOALS) PYTHON=python3.12' >&2; exit 1; }
	@"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo '$(PYTHON) cannot make virtual environments: install its venv module (Debian, Ubuntu: apt-get install python3-venv)' >&2; exit 1; }
	@"$(PYTHON)" -m venv --clear .venv
	@printf '%s\n' "$(CURDIR)" >.venv/.made-in
	@printf '%s\n' "$(PYTHON)" >.venv/.made-with
	@touch $@

# Pinned versions by their hashes; where these cannot be had, the newest that fit, said in a line.
.venv/.stamp-package: pyproject.toml constraints/all.txt .venv/.stamp-venv
	@echo 'Installing the package into .venv, with what all its commands need'
	@$(bin)/python scripts/install.py all.txt
	@touch $@

.venv/.stamp-dev: constraints/dev.txt .venv/.stamp-package
	@echo 'Installing the tools for tests and checks into .venv'
	@$(bin)/python scripts/install.py dev.txt
	@touch $@

.venv/.stamp-docs: .venv/.stamp-package
	@echo 'Installing the tools for the documentation into .venv'
	@$(pip) install -e '.[docs]'
	@touch $@

.venv/.stamp-bench: .venv/.stamp-package
	@echo 'Installing the programs that are measured beside this one into .venv'
	@$(pip) install -e '.[bench]'
	@touch $@

.venv/.stamp-release: .venv/.stamp-package
	@echo 'Installing the tools for releases into .venv'
	@$(pip) install build twine uv
	@touch $@

.venv/.stamp-ngspice: scripts/get_ngspice.py .venv/.stamp-package
	@$(bin)/python scripts/get_ngspice.py
	@touch $@

# Without npm it says so, and all but `ilg-circuit page` works; the next make looks again.
.venv/.stamp-page: scripts/get_page_assets.py .venv/.stamp-package
	@$(bin)/python scripts/get_page_assets.py && touch $@ || true
