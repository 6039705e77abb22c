# Gewebe. `make help` lists the targets.

VERSION := 0.1.0
config ?= release
BUILD := build/$(config)

PREFIX ?= /usr/local
BINDIR ?= $(PREFIX)/bin
LIBDIR ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
MANDIR ?= $(PREFIX)/share/man
# Where shells look for completions; Debian's packages have zsh/vendor-completions.
BASHDIR ?= $(PREFIX)/share/bash-completion/completions
ZSHDIR ?= $(PREFIX)/share/zsh/site-functions
FISHDIR ?= $(PREFIX)/share/fish/vendor_completions.d
INSTALL ?= install

# --- How to compile ---------------------------------------------------------------------------------

flags_release := -O2 -DNDEBUG
flags_debug := -O0 -g
# AddressSanitizer stops at null pointers and behind objects, too; the checks of UBSan left out would be more than half of a
# build. Eigen allocates as it does without AddressSanitizer, for tests' objects are shared.
flags_sanitize := -O1 -g1 -fsanitize=address,undefined -fno-sanitize=null,object-size,vptr,pointer-overflow,alignment -fno-sanitize-recover=all -fno-omit-frame-pointer -DGEWEBE_SANITIZE \
  -DEIGEN_MALLOC_ALREADY_ALIGNED=1
flags_thread := -O1 -g1 -fsanitize=thread -DGEWEBE_SANITIZE
flags_coverage := -O0 -g --coverage
flags_fuzz := -O1 -g1 -fsanitize=address,fuzzer-no-link -fno-omit-frame-pointer -DGEWEBE_SANITIZE
# The units of tests/unit are long and run for moments: most of a build would be their code. They are optimised less and
# compiled once for release and sanitize: the sanitizers watch the library and not the tests' own code (it is linked behind
# the library, so that functions of headers are the library's).
unit_flags_release := -O1 -DNDEBUG
unit_flags_sanitize := $(unit_flags_release)
ifeq ($(flags_$(config)),)
$(error config=$(config) is unknown, expected release, debug, sanitize, thread, coverage or fuzz)
endif

ifeq ($(origin CXX),default)
CXX := $(if $(filter fuzz,$(config)),clang++-16,g++)
endif

WARNINGS := -Wall -Wextra -Wshadow -Wconversion $(if $(WERROR),-Werror)
# g++ takes an std::optional without a value for one that is read uninitialised where a sanitizer instruments it.
WARNINGS += $(if $(filter sanitize thread,$(config)),$(if $(findstring clang,$(CXX)),,-Wno-maybe-uninitialized))
LANGUAGE := -std=c++20 -ffp-contract=off -fPIC
# The libraries' headers stand in /usr/include, where no warning is shown; Eigen's have a folder of their own.
INCLUDES := -Ilib -I. $(addprefix -isystem /usr/include/,eigen3 suitesparse hdf5/serial)
DEFINES := -DGEWEBE_VERSION='"$(VERSION)"'
OPTIMIZE := $(flags_$(config))
# Objects of tests/unit.
UNIT_BUILD := $(if $(unit_flags_$(config)),build/tests,$(BUILD))
ALLFLAGS = $(LANGUAGE) $(OPTIMIZE) $(WARNINGS) $(INCLUDES) $(DEFINES) $(CPPFLAGS) $(CXXFLAGS)
# Where there is ccache, one machine compiles the same text with the same flags once; CCACHE= turns that off.
CCACHE ?= $(shell command -v ccache)
ifneq ($(CCACHE),)
export CCACHE_SLOPPINESS ?= pch_defines,time_macros
endif
# Programs take from these only what they use (--as-needed; tests/contract/install.sh looks with ldd).
LIBS := -lopenvdb -ltbb -lImath -lassimp -lcholmod -lhdf5_serial -lepoxy -lpng -lz -lxxhash -lgmp -lmpfr
BENCH_LIBS := -lembree3 -lblas
LINK = $(CXX) $(flags_$(config)) $(LDFLAGS) -o $@ $(filter %.o %.a,$^) -Wl,--as-needed

# --- What there is ----------------------------------------------------------------------------------

