// SPDX-License-Identifier: MIT
#pragma once
#include <memory>

#include "container/base/result.hpp"
namespace relit::player {
class WorkerPool {
 public:
  static Result<std::shared_ptr<WorkerPool>> create(int n) {
    auto p = std::make_shared<WorkerPool>();
    p->n = n;
    return p;
  }
  int threads() const { return n; }
  int n = 1;
};
}  // namespace relit::player
