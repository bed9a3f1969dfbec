# Sparing's commands. Everything but `setup` is plain cargo; see CONTRIBUTING.md.

# A toolchain that rustup has just installed is not in every shell's path yet.
export PATH := $(PATH):$(HOME)/.cargo/bin
CARGO ?= cargo
.DEFAULT_GOAL := help
.PHONY: help setup build demo test bench valgrind references docs clean

help: ## list these targets
	@echo "Sparing: a production path tracer. Targets:"
	@sed -n 's/^\([a-z]*\):[^#]*## \(.*\)/  make \1|\2/p' Makefile | \
		while IFS='|' read -r target text; do printf '%-18s %s\n' "$$target" "$$text"; done

setup: ## install what is missing: Embree 4, libclang, OpenEXR, libSVM's tools (needs root or sudo)
	@scripts/setup.sh

build: setup ## build target/release/sparing
	@$(CARGO) build --release

demo: build ## render scenes/demo.pbrt to out/ and say what it took (some minutes)
	@scripts/demo.sh

# Counts what the integrator runs; the test `needs` proves with it what scenes do not pay for.
COUNTERS = sparing-render/counters

# Cheap steps first. The build and the tests share one profile, so nothing is compiled twice.
test: setup ## format, lints, documentation, all tests, benches and examples
	@echo "== format"
	@$(CARGO) fmt --all --check
	@echo "== lints"
	@$(CARGO) clippy --workspace --all-targets --features $(COUNTERS) -- -D warnings
	@echo "== documentation"
	@RUSTDOCFLAGS="-D warnings" $(CARGO) doc --workspace --no-deps
	@echo "== build of tests, benches and examples"
	@$(CARGO) build --workspace --all-targets
	@echo "== tests"
	@$(CARGO) test --workspace --quiet
	@echo "== tests with counters"
	@$(CARGO) test --workspace --quiet --features $(COUNTERS) --test needs
	@echo "== all passed"

bench: setup ## run all benchmarks
	@$(CARGO) bench --workspace --bench '*'

valgrind: setup ## run the tests of the wrappers of C libraries under memcheck (needs valgrind)
	@scripts/valgrind.sh

references: setup ## render the reference pictures of the tests again (long; look at them before you commit)
	@SPARING_WRITE_REFERENCES=1 $(CARGO) test --test integration references -- --nocapture

docs: setup ## build the documentation of all crates
	@$(CARGO) doc --workspace --no-deps
	@echo "open $(CURDIR)/target/doc/sparing/index.html"

clean: ## remove target/ and out/; Embree in .deps/ stays
	@$(CARGO) clean
	@rm -rf out
