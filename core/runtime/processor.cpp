// Detection of the library variant that this processor can run.
#include "iccm/core.h"

#if defined(__x86_64__) && !defined(__wasm__)
#include <cpuid.h>

namespace {

// Whether the operating system saves the upper halves of wide registers too (XCR0, Intel's manual volume 1, 13.3).
bool saves_wide_registers() {
    uint32_t low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return (low & 6) == 6;
}

}  // namespace

// The level of the x86-64 psABI: 3 if AVX2, BMI1, BMI2, F16C, FMA, LZCNT and MOVBE are available, else 1.
ICCM_EXPORT int64_t iccm_runtime_x86_64_level() {
    uint32_t a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d)) return 1;
    const uint32_t fma = 1u << 12, movbe = 1u << 22, osxsave = 1u << 27, avx = 1u << 28, f16c = 1u << 29;
    const uint32_t first = fma | movbe | osxsave | avx | f16c;
    if ((c & first) != first || !saves_wide_registers()) return 1;
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return 1;
    const uint32_t bmi1 = 1u << 3, avx2 = 1u << 5, bmi2 = 1u << 8;
    if ((b & (bmi1 | avx2 | bmi2)) != (bmi1 | avx2 | bmi2)) return 1;
    if (!__get_cpuid(0x80000001u, &a, &b, &c, &d)) return 1;
    return c & (1u << 5) ? 3 : 1;  // LZCNT
}
#else
ICCM_EXPORT int64_t iccm_runtime_x86_64_level() { return 0; }
#endif
