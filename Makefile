# Lull: one non-recursive Makefile. `make help` lists the targets.
#
# Sources are found by folder, so that a new file needs no line here. What a file may include is decided by the -I flags of
# its folder: that is how the dependency arrows of CONTRIBUTING.md are enforced (an illegal include does not compile).
#
#   MODE=release|debug|asan|tsan   objects and results of each mode live apart (release: build/, others: build/MODE/)
#   DESTDIR PREFIX LIBDIR          where `make install` puts things; LIBDIR (lib) is a folder below PREFIX or a whole path
#   CC CXX AR, CPPFLAGS CFLAGS CXXFLAGS LDFLAGS   are honoured; flags come after our own, CXXFLAGS are CFLAGS if not given
#   EMBREE=3|4                     of both, if both are installed

MODE    ?= release
PREFIX  ?= /usr/local
LIBDIR  ?= lib
DESTDIR ?=
CC      := $(if $(filter default,$(origin CC)),gcc,$(CC))
CXX     := $(if $(filter default,$(origin CXX)),g++,$(CXX))
AR      := $(if $(filter default,$(origin AR)),$(if $(filter gcc%,$(CC)),gcc-ar,ar),$(AR))# gcc-ar knows objects of -flto
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
# With -Werror: `make test` builds everything so, and a warning fails it; what users build does not break with another
# compiler.
OPT_asan    := -O1 -g1 -Werror -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=undefined
OPT_tsan    := -O1 -g -fsanitize=thread
SAN_asan    := -fsanitize=address,undefined
SAN_tsan    := -fsanitize=thread
COMMON  := $(OPT_$(MODE)) -fPIC -fvisibility=hidden -pthread -MMD -MP $(NUM)
CXXFLAGS     ?= $(CFLAGS)
CFLAGS_ALL   = -std=c17 -D_POSIX_C_SOURCE=200809L $(COMMON) $(WARNC) $(CPPFLAGS) $(CFLAGS)
CXXFLAGS_ALL = -std=c++17 $(COMMON) $(WARN) $(CPPFLAGS) $(CXXFLAGS)
LDFLAGS_ALL  = -pthread $(SAN_$(MODE)) $(LDFLAGS)

# --- libraries -----------------------------------------------------------------------------------------------------------
EXR_CFLAGS  := $(shell $(PKG) --cflags OpenEXR 2>/dev/null)
EXR_LIBS    := $(or $(filter -L% -lOpenEXRCore%,$(shell $(PKG) --libs OpenEXR 2>/dev/null)),-lOpenEXRCore)
BLAS_CFLAGS := $(shell $(PKG) --cflags openblas 2>/dev/null)
# Embree has no .pc file: the compiler says which headers it finds.
EMBREE := $(or $(EMBREE),$(firstword $(foreach v,4 3,$(shell \
    $(CC) $(CPPFLAGS) $(CFLAGS) -E -include embree$(v)/rtcore.h -x c /dev/null >/dev/null 2>&1 && echo $(v)))),4)
BASE_LIBS := -lcjson -lpng -lz -lm
PT_LIBS  := -lembree$(EMBREE) $(EXR_LIBS) -lcjson -lpng -lz -ldl -lm
# Hundreds of libraries: the programs load them when they read an image.
IMAGE_LIBS := -lOpenImageIO -lOpenImageIO_Util -lstdc++
# MPI is optional and in a shared object of its own, so that programs run where it is not: MPI= leaves it out.
MPI_PKG := $(firstword $(foreach p,ompi-c mpich,$(shell $(PKG) --exists $(p) 2>/dev/null && echo $(p))))
MPI     ?= $(if $(MPI_PKG),1)
MPI_CFLAGS := $(patsubst -I%,-isystem %,$(if $(MPI_PKG),$(shell $(PKG) --cflags $(MPI_PKG))))
MPI_LIBS   := $(if $(MPI_PKG),$(shell $(PKG) --libs $(MPI_PKG)))
GGN_LIBS := -lsvm -lcjson -lpng -lz -ldl -lm

