// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

namespace relit::fuzz {

/// Changes one record of the file behind the first `prefix` bytes, or the order of records, and
/// joins them again; now and then changes just any bytes. As LLVMFuzzerCustomMutator otherwise.
std::size_t mutate_file(std::uint8_t* data, std::size_t size, std::size_t max_size,
                        std::uint32_t seed, std::size_t prefix);

}  // namespace relit::fuzz
