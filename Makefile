# make demo   set up what is missing, then run the whole job on an embedded example
# make test   set up what is missing, then lint, type check and test
SHELL := /bin/bash
READY := .venv/ready
RUN := tools/in_env

.PHONY: demo test lint setup clean

demo: $(READY)
	@$(RUN) weld-twin demo --out out

test: lint
	@$(RUN) python -m pytest

lint: $(READY)
	@$(RUN) ruff check src test
	@$(RUN) mypy

setup: $(READY)

$(READY): pyproject.toml tools/setup
	@tools/setup

clean:
	rm -rf .venv out
