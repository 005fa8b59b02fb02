// SPDX-License-Identifier: Apache-2.0
// DDS domains for tests: two processes that ask here never have the same one, however many test runs share the machine.
//
// A domain is taken by an exclusive lock of its file in a folder that all runs share. The lock lasts until this process
// has ended, and with it each program that it started: one that outlives its test goes on using the bus. Scripts take
// domains by the same files: tests/support/take_domain.sh.
#pragma once

#include <filesystem>
#include <optional>

namespace prescene::tests {

/// RTPS uses the 250 ports from 7400 + 250 * domain on. Those of domains up to 100 are below 32768, where the ports
/// begin that Linux gives to whoever asks for any. Domain 0 belongs to programs that were told none, and 97 to 99 to
/// bench_interfaces.
inline constexpr int kFirstTestDomain = 1;
inline constexpr int kLastTestDomain = 96;

/// The domain of this process: the same at each call. Throws std::runtime_error, which fails the test, where none is
/// free.
int own_domain();

/// One that neither this process nor another had at the time of the call; another one at each call. Throws as
/// own_domain().
int another_domain();

/// A domain that nobody has by the files in `folder`, which must exist; nothing where all are taken.
std::optional<int> take_domain(const std::filesystem::path& folder);

}  // namespace prescene::tests
