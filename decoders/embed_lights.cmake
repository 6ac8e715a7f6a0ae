# cmake -DOUTPUT=standard_lights.cpp -DLIGHTS=standard_lights.json -P embed_lights.cmake: a C++ file that
# defines standard_lights() of decoders/relit_error.hpp.
file(READ "${LIGHTS}" json)
string(JSON lights GET "${json}" lights)
# Numbers in order, without the rest: sixteen rows of three for each light.
string(REGEX REPLACE "\"[^\"]*\" *:? *(\"[^\"]*\")?" "" numbers "${lights}")
string(REGEX MATCHALL "-?[0-9]+(\\.[0-9]+)?([eE][-+]?[0-9]+)?" numbers "${numbers}")
list(LENGTH numbers count)
if(NOT count EQUAL 768)
  message(FATAL_ERROR "${LIGHTS}: ${count} numbers, not 16 lights of 16 coefficients of 3 channels")
endif()
list(JOIN numbers ", " numbers)
file(WRITE "${OUTPUT}" "// SPDX-License-Identifier: MIT
#include \"decoders/relit_error.hpp\"

namespace relit::decoders {
namespace {

constexpr double kNumbers[] = {${numbers}};

}  // namespace

std::vector<Light> standard_lights() {
  std::vector<Light> lights(16);
  const double* number = kNumbers;
  for (Light& light : lights) {
    light.sh.resize(16);
    for (auto& row : light.sh)
      for (double& value : row) value = *number++;
  }
  return lights;
}

}  // namespace relit::decoders
")