# --- include paths: the dependency arrows --------------------------------------------------------------------------------
API := -Iplugin-api/include
# "base/…", "job/…", "picture/…", "sequence/…" and "denoise/…": what all programs stand on; no part of the ABI
BASE := -Iplugin-api
BASE_FOLDERS := base job picture sequence denoise
# INC_PROGRAM_FOLDER is for a folder, INC_PROGRAM for the rest of the program; INC_tests_PREFIX for the tests of that prefix.
INC_plugin-api         := $(API)
$(foreach f,$(BASE_FOLDERS),$(eval INC_plugin-api_$(f) := $(BASE)))
INC_plugin-api_mpi     := $(BASE) $(MPI_CFLAGS)# the only folder that knows MPI
INC_plugin-api_src     := $(API) $(BASE)
INC_plugin-api_tools   := $(API) $(BASE)
INC_plugin-api_report  := $(API) $(BASE)
INC_plugin-api_host    := $(API) $(BASE)
INC_plugin-api_script  := $(API) $(BASE)
INC_pathtracer         := -Ipathtracer $(BASE) $(EXR_CFLAGS)
INC_pathtracer_geom    := $(INC_pathtracer) -DPT_EMBREE=$(EMBREE)# the only folder that knows Embree
INC_pathtracer_render  := $(INC_pathtracer) $(API)# with app/ the only hosts of criteria
INC_pathtracer_app     := $(INC_pathtracer_render)
INC_ggn                := -Iggn $(BASE) $(BLAS_CFLAGS)
INC_ggn_plugin         := $(INC_ggn) $(API)# the only folder of ggn that knows the ABI
INC_tests              := -Itests -Itests/support $(API)
INC_tests_pt           := -Itests -Itests/support $(INC_pathtracer_render)
INC_tests_ggn          := -Itests -Itests/support $(INC_ggn_plugin)
INC_tests_base         := -Itests -Itests/support $(BASE)
INC_tests_api_host     := $(INC_tests) $(BASE)# the host library from inside

