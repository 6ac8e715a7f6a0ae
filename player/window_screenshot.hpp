// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>

#include "gles/device.hpp"

namespace relit::player {

/// Draws a picture off the screen, with four samples a pixel, and writes it as relit-0001.png or
/// the next number that is free in the working folder. `draw` draws into the framebuffer that is
/// bound. Returns the name. Errors: kIo, kEnvironment, kLimit, those of `draw`.
Result<std::string> write_screenshot(const gles::Device& device, int width, int height,
                                     const std::function<Status(int width, int height)>& draw);

}  // namespace relit::player
