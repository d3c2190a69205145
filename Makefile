# make demo   set up what is missing, then run the whole job on an embedded example
# make test   set up what is missing, then lint, type check and test
SHELL := /bin/bash
RUN := tools/in_env

.PHONY: demo test lint setup setup-test clean

demo: setup
	@$(RUN) weld-twin demo --out out

test: lint
	@$(RUN) python -m pytest

lint: setup-test
	@$(RUN) ruff check .
	@$(RUN) ruff format --check .
	@$(RUN) mypy

setup: .venv/ready
setup-test: .venv/ready-test

.venv/ready: pyproject.toml tools/setup
	@tools/setup

.venv/ready-test: .venv/ready
	@tools/setup test bench

clean:
	rm -rf .venv out
