# SPDX-License-Identifier: MIT
"""The structs and numbers of lull/criterion.h, loader.h and host.h for ctypes: nothing else. The headers' comments are
the contract; tests/hosts compares every offset with plugin-api/layout-1.txt and host-layout-1.txt, every number with the
headers."""
import ctypes as C
from typing import Any

OK, E_INVALID, E_KEY, E_VALUE, E_MEMORY, E_PLANE, E_STATE, E_IO, E_VERSION, E_UNSUPPORTED, E_CANCELLED, E_INTERNAL = \
    range(0, -12, -1)
LOG_ERROR, LOG_WARNING, LOG_INFO, LOG_DEBUG = range(4)
COLOR, WEIGHT, SPP, MOMENT2, HALF, ALBEDO, NORMAL, DEPTH, PLANE_COUNT = range(9)
TYPE_F32, TYPE_F16, TYPE_F64, TYPE_U32 = range(4)
NORM_ONE, NORM_SPP, NORM_HALF_SPP, NORM_WEIGHT = range(4)
TRANSFER_UNKNOWN, TRANSFER_LINEAR, TRANSFER_SRGB, TRANSFER_GAMMA = range(4)
FRAME_DETERMINISTIC, FRAME_INDEPENDENT, FRAME_SHARED = 2, 4, 8
CONTINUE, STOP = 0, 1
HOST_UNIFORM, HOST_OPEN_ENDED = 0x100, 0x400
REPORT_INTERRUPTED, REPORT_NO_RAYS, REPORT_DENOISED = 1, 4, 8
DENOISE_FULL = 1
REASON_NONE, REASON_CRITERION, REASON_SPP_MAX, REASON_UNIFORM, REASON_TIME, REASON_INTERRUPT, REASON_DROPPED, \
    REASON_COUNT = range(8)
PATH_MAX = 4096

LogFn = C.CFUNCTYPE(None, C.c_void_p, C.c_int32, C.c_char_p)
WriteFn = C.CFUNCTYPE(C.c_int32, C.c_void_p, C.c_void_p, C.c_uint64)
_KINDS = {"i32": C.c_int32, "u8": C.c_uint8, "u32": C.c_uint32, "i64": C.c_int64, "u64": C.c_uint64, "f64": C.c_double,
          "ptr": C.c_void_p, "text": C.c_char_p, "log": LogFn, "write": WriteFn, "message": C.c_char * 504,
          "path": C.c_char * PATH_MAX, "crop": C.c_int32 * 4, "matrix": C.c_double * 9}


def _struct(name: str, fields: str) -> type:
    """A ctypes struct. fields: "KIND NAME NAME …; KIND NAME …", in the order in which they lie."""
    groups = [group.split() for group in fields.split(";")]
    return type(name, (C.Structure,), {"__doc__": f"The headers' struct of this name: {fields}",
                                       "_fields_": [(n, _KINDS[kind]) for kind, *names in groups for n in names]})


Error: Any = _struct("Error", "u32 struct_size; i32 code; message message")
Param: Any = _struct("Param", "text name help default_value choices; f64 min max; i32 type; u32 flags")
Pair: Any = _struct("Pair", "text key value")
Requirements: Any = _struct("Requirements", "u32 struct_size flags planes_required planes_used block_width block_height "
                                            "halo checks_hint; u64 first_spp bytes_per_block")
Rect: Any = _struct("Rect", "i32 x0 y0 x1 y1")
Plane: Any = _struct("Plane", "ptr data; i64 stride_x stride_y stride_c; f64 scale; i32 type normaliser; u32 channels flags")
Decision: Any = _struct("Decision", "i32 action; u32 flags; u64 next_spp; f64 p_noisy predicted_spp error")
Criterion: Any = _struct("Criterion", "u32 struct_size api_minor; text id name version description; ptr params; u32 "
                                      "param_count param_stride; i32 thread_level; u32 capabilities; ptr create "
                                      "requirements begin_frame evaluate end_frame destroy get_extension")
Writer: Any = _struct("Writer", "u32 struct_size flags; ptr context; write write")
Search: Any = _struct("Search", "ptr dirs; u64 dir_count; log log; ptr log_context")
Found: Any = _struct("Found", "ptr criterion; path path")
HostServices: Any = _struct("HostServices", "u32 struct_size threads; text name; ptr context; log log; ptr parallel_for "
                                            "release")
HostConfig: Any = _struct("HostConfig", "u32 struct_size flags width height block_width block_height; crop crop; ptr "
                                        "layout; u32 layout_count layout_stride planes; i32 transfer; f64 gamma exposure "
                                        "sample_clamp; matrix rgb_to_xyz; u64 spp_min spp_max seed; f64 time_budget_s "
                                        "max_check_overhead max_seam; u64 check_step; ptr mask")
HostBlock: Any = _struct("HostBlock", "u32 id; i32 x0 y0 x1 y1 reason; u64 spp half_spp; f64 thread_s; u64 rays dropped "
                                      "next_spp asked_spp; f64 p_noisy error predicted_spp; u32 asked checks stop_votes "
                                      "step")
HostBlocks: Any = _struct("HostBlocks", "u32 struct_size count; ptr list; u32 columns rows list_columns flags; i32 "
                                        "block_width block_height x0 y0 x1 y1; u64 spp_min spp_max check_step")
HostTotals: Any = _struct("HostTotals", "u64 samples paths rays dropped; f64 render_s criterion_s; u64 checks failed_checks "
                                        "skipped_checks; f64 criterion_thread_s; u64 asked")
HostView: Any = _struct("HostView", "u32 struct_size plane_count; i32 x0 y0 x1 y1; ptr planes dropped dropped_half")
HostForecast: Any = _struct("HostForecast", "f64 done_s left_s sampling_s check_s; u64 low high; u32 active known")
HostReport: Any = _struct("HostReport", "u32 struct_size flags; text scene mask kernel; ptr effects; u32 effect_count "
                                        "threads processes zero; u64 messages message_bytes; f64 message_wait_s; u64 "
                                        "film_bytes film_pixels; f64 scene_bytes noisy_weight; ptr noisy_error; text "
                                        "software processor; ptr command; u64 command_count; ptr phases; u64 "
                                        "phase_count")
HostPhase: Any = _struct("HostPhase", "text name; f64 seconds")
HostQuoteRow: Any = _struct("HostQuoteRow", "ptr blocks; f64 spp_min spp_mean spp_max spp_mean_low spp_mean_high thread_s "
                                            "thread_low_s thread_high_s wall_s wall_low_s wall_high_s against_uniform; u32 "
                                            "unknown unmet capped; i32 asked; text parameter; f64 value; "
                                            "text name; i64 told")
HostDenoising: Any = _struct("HostDenoising", "u32 struct_size flags threads zero; text library; ptr context cancelled")
HostPicture: Any = _struct("HostPicture", "u32 struct_size zero; ptr rgb denoised weight")
HostSimulation: Any = _struct("HostSimulation", "u32 struct_size zero; u64 pixels spp half_spp to_spp; matrix rgb_to_xyz; "
                                                "ptr color half moment2")
HostLayer: Any = _struct("HostLayer", "text name; ptr rgb")
HostOutput: Any = _struct("HostOutput", "text option path")


def sized(struct_type: Any, **fields: object) -> Any:
    """A zeroed struct that can grow, its struct_size set."""
    return struct_type(struct_size=C.sizeof(struct_type), **fields)
