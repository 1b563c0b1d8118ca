# Every target works on a fresh machine: the first one that needs it makes the virtual environment.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
BASE   := $(VENV)/.base
TESTS  := $(VENV)/.tests
LARGE  := $(VENV)/.large
PAGES  := $(VENV)/.docs

CORE   := $(VENV)/.core
ZIG    := $(VENV)/.zig
NODE   := node_modules/.ready
WASM   := build/wasm/core.wasm
DEMO   := build/web/try.js

# Tests and the commands that they start keep compiled modules, also where the environment turns that off.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: demo figma test test-slow test-portable lint lint-page lint-types docs generated bench gallery wheels release wasm clean

# The environment grows as it is needed: iccm itself with its figures, what its tests need, and the large libraries of some extras.
$(BASE): pyproject.toml setup.py
	$(PYTHON) -m venv --without-pip $(VENV)
	@$(BIN)/python packaging/install.py
	touch $@

$(TESTS): $(BASE)
	@$(BIN)/python packaging/install.py dev
	touch $@

$(LARGE): $(TESTS)
	@$(BIN)/python packaging/install.py large
	touch $@

# The compiled core, brought up to date with its sources; without a compiler the installation brings one and compiles.
$(CORE): $(BASE) $(shell find core -name '*.cpp' -o -name '*.h' -o -name '*.py')
	@echo "Bringing the compiled core up to date ..."
	@$(BIN)/python core/compile.py >/dev/null 2>&1 || \
	    $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	touch $@

demo: $(CORE)
	@echo "Running the samples; each line names the picture that it wrote:"
	@$(BIN)/python samples/run.py
	@echo "Next: source $(VENV)/bin/activate, then iccm map --help"

# Several tests at a time, and one thread for linear algebra in each, so that they don't fight.
test: $(CORE) $(TESTS)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -m "not slow" -n auto --maxprocesses 4

# The module for WebAssembly is among them, which ziglang compiles, and the tests of extras with large libraries, which
# `make test` skips.
test-slow: $(CORE) $(LARGE) $(ZIG)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -m "slow or large" -n auto --maxprocesses 4

# The fast tests as on Windows, as far as it can be imitated, folder by folder: half an hour. `--system macos` imitates
# macOS.
test-portable: $(CORE) $(TESTS)
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.portable

lint: $(TESTS) lint-page lint-types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# mypy must see the package as it is installed, not the folders of the repository: stage it.
lint-types: $(TESTS)
	rm -rf build/typecheck && mkdir -p build/typecheck
	cp -R iccm build/typecheck/iccm && cp -R cli extensions io build/typecheck/iccm
	cd build/typecheck && ../../$(BIN)/mypy --config-file ../../pyproject.toml --cache-dir ../mypy-cache -p iccm

# The page of `iccm edit`, by eslint and by TypeScript, which checks the types that its comments give. Its unit tests
# are among those of pytest.
lint-page:
	@if command -v npm >/dev/null; then $(MAKE) --no-print-directory $(NODE) && npm run --silent lint && npm run --silent types; \
	else echo "JAVASCRIPT IS NOT CHECKED: install Node.js with npm"; fi

$(NODE): package.json package-lock.json
	npm ci --silent --no-audit --no-fund
	touch $@

$(PAGES): $(TESTS)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	touch $@

# The site, into build/site: broken links and warnings fail, nothing is fetched.
docs: $(PAGES) $(DEMO)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@$(BIN)/python docs/links.py build/site

# What is written from the code and committed: man pages, lists, and the record of what is public.
generated: $(CORE) $(TESTS)
	$(BIN)/python docs/man.py
	$(BIN)/python docs/lists.py
	$(BIN)/python docs/modules.py
	$(BIN)/python -m tests.public_surface --record

bench: $(CORE) $(LARGE)
	$(BIN)/python -m tests.bench

gallery: $(CORE) $(LARGE)
	$(BIN)/python -m tests.bench.gallery

# The wheels of all platforms, into dist, with the compiler that the package ziglang brings.
wheels: $(ZIG)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check build auditwheel
	$(BIN)/python core/wheels.py dist

# All that a release publishes, into dist: the wheels, of which those for Linux are audited, and the sources. Pushing the
# tag of the version makes and publishes the same (.github/workflows/release.yml).
release: wheels
	$(BIN)/python -m build --sdist --outdir dist
	@for wheel in dist/*manylinux*.whl; do \
	    $(BIN)/auditwheel show "$$wheel" | tr '\n' ' ' | grep -o 'platform tag: *"manylinux_2_17[^"]*"' || { echo "$$wheel needs a newer system than its tag says" >&2; exit 1; }; \
	done

# The core for browsers and other hosts of WebAssembly, into build/wasm.
wasm: $(WASM)

$(WASM): $(ZIG) $(shell find core -name '*.cpp' -o -name '*.h' -o -name 'compile.py')
	$(BIN)/python core/compile.py --target wasm32-wasi $(@D)
	@touch $@

# The demo of the site, one script with the core inside.
$(DEMO): $(WASM) $(shell find web io/edit/page -type f) $(wildcard docs/files/*)
	@command -v npm >/dev/null || { echo "the demo of the site needs Node.js with npm: install it" >&2; exit 1; }
	@$(MAKE) --no-print-directory $(NODE)
	npm run --silent try

# The window of the plug-in for Figma, which contains the demo.
figma: $(DEMO)
	cp build/web/figma.html plugins/figma/ui.html

$(ZIG): $(BASE)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check 'ziglang>=0.15'
	touch $@

clean:
	rm -rf $(VENV) node_modules build dist iccm/native/lib out *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
