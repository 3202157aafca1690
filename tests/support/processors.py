"""Environments in which a child process computes as on another processor."""

import numpy as np

_FOUND = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
PLAIN = {
    "NPY_DISABLE_CPU_FEATURES": " ".join(_FOUND),
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
}
"""NumPy without its faster loops, a C library without FMA."""
_WIDE = [{"OPENBLAS_CORETYPE": "SkylakeX"}] if {"X86_V4", "AVX512_SKX"} & {*_FOUND} else []
PROCESSORS = [
    {"OPENBLAS_CORETYPE": "Haswell"},
    {"OPENBLAS_CORETYPE": "Nehalem"},
    *_WIDE,
    {"OPENBLAS_CORETYPE": "Prescott"} | PLAIN,
]
"""Kernels of OpenBLAS that this processor can execute."""
