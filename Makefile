# The commands of the README. Everything is idempotent.
JOBS := $(shell nproc)
PROGRAM := build/release/geocage

.PHONY: run test build configured bench format lint docs api setup clean

run: build
	$(PROGRAM) run

test: configured
	cmake --build --preset release -j $(JOBS)
	ctest --preset release -j $(JOBS)

build: configured
	cmake --build --preset release -j $(JOBS) --target geocage

configured: setup
	@cmake --preset release > build-configure.log 2>&1 || { cat build-configure.log; exit 1; }; rm -f build-configure.log

bench: setup
	cmake --preset bench
	cmake --build --preset bench -j $(JOBS)
	build/bench/geocage_bench

format:
	git ls-files '*.cpp' '*.h' | xargs clang-format -i

lint: configured
	git ls-files '*.cpp' '*.h' | xargs clang-format --dry-run --Werror
	sh setup/lint.sh

docs: build
	python3 docs/parameter_tables.py $(PROGRAM)

api: setup
	mkdir -p build
	doxygen docs/Doxyfile

setup:
	@bash setup/install.sh

clean:
	rm -rf build
