# cmake -DOUTPUT=measure_page_style.cpp -DSTYLE=measure_page.css -P embed_page.cmake: a C++ file that defines
# the style of player/measure_page.hpp.
file(READ "${STYLE}" style)
file(WRITE "${OUTPUT}" "// SPDX-License-Identifier: MIT\n#include \"player/measure_page.hpp\"\n
namespace relit::player {\n\nconst std::string_view kMeasurePageStyle = R\"css(${style})css\";\n
}  // namespace relit::player\n")
