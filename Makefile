# engine mount: `make drive` and `make test` are all that a new machine needs.

VENV ?= .venv
BIN := $(VENV)/bin
CAR := mount_models mount_ros mount_driver mount_init mount_control mount_recorder mount_sim mount_bringup
DESK := engine_mount
PACKAGES := $(CAR) $(DESK)
# The first Python that runs, is 3.11 to 3.13 (the wheels of rclpy end there) and can make environments. That of the
# distribution comes first: it was compiled with profile-guided optimisation, which many that were compiled by
# hand lack, and without it the graph runs a quarter slower (measured).
PYTHON ?= $(shell for p in /usr/bin/python3 python3 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null && echo $$p && break; done)
DRIVE_OPTIONS ?=
FAULTS_OPTIONS ?=
CHECK_OPTIONS ?=
REAL_TIME_TESTS = $(shell grep -rl --include='test_*.py' 'mark.real_time' src test)
# Processes that pass tests at the same time: one more than cores, for many tests wait for processes of their own.
WORKERS ?= $(shell echo $$(($$(nproc) < 3 ? $$(nproc) + 1 : 4)))
RACK := build/rack
SPECIMEN := src/mount_models/mount_models/specimens/default.yaml

# Where it is set, as in many containers, every process would compile all its modules anew: half a second for each node,
# a quarter of a minute for each process that passes tests.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help drive test test-all test-arm64 test-cortex-m test-socketcan check faults experiments identify pages bench lint format setup-core setup setup-desk setup-dev clean

help: ## list the commands
	@grep -E '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*## /: /' | column -t -s:

drive: $(VENV)/.ready ## drive the simulated car over a gap in the motorway and record it
	@$(BIN)/engine-mount drive $(DRIVE_OPTIONS)

# Tests that start the graph in real time need the machine for themselves; they come last, one by one.
pass_tests = $(BIN)/python -m pytest -m '$(1) and not real_time' -n $(WORKERS) --dist loadscope && \
	$(BIN)/python -m pytest -m '$(1) and real_time' $(REAL_TIME_TESTS)

test: $(VENV)/.ready-dev ## pass the tests that take 5 minutes on two cores
	@$(call pass_tests,not slow)

test-all: test ## pass these and all others, which take 10 minutes more
	@$(call pass_tests,slow)

test-arm64: $(VENV)/.ready-dev ## compare the law in C, and all that needs no ROS, on an emulated aarch64 with this machine
	@$(BIN)/python test/targets/law_in_c.py arm64
	@$(BIN)/python test/targets/aarch64.py

test-cortex-m: $(VENV)/.ready-dev ## compare the law in C on an emulated Cortex-M7 without a library with Python
	@$(BIN)/python test/targets/law_in_c.py cortex-m

test-socketcan: $(VENV)/.ready-dev ## pass tests of the driver over SocketCAN, and a drive, in an emulated machine
	@$(BIN)/python test/socketcan/virtual_machine.py

check: $(VENV)/.ready ## drive the manoeuvre suite and judge it by its limits, before a change goes into the car
	@$(BIN)/engine-mount check $(CHECK_OPTIONS)

faults: $(VENV)/.ready ## bring every fault into the real graph; writes docs/reference/faults.md
	@$(BIN)/engine-mount dev faults --page docs/reference/faults.md $(FAULTS_OPTIONS)

experiments: $(VENV)/.ready ## repeat the paper's experiments; writes docs/explanation/experiments.md and docs/explanation/figures
	@$(BIN)/engine-mount experiment all --page docs/explanation/experiments.md
	@rm -rf build/drive && $(BIN)/engine-mount drive --core --out build/drive && cp build/drive/drive.png docs/explanation/figures

identify: $(VENV)/.ready ## calibrate and identify on the simulated rack; writes the specimen that is shipped
	@$(BIN)/engine-mount calibrate rack --out $(RACK) --noise 0 --celsius 20 --celsius 80
	@$(BIN)/engine-mount calibrate actuator $(RACK)/force.csv --name default --out $(RACK)/default.yaml
	@$(BIN)/engine-mount calibrate inductance $(RACK)/ripple_*.csv --base $(RACK)/default.yaml --out $(RACK)/default.yaml
	@$(BIN)/engine-mount identify friction --step sawtooth --train $(RACK)/friction_ramp.csv $(RACK)/friction_[46]0N.csv $(RACK)/friction_1?0N.csv --held-out $(RACK)/friction_80N.csv --base $(RACK)/default.yaml --out $(SPECIMEN)

pages: $(VENV)/.ready-dev ## write the pages of docs/reference that come from the code, and what the notebooks show
	@for page in commands_page fleet_columns_page names_page parameters_page signals_page notebooks; do $(BIN)/python test/docs/$$page.py || exit 1; done

bench: $(VENV)/.ready $(VENV)/.ready-desk ## performance figures as ratios, side by side in one run
	@$(BIN)/engine-mount dev bench

lint: $(VENV)/.ready-dev ## style, types
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

format: $(VENV)/.ready-dev ## put the sources in shape
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

setup-core: $(VENV)/.ready-core ## what a desk without ROS needs, as on aarch64: drive --core, replay, audit, report
setup: $(VENV)/.ready ## what `make drive` needs
setup-desk: $(VENV)/.ready-desk ## what the fleet, recordings by URI and files of others need besides; without ROS too
setup-dev: $(VENV)/.ready-dev ## what `make test` needs

clean: ## remove the environment and all that was built
	rm -rf $(VENV) build install log src/*/build src/*/*.egg-info .pytest_cache .mypy_cache .ruff_cache

$(VENV)/.created:
	@test -n '$(PYTHON)' || { echo 'No Python 3.11, 3.12 or 3.13 that can make environments was found; on Debian and Ubuntu: apt-get install python3-venv; or say PYTHON=/path/to/python3'; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { echo 'No environment could be made in $(VENV) with $(PYTHON)'; rm -rf $(VENV); exit 1; }
	@touch $@

$(VENV)/.ready-core: $(VENV)/.created requirements-core.txt $(wildcard src/*/setup.py)
	@echo 'Setting up (once, about two minutes) ...'
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements-core.txt
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --use-pep517 \
		$(foreach package,$(PACKAGES),-e src/$(package))
	@$(BIN)/engine-mount dev prepare
	@touch $@

$(VENV)/.ready: $(VENV)/.ready-core requirements.txt requirements-car.txt
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.txt
	@touch $@

$(VENV)/.ready-desk: $(VENV)/.ready-core requirements-desk.txt
	@echo 'Setting up fleet, stores and formats (once, about half a minute) ...'
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements-desk.txt
	@touch $@

$(VENV)/.ready-dev: $(VENV)/.ready $(VENV)/.ready-desk requirements-dev.txt
	@echo 'Setting up tests and checks (once, about a minute) ...'
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements-dev.txt
	@touch $@
