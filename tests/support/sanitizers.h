// SPDX-License-Identifier: Apache-2.0
// PRESCENE_SANITIZES_MEMORY is 1 in a build with the address or thread sanitizer, which slow the program down and
// replace its allocator, and 0 otherwise.
#pragma once

#if defined(__has_feature)  // clang
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PRESCENE_SANITIZES_MEMORY 1
#endif
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PRESCENE_SANITIZES_MEMORY 1
#endif

#if !defined(PRESCENE_SANITIZES_MEMORY)
#define PRESCENE_SANITIZES_MEMORY 0
#endif
