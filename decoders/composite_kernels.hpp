// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include "decoders/composite.hpp"

/// The composite's kernels one by one, for CompositeJob and for the tests and benchmarks that
/// compare them.
namespace relit::decoders {

struct CompositeKernel {
  const char* name;
  void (*run)(const CompositeJob&);
};

/// Those that this processor can run, "scalar" first, the fastest last. Valid for ever; any thread.
[[nodiscard]] std::span<const CompositeKernel> composite_kernels();

void composite_scalar(const CompositeJob& job);
#if defined(__x86_64__)
void composite_sse2(const CompositeJob& job);
void composite_avx2(const CompositeJob& job);
#endif
#if defined(__ARM_NEON)
void composite_neon(const CompositeJob& job);
#endif

}  // namespace relit::decoders
