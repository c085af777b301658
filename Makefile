# One line each; CI calls the same words.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUN := $(VENV)/.run
DEV := $(VENV)/.dev
# Apart from iVeg's own libraries: what judges them is none of them.
AUDIT := $(VENV)/audit
# A module of tests and what it starts stay together; two cores carry two stacks.
WORKERS ?= 2
# A worker that dies ends the run: loadscope would wait for it for ever.
SIDE_BY_SIDE = -n $(WORKERS) --dist loadscope --no-loadscope-reorder --max-worker-restart 0
# What a site and the demo install (run.lock), the image, and all a test can ask for.
LOCK = $(BIN)/uv pip compile --quiet --universal --generate-hashes --no-emit-index-url --no-header pyproject.toml
ALL := postgresql ros2 sso
# No end for a test that takes hours.
FOR_HOURS := -o faulthandler_timeout=0
export PYTHONPATH := $(CURDIR)
# Tests are compiled once, not in each worker of each run.
export PYTHONDONTWRITEBYTECODE :=

.NOTPARALLEL:
.PHONY: test-needs check-needs demo demo-ros2 test quick setup format check bench deep chaos mutants experiment soak migration lock audit sbom clean

demo: $(RUN) ; @exec $(BIN)/python -m iveg demo
demo-ros2: $(DEV) ; @exec $(BIN)/python -m iveg demo --ros2
test: test-needs $(DEV) ; $(BIN)/python -m pytest $(SIDE_BY_SIDE)
quick: $(DEV) ; IVEG_HYPOTHESIS=quick IVEG_STOP_EXAMPLES=20 $(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "not real and not slow"
setup: $(DEV)
format: $(DEV) ; $(BIN)/ruff format . && $(BIN)/ruff check --fix .
check: check-needs $(DEV) node_modules ; $(BIN)/ruff format --check . && $(BIN)/ruff check . && $(BIN)/mypy && $(BIN)/mypy deploy/make-secrets && $(BIN)/lint-imports && npm run --silent check
bench: test-needs $(DEV) ; $(BIN)/python -m benchmarks
deep: $(DEV) ; IVEG_HYPOTHESIS=thorough IVEG_STOP_EXAMPLES=20000 IVEG_LIAR_STEPS=100000 IVEG_OPENAPI_EXAMPLES=1000 $(BIN)/python -m pytest $(FOR_HOURS) -o timeout=3600 tests/properties tests/liar
chaos: test-needs $(DEV) ; IVEG_CHAOS_DISK=on IVEG_CHAOS_RECORDER_KILLS=$(or $(KILLS),50) IVEG_CHAOS_SEED=$(or $(SEED),1) IVEG_CHAOS_KILLS=$(or $(KILLS),200) IVEG_CHAOS_TIMES=$(or $(TIMES),20) $(BIN)/python -m pytest $(FOR_HOURS) tests/chaos/test_kills.py tests/chaos/test_backlog.py tests/chaos/test_network.py tests/chaos/test_ros2_kills.py tests/chaos/test_recording_kills.py tests/chaos/test_disk_full.py
mutants: $(DEV) ; $(BIN)/python -m tests.mutants
experiment: $(RUN) ; @exec $(BIN)/python -m iveg experiment run --$(or $(SIZE),quick)
soak: $(DEV) ; $(BIN)/python -m benchmarks.soak
migration: $(DEV) ; $(BIN)/alembic revision --autogenerate -m "$(m)"
lock: $(DEV) ; $(BIN)/python -m pip install --quiet uv && $(LOCK) -o requirements/run.lock && $(LOCK) $(ALL:%=--extra %) --extra dev -o requirements/dev.lock && $(LOCK) --extra postgresql --extra sso -c requirements/dev.lock -o requirements/image.lock && $(LOCK:pyproject.toml=requirements/audit.in) -o requirements/audit.lock
# Known holes of what a site installs, and of what checks the page.
audit: $(AUDIT) ; $(AUDIT)/bin/pip-audit --disable-pip --require-hashes --requirement requirements/image.lock --strict && npm audit --no-package-lock
sbom: $(AUDIT) ; $(AUDIT)/bin/cyclonedx-py requirements --output-reproducible --output-file sbom.cdx.json requirements/image.lock
clean: ; rm -rf $(VENV) node_modules .mypy_cache .ruff_cache .pytest_cache .hypothesis test-output sbom.cdx.json

# The system's part: installed on Debian, named elsewhere.
test-needs check-needs: ; @PYTHON=$(PYTHON) .ci/setup venv $(@:-needs=)
$(BIN)/python: ; PYTHON=$(PYTHON) .ci/setup venv && $(PYTHON) -m venv $(VENV)
$(RUN): requirements/run.lock | $(BIN)/python ; $(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $< && touch $@
$(DEV): requirements/dev.lock | $(BIN)/python ; $(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $< && touch $@ $(RUN)
$(AUDIT): requirements/audit.lock | $(BIN)/python ; $(PYTHON) -m venv $@ && $@/bin/pip install --quiet --disable-pip-version-check --require-hashes -r $< && touch $@
node_modules: package.json ; npm install --silent --no-audit --no-fund --no-package-lock && touch $@
