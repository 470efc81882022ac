# The commands of this workspace; `make help` lists them.
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.ONESHELL:
.DEFAULT_GOAL := help
.PHONY: help setup demo test test-long test-oldest check format ablate bench docs faults fuzz colcon lock clean

BIN = $(VENV)/bin
PIP = $(BIN)/python -m pip --disable-pip-version-check --quiet
PACKAGES := $(patsubst %/setup.py,%,$(wildcard src/*/setup.py))
PYENV := $(or $(PYENV_ROOT),$(HOME)/.pyenv)
PYTHONS := python3.12 $(wildcard $(PYENV)/versions/3.12*/bin/python3.12)
# The first Python that really runs and can make a venv: a pyenv shim may exist and yet fail.
PYTHON = $(firstword $(shell for python in $(PYTHONS); do \
	"$$python" -c "import ensurepip, venv" 2>/dev/null && echo "$$python" || true; done))

# A sourced ROS 2 Jazzy is used as it is, with the Python it was built for; otherwise ROS comes from the wheels in the lock.
ifeq ($(ROS_DISTRO)$(if $(AMENT_PREFIX_PATH), sourced),jazzy sourced)
ROS := sourced
VENV := .venv-sourced
PYTHONS := /usr/bin/python3.12 $(PYTHONS)
VENV_OPTIONS := --system-site-packages
PINS := grep -hv '^ros-' requirements.lock requirements.nodeps
else
ROS := wheels
VENV := .venv
VENV_OPTIONS :=
PINS := cat requirements.lock requirements.nodeps
# Called from another venv with these wheels: forget that venv's libraries.
ifdef _ROS_WHEELS_BOOTSTRAP_COMPLETE
unexport _ROS_WHEELS_BOOTSTRAP_COMPLETE LD_LIBRARY_PATH
endif
endif

# Three processes on two cores, each of one thread: some tests wait for a rig.
PARALLEL := OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1
SPREAD := -n 3 --dist worksteal

help: ## list these commands
	@sed -nE 's/^([a-z-]+):[^#]*## (.*)/make \1\t\2/p' $(firstword $(MAKEFILE_LIST)) | expand -t 18

setup: $(VENV)/.compiled-$(ROS) $(VENV)/.learning-$(ROS) ## create .venv with everything pinned; nothing when it is up to date

demo: $(VENV)/.installed-$(ROS) ## conceal physics in an emulated rig, record it, diagnose it, report
	@trap : INT  # Ctrl-C ends the demo, which says so; make has nothing to add
	$(BIN)/python -m pendulum_bridge.studies.demo --out out/demo $(ARGS) || [ $$? -eq 130 ]

test: setup ## run the test suite (ARGS="-k word" and the like go to pytest)
	@run() { $(BIN)/python -m pytest "$$@" $(ARGS) || [ $$? -eq 5 ]; }  # 5: no test selected
	$(PARALLEL) run $(SPREAD) -m "not (wall_time or long)"
	run -m wall_time  # what measures time runs alone

test-long: setup ## run the tests that take long: real rigs, studies, every command of the README
	@$(PARALLEL) $(BIN)/python -m pytest $(SPREAD) -m "long and not wall_time" $(ARGS) || [ $$? -eq 5 ]

# Ubuntu 24.04's versions of the libraries, without ROS and MuJoCo: the tests that need neither.
OLDEST := .venv-oldest
CORE := $(addprefix tests/twin/test_,$(addsuffix .py,known_answers simulation twin_file strict_yaml rail_ends emergency_stop)) \
	tests/sysid/reading tests/sysid/fitting/test_gauss_newton.py
test-oldest: $(OLDEST)/.installed ## the core's tests with the oldest libraries that it works with, those of Ubuntu 24.04
	@PYTHONPATH=$(subst $(eval ) ,:,$(PACKAGES:%=$(CURDIR)/%)) $(OLDEST)/bin/python -m pytest --quiet -c src/pendulum_twin/pytest.ini --rootdir . -p no:cacheprovider $(CORE) $(ARGS)

$(OLDEST)/.installed: requirements-oldest.lock
	@"$(PYTHON)" -m venv --clear $(OLDEST)
	$(OLDEST)/bin/python -m pip --disable-pip-version-check --quiet install --no-deps -r requirements-oldest.lock
	touch $@

check: setup ## format, lint, types
	@$(BIN)/ruff format --check src tests
	$(BIN)/ruff check src tests
	$(BIN)/mypy

format: setup ## write the format, and the fixes that lint can make by itself
	@$(BIN)/ruff check --fix-only --quiet src tests
	$(BIN)/ruff format src tests

ablate: setup ## vary every number that decides, and show which verdicts change (TRIALS=folder of sysid prove)
	@$(BIN)/python -m pendulum_sysid.studies.ablation --trials $(or $(TRIALS),out/proof/trials) --out docs/decisions.md $(ARGS)

bench: setup ## the benchmarks, each figure beside its peer
	@$(BIN)/python tests/bench/run.py $(ARGS)

docs: setup ## the site with the page of the Python API, into out/site
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	echo out/site/index.html

faults: $(VENV)/.installed-$(ROS) ## make every fault in turn: time until PWM 0, what is right, what was said
	@$(BIN)/python tests/faults/run.py $(ARGS)

fuzz: setup ## 2,000 odd files given to sysid: how it ends, the longest time, the memory (ARGS="--cases N --seed S")
	@$(BIN)/python tests/fuzz/run.py $(ARGS)

colcon: $(VENV)/.installed-$(ROS) ## build the ROS packages into build/ and install/ (ARGS="--symlink-install")
	@$(BIN)/colcon build --base-paths src $(ARGS)

lock: setup ## resolve requirements.in and requirements-learning.in anew into their locks
	@$(PIP) install --dry-run --ignore-installed --report $(VENV)/resolved.json -r requirements.in
	$(BIN)/python -c 'import json, sys
	pins = ["{name}=={version}".format_map(p["metadata"]) for p in json.load(sys.stdin)["install"]]
	print(*sorted(pins, key=str.casefold), sep="\n")' < $(VENV)/resolved.json > requirements.lock
	$(PIP) install --dry-run --ignore-installed --report $(VENV)/resolved.json -c requirements.lock -r requirements-learning.in
	$(BIN)/python -c 'import json, sys
	pins = {"{name}=={version}".format_map(p["metadata"]) for p in json.load(sys.stdin)["install"]}
	print(*sorted(pins - set(open("requirements.lock").read().split()), key=str.casefold), sep="\n")' \
		< $(VENV)/resolved.json > requirements-learning.lock

clean: ## remove what was built; .venv stays
	@rm -rf build install log out .mypy_cache .ruff_cache .pytest_cache .hypothesis src/*/build src/*/*.egg-info

# Made anew when a pin changes, so that it never holds more than the lock says. ROS from wheels is in .venv, a sourced ROS
# in .venv-sourced: sourcing or leaving ROS keeps both. Where there is no .venv, it is a link to the other.
$(VENV)/.pinned-$(ROS): requirements.lock requirements.nodeps
	@python="$(PYTHON)"
	if [ -z "$$python" ]; then
		echo "Python 3.12 is missing: install it with its venv module (apt install python3.12-venv, or pyenv install 3.12)." >&2
		exit 1
	fi
	echo "Setting up $(VENV) with $$python, ROS 2 Jazzy: $(ROS)"
	if [ -L $(VENV) ]; then rm $(VENV); fi
	"$$python" -m venv --clear $(VENV_OPTIONS) $(VENV)
	if [ ! -e .venv ]; then ln -sfn $(VENV) .venv; fi
	$(PINS) > $(VENV)/pins.txt
	$(PIP) install --no-deps -r $(VENV)/pins.txt
	touch $@

# Apart, and last: torch is several times as large as all the rest.
$(VENV)/.learning-$(ROS): $(VENV)/.pinned-$(ROS) requirements-learning.lock
	@$(PIP) install --no-deps -r requirements-learning.lock
	touch $@

# The twin's kernel is compiled ahead: no first start has to.
$(VENV)/.compiled-$(ROS): $(VENV)/.installed-$(ROS) $(wildcard src/pendulum_twin/pendulum_twin/*.py src/pendulum_twin/pendulum_twin/effects/*.py src/pendulum_twin/pendulum_twin/laws/*.py)
	@echo "Compiling the twin"
	$(BIN)/python -m pendulum_twin.compile_ahead --all > /dev/null
	$(BIN)/python -m compileall -q src  # for users whose Python writes no bytecode, too
	touch $@

$(VENV)/.installed-$(ROS): $(VENV)/.pinned-$(ROS) $(PACKAGES:%=%/setup.py)
	@$(PIP) install --no-deps --no-build-isolation --use-pep517 $(PACKAGES:%=-e ./%)
	touch $@
