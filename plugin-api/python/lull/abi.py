# SPDX-License-Identifier: MIT
"""The structs and numbers of lull/criterion.h 1.0 for ctypes: nothing else. The header's comments are the contract.

Each class stands for `struct lull_<name>`; tests/hosts compares every offset with plugin-api/layout-1.txt.
"""
import ctypes as C
from ctypes import c_double as F64
from ctypes import c_int32 as I32
from ctypes import c_int64 as I64
from ctypes import c_uint32 as U32
from ctypes import c_uint64 as U64
from ctypes import c_void_p as P

API_MINOR = 0
ENTRY_NAME = "lull_criterion_entry_v1"
EXT_STATE = b"lull.state/1"

OK, E_INVALID, E_KEY, E_VALUE, E_MEMORY, E_PLANE, E_STATE, E_IO, E_VERSION, E_UNSUPPORTED, E_CANCELLED, E_INTERNAL = \
    range(0, -12, -1)
LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG = range(4)
PARAM_INT, PARAM_FLOAT, PARAM_BOOL, PARAM_CHOICE, PARAM_FILE, PARAM_TEXT = range(6)
COLOR, WEIGHT, SPP, MOMENT2, HALF, ALBEDO, NORMAL, DEPTH, PLANE_COUNT = range(9)
TYPE_F32, TYPE_F16, TYPE_F64, TYPE_U32 = range(4)
NORM_ONE, NORM_SPP, NORM_HALF_SPP, NORM_WEIGHT = range(4)
TRANSFER_UNKNOWN, TRANSFER_LINEAR, TRANSFER_SRGB, TRANSFER_GAMMA = range(4)
REQ_FLEXIBLE = 1
FRAME_RESTART, FRAME_DETERMINISTIC, FRAME_INDEPENDENT, FRAME_SHARED = 1, 2, 4, 8
BLOCK_STOPPED, BLOCK_FINAL = 1, 2
CONTINUE, STOP = 0, 1
DECISION_TOO_EARLY, DECISION_BAD_INPUT = 1, 2
THREADS_NONE, THREADS_INSTANCE, THREADS_FULL = range(3)
CAP_DETERMINISTIC, CAP_BATCH_INVARIANT, CAP_REOPENS = 1, 2, 4


class Error(C.Structure):
    _fields_ = [("struct_size", U32), ("code", I32), ("message", C.c_char * 504)]


TaskFn = C.CFUNCTYPE(None, P, U64, U32)
LogFn = C.CFUNCTYPE(None, P, I32, C.c_char_p)
ParallelForFn = C.CFUNCTYPE(I32, P, U64, TaskFn, P)


class Host(C.Structure):
    _fields_ = [("struct_size", U32), ("api_minor", U32), ("context", P), ("name", C.c_char_p), ("max_workers", U32),
                ("flags", U32), ("log", LogFn), ("parallel_for", ParallelForFn), ("cancelled", P), ("get_extension", P)]


class Param(C.Structure):
    _fields_ = [("name", C.c_char_p), ("help", C.c_char_p), ("default_value", C.c_char_p), ("choices", C.c_char_p),
                ("min", F64), ("max", F64), ("type", I32), ("flags", U32)]


class Pair(C.Structure):
    _fields_ = [("key", C.c_char_p), ("value", C.c_char_p)]


class Requirements(C.Structure):
    _fields_ = [("struct_size", U32), ("flags", U32), ("planes_required", U32), ("planes_used", U32), ("block_width", U32),
                ("block_height", U32), ("halo", U32), ("checks_hint", U32), ("first_spp", U64), ("bytes_per_block", U64)]


class Rect(C.Structure):
    _fields_ = [("x0", I32), ("y0", I32), ("x1", I32), ("y1", I32)]


class Frame(C.Structure):
    _fields_ = [("struct_size", U32), ("flags", U32), ("width", U32), ("height", U32), ("blocks", P), ("block_count", U32),
                ("block_stride", U32), ("planes", U32), ("transfer", I32), ("gamma", F64), ("exposure", F64),
                ("sample_clamp", F64), ("time_budget_s", F64), ("spp_min", U64), ("spp_max", U64), ("seed", U64),
                ("rgb_to_xyz", F64 * 9)]


class Plane(C.Structure):
    _fields_ = [("data", P), ("stride_x", I64), ("stride_y", I64), ("stride_c", I64), ("scale", F64), ("type", I32),
                ("normaliser", I32), ("channels", U32), ("flags", U32)]


class Block(C.Structure):
    _fields_ = [("id", U32), ("flags", U32), ("x0", I32), ("y0", I32), ("x1", I32), ("y1", I32), ("spp", U64),
                ("half_spp", U64), ("thread_s", F64)]


class View(C.Structure):
    _fields_ = [("struct_size", U32), ("flags", U32), ("x0", I32), ("y0", I32), ("x1", I32), ("y1", I32), ("planes", P),
                ("plane_count", U32), ("plane_stride", U32), ("all", P), ("all_count", U32), ("all_stride", U32),
                ("elapsed_s", F64)]


class Decision(C.Structure):
    _fields_ = [("action", I32), ("flags", U32), ("next_spp", U64), ("p_noisy", F64), ("predicted_spp", F64), ("error", F64)]


class Criterion(C.Structure):
    _fields_ = [("struct_size", U32), ("api_minor", U32), ("id", C.c_char_p), ("name", C.c_char_p), ("version", C.c_char_p),
                ("description", C.c_char_p), ("params", P), ("param_count", U32), ("param_stride", U32),
                ("thread_level", I32), ("capabilities", U32),
                ("create", C.CFUNCTYPE(I32, P, P, U32, U32, P, P)), ("requirements", C.CFUNCTYPE(I32, P, P, P)),
                ("begin_frame", C.CFUNCTYPE(I32, P, P, P)), ("evaluate", C.CFUNCTYPE(I32, P, P, P, U32, P, U32, U32, P)),
                ("end_frame", C.CFUNCTYPE(None, P)), ("destroy", C.CFUNCTYPE(None, P)),
                ("get_extension", C.CFUNCTYPE(P, C.c_char_p))]


WriteFn = C.CFUNCTYPE(I32, P, P, U64)
ReadFn = C.CFUNCTYPE(I32, P, P, U64)


class Writer(C.Structure):
    _fields_ = [("struct_size", U32), ("flags", U32), ("context", P), ("write", WriteFn)]


class Reader(C.Structure):
    _fields_ = [("struct_size", U32), ("flags", U32), ("context", P), ("read", ReadFn)]


class State(C.Structure):
    _fields_ = [("struct_size", U32), ("flags", U32), ("save", C.CFUNCTYPE(I32, P, P, P)),
                ("load", C.CFUNCTYPE(I32, P, P, P))]


def sized(struct_type, **fields):
    """A zeroed struct that can grow, its struct_size set."""
    return struct_type(struct_size=C.sizeof(struct_type), **fields)
