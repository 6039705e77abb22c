# Gewebe. `make help` lists the targets.
config ?= release
BUILD := build/$(config)
CXX ?= g++
AR ?= ar

flags_release := -O2 -DNDEBUG
flags_debug := -O0 -g
flags_sanitize := -O1 -g1 -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer -DGEWEBE_SANITIZE
flags_coverage := -O0 -g --coverage
WARNINGS := -Wall -Wextra -Wshadow -Wconversion
CXXSTD := -std=c++20 -ffp-contract=off -fPIC
CPPFLAGS_ALL := -Ilib -I. -DGEWEBE_VERSION='"$(VERSION)"' -MMD -MP
VERSION := 0.1.0
SYSTEM := -isystem /usr/include/eigen3
ALLFLAGS = $(CXXSTD) $(flags_$(config)) $(WARNINGS) $(CPPFLAGS_ALL) $(SYSTEM) $(CPPFLAGS) $(CXXFLAGS)
LIBS := -lopenvdb -ltbb -lImath -lassimp -lxxhash

LIB_SRC := $(wildcard lib/*/*.cpp formats/*.cpp)
TOOL_SRC := $(filter-out tools/cli.cpp tools/report.cpp,$(wildcard tools/*.cpp))
TOOLS := $(TOOL_SRC:tools/%.cpp=%)
UNIT_SRC := $(wildcard tests/unit/*.cpp)
obj = $(patsubst %.cpp,$(BUILD)/obj/%.o,$(1))

all: $(TOOLS:%=$(BUILD)/%)

$(BUILD)/obj/%_avx2.o: FLAGS_FILE := -mavx2 -mfma -O3
$(BUILD)/obj/%_avx512.o: FLAGS_FILE := -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma -O3
$(BUILD)/obj/%_cgal.o: FLAGS_FILE := -frounding-math

$(BUILD)/obj/%.o: %.cpp
	@mkdir -p $(@D)
	$(CXX) $(ALLFLAGS) $(FLAGS_FILE) -c $< -o $@

$(BUILD)/libgewebe.a: $(call obj,$(LIB_SRC))
	@rm -f $@
	$(AR) rcsD $@ $^

$(TOOLS:%=$(BUILD)/%): $(BUILD)/%: $(BUILD)/obj/tools/%.o $(BUILD)/obj/tools/cli.o $(BUILD)/obj/tools/report.o $(BUILD)/libgewebe.a
	$(CXX) $(flags_$(config)) $(LDFLAGS) -o $@ $^ -Wl,--as-needed $(LIBS)

$(BUILD)/unit: $(call obj,$(UNIT_SRC)) $(BUILD)/libgewebe.a
	$(CXX) $(flags_$(config)) $(LDFLAGS) -o $@ $^ -Wl,--as-needed $(LIBS) -lgtest -lgtest_main -lgmp -lmpfr

-include $(shell find $(BUILD)/obj -name '*.d' 2>/dev/null)

.PHONY: all
