# `make study` does the main job, `make test` passes the tests; each sets up what it needs in .venv.

.DEFAULT_GOAL := help
.PHONY: help study test test-slow lint lock data clean firmware firmware-tools firmware-if-possible browser-if-possible protocol-doc bench-docs rigs effect-table control real calibration trial stories bench predictive bench-discovery bench-lock notebooks docs readme-figure package

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
PRESET ?= full
CORES ?= 2
export PYTHON
export MPLBACKEND ?= Agg

help: ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 16

$(READY): requirements.lock pyproject.toml scripts/find-python
	@python=$$(sh scripts/find-python) && echo "setting up $(VENV) with $$python" && "$$python" -m venv --clear $(VENV)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@$(BIN)/python -m compileall -q -j $(CORES) $(VENV)/lib >/dev/null || true
	@touch $@

study: $(READY) ## the whole study of the shipped data: reports/report.html and .pdf (PRESET=quick for a short one)
	@$(BIN)/muscle-bayes study --preset $(PRESET)

test: $(READY) lint firmware-if-possible browser-if-possible ## lint and test, a quarter of an hour on two cores
	@$(BIN)/python -m pytest -n $(CORES) --dist loadfile --no-loadscope-reorder -m "not slow"

test-slow: $(READY) firmware-if-possible ## the long statistical tests
	@$(BIN)/python -m pytest -m slow

lint: $(READY) ## style, types and the direction of imports
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy
	@$(BIN)/lint-imports

firmware: $(READY) firmware-tools ## build the boards' firmware and its simulator (GAINS=gains.h)
	@$(MAKE) --no-print-directory --directory firmware $(if $(GAINS),GAINS=$(abspath $(GAINS)))

firmware-tools: ## install the AVR compiler and simavr with apt where they are missing
	@sh scripts/firmware-tools

browser-if-possible: # opens the report in the tests
	@sh scripts/browser || echo "the test that opens the report in a browser is skipped"

firmware-if-possible:
	@if sh scripts/firmware-tools; then \
	  $(MAKE) --no-print-directory --silent --directory firmware; \
	else echo "tests of the firmware are skipped"; fi

data: $(READY) ## write the shipped synthetic runs anew, byte for byte
	@$(BIN)/muscle-bayes simulate shipped --out data

REAL ?= ../shared/real
real: $(READY) ## fit measured rigs and write docs/real-rigs.md beside published values (REAL=folder)
	@$(BIN)/python scripts/published_rigs.py $(REAL)

CALIBRATION := reports/calibration
calibration: $(READY) ## simulation-based calibration, 200 data sets each (two hours on two cores); writes docs/calibration.md
	@$(BIN)/muscle-bayes fit data/spring-*.csv --out $(CALIBRATION)/fixture.nc
	@$(BIN)/muscle-bayes sbc data/spring-*.csv --out $(CALIBRATION)/fixture
	@$(BIN)/muscle-bayes sbc data/plain/staircase-*.csv --given $(CALIBRATION)/fixture.nc --measured --out $(CALIBRATION)/muscle
	@$(BIN)/python scripts/write_calibration_doc.py $(CALIBRATION)

STUDIED := reports/posteriors
control: $(READY) ## tune and judge gains over `make study`'s posterior, write docs/control-results.md (long)
	@$(BIN)/python scripts/control_results.py $(STUDIED)/revised.nc --heater data/sawtooth.csv
	@$(BIN)/python -m benchmarks.control $(STUDIED)/revised.nc

trial: $(READY) ## hide effects in synthetic runs and count what discovery finds (hours; resumes)
	@$(BIN)/python -m benchmarks.trial
	@$(MAKE) --no-print-directory $(BENCH_READY)
	@$(BIN)/python -m benchmarks.discovery --outcomes reports/trial/outcomes.json
	@$(BIN)/python -m benchmarks.trial.page reports/trial

stories: $(READY) ## the thesis' open questions, and measured rigs, answered by discovery: docs/discovery-*.md (REAL=folder)
	@$(BIN)/python scripts/discovery_stories.py
	@$(BIN)/python scripts/real_discoveries.py $(REAL)

protocol-doc: $(READY) ## write the tables of docs/protocol.md anew
	@$(BIN)/python scripts/write_protocol_doc.py

rigs: $(READY) ## fit twelve kinds of simulated rig and write docs/rigs.md (half an hour)
	@$(BIN)/python -m benchmarks.rig_examples

bench-docs: $(READY) firmware ## try the firmware (half an hour), write docs/bench-trials.md and the wiring tables
	@mkdir -p build
	@$(BIN)/python -m benchmarks.bench_test --failures 400 --overheating 48 --fuzz 0 --stuck 0 --minutes 0 --json build/bench-trials.json
	@$(BIN)/python -m benchmarks.bench_test.page build/bench-trials.json

effect-table: $(READY) ## write docs/effects.md anew, from the catalogue
	@$(BIN)/python scripts/write_effect_table.py

notebooks: $(READY) firmware-if-possible ## run all notebooks, and write them with their figures beside the scripts
	@$(BIN)/python scripts/notebooks.py --out notebooks

docs: $(READY) ## build these pages as a site in build/docs, with what `make notebooks` has run
	@$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going docs build/docs
	@echo "open build/docs/index.html"

readme-figure: $(READY) ## draw the README's figures anew, the discovery from what `make study` found
	@$(BIN)/python scripts/draw_rig.py
	@cp reports/figures/discovery.png docs/figures/discovery.png

package: $(READY) ## build wheel and sdist into dist/
	@$(BIN)/python -m hatchling build

BENCH := .venv-bench
BENCH_READY := $(BENCH)/.ready
$(BENCH_READY): requirements.lock benchmarks/requirements.lock pyproject.toml scripts/find-python
	@python=$$(sh scripts/find-python) && echo "setting up $(BENCH) with $$python" && "$$python" -m venv --clear $(BENCH)
	@$(BENCH)/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock --requirement benchmarks/requirements.lock
	@$(BENCH)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

bench: $(BENCH_READY) ## race gradient and sampler against others, see how cost grows, write docs/benchmarks.md
	@$(BENCH)/bin/python -m benchmarks.gradient
	@$(BENCH)/bin/python -m benchmarks.sampling
	@$(BENCH)/bin/python -m benchmarks.scaling
	@$(BENCH)/bin/python -m benchmarks.table

predictive: $(BENCH_READY) ## run predictive control beside `make control`'s laws, write docs/predictive-control.md (long)
	@$(BENCH)/bin/python -m benchmarks.predictive_control $(STUDIED)/revised.nc --heater data/sawtooth.csv

bench-discovery: $(READY) ## CPU-minutes of discovery, cold and warm (REAL=folder of measured rigs)
	@$(BIN)/python -m benchmarks.discovery shipped=data/plain stories=data $(if $(REAL),drop=$(REAL)/xl330-drop axis=$(REAL)/emps)

bench-lock: ## pin what only the benchmarks need (needs uv)
	uv pip compile --quiet --universal --python-version 3.12 --generate-hashes --no-header --no-emit-index-url --constraint requirements.lock benchmarks/requirements.in --output-file benchmarks/requirements.lock

lock: ## pin every dependency again (needs uv)
	uv pip compile --quiet --universal --python-version 3.12 --generate-hashes --no-header --no-emit-index-url --extra test pyproject.toml --output-file requirements.lock

clean: ## remove the environment and caches
	rm -rf $(VENV) .venv-bench .cache build dist docs/api docs/notebooks docs/commands.md firmware/build