# --- sources -------------------------------------------------------------------------------------------------------------
BASE_SRC    := $(wildcard $(BASE_FOLDERS:%=plugin-api/%/*.c))
IMAGES_SRC  := plugin-api/picture/oiio.cpp# in a shared object of its own; fuzz targets and benchmarks link it
LOADER_SRC  := $(wildcard plugin-api/src/*.c)
HOST_SRC    := $(wildcard plugin-api/host/*.c)
EXAMPLE_SRC := $(wildcard plugin-api/examples/*.c)
TOOL_SRC    := $(wildcard plugin-api/tools/*.c)
MPI_SRC     := $(wildcard plugin-api/mpi/*.c)
PT_MAIN     := pathtracer/app/main.c
PT_SRC      := $(filter-out $(PT_MAIN),$(wildcard pathtracer/*/*.c))
GGN_SRC     := $(filter-out ggn/plugin/% ggn/cli/%,$(wildcard ggn/*/*.c))
# What includes nn/real.h itself is compiled for float and, with GGN_DOUBLE, for double.
GGN_TWICE   := $(shell grep -ls '"nn/real.h"' ggn/nn/*.c ggn/model/*.c tests/support/*.c)
GGN_ENTRIES := $(wildcard ggn/plugin/entry_*.c)# one a library of criteria: entry_NAME.c makes NAME.so
GGN_PLUGIN  := $(filter-out $(GGN_ENTRIES),$(wildcard ggn/plugin/*.c ggn/plugin/*/*.c))
STUDY       := plugin-api/python/lull/study# lull-study: Python, and the page that it serves
GGN_CLI     := $(wildcard ggn/cli/*.c)
# Tests name what they test by prefix: pt_ (path tracer), ggn_, api_ (plugin-api), base_ (BASE_FOLDERS).
TEST_FOLDERS := unit grad golden stat abi hard oom
TEST_SRC    := $(wildcard $(TEST_FOLDERS:%=tests/%/*.c))
# The subset that also runs under ASan+UBSan in `make test`.
SANE_SRC    := $(wildcard tests/unit/*.c tests/abi/*.c tests/oom/*.c)
# Hosts that are not installed are skipped; `make test-hosts` installs them first.
HOST_TEST   := $(wildcard tests/hosts/*.sh)
SCRIPT_TEST := $(wildcard tests/cli/*.sh tests/e2e/*.sh tests/lab/*.sh) $(HOST_TEST)
FUZZ_SRC    := $(filter-out tests/fuzz/replay.c,$(wildcard tests/fuzz/*.c))

o = $(addprefix $(OBJ)/,$(addsuffix .o,$(1)) $(addsuffix .double.o,$(filter $(GGN_TWICE),$(1))))
BASE_OBJ    := $(call o,$(BASE_SRC))
# The path tracer is linked with the host library's objects: wherever it is moved, it finds the library.
HOST_OBJ    := $(call o,$(HOST_SRC))
PT_CORE_OBJ := $(call o,$(PT_SRC)) $(HOST_OBJ) $(BASE_OBJ)
PT_OBJ      := $(PT_CORE_OBJ) $(call o,$(IMAGES_SRC))
LOADER_OBJ  := $(call o,$(LOADER_SRC))
GGN_CORE_OBJ := $(call o,$(GGN_SRC)) $(BASE_OBJ)
GGN_OBJ     := $(GGN_CORE_OBJ) $(call o,$(IMAGES_SRC))
GGN_PLUGIN_OBJ := $(call o,$(GGN_PLUGIN))

PROGRAMS := $(addprefix $(BIN)/,lull-render ggn lull-study lull-plot lull-report lull-check)
MPI_MODULE := $(if $(MPI),$(OUT)/lib/lull/modules/lull-mpi.so)# loaded only by processes that a launcher has started
# The host library for renderers (lull/host.h): the file has the major version in its name, programs link the other.
HOST_LIB := $(OUT)/lib/liblull-host.so.1
EXAMPLES := $(BIN)/host-example
DENOISER := $(OUT)/lib/lull/modules/lull-denoiser# a program that denoise/oidn.h runs
IMAGES   := $(OUT)/lib/lull/modules/lull-images.so
JUDGE    := $(OUT)/lib/lull/modules/ggn-judge# what ggn starts for the commands that are Python
SCRIPTS  := $(OUT)/lib/lull/modules/lull-python.so# criteria that are Python files
MODULES  := $(DENOISER) $(MPI_MODULE) $(IMAGES) $(JUDGE) $(SCRIPTS)
CRITERIA := $(EXAMPLE_SRC:plugin-api/examples/%.c=$(LIB)/%.so) $(GGN_ENTRIES:ggn/plugin/entry_%.c=$(LIB)/%.so)
TESTS    := $(patsubst tests/%.c,$(OUT)/tests/%,$(TEST_SRC))
SANE     := $(patsubst tests/%.c,build/asan/tests/%,$(SANE_SRC))
REPLAY   := $(patsubst tests/fuzz/%.c,$(OUT)/fuzz/replay-%,$(FUZZ_SRC))
FUZZERS  := $(patsubst tests/fuzz/%.c,build/fuzz/%,$(FUZZ_SRC))

.DEFAULT_GOAL := all
.PHONY: all setup tests test-tools replay demo train-demo test test-clang test-study test-hosts test-packages asan tsan \
    fuzz mutants host-model hdr-check abi-check bench cost install uninstall deb wheel blender man compdb clean help
.SECONDARY:

all: $(PROGRAMS) $(CRITERIA) $(MODULES) $(HOST_LIB) $(EXAMPLES) ## build the programs and the criteria

# --- compiling: one rule, flags by folder --------------------------------------------------------------------------------
# parts: the words of FOLDER/FOLDER/…/NAME; keys: by what its flags are found, the nearest first.
parts = $(subst /, ,$(1))
prefix = $(wordlist 1,$(1),$(subst _, ,$(basename $(notdir $(2)))))
keys = $(if $(filter tests/%,$(1)),tests_$(subst $() ,_,$(call prefix,2,$(1))) tests_$(call prefix,1,$(1)) tests, \
    $(subst $() ,_,$(wordlist 1,2,$(call parts,$(1)))) $(firstword $(call parts,$(1))))
inc = $(INC_$(firstword $(foreach k,$(call keys,$(1)),$(if $(INC_$(k)),$(k)))))
# Kernels for one instruction set carry it in their name (x_avx2.c, x_avx512.c); they are reached by run-time dispatch only.
ifneq ($(filter x86_64%,$(shell $(CC) -dumpmachine)),)
ISA_avx2   := -mavx2 -mfma
ISA_avx512 := -mavx512f -mavx512vl -mavx512bw -mavx512dq -mfma -mprefer-vector-width=512
isa = $(ISA_$(lastword $(subst _, ,$(basename $(1)))))
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
$(OBJ)/plugin-api/script/script.c.o: plugin-api/python/lull/script.py

$(OBJ)/%.cpp.o: %.cpp
	@mkdir -p $(@D)
	@echo "  CXX  $<"
	@$(CXX) $(CXXFLAGS_ALL) $(call inc,$<) -c $< -o $@

# Programs are linked by the second linker of Debian's binutils in a tenth of the time; it exports _end and others, so no
# plugin is.
LINKER := $(if $(shell command -v ld.gold),-fuse-ld=gold)
link = @mkdir -p $(@D); echo "  LD   $@"; $(CC) $(LINKER)
so   = @mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--version-script=plugin-api/plugin.map -Wl,-z,defs

$(BIN)/lull-render: $(call o,$(PT_MAIN)) $(PT_CORE_OBJ) $(LOADER_OBJ) | $(IMAGES)
	$(link) $^ $(LDFLAGS_ALL) $(PT_LIBS) -o $@
$(BIN)/ggn: $(call o,$(GGN_CLI)) $(GGN_CORE_OBJ) | $(IMAGES)
	$(link) $^ $(LDFLAGS_ALL) $(GGN_LIBS) -o $@
# Their packages are found beside them where they are installed, else in the source tree.
$(BIN)/lull-study $(BIN)/lull-plot $(JUDGE): plugin-api/python/program | $(HOST_LIB) $(IMAGES)
	@install -D -m 755 $< $@
# Of what both programs stand on the checker takes what it names.
$(OBJ)/base.a: $(BASE_OBJ)
	@rm -f $@; echo "  AR   $@"; $(AR) rcs $@ $^
$(BIN)/lull-check: $(call o,$(TOOL_SRC)) $(LOADER_OBJ) $(OBJ)/base.a
	$(link) $^ $(LDFLAGS_ALL) -ldl -lm -o $@
REPORT_SRC := $(wildcard plugin-api/report/*.c)
$(BIN)/lull-report: $(call o,$(REPORT_SRC)) $(HOST_OBJ) $(LOADER_OBJ) $(OBJ)/base.a | $(IMAGES)
	$(link) $^ $(LDFLAGS_ALL) $(BASE_LIBS) -ldl -o $@
$(IMAGES): $(call o,$(IMAGES_SRC)) $(OBJ)/base.a
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--exclude-libs,ALL $^ $(LDFLAGS_ALL) $(IMAGE_LIBS) -lz -lm -o $@
$(DENOISER): $(call o,$(wildcard plugin-api/denoise/program/*.c)) $(OBJ)/base.a
	$(link) $^ $(LDFLAGS_ALL) -ldl -lm -o $@
$(SCRIPTS): $(call o,$(wildcard plugin-api/script/*.c)) $(OBJ)/base.a
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--exclude-libs,ALL -Wl,-z,defs $^ $(LDFLAGS_ALL) -lm -o $@
$(OUT)/lib/lull/modules/lull-mpi.so: $(call o,$(MPI_SRC)) $(OBJ)/base.a
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--exclude-libs,ALL $^ $(LDFLAGS_ALL) $(MPI_LIBS) -lm -o $@
# As the wheel and the Blender extension carry them: for systems that have the C library and zlib, and without symbols.
# Debian has no archives of cJSON and libpng that fit into a shared object, so they lie beside.
BUNDLE := $(OUT)/bundle/lib
CARRIED := denoised fixed ggn halfbuf observer variance
BESIDE := $(BUNDLE)/libcjson.so.1 $(BUNDLE)/libpng16.so.16
BUNDLED := $(BUNDLE)/liblull-host.so.1 $(BESIDE) $(CARRIED:%=$(BUNDLE)/lull/%.so) $(BUNDLE)/lull/lull-3.ggn \
    $(BUNDLE)/lull/modules/lull-denoiser $(BUNDLE)/lull/modules/lull-python.so
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
$(HOST_LIB) $(BUNDLE)/liblull-host.so.1: $(HOST_OBJ) $(LOADER_OBJ) $(OBJ)/base.a plugin-api/host.map
	@mkdir -p $(@D); echo "  SO   $@"; $(CC) -shared -Wl,--version-script=plugin-api/host.map -Wl,-z,defs -Wl,-soname,$(@F) \
	    -Wl,--as-needed $(filter %.o %.a,$^) $(LDFLAGS_ALL) $(BASE_LIBS) -ldl -o $@
	@ln -sf $(@F) $(@:.1=)
# As a renderer would build it: the public headers and the library, nothing else.
$(BIN)/host-example: plugin-api/examples/host.cpp $(wildcard plugin-api/include/lull/*.h) | $(HOST_LIB)
	@mkdir -p $(@D); echo "  CXX  $@"; $(CXX) -std=c++11 $(WARN) $(OPT_$(MODE)) $(SAN_$(MODE)) $(CPPFLAGS) $(CXXFLAGS) \
	    $(API) $< -L$(OUT)/lib -Wl,-rpath,'$$ORIGIN/../lib' $(LDFLAGS) -llull-host -o $@
# Of the networks the criteria take what they name: no image is read there, and no image library loaded.
$(OBJ)/ggn.a: $(GGN_CORE_OBJ)
	@rm -f $@; echo "  AR   $@"; $(AR) rcs $@ $^
$(OBJ)/ggn-plugin.a: $(GGN_PLUGIN_OBJ)
	@rm -f $@; echo "  AR   $@"; $(AR) rcs $@ $^
# Each with what its criteria name and the libraries that those need: observer.so the mathematical one, ggn.so no BLAS.
GGN_CRITERIA := $(GGN_ENTRIES:ggn/plugin/entry_%.c=$(LIB)/%.so)
$(GGN_CRITERIA): $(OBJ)/ggn-plugin.a $(OBJ)/ggn.a plugin-api/plugin.map
$(GGN_CRITERIA): $(LIB)/%.so: $(OBJ)/ggn/plugin/entry_%.c.o
	$(so) $(filter %.o %.a,$^) $(LDFLAGS_ALL) -Wl,--as-needed $(GGN_LIBS) -o $@
$(LIB)/denoised.so: | $(DENOISER)
$(LIB)/%.so: $(OBJ)/plugin-api/examples/%.c.o plugin-api/plugin.map
	$(so) $(filter %.o,$^) $(LDFLAGS_ALL) -lm -o $@

# --- tests ---------------------------------------------------------------------------------------------------------------
# tests/support/*.c is linked into every test of its prefix (pt_*.c, ggn_*.c; base_*.c into theirs too) or into all (none).
SUPPORT := $(wildcard tests/support/*.c)
support_but = $(call o,$(filter-out $(1:%=tests/support/%_%),$(SUPPORT)))
SUPPORT_pt  := $(call support_but,ggn api)
SUPPORT_ggn := $(call support_but,pt api)
SUPPORT_api := $(call support_but,pt ggn base api)
SUPPORT_host := $(SUPPORT_api) $(call o,$(filter tests/support/api_host_%,$(SUPPORT)))
SUPPORT_base := $(call o,$(filter tests/support/base_% %/open_files.c %/foreign.c,$(SUPPORT)))
define test_rules
$(OUT)/tests/$(1)/pt_%: $(OBJ)/tests/$(1)/pt_%.c.o $(PT_CORE_OBJ) $(LOADER_OBJ) $(SUPPORT_pt)
	$$(link) $$^ $$(LDFLAGS_ALL) $(PT_LIBS) -lcmocka -o $$@
$(OUT)/tests/$(1)/ggn_%: $(OBJ)/tests/$(1)/ggn_%.c.o $(GGN_CORE_OBJ) $(SUPPORT_ggn)
	$$(link) $$^ $$(LDFLAGS_ALL) $(GGN_LIBS) -lcmocka -o $$@
$(OUT)/tests/$(1)/ggn_plugin%: $(OBJ)/tests/$(1)/ggn_plugin%.c.o $(GGN_PLUGIN_OBJ) $(GGN_CORE_OBJ) $(SUPPORT_ggn)
	$$(link) $$^ $$(LDFLAGS_ALL) $(GGN_LIBS) -lcmocka -o $$@
$(OUT)/tests/$(1)/api_%: $(OBJ)/tests/$(1)/api_%.c.o $(LOADER_OBJ) $(OBJ)/base.a $(SUPPORT_api)
	$$(link) $$^ $$(LDFLAGS_ALL) -ldl -lm -lcmocka -o $$@
$(OUT)/tests/$(1)/api_host%: $(OBJ)/tests/$(1)/api_host%.c.o $(HOST_OBJ) $(LOADER_OBJ) $(OBJ)/base.a $(SUPPORT_host)
	$$(link) $$^ $$(LDFLAGS_ALL) $(BASE_LIBS) -ldl -lcmocka -o $$@
$(OUT)/tests/$(1)/base_%: $(OBJ)/tests/$(1)/base_%.c.o $(BASE_OBJ) $(SUPPORT_base)
	$$(link) $$^ $$(LDFLAGS_ALL) $(BASE_LIBS) -lcmocka -o $$@
endef
$(foreach d,$(TEST_FOLDERS),$(eval $(call test_rules,$(d))))
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
test-tools: $(ABI_PLUGINS) $(OIDN_STUB) $(OUT)/tests/approve $(OUT)/tests/processors/embree_isa.so \
    $(OUT)/bench/ggn_golden $(OUT)/bench/ggn_networks # what test scripts need
replay: $(REPLAY)

# Sub-makes, so that packages installed by setup are seen by pkg-config; by all processors, if no -j says by how many.
build = $(MAKE) --no-print-directory $(if $(filter -j%,$(MAKEFLAGS)),,-j$(shell nproc))
test: setup ## build everything, run every test; closes with "N passed, N failed"
	@$(build) all tests
	@$(build) MODE=asan all replay $(SANE)
	@BUILD=build tests/run $(patsubst tests/%.c,build/tests/%,$(TEST_SRC)) $(SCRIPT_TEST) \
	    --processors tests/processors/list \
	    --asan $(SANE) --replay $(patsubst tests/fuzz/%.c,build/asan/fuzz/replay-%,$(FUZZ_SRC))

CLANG_TEST := $(patsubst tests/%.c,build/clang/tests/%,$(filter tests/unit/% tests/golden/% tests/abi/%,$(TEST_SRC)))
test-clang: ## build the product with clang, without a warning, into build/clang, and pass the unit, golden and ABI tests
	@scripts/setup clang
	@$(build) OUT=build/clang CC=clang CXX=clang++ CFLAGS="$(CFLAGS) -Werror" all $(CLANG_TEST)
	@BUILD=build/clang tests/run $(CLANG_TEST)

test-hosts: setup ## install Blender, Mitsuba, LuxCore and bpy as far as they can be had, and test Lull in them
	@$(build) all $(ABI_PLUGINS) $(OIDN_STUB)
	@scripts/hosts/setup
	@BUILD=build tests/run $(HOST_TEST)

test-packages: all $(OIDN_STUB) ## make, install, use and remove what people install
	@BUILD=build JOBS=1 tests/run $(wildcard tests/packages/*.sh)

asan tsan: ## run the unit and ABI tests under the sanitizer
	@$(build) MODE=$@ all tests
	@BUILD=build/$@ tests/run --$@ $(SANE_SRC:tests/%.c=build/$@/tests/%) $(if $(filter tsan,$@),$(wildcard tests/tsan/*.sh))

test-study: setup ## the page of lull-study in Chromium, simulated participants, load, as far as it can be installed
	@$(build) $(BIN)/lull-study
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
build/fuzz/ggn_%: $(OBJ)/tests/fuzz/ggn_%.c.o $(GGN_OBJ)
	$(link) -fsanitize=fuzzer $^ $(LDFLAGS_ALL) $(GGN_LIBS) $(IMAGE_LIBS) -o $@

mutants: ## plant single-line faults and see that the tests notice (hours; resumes)
	@scripts/mutants $(MUTANTS_FLAGS) $(TEST_SRC) $(SCRIPT_TEST)

host-model: $(BIN)/lull-render $(CRITERIA) ## 1,000 runs that are interrupted, killed or out of disk, against a model
	@tests/model/host.py $(MODEL_FLAGS)

# Every header compiles alone; the ABI header also as C99 and C++11.
HEADERS := $(shell find pathtracer ggn plugin-api tests -name '*.h' -type f 2>/dev/null)
LOOK := -fsyntax-only
C_LOOK = $(CC) -std=c17 -D_POSIX_C_SOURCE=200809L $(WARNC) -Wno-unused-const-variable
PUBLIC := $(addprefix plugin-api/include/lull/,criterion.h criterion_kit.h host.h host_draft.h)
hdr-check: ## each header compiles alone, no include goes up, no long function or line, layout by clang-format 14
	@scripts/check-floors
	@$(foreach h,$(HEADERS), \
	    echo "extern int unused;" | $(C_LOOK) $(call inc,$(h)) $(call isa,$(h)) -include $(h) -x c $(LOOK) - &&) true
	@$(foreach h,$(PUBLIC),$(CC) -std=c99 $(WARNC) $(API) -x c $(LOOK) $(h) &&) true
	@$(foreach h,$(PUBLIC),$(CXX) -std=c++11 $(WARN) $(API) -x c++ $(LOOK) $(h) &&) true
	@! clang-format --version 2>/dev/null | grep -q 'version 14' || \
	    clang-format --dry-run -Werror $$(git ls-files '*.[ch]' '*.cpp')
abi-check: $(OUT)/tests/abi/api_layout ## the layouts of the ABI and the host library are the frozen ones
	@$<

# --- running -------------------------------------------------------------------------------------------------------------
demo: setup ## install what is missing, build, render a scene with per-block stopping
	@$(build) all
	@scripts/demo
bench: all $(BENCHES) ## measure speed as ratios, interleaved, against the peers that are installed (docs/results/speed.md)
	@scripts/lab bench --write
cost: all ## measure what accuracy costs each criterion, from recordings in data/ (docs/results/cost.md)
	@scripts/lab cost
train-demo: all ## train a tiny model on a tiny bundled data set and show that it learns
	@scripts/train-demo

DEST := '$(subst ','\'',$(DESTDIR))'# as the shell takes it
ifneq ($(filter install uninstall,$(MAKECMDGOALS)),)
ifneq ($(strip $(words $(PREFIX) $(LIBDIR))$(foreach c,: ' " | & ;,$(findstring $(c),$(PREFIX)$(LIBDIR)))),2)
$(error PREFIX=$(PREFIX) LIBDIR=$(LIBDIR): expected folders without blanks, quotes and :|&;)
endif
endif

# FOLDER:MODE:FILE of everything that install puts in place and uninstall takes away; links stay links.
libdir := $(if $(filter /%,$(LIBDIR)),$(LIBDIR),$(PREFIX)/$(LIBDIR))
share := $(PREFIX)/share
put = $(foreach f,$(3),$(1):$(2):$(f))
INSTALLED = $(call put,$(PREFIX)/bin,755,$(PROGRAMS) scripts/packages/lull-denoiser-setup) \
    $(call put,$(PREFIX)/include/lull,644,$(wildcard plugin-api/include/lull/*.h)) \
    $(call put,$(libdir),755,$(HOST_LIB) $(HOST_LIB:.1=)) $(call put,$(libdir)/pkgconfig,644,$(PC_FILES)) \
    $(call put,$(libdir)/cmake/lull,644,$(CMAKE_FILES)) \
    $(call put,$(libdir)/lull,755,$(CRITERIA)) $(call put,$(libdir)/lull/modules,755,$(MODULES)) \
    $(call put,$(share)/man/man1,644,$(wildcard docs/man/*.1)) $(call put,$(share)/man/man7,644,$(wildcard docs/man/*.7)) \
    $(call put,$(share)/bash-completion/completions,644,$(wildcard scripts/packages/completions/*)) \
    $(call put,$(share)/lull,644,$(wildcard ggn/models/*.ggn) plugin-api/base/version.h \
        $(addsuffix .py,$(addprefix plugin-api/python/lull/,abi files library limits program script sequence version))) \
    $(foreach p,judge plot,$(call put,$(share)/lull/$(p),644,$(wildcard plugin-api/python/lull/$(p)/*.py))) \
    $(call put,$(share)/lull/study,644,$(wildcard $(STUDY)/*.py)) \
    $(call put,$(share)/lull/study/page,644,$(wildcard $(STUDY)/page/*.*)) \
    $(call put,$(share)/lull/study/page/vendor,644,$(wildcard $(STUDY)/page/vendor/*))
OWN_FOLDERS = $(libdir)/lull/modules $(libdir)/lull $(libdir)/cmake/lull $(PREFIX)/include/lull \
    $(share)/lull/study/page/vendor $(share)/lull/study/page $(share)/lull/study $(share)/lull/plot $(share)/lull/judge $(share)/lull
# Where LIBDIR is elsewhere, this link: programs find their criteria and modules in ../lib/lull.
OWN_LINK = $(filter-out $(libdir)/lull,$(PREFIX)/lib/lull)
PC_FILES := $(OUT)/lull-criterion.pc $(OUT)/lull-host.pc
CMAKE_FILES := $(OUT)/lull-config.cmake $(OUT)/lull-config-version.cmake
# 1.2 of LULL_HOST_MAJOR and LULL_HOST_MINOR
version = $(shell sed -n 's/^\#define $(1)_M[AI][JN]OR \([0-9]*\).*/\1/p' plugin-api/include/lull/$(2) | paste -sd.)
.PHONY: $(PC_FILES) $(CMAKE_FILES)
$(PC_FILES) $(CMAKE_FILES): $(OUT)/%: plugin-api/%.in
	@mkdir -p $(@D)
	@sed -e 's|@PREFIX@|$(PREFIX)|g' -e 's|@LIBDIR@|$(patsubst $(PREFIX)/%,$${prefix}/%,$(libdir))|g' \
	    -e 's|@CRITERION_VERSION@|$(call version,LULL_API,criterion.h)|g' \
	    -e 's|@HOST_VERSION@|$(call version,LULL_HOST,host.h)|g' \
	    -e "s|@UP@|$$(realpath -ms --relative-to=$(libdir)/cmake/lull $(PREFIX))|g" $< >$@

install: all $(PC_FILES) $(CMAKE_FILES) ## install programs, libraries, headers, models, pages under $(DESTDIR)$(PREFIX)
	@for i in $(INSTALLED); do \
	    folder=$(DEST)$${i%%:*} file=$${i##*:} mode=$${i#*:}; \
	    install -d "$$folder" || exit 1; \
	    if [ -h $$file ]; then cp -P $$file "$$folder"; else install -m $${mode%%:*} $$file "$$folder"; fi || exit 1; done
	@$(if $(OWN_LINK),install -d $(DEST)$(PREFIX)/lib && ln -srfn $(DEST)$(libdir)/lull $(DEST)$(OWN_LINK))
	@echo "  installed $(words $(INSTALLED)) files under "$(DEST)$(PREFIX)
uninstall: ## remove what install put under $(DESTDIR)$(PREFIX)
	@for i in $(INSTALLED); do rm -f $(DEST)$${i%%:*}/$${i##*/} || exit 1; done
	@$(if $(OWN_LINK),[ ! -h $(DEST)$(OWN_LINK) ] || rm $(DEST)$(OWN_LINK))
	@for f in $(OWN_FOLDERS); do [ ! -d $(DEST)$$f ] || rmdir --ignore-fail-on-non-empty $(DEST)$$f; done

wheel: $(BUNDLED) ## make the Python package with host library, criteria and model in build/wheel
	@scripts/packages/bundle wheel $(BUNDLED)
blender: $(BUNDLED) ## make the add-on for Blender 3.4, which is an extension for 4.2 and later, in build/blender
	@scripts/packages/bundle blender $(BUNDLED)
deb: all ## make the Debian packages lull, liblull-host1 and lull-dev in build/deb (needs debhelper)
	@scripts/packages/deb

man: all ## write docs/man/*.1 from --help and docs/man/*.h2m (needs help2man)
	@docs/man/write

# What `make -n` would compile, for editors; the program of a wheel or a test is built by the same rule.
compdb: ## write compile_commands.json
	@mkdir -p build && $(MAKE) --no-print-directory -n -B all tests | sed -n -e 's/["\\]/\\&/g' \
	    -e 's|^.* -c \([^ ]*\) -o \([^ ]*\)$$|{"directory":"$(CURDIR)","file":"\1","output":"\2","command":"&"},|p' | \
	    sed -e '1s/^/[/' -e '$$s/,$$/]/' >build/compdb.part && mv build/compdb.part compile_commands.json

clean: ## remove build/
	rm -rf build compile_commands.json

help: ## this list
	@sed -nE 's/^([a-z][a-z -]*):[^#]*## /\1\t/p' Makefile | awk -F'\t' '{ printf "  %-12s %s\n", $$1, $$2 }'

-include $(shell find $(OBJ) -name '*.d' 2>/dev/null)
