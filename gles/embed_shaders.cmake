# cmake -DOUTPUT=shaders.cpp -DSOURCES=a.glsl|b.glsl -P embed_shaders.cmake: a C++ file that defines
# the string views of gles/shaders.hpp.
string(REPLACE "|" ";" sources "${SOURCES}")
set(text "// SPDX-License-Identifier: MIT\n#include \"gles/shaders.hpp\"\n\nnamespace relit::gles::shaders {\n\n")
foreach(source IN LISTS sources)
  get_filename_component(name "${source}" NAME)
  string(REGEX REPLACE "\\.glsl$" "" name "${name}")
  string(REPLACE "." "_" name "${name}")
  file(READ "${source}" body)
  string(APPEND text "const std::string_view ${name} = R\"glsl(${body})glsl\";\n\n")
endforeach()
string(APPEND text "}  // namespace relit::gles::shaders\n")
file(WRITE "${OUTPUT}" "${text}")