LIB_SRC := $(wildcard lib/*/*.cpp formats/*/*.cpp)
# Each file of tools/ is a program; what they share or need beside their main stands in folders.
SHARED_SRC := $(wildcard tools/*/*.cpp)
TOOL_SRC := $(wildcard tools/*.cpp)
UNIT_SRC := $(wildcard tests/unit/*.cpp)
# The files of the tests that ThreadSanitizer runs, tests/sanitize/threads.
ifeq ($(config),thread)
UNIT_SRC := tests/unit/mesh_fixtures.cpp $(patsubst %,tests/unit/test_%.cpp,base column_sum corotational csg cut_stiffness \
  density elastodynamic elastostatic frontal_factor hyperelastic marching_cubes mesh_instruments mixed_meetings render_raster \
  scene_clients shared_shapes simulation simulation_cut_solid simulation_solid simulation_tear_solid \
  snap_collapse solid_assembly solid_motion store volume_file voxelize warped_statics)
endif
STRESS_SRC := $(wildcard tests/stress/*.cpp)
FUZZ_SRC := $(wildcard tests/fuzz/fuzz_*.cpp)
BENCH_SRC := $(wildcard tests/bench/*.cpp)
VALIDATE_SRC := $(wildcard tests/validate/*.cpp)
# What others may include.
PUBLIC := $(shell sed 's/\#.*//' lib/PUBLIC)
MAN := $(wildcard man/*.[1-9])
STRESS_SCRIPTS := tests/stress/kill
STRESS_PYTHON := tests/stress/frames
SCRIPTS := .ci/run .ci/sanitize tests/run tests/bare tests/golden/run $(STRESS_SCRIPTS) \
  $(filter-out scripts/words%,$(wildcard scripts/* tests/contract/* tests/golden/in/*.sh))

TOOLS := $(TOOL_SRC:tools/%.cpp=$(BUILD)/%)
UNIT := $(if $(UNIT_SRC),$(BUILD)/unit)
STRESS := $(STRESS_SRC:tests/stress/%.cpp=$(BUILD)/stress_%)
FUZZ := $(FUZZ_SRC:tests/fuzz/%.cpp=$(BUILD)/%)
BENCH := $(BENCH_SRC:tests/bench/%.cpp=$(BUILD)/bench_%)
VALIDATE := $(if $(VALIDATE_SRC),$(BUILD)/validate)
ARCHIVE := $(BUILD)/libgewebe.a
SHARED := $(BUILD)/obj/tools/shared.a
# What reads volumes, for a program that seldom does: loaded when one comes (formats/volume/volume_plugin.h).
PLUGIN := $(BUILD)/gewebe-volume.so
PLUGINDIR = $(patsubst %/,%,$(dir $(BINDIR)))/lib/gewebe

# Unity units: files of a room are compiled in groups, so that headers are read once (scripts/unity). UNITY=no compiles
# each file by itself; a build folder that has such objects goes on with them unless UNITY=yes is given.
# Files with flags of their own are in no group, nor those that would bring libraries to programs that need others of them.
UNITY ?= $(if $(filter-out $(BUILD)/obj/lib/base/lib-base-%,$(wildcard $(BUILD)/obj/lib/base/*.o)),no,yes)
SINGLE := %_avx2.cpp %_avx512.cpp %_baseline.cpp %_cgal.cpp lib/antialiasing/coverage_exact.cpp tests/unit/mesh_fixtures.cpp
GROUPED := $(filter-out $(SINGLE) tools/cli/% tools/model/% tools/volume/% lib/volume/% formats/volume/%,$(LIB_SRC) $(SHARED_SRC) $(UNIT_SRC))
ifneq ($(UNITY),no)
ifneq ($(filter-out clean deps help html lint uninstall,$(or $(MAKECMDGOALS),all)),)
UNITS := $(shell scripts/unity '$(BUILD)/unity' 2000 $(filter-out tests/%,$(GROUPED))) \
  $(shell scripts/unity '$(UNIT_BUILD)/unity' 2000 $(filter tests/%,$(GROUPED)))
endif
endif
# Objects of source files: of the groups that hold them, or their own.
obj = $(patsubst $(BUILD)/obj/tests/unit/%,$(UNIT_BUILD)/obj/tests/unit/%,\
  $(patsubst %.cpp,$(BUILD)/obj/%.o,$(if $(UNITS),$(filter-out $(GROUPED),$(1)),$(1))) \
  $(patsubst %,$(BUILD)/obj/%.o,$(filter $(addsuffix /%,$(sort $(patsubst %/,%,$(dir $(filter $(GROUPED),$(1)))))),$(UNITS))))
# The commit that programs tell; its own unit, so that another one compiles nothing else and links programs alone.
COMMIT := $(BUILD)/obj/commit.o
OBJECTS := $(call obj,$(LIB_SRC) $(SHARED_SRC) $(TOOL_SRC) $(UNIT_SRC) $(STRESS_SRC) $(FUZZ_SRC) $(BENCH_SRC) $(VALIDATE_SRC) tests/fuzz/replay.cpp)

# --- Packages ---------------------------------------------------------------------------------------

# Goals that install what they need; plain `make` is none of them.
sets_deps := build check
sets_check := build check
sets_golden-update := build check
sets_stress := build check
sets_demo := build
sets_bench := build bench
sets_validate := build
sets_report := build $(if $(QUICK),,bench)
sets_lint := build check lint
sets_deb := build deb
sets_wheel := build wheel
SETS ?= $(sort $(foreach goal,$(MAKECMDGOALS),$(sets_$(goal))) $(if $(filter fuzz,$(config)),fuzz))
ifneq ($(filter check golden-update stress demo bench validate report lint deb wheel,$(MAKECMDGOALS)),)
ifneq ($(DEPS),no)
FIRST := deps
endif
endif

# --- Rules ------------------------------------------------------------------------------------------

ifeq ($(config),fuzz)
all: $(FUZZ)
else
all: $(TOOLS) $(ARCHIVE) $(PLUGIN)
endif

deps:
	@scripts/deps $(SETS)

# Kernels for one instruction set each, chosen at run time; -O3 is for their loops, and nobody reads errno or the flags of
# floating-point exceptions, which would keep square roots and choices out of them.
kernel = $(if $(filter release,$(config)),-O3) -fno-math-errno -fno-trapping-math
$(BUILD)/obj/%_avx2.o: FILE_FLAGS := -mavx2 -mfma $(kernel)
$(BUILD)/obj/%_avx512.o: FILE_FLAGS := -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma $(kernel)
$(BUILD)/obj/lib/antialiasing/coverage_exact.o: FILE_FLAGS := $(kernel)
# Eight lanes on four, or on two: their vectors cross no call that is not inlined.
$(BUILD)/obj/lib/raster/raster_kernel_%.o: FILE_FLAGS += -Wno-psabi
$(BUILD)/obj/lib/raster/raster_kernel_baseline.o: FILE_FLAGS := -Wno-psabi $(kernel)
# CGAL's interval arithmetic changes the rounding mode. More than -O1 takes twice as long to compile.
$(BUILD)/obj/%_cgal.o: FILE_FLAGS := -frounding-math $(if $(filter release,$(config)),-O1)
$(UNIT_BUILD)/obj/tests/unit/%_cgal.o: FILE_FLAGS := -frounding-math
# Instances for five types of voxels.
$(UNIT_BUILD)/obj/tests/unit/test_volume_file_openvdb.o: FILE_FLAGS := -O0

# Hold the commands, so that other flags compile everything again.
COMMAND := $(CXX) $(ALLFLAGS) $(LDFLAGS)
$(BUILD)/flags: FORCE | $(FIRST)
	@mkdir -p $(@D)
	@printf '%s\n' '$(subst ','\'',$(COMMAND))' | cmp -s - $@ || printf '%s\n' '$(subst ','\'',$(COMMAND))' > $@
ifneq ($(UNIT_BUILD),$(BUILD))
$(UNIT_BUILD)/flags: OPTIMIZE := $(unit_flags_$(config))
$(UNIT_BUILD)/flags: FORCE | $(FIRST)
	@mkdir -p $(@D)
	@printf '%s\n' '$(subst ','\'',$(CXX) $(ALLFLAGS))' | cmp -s - $@ || printf '%s\n' '$(subst ','\'',$(CXX) $(ALLFLAGS))' > $@
endif

# Headers of the language that most units read (of 3 s for a unit, 2 s were spent in them), compiled once for each kind
# of unit; what a unit includes it still says itself, as `make lint` sees, which does without. Units with flags of their
# own do too.
ifneq ($(filter g++%,$(notdir $(firstword $(CXX)))),)
PRECOMPILED_lib := algorithm array bit charconv cmath cstddef cstdint cstring functional limits map memory numeric \
  optional span string string_view tuple utility variant vector
PRECOMPILED_unit := $(PRECOMPILED_lib) filesystem fstream iostream numbers random set sstream gtest/gtest.h
# g++ 12 forgets that precompiled headers are the system's and shows its false alarms within std::string.
precompiled = $(if $(FILE_FLAGS),,-include $(PRECOMPILED)/$(KIND).h \
  $(addprefix -Wno-,array-bounds restrict stringop-overflow stringop-overread))
endif
KIND := lib
PRECOMPILED := $(BUILD)/precompiled
$(UNIT_BUILD)/obj/tests/unit/%.o: KIND := unit
$(UNIT_BUILD)/obj/tests/unit/%.o: PRECOMPILED := $(UNIT_BUILD)/precompiled
ifneq ($(unit_flags_$(config)),)
$(UNIT_BUILD)/obj/tests/unit/%.o $(UNIT_BUILD)/precompiled/unit.h.gch: OPTIMIZE := $(unit_flags_$(config))
endif

# A class of one .cpp may have members of its anonymous namespace; within a unity unit g++ takes the .cpp for a header.
UNITY_FLAGS := $(if $(filter g++%,$(notdir $(firstword $(CXX)))),-Wno-subobject-linkage)

define precompiled_header
@mkdir -p $(@D)
@printf '#include <%s>\n' $(PRECOMPILED_$*) > $@.new && { cmp -s $@.new $@ && rm $@.new || mv $@.new $@; }
endef
$(BUILD)/precompiled/lib.h: $(BUILD)/precompiled/%.h: Makefile
	$(precompiled_header)
$(UNIT_BUILD)/precompiled/unit.h: $(UNIT_BUILD)/precompiled/%.h: Makefile
	$(precompiled_header)
$(BUILD)/precompiled/lib.h.gch: $(BUILD)/flags
$(UNIT_BUILD)/precompiled/unit.h.gch: $(UNIT_BUILD)/flags
build/%.h.gch: build/%.h | $(FIRST)
	$(CCACHE) $(CXX) $(ALLFLAGS) -x c++-header $< -o $@
.PRECIOUS: $(BUILD)/precompiled/lib.h $(UNIT_BUILD)/precompiled/unit.h build/%.h.gch

lib_first := $(BUILD)/flags $(if $(PRECOMPILED_lib),$(BUILD)/precompiled/lib.h.gch)
unit_first := $(UNIT_BUILD)/flags $(if $(PRECOMPILED_lib),$(UNIT_BUILD)/precompiled/unit.h.gch)
$(UNIT_BUILD)/obj/tests/unit/%.o: $(UNIT_BUILD)/unity/tests/unit/%.cpp $(unit_first) | $(FIRST)
	$(compile)
$(BUILD)/obj/%.o: $(BUILD)/unity/%.cpp $(lib_first) | $(FIRST)
	$(compile)
$(UNIT_BUILD)/obj/tests/unit/%.o: tests/unit/%.cpp $(unit_first) | $(FIRST)
	$(compile)
$(BUILD)/obj/%.o: %.cpp $(lib_first) | $(FIRST)
	$(compile)
define compile
@mkdir -p $(@D)
$(CCACHE) $(CXX) $(ALLFLAGS) $(FILE_FLAGS) $(precompiled) $(if $(filter $(BUILD)/unity/% $(UNIT_BUILD)/unity/%,$<),$(UNITY_FLAGS)) -MMD -MP -c $< -o $@
endef

# The viewer of pages and the Makefile of `gewebe --makefile`, as strings of C++.
VIEWER := $(BUILD)/obj/viewer.o
$(BUILD)/viewer.cpp: formats/page/viewer.html formats/page/viewer.js Makefile
	@mkdir -p $(@D)
	@{ for kind in html js; do printf 'extern "C" const char gewebe_viewer_%s[] = R"viewer(' $$kind && cat formats/page/viewer.$$kind && \
	  printf ')viewer";\n' || exit 1; done; } > $@
STANDARD := $(BUILD)/obj/standard.o
$(BUILD)/standard.cpp: tools/standard.mk Makefile
	@mkdir -p $(@D)
	@{ printf 'extern "C" const char gewebe_standard_makefile[] = R"makefile(' && cat tools/standard.mk && printf ')makefile";\n'; } > $@
$(VIEWER) $(STANDARD): $(BUILD)/obj/%.o: $(BUILD)/%.cpp | $(FIRST)
	@mkdir -p $(@D)
	$(CXX) -fPIC -c $< -o $@

$(ARCHIVE): $(call obj,$(LIB_SRC)) $(VIEWER)
$(SHARED): $(call obj,$(SHARED_SRC))
$(BUILD)/gewebe: $(STANDARD)
$(ARCHIVE) $(SHARED):
	@mkdir -p $(@D) && rm -f $@
	$(AR) rcsD $@ $^

$(BUILD)/commit.cpp: FORCE
	@mkdir -p $(@D)
	@printf 'extern "C" const char gewebe_commit[] = "%s";\n' "$$(scripts/commit)" | cmp -s - $@ || \
	  printf 'extern "C" const char gewebe_commit[] = "%s";\n' "$$(scripts/commit)" > $@
$(COMMIT): $(BUILD)/commit.cpp | $(FIRST)
	@mkdir -p $(@D)
	$(CXX) -fPIC -c $< -o $@

$(TOOLS): $(BUILD)/%: $(BUILD)/obj/tools/%.o $(COMMIT) $(SHARED) $(ARCHIVE)
	$(LINK) $(LIBS)

$(PLUGIN): $(ARCHIVE)
	$(CXX) $(flags_$(config)) $(LDFLAGS) -shared -o $@ -Wl,-u,gewebe_view_volume $^ -Wl,--as-needed $(LIBS)

$(BUILD)/unit: $(call obj,$(UNIT_SRC)) $(SHARED) $(ARCHIVE) | $(PLUGIN)
	$(CXX) $(flags_$(config)) $(LDFLAGS) -o $@ -Wl,--whole-archive $(ARCHIVE) -Wl,--no-whole-archive $(filter %.o,$^) $(SHARED) \
	  -Wl,--as-needed $(LIBS) -lgtest_main -lgtest

$(STRESS): $(BUILD)/stress_%: $(BUILD)/obj/tests/stress/%.o $(call obj,tests/unit/mesh_fixtures.cpp) $(SHARED) $(ARCHIVE)
	$(LINK) $(LIBS)

# Its second object comes behind the archive, which is read again.
$(BUILD)/bench_contact_error: LIBS := $(ARCHIVE) $(LIBS)
$(BUILD)/bench_contact_error: $(call obj,tests/validate/pressed_body.cpp)
$(BENCH): $(BUILD)/bench_%: $(BUILD)/obj/tests/bench/%.o $(call obj,tests/unit/mesh_fixtures.cpp) $(SHARED) $(ARCHIVE)
	$(LINK) $(LIBS) $(BENCH_LIBS)

$(BUILD)/validate: $(call obj,$(VALIDATE_SRC) tests/unit/mesh_fixtures.cpp) $(SHARED) $(ARCHIVE)
	$(LINK) $(LIBS)

# libFuzzer brings its own main; elsewhere replay.cpp runs the files of the corpus.
ifeq ($(config),fuzz)
$(FUZZ): $(BUILD)/%: $(BUILD)/obj/tests/fuzz/%.o $(SHARED) $(ARCHIVE)
	$(LINK) -fsanitize=fuzzer $(LIBS)
else
$(FUZZ): $(BUILD)/%: $(BUILD)/obj/tests/fuzz/%.o $(BUILD)/obj/tests/fuzz/replay.o $(SHARED) $(ARCHIVE)
	$(LINK) $(LIBS)
endif

# What shells complete command lines by, from what the programs declare.
COMPLETIONS := $(BUILD)/completions/gewebe $(BUILD)/completions/_gewebe $(TOOLS:$(BUILD)/%=$(BUILD)/completions/%.fish)
completed = @mkdir -p $(@D) && scripts/completions $(1) $(BUILD) $(2) > $@
$(COMPLETIONS): $(TOOLS) scripts/completions
$(BUILD)/completions/gewebe:
	$(call completed,bash,$(notdir $(TOOLS)))
$(BUILD)/completions/_gewebe:
	$(call completed,zsh,$(notdir $(TOOLS)))
$(BUILD)/completions/%.fish: $(TOOLS) scripts/completions
	$(call completed,fish,$*)

-include $(OBJECTS:.o=.d)

# --- Tests ------------------------------------------------------------------------------------------

# T=NAME runs the tests of that name (or pattern) alone; SET=fast unit tests, bad input and fuzz corpora.
# config=thread: unit tests alone.
check: $(UNIT) $(if $(filter thread,$(config)),,$(TOOLS) $(ARCHIVE) $(PLUGIN) $(FUZZ)) | $(FIRST)
	@CXX='$(CXX)' MAKE='$(MAKE_COMMAND)' tests/run --config '$(config)' $(if $(SET),--set '$(SET)') $(if $(T),--test '$(T)')
ifeq ($(config),coverage)
	@scripts/coverage $(BUILD)
endif

golden-update: $(TOOLS) $(PLUGIN) | $(FIRST)
	@tests/golden/run update --config '$(config)' $(if $(T),--test '$(T)')

stress: $(STRESS) $(TOOLS) | $(FIRST)
	@test -n '$(STRESS)' || { echo 'stress: tests/stress has no programs yet' >&2; exit 1; }
	@for program in $(STRESS) $(STRESS_SCRIPTS) $(STRESS_PYTHON); do echo "$$program"; \
	  PATH='$(abspath $(BUILD))':"$$PATH" $$program || exit 1; done

# Each program writes CSV, which ends with the machine and the versions of what took part; gnuplot, where there is one, draws it.
bench: $(BENCH) $(TOOLS) | $(FIRST)
	@test -n '$(BENCH)' || { echo 'bench: tests/bench has no programs yet' >&2; exit 1; }
	@for program in $(BENCH); do { $$program && python3 tests/report/machine.py '$(BUILD)'; } > $$program.csv.part && mv $$program.csv.part $$program.csv && \
	  cat $$program.csv && scripts/plot $$program.csv || exit 1; done

# PAGE says where the page goes: examples/validate holds one. S=WORD makes the section of that name alone.
# S=textbook runs textbook scenes of contact instead, by the programs alone: QUICK=1 a minute's worth of them, ONLY=NAME one scene.
validate: PAGE ?= $(BUILD)/validation
ifeq ($(S),textbook)
validate: $(TOOLS) $(PLUGIN) | $(FIRST)
	@python3 tests/validate/textbook.py --build '$(BUILD)' --page '$(PAGE)/textbook' $(if $(QUICK),--quick) $(if $(ONLY),--only '$(ONLY)') -j $(or $(JOBS),1)
else ifeq ($(S),accuracy)
validate: $(TOOLS) $(PLUGIN) | $(FIRST)
	@PATH='$(abspath $(BUILD))':"$$PATH" python3 tests/validate/accuracy.py --data '$(or $(GEWEBE_SHARED),../shared)/data' $(if $(ONLY),--only '$(ONLY)')
else
validate: $(VALIDATE) | $(FIRST)
	@$(VALIDATE) '$(PAGE)' $(S)
endif

# What report FZKA 7190 claims, measured here: a page a claim in the folder REPORT.
# PAGE=NAME makes that page alone, QUICK=1 small ones without benchmarks; BEFORE=FOLDER has another commit's programs,
# which one page compares with these.
REPORT ?= $(BUILD)/report
REPORT_BENCH := antialias break_even contact_error csg density ela factor geometry latency render solid_motion_peers stiffness stuffing_cgal \
  surface_quality_cgal voxelize work_error
report: $(TOOLS) $(PLUGIN) $(if $(QUICK),,$(REPORT_BENCH:%=$(BUILD)/bench_%) $(VALIDATE)) | $(FIRST)
	@python3 tests/report/report.py '$(REPORT)' --build '$(BUILD)' $(if $(PAGE),--page '$(PAGE)') $(if $(QUICK),--quick)

# The example's own Makefile is a user's: it finds the programs in the PATH.
demo: $(TOOLS) | $(FIRST)
	@PATH='$(abspath $(BUILD))':"$$PATH" $(MAKE) --no-print-directory -C examples/myoma

# The manual as linked pages.
html:
	@scripts/html '$(BUILD)/html' && scripts/html --check '$(BUILD)/html'
	@echo 'The manual is $(abspath $(BUILD))/html/index.html'

# Debian packages of the last commit; NOCHECK= runs the quick tests within, too.
NOCHECK ?= nocheck
deb: | $(FIRST)
	@DEB_BUILD_OPTIONS='$(NOCHECK) noautodbgsym' scripts/deb '$(BUILD)/deb'

# A wheel for Python: programs with the libraries that they load, and the module; tried in an environment of its own.
wheel: $(TOOLS) $(PLUGIN) | $(FIRST)
	@test '$(config)' = release || { echo 'wheel: for config=release' >&2; exit 1; }
	@scripts/wheel '$(BUILD)' '$(BUILD)/wheel'
	@GEWEBE_WHEEL="$$(echo '$(abspath $(BUILD))'/wheel/gewebe-*.whl)" tests/run --config '$(config)' --test 'wheel/*'

# --- Lint: one stamp a file, so that only what changed is looked at again ------------------------------

LINT := build/lint
LINT_CXX := $(wildcard lib/*/*.cpp formats/*/*.cpp tools/*.cpp tools/*/*.cpp tests/*/*.cpp)
LINT_HEADERS := $(wildcard lib/*/*.h formats/*/*.h tools/*/*.h tests/*/*.h)
# clang-tidy reads groups of files, as the compiler does: most of its time goes to headers. TIDY='lib tools' looks at these
# folders alone, COMMITS=40 at what the last 40 commits changed (of a header, at the .cpp beside it; what else reads it, all of
# lint sees).
TIDY ?= lib formats tools tests
TIDY_CXX := $(filter $(TIDY:%=%/%),$(LINT_CXX))
ifneq ($(COMMITS),)
TIDY_CXX := $(filter $(patsubst %.h,%.cpp,$(shell scripts/changed-files $(COMMITS) || printf '%s\n' $(LINT_CXX))),$(TIDY_CXX))
endif
TIDY_ALONE := $(filter $(SINGLE) lib/volume/% formats/volume/% $(filter-out tools/run/%,$(wildcard tools/*/*.cpp)) $(wildcard tools/*.cpp) \
  $(patsubst %,tests/%/%,bench fuzz stress validate),$(TIDY_CXX))
ifneq ($(filter lint,$(MAKECMDGOALS)),)
TIDY_UNITS := $(shell scripts/unity '$(LINT)/unity' 8000 $(filter-out $(TIDY_ALONE),$(TIDY_CXX)))
endif
TIDY_STAMPS := $(TIDY_ALONE:%=$(LINT)/%.tidy) $(TIDY_UNITS:%=$(LINT)/unity/%.tidy)
MAN_STAMPS := $(MAN:%=$(LINT)/%.mandoc)
SHELL_STAMPS := $(SCRIPTS:%=$(LINT)/%.shellcheck)

FORMAT_STAMP := $(LINT)/format
INCLUDES_STAMP := $(LINT)/includes
NAMES_STAMP := $(LINT)/names
WORDS_STAMP := $(LINT)/words

lint: $(FORMAT_STAMP) $(INCLUDES_STAMP) $(NAMES_STAMP) $(WORDS_STAMP) $(MAN_STAMPS) $(SHELL_STAMPS) $(TIDY_STAMPS)

$(NAMES_STAMP): $(LINT_CXX) $(LINT_HEADERS) scripts/check-names | $(FIRST)
	@mkdir -p $(@D)
	@echo 'check-names'
	@scripts/check-names $(filter-out $(addprefix tests/,bench/% stress/% fuzz/% validate/%),$(LINT_CXX) $(LINT_HEADERS)) \
	  --alone $(filter $(addprefix tests/,bench/% stress/% fuzz/%),$(LINT_CXX) $(LINT_HEADERS))
	@scripts/check-names $(filter-out tests/%,$(LINT_CXX) $(LINT_HEADERS)) $(filter tests/validate/%,$(LINT_CXX) $(LINT_HEADERS)) && touch $@

$(WORDS_STAMP): $(filter lib/% formats/% tools/%,$(LINT_CXX) $(LINT_HEADERS)) $(MAN) $(wildcard *.md examples/*/README.md) $(wildcard scripts/words*) scripts/check-words | $(FIRST)
	@mkdir -p $(@D)
	@scripts/check-words && touch $@

