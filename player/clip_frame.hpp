// SPDX-License-Identifier: MIT
#pragma once
#include "player/clip_reader.hpp"
