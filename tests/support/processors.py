"""Environments in which a child process computes as on another processor."""

import platform

import numpy as np

_FOUND = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
PLAIN = {
    "NPY_DISABLE_CPU_FEATURES": " ".join(_FOUND),
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
}
"""NumPy without its faster loops, a C library without FMA."""
_AVX2 = [{"OPENBLAS_CORETYPE": "Haswell"}] if {"X86_V3", "AVX2"} & {*_FOUND} else []
_AVX512 = [{"OPENBLAS_CORETYPE": "SkylakeX"}] if {"X86_V4", "AVX512_SKX"} & {*_FOUND} else []
_X86 = [*_AVX2, {"OPENBLAS_CORETYPE": "Nehalem"}, *_AVX512, {"OPENBLAS_CORETYPE": "Prescott"} | PLAIN]
PROCESSORS = _X86 if platform.machine().lower() in {"x86_64", "amd64"} else [{}]
"""Kernels of OpenBLAS that this processor can execute."""
