# Two commands for newcomers: `make run` and `make test`. Needs only Python >= 3.11 and a package registry.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
LOWEST := .venv-lowest
OUT ?= results/upsetting
# What is never imported need not be compiled: half of the time that installing takes.
INSTALL := -m pip install --quiet --no-compile --disable-pip-version-check

# The matrices are small: one thread each is fastest, and timings are then comparable.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export MPLBACKEND := Agg
# Many tests start processes of their own: what these import is compiled once, even where the environment says otherwise.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: run test suite lint types bench docs check-long test-lowest clean

run: $(VENV)/.run
	$(BIN)/python -m studies.upsetting --mu 0.1 0.3 --beside --overwrite --out $(OUT)
	$(BIN)/python -m paper_figs.fig1_mesh --results $(OUT)
	$(BIN)/python -m paper_figs.fig2_velocity --results $(OUT)
	$(BIN)/python -m paper_figs.fig_force_stroke --results $(OUT)
	$(BIN)/python -m paper_figs.fig_traction --results $(OUT)
	@echo "results: $(OUT)  figures: $(OUT)/figures"

# Types are checked beside the tests, on one core; tests that measure time run after both, alone.
test: lint
	$(MAKE) --no-print-directory -j 2 types suite
	$(BIN)/python -m pytest -m "serial and not slow" $$(grep -l mark.serial tests/test_*.py)

suite: $(VENV)/.dev
	$(BIN)/python -m pytest -n 2 --dist loadfile -m "not serial and not slow"

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(VENV)/.dev
	$(BIN)/pyright --pythonpath $(BIN)/python

bench: $(VENV)/.dev
	$(BIN)/python -m benchmarks.speed

# Every example of the gallery is run; a warning, a broken link or a name that does not exist is an error.
docs: $(VENV)/.docs
	$(BIN)/sphinx-build -W --keep-going -q docs docs/_build/html
	@echo "documentation: docs/_build/html/index.html"

# What `make test` leaves out: long cases, Dask's cluster, the sdist, kills and full disks, the site; one line a test as it ends.
check-long: $(VENV)/.dev
	$(BIN)/python -m pytest -v --durations=10 -m slow
	$(BIN)/python -m studies.faults --fast --overwrite --out results/faults
	$(MAKE) --no-print-directory docs

# The suite with the oldest versions that pyproject.toml allows, in an environment of its own.
test-lowest: $(LOWEST)/.dev
	$(LOWEST)/bin/python -m pytest -n 2 --dist loadfile -m "not serial and not slow"

$(LOWEST)/.dev: pyproject.toml .ci/lowest.py
	$(PYTHON) -m venv --clear $(LOWEST)
	$(PYTHON) .ci/lowest.py > $(LOWEST)/lowest.txt
	$(LOWEST)/bin/python $(INSTALL) -c $(LOWEST)/lowest.txt -e ".[dev,docs]"
	touch $@

$(VENV)/bin/python:
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'bipot needs Python >= 3.11')"
	$(PYTHON) -m venv $(VENV)

$(VENV)/.run: $(VENV)/bin/python pyproject.toml
	$(BIN)/python $(INSTALL) -e ".[studies]"
	touch $@

$(VENV)/.docs: $(VENV)/bin/python pyproject.toml
	$(BIN)/python $(INSTALL) -e ".[docs]"
	touch $@ $(VENV)/.run

$(VENV)/.dev: $(VENV)/bin/python pyproject.toml
	$(BIN)/python $(INSTALL) -e ".[dev,docs]"
	touch $@ $(VENV)/.docs $(VENV)/.run

clean:
	rm -rf $(VENV) $(LOWEST) results docs/_build docs/gallery docs/reference .pytest_cache .ruff_cache .hypothesis .benchmarks