# Of those that changed.
$(FORMAT_STAMP): $(LINT_CXX) $(LINT_HEADERS) | $(FIRST)
	@mkdir -p $(@D)
	@echo 'clang-format'
	@clang-format-16 --dry-run -Werror $? && touch $@

$(INCLUDES_STAMP): $(LINT_CXX) $(LINT_HEADERS) scripts/check-includes scripts/check-nan lib/PUBLIC | $(FIRST)
	@mkdir -p $(@D)
	@echo 'check-includes, check-nan'
	@scripts/check-includes $(LINT_CXX) $(LINT_HEADERS) && scripts/check-nan $(LINT_CXX) $(LINT_HEADERS) && touch $@

$(MAN_STAMPS): $(LINT)/%.mandoc: % | $(FIRST)
	@mkdir -p $(@D)
	@echo 'mandoc $<'
	@mandoc -Tlint -W warning $< && touch $@

$(SHELL_STAMPS): $(LINT)/%.shellcheck: % | $(FIRST)
	@mkdir -p $(@D)
	@echo 'shellcheck $<'
	@shellcheck -x $< && touch $@

# Writes beside the stamp which of our files the file reads, so that their change counts too. (What passed in another
# clone with the same text is known to scripts/tidy.) `make build/lint/lib/base/parallel.cpp.tidy` looks at one file.
TIDY_FLAGS = $(LANGUAGE) $(WARNINGS) $(INCLUDES) $(DEFINES) $(CPPFLAGS) $(FILE_FLAGS)
$(LINT)/%_avx2.cpp.tidy: FILE_FLAGS := -mavx2 -mfma
$(LINT)/%_avx512.cpp.tidy: FILE_FLAGS := -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma
$(LINT)/unity/%.tidy: $(LINT)/unity/%.cpp .clang-tidy scripts/tidy | $(FIRST)
	@scripts/tidy $< $@.d $(TIDY_FLAGS) && touch $@
