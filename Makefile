# The commands of the README. Everything is idempotent.
JOBS := $(shell nproc)
PROGRAM := build/release/geocage

.PHONY: run test build bench format lint setup clean

run: build
	$(PROGRAM) run

test: build
	ctest --preset release -j $(JOBS)

build: setup
	@cmake --preset release > build-configure.log 2>&1 || { cat build-configure.log; exit 1; }; rm -f build-configure.log
	cmake --build --preset release -j $(JOBS)

bench: setup
	cmake --preset bench
	cmake --build --preset bench -j $(JOBS)
	build/bench/geocage_bench

format:
	git ls-files '*.cpp' '*.h' | xargs clang-format -i

lint: build
	git ls-files '*.cpp' '*.h' | xargs clang-format --dry-run --Werror
	sh setup/lint.sh

setup:
	@bash setup/install.sh

clean:
	rm -rf build
