# make setup, demo, test, lint, docs; each makes .venv first if it is out of date.
#
# PYTHON=...         interpreter of a new .venv: Python 3.11 or 3.12
# TORCH_OPTIONS=...  for the pip that installs torch. Without any, you get the
#   default build of your platform's index (on Linux: CUDA, which runs without
#   a GPU too). A smaller CPU build: --index-url=URL of torch's CPU wheels, as
#   pytorch.org gives it. The version stays that of constraints.txt.

BIN := .venv/bin
STAMP := .venv/.set-up
LAID_OUT := .venv/laid_out/lfgp_dmc
PYTHON ?= $(shell command -v python3.11 || command -v python3.12 || \
	echo python3)
TORCH_OPTIONS ?=

.PHONY: setup demo test lint docs

setup: $(STAMP)

$(STAMP): pyproject.toml constraints.txt
	@test -x $(BIN)/python || $(PYTHON) -c 'import sys; \
	sys.exit(not (3, 11) <= sys.version_info < (3, 13))' || { \
	echo "error: needs Python 3.11 or 3.12; make setup PYTHON=..." >&2; exit 1; }
	$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install $(TORCH_OPTIONS) -c constraints.txt torch
	$(BIN)/python -m pip install -c constraints.txt -e '.[dev]'
	$(BIN)/python launch/set_up_graphics.py
	touch $@

demo: setup
	$(BIN)/python launch/demo.py --flagfile=launch/flags/quickstart.flags

test: setup
	$(BIN)/python -m pytest -n 2 --dist=worksteal tests

# mypy does not read how pyproject.toml maps folders to import names: it gets a
# folder of links in which they are laid out so.
lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	rm -rf $(LAID_OUT) && mkdir -p $(LAID_OUT)
	ln -s $(CURDIR)/lfgp_dmc/* $(addprefix $(CURDIR)/,agents launch tasks) \
		$(LAID_OUT)
	$(BIN)/mypy

# The API pages: build/docs/index.html. The commands say --help.
API := $(addprefix lfgp_dmc.,acting agents data gymnasium observations pictures \
	runs study task_names tasks types)
docs: setup
	$(BIN)/python -W ignore -m pdoc --docformat google \
		--output-directory build/docs lfgp_dmc $(API)