$(LINT)/%.tidy: % .clang-tidy scripts/tidy | $(FIRST)
	@mkdir -p $(@D)
	@scripts/tidy $< $@.d $(TIDY_FLAGS) && touch $@
-include $(TIDY_STAMPS:=.d)

# --- Installation -------------------------------------------------------------------------------------

to = $(DESTDIR)$(1)
PC := $(call to,$(LIBDIR))/pkgconfig/gewebe.pc
install: all $(COMPLETIONS)
	@test '$(config)' != fuzz || { echo 'install: config=fuzz has no programs' >&2; exit 1; }
	$(INSTALL) -d '$(call to,$(BINDIR))' '$(call to,$(LIBDIR))/pkgconfig'
	$(if $(TOOLS),$(INSTALL) $(TOOLS) '$(call to,$(BINDIR))')
	$(INSTALL) -D -m 644 $(PLUGIN) '$(call to,$(PLUGINDIR))/$(notdir $(PLUGIN))'
	$(INSTALL) -m 644 $(ARCHIVE) '$(call to,$(LIBDIR))'
	$(foreach h,$(PUBLIC),$(INSTALL) -D -m 644 $(firstword $(wildcard lib/$h $h) $h) '$(call to,$(INCLUDEDIR))/gewebe/$h' &&) true
	$(foreach m,$(MAN),$(INSTALL) -D -m 644 $m '$(call to,$(MANDIR))/man$(subst .,,$(suffix $m))/$(notdir $m)' &&) true
	$(INSTALL) -D -m 644 $(BUILD)/completions/gewebe '$(call to,$(BASHDIR))/gewebe'
	$(foreach t,$(filter-out gewebe,$(notdir $(TOOLS))),ln -sf gewebe '$(call to,$(BASHDIR))/$t' &&) true
	$(INSTALL) -D -m 644 $(BUILD)/completions/_gewebe '$(call to,$(ZSHDIR))/_gewebe'
	$(INSTALL) -d '$(call to,$(FISHDIR))'
	$(INSTALL) -m 644 $(filter %.fish,$(COMPLETIONS)) '$(call to,$(FISHDIR))'
	sed -e 's|@VERSION@|$(VERSION)|' -e 's|@LIBS@|$(LIBS)|' -e 's|@PREFIX@|$(PREFIX)|' \
	  -e 's|@LIBDIR@|$(LIBDIR:$(PREFIX)/%=$${prefix}/%)|' -e 's|@INCLUDEDIR@|$(INCLUDEDIR:$(PREFIX)/%=$${prefix}/%)|' \
	  gewebe.pc.in > '$(PC)'
	chmod 644 '$(PC)'

