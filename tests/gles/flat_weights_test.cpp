// SPDX-License-Identifier: MIT
#include "gles/flat_weights.hpp"

#include "tests/test.hpp"

using relit::gles::FlatWeights;

TEST_CASE("weights are inputs as far as there is room, and uniforms beyond it") {
  FlatWeights flat(1);
  CHECK(flat.inputs().empty());
  CHECK(flat.outputs().empty());
  const char* inputs[] = {"v_weights[0].x", "v_weights[0].y", "v_weights[0].z", "v_weights[0].w"};
  for (const char* input : inputs) CHECK(flat.name("u_weight0[7].g") == input);
  CHECK(flat.name("u_weight1[0].r") == "u_weight1[0].r");
  CHECK(flat.inputs() == "flat in vec4 v_weights[1];\n");
  CHECK(flat.outputs().find("flat out vec4 v_weights[1];\n") != std::string::npos);
  CHECK(flat.outputs().find("v_weights[0].w = u_weight0[7].g;") != std::string::npos);
  CHECK(flat.outputs().find("u_weight1") == std::string::npos);
}

TEST_CASE("a vector of weights that is not full is declared") {
  FlatWeights flat(30);
  for (int i = 0; i < 5; ++i) (void)flat.name("u_weight0[0].r");
  CHECK(flat.inputs() == "flat in vec4 v_weights[2];\n");
}
