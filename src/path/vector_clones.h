#pragma once

// Compiles one function for several instruction sets; the widest that the machine supports runs. Sources that use it
// are compiled without fused multiply-adds (CMakeLists.txt), so that all versions give the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define CROWNFIT_FOR_EVERY_VECTOR __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define CROWNFIT_FOR_EVERY_VECTOR
#endif