# Takes back what install laid down, then its folders as far as they are empty; a system's own stay.
ours := $(sort $(dir $(PUBLIC)))
system_dir := $(filter /usr /usr/local,$(DESTDIR)$(PREFIX))
uninstall:
	rm -f $(foreach t,$(TOOLS),'$(call to,$(BINDIR))/$(notdir $t)') '$(call to,$(LIBDIR))/libgewebe.a' '$(PC)'
	rm -f '$(call to,$(PLUGINDIR))/$(notdir $(PLUGIN))'
	rm -f $(foreach h,$(PUBLIC),'$(call to,$(INCLUDEDIR))/gewebe/$h')
	rm -f $(foreach m,$(MAN),'$(call to,$(MANDIR))/man$(subst .,,$(suffix $m))/$(notdir $m)')
	rm -f $(foreach t,$(notdir $(TOOLS)),'$(call to,$(BASHDIR))/$t' '$(call to,$(FISHDIR))/$t.fish') '$(call to,$(ZSHDIR))/_gewebe'
	@for folder in $(foreach d,$(ours),'$(call to,$(INCLUDEDIR))/gewebe/$d') \
	  '$(call to,$(INCLUDEDIR))/gewebe/formats' '$(call to,$(INCLUDEDIR))/gewebe' \
	  '$(call to,$(PLUGINDIR))' '$(call to,$(LIBDIR))/pkgconfig' $(foreach s,1 5 7,'$(call to,$(MANDIR))/man$s'); do \
	  rmdir "$$folder" 2>/dev/null || true; done
