# Everything from a fresh checkout: `make run` to have a module, `make test` before a change goes in.
# Needed beforehand: Rust 1.95 or later, Python 3.10 or later with venv, a C and C++ compiler, Node.js 20
# or later with npm.

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help
.NOTPARALLEL:
MAKEFLAGS += --no-builtin-rules

# A rustup installation that the shell does not know yet, and before a distribution's older Rust.
export PATH := $(HOME)/.cargo/bin:$(PATH)

VENV := .venv
PYTHON := $(VENV)/bin/python
# Relative to this folder or absolute, as Cargo itself takes it.
TARGET := $(or $(CARGO_TARGET_DIR),target)
CORE := opentmcl-wire opentmcl-catalog opentmcl-motion opentmcl-firmware
# What `make run` serves, and further options for it: make run ARGS="--tcp 127.0.0.1:4016".
MODULE := tmcm-6214
ARGS :=
# How long each fuzz target runs.
FUZZ_SECONDS := 600

heading = @printf '\n== %s\n' "$(1)"

.PHONY: help
help: ## Show this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: run
run: ## Serve a virtual TMCM-6214 until Ctrl-C
	$(call heading,build)
	cargo build --locked --release -p opentmcl-cli
	$(call heading,serve $(MODULE))
	@exec $(TARGET)/release/tmcl serve $(MODULE) $(ARGS)

.PHONY: test
test: fmt clippy test-rust conform test-python test-editors thumb fuzz-short docs-check ## Run every check
	$(call heading,all checks passed)

.PHONY: fmt
fmt: ## Check the formatting
	$(call heading,format)
	cargo fmt --all --check
	cargo fmt --manifest-path fuzz/Cargo.toml --check

.PHONY: clippy
clippy: ## Run the linter, warnings denied
	$(call heading,clippy)
	cargo clippy --locked --workspace --all-targets -- -D warnings

.PHONY: test-rust
test-rust: ## Run the Rust tests
	$(call heading,Rust tests)
	cargo test --locked --workspace

# Together with the tests: a build for itself would compile half of the dependencies once more, with
# fewer features.
.PHONY: program
program:
	$(call heading,tmcl)
	cargo test --locked --workspace --no-run --quiet

.PHONY: conform
conform: program ## Run the transcripts and count what they cover
	$(call heading,transcripts)
	$(TARGET)/debug/tmcl conform --coverage

.PHONY: test-python
test-python: program venv ## Run the client tests with PyTrinamic, and the motor model beside another
	$(call heading,client tests)
	TMCL=$(TARGET)/debug/tmcl $(PYTHON) -m pytest tests/python

.PHONY: test-editors
test-editors: ## Build and test the extension for Visual Studio Code
	$(call heading,editors)
	@command -v npm >/dev/null || { echo 'error: there is no npm; the editor extension needs Node.js 20 or later' >&2; exit 1; }
	@node -e 'process.exit(Number(parseInt(process.versions.node) < 20))' \
		|| { echo "error: this is Node.js $$(node --version); the editor extension needs 20 or later" >&2; exit 1; }
	cd editors/vscode && npm ci --loglevel=error --no-audit --no-fund && npm run --silent build && npm test --silent

.PHONY: thumb
thumb: ## Build the core for a Cortex-M4F
	$(call heading,core for thumbv7em-none-eabihf)
	tools/thumb-build.sh $(CORE)

.PHONY: fuzz
fuzz: ## Fuzz each target for FUZZ_SECONDS (600), keeping what is found
	$(call heading,fuzz)
	tools/fuzz.sh $(FUZZ_SECONDS)

.PHONY: fuzz-short
fuzz-short: ## Fuzz each target for 10 seconds from the committed seeds
	$(call heading,fuzz)
	tools/fuzz.sh --from-seeds 10

.PHONY: soak
soak: ## Run a hundred thousand random machines and random scenarios
	$(call heading,random machines)
	MACHINES=100000 cargo test --locked --release -p opentmcl-plant --test random machines::
	MACHINES=2000 cargo test --locked --release -p opentmcl-plant --test random steppers::
	$(call heading,random scenarios)
	OPENTMCL_SCENARIOS=100000 cargo test --locked --release -p opentmcl-virtual --test random_scenarios

.PHONY: docs-check
docs-check: program venv ## Check the documentation: API docs, links, and that examples show real output
	$(call heading,documentation)
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --workspace --no-deps --document-private-items --quiet
	python3 tools/check_links.py
	TMCL=$(TARGET)/debug/tmcl python3 tools/check_docs.py --python $(PYTHON)

.PHONY: bench
bench: $(VENV)/installed-bench ## Measure, print a table and write target/bench/summary.json
	$(call heading,build)
	cargo build --locked --release -p opentmcl-cli -p opentmcl-bench
	$(call heading,measure)
	TMCL=$(TARGET)/release/tmcl BENCH=$(TARGET)/release/opentmcl-bench $(PYTHON) bench/run.py

.PHONY: venv
venv: $(VENV)/installed ## Install Python with PyTrinamic and simulators in .venv

$(VENV)/installed: tests/python/requirements.txt tests/python/simulators.txt
	$(call heading,Python environment)
	tools/make-venv.sh $(VENV) $^
	@touch $@

# What only `make bench` needs.
$(VENV)/installed-bench: bench/simulators.txt $(VENV)/installed
	$(call heading,further simulators)
	tools/make-venv.sh $(VENV) $<
	@touch $@

.PHONY: clean
clean: ## Remove everything that was built
	rm -rf $(TARGET) target fuzz/target $(VENV) editors/vscode/node_modules editors/vscode/dist
