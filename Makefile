# Lull: one non-recursive Makefile. `make help` lists the targets.
#
# Sources are found by folder, so that a new file needs no line here. What a file may include is decided by the -I flags of
# its folder: that is how the dependency arrows of CONTRIBUTING.md are enforced (an illegal include does not compile).
#
#   MODE=release|debug|asan|tsan   objects and results of each mode live apart (release: build/, others: build/MODE/)
#   DESTDIR PREFIX CC CXX CFLAGS LDFLAGS are honoured; CFLAGS and LDFLAGS are appended to the project's own.

MODE    ?= release
PREFIX  ?= /usr/local
DESTDIR ?=
CC      := $(if $(filter default,$(origin CC)),gcc,$(CC))
CXX     := $(if $(filter default,$(origin CXX)),g++,$(CXX))
PKG     := pkg-config

ifeq ($(filter $(MODE),release debug asan tsan),)
$(error MODE=$(MODE): expected release, debug, asan or tsan)
endif

OUT := $(if $(filter release,$(MODE)),build,build/$(MODE))
OBJ := $(OUT)/obj
BIN := $(OUT)/bin
LIB := $(OUT)/lib/lull

# --- flags ---------------------------------------------------------------------------------------------------------------
WARN  := -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wundef -Wvla
WARNC := $(WARN) -Wstrict-prototypes -Wmissing-prototypes
# No -ffast-math ever: it removes NaN checks and, in a shared object, switches the host to flush-to-zero at dlopen.
# -ffp-contract=off: the same bytes whatever the compiler would fuse.
NUM   := -ffp-contract=off -fno-math-errno
OPT_release := -O3 -g
OPT_debug   := -O0 -g3
# With -Werror: `make test` builds everything so, and a warning fails it; what users build does not break with another compiler.
OPT_asan    := -O1 -g1 -Werror -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined
OPT_tsan    := -O1 -g -fsanitize=thread
SAN_asan    := -fsanitize=address,undefined
SAN_tsan    := -fsanitize=thread
COMMON  := $(OPT_$(MODE)) -fPIC -fvisibility=hidden -pthread -MMD -MP $(NUM)
CFLAGS_ALL   = -std=c17 -D_POSIX_C_SOURCE=200809L $(COMMON) $(WARNC) $(CFLAGS)
CXXFLAGS_ALL = -std=c++17 $(COMMON) $(WARN) $(CFLAGS)
LDFLAGS_ALL  = -pthread $(SAN_$(MODE)) $(LDFLAGS)

# --- libraries -----------------------------------------------------------------------------------------------------------
EXR_CFLAGS  := $(shell $(PKG) --cflags OpenEXR 2>/dev/null)
BLAS_CFLAGS := $(shell $(PKG) --cflags openblas 2>/dev/null)
BASE_LIBS := -lcjson -lpng -lz -lm
PT_LIBS  := -lembree3 -lOpenEXRCore-3_1 -lcjson -lpng -lz -ldl -lm
IMAGE_LIBS := -lOpenImageIO -lOpenImageIO_Util -lstdc++# hundreds of libraries: the programs load them when they read an image
# MPI is optional and in a shared object of its own, so that programs run where it is not: MPI= leaves it out.
MPI_PKG := $(firstword $(foreach p,ompi-c mpich,$(shell $(PKG) --exists $(p) 2>/dev/null && echo $(p))))
MPI     ?= $(if $(MPI_PKG),1)
MPI_CFLAGS := $(patsubst -I%,-isystem %,$(if $(MPI_PKG),$(shell $(PKG) --cflags $(MPI_PKG))))
MPI_LIBS   := $(if $(MPI_PKG),$(shell $(PKG) --libs $(MPI_PKG)))
STUDY_LIBS := -lmicrohttpd -lsqlite3
GGN_LIBS := -lopenblas -llapacke -lsvm -lcjson -lpng -lz -ldl -lm

# --- include paths: the dependency arrows --------------------------------------------------------------------------------
API := -Iplugin-api/include
BASE := -Iplugin-api# "base/…", "job/…", "picture/…", "sequence/…" and "denoise/…": what all programs stand on; no part of the ABI
INC_plugin-api         := $(API)
INC_plugin-api_base    := $(BASE)
INC_plugin-api_mpi     := $(BASE) $(MPI_CFLAGS)# the only folder that knows MPI
INC_plugin-api_tools   := $(API) $(BASE)
INC_plugin-api_host    := $(API) $(BASE)
INC_pathtracer         := -Ipathtracer $(BASE) $(EXR_CFLAGS)
INC_pathtracer_host    := $(INC_pathtracer) $(API)# pathtracer/render and pathtracer/app: the only hosts of criteria
INC_ggn                := -Iggn $(BASE) $(BLAS_CFLAGS)
INC_ggn_plugin         := $(INC_ggn) $(API)# ggn/plugin: the only folder of ggn that knows the ABI
INC_tests_pt           := -Itests -Itests/support $(INC_pathtracer_host)
INC_tests_ggn          := -Itests -Itests/support $(INC_ggn_plugin)
INC_tests_base         := -Itests -Itests/support $(BASE)
INC_tests_api          := -Itests -Itests/support $(API)
INC_tests_host         := $(INC_tests_api) $(BASE)# api_host_: the host library from inside