ifeq ($(system_dir),)
	@for folder in '$(BINDIR)' '$(LIBDIR)' '$(INCLUDEDIR)' '$(MANDIR)' '$(BASHDIR)' '$(ZSHDIR)' '$(FISHDIR)'; do \
	  while test "$$folder" != / && test "$$folder" != . && rmdir '$(DESTDIR)'"$$folder" 2>/dev/null; do \
	    folder=$$(dirname "$$folder"); done; done
endif

clean:
	rm -rf build

help:
	@echo 'make [config=release|debug|sanitize|thread|coverage|fuzz] [TARGET…]'
	@echo
	@echo '  all            programs and libgewebe.a in build/CONFIG (the default; config=fuzz: the fuzz targets)'
	@echo '  deps           install the packages that are missing (SETS="build check lint bench fuzz ci" says which)'
	@echo '  demo           examples/myoma: from particles to the pictures of a pulled organ'
	@echo '  check          run the tests; T=NAME only that one, SET=fast unit tests, bad input, fuzz corpora'
	@echo '  golden-update  write tests/golden/expected anew and say what changed (T=NAME only that case)'
	@echo '  stress         run the programs of tests/stress'
	@echo '  bench          measure time against error'
	@echo '  validate       judge the finite elements by theory, benchmarks, peers, an experiment; PAGE=FOLDER for the page, S=textbook scenes of contact, S=accuracy organs pressed'
	@echo '  report         what report FZKA 7190 claims beside what is measured here; REPORT=FOLDER for the pages, PAGE=NAME, QUICK=1, BEFORE=FOLDER'
	@echo '  html           the manual as linked pages in build/CONFIG/html, by mandoc'
	@echo '  deb            packages for Debian 12 of the last commit in build/CONFIG/deb, seen by lintian'
	@echo '  wheel          for Python, in build/CONFIG/wheel: programs with their libraries and the module gewebe, tried in a venv'
	@echo '  lint           clang-format, clang-tidy, mandoc, shellcheck, direction of includes'
	@echo '  install        into PREFIX (/usr/local) under DESTDIR: programs, man pages, completions, library, headers, gewebe.pc'
	@echo '  uninstall      the reverse'
	@echo '  clean          remove build/'
	@echo
	@echo 'demo, check, golden-update, stress, bench, validate, report, deb, wheel and lint install their packages first; DEPS=no turns that off.'
	@echo 'WERROR=1 makes warnings errors. CXX=clang++-16 works too. UNITY=no compiles each file by itself: slower in all, quicker'
	@echo 'after a change of one file.'

FORCE:

.DELETE_ON_ERROR:
.PHONY: all deps check golden-update stress bench validate report demo html deb wheel lint install uninstall clean help FORCE
