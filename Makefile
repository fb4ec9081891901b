# Two commands do all set-up: `make demo` (the main job, no root needed) and `make test`.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
# Bump nothing by hand: the stamps follow pyproject.toml.
USER_STAMP := $(VENV)/.installed
TEST_STAMP := $(VENV)/.installed-test
BENCH_STAMP := $(VENV)/.installed-bench
JOBS   ?= 2

.PHONY: demo test lint coverage bench system clean

demo: $(USER_STAMP)
	$(BIN)/softsense simulate linear -o out/demo/linear.csv
	$(BIN)/softsense build out/demo/linear.csv --size 2 -o out/demo/estimator

test: system $(TEST_STAMP)
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile $(PYTEST)

lint: $(TEST_STAMP)
	$(BIN)/ruff check . && $(BIN)/ruff format --check . && $(BIN)/mypy

coverage: system $(TEST_STAMP)
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --cov=softsense --cov=softsense_codegen $(PYTEST)

bench: $(BENCH_STAMP)
	$(BIN)/python tests/benchmarks/run.py

system:
	@sh .ci/system-packages

$(VENV)/bin/python:
	@$(PYTHON) -c 'import ensurepip' 2>/dev/null || sh .ci/system-packages python3-venv
	$(PYTHON) -m venv $(VENV)

$(USER_STAMP): pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --disable-pip-version-check -q -e .
	@touch $@

$(TEST_STAMP): pyproject.toml | $(VENV)/bin/python
	$(BIN)/python -m pip install --disable-pip-version-check -q -e '.[test]'
	@touch $@ $(USER_STAMP)

$(BENCH_STAMP): $(TEST_STAMP)
	$(BIN)/python -m pip install --disable-pip-version-check -q -e '.[bench]'
	@touch $@

clean:
	rm -rf $(VENV) out dist firmware/build
