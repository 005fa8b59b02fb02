// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of benchmarks/report.h and benchmarks/arguments.h take for granted.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace prescene::benchmarks::given_benchmarks_report::arguments_h {
extern const int count;
extern const char* const* const words;
}  // namespace prescene::benchmarks::given_benchmarks_report::arguments_h
