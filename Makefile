# SPDX-License-Identifier: GPL-3.0-or-later
# One command for each task; the names and habits are those of Blender's own makefile. `make help` lists them.

define HELP_TEXT

Convenience targets: each sets up what it needs (Debian packages through tools/setup.sh), builds, and does its task.

  make              Build the native module and build/blender.
  make build        The same. PRESET=debug|asan|tsan chooses another preset of CMakePresets.json.
  make release, make debug
                    make build PRESET=release, PRESET=debug
  make native       The module alone.

Rendering
  make demo         Render blend_files/cornell_box.blend in Blender: build/demo/cornell_box.png.
                    FILE=path.blend   another file          SAMPLES=n   at most n samples
                    SECONDS=n         for n seconds at most (300; 0: as long as the file's accuracy takes)
  build/blender …   Blender with the add-on enabled; your settings stay untouched. BLENDER=path: another Blender (for
                    Blender's own builds `make package` first: they need the module made for them).

Testing
  make test         Everything: the native module, Debian's Blender (background and window), the package in official
                    Blender 4.5 LTS and 5.0. TESTS=tests/native chooses, PYTEST_ARGS="-k film" goes to pytest.
  make test-quick   The same without the tests marked slow.
  make test-blenders
                    Also official 4.2 LTS, and windows in Debian's 4.3.2 and 5.2.2 (root; about 6 GB under build/roots).
                    BLENDERS_ARGS="--only debian --suites sid" runs a part.
  make asan         The native tests with the address and undefined-behaviour sanitizers.
  make tsan         The native tests with the thread sanitizer.

Figures
  make bench        Every figure that the project promises: build/bench/*.json, *.svg and a table. NAME=foundation: one set;
                    FIGURE=memory: one figure of it.

Shipping
  make package      build/package/afterglow-<version>-linux-x64.zip (extension for official Blender 4.2 LTS to 5.0)
                    and afterglow-legacy-<version>.zip (Debian's 3.4.1).
  make venvs        Official Blenders as Python modules, from PyPI: build/venvs. VERSIONS="4.5 5.0": these alone.

Other
  make format       clang-format (and ruff, where it is installed) over the own sources.
  make clean        Remove what was built; downloads, Blender's venvs and the roots stay. make distclean: them, too.
  make help         This text.

endef
export HELP_TEXT

PRESET ?= release
FILE ?= blend_files/cornell_box.blend
TESTS ?= tests/native tests/blender
PYTEST_ARGS ?=
NAME ?=
FIGURE ?=
SAMPLES ?=
SECONDS ?=

# The distribution's Python is the one that its Blender runs; the first on PATH may be another.
PYTHON ?= $(firstword $(wildcard /usr/bin/python3) python3)
ROOT := $(CURDIR)
BUILD := build/$(PRESET)
PYTEST = AFTERGLOW_PRESET=$(PRESET) $(PYTHON) -m pytest

.DEFAULT_GOAL := build
.PHONY: build debug release native demo test test-quick test-blenders asan tsan bench package venvs format clean distclean help

build: native build/blender

release:
	@$(MAKE) --no-print-directory build PRESET=release

debug:
	@$(MAKE) --no-print-directory build PRESET=debug

native:
	@tools/setup.sh build
	@cmake --preset $(PRESET) -DPython_EXECUTABLE=$(PYTHON) >build/.configure.log 2>&1 || (cat build/.configure.log; exit 1)
	@cmake --build $(BUILD)

native: | build/.keep
build/.keep:
	@mkdir -p build && touch $@

# What stands behind build/blender never changes but for the preset, so it is simply written anew.
.PHONY: build/blender
build/blender: | build/.keep
	@mkdir -p build/scripts/addons
	@ln -sfn ../../../addon/render_afterglow build/scripts/addons/render_afterglow
	@sed -e 's|@ROOT@|$(ROOT)|g' -e 's|@PRESET@|$(PRESET)|g' tools/blender.in >build/blender.new
	@chmod +x build/blender.new && mv build/blender.new build/blender

demo:
	@tools/setup.sh demo
	@$(MAKE) --no-print-directory build
	@$(PYTHON) tools/demo.py "$(FILE)" $(if $(SAMPLES),--samples $(SAMPLES)) $(if $(SECONDS),--seconds $(SECONDS))

test:
	@tools/setup.sh test
	@$(MAKE) --no-print-directory build PRESET=release
	@$(PYTEST) $(PYTEST_ARGS) $(TESTS)

test-quick:
	@tools/setup.sh test
	@$(MAKE) --no-print-directory build PRESET=release
	@$(PYTEST) -m "not slow" $(PYTEST_ARGS) $(TESTS)

test-blenders:
	@tools/setup.sh blenders
	@$(MAKE) --no-print-directory build PRESET=release
	@$(PYTHON) tools/blenders.py $(BLENDERS_ARGS)

asan tsan:
	@tools/setup.sh test
	@$(MAKE) --no-print-directory native PRESET=$@
	@tools/sanitized.sh $@ $(PYTHON) -m pytest -p no:cacheprovider $(PYTEST_ARGS) $(if $(filter command line,$(origin TESTS)),$(TESTS),tests/native)

bench:
	@tools/setup.sh test
	@$(MAKE) --no-print-directory build PRESET=release
	@PYTHONPATH=$(ROOT)/build/release/python $(PYTHON) -m afterglow bench $(NAME) $(FIGURE:%=--figure %) --output build/bench

package:
	@tools/setup.sh package
	@$(PYTHON) tools/package.py

venvs:
	@tools/setup.sh package
	@$(PYTHON) tools/venvs.py $(VERSIONS)

format:
	@tools/setup.sh format
	@git ls-files '*.cpp' '*.h' | xargs -r clang-format -i
	@if command -v ruff >/dev/null; then ruff check --fix .; else echo "ruff is not installed: Python left as it is"; fi

clean:
	rm -rf build/release build/debug build/asan build/tsan build/trixie build/sid build/official build/demo build/scripts build/blender \
		build/blenders build/bench build/package

distclean:
	@if mount | grep -q "$(ROOT)/build/"; then echo "something is mounted below build/: unmount it first"; exit 1; fi
	rm -rf build

help:
	@echo "$$HELP_TEXT"
