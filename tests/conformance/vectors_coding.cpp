// SPDX-License-Identifier: MIT
// Codecs, layouts, exponents, colour, order: files that a reader must decode to the bit.
#include "tests/conformance/figure.hpp"
#include "tests/conformance/vector.hpp"

namespace relit::conformance {

using container::Chroma;

namespace {

const char* chroma_text(Chroma chroma) {
  return chroma == Chroma::kLuma ? "luma" : chroma == Chroma::k420 ? "420" : "444";
}

struct Coding {
  const char* codec;
  int bits;
  Chroma chroma;
  bool lossless = false;
};

FigureOptions coded(const Coding& coding) {
  FigureOptions o = plain_figure();
  o.frames = 4;
  o.coding.codec = coding.codec;
  o.coding.bit_depth = coding.bits;
  o.coding.chroma = coding.chroma;
  o.coding.lossless = coding.lossless;
  if (o.coding.codec == "h264" || o.coding.codec == "hevc") o.coding.preset = "medium";
  if (o.coding.codec == "vp9" || o.coding.codec == "av1") o.coding.preset = "6";
  return o;
}

void add_codecs(Vectors& vectors) {
  const Coding codings[] = {
      {"h264", 8, Chroma::k420},       {"h264", 10, Chroma::k420},
      {"h264", 10, Chroma::k444},      {"h264", 10, Chroma::kLuma},
      {"h264", 8, Chroma::k444, true}, {"h264", 10, Chroma::kLuma, true},
      {"hevc", 8, Chroma::k420},       {"hevc", 10, Chroma::k420},
      {"hevc", 10, Chroma::kLuma},     {"hevc", 10, Chroma::k444, true},
      {"mpeg4", 8, Chroma::k420},      {"ffv1", 8, Chroma::k444},
      {"ffv1", 8, Chroma::kLuma},      {"ffv1", 10, Chroma::k444},
      {"ffv1", 10, Chroma::kLuma},     {"vp9", 8, Chroma::k420},
      {"vp9", 10, Chroma::k420},       {"vp9", 8, Chroma::kLuma},
      {"vp9", 8, Chroma::k444, true},  {"av1", 8, Chroma::k420},
      {"av1", 10, Chroma::k420},       {"av1", 10, Chroma::kLuma},
  };
  for (const Coding& c : codings) {
    const std::string name = std::string("coding-") + c.codec + "-" + std::to_string(c.bits) + "-" +
                             chroma_text(c.chroma) + (c.lossless ? "-lossless" : "");
    const std::string text = std::string(c.codec) + ", " + std::to_string(c.bits) + " bits, " +
                             chroma_text(c.chroma) + (c.lossless ? ", lossless" : "");
    vectors.push_back(
        {name, text, Outcome::kWhole, {}, [c] { return assemble(figure(coded(c))); }});
  }
}

void add_exponents(Vectors& vectors) {
  for (const int block : {1, 2, 4, 8, 16, 32}) {
    vectors.push_back({"exponents-block-" + std::to_string(block),
                       "one exponent for each square of " + std::to_string(block) + " texels",
                       Outcome::kWhole,
                       {},
                       [block] {
                         FigureOptions o = plain_figure();
                         if (block == 32) o.width = o.height = 32;
                         o.coding.exponent_block = block;
                         return assemble(figure(o));
                       }});
  }
  for (const int hold : {1, 2, 3}) {
    vectors.push_back({"exponents-hold-" + std::to_string(hold),
                       "an exponent picture holds for " + std::to_string(hold) + " frames",
                       Outcome::kWhole,
                       {},
                       [hold] {
                         FigureOptions o = plain_figure();
                         o.frames = 7;
                         o.coding.segment_frames = 4;
                         o.coding.exponent_block = 4;
                         o.coding.exponent_hold = hold;
                         return assemble(figure(o));
                       }});
  }
  vectors.push_back(
      {"exponents-10-bit", "exponents with mantissas of 10 bits", Outcome::kWhole, {}, [] {
         FigureOptions o = plain_figure();
         o.coding.bit_depth = 10;
         o.coding.exponent_block = 4;
         return assemble(figure(o));
       }});
  vectors.push_back({"exponents-odd-blocks",
                     "a light map that is no multiple of the block",
                     Outcome::kWhole,
                     {},
                     [] {
                       FigureOptions o = plain_figure();
                       o.width = 21, o.height = 17;
                       o.coding.exponent_block = 8;
                       return assemble(figure(o));
                     }});
  vectors.push_back({"exponents-paper",
                     "mantissas in MPEG-4, 4:2:0, one exponent a texel and frame, in one grid",
                     Outcome::kWhole,
                     {},
                     [] {
                       FigureOptions o = plain_figure();
                       o.order = 1;
                       o.coding = bake::paper_options();
                       o.coding.segment_frames = 2;
                       return assemble(figure(o));
                     }});
}

FigureOptions principal(const char* codec, int order, bool predict) {
  FigureOptions o = coded({codec, 10, Chroma::kLuma});
  o.order = order;
  o.coding.planes = bake::Planes::kPrincipal;
  o.coding.predict = predict;
  return o;
}

/// Moves the quad's chart to the texels from `least` to 13 of 16.
Draft charted(const FigureOptions& options, int least) {
  Draft draft = figure(options);
  container::VertexStream& uv = draft.meshes[0].streams[1];
  const float origin = static_cast<float>(least) / 16;
  uv.offset = {origin, origin, 0};
  uv.scale = {(13.0f / 16 - origin) / 65535, (13.0f / 16 - origin) / 65535, 1};
  return draft;
}

void add_principal(Vectors& vectors) {
  const auto add = [&](const std::string& name, const std::string& text, auto make) {
    vectors.push_back({name, text, Outcome::kWhole, {}, [make] { return assemble(make()); }});
  };
  add("principal-planes", "principal planes of all of the transfer",
      [] { return figure(principal("ffv1", 2, false)); });
  for (const int order : {0, 1, 2, 3}) {
    add("prediction-order-" + std::to_string(order),
        "a prediction, and principal planes of what it leaves, order " + std::to_string(order),
        [order] { return figure(principal("ffv1", order, true)); });
  }
  add("prediction-h264", "likewise in H.264", [] { return figure(principal("h264", 2, true)); });
  add("prediction-hevc", "likewise in HEVC", [] { return figure(principal("hevc", 2, true)); });
  add("prediction-touched", "a prediction where texels touch a chart that they do not lie in",
      [] { return charted(principal("ffv1", 1, true), 6); });
  add("prediction-fringe", "a prediction where texels are beside a chart",
      [] { return charted(principal("ffv1", 1, true), 7); });
}

void add_orders(Vectors& vectors) {
  for (const int order : {0, 1, 2, 3}) {
    for (const bool grid : {false, true}) {
      const std::string layout = grid ? "grid" : "layered";
      vectors.push_back({"order-" + std::to_string(order) + "-" + layout,
                         "harmonics of order " + std::to_string(order) + ", " + layout,
                         Outcome::kWhole,
                         {},
                         [order, grid] {
                           FigureOptions o = plain_figure();
                           o.order = order;
                           o.frames = 2;
                           o.coding.layout = grid ? bake::Layout::kGrid : bake::Layout::kLayered;
                           return assemble(figure(o));
                         }});
    }
  }
}

void add_sizes(Vectors& vectors) {
  vectors.push_back({"size-odd-420", "an odd light map in 4:2:0", Outcome::kWhole, {}, [] {
                       FigureOptions o = coded({"h264", 10, Chroma::k420});
                       o.width = 19, o.height = 23;
                       return assemble(figure(o));
                     }});
  vectors.push_back({"size-1x1", "a light map of one texel", Outcome::kWhole, {}, [] {
                       FigureOptions o = plain_figure();
                       o.width = o.height = 1;
                       return assemble(figure(o));
                     }});
  vectors.push_back({"size-32x16", "a light map that is no square", Outcome::kWhole, {}, [] {
                       FigureOptions o = plain_figure();
                       o.width = 32;
                       return assemble(figure(o));
                     }});
}

void add_order_of_packets(Vectors& vectors) {
  vectors.push_back(
      {"packets-b-frames", "packets in decoding order, pts not rising", Outcome::kWhole, {}, [] {
         FigureOptions o = coded({"h264", 10, Chroma::kLuma});
         o.frames = 12;
         o.coding.segment_frames = 8;
         return assemble(figure(o));
       }});
  vectors.push_back({"packets-b-frames-hevc", "likewise in HEVC", Outcome::kWhole, {}, [] {
                       FigureOptions o = coded({"hevc", 10, Chroma::kLuma});
                       o.frames = 10;
                       o.coding.segment_frames = 10;
                       return assemble(figure(o));
                     }});
}

}  // namespace

void add_codings(Vectors& vectors) {
  add_codecs(vectors);
  add_exponents(vectors);
  add_orders(vectors);
  add_principal(vectors);
  add_sizes(vectors);
  add_order_of_packets(vectors);
}

}  // namespace relit::conformance
