// SPDX-License-Identifier: MIT
#if !__has_include(<catch2/catch_all.hpp>)
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
#endif

#include <cstdlib>

// Where the tests find the sources, what was built, and the shared characters; the environment can
// say otherwise.
static const bool places_are_set = [] {
  ::setenv("RELIT_SOURCE_DIR", RELIT_TEST_SOURCE_DIR, 0);
  ::setenv("RELIT_BINARY_DIR", RELIT_TEST_BINARY_DIR, 0);
  ::setenv("RELIT_ASSETS", RELIT_TEST_SOURCE_DIR "/../shared/assets", 0);
  return true;
}();
