# Needs python3 >= 3.11 and nothing else: the first target run makes .venv with the versions of uv.lock.
PYTHON ?= python3
UV_VERSION := 0.13.9
BIN := .venv/bin
STAMP := .venv/.installed

.PHONY: demo test bench lint figures clean

demo: $(STAMP)
	$(BIN)/adwa demo --out out/demo

test: $(STAMP)
	$(BIN)/python -m pytest --numprocesses 2 --dist loadfile --no-loadscope-reorder

# Beside other programs, some of which are installed for it.
bench: $(STAMP)
	UV_PROJECT_ENVIRONMENT=.venv $(BIN)/uv sync --frozen --quiet --group bench
	$(BIN)/python -m tests.benchmarks

lint: $(STAMP)
	$(BIN)/ruff check
	$(BIN)/pyright

# The README's pictures; some of the demo's job, which is run first where it has not been.
figures: $(STAMP)
	$(BIN)/python -m notebooks.draw_pictures

clean:
	rm -rf .venv out dist .pytest_cache .ruff_cache .hypothesis .jax_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(STAMP): pyproject.toml uv.lock
	@$(PYTHON) -c 'import sys; version = sys.version_info[:2]; sys.exit(0 if version >= (3, 11) else \
	"$(PYTHON) is Python %d.%d; 3.11 or newer is needed; try: make PYTHON=python3.11" % version)'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv==$(UV_VERSION)
	UV_PROJECT_ENVIRONMENT=.venv $(BIN)/uv sync --frozen --quiet
	@touch $@