# --- sources -------------------------------------------------------------------------------------------------------------
BASE_SRC    := $(wildcard plugin-api/base/*.c plugin-api/job/*.c plugin-api/picture/*.c plugin-api/sequence/*.c plugin-api/denoise/*.c)
IMAGES_SRC  := plugin-api/picture/oiio.cpp# in a shared object of its own; fuzz targets and benchmarks link it
LOADER_SRC  := $(wildcard plugin-api/src/*.c)
HOST_SRC    := $(wildcard plugin-api/host/*.c)
EXAMPLE_SRC := $(wildcard plugin-api/examples/*.c)
TOOL_SRC    := $(wildcard plugin-api/tools/*.c)
MPI_SRC     := $(wildcard plugin-api/mpi/*.c)
PT_MAIN     := pathtracer/app/main.c
PT_SRC      := $(filter-out $(PT_MAIN),$(wildcard pathtracer/*/*.c))
GGN_SRC     := $(filter-out ggn/plugin/% ggn/study/% ggn/cli/%,$(wildcard ggn/*/*.c))
# What includes nn/real.h itself is compiled for float and, with GGN_DOUBLE, for double.
GGN_TWICE   := $(shell grep -ls '"nn/real.h"' ggn/nn/*.c ggn/model/*.c tests/support/*.c)
GGN_ENTRIES := $(wildcard ggn/plugin/entry_*.c)# one a library of criteria: entry_NAME.c makes NAME.so
GGN_PLUGIN  := $(filter-out $(GGN_ENTRIES),$(wildcard ggn/plugin/*.c ggn/plugin/*/*.c))
STUDY_MAIN  := ggn/study/main.c
STUDY_SRC   := $(filter-out $(STUDY_MAIN),$(wildcard ggn/study/*.c))# the only users of STUDY_LIBS
GGN_CLI     := $(wildcard ggn/cli/*.c)
# Tests name what they test by prefix: pt_ (path tracer), ggn_, api_ (plugin-api), base_ (plugin-api/base, sequence, denoise).
TEST_SRC    := $(wildcard tests/unit/*.c tests/grad/*.c tests/golden/*.c tests/stat/*.c tests/abi/*.c tests/hard/*.c tests/oom/*.c)
# The subset that also runs under ASan+UBSan in `make test`.
SANE_SRC    := $(wildcard tests/unit/*.c tests/abi/*.c tests/oom/*.c)
# Hosts that are not installed are skipped; `make test-hosts` installs them first.
HOST_TEST   := $(wildcard tests/hosts/*.sh)
SCRIPT_TEST := $(wildcard tests/cli/*.sh tests/e2e/*.sh) $(HOST_TEST)
FUZZ_SRC    := $(filter-out tests/fuzz/replay.c,$(wildcard tests/fuzz/*.c))

o = $(addprefix $(OBJ)/,$(addsuffix .o,$(1)) $(addsuffix .double.o,$(filter $(GGN_TWICE),$(1))))
BASE_OBJ    := $(call o,$(BASE_SRC))
# The path tracer is linked with the host library's objects: it starts without a search for the library, wherever it is moved.
PT_CORE_OBJ := $(call o,$(PT_SRC) $(HOST_SRC)) $(BASE_OBJ)
PT_OBJ      := $(PT_CORE_OBJ) $(call o,$(IMAGES_SRC))
LOADER_OBJ  := $(call o,$(LOADER_SRC))
GGN_CORE_OBJ := $(call o,$(GGN_SRC)) $(BASE_OBJ)
GGN_OBJ     := $(GGN_CORE_OBJ) $(call o,$(IMAGES_SRC))
GGN_PLUGIN_OBJ := $(call o,$(GGN_PLUGIN))
STUDY_OBJ   := $(call o,$(STUDY_SRC))

PROGRAMS := $(if $(PT_MAIN),$(BIN)/lull-render) $(if $(GGN_CLI),$(BIN)/ggn) $(BIN)/lull-study $(BIN)/lull-report $(if $(TOOL_SRC),$(BIN)/lull-check)
MPI_MODULE := $(if $(MPI),$(OUT)/lib/lull/modules/lull-mpi.so)# loaded only by processes that a launcher has started
# The host library for renderers (lull/host.h): the file has the major version in its name, programs link the other.
HOST_LIB := $(OUT)/lib/liblull-host.so.1
EXAMPLES := $(BIN)/host-example
DENOISER := $(OUT)/lib/lull/modules/lull-denoiser# a program that denoise/oidn.h runs
MODULES  := $(DENOISER) $(MPI_MODULE) $(OUT)/lib/lull/modules/lull-images.so
CRITERIA := $(EXAMPLE_SRC:plugin-api/examples/%.c=$(LIB)/%.so) $(GGN_ENTRIES:ggn/plugin/entry_%.c=$(LIB)/%.so)
TESTS    := $(patsubst tests/%.c,$(OUT)/tests/%,$(TEST_SRC))
SANE     := $(patsubst tests/%.c,build/asan/tests/%,$(SANE_SRC))
REPLAY   := $(patsubst tests/fuzz/%.c,$(OUT)/fuzz/replay-%,$(FUZZ_SRC))
FUZZERS  := $(patsubst tests/fuzz/%.c,build/fuzz/%,$(FUZZ_SRC))

.DEFAULT_GOAL := all
.PHONY: all demo test bench cost asan tsan fuzz mutants host-model hdr-check abi-check install uninstall deb wheel blender man compdb clean help setup tests test-tools replay train-demo test-study test-hosts test-packages test-clang
.SECONDARY:

all: $(PROGRAMS) $(CRITERIA) $(MODULES) $(HOST_LIB) $(EXAMPLES) ## build the programs and the criteria

# --- compiling: one rule, flags by folder --------------------------------------------------------------------------------
inc = $(or $(strip \
  $(if $(filter plugin-api/%,$(1)),$(if $(filter plugin-api/base/% plugin-api/job/% plugin-api/picture/% plugin-api/sequence/% plugin-api/denoise/%,$(1)),$(INC_plugin-api_base),$(if $(filter plugin-api/tools/% plugin-api/report/%,$(1)),$(INC_plugin-api_tools),$(if $(filter plugin-api/host/%,$(1)),$(INC_plugin-api_host),$(if $(filter plugin-api/mpi/%,$(1)),$(INC_plugin-api_mpi),$(INC_plugin-api)))))) \
  $(if $(filter pathtracer/%,$(1)),$(if $(filter pathtracer/app/% pathtracer/render/%,$(1)),$(INC_pathtracer_host),$(INC_pathtracer))) \
  $(if $(filter ggn/%,$(1)),$(if $(filter ggn/plugin/%,$(1)),$(INC_ggn_plugin),$(INC_ggn))) \
  $(if $(filter tests/%,$(1)),$(if $(filter pt_%,$(notdir $(1))),$(INC_tests_pt),$(if $(filter ggn_%,$(notdir $(1))),$(INC_tests_ggn),$(if $(filter base_%,$(notdir $(1))),$(INC_tests_base),$(if $(filter api_host_%,$(notdir $(1))),$(INC_tests_host),$(INC_tests_api))))))),)
# Kernels for one instruction set carry it in their name (x_avx2.c, x_avx512.c); they are reached by run-time dispatch only.
ifneq ($(filter x86_64%,$(shell $(CC) -dumpmachine)),)
isa = $(if $(filter %_avx2.c,$(1)),-mavx2 -mfma)$(if $(filter %_avx512.c,$(1)),-mavx512f -mavx512vl -mavx512bw -mavx512dq -mfma -mprefer-vector-width=512)$(if $(filter %_avx512bf16.c,$(1)),-mavx512f -mavx512vl -mavx512bw -mavx512dq -mavx512bf16 -mfma)
endif

# Loops that are to become vectors may compute what a branch would have skipped: no flag of the processor is ever read.
speculate = $(if $(filter pathtracer/integ/lanes_%,$(1)),-fno-trapping-math)

$(OBJ)/%.c.o: %.c
	@mkdir -p $(@D)
	@echo "  CC   $<"
	@$(CC) $(CFLAGS_ALL) $(call inc,$<) $(call isa,$<) $(call speculate,$<) -c $< -o $@

$(OBJ)/%.c.double.o: %.c
	@mkdir -p $(@D)
	@echo "  CC   $< (double)"
	@$(CC) $(CFLAGS_ALL) -DGGN_DOUBLE $(call inc,$<) $(call isa,$<) -c $< -o $@

# What it takes in by .incbin no compiler lists.
$(OBJ)/plugin-api/host/page.c.o: plugin-api/host/page.html

$(OBJ)/%.cpp.o: %.cpp
	@mkdir -p $(@D)
	@echo "  CXX  $<"
	@$(CXX) $(CXXFLAGS_ALL) $(call inc,$<) -c $< -o $@

# Programs are linked by the second linker of Debian's binutils in a tenth of the time; it exports _end and others, so no plugin is.
LINKER := $(if $(shell command -v ld.gold),-fuse-ld=gold)
link = @mkdir -p $(@D); echo "  LD   $@"; $(CC) $(LINKER)
so   = @mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--version-script=plugin-api/plugin.map -Wl,-z,defs

$(BIN)/lull-render: $(call o,$(PT_MAIN)) $(PT_CORE_OBJ) $(LOADER_OBJ) | $(OUT)/lib/lull/modules/lull-images.so
	$(link) $^ $(LDFLAGS_ALL) $(PT_LIBS) -o $@
$(BIN)/ggn: $(call o,$(GGN_CLI)) $(GGN_CORE_OBJ) | $(OUT)/lib/lull/modules/lull-images.so
	$(link) $^ $(LDFLAGS_ALL) $(GGN_LIBS) -o $@
# Of the rest of ggn the study takes what it names, and no network is among it.
$(BIN)/lull-study: $(call o,$(STUDY_MAIN)) $(STUDY_OBJ) $(OBJ)/ggn.a | $(OUT)/lib/lull/modules/lull-images.so
	$(link) $^ $(LDFLAGS_ALL) -Wl,--as-needed $(STUDY_LIBS) $(GGN_LIBS) -o $@
# Of what both programs stand on the checker takes what it names.
$(OBJ)/base.a: $(BASE_OBJ)
	@rm -f $@; echo "  AR   $@"; $(AR) rcs $@ $^
$(BIN)/lull-check: $(call o,$(TOOL_SRC)) $(LOADER_OBJ) $(OBJ)/base.a
	$(link) $^ $(LDFLAGS_ALL) -ldl -lm -o $@
$(BIN)/lull-report: $(call o,$(wildcard plugin-api/report/*.c) $(HOST_SRC)) $(LOADER_OBJ) $(OBJ)/base.a | $(OUT)/lib/lull/modules/lull-images.so
	$(link) $^ $(LDFLAGS_ALL) $(BASE_LIBS) -ldl -o $@
$(OUT)/lib/lull/modules/lull-images.so: $(call o,$(IMAGES_SRC)) $(OBJ)/base.a
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--exclude-libs,ALL $^ $(LDFLAGS_ALL) $(IMAGE_LIBS) -lz -lm -o $@
$(DENOISER): $(call o,$(wildcard plugin-api/denoise/program/*.c)) $(OBJ)/base.a
	$(link) $^ $(LDFLAGS_ALL) -ldl -lm -o $@
$(OUT)/lib/lull/modules/lull-mpi.so: $(call o,$(MPI_SRC)) $(OBJ)/base.a
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--exclude-libs,ALL $^ $(LDFLAGS_ALL) $(MPI_LIBS) -lm -o $@
# As the wheel and the Blender extension carry them: for systems that have the C library and zlib, and without symbols. Debian has no
# archives of cJSON and libpng that fit into a shared object, so they lie beside.
BUNDLE := $(OUT)/bundle/lib
CARRIED := denoised fixed ggn halfbuf observer variance
BESIDE := $(BUNDLE)/libcjson.so.1 $(BUNDLE)/libpng16.so.16
BUNDLED := $(BUNDLE)/liblull-host.so.1 $(BESIDE) $(CARRIED:%=$(BUNDLE)/lull/%.so) $(BUNDLE)/lull/lull-3.ggn \
    $(BUNDLE)/lull/modules/lull-denoiser
$(BUNDLE)/liblull-host.so.1: BASE_LIBS += -s -Wl,-rpath,'$$ORIGIN'
$(BUNDLE)/lull/ggn.so: GGN_LIBS += -s -Wl,-rpath,'$$ORIGIN/..'
$(BUNDLE)/lull/ggn.so: $(OBJ)/ggn/plugin/entry_ggn.c.o $(OBJ)/ggn-plugin.a $(OBJ)/ggn.a plugin-api/plugin.map
	$(so) $(filter %.o %.a,$^) $(LDFLAGS_ALL) -Wl,--as-needed $(GGN_LIBS) -o $@
$(BUNDLE)/lull/%.ggn: ggn/models/%.ggn
	@install -D -m 644 $< $@
$(BESIDE): $(BUNDLE)/%:
	@mkdir -p $(@D); strip -o $@ "$$($(CC) -print-file-name=$*)"
$(BUNDLE)/%: $(OUT)/lib/%
	@mkdir -p $(@D); strip -o $@ $<
$(HOST_LIB) $(BUNDLE)/liblull-host.so.1: $(call o,$(HOST_SRC)) $(LOADER_OBJ) $(OBJ)/base.a plugin-api/host.map
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--version-script=plugin-api/host.map -Wl,-z,defs -Wl,-soname,$(@F) \
	    -Wl,--as-needed $(filter %.o %.a,$^) $(LDFLAGS_ALL) $(BASE_LIBS) -ldl -o $@
	@ln -sf $(@F) $(@:.1=)
# As a renderer would build it: the public headers and the library, nothing else.
$(BIN)/host-example: plugin-api/examples/host.cpp $(wildcard plugin-api/include/lull/*.h) | $(HOST_LIB)
	@mkdir -p $(@D); echo "  CXX  $@"; $(CXX) -std=c++11 $(WARN) $(OPT_$(MODE)) $(SAN_$(MODE)) $(CFLAGS) $(API) $< -L$(OUT)/lib \
	    -Wl,-rpath,'$$ORIGIN/../lib' $(LDFLAGS) -llull-host -o $@
# Of the networks the criteria take what they name: no image is read there, and no image library loaded.
$(OBJ)/ggn.a: $(GGN_CORE_OBJ)
	@rm -f $@; echo "  AR   $@"; $(AR) rcs $@ $^
$(OBJ)/ggn-plugin.a: $(GGN_PLUGIN_OBJ)
	@rm -f $@; echo "  AR   $@"; $(AR) rcs $@ $^
# Each with what its criteria name and the libraries that those need: observer.so the mathematical one, ggn.so no BLAS.
$(GGN_ENTRIES:ggn/plugin/entry_%.c=$(LIB)/%.so): $(LIB)/%.so: $(OBJ)/ggn/plugin/entry_%.c.o $(OBJ)/ggn-plugin.a $(OBJ)/ggn.a plugin-api/plugin.map
	$(so) $(filter %.o %.a,$^) $(LDFLAGS_ALL) -Wl,--as-needed $(GGN_LIBS) -o $@
$(LIB)/denoised.so: | $(DENOISER)
$(LIB)/%.so: $(OBJ)/plugin-api/examples/%.c.o plugin-api/plugin.map
	$(so) $(filter %.o,$^) $(LDFLAGS_ALL) -lm -o $@

# --- tests ---------------------------------------------------------------------------------------------------------------
# tests/support/*.c is linked into every test of its prefix (pt_*.c, ggn_*.c; base_*.c into theirs too) or into all (no prefix).
SUPPORT_pt  := $(call o,$(filter-out tests/support/ggn_% tests/support/api_%,$(wildcard tests/support/*.c)))
SUPPORT_ggn := $(call o,$(filter-out tests/support/pt_% tests/support/api_%,$(wildcard tests/support/*.c)))
SUPPORT_api := $(call o,$(filter-out tests/support/pt_% tests/support/ggn_% tests/support/base_% tests/support/api_%,$(wildcard tests/support/*.c)))
SUPPORT_host := $(SUPPORT_api) $(call o,$(wildcard tests/support/api_host_*.c))
SUPPORT_base := $(call o,$(wildcard tests/support/base_*.c) tests/support/open_files.c tests/support/foreign.c)
define test_rules
$(OUT)/tests/$(1)/pt_%: $(OBJ)/tests/$(1)/pt_%.c.o $(PT_CORE_OBJ) $(LOADER_OBJ) $(SUPPORT_pt)
	$$(link) $$^ $$(LDFLAGS_ALL) $(PT_LIBS) -lcmocka -o $$@
$(OUT)/tests/$(1)/ggn_%: $(OBJ)/tests/$(1)/ggn_%.c.o $(GGN_CORE_OBJ) $(SUPPORT_ggn)
	$$(link) $$^ $$(LDFLAGS_ALL) $(GGN_LIBS) -lcmocka -o $$@
$(OUT)/tests/$(1)/ggn_study%: $(OBJ)/tests/$(1)/ggn_study%.c.o $(STUDY_OBJ) $(GGN_CORE_OBJ) $(SUPPORT_ggn)
	$$(link) $$^ $$(LDFLAGS_ALL) $(STUDY_LIBS) $(GGN_LIBS) -lcmocka -o $$@
$(OUT)/tests/$(1)/ggn_plugin%: $(OBJ)/tests/$(1)/ggn_plugin%.c.o $(GGN_PLUGIN_OBJ) $(GGN_CORE_OBJ) $(SUPPORT_ggn)
	$$(link) $$^ $$(LDFLAGS_ALL) $(GGN_LIBS) -lcmocka -o $$@
$(OUT)/tests/$(1)/api_%: $(OBJ)/tests/$(1)/api_%.c.o $(LOADER_OBJ) $(SUPPORT_api)
	$$(link) $$^ $$(LDFLAGS_ALL) -ldl -lm -lcmocka -o $$@
$(OUT)/tests/$(1)/api_host%: $(OBJ)/tests/$(1)/api_host%.c.o $(call o,$(HOST_SRC)) $(LOADER_OBJ) $(OBJ)/base.a $(SUPPORT_host)
	$$(link) $$^ $$(LDFLAGS_ALL) $(BASE_LIBS) -ldl -lcmocka -o $$@
$(OUT)/tests/$(1)/base_%: $(OBJ)/tests/$(1)/base_%.c.o $(BASE_OBJ) $(SUPPORT_base)
	$$(link) $$^ $$(LDFLAGS_ALL) $(BASE_LIBS) -lcmocka -o $$@
endef
$(foreach d,unit grad golden stat abi hard oom,$(eval $(call test_rules,$(d))))
$(OUT)/tests/abi/api_oom: $(OBJ)/plugin-api/tools/alloc_probe.c.o
# They load their modules from where a program's lie.
$(TESTS) $(SANE): | $(OUT)/tests/lib
$(OUT)/tests/lib: | $(MODULES)
	@mkdir -p $(@D); ln -sfn ../lib $@
# A denoiser whose answers are known, in the place of Open Image Denoise.
OIDN_STUB := $(OUT)/tests/oidn-stub/libOpenImageDenoise.so.2
$(OIDN_STUB): $(OBJ)/tests/stub/oidn.c.o
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared $< $(LDFLAGS_ALL) -lm -o $@
$(TESTS) $(SANE): | $(OIDN_STUB)
# Criteria for the tests of the loader and of lull-check, most of them broken on purpose.
ABI_PLUGINS := $(patsubst tests/%.c,$(OUT)/tests/%.so,$(wildcard tests/abi/plugins/*.c))
$(OUT)/tests/abi/plugins/%.so: $(OBJ)/tests/abi/plugins/%.c.o
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared $< $(LDFLAGS_ALL) -lm -o $@
# What scripts compare recorded texts with.
$(OUT)/tests/approve: $(call o,tests/cli/approve.c tests/support/approve.c tests/support/foreign.c)
	$(link) $^ $(LDFLAGS_ALL) -lcmocka -lm -o $@
$(OUT)/tests/processors/embree_isa.so: $(OBJ)/tests/processors/embree_isa.c.o
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared $< $(LDFLAGS_ALL) -ldl -o $@
$(patsubst tests/%.c,$(OUT)/tests/%,$(wildcard tests/abi/api_*.c)): | $(ABI_PLUGINS) $(CRITERIA) $(HOST_LIB)
$(OUT)/fuzz/replay-pt_%: $(OBJ)/tests/fuzz/pt_%.c.o $(OBJ)/tests/fuzz/replay.c.o $(PT_OBJ) $(LOADER_OBJ)
	$(link) $^ $(LDFLAGS_ALL) $(PT_LIBS) $(IMAGE_LIBS) -o $@
$(OUT)/fuzz/replay-ggn_study%: $(OBJ)/tests/fuzz/ggn_study%.c.o $(OBJ)/tests/fuzz/replay.c.o $(STUDY_OBJ) $(GGN_OBJ)
	$(link) $^ $(LDFLAGS_ALL) $(STUDY_LIBS) $(GGN_LIBS) $(IMAGE_LIBS) -o $@
$(OUT)/fuzz/replay-ggn_%: $(OBJ)/tests/fuzz/ggn_%.c.o $(OBJ)/tests/fuzz/replay.c.o $(GGN_OBJ)
	$(link) $^ $(LDFLAGS_ALL) $(GGN_LIBS) $(IMAGE_LIBS) -o $@

# Measuring programs; scripts/lab bench runs them.
BENCHES := $(patsubst tests/bench/%.c,$(OUT)/bench/%,$(wildcard tests/bench/*.c))
$(OUT)/bench/pt_%: $(OBJ)/tests/bench/pt_%.c.o $(PT_OBJ) $(LOADER_OBJ) $(SUPPORT_pt)
	$(link) $^ $(LDFLAGS_ALL) $(PT_LIBS) $(IMAGE_LIBS) -lcmocka -o $@
$(OUT)/bench/ggn_%: $(OBJ)/tests/bench/ggn_%.c.o $(GGN_OBJ) $(SUPPORT_ggn)
	$(link) $^ $(LDFLAGS_ALL) $(GGN_LIBS) $(IMAGE_LIBS) -lcmocka -o $@

setup: ## install the Debian packages that are missing
	@scripts/setup

tests: $(TESTS) test-tools
test-tools: $(ABI_PLUGINS) $(OIDN_STUB) $(OUT)/tests/approve $(OUT)/tests/processors/embree_isa.so # what test scripts need
replay: $(REPLAY)

# `test` builds in sub-makes so that packages installed by setup are seen by pkg-config.
test: setup ## build everything, run every test; closes with "N passed, N failed"
	@$(MAKE) --no-print-directory all tests
	@$(MAKE) --no-print-directory MODE=asan all replay $(SANE)
	@BUILD=build tests/run $(patsubst tests/%.c,build/tests/%,$(TEST_SRC)) $(SCRIPT_TEST) \
	    --processors tests/processors/list \
	    --asan $(SANE) --replay $(patsubst tests/fuzz/%.c,build/asan/fuzz/replay-%,$(FUZZ_SRC))

CLANG_TEST := $(patsubst tests/%.c,build/clang/tests/%,$(filter tests/unit/% tests/golden/% tests/abi/%,$(TEST_SRC)))
test-clang: ## build the product with clang, without a warning, into build/clang, and pass the unit, golden and ABI tests
	@scripts/setup clang
	@$(MAKE) --no-print-directory OUT=build/clang CC=clang CXX=clang++ CFLAGS="$(CFLAGS) -Werror" all $(CLANG_TEST)
	@BUILD=build/clang tests/run $(CLANG_TEST)

test-hosts: setup ## install Blender, Mitsuba and bpy as far as they can be had, and test Lull in them
	@$(MAKE) --no-print-directory all $(ABI_PLUGINS) $(OIDN_STUB)
	@scripts/hosts/setup
	@BUILD=build tests/run $(HOST_TEST)

test-packages: all $(OIDN_STUB) ## make, install, use and remove what people install: make install, Debian packages, wheel, Blender add-on
	@BUILD=build JOBS=1 tests/run $(wildcard tests/packages/*.sh)

asan tsan: ## run the unit and ABI tests under the sanitizer
	@$(MAKE) --no-print-directory MODE=$@ all tests
	@BUILD=build/$@ tests/run --$@ $(patsubst tests/%.c,build/$@/tests/%,$(SANE_SRC)) $(if $(filter tsan,$@),$(wildcard tests/tsan/*.sh))

test-study: setup ## the page of lull-study in Chromium, simulated participants, load; installs what it can, skips the rest with a reason
	@$(MAKE) --no-print-directory $(BIN)/lull-study
	@BUILD=build tests/run $(filter-out %/node.sh,$(wildcard tests/study/*.sh))

FUZZ_SECONDS ?= 60
FUZZ_FLAGS := -g -O1 -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize=vptr -fno-sanitize-recover=undefined
fuzz: ## fuzz each target for FUZZ_SECONDS (default 60) under ASan+UBSan; needs clang
	@$(MAKE) --no-print-directory MODE=asan OUT=build/fuzz-objects CC=clang CXX=clang++ OPT_asan="$(FUZZ_FLAGS)" fuzzers
	@for f in $(FUZZERS); do tests/fuzz/run $$f $(FUZZ_SECONDS) || exit 1; done
.PHONY: fuzzers
fuzzers: $(FUZZERS)
build/fuzz/pt_%: $(OBJ)/tests/fuzz/pt_%.c.o $(PT_OBJ) $(LOADER_OBJ)
	$(link) -fsanitize=fuzzer $^ $(LDFLAGS_ALL) $(PT_LIBS) $(IMAGE_LIBS) -o $@
build/fuzz/ggn_study%: $(OBJ)/tests/fuzz/ggn_study%.c.o $(STUDY_OBJ) $(GGN_OBJ)
	$(link) -fsanitize=fuzzer $^ $(LDFLAGS_ALL) $(STUDY_LIBS) $(GGN_LIBS) $(IMAGE_LIBS) -o $@
build/fuzz/ggn_%: $(OBJ)/tests/fuzz/ggn_%.c.o $(GGN_OBJ)
	$(link) -fsanitize=fuzzer $^ $(LDFLAGS_ALL) $(GGN_LIBS) $(IMAGE_LIBS) -o $@

mutants: ## plant single-line faults and see that the tests notice (hours; resumes)
	@scripts/mutants $(MUTANTS_FLAGS) $(TEST_SRC) $(SCRIPT_TEST)

host-model: $(BIN)/lull-render $(CRITERIA) ## 1,000 runs that are interrupted, killed or out of disk, against a model of what must be there
	@tests/model/host.py $(MODEL_FLAGS)

# Every header compiles alone; the ABI header also as C99 and C++11.
HEADERS := $(shell find pathtracer ggn plugin-api tests -name '*.h' 2>/dev/null)
hdr-check: ## each header compiles alone (the ABI's as C99 and C++11), no include goes up, no long function or line, layout by clang-format 14, …
	@scripts/check-floors
	@$(foreach h,$(HEADERS),echo "extern int unused;" | $(CC) -std=c17 -D_POSIX_C_SOURCE=200809L $(WARNC) -Wno-unused-const-variable $(call inc,$(h)) $(call isa,$(h:.h=.c)) \
	    -include $(h) -x c -fsyntax-only - &&) true
	@$(foreach h,criterion.h criterion_kit.h host.h,$(CC) -std=c99 $(WARNC) $(API) -x c -fsyntax-only plugin-api/include/lull/$(h) &&) true
	@$(foreach h,criterion.h criterion_kit.h host.h,$(CXX) -std=c++11 $(WARN) $(API) -x c++ -fsyntax-only plugin-api/include/lull/$(h) &&) true
	@! clang-format --version 2>/dev/null | grep -q 'version 14' || clang-format --dry-run -Werror $$(git ls-files '*.[ch]' '*.cpp')
abi-check: $(OUT)/tests/abi/api_layout ## the layouts of the ABI and the host library are the frozen ones (plugin-api/*layout-1.txt)
	@$<

# --- running -------------------------------------------------------------------------------------------------------------
demo: setup ## install what is missing, build, render a scene with per-block stopping
	@$(MAKE) --no-print-directory all
	@scripts/demo
bench: all $(BENCHES) ## measure speed as ratios, interleaved, against the peers that are installed; the table in docs/speed.md
	@scripts/lab bench --write
cost: all ## measure what accuracy costs each criterion, from recordings in data/ (docs/cost.md)
	@scripts/lab cost
train-demo: all ## train a tiny model on a tiny bundled data set and show that it learns
	@scripts/train-demo

# FOLDER:MODE:FILE of everything that install puts below PREFIX and uninstall takes away; links stay links.
put = $(foreach f,$(3),$(1):$(2):$(f))
INSTALLED = $(call put,bin,755,$(PROGRAMS)) $(call put,lib/lull,755,$(CRITERIA)) $(call put,lib/lull/modules,755,$(MODULES)) \
    $(call put,lib,755,$(HOST_LIB) $(HOST_LIB:.1=)) $(call put,lib/pkgconfig,644,$(PC_FILES)) \
    $(call put,include/lull,644,$(wildcard plugin-api/include/lull/*.h)) \
    $(call put,share/man/man1,644,$(wildcard docs/man/*.1)) $(call put,share/man/man7,644,$(wildcard docs/man/*.7)) \
    $(call put,share/bash-completion/completions,644,$(wildcard scripts/packages/completions/*)) \
    $(call put,share/lull,644,$(wildcard ggn/models/*.ggn)) $(call put,share/lull/study,644,$(wildcard ggn/study/page/*.*)) \
    $(call put,share/lull/study/vendor,644,$(wildcard ggn/study/page/vendor/*))
OWN_FOLDERS := lib/lull/modules lib/lull include/lull share/lull/study/vendor share/lull/study share/lull
PC_FILES := $(OUT)/lull-criterion.pc $(OUT)/lull-host.pc
.PHONY: $(PC_FILES)
$(PC_FILES): $(OUT)/%.pc: plugin-api/%.pc.in
	@mkdir -p $(@D); sed 's|@PREFIX@|$(PREFIX)|g' $< >$@

install: all $(PC_FILES) ## install under $(DESTDIR)$(PREFIX): programs, criteria, host library, headers, models, man pages, completions
	@for i in $(INSTALLED); do \
	    folder=$(DESTDIR)$(PREFIX)/$${i%%:*} file=$${i##*:} mode=$${i#*:}; \
	    install -d $$folder || exit 1; \
	    if [ -h $$file ]; then cp -P $$file $$folder; else install -m $${mode%%:*} $$file $$folder; fi || exit 1; done
	@echo "  installed $(words $(INSTALLED)) files under $(DESTDIR)$(PREFIX)"
uninstall: ## remove what install put under $(DESTDIR)$(PREFIX)
	@for i in $(INSTALLED); do rm -f $(DESTDIR)$(PREFIX)/$${i%%:*}/$${i##*/} || exit 1; done
	@for f in $(OWN_FOLDERS); do [ ! -d $(DESTDIR)$(PREFIX)/$$f ] || rmdir --ignore-fail-on-non-empty $(DESTDIR)$(PREFIX)/$$f; done

wheel: $(BUNDLED) ## make the Python package with host library, criteria and model in build/wheel
	@scripts/packages/bundle wheel $(BUNDLED)
blender: $(BUNDLED) ## make the add-on for Blender 3.4, which is an extension for 4.2 and later, in build/blender
	@scripts/packages/bundle blender $(BUNDLED)
deb: all ## make the Debian packages lull, liblull-host1 and lull-dev in build/deb (needs debhelper)
	@scripts/packages/deb

man: all ## write docs/man/*.1 from --help and docs/man/*.h2m (needs help2man)
	@docs/man/write

compdb: ## write compile_commands.json
	@{ echo '['; sep=; for f in $(BASE_SRC) $(PT_SRC) $(IMAGES_SRC) $(PT_MAIN) $(GGN_SRC) $(GGN_PLUGIN) $(GGN_ENTRIES) $(STUDY_SRC) $(STUDY_MAIN) $(GGN_CLI) $(HOST_SRC) $(LOADER_SRC) $(EXAMPLE_SRC) $(TOOL_SRC) $(MPI_SRC); do \
	  printf '%s' "$$sep"; $(MAKE) --no-print-directory -s compdb-one F=$$f; sep=,; done; echo ']'; } > compile_commands.json
.PHONY: compdb-one
compdb-one:
	@echo '{"directory":"$(CURDIR)","file":"$(F)","command":"$(if $(filter %.cpp,$(F)),$(CXX) $(CXXFLAGS_ALL),$(CC) $(CFLAGS_ALL)) $(call inc,$(F)) $(call isa,$(F)) -c $(F)"}'

clean: ## remove build/
	rm -rf build compile_commands.json

help: ## this list
	@grep -hE '^[a-z][a-z -]*:.*## ' Makefile | sed -E 's/^([a-z -]+):[^#]*## /\1\t/' | awk -F'\t' '{printf "  %-12s %s\n", $$1, $$2}'

-include $(shell find $(OBJ) -name '*.d' 2>/dev/null)
