# make demo   set up what is missing, then run the whole job on an embedded example
# make test   set up what is missing, then lint, type check and test
# make docs   set up what is missing, then build the documentation in build/site; warnings are errors
SHELL := /bin/bash
RUN := tools/in_env

.PHONY: demo test docs lint setup setup-test setup-docs clean

demo: setup
	@$(RUN) weld-twin demo --out out

# Types are checked beside the tests. Two lines of tests of nodes wait most of their time, so that there are
# two processes more than cores: `conftest.py` counts them.
test: setup-test
	@$(RUN) ruff check .
	@$(RUN) ruff format --check .
	@mkdir -p build
	@nice $(RUN) mypy > build/types.txt 2>&1 & types=$$!; \
	$(RUN) python -m pytest -n auto --dist loadscope --no-loadscope-reorder; tests=$$?; \
	wait $$types; types=$$?; cat build/types.txt; exit $$((tests | types))
	@tools/browser why

docs: setup-docs
	@$(RUN) python -m sphinx -q -W --keep-going -c docs . build/site
	@echo 'open build/site/index.html'

lint: setup-test
	@$(RUN) ruff check .
	@$(RUN) ruff format --check .
	@$(RUN) mypy

setup: .venv/ready
setup-test: .venv/ready-test
setup-docs: .venv/ready-docs

.venv/ready: pyproject.toml tools/setup tools/lock.txt
	@tools/setup

.venv/ready-test: .venv/ready
	@tools/setup test bench
	@tools/browser

.venv/ready-docs: .venv/ready
	@tools/setup docs

clean:
	rm -rf .venv out build
